//! Touch-off: the board's height with a plate, its edges and corners with the tool, step by step.
//!
//! ```text
//!  ┌ ─ ┬ ─ ┬ ─ ┐   a target on the board: the middle is its height, a side one edge, a corner two edges
//!  ├ ─ ┼ ─ ┼ ─ ┤   step ─ Touch ─▶ Ask::Edge or Ask::Probe ─ idle again, nothing refused ─▶ next step
//!  └ ─ ┴ ─ ┴ ─ ┘
//! ```
//!
//! Lengths in µm.

use super::{Effect, Model, link};
use crate::format::typed_in;
use annulus_core::control::State;
use annulus_core::wire::Ask;

const REACH_UM: u32 = 10_000;
/// Search depth for the board from the top of Z, µm.
const DEPTH_UM: u32 = 45_000;
/// Search depth for a controller, which starts just above the board because its end of travel is unknown, µm.
const NEAR_UM: u32 = 10_000;
/// Tool diameters and plate thicknesses that can be typed, mm.
pub const TYPED_MM: (f64, f64) = (0.0, 50.0);

/// Target on the board: -1 left or front, 0 middle, 1 right or back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TouchTarget {
    pub x: i8,
    pub y: i8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TouchedPart {
    /// The board, or a plate on it, from above.
    Height,
    Edge {
        axis: u8,
        up: bool,
    },
}

#[derive(Clone, Debug, PartialEq)]
pub struct TouchOff {
    pub target: TouchTarget,
    /// Number of finished steps.
    pub done: usize,
    /// Tool diameter as typed, mm.
    pub tool: String,
    /// Plate thickness as typed, mm.
    pub plate: String,
    /// A step was requested; true once the machine has moved since.
    waits: Option<bool>,
}

impl Default for TouchOff {
    fn default() -> Self {
        let (tool, plate) = ("1".to_owned(), "0".to_owned());
        Self { target: TouchTarget::default(), done: 0, tool, plate, waits: None }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum TouchOffEvent {
    Target {
        target: TouchTarget,
    },
    Tool {
        text: String,
    },
    Plate {
        text: String,
    },
    /// Do the next step. The machine moves.
    Touch,
}

/// A typed length, µm; `None` if it is not a number or out of range.
fn um(text: &str) -> Option<u32> {
    typed_in(text, TYPED_MM).map(|mm| (mm * 1e3) as u32)
}

impl TouchTarget {
    pub fn parts(self) -> Vec<TouchedPart> {
        let edge = |axis, side: i8| (side != 0).then_some(TouchedPart::Edge { axis, up: side < 0 });
        let edges: Vec<_> = [edge(0, self.x), edge(1, self.y)].into_iter().flatten().collect();
        if edges.is_empty() { vec![TouchedPart::Height] } else { edges }
    }
}

impl TouchOff {
    /// The next step; `None` after the last one.
    pub fn next(&self) -> Option<TouchedPart> {
        self.target.parts().get(self.done).copied()
    }

    /// The request for the next step; `None` if a typed length is invalid. `plans`: the controller plans its
    /// own motion.
    pub fn wish(&self, plans: bool) -> Option<Ask> {
        Some(match self.next()? {
            TouchedPart::Height => {
                let depth_um = if plans { NEAR_UM } else { DEPTH_UM };
                Ask::Probe { depth_um, plate_um: um(&self.plate)? }
            }
            TouchedPart::Edge { axis, up } => {
                Ask::Edge { axis, up, reach_um: REACH_UM, tool_um: um(&self.tool)? }
            }
        })
    }
}

pub(super) fn update(model: &mut Model, event: TouchOffEvent) -> Vec<Effect> {
    let touch = &mut model.touch_off;
    match event {
        TouchOffEvent::Target { target } => (touch.target, touch.done, touch.waits) = (target, 0, None),
        TouchOffEvent::Tool { text } => touch.tool = text,
        TouchOffEvent::Plate { text } => touch.plate = text,
        TouchOffEvent::Touch => {
            let Some(wish) = touch.wish(model.link.controller.plans()) else { return Vec::new() };
            touch.waits = Some(false);
            model.link.refused = None;
            return link::ask(model, &wish);
        }
    }
    Vec::new()
}

/// A step is finished once the machine has moved and is idle again without a refusal.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let Some(moved) = model.touch_off.waits else { return Vec::new() };
    let state = model.link.status.as_ref().map(|status| status.state);
    model.touch_off.waits = match state {
        _ if model.link.refused.is_some() => None,
        None | Some(State::Alarm | State::NotHomed) => None,
        Some(State::Ready) if moved => {
            model.touch_off.done += 1;
            None
        }
        Some(State::Ready) => Some(false),
        Some(_) => Some(true),
    };
    Vec::new()
}
