//! Arming: the program becomes a stream, the stream is checked, and the pre-flight says row by row what was found.
//!
//! Comes in: a program's bytes and how the drill stands. Goes out: a [`Prepared`] job. Moves nothing.

use crate::surface::{Followed, Ground, KeptSurface, followed};
use annulus_core::board::bed;
use annulus_core::check;
use annulus_core::control::{State, Trust, lateness};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::worn::{self, Wear};
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program, bite, deepest};
use annulus_core::level::{TOLERANCE, level};
use annulus_core::machine::{self, Machine, RackTool, Steps, ToolWear};
use annulus_core::magazine::{Held, ToolStock, changes_ticks};
use annulus_core::motion;
use annulus_core::steps::{self, Packed, Segment, Switching, TICK_HZ};
use annulus_core::wire::{PreflightRow, RowVerdict, Tell, program};
use std::sync::Arc;
use std::thread;

/// How the drill stands when a job is prepared.
#[derive(Clone, Debug, PartialEq)]
pub struct Context {
    /// The machine.
    pub machine: Machine,
    /// Work zero in machine steps, where there is one.
    pub zero: Option<[i64; 2]>,
    /// What it is doing.
    pub state: State,
    /// What its position is worth.
    pub trust: Trust,
    /// The highest safe step rate, where time is real.
    pub safe_hz: Option<f64>,
    /// Whether the spindle answers, where it is one that tells of itself.
    pub spindle_answers: Option<bool>,
    /// What the tools of its rack have done.
    pub wear: Vec<ToolWear>,
    /// What lies in the magazine, where there is one.
    pub stock: Option<ToolStock>,
    /// An interrupted job.
    pub offer: Option<Broken>,
    /// The height map that was kept.
    pub surface: Option<Arc<KeptSurface>>,
}

/// A job that was broken off, as far as another start has to know it.
#[derive(Clone, Debug, PartialEq)]
pub struct Broken {
    /// SHA-256 of its program.
    pub key: String,
    /// The leg it goes on with.
    pub next_leg: u32,
    /// The work zero it was begun with, machine steps, where those still mean what they meant.
    pub zero_steps: Option<[i64; 2]>,
    /// The height map that it follows, by its key.
    pub levelled: Option<String>,
}

/// A job that was checked.
pub struct Prepared {
    /// SHA-256 of the program's bytes.
    pub key: String,
    /// These.
    pub bytes: Vec<u8>,
    /// The program, its depth as that of its height map where it follows one.
    pub program: Program,
    /// The height map that it follows.
    pub follows: Option<Arc<KeptSurface>>,
    /// Its steps.
    pub stream: Packed,
    /// Their digest.
    pub digest: String,
    /// Time from the start of every leg to the end of the job, with the changes that the machine makes by itself, in ticks.
    pub left_ticks: Vec<u64>,
    /// Work zero in machine steps, every tip on the board's surface.
    pub zero: Steps,
    /// What was found, row by row.
    pub checks: Vec<PreflightRow>,
    /// What it was prepared for; arming is void when that changed meanwhile.
    pub context: Context,
    /// Its feeds, percent of those in `bytes`.
    pub feed_percent: u8,
}

/// What a program becomes on a machine.
struct Planned {
    program: Program,
    stream: Packed,
    left_ticks: Vec<u64>,
}

impl Prepared {
    /// The verdict as everybody sees it.
    pub(crate) fn tell(&self) -> Tell {
        let (job, stream_digest) = (self.key.clone(), self.digest.clone());
        let levelled = self.follows.is_some();
        Tell::Armed { job, stream_digest, levelled, checks: self.checks.clone() }
    }

    /// The first reason against starting.
    pub(crate) fn refusal(&self) -> Option<Diagnostic> {
        self.checks.iter().find(|row| row.verdict == RowVerdict::Fail).map(|row| row.finding.clone())
    }

    /// Where leg `leg` starts when it is begun from rest, in machine steps: all spindles up.
    pub(crate) fn start_of_leg(&self, leg: usize) -> Steps {
        let from = self.before_leg(leg);
        let up = self.stream.start();
        std::array::from_fn(|axis| {
            self.zero[axis] + if axis < 2 { from[axis] } else { from[axis].max(up[axis]) }
        })
    }

