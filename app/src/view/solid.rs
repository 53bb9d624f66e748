//! The board in space as a part of the picture: its field, where one looks from, the tool.
//!
//! Goes out: what is to be drawn. Does not know how it is drawn.

use super::orbit::Orbit;
use super::relief::{Cutting, Field};

/// What of the board in space is kept while the picture stands.
#[derive(Default)]
pub(super) struct Solid {
    pub(super) field: Option<Field>,
    pub(super) orbit: Orbit,
    pub(super) tool: Option<Cutting>,
    /// The device takes a board so large.
    pub(super) fits: bool,
    /// It is looked at, and not the flat picture.
    pub(super) shown: bool,
}

impl Solid {
    /// What is to be drawn instead of the flat picture.
    pub(super) fn seen(&self) -> Option<(&Field, &Orbit, Option<Cutting>)> {
        let field = self.field.as_ref().filter(|_| self.shown && self.fits)?;
        Some((field, &self.orbit, self.tool))
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
