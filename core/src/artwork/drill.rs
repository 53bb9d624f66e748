//! A drill file as written: tools, hits, slots and routes in file order, in exact lengths.
//!
//! Comes in: what a reader found. Goes out: the data and its measures in mm. Does not know how it was written, and
//! not what the holes are for.

use crate::geometry::{Bounds, PathSegment, Point};
use crate::units::Length;

/// A drill file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrillFile {
    /// Tools in the order they were defined or first used.
    pub tools: Vec<ToolEntry>,
    /// Single holes in file order, repeats expanded.
    pub hits: Vec<Hit>,
    /// Straight slots (G85) in file order.
    pub slots: Vec<SlotEntry>,
    /// Routed paths in file order.
    pub routes: Vec<Route>,
}

/// A tool of the file's table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ToolEntry {
    /// Its number in the file.
    pub code: u32,
    /// Diameter; none where the file does not say.
    pub diameter: Option<Length>,
    /// Plated, not plated, or not said.
    pub plated: Option<bool>,
    /// Line of its definition or first use, from 1; 0 if another file defines it.
    pub line: u32,
}

/// One hole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hit {
    /// Its centre.
    pub at: Point,
    /// Line in the file, from 1.
    pub line: u32,
    /// Index into [`DrillFile::tools`].
    pub tool: u16,
}

/// A straight slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotEntry {
    /// Centre of one end.
    pub from: Point,
    /// Centre of the other end.
    pub to: Point,
    /// Line in the file, from 1.
    pub line: u32,
    /// Index into [`DrillFile::tools`].
    pub tool: u16,
    /// How many hits stand before it in the file.
    pub after_hits: u32,
}

/// A path routed with the tool down.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Route {
    /// Where the tool went down.
    pub from: Point,
    /// The moves.
    pub segments: Vec<PathSegment>,
    /// Line in the file, from 1.
    pub line: u32,
    /// Index into [`DrillFile::tools`].
    pub tool: u16,
}

/// How much work there is for one tool, or for all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Single holes.
    pub hits: u32,
    /// Straight slots (G85).
    pub slots: u32,
    /// Routed paths.
    pub routed_paths: u32,
    /// Moves in them.
    pub routed_segments: u32,
}

impl DrillFile {
    /// The work of each tool, in the order of [`DrillFile::tools`].
    pub fn counts(&self) -> Vec<Counts> {
        let mut counts = vec![Counts::default(); self.tools.len()];
        let mut on = |tool: u16, add: fn(&mut Counts, u32), by: u32| {
            if let Some(row) = counts.get_mut(usize::from(tool)) {
                add(row, by);
            }
        };
        self.hits.iter().for_each(|hit| on(hit.tool, |row, by| row.hits += by, 1));
        self.slots.iter().for_each(|slot| on(slot.tool, |row, by| row.slots += by, 1));
        for route in &self.routes {
            on(route.tool, |row, by| row.routed_paths += by, 1);
            on(route.tool, |row, by| row.routed_segments += by, route.segments.len() as u32);
        }
        counts
    }

    /// The work of all tools together.
    pub fn totals(&self) -> Counts {
        Counts {
            hits: self.hits.len() as u32,
            slots: self.slots.len() as u32,
            routed_paths: self.routes.len() as u32,
            routed_segments: self.routes.iter().map(|route| route.segments.len() as u32).sum(),
        }
    }

    /// Every centre with its tool: holes, slot ends, route vertices.
    pub fn centres(&self) -> impl Iterator<Item = (Point, u16)> + '_ {
        let hits = self.hits.iter().map(|hit| (hit.at, hit.tool));
        let slots = self.slots.iter().flat_map(|slot| [(slot.from, slot.tool), (slot.to, slot.tool)]);
        let routes = self.routes.iter().flat_map(|route| {
            let vertices = route.segments.iter().map(|segment| segment.to());
            std::iter::once(route.from).chain(vertices).map(|point| (point, route.tool))
        });
        hits.chain(slots).chain(routes)
    }

    /// The box around all centres.
    pub fn centre_bounds(&self) -> Option<Bounds> {
        Bounds::around(self.centres().map(|(point, _)| point))
    }

    /// The box around all holes at their full size; tools without a diameter count as points.
    pub fn outer_bounds(&self) -> Option<Bounds> {
        self.centres().fold(None, |bounds: Option<Bounds>, (point, tool)| {
            let tool = self.tools.get(usize::from(tool));
            let radius = tool.and_then(|tool| tool.diameter).map_or(0, |diameter| diameter.nm() / 2);
            let around = Bounds::of(point).grown(Length::from_nm(radius));
            Some(bounds.map_or(around, |bounds| bounds.with(around.min).with(around.max)))
        })
    }

    /// Length in mm of the moves from the end of one hole or slot to the start of the next, in file order, without
    /// the first approach; routes are not counted.
    pub fn rapid_length_mm(&self) -> f64 {
        let mut total = 0.0;
        let mut last: Option<Point> = None;
        let mut slots = self.slots.iter().peekable();
        for index in 0..=self.hits.len() {
            while let Some(slot) = slots.next_if(|slot| slot.after_hits as usize <= index) {
                total += last.map_or(0.0, |from| from.distance_mm(slot.from));
                last = Some(slot.to);
            }
            if let Some(hit) = self.hits.get(index) {
                total += last.map_or(0.0, |from| from.distance_mm(hit.at));
                last = Some(hit.at);
            }
        }
        total
    }
}
