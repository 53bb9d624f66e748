//! Alignment of the second side: holes located by tool tip or camera, the best shift and rotation, and the
//! aligned job.
//!
//! ```text
//! job ─▶ two or three holes at its corners ─ tip or crosshair on each ─▶ BoardFit ─ applied ─▶ aligned job
//!
//!   dot made by the tip at P, crosshair on it at Q:   camera offset = P − Q;   target = tool head + offset
//! ```
//!
//! Located positions are in machine mm, planned ones in work coordinates.
//!
//! A located position is only as good as the machine's position: it is dropped when that is lost or the
//! machine changes.

use super::{Effect, Job, Lane, Model};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, Settings, ToTime};
use annulus_core::align::{BoardFit, FoundHole, aligned, telling};
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Mark, Program};
use annulus_core::wire::program;
use annulus_core::{error, warning};
use std::sync::Arc;

/// Largest shift of the board from its plan, mm, if the work zero changed after the holes were located. With
/// the same zero any shift is accepted.
const FURTHEST_MM: f64 = 20.0;
/// Work zeros within this distance are the same, mm; less than the rounding of any report.
const SAME_ZERO_MM: f64 = 0.01;

/// State of the camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Eye {
    #[default]
    Shut,
    /// The browser asks the user, or the camera is starting.
    Opening,
    Open,
    Blind(Diagnostic),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoughtHole {
    /// Planned position, work coordinates.
    pub planned: Point,
    pub found_mm: Option<[f64; 2]>,
}

#[derive(Clone, Debug, Default)]
pub struct SecondSide {
    pub open: bool,
    pub holes: Vec<SoughtHole>,
    pub aimed: usize,
    pub eye: Eye,
    /// From the spindle axis to the crosshair, mm; `None` until it is learnt.
    pub offset_mm: Option<[f64; 2]>,
    pub dot_mm: Option<[f64; 2]>,
    /// Position of the board, or why it can't be computed; `None` until two holes are located.
    pub fit: Option<Result<BoardFit, Diagnostic>>,
    /// Align the job.
    pub applied: bool,
    /// Located holes were dropped. Reset by a start, by [`SecondSideEvent::Apply`] and by other holes.
    pub forgotten: bool,
    pub job: Option<Arc<Job>>,
    /// The work zero when a hole was taken last, machine mm.
    zero_mm: Option<[f64; 2]>,
    of: Option<Arc<Job>>,
    /// The fit used for `job`, and the request if the job is still being timed.
    made: Option<(BoardFit, Option<u32>)>,
    places: Arc<Vec<Point>>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum SecondSideEvent {
    Show {
        on: bool,
    },
    Aim {
        hole: usize,
    },
    Take {
        by_camera: bool,
    },
    /// Drop the selected hole's located position.
    Forget,
    /// Use another hole of the board instead of the selected one.
    Other,
    Look {
        on: bool,
    },
    Eye {
        eye: Eye,
    },
    Dot,
    /// The crosshair is on the dot.
    OnDot,
    Kept {
        /// From the spindle axis, mm.
        offset_mm: [f64; 2],
    },
    Apply {
        on: bool,
    },
}

impl SecondSide {
    /// The aligned job is still being timed.
    pub fn waits(&self) -> bool {
        matches!(self.made, Some((_, Some(_))))
    }

    pub(super) fn waits_for(&self, number: u32) -> bool {
        matches!(self.made, Some((_, Some(wanted))) if wanted == number)
    }

