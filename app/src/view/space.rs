//! What the page does with the board in space: shows it, carves it, looks at it from elsewhere.
//!
//! Comes in: a relief, tiles, a tool; drags and zooms. Goes out: frames that are asked for. Does not know how it is drawn.

use super::backend::Painter;
use super::handle::View;
use super::orbit::Orbit;
use super::relief::{Cutting, Patch, Relief, ReliefField};

impl View {
    /// Looks at the board in space, or at the flat picture again.
    pub fn show_solid(&self, shown: bool) {
        self.0.borrow_mut().solid.shown = shown;
        self.repaint();
    }

    /// Another board in space, uncut, or none; one looks at all of it.
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

    /// These tiles of it are others.
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

    /// What is cut of it from below, all of it.
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

    /// The tool over it; none hides it.
    pub fn set_cutting(&self, tool: Option<Cutting>) {
        self.0.borrow_mut().solid.tool = tool;
        self.repaint();
    }

    /// All of it, as it is seen first, or straight from above.
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

    /// From the other side.
    pub fn look_flipped(&self) {
        self.0.borrow_mut().solid.orbit.flip();
        self.repaint();
    }

    /// Whether the board in space is looked at from underneath.
    pub fn is_from_below(&self) -> bool {
        self.0.borrow().solid.orbit.is_below()
    }

    /// Moves the eye; false where the flat picture is on show.
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

    /// The place of the board that a pixel shows.
    pub(super) fn place_of(&self, at_px: [f64; 2]) -> [f64; 2] {
        let stage = self.0.borrow();
        let solid = stage.solid.seen().and_then(|(_, orbit, _)| orbit.to_mm(at_px, stage.camera.viewport_px));
        solid.unwrap_or_else(|| stage.camera.to_mm(at_px))
    }
}
