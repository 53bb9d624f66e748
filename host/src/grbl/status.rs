//! The status reports of a controller, in the same form as a drill's, and the machine model that jobs are
//! planned for.

use super::expected;
use super::lengths::{changer_of, is_of_controller, lengths_of, reset_of};
use super::station::{Station, Work};
use crate::files::Files;
use annulus_core::control::{State, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::{BoardHeight, EnginePhase, Info, settings};
use annulus_core::job::{Input, Mark};
use annulus_core::machine::{self, AXES, MILL_KEY, Machine, MillProfile, Value};
use annulus_core::pins::SpindleState;
use annulus_core::steps::Stage;
use annulus_core::wire::{ControllerReport, InterruptedJob, Status, Tell};
use std::time::Duration;

/// Shortest time between two reports of small changes.
const PACE: Duration = Duration::from_millis(40);
const HEARTBEAT: Duration = Duration::from_millis(100);

/// Machine settings that the controller knows itself, per axis, and the number of its setting for X.
const SAID: [(&str, u16); 5] =
    [("scale", 100), ("max_speed", 110), ("max_acceleration", 120), ("min", 130), ("max", 130)];
const AXIS_NAMES: [&str; 3] = ["x", "y", "z"];

pub(super) fn set_there(key: &str) -> Option<u16> {
    if key == "spindle.max_speed" {
        return Some(30);
    }
    let (axis, name) = key.split_once('.')?;
    let axis = AXIS_NAMES.iter().position(|known| *known == axis)?;
    let (_, first) = SAID.iter().find(|(known, _)| *known == name)?;
    Some(first + axis as u16)
}

/// The controller's settings as settings of the machine. The board is assumed as far below Z's top as is
/// plausible.
fn said(info: &Info) -> Vec<(String, Value)> {
    let mut said = Vec::new();
    let mut set = |key: String, value: f64| said.push((key, Value::Number(value)));
    let axes = |first| settings::axes(&info.values, first);
    for (axis, name) in AXIS_NAMES.into_iter().enumerate() {
        if let (Some(scale), Some(rate)) = (axes(100), axes(110)) {
            set(format!("{name}.scale"), scale[axis]);
            set(format!("{name}.max_speed"), rate[axis] / 60.0);
        }
        if let Some(acceleration) = axes(120) {
            set(format!("{name}.max_acceleration"), acceleration[axis]);
        }
        if let Some([low, high]) = info.likely_ends_mm(axis) {
            set(format!("{name}.min"), low);
            set(format!("{name}.max"), high);
            set(format!("{name}.home_search"), (high - low) * 1.5);
        }
    }
    if let (Some(scale), Some(rate), Some(acceleration)) = (axes(100), axes(110), axes(120)) {
        set("motion.down_speed".to_owned(), rate[2] / 60.0);
        set("motion.down_acceleration".to_owned(), acceleration[2]);
        let hz = (0..3).map(|axis| scale[axis] * rate[axis] / 60.0).fold(25_000.0, f64::max);
        set("drive.max_step_rate".to_owned(), hz.ceil());
        set("drive.pulse_width".to_owned(), (0.4e6 / hz).min(2.0));
    }
    if let Some([low, high]) = info.likely_ends_mm(2) {
        set("stroke.surface".to_owned(), high - ((high - low) * 0.6).min(30.0));
    }
    if let Some(rpm) = info.values.get(&30).filter(|rpm| **rpm > 0.0) {
        set("spindle.max_speed".to_owned(), rpm.round());
    }
    said
}

fn mill_of(kept: &[(String, Value)]) -> Option<&'static MillProfile> {
    kept.iter().find_map(|(key, value)| match value {
        Value::Text(name) if key == MILL_KEY => machine::mill(name),
        _ => None,
    })
}

/// The machine that jobs are planned for: the user's mill profile or the `named` machine, then the
/// controller's settings if they are valid, then the user's settings.
fn machine_of(kept: &[(String, Value)], info: &Info, named: Option<&Machine>) -> Machine {
    let base = match (mill_of(kept), named) {
        (None, Some(named)) => named.clone(),
        (mill, _) => {
            let mill = mill.map_or_else(machine::hobby_3018, MillProfile::machine);
            let name = format!("{} {}", info.flavour(), info.version).chars().take(60).collect();
            Machine { name, description: String::new(), ..mill }
        }
    };
    let said = said(info);
    let base = machine::apply(&base, &said).unwrap_or(base);
    let set: Vec<_> = kept.iter().filter(|(key, _)| !is_of_controller(key)).cloned().collect();
    machine::apply(&base, &set).unwrap_or(base)
}

impl<F: Files> Station<F> {
    /// Rebuilds the machine from the current settings.
    pub(super) fn describe(&mut self) {
        let kept = self.ledger.settings();
        let named = self.named.as_ref();
        self.mill = mill_of(&kept).or(named.and_then(|named| named.mill));
        (self.lengths, self.reset) = (lengths_of(&kept), reset_of(&kept));
        self.changer = changer_of(&kept);
        let named = named.map(|named| &named.machine);
        self.machine = machine_of(&kept, &self.attended.controller().info, named);
    }

