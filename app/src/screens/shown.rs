//! Which board is in the picture, and how far along it is, on each screen.
//!
//! Comes in: the open document, its plan, the job of the machine, the playback. Goes out: [`Shown`] and [`Moment`].
//! Knows no pixels.

use crate::keys::Tab;
use crate::model::{Job, job_board};
use crate::page::link;
use crate::page::{frame, open_board, open_job, play};
use crate::picture;
use crate::toolpaths::{self, Toolpaths};
use crate::view::{FilledLayer, OrderProgress};
use annulus_core::board::{Board, Hole};
use annulus_core::cam::work::Flip;
use annulus_core::geometry::{Bounds, Point, Region};
use annulus_core::job::{Command, Leg, Mark, Program, Stage};
use leptos::prelude::*;
use std::sync::Arc;

/// A board with the order its holes are drilled in.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shown {
    /// The board.
    pub board: Arc<Board>,
    /// Its holes in order of drilling.
    pub order: Vec<u32>,
    /// The place of the board, as it lies, that is the work zero.
    pub work_zero: Point,
    /// The same on the board that is shown.
    pub start: Point,
    /// The box of the board, whose lower left corner the picture counts from.
    pub body: Option<Bounds>,
    /// What the program does, if there is one.
    pub toolpaths: Option<Arc<Toolpaths>>,
    /// Disc and stop of every hole.
    pub discs: Vec<(u32, u32)>,
    /// For every way, the operation that it belongs to, where that is known.
    pub toolpath_operations: Vec<u16>,
    /// Filled layers, the lowest first.
    pub layers: Vec<FilledLayer>,
    /// Show the toolpaths as in the file instead of the planned ones.
    pub before: bool,
}

impl Shown {
    /// The hole that disc `disc` stands for.
    pub(crate) fn hole_of_disc(&self, disc: usize) -> Option<u32> {
        (disc < self.board.holes.len()).then_some(disc as u32)
    }

    /// The disc of hole `hole`.
    pub(crate) fn disc_of_hole(&self, hole: u32) -> Option<usize> {
        self.hole_of_disc(hole as usize).map(|hole| hole as usize)
    }

    /// The operation that a stop belongs to; where that is not known, its bit tells them apart.
    pub(crate) fn operation_of(&self, stop: u32) -> usize {
        let toolpaths = self.toolpaths.as_ref();
        let mark = toolpaths.and_then(|toolpaths| toolpaths.stops.get(stop as usize));
        if let Some(Mark::Toolpath(way)) = mark
            && let Some(operation) = self.toolpath_operations.get(*way as usize)
        {
            return usize::from(*operation);
        }
        let cut = toolpaths
            .and_then(|toolpaths| toolpaths.cuts.get(toolpaths.cuts.partition_point(|cut| cut.stop < stop)));
        cut.map_or(0, |cut| cut.bit as usize)
    }

    /// Millimetres of the picture to work coordinates.
    pub(crate) fn work_of_picture(&self, at_mm: [f64; 2]) -> [f64; 2] {
        let origin = picture::origin(self.body);
        [at_mm[0] + (origin.x - self.work_zero.x).mm(), at_mm[1] + (origin.y - self.work_zero.y).mm()]
    }

    /// And back.
    pub(crate) fn picture_of_work(&self, at_mm: [f64; 2]) -> [f32; 2] {
        let [x, y] = self.work_of_picture([0.0, 0.0]);
        [(at_mm[0] - x) as f32, (at_mm[1] - y) as f32]
    }
}

/// How far the shown board is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moment {
    /// Holes and toolpaths behind the head.
    pub progress: OrderProgress,
    /// The head in work coordinates.
    pub head_mm: Option<[f64; 2]>,
}

/// The holes that the last run left out, by the drill's own record.
pub(crate) fn missing_holes() -> Memo<Vec<u32>> {
    let line = link::link();
    let told =
        Memo::new(move |_| line.status.with(|status| status.as_ref().and_then(|one| one.missing.clone())));
    Memo::new(move |_| {
        let Some(told) = told.get() else { return Vec::new() };
        let own = |job: &Option<Arc<Job>>| job.clone().filter(|job| job.key == told.job);
        let Some(job) = open_board().job.with(own).or_else(|| link::link().fetched.with(own)) else {
            return Vec::new();
        };
        let runs = told.legs.iter().flat_map(|(from, to)| *from as usize..*to as usize);
        let marks = runs.filter_map(|leg| job.program.legs.get(leg)).map(|leg| leg.mark);
        marks.filter_map(|mark| if let Mark::Hole(hole) = mark { Some(hole) } else { None }).collect()
    })
}

/// The place in the files' coordinates that rulers, readings and lists of the open board count from: the work zero, and until a plan
/// says that, the corner of the board.
pub(crate) fn zero() -> Point {
    let planned = open_board().plan.with(|plan| plan.as_ref().map(|plan| plan.origin));
    let corner =
        || open_board().document.with(|open| open.as_ref().map(|open| picture::origin(open.reading.body)));
    planned.or_else(corner).unwrap_or_default()
}

