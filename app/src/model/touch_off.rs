//! Touching off: the height of the board by a plate, its edges and corners by the tool, one step after the other.
//!
//! ```text
//!  ┌ ─ ┬ ─ ┬ ─ ┐   a place of the board: its middle is its height, a side is one edge, a corner two
//!  ├ ─ ┼ ─ ┼ ─ ┤   step ─ Touch ─▶ Ask::Edge or Ask::Probe ─ at rest again, nothing refused ─▶ the next step
//!  └ ─ ┴ ─ ┴ ─ ┘
//! ```
//!
//! Comes in: wishes, how the machine stands. Goes out: the asks. Lengths in µm. Does not know how anything is touched.

use super::{Effect, Model, link};
use annulus_core::control::State;
use annulus_core::wire::Ask;

/// How far the tip looks for an edge, and for the board: from all the way up, by a controller that knows no end from just above, µm.
const REACH_UM: u32 = 10_000;
const DEPTH_UM: u32 = 45_000;
const NEAR_UM: u32 = 10_000;
/// The widest tool and the thickest plate that can be typed, mm.
const MOST_MM: f64 = 50.0;

/// Which place of the board: -1 left and front, 0 the middle, 1 right and back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TouchTarget {
    /// Along X.
    pub x: i8,
    /// Along Y.
    pub y: i8,
}

/// One thing to touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TouchedPart {
    /// The board, or a plate on it, from above.
    Height,
    /// An edge along an axis.
    Edge {
        /// 0 X, 1 Y.
        axis: u8,
        /// The tip goes upwards in its numbers.
        up: bool,
    },
}

/// Touching off as it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchOff {
    /// What is to be touched.
    pub target: TouchTarget,
    /// Steps of it that are done.
    pub done: usize,
    /// Diameter of the tool, as typed, mm.
    pub tool: String,
    /// Thickness of the plate, as typed, mm.
    pub plate: String,
    /// A step was asked for; whether anything moved since.
    waits: Option<bool>,
}

impl Default for TouchOff {
    fn default() -> Self {
        let (tool, plate) = ("1".to_owned(), "0".to_owned());
        Self { target: TouchTarget::default(), done: 0, tool, plate, waits: None }
    }
}

/// What happens about it.
#[derive(Clone, Debug, PartialEq)]
pub enum TouchOffEvent {
    /// This is to be touched.
    Target {
        /// Which place of the board.
        target: TouchTarget,
    },
    /// The tool's diameter is typed.
    Tool {
        /// As typed.
        text: String,
    },
    /// The plate's thickness is typed.
    Plate {
        /// As typed.
        text: String,
    },
    /// The step that is next.
    Touch,
}

/// A length as typed, µm; none where it is none.
fn um(text: &str) -> Option<u32> {
    let mm = text.trim().replace(',', ".").parse::<f64>().ok()?;
    (0.0..=MOST_MM).contains(&mm).then_some((mm * 1e3) as u32)
}

impl TouchTarget {
    /// What there is to touch, in order.
    pub fn parts(self) -> Vec<TouchedPart> {
        let edge = |axis, side: i8| (side != 0).then_some(TouchedPart::Edge { axis, up: side < 0 });
        let edges: Vec<_> = [edge(0, self.x), edge(1, self.y)].into_iter().flatten().collect();
        if edges.is_empty() { vec![TouchedPart::Height] } else { edges }
    }
}

impl TouchOff {
    /// What is touched next; none once all is.
    pub fn next(&self) -> Option<TouchedPart> {
        self.target.parts().get(self.done).copied()
    }

    /// What is asked of the machine for it, or of a controller that `plans` its own motion; none where what was typed is no length.
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

/// Takes one event in.
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

/// A step is done once the machine rests again and nothing was refused.
pub(super) fn follow(model: &mut Model) {
    let Some(moved) = model.touch_off.waits else { return };
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
}