    /// Whether the motors of X and Y went down in their numbers last before leg `leg`: so their play is taken up.
    fn down_before(&self, leg: usize) -> [bool; 2] {
        let mut down = [None; 2];
        for segment in (0..leg).rev().flat_map(|leg| self.stream.leg(leg).into_iter().rev()) {
            for (axis, down) in down.iter_mut().enumerate() {
                let last = segment.runs.iter().rev().find(|run| run.axes >> axis & 1 == 1);
                *down = down.or(last.map(|run| !run.forward));
            }
            if down.iter().all(Option::is_some) {
                break;
            }
        }
        down.map(Option::unwrap_or_default)
    }

    /// Where the motors of X and Y go first, in machine steps, when leg `leg` is begun from anywhere: so that they come to its
    /// start from the side that the stream has them come from, with their play taken up.
    pub(crate) fn before_start(&self, machine: &Machine, leg: usize) -> Steps {
        let mut start = self.start_of_leg(leg);
        for (axis, down) in self.down_before(leg).into_iter().enumerate() {
            let settings = machine.axis(axis);
            let play = settings.scale.steps(settings.backlash);
            start[axis] += if down { play } else { -play };
            start[axis] = start[axis].max(settings.scale.steps(settings.min));
        }
        start
    }

    /// Where everything stands when leg `leg` follows the one before, in steps from the work zero.
    pub fn before_leg(&self, leg: usize) -> Steps {
        self.stream.before(leg)
    }

    /// Whether leg `leg` goes on from the bottom of the hole before.
    pub(crate) fn begins_low(&self, leg: usize) -> bool {
        !self.stream.range(leg).is_empty() && self.before_leg(leg)[2..].iter().any(|height| *height < 0)
    }

    /// Leg `leg` as it is begun with all spindles up. Where the stream goes on from its bottom, it is left there.
    pub(crate) fn entry(&self, machine: &Machine, leg: usize) -> Result<Vec<Segment>, Diagnostic> {
        let mut alone = motion::leg_alone(&self.program, machine, leg, self.down_before(leg))?;
        if self.begins_low(leg + 1) {
            alone.moves.pop();
        }
        Ok(alone.moves.iter().map(|planned| steps::segment(planned, machine)).collect())
    }

    /// What lifts the spindles after leg `leg` when the next one does not follow at once.
    pub(crate) fn lift(&self, machine: &Machine, leg: usize) -> Result<Vec<Segment>, Diagnostic> {
        let alone = motion::leg_alone(&self.program, machine, leg, self.down_before(leg))?;
        Ok(alone.moves.last().map(|planned| steps::segment(planned, machine)).into_iter().collect())
    }

    /// How many steps of Z the board lies higher than flat at the hole that leg `leg` of a job that follows a height map drills.
    pub(crate) fn board_steps(&self, machine: &Machine, leg: usize) -> i64 {
        let hole = self.program.legs.get(leg).filter(|leg| matches!(leg.mark, Mark::Hole(_)));
        let place = hole.and_then(|leg| {
            leg.commands.iter().find_map(|command| match command {
                Command::Rapid { to } => Some(*to),
                _ => None,
            })
        });
        let height = self.follows.as_ref().zip(place).map(|(kept, at)| kept.map.height(at));
        height.map_or(0, |height| machine.z.scale.steps(height))
    }

    /// What is in force before segment `first`: bit and spindle speed.
    pub(crate) fn in_force(&self, first: usize) -> (Option<u32>, u32) {
        let (mut bit, mut rpm) = (None, 0);
        for effect in self.stream.effects_before(first) {
            match effect {
                Switching::Spindle { rpm: speed } => rpm = speed,
                Switching::AwaitBit { bit: wanted } => bit = Some(wanted),
                Switching::None | Switching::Foot { .. } => {}
            }
        }
        (bit, rpm)
    }

    /// Holes and toolpaths of the legs before `leg`.
    pub(crate) fn done_before(&self, leg: usize) -> (u32, u32) {
        made(self.program.legs.iter().take(leg))
    }
}

