//! A drill file as written: tools, hits, slots and routes in file order, in exact lengths.

use crate::geometry::{Bounds, PathSegment, Point};
use crate::units::Length;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrillFile {
    /// In the order of definition or first use.
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
    pub code: u32,
    /// None if the file doesn't give it.
    pub diameter: Option<Length>,
    /// None if unknown.
    pub plated: Option<bool>,
    /// Line of its definition or first use, from 1; 0 if it comes from another file.
    pub line: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hit {
    pub at: Point,
    /// Line in the file, from 1.
    pub line: u32,
    /// Index into [`DrillFile::tools`].
    pub tool: u16,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotEntry {
    pub from: Point,
    /// Center of the other end.
    pub to: Point,
    /// Line in the file, from 1.
    pub line: u32,
    /// Index into [`DrillFile::tools`].
    pub tool: u16,
    /// Number of hits before it in the file.
    pub after_hits: u32,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Route {
    /// Where the tool plunges.
    pub from: Point,
    pub segments: Vec<PathSegment>,
    /// Line in the file, from 1.
    pub line: u32,
    /// Index into [`DrillFile::tools`].
    pub tool: u16,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    pub hits: u32,
    /// Straight slots (G85).
    pub slots: u32,
    pub routed_paths: u32,
    pub routed_segments: u32,
}

impl DrillFile {
    /// The work per tool, in the order of [`DrillFile::tools`].
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

    pub fn totals(&self) -> Counts {
        Counts {
            hits: self.hits.len() as u32,
            slots: self.slots.len() as u32,
            routed_paths: self.routes.len() as u32,
            routed_segments: self.routes.iter().map(|route| route.segments.len() as u32).sum(),
        }
    }

    /// Every center with its tool: hits, then slot ends, then route vertices.
    pub fn centres(&self) -> impl Iterator<Item = (Point, u16)> + '_ {
        let hits = self.hits.iter().map(|hit| (hit.at, hit.tool));
        let slots = self.slots.iter().flat_map(|slot| [(slot.from, slot.tool), (slot.to, slot.tool)]);
        let routes = self.routes.iter().flat_map(|route| {
            let vertices = route.segments.iter().map(|segment| segment.to());
            std::iter::once(route.from).chain(vertices).map(|point| (point, route.tool))
        });
        hits.chain(slots).chain(routes)
    }

    pub fn centre_bounds(&self) -> Option<Bounds> {
        Bounds::around(self.centres().map(|(point, _)| point))
    }

    /// Bounding box of all holes with their diameter; tools without a diameter count as points.
    pub fn outer_bounds(&self) -> Option<Bounds> {
        self.centres().fold(None, |bounds: Option<Bounds>, (point, tool)| {
            let tool = self.tools.get(usize::from(tool));
            let radius = tool.and_then(|tool| tool.diameter).map_or(0, |diameter| diameter.nm() / 2);
            let around = Bounds::of(point).grown(Length::from_nm(radius));
            Some(bounds.map_or(around, |bounds| bounds.with(around.min).with(around.max)))
        })
    }

    /// Length in mm of the moves from the end of one hole or slot to the start of the next, in file order.
    /// Without the first approach, and without routes.
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
