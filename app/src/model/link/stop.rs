//! STOP: always the first effect of its event; warns if it is not confirmed. Escape pauses first, then stops.

use super::{Link, LinkEvent, LinkPhase, ask};
use crate::health::{STOP_PATIENCE_MS, StopWay};
use crate::model::{Effect, Event, Model};
use annulus_core::control::State;
use annulus_core::wire::Ask;

/// A job that ends within this time after STOP counts as stopped by it.
const BY_THIS_MS: f64 = 60_000.0;
const ESCAPE_TWICE_MS: f64 = 1500.0;

pub(super) fn pressed_here(link: &Link, now_ms: f64) -> bool {
    link.pressed_ms.is_some_and(|pressed_ms| now_ms - pressed_ms <= BY_THIS_MS)
}

/// Stops the machine. Without a link, STOP is stored and sent first on the next one. If another tab owns the
/// machine, that tab is asked to stop it.
pub(super) fn pressed(model: &mut Model) -> Vec<Effect> {
    model.link.pressed_ms = Some(model.clock.page_ms);
    if model.link.phase != LinkPhase::Open {
        model.link.stop = StopWay::Latched;
        model.link.stop_unconfirmed = true;
        return Vec::from_iter(model.frame.alone.then_some(Effect::StopBeside { heard: false }));
    }
    send(model)
}

/// STOP was pressed in another tab of this site: if this tab owns the machine, it stops it and confirms.
pub(super) fn beside(model: &mut Model) -> Vec<Effect> {
    if model.link.phase != LinkPhase::Open {
        return Vec::new();
    }
    let mut effects = send(model);
    effects.push(Effect::StopBeside { heard: true });
    effects
}

/// The tab that owns the machine stops it: discard the stored STOP.
pub(super) fn heard_beside(link: &mut Link) {
    if link.stop == StopWay::Latched {
        heard(link);
    }
}

fn send(model: &mut Model) -> Vec<Effect> {
    let at_ms = model.clock.page_ms;
    model.link.stop = StopWay::Sent(at_ms);
    let mut effects = ask(model, &Ask::Stop);
    // The pong to this ping proves that the bridge has read STOP, which was sent before it.
    effects.extend(ask(model, &Ask::Ping { stamp: at_ms }));
    let event = Box::new(Event::Link(LinkEvent::StopLooked));
    effects.push(Effect::Wake { after_ms: STOP_PATIENCE_MS as u32 + 5, event });
    effects
}

pub(super) fn look(model: &mut Model) {
    if model.link.stop.overdue(model.clock.page_ms) {
        model.link.stop_unconfirmed = true;
    }
}

/// The link is open again: sends a stored STOP.
pub(super) fn opened(model: &mut Model) -> Vec<Effect> {
    if model.link.stop == StopWay::Latched { send(model) } else { Vec::new() }
}

/// The link broke: stores a STOP that was not confirmed.
pub(super) fn broke(link: &mut Link) {
    if matches!(link.stop, StopWay::Sent(_)) {
        link.stop = StopWay::Latched;
        link.stop_unconfirmed = true;
    }
}

pub(super) fn pong(link: &mut Link, stamp_ms: f64) {
    if link.stop.heard_by_pong(stamp_ms) {
        heard(link);
    }
}

pub(super) fn status(link: &mut Link, state: State) {
    if link.stop.heard_by(state) {
        heard(link);
    }
}

fn heard(link: &mut Link) {
    link.stop = StopWay::Idle;
    link.stop_unconfirmed = false;
}

/// Pauses a job that this page controls; never resumes one.
pub(super) fn pause(model: &mut Model) -> Vec<Effect> {
    if model.link.control.yours && model.link.state() == Some(State::Running) {
        ask(model, &Ask::Pause)
    } else {
        Vec::new()
    }
}

/// The first Escape pauses, the second stops. Overlays handle Escape before this.
pub(super) fn escape(model: &mut Model) -> Vec<Effect> {
    if !model.link.busy() || !model.link.control.yours {
        return Vec::new();
    }
    let now_ms = model.clock.page_ms;
    let before_ms = model.link.escaped_ms.replace(now_ms);
    // While the machine still decelerates for the first Escape, a second one stops at any time.
    let is_pausing = before_ms.is_some() && model.link.state() == Some(State::Pausing);
    if is_pausing || before_ms.is_some_and(|before_ms| now_ms - before_ms <= ESCAPE_TWICE_MS) {
        pressed(model)
    } else {
        pause(model)
    }
}