/// Holes and toolpaths of `legs`.
pub(crate) fn made<'a>(legs: impl Iterator<Item = &'a Leg>) -> (u32, u32) {
    legs.fold((0, 0), |(holes, toolpaths), leg| match leg.mark {
        Mark::Hole(_) => (holes + 1, toolpaths),
        Mark::Toolpath(_) => (holes, toolpaths + 1),
        _ => (holes, toolpaths),
    })
}

pub(crate) fn row(verdict: RowVerdict, finding: Diagnostic) -> PreflightRow {
    PreflightRow { finding, verdict }
}

fn note(code: &str) -> Diagnostic {
    Diagnostic::note(code)
}

/// The job `bytes` prepared for the drill as it stands.
pub fn prepare(key: &str, bytes: &[u8], from_leg: u32, context: &Context) -> Result<Prepared, Diagnostic> {
    let machine = &context.machine;
    let program = program::decode(bytes)?;
    let taken_up = context.offer.as_ref().filter(|broken| broken.key == key);
    let plane = context.zero.or(taken_up.and_then(|broken| broken.zero_steps));
    let begun = taken_up.filter(|_| from_leg > 0).map(|broken| broken.levelled.as_deref());
    let ground = Ground { machine, zero_steps: plane, kept: context.surface.as_ref(), begun };
    let Followed { program, follows, told } = followed(program, &ground);
    let plan = planned(program, context)?;
    let Planned { program, stream, left_ticks, .. } = &plan;
    let mut zero = machine.on_surface();
    [zero[0], zero[1]] = plane.unwrap_or_default();
    let left_s = left_ticks.get(from_leg as usize).copied().unwrap_or(0) as f64 / TICK_HZ as f64;
    let mut checks = standing(context, plane);
    checks.push(if program.machine == machine.fingerprint() {
        row(RowVerdict::Pass, note("preflight.same_machine"))
    } else {
        row(RowVerdict::Fail, Diagnostic::error("preflight.other_machine"))
    });
    let (digest, verdict) = judged(stream, machine, plane.map(|_| zero));
    match verdict {
        Some(Ok(())) => checks.push(row(RowVerdict::Pass, note("preflight.stream_safe"))),
        Some(Err(reasons)) => {
            checks.extend(reasons.into_iter().take(20).map(|why| row(RowVerdict::Fail, why)));
        }
        None => {}
    }
    checks.extend(context.safe_hz.map(|safe_hz| in_time(stream, safe_hz)));
    checks.extend(context.spindle_answers.map(|answers| {
        let silent = || row(RowVerdict::Fail, Diagnostic::error("preflight.spindle_silent"));
        if answers { row(RowVerdict::Pass, note("preflight.spindle_answers")) } else { silent() }
    }));
    checks.extend(told);
    checks.extend(machine::warnings(machine).into_iter().map(|warning| row(RowVerdict::Warn, warning)));
    checks.extend(unknown_bit(program).map(|why| row(RowVerdict::Fail, why)));
    checks.extend(bite::judged_all(program).into_iter().map(|why| row(RowVerdict::Warn, why)));
    let missing = missing_drills(program, machine);
    if !missing.is_empty() {
        let why = Diagnostic::warning("preflight.bit_not_in_rack").with("bits", missing.join(", "));
        checks.push(row(RowVerdict::Warn, why));
    }
    checks.extend(worn_tools(program, machine, (from_leg as usize, &context.wear)));
    if let Some(stock) = &context.stock {
        checks.extend(magazine(program, from_leg as usize, stock));
    } else if let Some(bit) = bit_of_leg(program, from_leg as usize) {
        checks.push(row(RowVerdict::Warn, note("preflight.first_bit").with("bit", bit.titled())));
    }
    checks.extend(far_below(program, machine));
    checks.extend(accepted(program));
    checks.extend(given_up(key, from_leg, context).map(|why| row(RowVerdict::Warn, why)));
    checks.push(row(RowVerdict::Pass, rest(program, from_leg as usize, left_s)));
    let (key, bytes) = (key.to_owned(), bytes.to_vec());
    Ok(Prepared { zero, checks, digest, follows, ..bare(plan, key, bytes, context.clone()) })
}

