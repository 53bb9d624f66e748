//! The board that chosen drill files describe.
//!
//! Comes in: an [`Artwork`] and which of its files to use. Goes out: a [`Board`] and the remarks of those files. Knows
//! no words of any format; arcs become chords here.

use super::outline::{contours, nest};
use super::{Board, Hole, Slot};
use crate::artwork::{Artwork, DrillFile, FileRead, Role, ToolEntry};
use crate::geometry::{Point, Region, Segment, chords};
use crate::remark::{Remark, Weight};
use crate::units::Length;

/// How far a chord may be from its arc, in mm.
const CHORD_ERROR_MM: f64 = 0.005;

/// Makes the board of the files at `used`; what is not a drill file among them adds nothing. The remarks are those of the
/// files used.
pub fn from_artwork(artwork: &Artwork, used: &[usize]) -> (Board, Vec<Remark>) {
    let mut board = Board::default();
    let mut remarks = Vec::new();
    for file in used.iter().filter_map(|&index| artwork.files.get(index)) {
        let Some(drill) = &file.drill else { continue };
        let source = board.sources.len() as u32;
        board.sources.push(file.name.clone());
        remarks.extend(file.remarks.iter().cloned());
        add(&mut board, file, drill, source);
    }
    board.name = board.sources.first().map(|name| short(name)).unwrap_or_default();
    board.outline = outline(artwork, &mut remarks);
    (board, remarks)
}

fn add(board: &mut Board, file: &FileRead, drill: &DrillFile, source: u32) {
    let nameless = ToolEntry { code: 0, diameter: None, plated: None, line: 0 };
    let tool = |index: u16| drill.tools.get(usize::from(index)).unwrap_or(&nameless);
    board.holes.reserve(drill.hits.len());
    for hit in &drill.hits {
        let tool = tool(hit.tool);
        let plated = tool.plated.or(file.plated);
        board.holes.push(Hole {
            at: hit.at,
            diameter: tool.diameter,
            plated,
            source,
            tool_code: tool.code,
            line: hit.line,
        });
    }
    let slot = |index: u16, path: Vec<Point>, line: u32| {
        let tool = tool(index);
        let plated = tool.plated.or(file.plated);
        Slot { path, width: tool.diameter, plated, source, tool_code: tool.code, line }
    };
    board.slots.extend(drill.slots.iter().map(|row| slot(row.tool, vec![row.from, row.to], row.line)));
    for route in &drill.routes {
        let mut path = vec![route.from];
        for segment in &route.segments {
            let from = path.last().copied().unwrap_or(route.from);
            match *segment {
                Segment::Line { to } => path.push(to),
                Segment::Arc { to, centre, clockwise } => {
                    path.extend(chords::arc(from, to, centre, clockwise, CHORD_ERROR_MM));
                }
            }
        }
        board.slots.push(slot(route.tool, path, route.line));
    }
    board.slots.sort_by_key(|slot| (slot.source, slot.line));
}

/// The first outline layer whose lines close gives the outline. Lines of it that lead nowhere are remarked.
fn outline(artwork: &Artwork, remarks: &mut Vec<Remark>) -> Region {
    for file in artwork.files.iter().filter(|file| file.role == Role::Outline) {
        let Some(gerber) = &file.gerber else { continue };
        let strokes: Vec<_> =
            gerber.tracks.iter().map(|track| (track.from, Segment::Line { to: track.to })).collect();
        let (closed, open) = contours(&strokes);
        if open > 0 {
            let code = if closed.is_empty() { "board.outline_open" } else { "board.outline_rest" };
            remarks.push(Remark::new(Weight::Doubt, code).at(&file.name, 0, 0).with("count", open));
        }
        if !closed.is_empty() {
            return nest(closed);
        }
    }
    Region::default()
}

/// A name for people: the last part of a path, without its ending.
fn short(name: &str) -> String {
    let base = name.rsplit(['/', '\\']).next().unwrap_or(name);
    base.rsplit_once('.').map_or(base, |(stem, _)| stem).to_owned()
}

impl Board {
    /// The box around all holes and slots at their full size; those without a size count as points.
    pub fn outer_bounds(&self) -> Option<crate::geometry::Bounds> {
        let holes = self.holes.iter().map(|hole| (hole.at, hole.diameter));
        let slots = self.slots.iter().flat_map(|slot| slot.path.iter().map(|&point| (point, slot.width)));
        holes.chain(slots).fold(None, |bounds: Option<crate::geometry::Bounds>, (point, size)| {
            let radius = Length::from_nm(size.map_or(0, |size| size.nm() / 2));
            let around = crate::geometry::Bounds::of(point).grown(radius);
            Some(bounds.map_or(around, |bounds| bounds.with(around.min).with(around.max)))
        })
    }
}
