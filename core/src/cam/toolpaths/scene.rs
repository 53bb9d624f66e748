//! The board as placed, prepared for planning: copies, pins, flip, zero, and zones.

use super::super::Corner;
use super::super::work::{Flip, Work, Zero};
use super::cut::{self, Area};
use super::kept::Kept;
use crate::board::{Board, Copper, Face};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Bounds, Path, Placement, Point, grow, path_bounds, rectangle, union};
use crate::machine::Machine;
use crate::units::Length;
use crate::warning;
use std::cell::{RefCell, RefMut};
use std::ops::Range;

pub struct PlacedBoard {
    /// With its copies and pins, flipped if its bottom is up.
    pub board: Board,
    /// The pin holes among its holes.
    pub pins: Range<u32>,
    /// The position that becomes the work zero.
    pub origin: Point,
    turning: Option<Placement>,
    /// Zones that tools must not enter.
    zones: Vec<Bounds>,
    /// Area of the toolpaths on the copper side; `None`: everywhere.
    pub(super) field: Option<Area>,
    /// The area inside the outer edges of the outline; `None` without an outline.
    body: Option<Area>,
    kept: RefCell<Kept>,
}

impl PlacedBoard {
    /// Places `board` as in `work`.
    pub fn of(board: &Board, work: &Work) -> Self {
        let setup = &work.setup;
        let mirror_x = setup.flip == Flip::LeftRight;
        let panel = board.panelled(setup.panel.columns, setup.panel.rows, setup.panel.gap);
        let pins = &setup.alignment;
        let pinned = panel.pinned(pins.pairs, pins.diameter, pins.margin, mirror_x);
        let pins = setup.pins(&pinned);
        let bottom = setup.face == Face::Bottom;
        let over = pinned.turning(mirror_x);
        let turning = over.filter(|_| bottom);
        let zone = |zone: &Bounds| match &turning {
            Some(turning) => Bounds::of(turning.point(zone.min)).with(turning.point(zone.max)),
            None => *zone,
        };
        let zones = setup.exclusions.iter().map(zone).collect();
        let laid = if bottom { pinned.turned(mirror_x) } else { pinned };
        let outlined = !laid.outline.is_empty();
        let field = outlined.then(|| Area::of(&grow(&laid.outline, setup.margin)));
        let body = outlined.then(|| Area::of(&laid.body()));
        let file = turning.as_ref().map_or(Point::default(), |turning| turning.point(Point::default()));
        let origin = match setup.zero {
            Zero::Board => super::super::origin(&panel, &laid, work),
            Zero::Blank => blank(&laid).map_or(file, |blank| blank.min),
            Zero::File => file,
        };
        let kept = RefCell::default();
        Self { origin, board: laid, pins, turning: over, zones, field, body, kept }
    }

    /// Uses the cache of an earlier plan, of this board or another.
    #[must_use]
    pub fn remembering(self, kept: Kept) -> Self {
        Self { kept: RefCell::new(kept), ..self }
    }

    pub fn kept(&self) -> Kept {
        let mut kept = self.kept.take();
        kept.tidy();
        kept
    }

    /// The cache, to be extended.
    pub(super) fn making(&self) -> RefMut<'_, Kept> {
        self.kept.borrow_mut()
    }

    /// Warning that the board has no outline, so the work zero is not its corner.
    pub(super) fn zero_without_outline(&self, work: &Work) -> Option<Diagnostic> {
        let untold = work.setup.zero == Zero::Board && Corner::of(&self.board, work) == Corner::Copper;
        untold.then(|| warning!("cam.zero_without_outline"))
    }

    /// The placement of a flip; `None` for an empty board.
    pub fn turning(&self) -> Option<Placement> {
        self.turning
    }

    /// Zones that tools must not enter, as placed.
    pub fn zones(&self) -> &[Bounds] {
        &self.zones
    }

    pub(super) fn copper(&self, face: Face) -> Option<&Copper> {
        self.board.copper.iter().find(|copper| copper.face == face && !copper.region.is_empty())
    }

    /// True if everything within `half` of `at` is outside the outer edges of the outline.
    pub(super) fn is_beside(&self, at: Point, half: Length) -> bool {
        let beyond = |body: &Area| !body.contains(at) && body.index().nearest(at, half).is_none();
        self.body.as_ref().is_some_and(beyond)
    }

    pub(super) fn closed_to(&self, width: Length) -> Option<Area> {
        let radius = Length::from_nm((width.nm() + 1) / 2);
        let boxes: Vec<Path> = self.zones.iter().map(|zone| rectangle(*zone)).collect();
        (!boxes.is_empty()).then(|| Area::of(&grow(&union(&boxes), radius)))
    }

    /// A warning for every zone of `work` that is outside everything, so that it has no effect.
    pub(super) fn idle_zones(&self, work: &Work) -> Vec<Diagnostic> {
        let Some(blank) = blank(&self.board) else { return Vec::new() };
        // A tool runs next to its cut; when clearing it may leave the outline by the margin.
        let widest = work.bits.iter().map(|bit| bit.diameter).max().unwrap_or_default();
        let all = blank.grown(widest + work.setup.margin);
        let beside = |zone: &Bounds| {
            zone.max.x < all.min.x
                || zone.min.x > all.max.x
                || zone.max.y < all.min.y
                || zone.min.y > all.max.y
        };
        let mm = |length: Length| format!("{:.2}", length.mm());
        let told = |zone: &Bounds| {
            let warning = warning!("cam.zone_beside", x = mm(zone.min.x), ..);
            let warning = warning.with("y", mm(zone.min.y));
            warning.with("to_x", mm(zone.max.x)).with("to_y", mm(zone.max.y))
        };
        let zones = self.zones.iter().zip(&work.setup.exclusions);
        zones.filter(|(laid, _)| beside(laid)).map(|(_, zone)| told(zone)).collect()
    }

    /// `paths` without the parts outside the field or in `closed`; also returns whether zones removed
    /// anything.
    pub(super) fn trimmed(&self, paths: Vec<Path>, closed: Option<&Area>) -> (Vec<Path>, bool) {
        let inside = match &self.field {
            Some(field) => paths.into_iter().flat_map(|path| kept(path, field, true)).collect(),
            None => paths,
        };
        let Some(closed) = closed else { return (inside, false) };
        let mut touched = false;
        let mut left = Vec::new();
        for path in inside {
            let before = path.clone();
            let parts = kept(path, closed, false);
            touched |= parts.len() != 1 || parts.first() != Some(&before);
            left.extend(parts);
        }
        (left, touched)
    }

    /// Tolerance of hole sizes: the drilling operation's, else the machine's.
    pub(super) fn tolerance(&self, work: &Work, machine: &Machine) -> Length {
        let said = work.operations.iter().filter_map(|one| super::board_tolerance(one, machine)).max();
        said.unwrap_or(machine.rack_tolerance)
    }
}

fn blank(board: &Board) -> Option<Bounds> {
    let copper = board.copper.iter().filter_map(|copper| copper.region.bounds());
    let all = board.outline.bounds().into_iter().chain(copper).chain(board.outer_bounds());
    all.reduce(|all, bounds| all.with(bounds.min).with(bounds.max))
}

/// The parts of `path` inside `area`, or outside; a detailed check only if the bounds meet an edge.
fn kept(path: Path, area: &Area, inside: bool) -> Vec<Path> {
    let bounds = path_bounds(&path);
    if area.index().edges_in(bounds).is_empty() {
        return if area.contains(bounds.min) == inside { vec![path] } else { Vec::new() };
    }
    cut::parts(&path, area, inside)
}
