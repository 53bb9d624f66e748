//! Moving by hand: a short press is one step, a long one goes on until it is let go. By mouse, finger and armed keys.
//!
//! ```text
//! down ─┬─ up within 0.3 s ─▶ one step
//!       └─ 0.3 s ─▶ moves ─▶ up, off the button, a second finger, lost focus, hidden page: comes to rest
//! ```
//!
//! Comes in: presses of pointers and keys. Goes out: steps and holds; only what the machine allows when they begin. No diagonals.

use super::{Link, LinkPhase, jog};
use crate::health::Freshness;
use crate::model::{Effect, Event, Model};
use annulus_core::control::State;

/// Steps of the jog pad, in µm; they stay millimetres whatever unit is shown.
pub const STEPS_UM: [i32; 4] = [10, 100, 1_000, 10_000];
/// A press so long is no click, in ms.
const LONG_MS: u32 = 300;
/// Armed keys that nobody uses are disarmed after this, in ms.
const IDLE_MS: u32 = 30_000;

/// What a press asks for: the axis (0 X, 1 Y, 2 Z), and whether upwards.
pub type JogDirection = (u8, bool);

/// A press that was not let go yet.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Press {
    number: u32,
    way: JogDirection,
    distance_um: i32,
    /// Which pointer; none for a key.
    pointer: Option<i32>,
    /// It was so long that the machine moves.
    moves: bool,
}

/// What the person chose, and holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// How far a step goes, in µm.
    pub step_um: i32,
    /// Keys move the machine while the focus is in the pad.
    pub armed: bool,
    press: Option<Press>,
    /// Counts presses and uses of the keys; a time that belongs to an older count is over.
    count: u32,
    used: u32,
}

impl Default for Hand {
    fn default() -> Self {
        Self { step_um: 1_000, armed: false, press: None, count: 0, used: 0 }
    }
}

/// What happens to the pad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HandEvent {
    /// The pad is there, as it is first.
    Shown,
    /// The pad, the window or the focus is gone: whatever is pressed ends.
    Gone,
    /// A step goes so far.
    StepUm {
        /// In µm.
        step_um: i32,
    },
    /// A step goes less far, or further.
    Finer {
        /// Less far.
        finer: bool,
    },
    /// A pointer went down on a button; where one is down already, that is the end of it.
    Down {
        /// The button.
        way: JogDirection,
        /// The pointer.
        pointer: i32,
    },
    /// A pointer went down somewhere.
    OtherDown {
        /// The pointer.
        pointer: i32,
    },
    /// A pointer left its button, or was let go.
    Up {
        /// The pointer.
        pointer: i32,
        /// On the button, as a click is.
        clicked: bool,
    },
    /// A button was pressed by a keyboard or a screen reader.
    Clicked {
        /// The button.
        way: JogDirection,
    },
    /// An armed key went down.
    KeyDown {
        /// Where it moves to; none ends what is held.
        way: Option<JogDirection>,
        /// Ten steps at once.
        ten: bool,
        /// It is held down, and told again.
        repeat: bool,
    },
    /// A key was let go.
    KeyUp {
        /// Where it moves to.
        way: Option<JogDirection>,
        /// It is Shift.
        shift: bool,
    },
    /// A press was long.
    Long {
        /// Which.
        number: u32,
    },
    /// The keys are to be armed, or not.
    Arm {
        /// Armed; none for the other of the two.
        on: Option<bool>,
    },
    /// The focus left the pad.
    FocusLeft,
    /// Nobody used the keys for a while.
    Idle {
        /// Since this use.
        used: u32,
    },
}

impl Hand {
    /// Where the key that is held moves to.
    pub fn key_held(&self) -> Option<JogDirection> {
        self.press.filter(|press| press.pointer.is_none()).map(|press| press.way)
    }
}

fn ready(link: &Link) -> bool {
    link.phase == LinkPhase::Open
        && link.control.yours
        && link.freshness == Freshness::Fresh
        && (link.state() == Some(State::Ready) || link.controller.touches_off(link.state()))
}

