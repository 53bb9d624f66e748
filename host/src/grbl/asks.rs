//! Translates the page's requests into those of the GRBL engine.

use super::job_tools::{JobTools, SectionWear};
use super::lengths::{self, is_of_controller};
use super::level::SurveyWish;
use super::order::{Armed, Draft, Order, Written};
use super::station::{Station, Work, Zero};
use super::status::set_there;
use crate::files::Files;
use annulus_core::control::State;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::grbl::{self as grbl, EngineEvent, EnginePhase, OverrideOf, settings};
use annulus_core::machine::{self, MILL_KEY, Machine, ParkAt, Value, is_in_file_only};
use annulus_core::wire::{ArmedJob, Ask, JOG_GRANT_MS, RowVerdict, Tell};
use annulus_core::{code, error};
use std::time::Duration;

/// Jog speeds, mm/min: XY, and Z.
const JOG_MM_PER_MIN: [f64; 2] = [1_000.0, 300.0];
/// Longest jog if the travel is unknown, mm.
const FURTHEST_MM: f64 = 300.0;
/// Probing speed (mm/min), greatest depth, and lift after contact (mm).
const PROBE_MM_PER_MIN: f64 = 60.0;
const DEEPEST_PROBE_MM: f64 = 50.0;
const PROBE_UP_MM: f64 = 2.0;
/// How far the tool backs off a touched edge, mm.
const EDGE_BACK_MM: f64 = 1.0;

fn refusal<T>(code: &str) -> Result<T, Diagnostic> {
    Err(Diagnostic::error(code))
}

impl<F: Files> Station<F> {
    pub(super) fn asked(&mut self, ask: Ask) -> Result<(), Diagnostic> {
        match ask {
            Ask::Home => self.engine_asked(grbl::EngineAsk::Home),
            Ask::Park => self.park(),
            Ask::SetZero => self.set_plane(),
            Ask::SetHeight => self.set_height(),
            Ask::UndoZero => self.undo_zero(),
            Ask::Probe { depth_um, plate_um } => self.probe(depth_um, plate_um),
            Ask::Edge { axis, up, reach_um, tool_um } => self.edge((axis, up), reach_um, tool_um),
            Ask::Survey { grid, job, clear_um, depth_um, now_s } => {
                self.survey(SurveyWish { grid, job, clear_um, depth_um, now_s })
            }
            Ask::ForgetHeightMap if self.work.is_some() => refusal(code!("control.busy")),
            Ask::ForgetHeightMap => self.keep_surface(None),
            Ask::Jog { axis, distance_um, anyway } => self.jog(axis, distance_um, anyway),
            Ask::JogOn => {
                // A late keep-alive must not start a new jog.
                if self.hand.until.is_some_and(|until| (self.time)() <= until) {
                    self.hand.until = Some(self.granted());
                }
                Ok(())
            }
            Ask::Start { job, from_leg, .. } => self.start(&job, from_leg),
            Ask::Pause => self.engine_asked(grbl::EngineAsk::Hold),
            Ask::Resume => self.engine_asked(grbl::EngineAsk::Resume),
            Ask::StopAfterHole => {
                self.hand.stops_after = self.work.is_some();
                self.engine_asked(grbl::EngineAsk::StopAfter)
            }
            Ask::FeedOverride { percent } => self.override_to(OverrideOf::Feed, percent),
            Ask::SpindleOverride { percent } => self.override_to(OverrideOf::Spindle, percent),
            Ask::RapidOverride { percent } => self.override_to(OverrideOf::Rapid, percent),
            Ask::Check { job } => self.check(&job),
            Ask::ToolChanged => self.engine_asked(grbl::EngineAsk::ToolReady),
            Ask::NewTool { number } => self.new_tool(number),
            Ask::AcknowledgeAlarm => {
                self.alarm = None;
                let homes = settings::on(&self.attended.controller().info.values, 22);
                let locked = self.attended.controller().phase == EnginePhase::Locked;
                if locked && !homes { self.engine_asked(grbl::EngineAsk::Unlock) } else { Ok(()) }
            }
            Ask::Unlock => {
                self.hand.unlocked = true;
                // Already unlocked: the user only wants jogging allowed.
                if self.attended.controller().phase == EnginePhase::Ready {
                    return Ok(());
                }
                self.engine_asked(grbl::EngineAsk::Unlock)
            }
            Ask::ForgetInterrupted => self.forget(),
            Ask::Configure { changes } => self.configure(&changes),
            Ask::Provoke { .. } => refusal(code!("fault.of_virtual_drill")),
            Ask::LiftTool => refusal(code!("control.no_lift_on_path")),
            Ask::Queue { .. } | Ask::QueueRun { .. } | Ask::QueueClear => refusal(code!("grbl.no_queue")),
            Ask::OutputLease { .. } | Ask::Output { .. } => refusal(code!("grbl.no_outputs")),
            Ask::SameLength | Ask::MeasureTool => refusal(code!("control.drills_alone")),
            Ask::Stock { .. } | Ask::ToolSeen { .. } | Ask::OpenClamp => refusal(code!("grbl.no_magazine")),
            // The line answers these itself.
            Ask::Arm { .. }
            | Ask::Hello { .. }
            | Ask::Ping { .. }
            | Ask::Stop
            | Ask::TakeControl { .. }
            | Ask::ReleaseControl => refusal(code!("control.not_for_the_drill")),
        }
    }