/// The rows about the tools that the machine fetches itself: whether all of them are there, what the spindle holds, and with which step
/// a change that stopped goes on.
fn magazine(program: &Program, from_leg: usize, stock: &ToolStock) -> Vec<PreflightRow> {
    let waits = program.legs.iter().skip(from_leg).flat_map(|leg| &leg.commands);
    let wanted = waits.filter_map(|command| match command {
        Command::AwaitBit { bit } => program.bits.get(*bit as usize),
        _ => None,
    });
    let mut missing: Vec<String> = Vec::new();
    let taken_up = bit_of_leg(program, from_leg).filter(|_| from_leg > 0);
    for bit in taken_up.into_iter().chain(wanted).filter(|bit| !stock.has(bit)) {
        let title = bit.titled();
        if !missing.contains(&title) {
            missing.push(title);
        }
    }
    let mut rows = Vec::new();
    if stock.spindle == Held::Unknown {
        rows.push(row(RowVerdict::Fail, Diagnostic::error("magazine.spindle_unknown")));
    } else if missing.is_empty() {
        rows.push(row(RowVerdict::Pass, note("preflight.magazine_ready")));
    } else {
        let why = Diagnostic::error("preflight.bit_not_in_magazine").with("bits", missing.join(", "));
        rows.push(row(RowVerdict::Fail, why));
    }
    if let (Some(change), Some(next)) = (&stock.change, stock.goes_on_with()) {
        let why = Diagnostic::warning("preflight.change_stopped").with("step", change.step.number());
        rows.push(row(RowVerdict::Warn, why.with("next", next.number())));
    }
    rows
}

/// A tip goes so far below the board that the bed may not be so thick.
pub(crate) fn far_below(program: &Program, machine: &Machine) -> Option<PreflightRow> {
    let below = deepest(program) - machine.process.board_thickness;
    let why = || Diagnostic::warning("preflight.far_below").with("below", format!("{:.2}", below.mm()));
    (below > bed(false)).then(|| row(RowVerdict::Warn, why()))
}

/// The errors of the job that a person saw and accepted, said once more.
pub(crate) fn accepted(program: &Program) -> Option<PreflightRow> {
    let codes = program.accepted.join(", ");
    (!codes.is_empty())
        .then(|| row(RowVerdict::Warn, Diagnostic::warning("preflight.accepted").with("codes", codes)))
}

/// What is given up when the job `key` begins at `from_leg`: another job that was broken off, or what is made of this one.
fn given_up(key: &str, from_leg: u32, context: &Context) -> Option<Diagnostic> {
    let Broken { key: offered, next_leg, .. } = context.offer.as_ref()?;
    if offered != key {
        return Some(Diagnostic::warning("preflight.forgets").with("job", &offered[..offered.len().min(8)]));
    }
    (from_leg == 0 && *next_leg > 0).then(|| Diagnostic::warning("preflight.anew"))
}

/// How much of the program there is to be done from `from_leg` on, and how long it takes.
pub(crate) fn rest(program: &Program, from_leg: usize, left_s: f64) -> Diagnostic {
    let (holes, toolpaths) = made(program.legs.iter().skip(from_leg));
    let words = if toolpaths > 0 { "preflight.time_milling" } else { "preflight.time" };
    let whole_s = left_s.round() as u64;
    let spent = note(words).with("holes", holes).with("toolpaths", toolpaths);
    spent.with("minutes", whole_s / 60).with("seconds", whole_s % 60)
}

/// The bit that leg `leg` is made with; before any is put in, the first of the program.
pub(crate) fn bit_of_leg(program: &Program, leg: usize) -> Option<&Bit> {
    let put_in = program.legs.iter().take(leg + 1).rev().find_map(|leg| match leg.mark {
        Mark::ToolChange(bit) => Some(bit as usize),
        _ => None,
    });
    program.bits.get(put_in.unwrap_or(0))
}

