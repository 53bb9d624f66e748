//! A manual tool change: move to the change position, find the new tool's length, return to the job.
//!
//! ```text
//! tool wanted ─▶ up, spindle off, to the change position ─▶ user ─▶ length known? ─▶ up, back ─▶ continue
//!                                                 jog, probe, set zero │ no: nothing cuts
//! ```
//!
//! A job requests its first tool before it moves to the board: that tool's length may be unknown.

use super::Owner;
use super::moves::{Doing, segments};
use super::touch::TouchFor;
use crate::prepare::Prepared;
use annulus_core::control::{BoardHeight, Event, State};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::job::{Bit, Mark, Switching};
use annulus_core::machine::{Machine, Steps};
use annulus_core::motion::cycles;
use annulus_core::queue;
use annulus_core::steps::Segment;
use annulus_core::wire::{ChangeReport, LengthKnown};

pub(crate) struct AskedTool {
    /// Index into the program's tools.
    pub(crate) bit: u32,
    back: Back,
}

enum Back {
    /// At the start of the next leg. `turns` if the spindle must be started there, because the leg does not
    /// request the tool itself.
    Start { turns: bool },
    /// Within a leg: the position relative to the work zero, and which axes arrived there counting down.
    Place { from_zero: Steps, down: [bool; 2] },
}

impl Owner {
    /// Returns `true` if the current tool may cut: its length is known, or all tools are equally long.
    pub(super) fn length_is_known(&self) -> bool {
        self.machine.has_equal_lengths() || self.known.height.may_cut()
    }

    /// Fails during an automatic tool change, running or interrupted.
    pub(super) fn may_move_in_change(&self) -> Result<(), Diagnostic> {
        let is_asked = self.work.as_ref().is_none_or(|work| work.asked.is_some());
        if self.session.state == State::ToolChange && !is_asked {
            return Err(error!("control.busy"));
        }
        Ok(())
    }

    /// X and Y of the work zero, for the change position.
    fn plane_zero(&self) -> [i64; 2] {
        let of_work = self.work.as_ref().map(|work| [work.job.zero[0], work.job.zero[1]]);
        of_work.or(self.session.zero()).unwrap_or_default()
    }

    /// The tool that the user must insert or measure before the first move, and whether the next leg lacks
    /// that request.
    pub(super) fn asked_first(&self) -> Option<(u32, bool)> {
        let work = self.work.as_ref().filter(|_| self.machine.is_changed_by_hand())?;
        if work.confirm_bit {
            return Some((work.bit.unwrap_or(0), true));
        }
        let awaited = |leg: usize| {
            work.job.stream.leg(leg).into_iter().find_map(|segment| match segment.effect {
                Switching::AwaitBit { bit } => Some(bit),
                _ => None,
            })
        };
        let marks = work.job.program.legs.iter().map(|leg| leg.mark).enumerate().skip(work.leg);
        let mut before = marks.take_while(|(_, mark)| matches!(mark, Mark::Prepare | Mark::ToolChange(_)));
        if let Some(bit) = before.find_map(|(leg, _)| awaited(leg)) {
            return Some((bit, false));
        }
        // A program without a tool change must not cut with a tool of unknown length either.
        let is_unknown = !self.length_is_known() && !work.job.program.bits.is_empty();
        is_unknown.then(|| (work.bit.unwrap_or(0), true))
    }

    /// Moves to the change position and asks for the tool; the job continues at the start of its leg.
    pub(super) fn change_first(&mut self, bit: u32, turns: bool) -> Result<(), Diagnostic> {
        self.ask_for(AskedTool { bit, back: Back::Start { turns } })
    }

    /// Moves to the change position and asks for the tool; the job continues within its leg.
    pub(super) fn change_here(&mut self, bit: u32) -> Result<(), Diagnostic> {
        let Some(work) = &self.work else { return Ok(()) };
        let from_zero = std::array::from_fn(|axis| self.position[axis] - work.job.zero[axis]);
        let down = [0, 1].map(|axis: usize| self.down >> axis & 1 == 1);
        self.ask_for(AskedTool { bit, back: Back::Place { from_zero, down } })
    }