/// The board in the picture.
pub(crate) fn shown() -> Memo<Option<Arc<Shown>>> {
    let desk = open_board();
    let layers = Memo::new(move |_| super::layers::seen());
    let laid_layers = Memo::new(move |_| super::layers::seen_laid());
    let as_laid = Memo::new(move |_| frame().tab.get() != Tab::Board);
    let planned = Memo::new(move |_| {
        let document = desk.document.get()?;
        let laid = desk.laid.get().filter(|_| as_laid.get());
        let (board, body) = match &laid {
            Some(laid) => (laid.laid.board.clone(), laid.laid.body),
            None => (document.reading.board.clone(), document.reading.body),
        };
        let board = Arc::new(board);
        let layers = if laid.is_some() { laid_layers.get() } else { layers.get() };
        let plan = desk.plan.get();
        let (order, work_zero) = plan
            .as_ref()
            .map_or_else(|| (Vec::new(), picture::origin(body)), |plan| (plan.order(), plan.origin));
        let toolpath_operations = plan.map(|plan| plan.toolpath_operations.clone()).unwrap_or_default();
        let turned = desk.laid.with(|laid| laid.as_ref().is_some_and(|laid| laid.laid.turned));
        let toolpaths = open_board().toolpaths.get().filter(|_| as_laid.get() || !turned);
        // As it lies a board may have pins beside it, from whose corner its picture counts then.
        let counts_alike = laid.is_some()
            || desk.laid.with(|laid| {
                laid.as_ref().is_none_or(|laid| picture::origin(laid.laid.body) == picture::origin(body))
            });
        let toolpaths = if counts_alike {
            toolpaths
        } else {
            let program = desk.program.get().filter(|_| toolpaths.is_some());
            program.map(|program| Arc::new(picture::program_in(&program, body)))
        };
        let start = if as_laid.get() || !turned { work_zero } else { turned_back(work_zero, body) };
        let before = frame().show_before.get();
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
        }))
    });
    let at_machine = Memo::new(move |_| {
        let foreign = link::link().shown_job.get().filter(|_| !machine_has_own_job());
        let Some(job) = foreign else { return planned.get() };
        let outline = outline_of(&job);
        // The copper of the open board lies where its outline does.
        let layers = if outline.is_empty() { Vec::new() } else { laid_layers.get() };
        Some(Arc::new(Shown { layers, ..of_program(&job, outline) }))
    });
    Memo::new(move |_| if frame().tab.get() == Tab::Machine { at_machine.get() } else { planned.get() })
}

/// Whether what the machine has is the job of the open board, or nothing.
pub(crate) fn machine_has_own_job() -> bool {
    link::link().shown_job.with(|shown| {
        let Some(shown) = shown else { return true };
        open_board().job.with(|own| own.as_ref().is_some_and(|own| own.key == shown.key))
    })
}

/// A place of the board that lies turned over, on the board as the files have it.
fn turned_back(at: Point, body: Option<Bounds>) -> Point {
    let flip = open_job().work.with(|work| work.as_ref().map(|work| work.setup.flip));
    match (body, flip) {
        (Some(body), Some(Flip::LeftRight)) => Point::new(body.min.x + body.max.x - at.x, at.y),
        (Some(body), Some(Flip::TopBottom)) => Point::new(at.x, body.min.y + body.max.y - at.y),
        _ => at,
    }
}

/// The outline of the open board, where that is the board of `job`.
fn outline_of(job: &Job) -> Region {
    let desk = open_board();
    let origin = desk.plan.with(|plan| plan.as_ref().map(|plan| plan.origin));
    let outline =
        desk.laid.with(|laid| job_board::outline(&job.program, &laid.as_ref()?.laid.board, origin?).cloned());
    outline.unwrap_or_default()
}

/// A board made of a program alone, for a page that opened later: its holes in order of drilling; its `outline` where that is known.
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
        before: false,
    }
}

/// The stop of every hole, by disc; `disc` finds it for a hole and its number in the order of drilling.
fn discs(toolpaths: &Toolpaths, disc: impl Fn(u32, u32) -> u32) -> Vec<(u32, u32)> {
    let holes = (0..).zip(&toolpaths.stops).filter_map(|(stop, mark)| match mark {
        Mark::Hole(hole) => Some((stop, *hole)),
        _ => None,
    });
    (0..).zip(holes).map(|(number, (stop, hole))| (disc(hole, number), stop)).collect()
}

/// Where a program mills, in the files' coordinates.
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

/// How far the screen's board is.
pub(crate) fn moment() -> Moment {
    match frame().tab.get() {
        Tab::Simulate => at_playback(),
        Tab::Machine => at_machine(),
        _ => Moment::default(),
    }
}

/// How far the playback is.
fn at_playback() -> Moment {
    let Some(now) = play().now() else { return Moment::default() };
    let drilling = matches!(now.mark, Mark::Hole(_)) && matches!(now.stage, Stage::Approach | Stage::Drill);
    let [x, y, _] = now.position_mm;
    let done = open_board().toolpaths.with(|toolpaths| {
        toolpaths.as_ref().map_or(now.holes_done, |toolpaths| toolpaths.done(now.leg, now.holes_done))
    });
    Moment { progress: OrderProgress { discs: done, drilling, lines: done }, head_mm: Some([x, y]) }
}

/// Nothing runs: the holes and the toolpaths that the last job made, if it is the one shown.
pub(crate) fn made_at_end(line: link::Link) -> (u32, u32) {
    let shown = link::link().shown_job.with(|job| job.as_ref().map(|job| job.key.clone()));
    line.ended.with(|ended| {
        let ended = ended.as_ref().filter(|ended| Some(&ended.job) == shown.as_ref());
        ended.map_or((0, 0), |ended| (ended.holes_done, ended.toolpaths_done))
    })
}

/// Holes whose legs lie behind the leg in work are done; in the leg itself once the bit goes up again.
fn at_machine() -> Moment {
    let line = link::link();
    let Some(status) = line.status.get() else { return Moment::default() };
    let done = link::link().shown_job.with(|job| {
        let (Some(job), Some(leg)) = (job, status.leg) else {
            let (holes, toolpaths) = made_at_end(line);
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
