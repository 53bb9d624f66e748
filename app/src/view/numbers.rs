//! The uniforms of a frame, laid out as in the shaders.
//!
//! ```text
//! camera, colours, progress ─▶ FlatNumbers  ─▶ marks.wgsl
//! orbit, relief, tool       ─▶ SpaceNumbers ─▶ relief.wgsl
//! ```

use super::camera::Camera;
use super::orbit::Orbit;
use super::palette::{Colour, Palette};
use super::relief::{Cutting, ReliefField};
use super::scene::{OrderProgress, Plate};

/// Drawn length of a tool: in diameters, and at least in mm.
const LONG_DIAMETERS: f32 = 7.0;
const LEAST_LONG_MM: f32 = 8.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Painted {
    Shown,
    /// On the screen at reduced resolution, because full resolution takes long on this device.
    Coarse,
    /// Not possible now: try again.
    Later,
    /// The device is lost: a new renderer is needed.
    Lost,
}

impl Painted {
    /// The code for the other WebAssembly.
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// From such a code. An unknown code counts as a lost device.
    pub(super) const fn of_code(code: u8) -> Self {
        match code {
            0 => Self::Shown,
            1 => Self::Coarse,
            2 => Self::Later,
            _ => Self::Lost,
        }
    }
}

/// Uniforms of the 2D view, without its marks.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct FlatNumbers {
    centre_mm: [f32; 2],
    half_px: [f32; 2],
    px_per_mm: f32,
    density: f32,
    grid_mm: f32,
    grid_fade: f32,
    plate_mm: [f32; 4],
    corner_mm: f32,
    has_plate: f32,
    discs: u32,
    lines: u32,
    drilling: u32,
    hand: f32,
    unused: [u32; 2],
    colours: [[f32; 4]; 10],
}

#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct SpaceNumbers {
    eye: [f32; 4],
    forward: [f32; 4],
    right: [f32; 4],
    up: [f32; 4],
    low: [f32; 2],
    cell: f32,
    thickness: f32,
    cells: [f32; 2],
    copper_mm: f32,
    both: f32,
    tip: [f32; 4],
    tool: [f32; 4],
    window: [f32; 2],
    samples: f32,
    under: f32,
    ground: [f32; 4],
}

impl FlatNumbers {
    /// `size_px` in device pixels; `density` is device pixels per CSS pixel.
    pub(super) fn of(
        camera: &Camera,
        (size_px, density): ([u32; 2], f64),
        (plate, grid): (Option<Plate>, bool),
        progress: OrderProgress,
        palette: &Palette,
    ) -> Self {
        let (grid_mm, grid_fade) = camera.grid();
        let corners = plate.map_or([0.0; 4], |p| [p.min_mm[0], p.min_mm[1], p.max_mm[0], p.max_mm[1]]);
        let colours = [
            palette.background,
            palette.plate,
            palette.edge,
            palette.grid,
            palette.bore,
            palette.done,
            palette.current,
            palette.failed,
            palette.selected,
            palette.travelled,
        ];
        Self {
            centre_mm: camera.centre_mm.map(|mm| mm as f32),
            half_px: size_px.map(|px| px as f32 / 2.0),
            px_per_mm: (camera.px_per_mm * density) as f32,
            density: density as f32,
            grid_mm: if grid { grid_mm as f32 } else { 0.0 },
            grid_fade: grid_fade as f32,
            plate_mm: corners,
            corner_mm: plate.map_or(0.0, |plate| plate.corner_mm),
            has_plate: f32::from(u8::from(plate.is_some())),
            discs: progress.discs,
            lines: progress.lines,
            drilling: u32::from(progress.drilling),
            hand: camera.hand() as f32,
            unused: [0; 2],
            colours: colours.map(Colour::linear),
        }
    }

    /// Without the numbers that don't affect the static picture.
    pub(super) fn without_progress(self) -> Self {
        Self { discs: 0, lines: 0, drilling: 0, ..self }
    }
}

