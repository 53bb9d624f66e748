//! Arming: turns the program into a stream, checks it, and lists the results as the pre-flight check. Moves
//! nothing.

mod lengths;

use crate::surface::{Followed, Ground, KeptSurface, KnownHeight, followed};
use annulus_core::board::bed;
use annulus_core::cam::suits;
use annulus_core::control::{State, Trust, lateness};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::worn::{self, Wear};
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program, bite, deepest};
use annulus_core::level::{TOLERANCE, level};
use annulus_core::machine::{self, Machine, RackTool, Steps, ToolWear};
use annulus_core::magazine::{Held, ToolStock, changes_ticks};
use annulus_core::steps::{self, Packed, Segment, Switching, TICK_HZ};
use annulus_core::wire::{ArmedJob, PreflightRow, RowVerdict, Tell, program};
use annulus_core::{check, motion};
use annulus_core::{code, error, note, warning};
use std::sync::Arc;
use std::thread;

/// The drill's state when a job is prepared.
#[derive(Clone, Debug, PartialEq)]
pub struct Context {
    pub machine: Machine,
    pub zero: Option<[i64; 2]>,
    pub state: State,
    pub trust: Trust,
    /// The highest safe step rate, on real hardware.
    pub safe_hz: Option<f64>,
    /// Whether the spindle responds; `None` if it does not report.
    pub spindle_answers: Option<bool>,
    pub wear: Vec<ToolWear>,
    pub stock: Option<ToolStock>,
    pub offer: Option<Broken>,
    pub surface: Option<Arc<KeptSurface>>,
    /// The tool for which the board height is known.
    pub known: KnownHeight,
}

/// An interrupted job, as far as the start of another one needs it.
#[derive(Clone, Debug, PartialEq)]
pub struct Broken {
    /// SHA-256 of its program.
    pub key: String,
    /// The leg where it resumes.
    pub next_leg: u32,
    /// The work zero that it started with, machine steps, if those still have the same meaning.
    pub zero_steps: Option<[i64; 2]>,
    pub levelled: Option<String>,
}

pub struct Prepared {
    /// SHA-256 of the program's bytes.
    pub key: String,
    pub bytes: Vec<u8>,
    /// The program; its depths are corrected if it follows a height map.
    pub program: Program,
    /// The height map that it follows.
    pub follows: Option<Arc<KeptSurface>>,
    pub stream: Packed,
    pub digest: String,
    /// Time from the start of every leg to the end of the job, with automatic tool changes, in ticks.
    pub left_ticks: Vec<u64>,
    /// Work zero in machine steps, with every tool on the board's surface.
    pub zero: Steps,
    /// The rows of the pre-flight check.
    pub checks: Vec<PreflightRow>,
    /// The state that it was prepared for. If the state changed since, arming is void.
    pub context: Context,
    /// Its feed, percent of the one in `bytes`.
    pub feed_percent: u8,
}

struct Planned {
    program: Program,
    stream: Packed,
    left_ticks: Vec<u64>,
}

impl Prepared {
    pub(crate) fn tell(&self) -> Tell {
        let (job, stream_digest) = (self.key.clone(), self.digest.clone());
        let levelled = self.follows.is_some();
        Tell::Armed(ArmedJob { job, stream_digest, levelled, checks: self.checks.clone() })
    }

    pub(crate) fn refusal(&self) -> Option<Diagnostic> {
        self.checks.iter().find(|row| row.verdict == RowVerdict::Fail).map(|row| row.finding.clone())
    }

    /// Where leg `leg` starts from a stop, in machine steps: all spindles up.
    pub(crate) fn start_of_leg(&self, leg: usize) -> Steps {
        let from = self.before_leg(leg);
        let up = self.stream.start();
        std::array::from_fn(|axis| {
            self.zero[axis] + if axis < 2 { from[axis] } else { from[axis].max(up[axis]) }
        })
    }

    /// Whether X and Y last moved down before leg `leg`, which decides the side of their backlash.
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

    /// Where X and Y go first, in machine steps, before leg `leg` starts: from there they reach the start
    /// from the stream's side, without backlash.
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

    /// The position before leg `leg` in sequence, in steps from the work zero.
    pub fn before_leg(&self, leg: usize) -> Steps {
        self.stream.before(leg)
    }

