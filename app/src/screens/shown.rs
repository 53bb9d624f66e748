//! The board in the picture and its progress, for each screen.

use crate::keys::Tab;
use crate::model::{Job, Model, job_board};
use crate::page::{board, peek, read, shared, watch};
use crate::picture;
use crate::toolpaths::{self, Toolpaths};
use crate::view::{FilledLayer, OrderProgress};
use annulus_core::board::{Board, Hole};
use annulus_core::cam::work::{Flip, OperationKind};
use annulus_core::geometry::{Bounds, Point, Region};
use annulus_core::job::{Command, Leg, Mark, Program, Stage};
use leptos::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shown {
    pub board: Arc<Board>,
    pub order: Vec<u32>,
    /// The work zero, on the board as placed on the machine.
    pub work_zero: Point,
    /// The work zero, on the board as shown.
    pub start: Point,
    /// Bounds of the board. The lower left corner is the picture's origin.
    pub body: Option<Bounds>,
    pub toolpaths: Option<Arc<Toolpaths>>,
    /// Disc and stop of every hole.
    pub discs: Vec<(u32, u32)>,
    /// The operation of each toolpath, by index; empty if unknown.
    pub toolpath_operations: Vec<u16>,
    /// The kind of each operation of the job, see [`picture::kind`].
    pub kinds: Vec<usize>,
    /// Filled layers, lowest first.
    pub layers: Vec<FilledLayer>,
    /// Show the travel in file order instead of the planned order.
    pub before: bool,
}

impl Shown {
    pub(crate) fn hole_of_disc(&self, disc: usize) -> Option<u32> {
        (disc < self.board.holes.len()).then_some(disc as u32)
    }

    pub(crate) fn disc_of_hole(&self, hole: u32) -> Option<usize> {
        self.hole_of_disc(hole as usize).map(|hole| hole as usize)
    }

    /// The operation of a stop. `None` for a hole, and if unknown.
    pub(crate) fn operation_of(&self, stop: u32) -> Option<usize> {
        let Mark::Toolpath(toolpath) = *self.toolpaths.as_ref()?.stops.get(stop as usize)? else {
            return None;
        };
        self.toolpath_operations.get(toolpath as usize).copied().map(usize::from)
    }

    /// Index of a stop's colour: the kind of its operation; if unknown, its tool.
    pub(crate) fn colour_of(&self, stop: u32) -> usize {
        let kind = self.operation_of(stop).and_then(|operation| self.kinds.get(operation).copied());
        let bit = || {
            let cuts = &self.toolpaths.as_ref()?.cuts;
            cuts.get(cuts.partition_point(|cut| cut.stop < stop)).map(|cut| cut.bit as usize)
        };
        kind.or_else(bit).unwrap_or(0)
    }

    /// True if the operation drills or mills holes.
    pub(crate) fn makes_holes(&self, operation: usize) -> bool {
        let word = self.kinds.get(operation).and_then(|kind| OperationKind::WORDS.get(*kind).copied());
        matches!(word, Some("drill" | "mill_holes"))
    }

    /// The kinds of operation with toolpaths in the picture, ascending.
    pub(crate) fn kinds_shown(&self) -> Vec<usize> {
        let operations: BTreeSet<u16> = self.toolpath_operations.iter().copied().collect();
        let kinds =
            operations.iter().filter_map(|operation| self.kinds.get(usize::from(*operation)).copied());
        let kinds: BTreeSet<usize> = kinds.filter(|_| self.toolpaths.is_some()).collect();
        kinds.into_iter().collect()
    }

    pub(crate) fn work_of_picture(&self, at_mm: [f64; 2]) -> [f64; 2] {
        let origin = picture::origin(self.body);
        [at_mm[0] + (origin.x - self.work_zero.x).mm(), at_mm[1] + (origin.y - self.work_zero.y).mm()]
    }