    pub(super) fn unlike_mill(&self) -> Vec<Diagnostic> {
        let info = &self.attended.controller().info;
        let unlike = self.mill.map(|mill| expected::unlike_mill(mill, info.flavour(), &info.values));
        unlike.unwrap_or_default()
    }

    pub(super) fn controller_tell(&self) -> Tell {
        let info = &self.attended.controller().info;
        let (flavour, version) = (info.flavour().to_owned(), info.version.clone());
        let values = info.values.iter().map(|(number, value)| (*number, *value)).collect();
        let mill = self.mill.map(|mill| mill.name.to_owned());
        let (lengths, reset_on_open) = (self.lengths, self.reset);
        let changer = self.changer.lines().to_vec();
        Tell::Controller(ControllerReport { flavour, version, values, mill, lengths, reset_on_open, changer })
    }

    pub(super) fn machine_tell(&self) -> Tell {
        Tell::Machine {
            settings: machine::read(&self.machine),
            fingerprint: self.machine.fingerprint(),
            faults: None,
        }
    }

    /// The interrupted job, if there is one and no job runs.
    pub(super) fn offer_tell(&self) -> Option<Tell> {
        let order = self.offer.as_ref().filter(|_| self.work.is_none())?;
        let done = self.ledger.entry().done;
        let (holes_done, toolpaths_done) = order.made(done);
        let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        Some(Tell::Interrupted(InterruptedJob {
            job: order.key.clone(),
            name: order.program.name.clone(),
            next_leg: count(order.leg(done)),
            holes_done,
            holes_total: count(order.program.hole_count()),
            toolpaths_done,
            toolpaths_total: count(order.program.toolpath_count()),
        }))
    }

    /// Messages for a newly connected page, once the controller is identified.
    pub fn greeting(&self) -> Vec<Tell> {
        if !self.greeted {
            return Vec::new();
        }
        let mut tells = vec![self.machine_tell(), self.controller_tell()];
        tells.push(Tell::Status(Box::new(self.status())));
        tells.extend(self.offer_tell());
        tells.push(self.surface_tell());
        tells.push(Tell::Tools(self.tools_report()));
        tells
    }

    pub fn report(&mut self) {
        if !self.greeted {
            return;
        }
        let now = (self.time)();
        self.tell_tools();
        let status = self.status();
        let since = now.saturating_sub(self.told.1);
        let coarse = self.told.0.as_ref().is_none_or(|told| {
            (told.state, told.trust) != (status.state, status.trust) || told.alarm != status.alarm
        });
        let changed = since >= PACE && self.told.0.as_ref() != Some(&status);
        if coarse || changed || since >= HEARTBEAT {
            self.told = (Some(status.clone()), now);
            self.tell(Tell::Status(Box::new(status)));
        }
    }

    pub fn moves(&self) -> bool {
        !matches!(self.state(), State::Ready | State::NotHomed | State::Alarm)
    }

    pub(super) fn state(&self) -> State {
        let controller = self.attended.controller();
        let homes = settings::on(&controller.info.values, 22);
        let homed = self.told.0.as_ref().is_some_and(|told| told.state == State::Homing);
        match controller.phase {
            // A door or a button at the machine.
            _ if controller.stands() => State::Paused,
            EnginePhase::Homing => State::Homing,
            // Until the first report after homing.
            EnginePhase::Ready if controller.status.is_none() && homed => State::Homing,
            EnginePhase::Ready if controller.status.is_none() => State::Stopping,
            EnginePhase::Jogging if controller.parks() => State::Parking,
            EnginePhase::Jogging | EnginePhase::Probing | EnginePhase::Surveying => State::Jogging,
            EnginePhase::Checking => State::Checking,
            EnginePhase::Running => State::Running,
            EnginePhase::Holding => State::Pausing,
            EnginePhase::Held => State::Paused,
            EnginePhase::ToolChange | EnginePhase::Measuring | EnginePhase::Changing => State::ToolChange,
            // A reset ends it: the controller sends its banner again.
            EnginePhase::Stopping | EnginePhase::Greeting => State::Stopping,
            _ if self.alarm.is_some() => State::Alarm,
            EnginePhase::Ready if !homes || self.hand.unlocked || controller.trust == Trust::Trusted => {
                State::Ready
            }
            EnginePhase::Ready | EnginePhase::Locked | EnginePhase::Closed => State::NotHomed,
        }
    }

