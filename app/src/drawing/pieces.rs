//! The drawing as triangles, in chunks of 256 things: an edit rebuilds only the chunks it changed.
//!
//! ```text
//!  Body ─ circle │ capsule │ ring ─▶ triangles ┐
//!  things 0…255, 256…511, … of each layer ─────┴▶ one mesh per chunk ─▶ DrawnPieces
//! ```

use crate::view::Mesh;
use annulus_core::board::drawing::{Body, Catch, Drawing, Finder, Id, Layer, Thing};
use annulus_core::geometry::Point;
use annulus_core::units::Length;
use geo::{LineString, Polygon, TriangulateEarcut};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use std::sync::Arc;

/// Things per chunk.
const PIECE: u32 = 256;
pub(super) const CHORD_ERROR_MM: f64 = 0.004;
/// The layers with triangles, lowest first.
const LAYERS: [Layer; 3] = [Layer::Bottom, Layer::Top, Layer::Edge];

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HolePiece {
    pub catch: Catch,
    pub at_mm: [f32; 2],
    pub diameter: Length,
}

#[derive(Clone, Debug, PartialEq)]
pub struct SlotPiece {
    pub path_mm: Vec<[f32; 2]>,
    pub width: Length,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrawnPieces {
    /// Triangles by layer, lowest first. Unchanged chunks keep their `Arc`, so the view can skip uploading
    /// them.
    pub areas: Vec<(Layer, Arc<Mesh>)>,
    pub holes: Vec<HolePiece>,
    pub slots: Vec<SlotPiece>,
    pub nodes: Vec<[f32; 2]>,
    /// Center lines of the board's edge: always visible, even if the edge is narrow.
    pub edges: Vec<[[f32; 2]; 2]>,
    /// Lower left and upper right corner.
    pub bounds_mm: Option<[[f32; 2]; 2]>,
}

/// True for objects of files, false for drawn things; then the number of the chunk.
type Key = (bool, u32);

#[derive(Clone, Debug, Default)]
struct Piece {
    meshes: [Arc<Mesh>; 3],
    holes: Vec<HolePiece>,
    slots: Vec<SlotPiece>,
    nodes: Vec<[f32; 2]>,
    edges: Vec<[[f32; 2]; 2]>,
    bounds_mm: Option<[[f32; 2]; 2]>,
}

#[derive(Clone, Debug, Default)]
pub struct Pieces {
    pieces: BTreeMap<Key, Piece>,
    stale: BTreeSet<Key>,
    sheet: Arc<DrawnPieces>,
}

fn key(catch: Catch) -> Key {
    match catch {
        Catch::Imported(of) => (false, of / PIECE),
        Catch::Drawn(id) => (true, id.0 / PIECE),
    }
}

/// In mm.
pub(super) fn spot(at: Point) -> [f32; 2] {
    [at.x.mm() as f32, at.y.mm() as f32]
}

impl Pieces {
    /// All chunks of a drawing, to be built at the next [`Self::sheet`].
    pub(super) fn new(drawing: &Drawing, finder: &Finder) -> Self {
        let imported = (0..finder.imported().len() as u32).map(Catch::Imported);
        let drawn = drawing.things().map(|(id, _)| Catch::Drawn(id));
        let stale = imported.chain(drawn).map(key).collect();
        Self { stale, ..Self::default() }
    }

    /// Marks the chunks of these things for rebuilding: their shape changed.
    pub(super) fn touch(&mut self, moved: &BTreeSet<Catch>) {
        self.stale.extend(moved.iter().copied().map(key));
    }

