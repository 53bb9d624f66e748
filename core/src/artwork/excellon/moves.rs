//! Slots, routes, repeats and patterns: everything with more than one hit per line.

use super::block::{Block, Pair};
use super::reader::{MOST_REPEATED, Motion, Pattern, Reader};
use crate::artwork::drill::{Hit, Route, SlotEntry};
use crate::artwork::number::Decimal;
use crate::code;
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::{PathSegment, Point};
use crate::units::Length;

impl Reader<'_> {
    pub(super) fn slot(&mut self, start: Pair, end: Pair) {
        let reached = !start.any() || self.go(start);
        let from = self.at;
        if !end.any() {
            self.report(Severity::Error, code!("drill.slot_without_end"), 1, b"");
        } else if reached && self.go(end) {
            let tool = self.tool_in_use();
            let after_hits = self.out.hits.len() as u32;
            self.out.slots.push(SlotEntry { from, to: self.at, line: self.line, tool, after_hits });
        }
    }

    /// A routing move: cuts if the tool is down.
    pub(super) fn rout(&mut self, from: Point, block: &Block, line: &[u8]) {
        let to = self.at;
        if self.route.is_none() {
            let moved_by_code = block.gs.iter().any(|(code, _)| *code == 0);
            if !moved_by_code {
                self.findings.once(Severity::Warning, code!("drill.move_without_cut"), self.line, 1, line);
            }
            return;
        }
        let segment = match self.motion {
            Motion::Clockwise => self.arc(from, to, block, true),
            Motion::Counterclockwise => self.arc(from, to, block, false),
            Motion::Straight => Some(PathSegment::Line { to }),
            Motion::Rapid => {
                self.report(Severity::Warning, code!("drill.rapid_while_down"), 1, line);
                Some(PathSegment::Line { to })
            }
        };
        let segment = segment.unwrap_or_else(|| {
            self.report(Severity::Error, code!("drill.arc_without_centre"), 1, line);
            PathSegment::Line { to }
        });
        self.moves += 1;
        if let Some(route) = &mut self.route {
            route.segments.push(segment);
        }
    }

    fn arc(&self, from: Point, to: Point, block: &Block, clockwise: bool) -> Option<PathSegment> {
        let length =
            |number: Option<Decimal>| number.map_or(Some(Length::ZERO), |number| self.scale.length(number));
        let centre = if let Some(radius) = block.radius {
            from_radius(from, to, self.scale.length(radius)?.mm(), clockwise)?
        } else if block.centre.any() {
            let middle = Point::new(from.x + length(block.centre.x)?, from.y + length(block.centre.y)?);
            checked(from, to, middle)?
        } else {
            return None;
        };
        Some(PathSegment::Arc { to, centre, clockwise })
    }

    /// M15: plunges the tool.
    pub(super) fn tool_down(&mut self) {
        self.tool_up();
        let tool = self.tool_in_use();
        self.route = Some(Route { from: self.at, segments: Vec::new(), line: self.line, tool });
    }

    /// M16, M17: retracts the tool.
    pub(super) fn tool_up(&mut self) {
        match self.route.take() {
            Some(route) if route.segments.is_empty() => {
                self.findings.at(Severity::Error, code!("drill.plunge_without_path"), route.line, 1, b"");
            }
            Some(route) => {
                self.moves += 1;
                self.out.routes.push(route);
            }
            None => {}
        }
    }

    /// `R5X1000`: repeats the last hit five times, each one step further.
    pub(super) fn repeat(&mut self, count: Decimal, step: Pair) -> Result<(), Diagnostic> {
        let last = self.out.hits.last().filter(|hit| hit.at == self.at).copied();
        let (Some(hit), false, true) = (last, count.point || count.mantissa < 0, step.any()) else {
            self.report(Severity::Error, code!("drill.repeat_of_nothing"), 1, b"");
            return Ok(());
        };
        let count = usize::try_from(count.mantissa).unwrap_or(usize::MAX);
        self.repeated = self.repeated.saturating_add(count);
        if self.repeated >= MOST_REPEATED {
            return Err(self.refusal(code!("drill.too_many_repeats")).with("most", MOST_REPEATED));
        }
        let was = (self.incremental, self.zero);
        self.incremental = true;
        for _ in 0..count {
            if !self.go(step) {
                break;
            }
            self.out.hits.push(Hit { at: self.at, line: self.line, ..hit });
        }
        (self.incremental, self.zero) = was;
        Ok(())
    }

    fn lengths(&self) -> [usize; 3] {
        [self.out.hits.len(), self.out.slots.len(), self.out.routes.len()]
    }

    /// M25: starts a pattern.
    pub(super) fn pattern_starts(&mut self) {
        self.pattern = Some(Pattern { from: self.lengths(), to: None, shift: Point::default() });
    }

    /// M01: ends the pattern.
    pub(super) fn pattern_ends(&mut self) {
        self.tool_up();
        let lengths = self.lengths();
        if let Some(pattern) = &mut self.pattern {
            pattern.to.get_or_insert(lengths);
        }
    }

    /// M02 with coordinates: repeats the pattern, one step further than the last time.
    pub(super) fn pattern_again(&mut self, step: Pair) -> Result<(), Diagnostic> {
        self.pattern_ends();
        let Some(Pattern { from, to: Some(to), shift }) = self.pattern else {
            self.report(Severity::Error, code!("drill.repeat_of_nothing"), 1, b"");
            return Ok(());
        };
        let count = (0..3).map(|kind| to[kind] - from[kind]).sum::<usize>();
        self.repeated = self.repeated.saturating_add(count.max(1));
        if self.repeated >= MOST_REPEATED {
            return Err(self.refusal(code!("drill.too_many_repeats")).with("most", MOST_REPEATED));
        }
        let was = (self.incremental, self.at, self.zero);
        (self.incremental, self.at, self.zero) = (false, Point::default(), Point::default());
        let good = self.go(step);
        let by = Point::new(shift.x + self.at.x, shift.y + self.at.y);
        (self.incremental, self.at, self.zero) = was;
        if good && !self.stays(from, to, by) {
            self.report(Severity::Error, code!("drill.out_of_range"), 1, b"");
        } else if good {
            self.copy(from, to, by);
            self.pattern = Some(Pattern { from, to: Some(to), shift: by });
        }
        Ok(())
    }

    /// True if a pattern moved `by` stays within the limits of coordinates.
    fn stays(&self, from: [usize; 3], to: [usize; 3], by: Point) -> bool {
        let far =
            |point: Point| (point.x + by.x).abs() > Length::LIMIT || (point.y + by.y).abs() > Length::LIMIT;
        let hits = self.out.hits.get(from[0]..to[0]).unwrap_or_default();
        let slots = self.out.slots.get(from[1]..to[1]).unwrap_or_default();
        let routes = self.out.routes.get(from[2]..to[2]).unwrap_or_default();
        !far(Point::default())
            && !hits.iter().any(|hit| far(hit.at))
            && !slots.iter().any(|slot| far(slot.from) || far(slot.to))
            && !routes.iter().any(|route| far(route.from) || route.segments.iter().any(|s| far(s.to())))
    }

    fn copy(&mut self, from: [usize; 3], to: [usize; 3], by: Point) {
        let moved = |point: Point| Point::new(point.x + by.x, point.y + by.y);
        let line = self.line;
        let start = self.out.hits.len();
        for index in from[0]..to[0] {
            let Some(&hit) = self.out.hits.get(index) else { break };
            self.out.hits.push(Hit { at: moved(hit.at), line, ..hit });
        }
        for index in from[1]..to[1] {
            let Some(&slot) = self.out.slots.get(index) else { break };
            let after_hits = slot.after_hits + (start - from[0]) as u32;
            self.out.slots.push(SlotEntry {
                from: moved(slot.from),
                to: moved(slot.to),
                line,
                after_hits,
                ..slot
            });
        }
        for index in from[2]..to[2] {
            let Some(route) = self.out.routes.get(index) else { break };
            let segments = route.segments.iter().map(|segment| match *segment {
                PathSegment::Line { to } => PathSegment::Line { to: moved(to) },
                PathSegment::Arc { to, centre, clockwise } => {
                    PathSegment::Arc { to: moved(to), centre: moved(centre), clockwise }
                }
            });
            let route =
                Route { from: moved(route.from), segments: segments.collect(), line, tool: route.tool };
            self.moves += 1 + route.segments.len();
            self.out.routes.push(route);
        }
    }
}