    fn status(&self) -> Status {
        let controller = self.attended.controller();
        let report = controller.status.as_ref();
        let machine_mm = report.and_then(|report| report.machine_mm).unwrap_or_default();
        let work_mm = controller.place().unwrap_or(machine_mm);
        let scale = settings::axes(&controller.info.values, 100);
        let mut steps = [0; AXES];
        for (axis, scale) in scale.unwrap_or_default().into_iter().enumerate() {
            steps[axis] = (machine_mm[axis] * scale).round() as i64;
        }
        let known = self.hand.zero_set || controller.trust == Trust::Trusted;
        let work = self.work.as_ref();
        let program = work.map(|work| &work.order.program);
        let done = self.attended.entry().done;
        let at = work.map(|work| work.order.leg(done));
        let mark = at.and_then(|at| Some(program?.legs.get(at)?.mark));
        let bit = at.and_then(|at| bit_at(&program?.legs, at));
        let (holes_done, toolpaths_done) = work.map_or((0, 0), |work| work.order.made(done));
        let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        let overrides = report.and_then(|report| report.overrides).unwrap_or([100; 3]);
        let [feed, rapid, spindle] = overrides.map(|percent| percent.min(200));
        let (left_s, done_share) = work.map_or((0.0, 0.0), |work| times(work, done, feed));
        let now = (self.time)();
        Status {
            state: self.state(),
            trust: controller.trust,
            steps,
            machine_mm,
            work_mm,
            zero_mm: controller.zero_mm.filter(|_| known).map(|[x, y, _]| [x, y]),
            needs_z_zero: controller.height() == BoardHeight::Unknown && !self.resumes_at_height(),
            target_mm: None,
            lower_dead_point_mm: None,
            job: work.map(|work| work.order.key.clone()),
            job_name: program.map(|program| program.name.clone()),
            leg: at.map(count),
            hole: if let Some(Mark::Hole(hole)) = mark { Some(hole) } else { None },
            holes_done,
            holes_total: program.map_or(0, |program| count(program.hole_count())),
            toolpath: if let Some(Mark::Toolpath(toolpath)) = mark { Some(toolpath) } else { None },
            toolpaths_done,
            toolpaths_total: program.map_or(0, |program| count(program.toolpath_count())),
            stage: mark.and_then(|mark| self.stage(mark, work_mm[2])),
            measuring: controller.measuring(),
            changing: controller.changing(),
            change: None,
            command: None,
            bit,
            bit_mm: bit.and_then(|bit| Some(program?.bits.get(bit as usize)?.diameter.mm())),
            spindle_rpm: self.rpm(),
            spindle: SpindleState::Untold,
            feed_override_percent: feed as u8,
            spindle_override_percent: Some(spindle as u8),
            rapid_override_percent: Some(rapid as u8),
            inputs: report.map_or(0, |report| inputs(&report.pins)),
            touches: None,
            lift_first_mm: controller.lift_first_mm(),
            paused_on_path: None,
            other_firmware: None,
            phases: [0; 3],
            slips: Vec::new(),
            drilled: None,
            missing: None,
            drilled_twice: Vec::new(),
            elapsed_s: work.map_or(0.0, |work| now.saturating_sub(work.started).as_secs_f64()),
            left_s,
            done_share,
            alarm: self.alarm.clone(),
        }
    }

    /// The stage, as far as the tool's height reveals it.
    fn stage(&self, mark: Mark, height_mm: f64) -> Option<Stage> {
        let moves = self.attended.controller().phase == EnginePhase::Running;
        match mark {
            _ if !moves => None,
            Mark::Hole(_) if height_mm < 0.0 => Some(Stage::Drill),
            Mark::Toolpath(_) if height_mm < 0.0 => Some(Stage::Mill),
            _ => Some(Stage::Travel),
        }
    }

    /// The spindle speed in the last report; 0 if that report shows the spindle off.
    fn rpm(&self) -> u32 {
        let report = self.attended.controller().status.as_ref();
        let off = report
            .and_then(|report| report.accessories.as_deref())
            .is_some_and(|on| !on.contains(['S', 'C']));
        report.and_then(|report| report.speed_rpm).filter(|_| !off).map_or(0, |rpm| rpm.max(0.0) as u32)
    }
}

fn bit_at(legs: &[annulus_core::job::Leg], at: usize) -> Option<u32> {
    legs.iter().take(at).rev().find_map(|leg| match leg.mark {
        Mark::ToolChange(bit) => Some(bit),
        _ => None,
    })
}

/// Seconds left of a job with `done` completed sections, and the completed share.
fn times(work: &Work, done: usize, feed_percent: u16) -> (f64, f64) {
    let whole: f64 = work.each_s.iter().sum();
    let left: f64 = work.each_s.iter().skip(done.saturating_sub(work.from)).sum();
    let share = if whole > 0.0 { 1.0 - left / whole } else { 0.0 };
    (left * 100.0 / f64::from(feed_percent.max(1)), share)
}

/// Input bits from GRBL's pin letters. A letter does not identify the end of a limit switch; most machines
/// home to the far end.
fn inputs(pins: &str) -> u32 {
    let of = |letter| match letter {
        'X' => Input::XMax.bit(),
        'Y' => Input::YMax.bit(),
        'Z' => Input::ZTop.bit(),
        'P' => Input::Contact.bit(),
        _ => 0,
    };
    pins.chars().map(of).fold(0, |all, bit| all | bit)
}
