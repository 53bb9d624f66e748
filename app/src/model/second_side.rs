//! The second side: holes of the board found by the tip or by a camera, the best shift and turn, and the job that goes along.
//!
//! ```text
//! job ─▶ two or three holes at its corners ─ tip or crosshair over each, taken ─▶ BoardFit ─ applied ─▶ another job, timed, shown, run
//!
//!   dot made by the tip at P, crosshair on it at Q:   camera = P − Q, once for all; what it sees is where the head is, plus that
//! ```
//!
//! Comes in: wishes, where the head is, whether a camera is there. Goes out: the job that goes along, wishes to see. Places of the
//! machine in mm; planned ones in work coordinates. Knows no pixels.
//!
//! A found place is worth what the machine's own places are worth: when those are lost, or another machine is there, it is forgotten.

use super::{Effect, Job, Lane, Model};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, Settings, ToTime};
use annulus_core::align::{BoardFit, FoundHole, aligned, telling};
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Mark, Program};
use annulus_core::wire::program;
use std::sync::Arc;

/// How far a board may lie from its plan once the work zero is another one than when its holes were found, mm. The same zero says by
/// itself that it is meant.
const FURTHEST_MM: f64 = 20.0;
/// How far the work zero may be from where it was to be the same, mm: less than the rounding of any report.
const SAME_ZERO_MM: f64 = 0.01;

/// What there is of a camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Eye {
    /// Nobody asked for it.
    #[default]
    Shut,
    /// The browser asks the person, or the camera wakes up.
    Opening,
    /// Its picture is there.
    Open,
    /// There is none, and why.
    Blind(Diagnostic),
}

/// A hole to be found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoughtHole {
    /// Where it is planned, work coordinates.
    pub planned: Point,
    /// Where it was found, machine mm.
    pub found_mm: Option<[f64; 2]>,
}

/// The second side as it stands.
#[derive(Clone, Debug, Default)]
pub struct SecondSide {
    /// Its block is open.
    pub open: bool,
    /// The holes.
    pub holes: Vec<SoughtHole>,
    /// Which of them is sought.
    pub aimed: usize,
    /// The camera.
    pub eye: Eye,
    /// What the crosshair sees, from the spindle, mm; none before it was learnt.
    pub offset_mm: Option<[f64; 2]>,
    /// Where the tip made a dot, machine mm.
    pub dot_mm: Option<[f64; 2]>,
    /// How the board lies, or why that cannot be told; none before two holes are found.
    pub fit: Option<Result<BoardFit, Diagnostic>>,
    /// The job goes along.
    pub applied: bool,
    /// Holes were found whose places count no more; until the person was told before a start, or found some again.
    pub forgotten: bool,
    /// The job as it lies there, once it is timed.
    pub job: Option<Arc<Job>>,
    /// The work zero when a hole was taken last, machine mm.
    zero_mm: Option<[f64; 2]>,
    /// The planned job that the holes are of.
    of: Option<Arc<Job>>,
    /// The fit that is in `job`, or on its way: the request.
    made: Option<(BoardFit, Option<u32>)>,
    /// All holes that could be sought.
    places: Arc<Vec<Point>>,
}

/// What happens about it.
#[derive(Clone, Debug, PartialEq)]
pub enum SecondSideEvent {
    /// Its block is opened or closed.
    Show {
        /// Opened.
        on: bool,
    },
    /// This hole is sought.
    Aim {
        /// Which.
        hole: usize,
    },
    /// The hole that is sought is where the tip is, or under the crosshair.
    Take {
        /// Under the crosshair.
        by_camera: bool,
    },
    /// The hole that is sought was not found after all.
    Forget,
    /// Another hole of the board in its place.
    Other,
    /// The camera is wanted, or not any more.
    Look {
        /// Wanted.
        on: bool,
    },
    /// What became of the camera.
    Eye {
        /// How it is.
        eye: Eye,
    },
    /// The tip made a dot where it is.
    Dot,
    /// The crosshair is on the dot.
    OnDot,
    /// The offset that was learnt before.
    Kept {
        /// From the spindle, mm.
        offset_mm: [f64; 2],
    },
    /// The job is to go along, or not.
    Apply {
        /// It is.
        on: bool,
    },
}