    pub(crate) fn picture_of_work(&self, at_mm: [f64; 2]) -> [f32; 2] {
        let [x, y] = self.work_of_picture([0.0, 0.0]);
        [(at_mm[0] - x) as f32, (at_mm[1] - y) as f32]
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moment {
    pub progress: OrderProgress,
    /// The tool's position in work coordinates.
    pub head_mm: Option<[f64; 2]>,
}

/// The holes that the last run left out, according to the machine's status.
pub(crate) fn missing_holes() -> Memo<Vec<u32>> {
    let told = Memo::new(move |_| {
        shared(|m| &m.link.status).with(|status| status.as_ref().and_then(|one| one.missing.clone()))
    });
    Memo::new(move |_| {
        let Some(told) = told.get() else { return Vec::new() };
        let own = |job: &Option<Arc<Job>>| job.clone().filter(|job| job.key == told.job);
        let Some(job) = shared(|m| &m.board.job).with(own).or_else(|| shared(|m| &m.start.fetched).with(own))
        else {
            return Vec::new();
        };
        let runs = told.legs.iter().flat_map(|(from, to)| *from as usize..*to as usize);
        let marks = runs.filter_map(|leg| job.program.legs.get(leg)).map(|leg| leg.mark);
        marks.filter_map(|mark| if let Mark::Hole(hole) = mark { Some(hole) } else { None }).collect()
    })
}

/// Origin of rulers, readouts and lists, in file coordinates: the work zero; before there is a plan, the
/// corner of the board.
pub(crate) fn zero() -> Point {
    let planned = read(|m| m.board.plan.as_ref().map(|plan| plan.origin));
    let corner = || {
        shared(|m| &m.board.document)
            .with(|open| open.as_ref().map(|open| picture::origin(open.reading.body)))
    };
    planned.or_else(corner).unwrap_or_default()
}

/// The kind of each operation of the job.
fn kinds_of(model: &Model) -> Vec<usize> {
    let operations = model.job.work.iter().flat_map(|work| &work.operations);
    operations.map(picture::kind).collect()
}

pub(crate) fn shown() -> Memo<Option<Arc<Shown>>> {
    let layers = Memo::new(move |_| super::layers::seen());
    let laid_layers = Memo::new(move |_| super::layers::seen_laid());
    let as_laid = move || read(|m| m.frame.tab != Tab::Board);
    let planned = Memo::new(move |_| {
        let document = shared(|m| &m.board.document).get()?;
        let laid = shared(|m| &m.board.laid).get().filter(|_| as_laid());
        let (board, body) = match &laid {
            Some(laid) => (laid.laid.board.clone(), laid.laid.body),
            None => (document.reading.board.clone(), document.reading.body),
        };
        let board = Arc::new(board);
        let layers = if laid.is_some() { laid_layers.get() } else { layers.get() };
        let plan = shared(|m| &m.board.plan).get();
        let (order, work_zero) = plan
            .as_ref()
            .map_or_else(|| (Vec::new(), picture::origin(body)), |plan| (plan.order(), plan.origin));
        let toolpath_operations = plan.map(|plan| plan.toolpath_operations.clone()).unwrap_or_default();
        // Of the job that was planned: an edit is planned at once.
        let kinds = peek(kinds_of);
        let turned = read(|m| m.board.laid.as_ref().is_some_and(|laid| laid.laid.turned));
        let toolpaths = board::toolpaths().get().filter(|_| as_laid() || !turned);
        // With pins next to the board, the placed board has another corner. Then the toolpaths are converted
        // again.
        let counts_alike = laid.is_some()
            || shared(|m| &m.board.laid).with(|laid| {
                laid.as_ref().is_none_or(|laid| picture::origin(laid.laid.body) == picture::origin(body))
            });
        let toolpaths = if counts_alike {
            toolpaths
        } else {
            let program = shared(|m| &m.board.program).get().filter(|_| toolpaths.is_some());
            program.map(|program| Arc::new(picture::program_in(&program, body)))
        };
        let start = if as_laid() || !turned { work_zero } else { turned_back(work_zero, body) };
        let before = read(|m| m.frame.show_before);
        let discs = toolpaths.as_ref().map(|toolpaths| discs(toolpaths, |hole, _| hole)).unwrap_or_default();
        Some(Arc::new(Shown {
            board,
            order,
            work_zero,
            start,
            body,
            toolpaths,
            discs,
            layers,
            before,
            toolpath_operations,
            kinds,
        }))
    });
    let at_machine = Memo::new(move |_| {
        let foreign = shared(|m| &m.start.shown).get().filter(|_| !machine_has_own_job());
        let Some(job) = foreign else { return planned.get() };
        let outline = outline_of(&job);
        // The copper fits only if the outline of the open board does.
        let layers = if outline.is_empty() { Vec::new() } else { laid_layers.get() };
        Some(Arc::new(Shown { layers, ..of_program(&job, outline) }))
    });
    Memo::new(move |_| if read(|m| m.frame.tab == Tab::Machine) { at_machine.get() } else { planned.get() })
}

/// True if the machine has the job of the open board, or none.
pub(crate) fn machine_has_own_job() -> bool {
    shared(|m| &m.start.shown).with(|shown| {
        let Some(shown) = shown else { return true };
        shared(|m| &m.board.job).with(|own| own.as_ref().is_some_and(|own| own.key == shown.key))
    })
}

/// Converts a point of the flipped board to the board as in the files.
fn turned_back(at: Point, body: Option<Bounds>) -> Point {
    let flip = read(|m| Some(m.job.work.as_ref()?.setup.flip));
    match (body, flip) {
        (Some(body), Some(Flip::LeftRight)) => Point::new(body.min.x + body.max.x - at.x, at.y),
        (Some(body), Some(Flip::TopBottom)) => Point::new(at.x, body.min.y + body.max.y - at.y),
        _ => at,
    }
}

fn outline_of(job: &Job) -> Region {
    let origin = read(|m| m.board.plan.as_ref().map(|plan| plan.origin));
    let outline = shared(|m| &m.board.laid)
        .with(|laid| job_board::outline(&job.program, &laid.as_ref()?.laid.board, origin?).cloned());
    outline.unwrap_or_default()
}

/// A board reconstructed from a program, for a page that was opened later: its holes in drill order, and
/// `outline` if known.
fn of_program(job: &Job, outline: Region) -> Shown {
    let program = &job.program;
    let mut bit = None;
    let mut holes = Vec::new();
    for leg in &program.legs {
        match leg.mark {
            Mark::ToolChange(index) => bit = program.bits.get(index as usize),
            Mark::Hole(_) => holes.extend(hole(program, leg, bit.map(|bit| bit.diameter))),
            _ => {}
        }
    }
    let order = (0..holes.len() as u32).collect();
    let board = Board { name: program.name.clone(), holes, outline, ..Board::default() };
    let body = picture::body_with(&board, milled(program));
    let toolpaths = picture::program_in(program, body);
    Shown {
        board: Arc::new(board),
        order,
        work_zero: program.origin,
        start: program.origin,
        body,
        discs: discs(&toolpaths, |_, number| number),
        toolpaths: Some(Arc::new(toolpaths)),
        layers: Vec::new(),
        toolpath_operations: Vec::new(),
        kinds: Vec::new(),
        before: false,
    }
}

/// Disc and stop of every hole. `disc` gives the disc from the hole and its position in the drill order.
fn discs(toolpaths: &Toolpaths, disc: impl Fn(u32, u32) -> u32) -> Vec<(u32, u32)> {
    let holes = (0..).zip(&toolpaths.stops).filter_map(|(stop, mark)| match mark {
        Mark::Hole(hole) => Some((stop, *hole)),
        _ => None,
    });
    (0..).zip(holes).map(|(number, (stop, hole))| (disc(hole, number), stop)).collect()
}

/// The milled points of a program, in file coordinates.
fn milled(program: &Program) -> impl Iterator<Item = Point> {
    let commands = program.legs.iter().flat_map(|leg| &leg.commands);
    commands.filter_map(|command| match command {
        Command::Mill { to, .. } | Command::MillArc { to, .. } => {
            Some(Point::new(to.x + program.origin.x, to.y + program.origin.y))
        }
        _ => None,
    })
}

fn hole(program: &Program, leg: &Leg, diameter: Option<annulus_core::units::Length>) -> Option<Hole> {
    let at = job_board::place(program, leg)?;
    Some(Hole { at, diameter, plated: None, source: 0, tool_code: 0, line: 0 })
}

pub(crate) fn moment() -> Moment {
    match read(|m| m.frame.tab) {
        Tab::Simulate => at_playback(),
        Tab::Machine => at_machine(),
        _ => Moment::default(),
    }
}

fn at_playback() -> Moment {
    let Some(now) = board::moment() else { return Moment::default() };
    let drilling = matches!(now.mark, Mark::Hole(_)) && matches!(now.stage, Stage::Approach | Stage::Drill);
    let [x, y, _] = now.position_mm;
    let done = board::toolpaths().with(|toolpaths| {
        toolpaths.as_ref().map_or(now.holes_done, |toolpaths| toolpaths.done(now.leg, now.holes_done))
    });
    Moment { progress: OrderProgress { discs: done, drilling, lines: done }, head_mm: Some([x, y]) }
}

/// The holes and toolpaths that the last job completed, if it is the shown one.
pub(crate) fn made_at_end() -> (u32, u32) {
    let shown = shared(|m| &m.start.shown).with(|job| job.as_ref().map(|job| job.key.clone()));
    watch(|m| &m.link.ended).with(|ended| {
        let ended = ended.as_ref().filter(|ended| Some(&ended.end.job) == shown.as_ref());
        ended.map_or((0, 0), |ended| (ended.end.holes_done, ended.end.toolpaths_done))
    })
}

/// Holes before the current leg are done; the current one is done once the tool retracts.
fn at_machine() -> Moment {
    let Some(status) = shared(|m| &m.link.status).get() else { return Moment::default() };
    let done = shared(|m| &m.start.shown).with(|job| {
        let (Some(job), Some(leg)) = (job, status.leg) else {
            let (holes, toolpaths) = made_at_end();
            return holes + toolpaths;
        };
        let legs = &job.program.legs;
        let behind = legs.iter().take(leg as usize).filter(|leg| toolpaths::is_stop(leg.mark)).count() as u32;
        let here = legs.get(leg as usize).is_some_and(|leg| matches!(leg.mark, Mark::Hole(_)));
        behind + u32::from(here && status.stage == Some(Stage::Retract))
    });
    let drilling = matches!(status.stage, Some(Stage::Approach | Stage::Drill));
    let [x, y, _] = status.work_mm;
    Moment { progress: OrderProgress { discs: done, drilling, lines: done }, head_mm: Some([x, y]) }
}