    /// The fit of the aligned job.
    pub fn lies(&self) -> Option<&BoardFit> {
        self.made.as_ref().filter(|_| self.job.is_some()).map(|(fit, _)| fit)
    }
}

pub fn told(fit: &BoardFit) -> Diagnostic {
    let mm = |mm: f64| format!("{mm:.3}");
    let told = warning!("align.lies", degrees = mm(fit.degrees()), ..);
    told.with("x", mm(fit.shift_mm[0])).with("y", mm(fit.shift_mm[1])).with("left", mm(fit.left_over_mm))
}

pub(super) fn update(model: &mut Model, event: SecondSideEvent) -> Vec<Effect> {
    let head = head_mm(model);
    let zero = model.link.status.as_ref().and_then(|status| status.zero_mm);
    let side = &mut model.second_side;
    match event {
        SecondSideEvent::Show { on } => {
            side.open = on;
            if !on && side.eye != Eye::Shut {
                side.eye = Eye::Shut;
                return vec![Effect::Camera { on: false }];
            }
        }
        SecondSideEvent::Aim { hole } => side.aimed = hole.min(side.holes.len().saturating_sub(1)),
        SecondSideEvent::Take { by_camera } => {
            let offset = if by_camera { side.offset_mm } else { Some([0.0; 2]) };
            if let (Some(head), Some(offset)) = (head, offset) {
                taken(side, [head[0] + offset[0], head[1] + offset[1]]);
                side.zero_mm = zero;
            }
        }
        SecondSideEvent::Forget => {
            if let Some(hole) = side.holes.get_mut(side.aimed) {
                hole.found_mm = None;
            }
        }
        SecondSideEvent::Other => other(side),
        SecondSideEvent::Look { on } => {
            side.eye = if on { Eye::Opening } else { Eye::Shut };
            return vec![Effect::Camera { on }];
        }
        // The camera may answer after it was closed: close it again.
        SecondSideEvent::Eye { eye } if side.eye != Eye::Shut => side.eye = eye,
        SecondSideEvent::Eye { .. } => return vec![Effect::Camera { on: false }],
        SecondSideEvent::Dot => side.dot_mm = head,
        SecondSideEvent::OnDot => {
            if let (Some(dot), Some(head)) = (side.dot_mm, head) {
                let offset_mm = [dot[0] - head[0], dot[1] - head[1]];
                side.offset_mm = Some(offset_mm);
                return vec![Effect::KeepCamera { offset_mm }];
            }
        }
        SecondSideEvent::Kept { offset_mm } => side.offset_mm = Some(offset_mm),
        SecondSideEvent::Apply { on } => (side.applied, side.forgotten) = (on, false),
    }
    Vec::new()
}

/// The machine's position was lost or the machine changed: drops the located positions.
pub(super) fn forget(side: &mut SecondSide) {
    side.forgotten |= side.holes.iter().any(|hole| hole.found_mm.is_some());
    side.holes.iter_mut().for_each(|hole| hole.found_mm = None);
    (side.applied, side.dot_mm, side.zero_mm) = (false, None, None);
}

/// Warning before a start: the located holes were dropped, so the job is not aligned.
pub(super) fn forgotten(side: &SecondSide) -> Option<Diagnostic> {
    side.forgotten.then(|| warning!("align.forgotten"))
}

/// Sets the selected hole's position and selects the next hole that has none.
fn taken(side: &mut SecondSide, place_mm: [f64; 2]) {
    if let Some(hole) = side.holes.get_mut(side.aimed) {
        hole.found_mm = Some(place_mm);
    }
    side.aimed = side.holes.iter().position(|hole| hole.found_mm.is_none()).unwrap_or(side.aimed);
}

/// Replaces the selected hole by the next one in the board's list.
fn other(side: &mut SecondSide) {
    let taken: Vec<Point> = side.holes.iter().map(|hole| hole.planned).collect();
    let Some(hole) = side.holes.get_mut(side.aimed) else { return };
    let from = side.places.iter().position(|at| *at == hole.planned).unwrap_or(0);
    let count = side.places.len();
    let next = (1..count).map(|step| side.places[(from + step) % count]).find(|at| !taken.contains(at));
    if let Some(planned) = next {
        *hole = SoughtHole { planned, found_mm: None };
    }
}

/// Position of the tool tip, machine mm; `None` if the position isn't trusted.
fn head_mm(model: &Model) -> Option<[f64; 2]> {
    let status = model.link.status.as_ref().filter(|status| status.trust == Trust::Trusted)?;
    Some([status.machine_mm[0], status.machine_mm[1]])
}

/// Updates the holes from the planned job, then the fit and the aligned job from the located holes.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let planned = model.board.job.clone();
    if model.link.status.as_ref().is_some_and(|status| status.trust != Trust::Trusted) {
        forget(&mut model.second_side);
    }
    let side = &model.second_side;
    if let Some(job) = planned.as_ref().filter(|job| !side.of.as_ref().is_some_and(|of| Arc::ptr_eq(of, job)))
        && (side.open || side.of.is_some())
    {
        begin(model, job);
    }
    if model.second_side.of.is_none() {
        return Vec::new();
    }
    let zero = model.link.status.as_ref().and_then(|status| status.zero_mm);
    let side = &mut model.second_side;
    side.fit = fit(&side.holes, zero).map(|fit| fit.and_then(|fit| believed(fit, side.zero_mm, zero)));
    let wanted = match (&side.fit, side.applied, planned) {
        (Some(Ok(fit)), true, Some(job)) => Some((*fit, job)),
        _ => None,
    };
    let Some((fit, job)) = wanted else {
        (side.made, side.job) = (None, None);
        return Vec::new();
    };
    if side.made.as_ref().is_some_and(|(made, _)| *made == fit) {
        return Vec::new();
    }
    let bytes = program::encode(&aligned(&job.program, &fit));
    let number = model.next_request();
    (model.second_side.made, model.second_side.job) = (Some((fit, Some(number))), None);
    let request = Request::Time(ToTime { program: bytes, machine: Settings::of(&model.machine) });
    vec![Effect::Ask { lane: Lane::Beside, number, request: Box::new(request) }]
}