/// The tools of the program that are worn, or will be before it is done from leg `from` on.
pub(crate) fn worn_tools(
    program: &Program,
    machine: &Machine,
    (from, wear): (usize, &[ToolWear]),
) -> Vec<PreflightRow> {
    let mut rows = Vec::new();
    for (bit, needs) in program.bits.iter().zip(worn::by_bit(program, from)).filter(|row| !row.1.is_nothing())
    {
        let Some(tool) = machine::tool_of(&machine.rack, bit, &machine.name, wear) else { continue };
        let now = ToolWear::of(wear, &machine.name, tool);
        let verdict = if now.is_over(tool.life) { RowVerdict::Warn } else { RowVerdict::Pass };
        rows.extend(worn_tool(tool, bit, (&now, needs)).map(|found| row(verdict, found)));
    }
    rows
}

/// What there is to say of a tool that has done so much, as `bit` of a job that needs so much of it: that it is worn, or will be.
pub(crate) fn worn_tool(tool: &RackTool, bit: &Bit, (now, needs): (&ToolWear, Wear)) -> Option<Diagnostic> {
    let way = tool.wears_by_way();
    let found = match (now.is_over(tool.life), now.plus(needs).is_over(tool.life)) {
        (true, _) if way => Diagnostic::warning("preflight.tool_worn_way"),
        (true, _) => Diagnostic::warning("preflight.tool_worn"),
        (false, true) if way => note("preflight.tool_wears_out_way"),
        (false, true) => note("preflight.tool_wears_out"),
        (false, false) => return None,
    };
    let found = found.with("number", tool.number).with("tool", bit.titled());
    Some(found.with("done", now.done()).with("life", tool.life))
}

/// The drills of the program that the machine's rack does not have. Mills and V-bits belong to the job: no rack lists them.
pub(crate) fn missing_drills(program: &Program, machine: &Machine) -> Vec<String> {
    let lacks = |bit: &&Bit| bit.cutter == Cutter::Drill && !machine.rack.iter().any(|tool| tool.is(bit));
    program.bits.iter().filter(lacks).map(|bit| bit.titled()).collect()
}

fn planned(program: Program, context: &Context) -> Result<Planned, Diagnostic> {
    let stream = Packed::of(&program, &context.machine)?;
    let left_ticks = left_ticks(&stream, &change_ticks(&program, context));
    Ok(Planned { program, stream, left_ticks })
}

/// The digest of a stream, and what the independent checker says of it where the work zero is known: side by side.
fn judged(
    stream: &Packed,
    machine: &Machine,
    zero: Option<Steps>,
) -> (String, Option<Result<(), Vec<Diagnostic>>>) {
    let digest = || steps::digest_of(&stream.start(), stream.count(), stream.segments());
    let check = |zero| check::verify_each(&stream.start(), || stream.segments(), machine, zero).map(drop);
    thread::scope(|scope| {
        let beside = thread::Builder::new().name("digest".to_owned()).spawn_scoped(scope, digest);
        let verdict = zero.map(check);
        // Where there is no second thread, or it failed, it is done here.
        let found = beside.ok().and_then(|beside| beside.join().ok());
        (found.unwrap_or_else(digest), verdict)
    })
}

/// A plan with what it was made from, at the feeds it came with, not judged.
fn bare(plan: Planned, key: String, bytes: Vec<u8>, context: Context) -> Prepared {
    let Planned { program, stream, left_ticks } = plan;
    let (zero, checks, digest, feed_percent) = (Steps::default(), Vec::new(), String::new(), 100);
    let follows = None;
    Prepared { key, bytes, program, follows, stream, digest, left_ticks, zero, checks, context, feed_percent }
}