/// Tolerance for the difference of both radii: files round to a few micrometres.
const RADIUS_SLACK_MM: f64 = 0.05;

/// The center given by I and J, if both ends have the same distance from it.
fn checked(from: Point, to: Point, centre: Point) -> Option<Point> {
    let (first, second) = (from.distance_mm(centre), to.distance_mm(centre));
    (first > 0.0 && (first - second).abs() <= RADIUS_SLACK_MM).then_some(centre)
}

/// The center of the shorter arc of radius `radius_mm`.
///
/// ```text
///        to ●
///         / |  h       h² = A² − (c/2)²
///        /  |
///   from ●──●mid──▶ for a counter-clockwise arc (G03), the center is left of the path
/// ```
fn from_radius(from: Point, to: Point, radius_mm: f64, clockwise: bool) -> Option<Point> {
    let chord = from.distance_mm(to);
    if chord <= 0.0 || chord > 2.0 * radius_mm + RADIUS_SLACK_MM {
        return None;
    }
    let height = libm::sqrt((radius_mm * radius_mm - chord * chord / 4.0).max(0.0));
    let side = if clockwise { -height } else { height };
    let (dx, dy) = ((to.x - from.x).mm() / chord, (to.y - from.y).mm() / chord);
    let middle = ((from.x.mm() + to.x.mm()) / 2.0, (from.y.mm() + to.y.mm()) / 2.0);
    Some(Point::from_mm(middle.0 - dy * side, middle.1 + dx * side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radius_gives_the_arc_centre_on_the_right_side() {
        let (from, to) = (Point::from_mm(30.0, 25.0), Point::from_mm(35.0, 30.0));
        assert_eq!(from_radius(from, to, 5.0, false), Some(Point::from_mm(30.0, 30.0)));
        assert_eq!(from_radius(from, to, 5.0, true), Some(Point::from_mm(35.0, 25.0)));
        assert_eq!(from_radius(from, to, 3.0, true), None);
        assert_eq!(checked(from, to, Point::from_mm(30.0, 30.0)), Some(Point::from_mm(30.0, 30.0)));
        assert_eq!(checked(from, to, Point::from_mm(31.0, 30.0)), None);
    }
}