    /// Passes a request to the engine. The first error becomes the result; everything else is reported to
    /// the page.
    pub(super) fn engine_asked(&mut self, ask: grbl::EngineAsk) -> Result<(), Diagnostic> {
        let mut refused = None;
        for why in self.engine(EngineEvent::Ask(ask)) {
            if why.severity == Severity::Error && refused.is_none() {
                refused = Some(why);
            } else {
                self.tell(Tell::Refused { why });
            }
        }
        refused.map_or(Ok(()), Err)
    }

    fn granted(&self) -> Duration {
        (self.time)() + Duration::from_millis(JOG_GRANT_MS)
    }

    /// Jogs for as long as the page keeps renewing it, and within the travel limits if they are known.
    fn jog(&mut self, axis: u8, distance_um: i32, anyway: bool) -> Result<(), Diagnostic> {
        let index = usize::from(axis);
        if index > 2 {
            return refusal(code!("control.no_such_jog"));
        }
        if self.state() == State::NotHomed {
            return refusal(code!("control.not_homed"));
        }
        let controller = self.attended.controller();
        let place = controller.status.as_ref().and_then(|status| status.machine_mm).map(|place| place[index]);
        let travel = settings::axes(&controller.info.values, 130).map_or(FURTHEST_MM, |travel| travel[index]);
        let wanted = f64::from(distance_um) / 1e3;
        let [low, high] = match (controller.room_mm(index), place) {
            (Some([low, high]), Some(place)) => [(low - place).min(0.0), (high - place).max(0.0)],
            _ => [-travel, travel],
        };
        let um = (wanted.clamp(low, high) * 1e3) as i32;
        if um == 0 {
            return Err(error!("control.end_of_travel", axis = machine::axis_name(index)));
        }
        let fastest = settings::axes(&controller.info.values, 110).map_or(f64::INFINITY, |rate| rate[index]);
        let mm_per_min = JOG_MM_PER_MIN[usize::from(index == 2)].min(fastest);
        self.engine_asked(grbl::EngineAsk::Jog { axis, um, mm_per_min, anyway })?;
        self.hand.until = Some(self.granted());
        Ok(())
    }

    /// Moves to the park position. Needs no renewal by the page; STOP ends it.
    pub(super) fn park(&mut self) -> Result<(), Diagnostic> {
        if self.state() == State::NotHomed {
            return refusal(code!("control.not_homed"));
        }
        let machine = &self.machine;
        let from_low_mm = (machine.park.at == ParkAt::Place)
            .then(|| [0, 1].map(|axis: usize| (machine.park.place[axis] - machine.axis(axis).min).mm()));
        self.engine_asked(grbl::EngineAsk::Park { from_low_mm })?;
        self.hand.until = None;
        Ok(())
    }

    /// A running job keeps its zero.
    fn set_plane(&mut self) -> Result<(), Diagnostic> {
        if self.work.is_some() {
            return refusal(code!("control.busy"));
        }
        let before = self.attended.controller().zero_mm;
        self.engine_asked(grbl::EngineAsk::SetZero { axes: [true, true, false], height_mm: 0.0 })?;
        (self.hand.zero_asked, self.hand.zero_before_mm) = (Some(Zero::Plane), before);
        Ok(())
    }

    fn set_height(&mut self) -> Result<(), Diagnostic> {
        let (height_mm, set) = self.surface_mm()?;
        self.engine_asked(grbl::EngineAsk::SetZero { axes: [false, false, true], height_mm })?;
        self.hand.zero_asked = Some(Zero::Height(set));
        Ok(())
    }

    /// Restores the previous XY zero; Z keeps its zero.
    fn undo_zero(&mut self) -> Result<(), Diagnostic> {
        let Some([x, y, _]) = self.hand.zero_before_mm else {
            return refusal(code!("control.no_zero_before"));
        };
        self.engine_asked(grbl::EngineAsk::ZeroAt { place_mm: [Some(x), Some(y), None] })?;
        (self.hand.zero_before_mm, self.hand.zero_asked) = (None, Some(Zero::Plane));
        Ok(())
    }

