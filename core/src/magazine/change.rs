//! One tool change as an automaton. Sensors are checked before and after each step.
//!
//! ```text
//! begin ─▶ check before ─▶ output, moves ─▶ report ─▶ check after ─▶ update the stock ─▶ next step … done
//!              └──────────────── alarm: the change stops at this step ◀────────┘
//! ```
//!
//! Positions in machine steps.

use super::{ChangeStep, Held, Looks, ToolStock, Unfinished};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::job::{Bit, Mark, Stage, Switching};
use crate::machine::{Machine, Steps};
use crate::motion::{Timeline, cycles};
use crate::steps::{self, Segment};

#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    later: Vec<ChangeStep>,
    from: Option<u8>,
    to: u8,
    /// Position at which the job continues, and the axes that must reach it from above.
    back: Steps,
    down: [bool; 2],
}

/// Actions for one step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepWork {
    /// Output to switch first: index and level.
    pub output: Option<(u8, bool)>,
    /// Moves to play after that.
    pub segments: Vec<Segment>,
    /// The stock must be saved to disk before the step starts, because afterwards the tool's location is
    /// uncertain.
    pub needs_kept: bool,
}

fn rest(duration_ticks: u64, effect: Switching, end: Steps) -> Segment {
    let (mark, stage) = (Mark::Prepare, Stage::Dwell);
    Segment { leg: 0, mark, stage, duration_ticks, runs: Vec::new(), effect, gate: None, end }
}

fn segments<'a>(machine: &Machine, ways: impl IntoIterator<Item = &'a Timeline>) -> Vec<Segment> {
    let moves = ways.into_iter().flat_map(|way| way.moves.iter());
    moves.map(|planned| steps::segment(planned, machine)).collect()
}

impl Change {
    /// The change to `bit`, for a job that continues at `back`; axes in `down` arrived there from above. None
    /// if the spindle already holds that bit. Records the start in `stock`.
    pub fn new(
        stock: &mut ToolStock,
        bit: &Bit,
        (back, down): (Steps, [bool; 2]),
    ) -> Result<Option<Self>, Diagnostic> {
        if stock.holds(bit) {
            stock.change = None;
            return Ok(None);
        }
        let missing = || error!("magazine.no_such_tool", bit = bit.titled());
        let to = stock.place_of(bit).ok_or_else(missing)?;
        let new = stock.lies(to).cloned().ok_or_else(missing)?;
        let (later, old) = match &stock.spindle {
            Held::Unknown => return Err(error!("magazine.spindle_unknown")),
            Held::Nothing => (without_old(), None),
            Held::Tool { tool, place } => {
                let no_room = || error!("magazine.no_room", number = tool.number);
                (ChangeStep::ALL.to_vec(), Some((tool.clone(), stock.way_back(*place).ok_or_else(no_room)?)))
            }
        };
        let from = old.as_ref().map(|(_, place)| *place);
        stock.change =
            later.first().map(|step| Unfinished { step: *step, old, new: (new, to), is_lost: false });
        Ok(Some(Self { later, from, to, back, down }))
    }

    /// Current step; none at the end.
    pub fn step(&self) -> Option<ChangeStep> {
        self.later.first().copied()
    }

    /// Slots of the old tool and of the new one.
    pub fn places(&self) -> (Option<u8>, u8) {
        (self.from, self.to)
    }

    /// Actions of the current step, from rest at `at`. Fails if the sensors forbid the step.
    pub fn begin(
        &self,
        machine: &Machine,
        stock: &mut ToolStock,
        (at, inputs): (Steps, u32),
    ) -> Result<StepWork, Diagnostic> {
        let Some(step) = self.step() else { return Ok(StepWork::default()) };
        if let Some(change) = &mut stock.change {
            change.step = step;
        }
        looked(machine, step, step.before(), inputs)?;
        let in_doubt =
            matches!((step, self.from), (ChangeStep::OpenClamp, Some(_)) | (ChangeStep::CloseClamp, _));
        if in_doubt {
            // A crash from here on must not assume where the tool is; the check after the step decides.
            stock.spindle = Held::Unknown;
        }
        let mut work = self.work(machine, step, at)?;
        work.needs_kept = in_doubt;
        if work.segments.is_empty() {
            work.segments.push(rest(0, Switching::None, at));
        }
        Ok(work)
    }

    /// Ends the current step, at rest. True if the change is complete.
    pub fn done(
        &mut self,
        machine: &Machine,
        stock: &mut ToolStock,
        inputs: u32,
    ) -> Result<bool, Diagnostic> {
        let Some(step) = self.step() else { return Ok(true) };
        looked(machine, step, step.after(), inputs)?;
        if let Some(change) = stock.change.clone() {
            match (step, &change.old) {
                (ChangeStep::RaiseFromOld, Some((tool, place))) => {
                    stock.lay(*place, Some(tool.clone()));
                    stock.spindle = Held::Nothing;
                }
                (ChangeStep::RaiseFromNew, _) => {
                    let (tool, place) = change.new;
                    stock.lay(place, None);
                    stock.spindle = Held::Tool { tool, place: Some(place) };
                }
                _ => {}
            }
        }
        self.later.remove(0);
        if self.later.is_empty() {
            stock.change = None;
        }
        Ok(self.later.is_empty())
    }