/// The plan changed; located positions stay if the holes are the same.
fn begin(model: &mut Model, job: &Arc<Job>) {
    let places = places(model, &job.program);
    let hole = |planned| SoughtHole { planned, found_mm: None };
    let side = &mut model.second_side;
    if *side.places != places {
        side.holes = telling(&places).into_iter().map(hole).collect();
        (side.aimed, side.applied, side.forgotten) = (0, false, false);
    }
    (side.places, side.of) = (Arc::new(places), Some(job.clone()));
    (side.made, side.job) = (None, None);
}

/// All holes of the placed board; for a program without a board, the holes that it drills.
fn places(model: &Model, program: &Program) -> Vec<Point> {
    let from = |at: Point| Point::new(at.x - program.origin.x, at.y - program.origin.y);
    let of_board =
        model.board.laid.as_ref().map(|laid| laid.laid.board.holes.iter().map(|hole| from(hole.at)));
    let drilled = program.legs.iter().filter(|leg| matches!(leg.mark, Mark::Hole(_)));
    let drilled = drilled.filter_map(|leg| {
        leg.commands
            .iter()
            .find_map(|command| if let Command::Rapid { to } = command { Some(*to) } else { None })
    });
    match of_board {
        Some(holes) if holes.len() > 1 => holes.collect(),
        _ => drilled.collect(),
    }
}

/// The fit of the located holes; needs at least two.
fn fit(holes: &[SoughtHole], zero_mm: Option<[f64; 2]>) -> Option<Result<BoardFit, Diagnostic>> {
    let zero = zero_mm?;
    let found = |hole: &SoughtHole| {
        let [x, y] = hole.found_mm?;
        Some(FoundHole { planned: hole.planned, found: Point::from_mm(x - zero[0], y - zero[1]) })
    };
    let found: Vec<FoundHole> = holes.iter().filter_map(found).collect();
    (found.len() > 1).then(|| BoardFit::of(&found))
}

/// Rejects a fit if the work zero was moved after the holes were located and the board is far from its plan.
fn believed(
    fit: BoardFit,
    found_from_mm: Option<[f64; 2]>,
    zero_mm: Option<[f64; 2]>,
) -> Result<BoardFit, Diagnostic> {
    let far_mm = |[x, y]: [f64; 2]| (x * x + y * y).sqrt();
    let moved = found_from_mm.zip(zero_mm).map(|(from, to)| far_mm([to[0] - from[0], to[1] - from[1]]));
    if moved.is_none_or(|mm| mm <= SAME_ZERO_MM) || far_mm(fit.shift_mm) <= FURTHEST_MM {
        return Ok(fit);
    }
    let mm = |mm: f64| format!("{mm:.1}");
    let why = error!("align.zero_elsewhere", moved = mm(moved.unwrap_or_default()), ..);
    Err(why.with("mm", mm(far_mm(fit.shift_mm))))
}

pub(super) fn timed(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    let side = &mut model.second_side;
    let (Some((fit, number)), Some(of)) = (&mut side.made, &side.of) else { return Vec::new() };
    *number = None;
    if let Ok(Answer::Timed(timed)) = answer {
        let program = aligned(&of.program, fit);
        let bytes = program::encode(&program);
        let (key, stream_digest) = (program::key(&bytes), timed.stream_digest);
        side.job = Some(Arc::new(Job { program, bytes, key, stream_digest }));
    }
    Vec::new()
}