    fn probe(&mut self, depth_um: u32, plate_um: u32) -> Result<(), Diagnostic> {
        if self.state() == State::NotHomed {
            return refusal(code!("control.not_homed"));
        }
        let depth_mm = (f64::from(depth_um) / 1e3).min(DEEPEST_PROBE_MM);
        let (surface_mm, set) = self.surface_mm()?;
        let plate_mm = f64::from(plate_um) / 1e3 + surface_mm;
        let mm_per_min = PROBE_MM_PER_MIN;
        self.engine_asked(grbl::EngineAsk::Probe { depth_mm, mm_per_min, plate_mm, up_mm: PROBE_UP_MM })?;
        // The lift after probing must not need a renewal by the page.
        self.hand.until = None;
        self.hand.zero_asked = Some(Zero::Height(set));
        Ok(())
    }

    fn edge(&mut self, (axis, up): (u8, bool), reach_um: u32, tool_um: u32) -> Result<(), Diagnostic> {
        if self.state() == State::NotHomed {
            return refusal(code!("control.not_homed"));
        }
        // A running job keeps its zero.
        if self.work.is_some() {
            return refusal(code!("control.busy"));
        }
        let mm = |um: u32| f64::from(um) / 1e3;
        let reach_mm = mm(reach_um);
        if axis > 1 || !(0.0..=DEEPEST_PROBE_MM).contains(&reach_mm) || mm(tool_um) > DEEPEST_PROBE_MM {
            return refusal(code!("touch.bad"));
        }
        let before = self.attended.controller().zero_mm;
        self.engine_asked(grbl::EngineAsk::Edge {
            axis,
            reach_mm: if up { reach_mm } else { -reach_mm },
            mm_per_min: PROBE_MM_PER_MIN,
            radius_mm: mm(tool_um) / 2.0,
            back_mm: EDGE_BACK_MM,
        })?;
        // Backing off the edge must not need a renewal by the page.
        self.hand.until = None;
        (self.hand.zero_asked, self.hand.zero_before_mm) = (Some(Zero::Edge), before);
        Ok(())
    }

    fn override_to(&mut self, of: OverrideOf, percent: u8) -> Result<(), Diagnostic> {
        self.engine_asked(grbl::EngineAsk::Override { of, percent })
    }

    fn offered(&self, job: &str, from_leg: u32) -> Option<&Order> {
        self.offer.as_ref().filter(|order| from_leg > 0 && order.key == job)
    }

    /// What an uploaded job's G-code is written from; `None` if the job resumes and its G-code exists.
    ///
    /// For a large job, writing the G-code takes seconds, and this station could not end a jog meanwhile. So
    /// the caller writes it, then calls [`Self::arm`].
    pub fn draft(&self, job: &str, from_leg: u32) -> Result<Option<Draft>, Diagnostic> {
        if self.work.is_some() {
            return refusal(code!("control.busy"));
        }
        if self.offered(job, from_leg).is_some() {
            return Ok(None);
        }
        if from_leg > 0 {
            return refusal(code!("control.leg_not_offered"));
        }
        let bytes = self.job(job).ok_or_else(|| error!("control.no_such_job"))?;
        let (key, bytes, machine) = (job.to_owned(), bytes.to_vec(), self.machine.clone());
        Ok(Some(Draft { key, bytes, machine }))
    }

    /// Checks a job against the controller's current state: the `written` job, or the interrupted one.
    pub fn arm(&mut self, job: &str, from_leg: u32, written: Option<Written>) -> Result<Tell, Diagnostic> {
        if self.work.is_some() {
            return refusal(code!("control.busy"));
        }
        let order = match (self.offered(job, from_leg), written) {
            (Some(order), _) => order.clone(),
            (None, None) => return refusal(code!("control.leg_not_offered")),
            // The settings changed while the G-code was written.
            (None, Some(written)) if written.fingerprint != self.machine.fingerprint() => {
                return refusal(code!("control.not_armed"));
            }
            (None, Some(written)) => written.order,
        };
        let from_leg = from_leg as usize;
        let done = self.ledger.entry().done;
        if from_leg > 0 && order.leg(done) != from_leg {
            return refusal(code!("control.leg_not_offered"));
        }
        let from = if from_leg > 0 { done } else { 0 };
        let (order, level) = self.levelled(order, from, from_leg > 0);
        let start = self.start_of(&order, from);
        let mut checks = self.rows(&order, &start);
        let refused = level.iter().find(|row| row.verdict == RowVerdict::Fail);
        let refused = refused.map(|row| row.finding.clone());
        checks.extend(level);
        let (from_leg, zero_mm) = (from_leg as u32, self.attended.controller().zero_mm);
        self.armed = Some(Armed { order, from_leg, start, zero_mm, refused });
        // The controller plans its own motion, so there is no stream digest.
        let levelled = false;
        Ok(Tell::Armed(ArmedJob { job: job.to_owned(), stream_digest: String::new(), levelled, checks }))
    }