/// The job in work with its feeds at `percent` of those it came with: the same legs to the same places, planned and checked
/// anew. Refused where the check, or this computer's clock, refuses it.
pub fn at_feed(job: &Prepared, percent: u8) -> Result<Prepared, Diagnostic> {
    let machine = &job.context.machine;
    let mut program = program::decode(&job.bytes)?;
    if let Some(surface) = &job.follows {
        program = level(&program, &surface.map, TOLERANCE)?.program;
    }
    let plan = planned(program.at_feed(percent), &job.context)?;
    let (digest, verdict) = judged(&plan.stream, machine, Some(job.zero));
    verdict
        .unwrap_or(Ok(()))
        .map_err(|reasons| reasons.into_iter().next().unwrap_or_else(|| Diagnostic::error("control.busy")))?;
    let too_fast = |safe_hz| lateness::too_fast(plan.stream.segments(), safe_hz);
    if let Some(why) = job.context.safe_hz.and_then(too_fast) {
        return Err(why);
    }
    let anew = bare(plan, job.key.clone(), job.bytes.clone(), job.context.clone());
    let (checks, follows) = (job.checks.clone(), job.follows.clone());
    Ok(Prepared { zero: job.zero, checks, digest, follows, feed_percent: percent, ..anew })
}

/// A wait for a bit that the program does not have: nobody could put it in.
fn unknown_bit(program: &Program) -> Option<Diagnostic> {
    let commands = program.legs.iter().flat_map(|leg| &leg.commands);
    let mut waits = commands.filter_map(|command| match command {
        Command::AwaitBit { bit } => Some(*bit),
        _ => None,
    });
    let bit = waits.find(|bit| *bit as usize >= program.bits.len())?;
    let why = Diagnostic::error("preflight.no_such_bit").with("bit", u64::from(bit) + 1);
    Some(why.with("bits", program.bits.len()))
}

/// The rows about the drill itself.
fn standing(context: &Context, plane: Option<[i64; 2]>) -> Vec<PreflightRow> {
    let lost = |code| row(RowVerdict::Fail, Diagnostic::error(code));
    vec![
        match context.trust {
            Trust::Trusted => row(RowVerdict::Pass, note("preflight.homed")),
            Trust::Suspect | Trust::Lost => lost("preflight.not_homed"),
        },
        match context.state {
            State::Ready | State::NotHomed => row(RowVerdict::Pass, note("preflight.at_rest")),
            _ => lost("preflight.busy"),
        },
        match plane {
            Some(_) => row(RowVerdict::Pass, note("preflight.zero_set")),
            None => lost("preflight.no_zero"),
        },
    ]
}

/// Whether this computer can step the stream in time.
fn in_time(stream: &Packed, safe_hz: f64) -> PreflightRow {
    let fastest = lateness::fastest_rate(stream.segments());
    match lateness::beyond(fastest, safe_hz) {
        Some(why) => row(RowVerdict::Fail, why),
        None => {
            let hz = fastest.map_or(0.0, |(hz, _)| hz);
            let finding = note("preflight.in_time").with("hz", hz.ceil()).with("safe", safe_hz.floor());
            row(RowVerdict::Pass, finding)
        }
    }
}

/// What the machine's own changes of tools add to each leg, in ticks.
fn change_ticks(program: &Program, context: &Context) -> Vec<u64> {
    let mut each = vec![0; program.legs.len()];
    let Some(stock) = &context.stock else { return each };
    let kind = |bit: &Bit| (bit.cutter, bit.diameter);
    let held = if let Held::Tool { tool, .. } = &stock.spindle { Some(kind(&tool.bit)) } else { None };
    let commands = program
        .legs
        .iter()
        .enumerate()
        .flat_map(|(at, leg)| leg.commands.iter().map(move |command| (at, command)));
    let waits = commands.filter_map(|(leg, command)| match command {
        Command::AwaitBit { bit } => Some((leg, kind(program.bits.get(*bit as usize)?))),
        _ => None,
    });
    let (legs, kinds): (Vec<usize>, Vec<_>) = waits.unzip();
    for (leg, ticks) in legs.into_iter().zip(changes_ticks(&context.machine, held, kinds)) {
        each[leg] += ticks;
    }
    each
}

fn left_ticks(stream: &Packed, change_ticks: &[u64]) -> Vec<u64> {
    let mut left = 0;
    let mut rows: Vec<u64> = (0..stream.legs())
        .rev()
        .map(|leg| {
            left += stream.ticks(leg) + change_ticks.get(leg).copied().unwrap_or(0);
            left
        })
        .collect();
    rows.reverse();
    rows
}
