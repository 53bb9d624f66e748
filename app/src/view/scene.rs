//! The content of the picture as plain data: millimetres of the board, X right, Y up.

use super::palette::Colour;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;

/// Order of a thing that isn't part of a plan.
pub const UNORDERED: u32 = 0x00ff_ffff;

/// The content, except selection, progress and tool position, which the view holds because they change often.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The board's body if there is no outline.
    pub plate: Option<Plate>,
    /// The board's body as triangles, three corners each.
    pub body: Vec<[f32; 2]>,
    /// Closed rings of the board's edge.
    pub outline: Vec<Vec<[f32; 2]>>,
    /// Filled areas over the body, lowest first.
    pub layers: Vec<FilledLayer>,
    pub slots: Vec<SceneSlot>,
    /// Lines, such as the tool's travel. Drawn under the discs.
    pub lines: Vec<Line>,
    /// Round holes, identified by their index.
    pub discs: Vec<Disc>,
    /// Corners of the box to fit into the window; none for everything.
    pub wanted_mm: Option<[[f32; 2]; 2]>,
    pub chosen_mm: Option<[[f32; 2]; 2]>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct FilledLayer {
    pub mesh: Arc<Mesh>,
    /// Alpha is the opacity.
    pub colour: Colour,
    /// The triangles are openings: the rest of the body is filled.
    pub openings: bool,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    pub corners_mm: Vec<[f32; 2]>,
    /// Three indices into the corners per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// The edges of the filled area: closed rings of consecutive corners, as first corner and count.
    pub rings: Vec<[u32; 2]>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plate {
    pub min_mm: [f32; 2],
    pub max_mm: [f32; 2],
    pub corner_mm: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    pub centre_mm: [f32; 2],
    pub radius_mm: f32,
    /// Colour of its tool.
    pub colour: Colour,
    pub state: HoleState,
    /// Index in the plan's order, or [`UNORDERED`].
    pub order: u32,
}

/// State of a hole. Each has a distinct shape in addition to its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HoleState {
    /// To be drilled: a ring around a dark bore.
    #[default]
    Planned = 0,
    Done = 1,
    Current = 2,
    /// Left out: struck through.
    Skipped = 3,
    Failed = 4,
    /// Not relevant now: faint.
    Dimmed = 5,
}

/// A straight stroke with round ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    pub a_mm: [f32; 2],
    pub b_mm: [f32; 2],
    pub width: Width,
    pub colour: Colour,
    /// Index in the plan's order, or [`UNORDERED`].
    pub order: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Width {
    Px(f32),
    /// Constant on the board.
    Mm(f32),
}

/// A slot: a hole swept along a path.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSlot {
    /// Center line, at least two points.
    pub path_mm: Vec<[f32; 2]>,
    pub width_mm: f32,
    /// Colour of its tool.
    pub colour: Colour,
}

/// Progress of a plan, by order. A change repaints but uploads nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OrderProgress {
    /// Discs with a lower number are done.
    pub discs: u32,
    pub drilling: bool,
    /// Lines with a lower number are done.
    pub lines: u32,
}

impl Scene {
    /// The body as triangles, three corners each, also if it is a plate.
    pub fn cover(&self) -> Cow<'_, [[f32; 2]]> {
        match self.plate {
            Some(plate) if self.body.is_empty() => Cow::Owned(plate.triangles()),
            _ => Cow::Borrowed(&self.body),
        }
    }

    /// Bounding box of everything; none for an empty scene.
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
    /// A fan around the middle, three corners per triangle.
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
    /// Two corner indices per edge segment.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        let pieces =
            |[first, count]: [u32; 2]| (0..count).map(move |at| [first + at, first + (at + 1) % count]);
        self.rings.iter().copied().flat_map(pieces)
    }

    /// Bounding box; none if there are no corners.
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
    /// The state of a disc with number `order` and own state `state`, under this progress.
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
    fn bounds_include_disc_rims_and_the_plate() {
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
    fn plate_cover_includes_its_round_corners() {
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
    fn progress_marks_only_planned_discs() {
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
