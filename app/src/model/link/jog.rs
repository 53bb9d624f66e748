//! Jogging with a keep-alive: the machine moves only while this page keeps sending `JogOn`.
//!
//! ```text
//! step    Jog ─▶ JogOn, every 50 ms ─▶ … ─▶ machine stopped, or page hidden, stuck or gone: no more
//! hold    Jog to the end of travel ─▶ JogOn, every 50 ms ─▶ … ─▶ released: no more, and the machine stops
//! ```

use super::{LinkPhase, ask};
use crate::model::{Effect, Model};
use annulus_core::control::State;
use annulus_core::wire::Ask;

/// After a jog request, the status may still show the state from before for this long, in ms.
const BEGINS_MS: f64 = 500.0;
/// Longer than any machine's travel, in µm: the bridge limits the move to the travel.
const FAR_UM: i32 = 2_000_000;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Jog {
    renews: bool,
    asked_ms: f64,
}

pub(super) fn jog(model: &mut Model, axis: u8, distance_um: i32) -> Vec<Effect> {
    // Only moves of X and Y can drag a tool through the board.
    let anyway = axis < 2 && model.link.hand.anyway;
    let mut effects = ask(model, &Ask::Jog { axis, distance_um, anyway });
    model.link.jog.asked_ms = model.clock.page_ms;
    if !std::mem::replace(&mut model.link.jog.renews, true) {
        effects.push(Effect::Renew { on: true });
    }
    effects
}

pub(super) fn hold(model: &mut Model, axis: u8, up: bool) -> Vec<Effect> {
    jog(model, axis, if up { FAR_UM } else { -FAR_UM })
}

pub(super) fn let_go(model: &mut Model) -> Vec<Effect> {
    let renews = std::mem::take(&mut model.link.jog.renews);
    renews.then_some(Effect::Renew { on: false }).into_iter().collect()
}

/// Sends the keep-alive while the machine jogs.
pub(super) fn renew(model: &mut Model, hidden: bool) -> Vec<Effect> {
    let link = &model.link;
    if !link.jog.renews {
        return Vec::new();
    }
    let jogs = link.state() == Some(State::Jogging);
    let begins = model.clock.page_ms - link.jog.asked_ms < BEGINS_MS;
    if link.phase == LinkPhase::Open && !hidden && (jogs || begins) {
        return ask(model, &Ask::JogOn);
    }
    let_go(model)
}
