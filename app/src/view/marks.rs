//! Encodes a scene as strokes with round ends, 32 bytes each. A disc is a stroke of length 0.
//!
//! ```text
//!        radius        bits: 0..2 state   3 disc   4 selected   5 hovered   8..31 order
//!      ╭───┴──────╮
//!      │ a ──── b │    order in the buffer: outline, slots, lines, discs
//!      ╰──────────╯
//! ```

use super::palette::{Colour, Palette};
use super::scene::{Disc, HoleState, Line, Scene, SceneSlot, UNORDERED, Width};
use super::thinned;
use std::ops::Range;

const DISC: u32 = 1 << 3;
const SELECTED: u32 = 1 << 4;
const HOVERED: u32 = 1 << 5;
/// Size of the tool's cross-hair, CSS pixels.
const HEAD_PX: f32 = 16.0;
/// Width of a slot's rim, CSS pixels.
const SLOT_RIM_PX: f32 = 1.75;

#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Mark {
    a_mm: [f32; 2],
    b_mm: [f32; 2],
    radius_mm: f32,
    radius_px: f32,
    colour: Colour,
    bits: u32,
}

pub(super) struct Marks {
    pub(super) all: Vec<Mark>,
    /// Index of the first disc; discs are in the scene's order.
    pub(super) first_disc: usize,
    /// Simplified lines for small zooms.
    pub(super) afar: Afar,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Afar {
    /// The full lines, as marks.
    lines: Range<u32>,
    /// Simplified lines, stored after all other marks: maximum error in mm, and marks.
    levels: Vec<(f32, Range<u32>)>,
}

impl Afar {
    /// The marks to draw at this zoom, of `count`: lines below the discs, and the discs.
    pub(super) fn drawn(&self, count: u32, px_per_mm: f64) -> ([Range<u32>; 2], Range<u32>) {
        let all = self.levels.first().map_or(count, |(_, first)| first.start);
        let level = thinned::level_for(self.levels.iter().map(|(off_mm, _)| *off_mm), px_per_mm);
        let lines = match level.and_then(|level| self.levels.get(level)) {
            Some((_, lines)) => [0..self.lines.start, lines.clone()],
            None => [0..self.lines.end, 0..0],
        };
        (lines, self.lines.end..all)
    }
}

/// Highlights, by disc index.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Emphasis {
    pub(super) selected: Vec<u32>,
    pub(super) hovered: Option<u32>,
}

impl Emphasis {
    pub(super) fn selected(&self, disc: usize) -> bool {
        self.selected.binary_search(&(disc as u32)).is_ok()
    }

    pub(super) fn hovered(&self, disc: usize) -> bool {
        self.hovered == Some(disc as u32)
    }
}

pub(super) fn build(scene: &Scene, palette: &Palette, emphasis: &Emphasis) -> Marks {
    let mut all = Vec::with_capacity(scene.lines.len() + scene.discs.len() + 8 * scene.slots.len());
    // The rim hides the jagged edges of the triangles; the outline is on top of it.
    for (width, colour) in [(4.0, palette.edge), (1.5, palette.outline)] {
        for ring in &scene.outline {
            let closed = ring.iter().zip(ring.iter().cycle().skip(1));
            all.extend(closed.map(|(a, b)| stroke(*a, *b, Width::Px(width), colour, UNORDERED)));
        }
    }
    for slot in &scene.slots {
        sweep(slot, slot.colour, 0.0, &mut all);
        sweep(slot, palette.bore, -SLOT_RIM_PX, &mut all);
    }
    let first_line = all.len() as u32;
    all.extend(scene.lines.iter().map(line));
    let first_disc = all.len();
    all.extend(scene.discs.iter().enumerate().map(|(index, each)| disc(index, each, emphasis)));
    let mut afar = Afar { lines: first_line..first_disc as u32, levels: Vec::new() };
    for (off_mm, lines) in thinned::levels(&scene.lines) {
        let start = all.len() as u32;
        all.extend(lines.iter().map(line));
        afar.levels.push((off_mm, start..all.len() as u32));
    }
    Marks { all, first_disc, afar }
}

pub(super) fn disc(index: usize, disc: &Disc, emphasis: &Emphasis) -> Mark {
    let mut bits = disc.state as u32 | DISC | disc.order.min(UNORDERED) << 8;
    if emphasis.selected(index) {
        bits |= SELECTED;
    }
    if emphasis.hovered(index) {
        bits |= HOVERED;
    }
    let at = disc.centre_mm;
    Mark { a_mm: at, b_mm: at, radius_mm: disc.radius_mm, radius_px: 0.0, colour: disc.colour, bits }
}

pub(super) fn head(at: [f32; 2], palette: &Palette) -> Mark {
    let bits = UNORDERED << 8;
    Mark { a_mm: at, b_mm: at, radius_mm: 0.0, radius_px: HEAD_PX, colour: palette.head, bits }
}