    /// True if the spindle at `at` is over the slot of the uncertain tool.
    pub fn is_over_place(machine: &Machine, stock: &ToolStock, at: &Steps) -> bool {
        let Some(change) = &stock.change else { return false };
        machine.magazine_place(usize::from(change.uncertain().1)) == Some([at[0], at[1]])
    }

    fn work(&self, machine: &Machine, step: ChangeStep, at: Steps) -> Result<StepWork, Diagnostic> {
        let magazine = &machine.magazine;
        let up = || cycles::retract(machine, at, cycles::top(machine).max(at[2])).map(|way| vec![way]);
        let down = || {
            let z = machine.z.scale.steps(magazine.height);
            cycles::lower(machine, at, z, machine.z.home_speed_mm_per_s).map(|way| vec![way])
        };
        let to = |axes: [bool; 2], place: [i64; 2]| {
            let mut there = at;
            for axis in (0..2).filter(|axis| axes[*axis]) {
                there[axis] = place[axis];
            }
            cycles::travel(machine, at, there).map(Vec::from)
        };
        let pause = || cycles::travel(machine, at, machine.magazine_pause(at)).map(Vec::from);
        let old = self.over(machine, self.from.unwrap_or(self.to))?;
        let new = self.over(machine, self.to)?;
        let (mut effect, mut ticks, mut output) = (Switching::None, 0, None);
        let ways = match step {
            ChangeStep::RaiseZ => {
                (effect, ticks) = (Switching::Spindle { rpm: 0 }, magazine.spin_down_ticks());
                up()?
            }
            ChangeStep::RaiseFoot => {
                if machine.foot.on {
                    (effect, ticks) = (Switching::Foot { down: false }, machine.foot.ticks());
                }
                Vec::new()
            }
            ChangeStep::XToOld => to([true, false], old)?,
            ChangeStep::YToOld => to([false, true], old)?,
            ChangeStep::XToNew => to([true, false], new)?,
            ChangeStep::YToNew => to([false, true], new)?,
            ChangeStep::LowerToOld | ChangeStep::LowerToNew => down()?,
            ChangeStep::OpenClamp | ChangeStep::CloseClamp => {
                let place =
                    machine.output_place(&magazine.clamp).ok_or_else(|| error!("magazine.no_clamp"))?;
                output = Some((place, step == ChangeStep::OpenClamp));
                Vec::new()
            }
            ChangeStep::WaitOpen | ChangeStep::WaitClosed => {
                ticks = magazine.clamp_ticks();
                Vec::new()
            }
            ChangeStep::RaiseFromOld
            | ChangeStep::RaiseBeforeNew
            | ChangeStep::RaiseFromNew
            | ChangeStep::RaiseAtEnd => up()?,
            ChangeStep::PauseWithout
            | ChangeStep::PauseBeforeNew
            | ChangeStep::PauseWithNew
            | ChangeStep::PauseAtEnd => pause()?,
            ChangeStep::CheckPutBack | ChangeStep::CheckTaken | ChangeStep::FootReady => Vec::new(),
            ChangeStep::GoOn => self.on(machine, at)?,
        };
        let waits = (ticks > 0 || effect != Switching::None).then(|| rest(ticks, effect, at));
        let pieces = waits.into_iter().chain(segments(machine, &ways)).collect();
        Ok(StepWork { output, segments: pieces, needs_kept: false })
    }

    fn over(&self, machine: &Machine, place: u8) -> Result<[i64; 2], Diagnostic> {
        let missing = || error!("magazine.no_such_place", place = place + 1);
        machine.magazine_place(usize::from(place)).ok_or_else(missing)
    }

    /// To where the job continues, arriving from the original side, so that the backlash has the original
    /// direction.
    fn on(&self, machine: &Machine, at: Steps) -> Result<Vec<Timeline>, Diagnostic> {
        let mut beside = self.back;
        beside[2..].copy_from_slice(&at[2..]);
        let mut over = beside;
        for (axis, is_down) in self.down.into_iter().enumerate() {
            let play = machine.axis(axis).scale.steps(machine.axis(axis).backlash);
            beside[axis] += if is_down { play } else { -play };
            over[axis] = self.back[axis];
        }
        Ok(vec![
            cycles::go_to(machine, at, beside)?,
            cycles::go_to(machine, beside, over)?,
            cycles::go_to(machine, over, self.back)?,
        ])
    }
}

/// The steps for an empty spindle. The clamp opens at the pause, before the new tool is fetched.
fn without_old() -> Vec<ChangeStep> {
    let first = [
        ChangeStep::RaiseZ,
        ChangeStep::RaiseFoot,
        ChangeStep::RaiseBeforeNew,
        ChangeStep::PauseBeforeNew,
        ChangeStep::OpenClamp,
        ChangeStep::WaitOpen,
    ];
    let rest = ChangeStep::ALL.into_iter().filter(|step| *step > ChangeStep::PauseBeforeNew);
    first.into_iter().chain(rest).collect()
}

fn looked(machine: &Machine, step: ChangeStep, looks: Looks, inputs: u32) -> Result<(), Diagnostic> {
    looks.wrong(machine.told_inputs(), inputs).map_or(Ok(()), |wrong| Err(step.alarm(wrong)))
}
