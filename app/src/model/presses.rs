//! Guards every control that moves or starts something. A press does nothing if the control appeared, moved
//! or changed its action less than a second ago.
//!
//! STOP, Pause, Escape and the release of a jog button are not guarded.

use super::frame::{toast, withdraw};
use super::{Effect, Model};
use crate::said::{Text, key};

/// A control must have been unchanged for this long before a press on it counts, in ms.
pub const STEADY_MS: f64 = 1000.0;
/// Edges within this distance count as unchanged, in px.
const SAME_EDGE_PX: i32 = 2;
const SAME_POINT_PX: f64 = 16.0;

#[derive(Clone, Debug, PartialEq)]
pub struct MovingControl {
    /// Number of its element; a new element has a new number.
    pub id: u32,
    pub act: String,
    /// Left, top, right and bottom edge in the page, without scrolling, in px.
    pub edges_px: [i32; 4],
    pub usable: bool,
}

impl MovingControl {
    fn is_same(&self, other: &Self) -> bool {
        let near = |(a, b): (&i32, &i32)| a.abs_diff(*b) <= SAME_EDGE_PX.unsigned_abs();
        (self.id, &self.act, self.usable) == (other.id, &other.act, other.usable)
            && self.edges_px.iter().zip(&other.edges_px).all(near)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum PressEvent {
    /// All guarded controls on screen.
    Shown {
        controls: Vec<MovingControl>,
    },
    /// A pointer or a key presses a control, or a pointer presses anything else.
    Pressed {
        /// The guarded control under the press, as it is at this moment.
        control: Option<MovingControl>,
        /// Position of the pointer in the window, px; `None` for a key.
        at_px: Option<[f64; 2]>,
    },
    Clicked {
        control: MovingControl,
    },
}

#[derive(Clone, Debug, PartialEq)]
struct Press {
    ms: f64,
    at_px: [f64; 2],
    control: Option<(u32, String)>,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Presses {
    /// Each control since its last change, and the time of that change, page ms.
    steady: Vec<(MovingControl, f64)>,
    before: Option<Press>,
    /// The last press or click came too soon.
    pub refused: bool,
    /// Numbers of the usable controls that changed less than a second ago.
    pub fresh: Vec<u32>,
}

impl Presses {
    /// True if a control with this action changed less than a second ago.
    pub(super) fn is_fresh(&self, act: &str, now_ms: f64) -> bool {
        self.steady.iter().any(|(control, since_ms)| control.act == act && now_ms - since_ms < STEADY_MS)
    }

    fn show(&mut self, controls: Vec<MovingControl>, now_ms: f64) {
        let since = |control: MovingControl| {
            let known = self.steady.iter().find(|(known, _)| known.is_same(&control));
            known.cloned().unwrap_or((control, now_ms))
        };
        self.steady = controls.into_iter().map(since).collect();
        let is_fresh = |(control, since_ms): &(MovingControl, f64)| {
            (now_ms - since_ms < STEADY_MS && control.usable).then_some(control.id)
        };
        self.fresh = self.steady.iter().filter_map(is_fresh).collect();
    }

    /// True if `control` has been unchanged long enough. An unknown control is new.
    fn is_steady(&self, control: &MovingControl, now_ms: f64) -> bool {
        let known = self.steady.iter().find(|(known, _)| known.is_same(control));
        known.is_some_and(|(_, since_ms)| now_ms - since_ms >= STEADY_MS)
    }

    /// True if the pointer pressed another control at this point just before: the second half of a double
    /// click.
    fn follows_another(&self, press: &Press) -> bool {
        self.before.as_ref().is_some_and(|before| {
            let apart = |axis: usize| (before.at_px[axis] - press.at_px[axis]).abs() <= SAME_POINT_PX;
            press.ms - before.ms < STEADY_MS && apart(0) && apart(1) && before.control != press.control
        })
    }

    fn press(&mut self, control: Option<MovingControl>, at_px: Option<[f64; 2]>, now_ms: f64) {
        let of = control.as_ref().map(|control| (control.id, control.act.clone()));
        let press = at_px.map(|at_px| Press { ms: now_ms, at_px, control: of });
        let too_soon = |control: &MovingControl| {
            !self.is_steady(control, now_ms)
                || press.as_ref().is_some_and(|press| self.follows_another(press))
        };
        self.refused = control.as_ref().is_some_and(too_soon);
        // A refused press is not remembered: the next one is again compared with the press before it.
        if press.is_some() && !self.refused {
            self.before = press;
        }
    }
}

pub(super) fn update(model: &mut Model, event: PressEvent) -> Vec<Effect> {
    let now_ms = model.clock.page_ms;
    let presses = &mut model.presses;
    let is_guarded = match event {
        PressEvent::Shown { controls } => {
            presses.show(controls, now_ms);
            return Vec::new();
        }
        PressEvent::Pressed { control, at_px } => {
            let is_guarded = control.is_some();
            presses.press(control, at_px, now_ms);
            is_guarded
        }
        PressEvent::Clicked { control } => {
            presses.refused |= !presses.is_steady(&control, now_ms);
            true
        }
    };
    let text = Text::of(key!("page.press.too_soon"));
    if presses.refused {
        return vec![toast(model, text, None)];
    }
    // A press that acts removes the notification about an ignored press.
    if is_guarded {
        withdraw(&mut model.frame, &text);
    }
    Vec::new()
}