    /// Returns `true` if leg `leg` continues from the bottom of the previous hole.
    pub(crate) fn begins_low(&self, leg: usize) -> bool {
        !self.stream.range(leg).is_empty() && self.before_leg(leg)[2..].iter().any(|height| *height < 0)
    }

    /// Leg `leg`, started with all spindles up. If the next leg continues from its bottom, the retract is
    /// left out.
    pub(crate) fn entry(&self, machine: &Machine, leg: usize) -> Result<Vec<Segment>, Diagnostic> {
        let mut alone = motion::leg_alone(&self.program, machine, leg, self.down_before(leg))?;
        if self.begins_low(leg + 1) {
            alone.moves.pop();
        }
        Ok(alone.moves.iter().map(|planned| steps::segment(planned, machine)).collect())
    }

    /// The retract after leg `leg`, for when the next one does not follow at once.
    pub(crate) fn lift(&self, machine: &Machine, leg: usize) -> Result<Vec<Segment>, Diagnostic> {
        let alone = motion::leg_alone(&self.program, machine, leg, self.down_before(leg))?;
        Ok(alone.moves.last().map(|planned| steps::segment(planned, machine)).into_iter().collect())
    }

    /// Height of the board above flat at the hole of leg `leg`, in steps of Z, if the job follows a height
    /// map.
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

    pub(crate) fn done_before(&self, leg: usize) -> (u32, u32) {
        made(self.program.legs.iter().take(leg))
    }
}

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
        row(RowVerdict::Pass, note!("preflight.same_machine"))
    } else {
        row(RowVerdict::Fail, error!("preflight.other_machine"))
    });
    let (digest, verdict) = judged(stream, machine, plane.map(|_| zero));
    match verdict {
        Some(Ok(())) => checks.push(row(RowVerdict::Pass, note!("preflight.stream_safe"))),
        Some(Err(reasons)) => {
            checks.extend(reasons.into_iter().take(20).map(|why| row(RowVerdict::Fail, why)));
        }
        None => {}
    }
    checks.extend(context.safe_hz.map(|safe_hz| in_time(stream, safe_hz)));
    checks.extend(context.spindle_answers.map(|answers| {
        let silent = || row(RowVerdict::Fail, error!("preflight.spindle_silent"));
        if answers { row(RowVerdict::Pass, note!("preflight.spindle_answers")) } else { silent() }
    }));
    checks.extend(told);
    checks.extend(machine::warnings(machine).into_iter().map(|warning| row(RowVerdict::Warn, warning)));
    checks.extend(unknown_bit(program).map(|why| row(RowVerdict::Fail, why)));
    checks.extend(bite::judged_all(program).into_iter().map(|why| row(RowVerdict::Warn, why)));
    checks.extend(suits::judged(program, machine).into_iter().map(|why| row(RowVerdict::Warn, why)));
    checks.extend(unseen_breakage(program, machine));
    let missing = missing_drills(program, machine);
    if !missing.is_empty() {
        let why = warning!("preflight.bit_not_in_rack", bits = missing.join(", "));
        checks.push(row(RowVerdict::Warn, why));
    }
    checks.extend(worn_tools(program, machine, (from_leg as usize, &context.wear)));
    if let Some(stock) = &context.stock {
        checks.extend(magazine(program, from_leg as usize, stock));
    } else if let Some(bit) = bit_of_leg(program, from_leg as usize).filter(|_| machine.has_equal_lengths()) {
        checks.push(row(RowVerdict::Warn, note!("preflight.first_bit", bit = bit.titled())));
    }
    checks.extend(lengths::rows(program, context, from_leg as usize));
    checks.extend(far_below(program, machine));
    checks.extend(accepted(program));
    checks.extend(given_up(key, from_leg, context).map(|why| row(RowVerdict::Warn, why)));
    checks.push(row(RowVerdict::Pass, rest(program, from_leg as usize, left_s)));
    let (key, bytes) = (key.to_owned(), bytes.to_vec());
    Ok(Prepared { zero, checks, digest, follows, ..bare(plan, key, bytes, context.clone()) })
}

/// The rows about a magazine: whether all tools are there, what the spindle holds, and the next step of an
/// interrupted change.
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
        rows.push(row(RowVerdict::Fail, error!("magazine.spindle_unknown")));
    } else if missing.is_empty() {
        rows.push(row(RowVerdict::Pass, note!("preflight.magazine_ready")));
    } else {
        let why = error!("preflight.bit_not_in_magazine", bits = missing.join(", "));
        rows.push(row(RowVerdict::Fail, why));
    }
    if let (Some(change), Some(next)) = (&stock.change, stock.goes_on_with()) {
        let why = warning!("preflight.change_stopped", step = change.step.number(), ..);
        rows.push(row(RowVerdict::Warn, why.with("next", next.number())));
    }
    rows
}