impl SpaceNumbers {
    /// For a picture of `drawn_px`, with `samples` rays per pixel in each direction, over `ground`.
    pub(super) fn of(
        (field, orbit, tool): (&ReliefField, &Orbit, Option<Cutting>),
        drawn_px: [u32; 2],
        samples: f32,
        ground: Colour,
    ) -> Self {
        let window = drawn_px.map(|px| px as f32);
        let rays = orbit.rays(window.map(f64::from));
        let four = |spot: [f64; 3]| [spot[0] as f32, spot[1] as f32, spot[2] as f32, 0.0];
        let relief = &field.relief;
        let tip = tool.map_or([0.0; 4], |tool| [tool.tip_mm[0], tool.tip_mm[1], tool.tip_mm[2], 1.0]);
        let long = |tool: Cutting| (2.0 * LONG_DIAMETERS * tool.radius_mm).max(LEAST_LONG_MM);
        Self {
            eye: four(rays.eye),
            forward: four(rays.forward),
            right: four(rays.right),
            up: four(rays.up),
            low: relief.low_mm,
            cell: relief.cell_mm,
            thickness: relief.thickness_mm,
            cells: relief.cells.map(|cells| cells as f32),
            copper_mm: relief.copper_mm,
            both: f32::from(u8::from(relief.both_sides)),
            tip,
            tool: tool.map_or([0.0; 4], |tool| [tool.end_mm, tool.radius_mm, tool.slope, long(tool)]),
            window,
            samples,
            under: f32::from(u8::from(!field.under().is_empty())),
            ground: ground.linear(),
        }
    }

    pub(super) fn drawn_px(&self) -> [u32; 2] {
        self.window.map(|px| px as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::Relief;

    #[test]
    fn uniform_buffers_are_multiples_of_16_bytes() {
        assert_eq!((size_of::<FlatNumbers>(), size_of::<SpaceNumbers>()), (240, 160));
        assert_eq!(size_of::<FlatNumbers>() % 16 + size_of::<SpaceNumbers>() % 16, 0);
    }

    #[test]
    fn paint_result_survives_its_number_code() {
        for painted in [Painted::Shown, Painted::Coarse, Painted::Later, Painted::Lost] {
            assert_eq!(Painted::of_code(painted.code()), painted);
        }
    }

    #[test]
    fn progress_changes_only_the_progress_numbers() {
        let plate = Plate { min_mm: [1.0, 2.0], max_mm: [30.0, 40.0], corner_mm: 3.0 };
        let camera = Camera::default();
        let of = |camera: &Camera, progress| {
            FlatNumbers::of(camera, ([800, 601], 2.0), (Some(plate), true), progress, &Palette::DARK)
        };
        let before = of(&camera, OrderProgress::default());
        let after = of(&camera, OrderProgress { discs: 7, drilling: true, lines: 90 });
        assert_ne!(before, after);
        assert_eq!(before, after.without_progress());
        let moved = Camera { centre_mm: [5.0, 0.0], ..camera };
        assert_ne!(of(&moved, OrderProgress::default()).without_progress(), before);
        assert_eq!((before.half_px, before.plate_mm), ([400.0, 300.5], [1.0, 2.0, 30.0, 40.0]));
        assert_eq!((before.px_per_mm, before.density), (2.0 * camera.px_per_mm as f32, 2.0));
    }

    #[test]
    fn space_numbers_hold_picture_size_and_tool() {
        let relief = Relief {
            low_mm: [0.0, 1.0],
            cell_mm: 0.1,
            cells: [100, 70],
            thickness_mm: 1.6,
            copper_mm: 0.035,
            both_sides: true,
        };
        let orbit = Orbit::of(relief.bounds_mm(), [300.0, 200.0], false);
        let field = ReliefField::new(relief);
        let tool = Cutting { tip_mm: [1.0, 2.0, -0.5], end_mm: 0.1, radius_mm: 0.2, slope: 0.0 };
        let numbers = SpaceNumbers::of((&field, &orbit, Some(tool)), [300, 200], 2.0, Palette::DARK.bore);
        assert_eq!(numbers.drawn_px(), [300, 200]);
        assert_eq!((numbers.both, numbers.under, numbers.samples), (1.0, 0.0, 2.0));
        assert_eq!((numbers.tip, numbers.tool), ([1.0, 2.0, -0.5, 1.0], [0.1, 0.2, 0.0, 8.0]));
        let none = SpaceNumbers::of((&field, &orbit, None), [300, 200], 2.0, Palette::DARK.bore);
        assert_eq!((none.tip, none.tool), ([0.0; 4], [0.0; 4]), "no tool");
    }
}
