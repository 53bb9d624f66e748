//! The status reports of the drill.

use super::Owner;
use super::moves::Doing;
use annulus_core::code;
use annulus_core::job::{Command, Leg, Mark};
use annulus_core::machine::{self, Output, Steps, phases};
use annulus_core::pins::SpindleState;
use annulus_core::steps::{Stage, TICK_HZ};
use annulus_core::wire::{InterruptedJob, SlipReport, Status, Tell};
use std::time::Duration;

/// Shortest time between two reports of small changes.
const PACE: Duration = Duration::from_millis(40);

pub(crate) const HEARTBEAT: Duration = Duration::from_millis(100);

impl Owner {
    pub(crate) fn now(&self) -> Duration {
        (self.time)()
    }

    pub(crate) fn tell(&self, tell: Tell) {
        self.outside.tell(tell);
    }

    pub(crate) fn tell_status(&mut self) {
        let now = self.now();
        let since = now.saturating_sub(self.told.1);
        let coarse = self.told.0.as_ref().is_none_or(|told| {
            told.state != self.session.state
                || told.trust != self.session.trust
                || told.alarm != self.session.alarm
        });
        if !coarse && since < PACE {
            return;
        }
        self.tell_tools();
        let status = self.status();
        if coarse || since >= HEARTBEAT || self.told.0.as_ref() != Some(&status) {
            self.told = (Some(status.clone()), now);
            self.tell(Tell::Status(Box::new(status)));
        }
    }

    fn tell_tools(&mut self) {
        let report = self.tools_report();
        if report != self.tools_told {
            self.tools_told = report.clone();
            self.tell(Tell::Tools(report));
        }
    }

    pub(crate) fn machine_tell(&self) -> Tell {
        Tell::Machine {
            settings: machine::read(&self.machine),
            fingerprint: self.machine.fingerprint(),
            faults: (self.machine.output == Output::Virtual).then(|| self.hands.faults.named.clone()),
        }
    }

    /// The interrupted job, if there is one and no job runs.
    pub(crate) fn offer(&self) -> Option<Tell> {
        let (job, progress) = self.interrupted.as_ref().filter(|_| self.work.is_none())?;
        Some(Tell::Interrupted(InterruptedJob {
            job: job.key.clone(),
            name: job.name.clone(),
            next_leg: progress.done,
            holes_done: progress.holes,
            holes_total: job.holes_total,
            toolpaths_done: progress.toolpaths,
            toolpaths_total: job.toolpaths_total,
        }))
    }

    pub fn greeting(&self) -> Vec<Tell> {
        let mut tells = vec![self.machine_tell(), Tell::Status(Box::new(self.status()))];
        tells.extend(self.timing.clone().map(|timing| Tell::Timing(Box::new(timing))));
        tells.extend(self.prepared.as_ref().map(|prepared| prepared.tell()));
        tells.extend(self.offer());
        tells.push(Tell::Tools(self.tools_report()));
        tells.extend(self.queue_greeting());
        tells.push(self.outputs_tell());
        tells.push(self.surface_tell());
        tells.extend(self.machine.has_magazine().then(|| self.magazine_tell()));
        tells
    }

    /// Whether the spindle responds; `None` if it does not report.
    pub(crate) fn spindle_answers(&self) -> Option<bool> {
        match self.executor.shared.glimpse().spindle {
            SpindleState::Untold => None,
            SpindleState::Unreachable | SpindleState::Lost { .. } => Some(false),
            SpindleState::Off { .. } | SpindleState::Reaching { .. } | SpindleState::AtSpeed { .. } => {
                Some(true)
            }
        }
    }

