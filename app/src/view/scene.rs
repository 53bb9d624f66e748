//! What is to be seen, as plain data: millimetres of the board, X to the right, Y up.
//!
//! Comes in: whatever somebody wants drawn. Goes out: the same. Does not know how it is drawn.

use super::palette::Colour;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

/// A thing that takes no part in the order of a plan.
pub const UNORDERED: u32 = 0x00ff_ffff;

/// Everything in the picture but what changes while one looks: selection, progress and head are the view's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The body of the board where no outline says better.
    pub plate: Option<Plate>,
    /// The body of the board as triangles, three corners each.
    pub body: Vec<[f32; 2]>,
    /// Closed lines of the board's edge.
    pub outline: Vec<Vec<[f32; 2]>>,
    /// Filled areas over the body, the first lowest.
    pub layers: Vec<FilledLayer>,
    /// Elongated holes.
    pub slots: Vec<SceneSlot>,
    /// Lines, for example the way of the head. They lie under the discs.
    pub lines: Vec<Line>,
    /// Round holes. They are told apart by their index here.
    pub discs: Vec<Disc>,
    /// Lower left and upper right corner of what is fitted into the window; none for everything.
    pub wanted_mm: Option<[[f32; 2]; 2]>,
    /// The box of what is chosen, where that is not discs.
    pub chosen_mm: Option<[[f32; 2]; 2]>,
}

/// A filled area.
#[derive(Clone, Debug, PartialEq)]
pub struct FilledLayer {
    /// Its triangles.
    pub mesh: Arc<Mesh>,
    /// Its colour; the alpha is its opacity.
    pub colour: Colour,
    /// The triangles are openings: the rest of the body is filled.
    pub openings: bool,
}

/// Triangles with shared corners.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// The corners in mm.
    pub corners_mm: Vec<[f32; 2]>,
    /// Three indices into them for each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// The edges of what is filled: closed rings of corners that follow each other, each its first corner and how many.
    pub rings: Vec<[u32; 2]>,
}

/// A rounded rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate {
    /// Lower left corner.
    pub min_mm: [f32; 2],
    /// Upper right corner.
    pub max_mm: [f32; 2],
    /// Radius of its corners.
    pub corner_mm: f32,
}

/// A round hole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Its centre.
    pub centre_mm: [f32; 2],
    /// Its radius.
    pub radius_mm: f32,
    /// Colour of its tool.
    pub colour: Colour,
    /// How far it is.
    pub state: HoleState,
    /// Its number in the order of the plan, from 0, or [`UNORDERED`].
    pub order: u32,
}

/// How far a hole is. Each state has a shape of its own beside its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HoleState {
    /// To be drilled: a ring around a dark bore.
    #[default]
    Planned = 0,
    /// Drilled: filled.
    Done = 1,
    /// In work: a second ring around it.
    Current = 2,
    /// Left out: struck through.
    Skipped = 3,
    /// Went wrong: crossed, with a second ring around it.
    Failed = 4,
    /// Not of interest now: faint.
    Dimmed = 5,
}

/// A straight stroke with round ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// From here …
    pub a_mm: [f32; 2],
    /// … to here.
    pub b_mm: [f32; 2],
    /// How wide.
    pub width: Width,
    /// Its colour until progress has passed it.
    pub colour: Colour,
    /// Its number in the order of the plan, from 0, or [`UNORDERED`].
    pub order: u32,
}

/// How wide a line is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Width {
    /// The same on the screen at every zoom, in CSS pixels.
    Px(f32),
    /// The same on the board.
    Mm(f32),
}

/// A hole swept along a path.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSlot {
    /// Its centre line, at least two points.
    pub path_mm: Vec<[f32; 2]>,
    /// Its width.
    pub width_mm: f32,
    /// Colour of its tool.
    pub colour: Colour,
}

/// How far a plan has come, by the numbers of its order. Moving it repaints; it rewrites nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OrderProgress {
    /// Discs with a lower number are done.
    pub discs: u32,
    /// The disc with number `discs` is in work.
    pub drilling: bool,
    /// Lines with a lower number lie behind the head.
    pub lines: u32,
}

impl Scene {
    /// The body as triangles, three corners each: that of a plate too.
    pub fn cover(&self) -> Cow<'_, [[f32; 2]]> {
        match self.plate {
            Some(plate) if self.body.is_empty() => Cow::Owned(plate.triangles()),
            _ => Cow::Borrowed(&self.body),
        }
    }

    /// Lower left and upper right corner of everything; none for an empty scene.
    pub fn bounds_mm(&self) -> Option<[[f32; 2]; 2]> {
        let plate = self.plate.iter().map(|plate| [plate.min_mm, plate.max_mm]);
        let discs = self.discs.iter().map(|disc| around(disc.centre_mm, disc.radius_mm));
        let edge = self.outline.iter().flatten().map(|point| [*point; 2]);
        let slots = self
            .slots
            .iter()
            .flat_map(|slot| slot.path_mm.iter().map(move |point| around(*point, slot.width_mm / 2.0)));
        let areas = self.layers.iter().filter_map(|layer| layer.mesh.bounds_mm());
        plate.chain(discs).chain(edge).chain(slots).chain(areas).reduce(|a, b| {
            let low = [a[0][0].min(b[0][0]), a[0][1].min(b[0][1])];
            [low, [a[1][0].max(b[1][0]), a[1][1].max(b[1][1])]]
        })
    }
}