impl SecondSide {
    /// The job that goes along is still being made.
    pub fn waits(&self) -> bool {
        matches!(self.made, Some((_, Some(_))))
    }

    /// Whether this request is waited for.
    pub(super) fn waits_for(&self, number: u32) -> bool {
        matches!(self.made, Some((_, Some(wanted))) if wanted == number)
    }

    /// The fit of the job that goes along.
    pub fn lies(&self) -> Option<&BoardFit> {
        self.made.as_ref().filter(|_| self.job.is_some()).map(|(fit, _)| fit)
    }
}

/// How a board lies, in words.
pub fn told(fit: &BoardFit) -> Diagnostic {
    let mm = |mm: f64| format!("{mm:.3}");
    let told = Diagnostic::warning("align.lies").with("degrees", mm(fit.degrees()));
    told.with("x", mm(fit.shift_mm[0])).with("y", mm(fit.shift_mm[1])).with("left", mm(fit.left_over_mm))
}

/// Takes one event in.
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
        // What comes late finds it shut.
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

/// Places of the machine are other ones from now on: what was found in them counts no more.
pub(super) fn forget(side: &mut SecondSide) {
    side.forgotten |= side.holes.iter().any(|hole| hole.found_mm.is_some());
    side.holes.iter_mut().for_each(|hole| hole.found_mm = None);
    (side.applied, side.dot_mm, side.zero_mm) = (false, None, None);
}

/// What is said before a start where found places were forgotten: the job lies as it is planned.
pub(super) fn forgotten(side: &SecondSide) -> Option<Diagnostic> {
    side.forgotten.then(|| Diagnostic::warning("align.forgotten"))
}

/// The hole that is sought is there; the next one that is not found yet is sought then.
fn taken(side: &mut SecondSide, place_mm: [f64; 2]) {
    if let Some(hole) = side.holes.get_mut(side.aimed) {
        hole.found_mm = Some(place_mm);
    }
    side.aimed = side.holes.iter().position(|hole| hole.found_mm.is_none()).unwrap_or(side.aimed);
}

/// The hole of the board behind the one that is sought, as the board lists them.
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

/// Where the tip is, machine mm; none where the machine does not know its place.
fn head_mm(model: &Model) -> Option<[f64; 2]> {
    let status = model.link.status.as_ref().filter(|status| status.trust == Trust::Trusted)?;
    Some([status.machine_mm[0], status.machine_mm[1]])
}

/// The holes follow the planned job; the fit, and the job that goes along, follow what was found.
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

/// Another plan: where its holes are the same ones, what was found stays.
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

/// Where the board has holes as it lies for the plan; of a program alone, where it drills.
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

/// How the board lies, from the holes that are found.
fn fit(holes: &[SoughtHole], zero_mm: Option<[f64; 2]>) -> Option<Result<BoardFit, Diagnostic>> {
    let zero = zero_mm?;
    let found = |hole: &SoughtHole| {
        let [x, y] = hole.found_mm?;
        Some(FoundHole { planned: hole.planned, found: Point::from_mm(x - zero[0], y - zero[1]) })
    };
    let found: Vec<FoundHole> = holes.iter().filter_map(found).collect();
    (found.len() > 1).then(|| BoardFit::of(&found))
}

/// The fit, unless the work zero was set elsewhere since its holes were found, and the board would lie far from its plan.
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
    let why = Diagnostic::error("align.zero_elsewhere").with("moved", mm(moved.unwrap_or_default()));
    Err(why.with("mm", mm(far_mm(fit.shift_mm))))
}

/// The job that goes along is timed.
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