    /// Starts the armed job. The job is durable before the first line is sent.
    fn start(&mut self, job: &str, from_leg: u32) -> Result<(), Diagnostic> {
        // If the zero moved since arming, the check compared with another zero.
        let zero_mm = self.attended.controller().zero_mm;
        let same =
            |armed: &Armed| armed.order.key == job && armed.from_leg == from_leg && armed.zero_mm == zero_mm;
        let Some(Armed { order, start, refused: level, .. }) = self.armed.take_if(|armed| same(armed)) else {
            return refusal(code!("control.not_armed"));
        };
        // The controller's state may have changed since arming: check again.
        let refused = self.rows(&order, &start).into_iter().find(|row| row.verdict == RowVerdict::Fail);
        let refused =
            refused.map(|row| row.finding).or(level).or_else(|| self.unfollowed(&order, start.from));
        if let Some(why) = refused {
            return Err(why);
        }
        self.bringing = Some(self.ledger.bring(&order)?);
        let each_s = self.estimates(&order, start.from).unwrap_or_default();
        let sections = SectionWear::by_legs(&order.program, order.legs.clone());
        let machine = (self.machine.name.as_str(), self.machine.rack.as_slice());
        self.attended.counts(Some(JobTools::new(sections, machine, self.ledger.wear().to_vec())));
        self.work = Some(Work { order, from: start.from, each_s, started: (self.time)() });
        // The user has already read and accepted these problems.
        let accepted = start.accepted.clone();
        let found = self.engine(EngineEvent::Ask(grbl::EngineAsk::Start(start)));
        let refused = found.into_iter().find(|why| why.is_unacknowledged(&accepted));
        if self.attended.controller().phase == EnginePhase::Running {
            (self.offer, self.alarm) = (None, None);
            return refused.map_or(Ok(()), Err);
        }
        (self.work, self.bringing) = (None, None);
        refused.map_or_else(|| refusal(code!("grbl.not_now")), Err)
    }

    fn forget(&mut self) -> Result<(), Diagnostic> {
        if self.offer.is_none() {
            return Ok(());
        }
        let entry = super::AttendedJob { ended: true, ..self.ledger.entry().clone() };
        let wear = self.ledger.wear().to_vec();
        self.ledger.save(&entry, wear)?;
        self.offer = None;
        Ok(())
    }

    /// Changes Annulus' own settings. Settings that the controller holds itself must be changed there.
    fn configure(&mut self, changes: &[(String, Value)]) -> Result<(), Diagnostic> {
        if self.work.is_some() {
            return refusal(code!("control.busy"));
        }
        for (key, _) in changes {
            if is_in_file_only(key) {
                return Err(error!("control.in_file_only", key = key));
            }
            if let Some(number) = set_there(key) {
                return Err(error!("grbl.set_there", key = key, number = number));
            }
        }
        let refused = |mut reasons: Vec<Diagnostic>| reasons.swap_remove(0);
        let (mill, set): (Vec<_>, Vec<_>) = changes.iter().cloned().partition(|(key, _)| key == MILL_KEY);
        if let Some((_, name)) = mill.iter().find(|(_, name)| !is_mill(name)) {
            return Err(error!("grbl.no_such_mill", name = name));
        }
        let (own, set): (Vec<_>, Vec<_>) = set.into_iter().partition(|(key, _)| is_of_controller(key));
        if let Some(why) = own.iter().find_map(lengths::refused) {
            return Err(why);
        }
        let changed = machine::apply(&self.machine, &set).map_err(refused)?;
        if let Some(why) = unfit(&changed) {
            return Err(why);
        }
        let mut kept = self.ledger.settings();
        kept.retain(|(key, _)| changes.iter().all(|(changed, _)| changed != key));
        kept.extend(changes.iter().cloned());
        self.ledger.keep_settings(&kept)?;
        self.describe();
        self.armed = None;
        for tell in [self.machine_tell(), self.controller_tell()] {
            self.tell(tell);
        }
        Ok(())
    }
}

/// Why a controller can't drive `machine`: it has a magazine, a presser foot or an index pulse. `None` if it
/// can.
pub fn unfit(machine: &Machine) -> Option<Diagnostic> {
    let indexes = [&machine.x, &machine.y, &machine.z].into_iter().any(|axis| axis.index);
    let rows = [
        (machine.has_magazine(), code!("grbl.no_magazine")),
        (machine.foot.on, code!("grbl.no_foot")),
        (indexes, code!("grbl.no_index")),
    ];
    rows.into_iter().find(|(is_so, _)| *is_so).map(|(_, code)| Diagnostic::error(code))
}

/// Returns `true` if `name` names a known mill or is empty, meaning none of them.
fn is_mill(name: &Value) -> bool {
    matches!(name, Value::Text(name) if name.is_empty() || machine::mill(name).is_some())
}
