//! The 3D view's state: field, camera, tool.

use super::orbit::Orbit;
use super::relief::{Cutting, ReliefField};

#[derive(Default)]
pub(super) struct Solid {
    pub(super) field: Option<ReliefField>,
    pub(super) orbit: Orbit,
    pub(super) tool: Option<Cutting>,
    /// The device supports a board of this size.
    pub(super) fits: bool,
    /// Shown instead of the 2D view.
    pub(super) shown: bool,
    /// Refit when the window changes, until the user moves the camera.
    pub(super) fitted: bool,
}

impl Solid {
    /// The 3D view, if it must be drawn.
    pub(super) fn seen(&self) -> Option<(&ReliefField, &Orbit, Option<Cutting>)> {
        let field = self.field.as_ref().filter(|_| self.shown && self.fits)?;
        Some((field, &self.orbit, self.tool))
    }

    /// Fits the board into the window from the current direction, unless the user has moved the camera.
    pub(super) fn fit(&mut self, viewport_px: [f64; 2]) {
        let Some(field) = self.field.as_ref().filter(|_| self.fitted) else { return };
        self.orbit.fit(field.relief.bounds_mm(), viewport_px);
    }

    /// For an attribute of the canvas: visibility, tilt and turn.
    pub(super) fn describe(&self) -> String {
        let orbit = &self.orbit;
        match self.seen() {
            Some(_) => format!("{:.0} {:.0} {:.1}", orbit.tilt_deg, orbit.turn_deg, orbit.across_mm),
            None => String::new(),
        }
    }
}