    /// The current triangles; the same handle until something changes.
    pub(super) fn sheet(&mut self, drawing: &Drawing, finder: &Finder) -> Arc<DrawnPieces> {
        if self.stale.is_empty() {
            return self.sheet.clone();
        }
        for key in std::mem::take(&mut self.stale) {
            self.pieces.insert(key, piece(key, drawing, finder));
        }
        let mut sheet = DrawnPieces::default();
        for (index, layer) in LAYERS.into_iter().enumerate() {
            let meshes = self.pieces.values().filter_map(|piece| piece.meshes.get(index));
            let drawn = meshes.filter(|mesh| !mesh.triangles.is_empty());
            sheet.areas.extend(drawn.map(|mesh| (layer, mesh.clone())));
        }
        for piece in self.pieces.values() {
            sheet.holes.extend_from_slice(&piece.holes);
            sheet.slots.extend_from_slice(&piece.slots);
            sheet.nodes.extend_from_slice(&piece.nodes);
            sheet.edges.extend_from_slice(&piece.edges);
            sheet.bounds_mm = both(sheet.bounds_mm, piece.bounds_mm);
        }
        self.sheet = Arc::new(sheet);
        self.sheet.clone()
    }
}

pub(super) fn both(a: Option<[[f32; 2]; 2]>, b: Option<[[f32; 2]; 2]>) -> Option<[[f32; 2]; 2]> {
    let (Some([a_low, a_high]), Some([b_low, b_high])) = (a, b) else { return a.or(b) };
    let low = [a_low[0].min(b_low[0]), a_low[1].min(b_low[1])];
    Some([low, [a_high[0].max(b_high[0]), a_high[1].max(b_high[1])]])
}

fn piece((drawn, number): Key, drawing: &Drawing, finder: &Finder) -> Piece {
    let mut meshes = [Mesh::default(), Mesh::default(), Mesh::default()];
    let mut piece = Piece::default();
    let first = number.saturating_mul(PIECE);
    for of in first..first.saturating_add(PIECE) {
        let catch = if drawn { Catch::Drawn(Id(of)) } else { Catch::Imported(of) };
        let Some(body) = finder.body(catch) else { continue };
        let bounds = body.bounds();
        piece.bounds_mm = both(piece.bounds_mm, Some([spot(bounds.min), spot(bounds.max)]));
        match (finder.layer(drawing, catch), body.points.first()) {
            (Some(layer), _) => {
                if layer == Layer::Edge {
                    piece.edges.extend(body.points.windows(2).map(|two| [spot(two[0]), spot(two[1])]));
                }
                let own = LAYERS.iter().zip(&mut meshes).filter(|(own, _)| layer.meets(**own));
                own.for_each(|(_, mesh)| fill(mesh, body, CHORD_ERROR_MM));
            }
            (None, Some(at)) if drawn && matches!(drawing.thing(Id(of)), Some(Thing::Node { .. })) => {
                piece.nodes.push(spot(*at));
            }
            (None, Some(_)) if body.points.len() > 1 => {
                let path_mm = body.points.iter().copied().map(spot).collect();
                piece.slots.push(SlotPiece { path_mm, width: body.radius * 2 });
            }
            (None, Some(at)) => {
                piece.holes.push(HolePiece { catch, at_mm: spot(*at), diameter: body.radius * 2 });
            }
            (None, None) => {}
        }
    }
    piece.meshes = meshes.map(Arc::new);
    piece
}

/// Adds the triangles of a body. `chord_mm` is the maximum distance of a chord from its arc.
pub(super) fn fill(mesh: &mut Mesh, body: &Body, chord_mm: f64) {
    let points: Vec<[f64; 2]> = body.points.iter().map(|at| [at.x.mm(), at.y.mm()]).collect();
    let radius = body.radius.mm();
    match points.as_slice() {
        [] => {}
        ring if body.closed => polygon(mesh, ring),
        [at] => fan(mesh, &arc(*at, radius, (0.0, 2.0 * PI), chord_mm)),
        [..] => {
            for pair in points.windows(2) {
                let [a, b] = [pair[0], pair[1]];
                let along = libm::atan2(b[1] - a[1], b[0] - a[0]);
                let mut around = arc(b, radius, (along - PI / 2.0, PI), chord_mm);
                around.extend(arc(a, radius, (along + PI / 2.0, PI), chord_mm));
                fan(mesh, &around);
            }
        }
    }
}

/// Points on an arc that starts at angle `from` and sweeps `over`, in radians.
fn arc(at: [f64; 2], radius: f64, (from, over): (f64, f64), chord_mm: f64) -> Vec<[f64; 2]> {
    let bend = libm::acos((1.0 - chord_mm / radius.max(chord_mm)).clamp(-1.0, 1.0)).max(0.05);
    let steps = (libm::ceil(over / (2.0 * bend)) as usize).clamp(4, 128);
    let whole = over >= 2.0 * PI;
    // Rotate the previous point instead of calling sine for each: there are many points.
    let (sin, cos) = libm::sincos(over / steps as f64);
    let (y, x) = libm::sincos(from);
    let turned = |[x, y]: &[f64; 2]| Some([x * cos - y * sin, x * sin + y * cos]);
    let spokes = std::iter::successors(Some([x, y]), turned).take(steps + usize::from(!whole));
    spokes.map(|[x, y]| [at[0] + radius * x, at[1] + radius * y]).collect()
}

fn fan(mesh: &mut Mesh, ring: &[[f64; 2]]) {
    let first = mesh.corners_mm.len() as u32;
    mesh.corners_mm.extend(ring.iter().map(|at| at.map(|mm| mm as f32)));
    let last = ring.len().saturating_sub(1) as u32;
    mesh.triangles.extend((1..last).map(|corner| [first, first + corner, first + corner + 1]));
}

fn polygon(mesh: &mut Mesh, ring: &[[f64; 2]]) {
    let turns = |at: usize| {
        let count = ring.len();
        let (a, b, c) = (ring[at], ring[(at + 1) % count], ring[(at + 2) % count]);
        (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
    };
    let all = |sign: f64| (0..ring.len()).all(|at| turns(at) * sign >= 0.0);
    if ring.len() < 9 && (all(1.0) || all(-1.0)) {
        return fan(mesh, ring);
    }
    let line: LineString<f64> = ring.to_vec().into();
    let cut = Polygon::new(line, Vec::new()).earcut_triangles_raw();
    let first = mesh.corners_mm.len();
    mesh.corners_mm.extend(cut.vertices.iter().map(|at| at.map(|mm| mm as f32)));
    let corner = |index: usize| (first + index) as u32;
    let triangles = cut.triangle_indices.chunks_exact(3);
    mesh.triangles.extend(triangles.map(|three| [corner(three[0]), corner(three[1]), corner(three[2])]));
}