    fn mm(&self, steps: &Steps) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.machine.axis(axis).scale.length(steps[axis]).mm())
    }

    fn status(&self) -> Status {
        let glimpse = self.executor.shared.glimpse();
        let machine_mm = self.mm(&glimpse.position);
        let zero = self.session.zero();
        let axes = [&self.machine.x, &self.machine.y];
        let zero_mm = zero.map(|zero| [0, 1].map(|axis: usize| axes[axis].scale.length(zero[axis]).mm()));
        let origin = zero_mm.unwrap_or_default();
        let surface = self.machine.process.surface.mm();
        let work_mm = [machine_mm[0] - origin[0], machine_mm[1] - origin[1], machine_mm[2] - surface];
        let work = self.work.as_ref();
        let leg = work.and_then(|work| work.job.program.legs.get(work.leg));
        let target = work.filter(|_| {
            self.doing == Doing::Leg && matches!(glimpse.stage, Some(Stage::Travel | Stage::NextHole))
        });
        let target_mm =
            target.map(|_| [0, 1].map(|axis: usize| axes[axis].scale.length(glimpse.end[axis]).mm()));
        let stage =
            glimpse.stage.map(|stage| if stage == Stage::NextHole { hop_stage(work_mm[2]) } else { stage });
        let left_at = |leg: usize| work.and_then(|work| work.job.left_ticks.get(leg)).copied().unwrap_or(0);
        let (all, ticks) = (left_at(0), left_at(work.map_or(0, |work| work.leg)));
        let bit = work.and_then(|work| work.bit);
        let bits = work.map(|work| &work.job.program.bits);
        Status {
            state: self.session.state,
            trust: self.session.trust,
            steps: glimpse.position,
            machine_mm,
            work_mm,
            zero_mm,
            // Never: the height of the board is a setting, or the job asks for it at its first tool change.
            needs_z_zero: false,
            target_mm,
            lower_dead_point_mm: leg.and_then(lowest_mm),
            job: work.map(|work| work.job.key.clone()),
            job_name: work.map(|work| work.job.program.name.clone()),
            leg: work.map(|work| u32::try_from(work.leg).unwrap_or(u32::MAX)),
            hole: leg.and_then(|leg| if let Mark::Hole(hole) = leg.mark { Some(hole) } else { None }),
            holes_done: work.map_or(0, |work| work.holes),
            holes_total: work.map_or(0, |work| count(work.job.program.hole_count())),
            toolpath: leg
                .and_then(|leg| if let Mark::Toolpath(number) = leg.mark { Some(number) } else { None }),
            toolpaths_done: work.map_or(0, |work| work.toolpaths),
            toolpaths_total: work.map_or(0, |work| count(work.job.program.toolpath_count())),
            stage,
            measuring: None,
            changing: None,
            change: self.change_report(),
            command: self.queue_command().or(stage.map(|stage| command_name(stage).to_owned())),
            bit,
            bit_mm: bit.and_then(|bit| bits?.get(bit as usize).map(|bit| bit.diameter.mm())),
            spindle_rpm: self.wanted_rpm(glimpse.rpm),
            spindle: glimpse.spindle,
            feed_override_percent: self.feed_override_percent(),
            spindle_override_percent: None,
            rapid_override_percent: None,
            inputs: glimpse.inputs,
            touches: glimpse.touches,
            lift_first_mm: self.lift_first_mm(),
            paused_on_path: self.pause_on_path(),
            other_firmware: glimpse.other_firmware,
            phases: [0, 1, 2].map(|axis| self.phase_byte(axis, glimpse.position[axis])),
            slips: self.slips(),
            drilled: self.judged.told,
            missing: self.judged.missing.clone(),
            drilled_twice: self.judged.twice.clone(),
            elapsed_s: work.map_or(0.0, |work| self.now().saturating_sub(work.started).as_secs_f64()),
            left_s: ticks as f64 / TICK_HZ as f64 / self.speed * 100.0
                / f64::from(self.executor.shared.feed_override().max(1)),
            done_share: if all > 0 { 1.0 - ticks as f64 / all as f64 } else { 0.0 },
            alarm: self.session.alarm.clone(),
        }
    }
}

impl Owner {
    /// The spindle speed to show. 0 if the executor died, unless its outputs could not be switched off.
    fn wanted_rpm(&self, told_rpm: u32) -> u32 {
        let stays_on = self.session.alarm.as_ref().is_some_and(|why| why.code == code!("output.not_safe"));
        if self.executor.is_gone() && !stays_on { 0 } else { told_rpm }
    }

    /// The phase byte of `axis` at `steps`: with forcing voltage if it moved since the last report.
    fn phase_byte(&self, axis: usize, steps: i64) -> u8 {
        let table = &self.machine.axis(axis).phases;
        let told = self.told.0.as_ref().map_or(steps, |told| told.steps[axis]);
        let before = steps - (steps - told).signum();
        phases::byte(table, steps, phases::column(table, before))
    }

    /// Where the virtual drill lost steps.
    pub(crate) fn slips(&self) -> Vec<SlipReport> {
        let Ok(slips) = self.hands.slips.lock() else { return Vec::new() };
        let told = slips.iter().map(|slip| SlipReport {
            axis: slip.axis as u8,
            place_mm: self.machine.axis(slip.axis).scale.length(slip.place).mm(),
            lost: slip.lost,
            cause: slip.cause.name().to_owned(),
        });
        told.collect()
    }
}

fn count(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

/// The stage of a move between holes, as far as the tool's height reveals it.
fn hop_stage(height_mm: f64) -> Stage {
    if height_mm < 0.0 { Stage::Drill } else { Stage::Travel }
}

fn command_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Travel => "rapid",
        Stage::Approach | Stage::Drill => "plunge",
        Stage::NextHole => "hole",
        Stage::Mill => "mill",
        Stage::Retract => "retract",
        Stage::Dwell => "dwell",
        Stage::AwaitBit => "await_bit",
        Stage::Seek | Stage::BackOff | Stage::Locate | Stage::Index | Stage::Offset => "home",
        Stage::Jog => "jog",
        Stage::Touch => "touch",
    }
}

/// The lowest depth of a leg, mm over the work zero.
fn lowest_mm(leg: &Leg) -> Option<f64> {
    let depths = leg.commands.iter().filter_map(|command| match command {
        Command::Plunge { to, .. } => Some(to.mm()),
        Command::Mill { height, .. } | Command::MillArc { height, .. } => Some(height.mm()),
        _ => None,
    });
    depths.reduce(f64::min)
}