pub(super) fn line(line: &Line) -> Mark {
    stroke(line.a_mm, line.b_mm, line.width, line.colour, line.order)
}

fn stroke(a_mm: [f32; 2], b_mm: [f32; 2], width: Width, colour: Colour, order: u32) -> Mark {
    let (radius_mm, radius_px) = match width {
        Width::Px(width) => (0.0, width / 2.0),
        Width::Mm(width) => (width / 2.0, 0.0),
    };
    let bits = HoleState::Planned as u32 | order.min(UNORDERED) << 8;
    Mark { a_mm, b_mm, radius_mm, radius_px, colour, bits }
}

fn sweep(slot: &SceneSlot, colour: Colour, grown_px: f32, into: &mut Vec<Mark>) {
    into.extend(slot.path_mm.windows(2).map(|pair| Mark {
        radius_px: grown_px,
        ..stroke(pair[0], pair[1], Width::Mm(slot.width_mm), colour, UNORDERED)
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> Scene {
        let red = Colour::rgb(0x00ff_0000);
        let hole = |x: f32, order| Disc {
            centre_mm: [x, 1.0],
            radius_mm: 0.5,
            colour: red,
            state: HoleState::Planned,
            order,
        };
        Scene {
            outline: vec![vec![[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]]],
            slots: vec![SceneSlot {
                path_mm: vec![[1.0, 1.0], [2.0, 1.0], [2.0, 3.0]],
                width_mm: 0.8,
                colour: red,
            }],
            lines: vec![Line {
                a_mm: [0.0; 2],
                b_mm: [1.0; 2],
                width: Width::Px(2.0),
                colour: red,
                order: 0,
            }],
            discs: vec![hole(1.0, 0), hole(2.0, UNORDERED), hole(3.0, 7)],
            ..Scene::default()
        }
    }

    #[test]
    fn distant_view_draws_merged_lines() {
        let piece = |at: u32| {
            let (a_mm, b_mm) = ([at as f32 * 0.001, 0.0], [(at + 1) as f32 * 0.001, 0.0]);
            Line { a_mm, b_mm, width: Width::Px(1.0), colour: Colour::rgb(0), order: 3 }
        };
        let scene = Scene { lines: (0..50_000).map(piece).collect(), ..scene() };
        let marks = build(&scene, &Palette::DARK, &Emphasis::default());
        let (count, near) = (marks.all.len() as u32, marks.first_disc as u32 + 3);
        assert!(near < count && f64::from(count) < 1.34 * f64::from(near), "{count} marks for {near}");
        assert_eq!(marks.afar.drawn(count, 1e4), ([0..near - 3, 0..0], near - 3..near));
        let ([before, lines], discs) = marks.afar.drawn(count, 1.0);
        assert_eq!((before, discs), (0..10, near - 3..near), "outline and slots, discs");
        assert!(lines.start >= near && lines.end <= count && lines.len() < 12_500, "{lines:?}");
        let few = build(&super::tests::scene(), &Palette::DARK, &Emphasis::default());
        let all = few.all.len() as u32;
        assert_eq!(few.afar.drawn(all, 1e-3), ([0..all - 3, 0..0], all - 3..all));
    }

    #[test]
    fn discs_are_last_in_scene_order() {
        let marks = build(&scene(), &Palette::DARK, &Emphasis::default());
        assert_eq!(marks.first_disc, 2 * 3 + 4 + 1, "a closed outline on its rim, a slot twice, a line");
        assert_eq!(marks.all.len(), marks.first_disc + 3);
        assert!(marks.all[..marks.first_disc].iter().all(|mark| mark.bits & DISC == 0));
        let orders: Vec<_> = marks.all[marks.first_disc..].iter().map(|mark| mark.bits >> 8).collect();
        assert_eq!(orders, [0, UNORDERED, 7]);
    }

    #[test]
    fn disc_mark_alone_equals_its_mark_in_the_scene() {
        let scene = scene();
        let emphasis = Emphasis { selected: vec![0, 2], hovered: Some(1) };
        let marks = build(&scene, &Palette::DARK, &emphasis);
        for (index, each) in scene.discs.iter().enumerate() {
            assert_eq!(marks.all[marks.first_disc + index], disc(index, each, &emphasis));
        }
        let flags: Vec<_> =
            marks.all[marks.first_disc..].iter().map(|mark| mark.bits & (SELECTED | HOVERED)).collect();
        assert_eq!(flags, [SELECTED, HOVERED, SELECTED]);
    }

    #[test]
    fn mark_is_32_bytes_without_padding() {
        assert_eq!(size_of::<Mark>(), 32);
        let mark = head([1.0, 2.0], &Palette::DARK);
        assert_eq!(bytemuck::bytes_of(&mark)[8..16], bytemuck::bytes_of(&mark)[..8], "a disc has no length");
    }
}