/// Warns that the machine does not detect a broken tool.
fn unseen_breakage(program: &Program, machine: &Machine) -> Option<PreflightRow> {
    let unseen = program.hole_count() > 0 && !machine.notices_broken_bits();
    unseen.then(|| row(RowVerdict::Warn, warning!("preflight.broken_bits_unseen")))
}

/// Warns if a tool goes deeper below the board than the spoilboard may be thick.
pub(crate) fn far_below(program: &Program, machine: &Machine) -> Option<PreflightRow> {
    let below = deepest(program) - machine.process.board_thickness;
    let why = || warning!("preflight.far_below", below = format!("{:.2}", below.mm()));
    (below > bed(false)).then(|| row(RowVerdict::Warn, why()))
}

pub(crate) fn accepted(program: &Program) -> Option<PreflightRow> {
    let codes = program.accepted.join(", ");
    (!codes.is_empty()).then(|| row(RowVerdict::Warn, warning!("preflight.accepted", codes = codes)))
}

/// Warning about what a start of `key` at `from_leg` discards: another interrupted job, or the progress of
/// this one.
fn given_up(key: &str, from_leg: u32, context: &Context) -> Option<Diagnostic> {
    let Broken { key: offered, next_leg, .. } = context.offer.as_ref()?;
    if offered != key {
        return Some(warning!("preflight.forgets", job = &offered[..offered.len().min(8)]));
    }
    (from_leg == 0 && *next_leg > 0).then(|| warning!("preflight.anew"))
}

pub(crate) fn rest(program: &Program, from_leg: usize, left_s: f64) -> Diagnostic {
    let (holes, toolpaths) = made(program.legs.iter().skip(from_leg));
    let words = if toolpaths > 0 { code!("preflight.time_milling") } else { code!("preflight.time") };
    let whole_s = left_s.round() as u64;
    let spent = Diagnostic::note(words).with("holes", holes).with("toolpaths", toolpaths);
    spent.with("minutes", whole_s / 60).with("seconds", whole_s % 60)
}

/// The tool of leg `leg`; before the first change, the first tool of the program.
pub(crate) fn bit_of_leg(program: &Program, leg: usize) -> Option<&Bit> {
    let put_in = program.legs.iter().take(leg + 1).rev().find_map(|leg| match leg.mark {
        Mark::ToolChange(bit) => Some(bit as usize),
        _ => None,
    });
    program.bits.get(put_in.unwrap_or(0))
}

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

/// The problem of a tool with wear `now` for a job that adds `needs`: worn, or worn out during the job.
pub(crate) fn worn_tool(tool: &RackTool, bit: &Bit, (now, needs): (&ToolWear, Wear)) -> Option<Diagnostic> {
    let way = tool.wears_by_way();
    let found = match (now.is_over(tool.life), now.plus(needs).is_over(tool.life)) {
        (true, _) if way => warning!("preflight.tool_worn_way", ..),
        (true, _) => warning!("preflight.tool_worn", ..),
        (false, true) if way => note!("preflight.tool_wears_out_way", ..),
        (false, true) => note!("preflight.tool_wears_out", ..),
        (false, false) => return None,
    };
    let found = found.with("number", tool.number).with("tool", bit.titled());
    Some(found.with("done", now.done()).with("life", tool.life))
}

/// The drills of the program that are not in the machine's tool list. End mills and V-bits belong to the
/// job and need no entry.
pub(crate) fn missing_drills(program: &Program, machine: &Machine) -> Vec<String> {
    let lacks = |bit: &&Bit| bit.cutter == Cutter::Drill && !machine.rack.iter().any(|tool| tool.is(bit));
    program.bits.iter().filter(lacks).map(|bit| bit.titled()).collect()
}

fn planned(program: Program, context: &Context) -> Result<Planned, Diagnostic> {
    let stream = Packed::of(&program, &context.machine)?;
    let left_ticks = left_ticks(&stream, &change_ticks(&program, context));
    Ok(Planned { program, stream, left_ticks })
}

