//! The board in space as a part of the picture: its field, where one looks from, the tool.
//!
//! Goes out: what is to be drawn. Does not know how it is drawn.

use super::orbit::Orbit;
use super::relief::{Cutting, ReliefField};

/// What of the board in space is kept while the picture stands.
#[derive(Default)]
pub(super) struct Solid {
    pub(super) field: Option<ReliefField>,
    pub(super) orbit: Orbit,
    pub(super) tool: Option<Cutting>,
    /// The device takes a board so large.
    pub(super) fits: bool,
    /// It is looked at, and not the flat picture.
    pub(super) shown: bool,
    /// All of it is in sight, also in a window of another size, until somebody moves it.
    pub(super) fitted: bool,
}

impl Solid {
    /// What is to be drawn instead of the flat picture.
    pub(super) fn seen(&self) -> Option<(&ReliefField, &Orbit, Option<Cutting>)> {
        let field = self.field.as_ref().filter(|_| self.shown && self.fits)?;
        Some((field, &self.orbit, self.tool))
    }

    /// All of it into a window of `viewport_px`, seen from where it is seen, unless somebody has moved it.
    pub(super) fn fit(&mut self, viewport_px: [f64; 2]) {
        let Some(field) = self.field.as_ref().filter(|_| self.fitted) else { return };
        self.orbit.fit(field.relief.bounds_mm(), viewport_px);
    }

    /// In an attribute of the canvas: whether it is on show, tilt and turn.
    pub(super) fn describe(&self) -> String {
        let orbit = &self.orbit;
        match self.seen() {
            Some(_) => format!("{:.0} {:.0} {:.1}", orbit.tilt_deg, orbit.turn_deg, orbit.across_mm),
            None => String::new(),
        }
    }
}
