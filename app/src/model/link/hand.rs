//! Jogging by mouse, finger and armed keys: a short press is one step, a long one moves until it is released.
//!
//! ```text
//! down ─┬─ up within 0.3 s ─▶ one step
//!       └─ 0.3 s ─▶ moves ─▶ up, off the button, a second finger, lost focus, hidden page: stops
//! ```
//!
//! One axis at a time: no diagonal moves.

use super::{Link, LinkPhase, jog};
use crate::health::Freshness;
use crate::model::{Effect, Event, Model};
use annulus_core::control::State;

/// Steps of the jog pad, in µm; millimetres in every display unit.
pub const STEPS_UM: [i32; 4] = [10, 100, 1_000, 10_000];
pub const JOG: &str = "jog";
/// From this duration a press is long and no longer a click, in ms.
const LONG_MS: u32 = 300;
/// A press of this duration allows jogging X and Y although the tool may be in the board, in ms.
pub const INSIST_MS: u32 = 1_500;
/// Armed keys are disarmed after this time without use, in ms.
const IDLE_MS: u32 = 30_000;

/// The axis (0 X, 1 Y, 2 Z), and whether in its positive direction.
pub type JogDirection = (u8, bool);

#[derive(Clone, Copy, Debug, PartialEq)]
struct Press {
    number: u32,
    way: JogDirection,
    distance_um: i32,
    /// `None` for a key.
    pointer: Option<i32>,
    /// The press was long: the machine moves.
    moves: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// Distance of a step, in µm.
    pub step_um: i32,
    /// Keys move the machine while the pad has the focus.
    pub armed: bool,
    /// X and Y jog although the tool may be in the board.
    pub anyway: bool,
    press: Option<Press>,
    /// Count presses and uses of the keys; a timer of an older count is outdated.
    count: u32,
    used: u32,
    /// Counts the presses that allow X and Y; a timer of an older count is outdated.
    insists: u32,
}

impl Default for Hand {
    fn default() -> Self {
        Self { step_um: 1_000, armed: false, anyway: false, press: None, count: 0, used: 0, insists: 0 }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HandEvent {
    /// The pad appeared: reset it.
    Shown,
    /// The pad, the window or the focus is gone: every press ends.
    Gone,
    StepUm {
        step_um: i32,
    },
    /// Select the next smaller or larger step.
    Finer {
        finer: bool,
    },
    /// A pointer went down on a button; if another press is active, both end.
    Down {
        way: JogDirection,
        pointer: i32,
    },
    OtherDown {
        pointer: i32,
    },
    Up {
        pointer: i32,
        /// Released on the button, as in a click.
        clicked: bool,
    },
    /// A keyboard or a screen reader activated a button.
    Clicked {
        way: JogDirection,
    },
    KeyDown {
        /// `None` ends the press.
        way: Option<JogDirection>,
        /// Ten steps in one move.
        ten: bool,
        repeat: bool,
    },
    KeyUp {
        way: Option<JogDirection>,
        shift: bool,
    },
    Long {
        number: u32,
    },
    /// The button that allows X and Y went down.
    InsistDown,
    InsistUp,
    Insisted {
        /// Value of `insists` at the start of the press.
        number: u32,
    },
    /// Raise Z until the tool is out of the board.
    LiftFirst,
    Arm {
        on: Option<bool>,
    },
    FocusLeft,
    /// The keys were not used for a while.
    Idle {
        used: u32,
    },
}

impl Hand {
    pub fn key_held(&self) -> Option<JogDirection> {
        self.press.filter(|press| press.pointer.is_none()).map(|press| press.way)
    }
}

/// True if a machine can jog in `state`. Before homing our own drills jog slowly; a GRBL controller is
/// locked.
fn jogs_in(state: Option<State>, plans: bool) -> bool {
    state == Some(State::Ready) || state == Some(State::NotHomed) && !plans
}

pub fn may_jog(link: &Link) -> bool {
    jogs_in(link.state(), link.controller.plans()) || link.touches_off()
}

fn ready(link: &Link) -> bool {
    link.phase == LinkPhase::Open && link.control.yours && link.freshness == Freshness::Fresh && may_jog(link)
}

pub(super) fn update(model: &mut Model, event: HandEvent) -> Vec<Effect> {
    let hand = &mut model.link.hand;
    match event {
        HandEvent::Shown => {
            let effects = end(model, false);
            let hand = &mut model.link.hand;
            // The counters stay, so that timers from before remain outdated.
            *hand = Hand { count: hand.count, used: hand.used, insists: hand.insists, ..Hand::default() };
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
        HandEvent::InsistDown => {
            hand.insists += 1;
            vec![wake(INSIST_MS, HandEvent::Insisted { number: hand.insists })]
        }
        HandEvent::InsistUp => {
            hand.insists += 1;
            Vec::new()
        }
        HandEvent::Insisted { number } => {
            hand.anyway |= number == hand.insists;
            Vec::new()
        }
        HandEvent::LiftFirst => lift_first(model),
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

/// The press is long: move until it ends.
fn long(model: &mut Model, number: u32) -> Vec<Effect> {
    let Some(press) = model.link.hand.press.as_mut().filter(|press| press.number == number) else {
        return Vec::new();
    };
    press.moves = true;
    let (axis, up) = press.way;
    jog::hold(model, axis, up)
}

/// Ends the press. A short one makes a step if it was released as a click.
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

/// Raises Z by the distance that the machine reports.
fn lift_first(model: &mut Model) -> Vec<Effect> {
    let lift_mm = model.link.status.as_ref().and_then(|status| status.lift_first_mm);
    let Some(lift_mm) = lift_mm.filter(|_| ready(&model.link)) else { return Vec::new() };
    jog::jog(model, 2, libm::ceil(lift_mm * 1e3) as i32)
}

/// Once the tool is out of the board, the next jog of X and Y in the board needs a new confirmation.
pub(super) fn follow(link: &mut Link) {
    let is_low = link.status.as_ref().is_some_and(|status| status.lift_first_mm.is_some());
    link.hand.anyway &= is_low;
}

fn gone(model: &mut Model) -> Vec<Effect> {
    let effects = end(model, false);
    model.link.hand.armed = false;
    (model.link.hand.anyway, model.link.hand.insists) = (false, model.link.hand.insists + 1);
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

fn use_keys(model: &mut Model) -> Effect {
    model.link.hand.used += 1;
    wake(IDLE_MS, HandEvent::Idle { used: model.link.hand.used })
}

fn key_down(model: &mut Model, way: Option<JogDirection>, ten: bool, repeat: bool) -> Vec<Effect> {
    if !model.link.hand.armed {
        return Vec::new();
    }
    // Another key, or Shift during a press, stops the move.
    let Some(way) = way else { return end(model, false) };
    let mut effects = vec![use_keys(model)];
    // The guard of presses also covers keys: no move while the pad has just appeared or moved.
    if !repeat && !model.presses.is_fresh(JOG, model.clock.page_ms) {
        let distance_um = model.link.hand.step_um * if ten { 10 } else { 1 };
        effects.extend(begin(model, way, distance_um, None));
    }
    effects
}