/// The digest of a stream, and the independent checker's verdict if the work zero is known; computed in
/// parallel.
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
        // Without a second thread, compute it here.
        let found = beside.ok().and_then(|beside| beside.join().ok());
        (found.unwrap_or_else(digest), verdict)
    })
}

/// A plan with its source, at the original feed, not checked yet.
fn bare(plan: Planned, key: String, bytes: Vec<u8>, context: Context) -> Prepared {
    let Planned { program, stream, left_ticks } = plan;
    let (zero, checks, digest, feed_percent) = (Steps::default(), Vec::new(), String::new(), 100);
    let follows = None;
    Prepared { key, bytes, program, follows, stream, digest, left_ticks, zero, checks, context, feed_percent }
}

/// The running job at `percent` of its original feed: the same legs to the same positions, planned and
/// checked again. Fails if the check, or this computer's clock, refuses it.
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
        .map_err(|reasons| reasons.into_iter().next().unwrap_or_else(|| error!("control.busy")))?;
    let too_fast = |safe_hz| lateness::too_fast(plan.stream.segments(), safe_hz);
    if let Some(why) = job.context.safe_hz.and_then(too_fast) {
        return Err(why);
    }
    let anew = bare(plan, job.key.clone(), job.bytes.clone(), job.context.clone());
    let (checks, follows) = (job.checks.clone(), job.follows.clone());
    Ok(Prepared { zero: job.zero, checks, digest, follows, feed_percent: percent, ..anew })
}

/// An error if the program waits for a tool that it does not define: no tool could satisfy it.
fn unknown_bit(program: &Program) -> Option<Diagnostic> {
    let commands = program.legs.iter().flat_map(|leg| &leg.commands);
    let mut waits = commands.filter_map(|command| match command {
        Command::AwaitBit { bit } => Some(*bit),
        _ => None,
    });
    let bit = waits.find(|bit| *bit as usize >= program.bits.len())?;
    let why = error!("preflight.no_such_bit", bit = u64::from(bit) + 1, ..);
    Some(why.with("bits", program.bits.len()))
}

/// The rows about the drill itself.
fn standing(context: &Context, plane: Option<[i64; 2]>) -> Vec<PreflightRow> {
    let lost = |code| row(RowVerdict::Fail, Diagnostic::error(code));
    vec![
        match context.trust {
            Trust::Trusted => row(RowVerdict::Pass, note!("preflight.homed")),
            Trust::Suspect | Trust::Lost => lost(code!("preflight.not_homed")),
        },
        match context.state {
            State::Ready | State::NotHomed => row(RowVerdict::Pass, note!("preflight.at_rest")),
            _ => lost(code!("preflight.busy")),
        },
        match plane {
            Some(_) => row(RowVerdict::Pass, note!("preflight.zero_set")),
            None => lost(code!("preflight.no_zero")),
        },
    ]
}

fn in_time(stream: &Packed, safe_hz: f64) -> PreflightRow {
    let fastest = lateness::fastest_rate(stream.segments());
    match lateness::beyond(fastest, safe_hz) {
        Some(why) => row(RowVerdict::Fail, why),
        None => {
            let hz = fastest.map_or(0.0, |(hz, _)| hz);
            let finding = note!("preflight.in_time", hz = hz.ceil(), safe = safe_hz.floor());
            row(RowVerdict::Pass, finding)
        }
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::machine::{Value, apply, preset, virtual_drill};

    #[test]
    fn machine_without_contact_sensing_gives_a_warning() {
        let set = |machine: &Machine, mm: f64| {
            apply(machine, &[("stroke.contact_tolerance".to_owned(), Value::Number(mm))]).unwrap()
        };
        let breakout = preset("breakout").unwrap();
        let unwired = apply(
            &breakout,
            &[("parallel.sensors".to_owned(), Value::Numbers(vec![3.0, -1.0, 4.0, -1.0, 2.0, -1.0, -1.0]))],
        );
        let rows = [
            (virtual_drill(), false),
            (breakout.clone(), false),
            (set(&breakout, 0.0), true),
            (set(&breakout, 0.3), false),
            (unwired.unwrap(), true),
        ];
        for (machine, told) in rows {
            let program = crate::tests::holes(&machine, 2, 2, |_| 800);
            let found = unseen_breakage(&program, &machine).map(|row| (row.finding.code, row.verdict));
            let expected = told.then(|| ("preflight.broken_bits_unseen".to_owned(), RowVerdict::Warn));
            assert_eq!(found, expected, "{}", machine.name);
        }
    }
}
