//! Moving by hand: the bridge goes only as long as this page says again and again that it is still there.
//!
//! ```text
//! step    Jog ─▶ JogOn, every 50 ms ─▶ … ─▶ the machine is at rest, or this page is hidden, stuck or gone: no more
//! hold    Jog as far as it goes ─▶ JogOn, every 50 ms ─▶ … ─▶ let go: no more, and the machine comes to rest
//! ```
//!
//! Comes in: one wish of a distance, or of a direction until it is let go. Goes out: that wish, and its renewals. Knows no
//! buttons.

use super::{LinkPhase, ask};
use crate::model::{Effect, Model};
use annulus_core::control::State;
use annulus_core::wire::Ask;

/// So long after the wish the machine may still be told to be at rest from before.
const BEGINS_MS: f64 = 500.0;
/// Further than any machine goes, in µm: the bridge ends it at the travel's end.
const FAR_UM: i32 = 2_000_000;

/// A move by hand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Jog {
    /// It is renewed.
    renews: bool,
    /// When it was asked for.
    asked_ms: f64,
}

/// Moves `axis` by `distance_um`.
pub(super) fn jog(model: &mut Model, axis: u8, distance_um: i32) -> Vec<Effect> {
    let mut effects = ask(model, &Ask::Jog { axis, distance_um });
    model.link.jog.asked_ms = model.clock.page_ms;
    if !std::mem::replace(&mut model.link.jog.renews, true) {
        effects.push(Effect::Renew { on: true });
    }
    effects
}

/// Moves `axis` upwards or downwards until it is let go.
pub(super) fn hold(model: &mut Model, axis: u8, up: bool) -> Vec<Effect> {
    jog(model, axis, if up { FAR_UM } else { -FAR_UM })
}

/// Nothing is renewed any more: what moves by hand comes to rest.
pub(super) fn let_go(model: &mut Model) -> Vec<Effect> {
    let renews = std::mem::take(&mut model.link.jog.renews);
    renews.then_some(Effect::Renew { on: false }).into_iter().collect()
}

/// Says that the page is still there, while something moves by hand.
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
