//! Overlays on the drawing: the selection, the aim of the tool, what is about to be placed.

use super::pieces::{CHORD_ERROR_MM, DrawnPieces, fill, spot};
use super::{Doing, Editor, Tool};
use crate::view::Mesh;
use annulus_core::board::drawing::{Body, Catch, Layer, Snap, Thing};
use annulus_core::geometry::Point;
use annulus_core::units::Length;
use std::collections::BTreeSet;
use std::sync::Arc;

/// If more things are selected, they get no outlines.
const MOST_RIMS: usize = 400;
/// Chord error for large selections, mm.
const COARSE_MM: f64 = 0.03;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkMeaning {
    Chosen,
    /// A selected node. A node has no size, so a dot marks it.
    ChosenNode,
    Coming(Layer),
    Box,
    Measure,
    /// The tool snapped to a node or to the end of an imported object.
    Caught,
    Middle,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnMark {
    pub a_mm: [f32; 2],
    pub b_mm: [f32; 2],
    /// Width on the board, mm; none for a line of constant width on screen.
    pub width_mm: Option<f32>,
    pub kind: MarkMeaning,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chosen {
    pub rims: Vec<DrawnMark>,
    pub mesh: Arc<Mesh>,
    /// Indices into the sheet's holes.
    pub holes: Vec<usize>,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    pub strokes: Vec<DrawnMark>,
    pub cross: Option<[f32; 2]>,
}

impl Chosen {
    pub fn new(editor: &Editor, sheet: &DrawnPieces) -> Self {
        if editor.chosen.is_empty() {
            return Self::default();
        }
        let drawing = editor.drawing();
        let leaves: BTreeSet<Catch> = editor.selection().leaves().collect();
        let holes = sheet.holes.iter().enumerate().filter(|(_, hole)| leaves.contains(&hole.catch));
        let holes = holes.map(|(at, _)| at).collect();
        let (mut mesh, mut rims) = (Mesh::default(), Vec::new());
        let many = leaves.len() > MOST_RIMS;
        let chord_mm = if many { COARSE_MM } else { CHORD_ERROR_MM };
        for catch in &leaves {
            let Some(body) = editor.finder().body(*catch) else { continue };
            if editor.finder().layer(drawing, *catch).is_some() {
                fill(&mut mesh, body, chord_mm);
            }
            match *catch {
                Catch::Drawn(id) if matches!(drawing.thing(id), Some(Thing::Node { .. })) => {
                    rims.extend(body.points.iter().map(|at| handle(*at)));
                }
                _ if !many => rim(&mut rims, body),
                _ => {}
            }
        }
        Self { rims, mesh: Arc::new(mesh), holes }
    }
}

impl Marks {
    pub fn new(editor: &Editor) -> Self {
        let mut marks = Self::default();
        let aim = editor.aim.at();
        let line =
            |a: Point, b: Point, kind| DrawnMark { a_mm: spot(a), b_mm: spot(b), width_mm: None, kind };
        match &editor.doing {
            Doing::Track { from, .. } => marks.strokes.push(DrawnMark {
                width_mm: Some(editor.pen.width.mm() as f32),
                ..line(*from, aim, MarkMeaning::Coming(editor.pen.layer))
            }),
            Doing::Box { from, to, .. } => {
                let corners = [*from, Point::new(to.x, from.y), *to, Point::new(from.x, to.y), *from];
                marks.strokes.extend(corners.windows(2).map(|two| line(two[0], two[1], MarkMeaning::Box)));
            }
            Doing::Measure { from, to } => {
                marks.strokes.push(line(*from, to.unwrap_or(aim), MarkMeaning::Measure));
            }
            Doing::Drag { anchor, moved: true, boxed: Some(bounds), .. } => {
                let (by_x, by_y) = (aim.x - anchor.x, aim.y - anchor.y);
                let corner = |x, y| Point::new(x + by_x, y + by_y);
                let (low, high) = (bounds.min, bounds.max);
                let corners =
                    [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y), (low.x, low.y)];
                let corners = corners.map(|(x, y)| corner(x, y));
                marks.strokes.extend(corners.windows(2).map(|two| line(two[0], two[1], MarkMeaning::Box)));
                marks.strokes.push(line(*anchor, aim, MarkMeaning::Measure));
            }
            Doing::Drag { .. } | Doing::Nothing => marks.strokes.extend(coming(editor)),
        }
        match editor.aim {
            Snap::Node(at, _) | Snap::Imported(at, _) => {
                marks.strokes.push(line(at, at, MarkMeaning::Caught));
            }
            Snap::Middle(at, _) => marks.strokes.push(line(at, at, MarkMeaning::Middle)),
            Snap::Free(_) | Snap::Grid(_) => {}
        }
        marks.cross = Some(spot(aim));
        marks
    }
}

fn coming(editor: &Editor) -> Vec<DrawnMark> {
    let (at, pen) = (spot(editor.aim.at()), editor.pen);
    let disc = |size: Length, kind| DrawnMark { a_mm: at, b_mm: at, width_mm: Some(size.mm() as f32), kind };
    match editor.tool {
        Tool::Pad => vec![disc(pen.size, MarkMeaning::Coming(pen.copper))],
        Tool::Hole => vec![disc(pen.diameter, MarkMeaning::Measure)],
        _ => Vec::new(),
    }
}

fn handle(at: Point) -> DrawnMark {
    DrawnMark { a_mm: spot(at), b_mm: spot(at), width_mm: None, kind: MarkMeaning::ChosenNode }
}

fn rim(strokes: &mut Vec<DrawnMark>, body: &Body) {
    for path in body.outline() {
        let points = path.flattened(0.01);
        let stroke = |two: &[Point]| DrawnMark {
            a_mm: spot(two[0]),
            b_mm: spot(two[1]),
            width_mm: None,
            kind: MarkMeaning::Chosen,
        };
        strokes.extend(points.windows(2).map(stroke));
    }
}