    pub(super) fn to_change_position(&self) -> Result<Vec<Segment>, Diagnostic> {
        queue::to_change(&self.machine, self.position, self.plane_zero(), self.length_is_known())
    }

    fn ask_for(&mut self, asked: AskedTool) -> Result<(), Diagnostic> {
        let moves = self.in_time(self.to_change_position()?)?;
        if let Some(work) = &mut self.work {
            work.asked = Some(asked);
        }
        self.give(Doing::ToChange, moves);
        Ok(())
    }

    /// At the change position: asks the user, who may insert another tool from now on.
    pub(super) fn at_change_position(&mut self) {
        self.pending.push_back(Event::BitWanted);
        let stopping = self.session.state == State::Stopping;
        let bit = self.asked_bit().filter(|_| !stopping);
        let (Some(bit), Some(work)) = (bit, &mut self.work) else { return };
        let is_first = !std::mem::replace(&mut work.has_asked, true);
        let is_same = self.known.of.as_ref() == Some(&bit) || (is_first && self.known.of.is_none());
        if work.is_worn || !is_same {
            self.known.height = self.known.height.with_another_tool(self.machine.has_equal_lengths());
        }
    }

    fn asked_bit(&self) -> Option<Bit> {
        let work = self.work.as_ref()?;
        let asked = work.asked.as_ref()?;
        work.job.program.bits.get(asked.bit as usize).cloned()
    }

    /// Fails while the current tool's length is unknown.
    pub(super) fn may_go_on(&self) -> Result<(), Diagnostic> {
        match self.asked_bit() {
            Some(bit) if !self.length_is_known() => Err(error!("control.length_first", bit = bit.titled())),
            _ => Ok(()),
        }
    }

    /// The Z zero is now valid for the current tool.
    pub(super) fn height_is_known(&mut self) {
        (self.known.height, self.known.of) = (BoardHeight::OfThisBit, self.asked_bit());
    }

    /// The running job above the board as `machine` has it, during a manual tool change. The whole job is
    /// checked again.
    pub(super) fn rebased(&self, machine: &Machine) -> Result<Option<Prepared>, Diagnostic> {
        let work = self.work.as_ref().filter(|_| self.session.changes_by_hand());
        work.map(|work| work.job.rebased(machine)).transpose()
    }

    /// The user declares that the current tool is as long as the one before, whose length must be known.
    pub(super) fn same_length(&mut self) -> Result<(), Diagnostic> {
        if self.session.state != State::ToolChange || self.asked_bit().is_none() {
            return Err(error!("control.nothing_to_do"));
        }
        if self.known.height == BoardHeight::Unknown {
            return Err(error!("control.no_length_yet"));
        }
        self.height_is_known();
        Ok(())
    }

    /// Returns to the job with the new tool. Returns `false` if no tool was asked for.
    pub(super) fn back_to_job(&mut self) -> bool {
        let bit = self.asked_bit();
        let Some(work) = &mut self.work else { return false };
        let Some(asked) = work.asked.take() else { return false };
        (work.is_worn, work.confirm_bit) = (false, false);
        match asked.back {
            Back::Place { .. } => work.given += 1,
            Back::Start { turns: false } => work.is_in = Some(asked.bit),
            Back::Start { turns: true } => {}
        }
        work.bit = Some(asked.bit);
        self.known.of = bit.filter(|_| self.known.height.may_cut());
        self.put_in(asked.bit, true);
        let moves = match asked.back {
            Back::Start { turns } => self.go_to_start(turns),
            Back::Place { from_zero, down } => self.go_back(from_zero, down),
        };
        if let Err(why) = moves {
            self.fails(why, self.session.trust);
        }
        true
    }

