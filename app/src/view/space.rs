//! The page's commands for the 3D view: show, carve, move the camera.

use super::backend::Painter;
use super::handle::View;
use super::orbit::Orbit;
use super::relief::{Cutting, Patch, Relief, ReliefField};

impl View {
    /// Switches between 3D view and 2D view.
    pub fn show_solid(&self, shown: bool) {
        self.0.borrow_mut().solid.shown = shown;
        self.repaint();
    }

    /// Replaces the board, without cuts, and fits it.
    pub fn set_relief(&self, relief: Option<Relief>) {
        {
            let mut stage = self.0.borrow_mut();
            let stage = &mut *stage;
            stage.solid.field = relief.map(ReliefField::new);
            stage.solid.fits = match &mut stage.painter {
                Painter::Gpu(gpu) => gpu.set_field(stage.solid.field.as_ref()),
                Painter::Flat(_) | Painter::None => false,
            };
        }
        self.look_home(false);
    }

    pub fn patch(&self, patches: &[Patch]) {
        {
            let mut stage = self.0.borrow_mut();
            let stage = &mut *stage;
            let Some(field) = &mut stage.solid.field else { return };
            for patch in patches {
                field.set(patch);
                if let Painter::Gpu(gpu) = &stage.painter {
                    gpu.patch(patch);
                }
            }
        }
        self.repaint();
    }

    pub fn set_under(&self, under: Vec<Patch>) {
        {
            let mut stage = self.0.borrow_mut();
            let stage = &mut *stage;
            let Some(field) = &mut stage.solid.field else { return };
            field.set_under(under);
            if let Painter::Gpu(gpu) = &mut stage.painter {
                stage.solid.fits = gpu.set_field(Some(&*field));
            }
        }
        self.repaint();
    }

    /// The tool; none hides it.
    pub fn set_cutting(&self, tool: Option<Cutting>) {
        self.0.borrow_mut().solid.tool = tool;
        self.repaint();
    }

    /// The whole board in the initial view, or straight from above if `flat`.
    pub fn look_home(&self, flat: bool) {
        {
            let mut stage = self.0.borrow_mut();
            let viewport = stage.camera.viewport_px;
            let bounds = stage.solid.field.as_ref().map(|field| field.relief.bounds_mm());
            if let Some(bounds) = bounds {
                (stage.solid.orbit, stage.solid.fitted) = (Orbit::of(bounds, viewport, flat), true);
            }
        }
        self.repaint();
    }

    pub fn look_flipped(&self) {
        self.0.borrow_mut().solid.orbit.flip();
        self.repaint();
    }

    pub fn is_from_below(&self) -> bool {
        self.0.borrow().solid.orbit.is_below()
    }

    /// Moves the camera; false while the 2D view is shown.
    pub(super) fn move_orbit(&self, change: impl FnOnce(&mut Orbit, [f64; 2])) -> bool {
        {
            let mut stage = self.0.borrow_mut();
            if stage.solid.seen().is_none() {
                return false;
            }
            let viewport = stage.camera.viewport_px;
            stage.solid.fitted = false;
            change(&mut stage.solid.orbit, viewport);
        }
        self.repaint();
        true
    }

    /// The board position under a pixel.
    pub(super) fn place_of(&self, at_px: [f64; 2]) -> [f64; 2] {
        let stage = self.0.borrow();
        let solid = stage.solid.seen().and_then(|(_, orbit, _)| orbit.to_mm(at_px, stage.camera.viewport_px));
        solid.unwrap_or_else(|| stage.camera.to_mm(at_px))
    }
}