/// Takes one event in.
pub(super) fn update(model: &mut Model, event: HandEvent) -> Vec<Effect> {
    let hand = &mut model.link.hand;
    match event {
        HandEvent::Shown => {
            let effects = end(model, false);
            let hand = &mut model.link.hand;
            *hand = Hand { count: hand.count, used: hand.used, ..Hand::default() };
            effects
        }
        HandEvent::Gone => gone(model),
        HandEvent::StepUm { step_um } => {
            hand.step_um = step_um;
            Vec::new()
        }
        HandEvent::Finer { finer } => {
            let here = STEPS_UM.iter().position(|um| *um == hand.step_um).unwrap_or(0);
            let next = if finer { here.saturating_sub(1) } else { (here + 1).min(STEPS_UM.len() - 1) };
            hand.step_um = STEPS_UM[next];
            Vec::new()
        }
        HandEvent::Down { way, pointer } if hand.press.is_none() => {
            begin(model, way, model.link.hand.step_um, Some(pointer))
        }
        HandEvent::Down { .. } => end(model, false),
        HandEvent::OtherDown { pointer } => {
            let other = hand.press.and_then(|press| press.pointer).is_some_and(|own| own != pointer);
            if other { end(model, false) } else { Vec::new() }
        }
        HandEvent::Up { pointer, clicked } => {
            let own = hand.press.is_some_and(|press| press.pointer == Some(pointer));
            if own { end(model, clicked) } else { Vec::new() }
        }
        HandEvent::Clicked { way } => step(model, way, model.link.hand.step_um),
        HandEvent::KeyDown { way, ten, repeat } => key_down(model, way, ten, repeat),
        HandEvent::KeyUp { way, shift } => {
            let own = hand.key_held().is_some() && hand.key_held() == way;
            if own || shift { end(model, own) } else { Vec::new() }
        }
        HandEvent::Long { number } => long(model, number),
        HandEvent::Arm { on } => arm(model, on),
        HandEvent::FocusLeft => disarm(model),
        HandEvent::Idle { used } if used == hand.used => disarm(model),
        HandEvent::Idle { .. } => Vec::new(),
    }
}

fn wake(after_ms: u32, event: HandEvent) -> Effect {
    Effect::Wake { after_ms, event: Box::new(Event::Link(super::LinkEvent::Hand(event))) }
}

fn begin(model: &mut Model, way: JogDirection, distance_um: i32, pointer: Option<i32>) -> Vec<Effect> {
    let mut effects = end(model, false);
    if !ready(&model.link) {
        return effects;
    }
    let hand = &mut model.link.hand;
    hand.count += 1;
    let number = hand.count;
    hand.press = Some(Press { number, way, distance_um, pointer, moves: false });
    effects.push(wake(LONG_MS, HandEvent::Long { number }));
    effects
}

/// The press was long: it moves until it ends.
fn long(model: &mut Model, number: u32) -> Vec<Effect> {
    let Some(press) = model.link.hand.press.as_mut().filter(|press| press.number == number) else {
        return Vec::new();
    };
    press.moves = true;
    let (axis, up) = press.way;
    jog::hold(model, axis, up)
}

/// The press is over. A short one is a step where it was let go as a click is.
fn end(model: &mut Model, clicked: bool) -> Vec<Effect> {
    match model.link.hand.press.take() {
        Some(press) if press.moves => jog::let_go(model),
        Some(press) if clicked => step(model, press.way, press.distance_um),
        _ => Vec::new(),
    }
}

fn step(model: &mut Model, (axis, up): JogDirection, distance_um: i32) -> Vec<Effect> {
    if !ready(&model.link) {
        return Vec::new();
    }
    jog::jog(model, axis, if up { distance_um } else { -distance_um })
}

fn gone(model: &mut Model) -> Vec<Effect> {
    let effects = end(model, false);
    model.link.hand.armed = false;
    effects
}

fn arm(model: &mut Model, on: Option<bool>) -> Vec<Effect> {
    if !on.unwrap_or(!model.link.hand.armed) {
        return disarm(model);
    }
    model.link.hand.armed = true;
    vec![use_keys(model)]
}

fn disarm(model: &mut Model) -> Vec<Effect> {
    let by_key = model.link.hand.key_held().is_some();
    model.link.hand.armed = false;
    if by_key { end(model, false) } else { Vec::new() }
}

/// The keys are in use: the time until they are disarmed begins anew.
fn use_keys(model: &mut Model) -> Effect {
    model.link.hand.used += 1;
    wake(IDLE_MS, HandEvent::Idle { used: model.link.hand.used })
}

fn key_down(model: &mut Model, way: Option<JogDirection>, ten: bool, repeat: bool) -> Vec<Effect> {
    if !model.link.hand.armed {
        return Vec::new();
    }
    // Another key, or Shift while one is held: what moves comes to rest.
    let Some(way) = way else { return end(model, false) };
    let mut effects = vec![use_keys(model)];
    if !repeat {
        let distance_um = model.link.hand.step_um * if ten { 10 } else { 1 };
        effects.extend(begin(model, way, distance_um, None));
    }
    effects
}