    fn go_back(&mut self, from_zero: Steps, down: [bool; 2]) -> Result<(), Diagnostic> {
        let Some(work) = &self.work else { return Ok(()) };
        let to: Steps = std::array::from_fn(|axis| work.job.zero[axis] + from_zero[axis]);
        let beside = [0, 1].map(|axis: usize| {
            let settings = self.machine.axis(axis);
            let play = settings.scale.steps(settings.backlash);
            (to[axis] + if down[axis] { play } else { -play }).max(settings.scale.steps(settings.min))
        });
        self.return_to(beside, to, Vec::new())
    }

    /// To the start of the next leg; starts the spindle if the leg does not.
    fn go_to_start(&mut self, turns: bool) -> Result<(), Diagnostic> {
        let Some(work) = &self.work else { return Ok(()) };
        let to = work.job.start_of_leg(work.leg);
        let [x, y, ..] = work.job.before_start(&self.machine, work.leg);
        let spindle = if turns { self.spindle_up() } else { Vec::new() };
        self.return_to([x, y], to, spindle)
    }

    fn return_to(&mut self, beside: [i64; 2], to: Steps, on: Vec<Segment>) -> Result<(), Diagnostic> {
        let mut moves = self.in_time(queue::from_change(&self.machine, self.position, beside, to)?)?;
        moves.extend(on);
        self.give(Doing::Approach, moves);
        Ok(())
    }

    /// Lifts the tool after it touched the board in a tool change.
    pub(super) fn rise_in_change(&mut self) -> Result<(), Diagnostic> {
        let z = self.machine.change_steps(&self.machine.on_surface()).max(self.position[2]);
        let up = cycles::retract(&self.machine, self.position, z)?;
        let moves = self.in_time(segments(&up, &self.machine))?;
        self.give(Doing::Park, moves);
        Ok(())
    }

    pub(super) fn measure_tool(&mut self) -> Result<(), Diagnostic> {
        self.may_touch()?;
        if self.session.state != State::ToolChange {
            return Err(error!("control.nothing_to_do"));
        }
        if !self.machine.change.setter.on {
            return Err(error!("control.no_setter"));
        }
        if !self.known.height.may_cut() && self.known.setter_steps.is_none() {
            return Err(error!("control.no_reference"));
        }
        self.begin_touching(TouchFor::Setter)
    }

    pub(super) fn setter_place(&self) -> [i64; 2] {
        [0, 1].map(|axis: usize| self.machine.axis(axis).scale.steps(self.machine.change.setter.place[axis]))
    }

    /// The tool touched the setter. A tool of known length gives the setter's height over the board; with
    /// that, every other tool's length follows.
    pub(super) fn met_setter(&mut self, at: Steps) -> Result<(), Diagnostic> {
        let (z, surface) =
            (self.machine.lowest(&at), self.machine.z.scale.steps(self.machine.process.surface));
        match self.known.setter_steps.filter(|_| !self.known.height.may_cut()) {
            Some(over) => self.set_height(self.machine.z.scale.length(z - over)),
            None => {
                self.known.setter_steps = Some(z - surface);
                Ok(())
            }
        }
    }

    pub(super) fn change_report(&self) -> Option<ChangeReport> {
        let work = self.work.as_ref().filter(|_| self.session.changes_by_hand())?;
        let asked = work.asked.as_ref()?;
        let glimpse = self.executor.shared.glimpse();
        let [is_up, is_at_place] =
            queue::at_change(&self.machine, &glimpse.position, self.plane_zero(), true);
        let length = match (self.machine.has_equal_lengths(), self.known.height.may_cut()) {
            (true, _) => LengthKnown::Equal,
            (false, true) => LengthKnown::Measured,
            (false, false) => LengthKnown::No,
        };
        Some(ChangeReport { bit: asked.bit, is_up, is_at_place, length })
    }
}