impl Plate {
    /// A fan round its middle, three corners each triangle.
    fn triangles(&self) -> Vec<[f32; 2]> {
        const STEPS: u8 = 8;
        let half: [f32; 2] = std::array::from_fn(|axis| 0.5 * (self.max_mm[axis] - self.min_mm[axis]));
        let middle: [f32; 2] = std::array::from_fn(|axis| self.min_mm[axis] + half[axis]);
        let round = self.corner_mm.min(half[0]).min(half[1]).max(0.0);
        let signs = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0_f32]];
        let corner = |(quarter, sign): (u8, [f32; 2])| {
            (0..=STEPS).map(move |step| {
                let angle = (f32::from(quarter) + f32::from(step) / f32::from(STEPS)) * FRAC_PI_2;
                let turned = [libm::cosf(angle), libm::sinf(angle)];
                std::array::from_fn(|axis| {
                    middle[axis] + sign[axis] * (half[axis] - round) + turned[axis] * round
                })
            })
        };
        let rim: Vec<[f32; 2]> = (0..).zip(signs).flat_map(corner).collect();
        let next = rim.iter().skip(1).chain(rim.first());
        rim.iter().zip(next).flat_map(|(a, b)| [middle, *a, *b]).collect()
    }
}

impl Mesh {
    /// Two indices into the corners for each piece of an edge.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        let pieces =
            |[first, count]: [u32; 2]| (0..count).map(move |at| [first + at, first + (at + 1) % count]);
        self.rings.iter().copied().flat_map(pieces)
    }

    /// Lower left and upper right corner; none for nothing.
    pub fn bounds_mm(&self) -> Option<[[f32; 2]; 2]> {
        let corners = self.corners_mm.iter().map(|corner| [*corner; 2]);
        corners.reduce(|a, b| {
            let low = [a[0][0].min(b[0][0]), a[0][1].min(b[0][1])];
            [low, [a[1][0].max(b[1][0]), a[1][1].max(b[1][1])]]
        })
    }
}

fn around(centre: [f32; 2], radius: f32) -> [[f32; 2]; 2] {
    [[centre[0] - radius, centre[1] - radius], [centre[0] + radius, centre[1] + radius]]
}

impl OrderProgress {
    /// The state of a disc with number `order` that itself says `state`.
    pub fn state(self, order: u32, state: HoleState) -> HoleState {
        match state {
            HoleState::Planned if order == UNORDERED => state,
            HoleState::Planned if order < self.discs => HoleState::Done,
            HoleState::Planned if order == self.discs && self.drilling => HoleState::Current,
            _ => state,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_hold_the_rims_of_discs_and_the_plate() {
        let disc = Disc {
            centre_mm: [10.0, 5.0],
            radius_mm: 2.0,
            colour: Colour::rgb(0),
            state: HoleState::Planned,
            order: 0,
        };
        let mut scene = Scene { discs: vec![disc], ..Scene::default() };
        assert_eq!(scene.bounds_mm(), Some([[8.0, 3.0], [12.0, 7.0]]));
        scene.plate = Some(Plate { min_mm: [0.0, 0.0], max_mm: [11.0, 20.0], corner_mm: 1.0 });
        assert_eq!(scene.bounds_mm(), Some([[0.0, 0.0], [12.0, 20.0]]));
        assert_eq!(Scene::default().bounds_mm(), None);
    }

    #[test]
    fn a_plate_is_covered_to_its_round_corners() {
        let plate = Plate { min_mm: [-2.0, 1.0], max_mm: [10.0, 9.0], corner_mm: 1.5 };
        let scene = Scene { plate: Some(plate), ..Scene::default() };
        let (cover, mut area) = (scene.cover(), 0.0);
        for triangle in cover.chunks_exact(3) {
            let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
            let twice = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
            assert!(twice >= 0.0, "{triangle:?}");
            area += 0.5 * twice;
        }
        let exact = 12.0 * 8.0 - (4.0 - std::f32::consts::PI) * 1.5 * 1.5;
        assert!((area - exact).abs() < 0.1, "{area} of {exact}");
        let body = vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        assert_eq!(*Scene { body: body.clone(), ..scene }.cover(), *body, "the outline says better");
    }

    #[test]
    fn progress_passes_planned_discs_and_leaves_the_others_alone() {
        let at = OrderProgress { discs: 3, drilling: true, lines: 0 };
        let rows = [
            (2, HoleState::Planned, HoleState::Done),
            (3, HoleState::Planned, HoleState::Current),
            (4, HoleState::Planned, HoleState::Planned),
            (UNORDERED, HoleState::Planned, HoleState::Planned),
            (1, HoleState::Failed, HoleState::Failed),
            (9, HoleState::Done, HoleState::Done),
        ];
        for (order, own, expected) in rows {
            assert_eq!(at.state(order, own), expected, "order {order}, {own:?}");
        }
        assert_eq!(OrderProgress { drilling: false, ..at }.state(3, HoleState::Planned), HoleState::Planned);
    }
}
