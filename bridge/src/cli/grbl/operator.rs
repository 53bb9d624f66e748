//! The command line as operator of a controller: homes, sets zero, starts, changes tools, stops.

mod answer;

use self::answer::{pause_text, say_worn};
use super::held::HeldAlone;
use super::how::{How, Place};
use super::keys::{Keys, Typing, Word, listen};
use super::program::Programs;
use super::{GREETING, TouchArgs, WhichMap, time_s};
use crate::cli::{Answer, Exit, Refusal, say};
use crate::grbl::{Client, Ledger};
use annulus_core::control::{Ending, Trust};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::grbl::{EngineAsk, EnginePhase, EngineStart, Info, Pause};
use annulus_core::level::{Correction, HeightMap};
use annulus_core::machine::{RackTool, ToolWear};
use annulus_core::{code, error, warning};
use annulus_host::grbl::{AttendedJob, ControllerGlimpse, JobTools, Told, unlike_mill};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Feed of the probe, mm/min, and lift after the touch, mm.
const PROBE: (f64, f64) = (60.0, 2.0);
/// Feed of jogs, mm/min.
const JOG_MM_PER_MIN: f64 = 300.0;
/// How often to request homing or a zero if a line was damaged.
const TRIES: u32 = 3;
/// A controller that is reset sends its banner within this time.
const RESET: Duration = Duration::from_secs(1);
/// Time limit for the machine to stop and to report it.
const REST: Duration = Duration::from_secs(30);
/// The same limit for a controller that was not identified.
const UNMET: Duration = Duration::from_secs(6);
/// Code of a job that the user ended before it started.
const NOT_BEGUN: &str = code!("grbl.not_begun");
/// Lines that arrive this soon after a refused line were typed together with it and relied on it.
const TYPED_WITH: Duration = Duration::from_millis(150);
/// Maximum number of queued lines.
pub(super) const MOST_LINES: usize = 64;

/// Acts for the user at the controller.
pub(super) struct Operator {
    pub(super) station: Client,
    pub(super) how: How,
    words: Receiver<Word>,
    /// Typed lines that wait.
    pub(super) lines: VecDeque<String>,
    /// No more lines will come.
    lines_end: bool,
    /// Lines are ignored until this time.
    ignores_until: Option<Instant>,
    /// The keys, at a terminal.
    pub(super) keys: Option<Keys>,
    pub(super) info: Option<Info>,
    pub(super) now: Option<ControllerGlimpse>,
    said: Vec<Diagnostic>,
    /// Tools of the job that are worn now or will be before it ends.
    worn: Vec<Diagnostic>,
    pub(super) worst: Option<Diagnostic>,
    zero_set: bool,
    pub(super) gone: bool,
    pub(super) interrupted: bool,
    quiet: bool,
    /// The height map, if depth follows it.
    pub(super) map: Option<HeightMap>,
    /// Depth correction by the height map.
    pub(super) corrected: Option<Correction>,
    /// Tool wear before the job.
    wear: Vec<ToolWear>,
    /// How the job ended, even if it ended during another wait.
    pub(super) ended: Option<Ending>,
    /// Requested tools that are not confirmed yet.
    wanted: VecDeque<Wanted>,
    /// The job has started.
    pub(super) begun: bool,
    /// How long the job is held without a terminal.
    pub(super) held: HeldAlone,
}

/// A requested tool: its index, and the tool and its wear if it is worn.
type Wanted = (u32, Option<Box<(RackTool, ToolWear)>>);

/// Result of a job.
struct Ended {
    ending: Option<Ending>,
    entry: AttendedJob,
}

impl Operator {
    pub(super) fn new(
        how: &How,
        ledger: &Ledger,
        job: (AttendedJob, Option<JobTools>),
        typing: Typing,
        quiet: bool,
    ) -> Result<Self, Refusal> {
        how.zero_at.map(Place::whole).transpose()?;
        let station = how.port.open(job, how.speed)?;
        let (sends, words) = channel();
        let keys = listen(sends, typing);
        Ok(Self {
            station,
            how: how.clone(),
            words,
            lines: VecDeque::new(),
            lines_end: false,
            ignores_until: None,
            keys,
            info: None,
            now: None,
            said: Vec::new(),
            worn: Vec::new(),
            worst: None,
            zero_set: false,
            gone: false,
            interrupted: false,
            quiet,
            map: None,
            corrected: None,
            wear: ledger.wear().to_vec(),
            ended: None,
            wanted: VecDeque::new(),
            begun: false,
            held: HeldAlone::default(),
        })
    }

    /// Runs the job, from the section in `before`.
    pub(super) fn run(
        &mut self,
        programs: &Programs,
        before: Option<&AttendedJob>,
        accept: &[String],
        level: Option<(WhichMap, &TouchArgs)>,
    ) -> Result<Answer, Refusal> {
        let answer = self.run_from(programs, before, accept, level);
        self.leaves(answer, NOT_BEGUN)
    }

    fn run_from(
        &mut self,
        programs: &Programs,
        before: Option<&AttendedJob>,
        accept: &[String],
        level: Option<(WhichMap, &TouchArgs)>,
    ) -> Result<Answer, Refusal> {
        self.tells(programs.diagnostics.clone());
        let from = before.map_or(0, |entry| entry.done);
        self.worn = programs.tools(&self.wear).map(|tools| tools.worn_ahead(from)).unwrap_or_default();
        self.worn.iter().for_each(|why| say(format_args!("{} {}", why.message("en"), why.advice("en"))));
        if self.how.leaves_unmeasured(&programs.routine, from) {
            return Err(Refusal::content(error!("grbl.tools_unmeasured")));
        }
        if self.how.changer.is_some() && self.how.setter.is_none() && self.how.probe_mm().is_some() {
            return Err(Refusal::content(error!("changer.no_probe")));
        }
        self.meets()?;
        let followed = self.followed(programs, before, level)?;
        let programs = followed.as_ref().unwrap_or(programs);
        let zero_mm = before.and_then(|entry| entry.zero_mm);
        if let Some(tool) = programs.routine.tool_at(from).filter(|_| from > 0) {
            say(format_args!("{}", pause_text(programs, tool)));
        }
        let drills = programs.routine.cuts().0 > 0;
        self.tells(drills.then(|| warning!("grbl.broken_bits_unseen")).into_iter().collect());
        let place = self.now.as_ref().and_then(|now| now.place_mm).unwrap_or_default();
        let seconds = self.info.as_ref().and_then(|info| time_s(programs, info, from, place));
        if let (Some(seconds), false) = (seconds, self.quiet) {
            say(format_args!("About {:.0} min {:02.0} s.", (seconds / 60.0).floor(), seconds % 60.0));
        }
        self.hear();
        self.is_wanted()?;
        (self.worst, self.ended, self.begun) = (None, None, false);
        self.wanted.clear();
        let (routine, accepted) = (Arc::clone(&programs.routine), accept.to_vec());
        let (spin_up_s, same_length) = (self.how.spin_up_s(), self.how.same_length);
        let setter = self.how.setter;
        let changer = self.how.changer_for(&routine, programs.tools(&self.wear).as_ref());
        let start = EngineStart { routine, from, zero_mm, same_length, setter, changer, spin_up_s, accepted };
        self.station.ask(EngineAsk::Start(start));
        self.tells_keys();
        let ended = self.until_ended(programs);
        Ok(self.answer(programs, &ended, seconds))
    }

    /// Waits until the controller is identified and the machine knows its position.
    pub(super) fn meets(&mut self) -> Result<(), Refusal> {
        let since = Instant::now();
        self.until(|operator| {
            let greeted = operator.phase().is_some_and(|phase| phase != EnginePhase::Greeting);
            (operator.info.is_some() && greeted) || since.elapsed() > GREETING
        });
        self.is_wanted()?;
        if self.gone || self.info.is_none() {
            let busy = self.said.iter().find(|found| found.code == code!("grbl.busy_at_opening")).cloned();
            return Err(Refusal::surroundings(busy.unwrap_or_else(|| self.why(code!("grbl.no_answer")))));
        }
        self.compare_with_mill();
        self.find_place()
    }

    /// Reports settings that differ from the named machine model.
    fn compare_with_mill(&mut self) {
        let (Some(mill), Some(info)) = (self.how.mill, &self.info) else { return };
        self.tells(unlike_mill(mill, info.flavour(), &info.values));
    }

    /// Prints these messages and saves them for the answer.
    pub(super) fn tells(&mut self, found: Vec<Diagnostic>) {
        for why in &found {
            let at = why.place.as_ref().map_or(String::new(), |at| format!("{}:{}: ", at.file, at.line));
            say(format_args!("{at}{} {}", why.message("en"), why.advice("en")));
        }
        self.said.extend(found);
    }

    pub(super) fn phase(&self) -> Option<EnginePhase> {
        self.now.as_ref().map(|now| now.phase)
    }

    pub(super) fn why(&self, code: &str) -> Diagnostic {
        self.worst.clone().unwrap_or_else(|| Diagnostic::error(code))
    }

    /// Handles the next notice of the engine.
    pub(super) fn next(&mut self) -> Option<Told> {
        self.ends_held();
        let told = self.station.next()?;
        match &told {
            Told::Greeted(info) => self.info = Some(info.as_ref().clone()),
            Told::Now(now) => {
                self.begun |= now.phase == EnginePhase::Running;
                self.now = Some(now.as_ref().clone());
            }
            Told::Ended(how) => self.ended = Some(*how),
            Told::ToolWanted { tool, worn } => self.wanted.push_back((*tool, worn.clone())),
            Told::ZeroSet => self.zero_set = true,
            Told::Gone => self.gone = true,
            Told::Found(found) => {
                say(format_args!("{} {} ({})", found.message("en"), found.advice("en"), found.code));
                // A refused late key is not the reason why a job failed.
                if found.severity == Severity::Error && !(self.begun && found.code == code!("grbl.not_now")) {
                    self.worst.get_or_insert(found.clone());
                }
                if found.code == code!("grbl.override_not_taken") {
                    self.forgets_keys();
                }
                self.said.push(found.clone());
            }
            _ => {}
        }
        Some(told)
    }

    /// Runs the engine until `so` holds, the controller is gone, or the user or the controller ends the job.
    pub(super) fn until(&mut self, so: impl Fn(&Self) -> bool) {
        let is_over = |operator: &Self| {
            operator.gone || operator.interrupted || operator.ended.is_some() || operator.held.is_stuck()
        };
        while !so(self) && !is_over(self) {
            self.next();
            self.hear();
        }
    }

    /// Handles input: a signal stops, lines are queued.
    pub(super) fn hear(&mut self) {
        while let Ok(word) = self.words.try_recv() {
            match word {
                Word::Line(_) if self.ignores_until.is_some_and(|until| Instant::now() < until) => {
                    self.ignores_typed();
                }
                Word::Line(line) if self.lines.len() < MOST_LINES => self.lines.push_back(line),
                Word::Line(_) => {}
                Word::End => self.lines_end = true,
                Word::Key(key) => self.pressed(key),
                Word::Signal => {
                    self.interrupted = true;
                    say("Stopping.");
                    self.station.ask(EngineAsk::Stop);
                }
            }
        }
    }

    /// Drops the queued lines, and those that arrive together with them.
    fn ignores_typed(&mut self) {
        self.lines.clear();
        self.ignores_until = Some(Instant::now() + TYPED_WITH);
    }

    /// Homes the machine if it can home, and sets the work zero if requested.
    fn find_place(&mut self) -> Result<(), Refusal> {
        let homes = self.homes();
        if homes && self.how.zero_here && !self.trusted() {
            return Err(Refusal::content(error!("grbl.zero_here_homes")));
        }
        for _ in 0..TRIES {
            if !homes || self.trusted() || self.gone || self.interrupted {
                break;
            }
            self.rests();
            self.is_wanted()?;
            let before = self.worst.take();
            let said = self.said.len();
            self.station.ask(EngineAsk::Home);
            self.until(|operator| {
                operator.phase() == Some(EnginePhase::Homing) || operator.said.len() > said
            });
            self.until(|operator| operator.phase() != Some(EnginePhase::Homing));
            self.rests();
            // The first error is the cause: later attempts may fail only because of it.
            let why = before.or_else(|| self.worst.take());
            self.worst = why.filter(|_| !self.trusted());
        }
        self.is_wanted()?;
        if homes && !self.trusted() {
            return Err(Refusal::content(self.why(code!("grbl.not_homed"))));
        }
        let zero = self.how.zero_at.map(Place::whole).transpose()?;
        if zero.is_some() && !homes {
            return Err(Refusal::content(error!("grbl.zero_at_needs_homing")));
        }
        if zero.is_some() || self.how.zero_here {
            self.set_zero(zero)?;
        }
        Ok(())
    }

    /// Sets the work zero at `there`, in machine coordinates, or here. Waits until the controller reports it.
    fn set_zero(&mut self, there: Option<[f64; 3]>) -> Result<(), Refusal> {
        for _ in 0..TRIES {
            // Without a report, the position of the controller is unknown.
            self.rests();
            self.is_wanted()?;
            (self.worst, self.zero_set) = (None, false);
            // Any message ends the wait, also one about a controller that was reset: a zero that is not set
            // by then never will be.
            let said = self.said.len();
            self.station.ask(match there {
                Some(zero) => EngineAsk::ZeroAt { place_mm: zero.map(Some) },
                None => EngineAsk::SetZero { axes: [true; 3], height_mm: 0.0 },
            });
            self.until(|operator| operator.zero_set || operator.said.len() > said);
            if !self.zero_set {
                // A controller that is reset for this sends its banner soon.
                let since = Instant::now();
                self.until(|operator| {
                    operator.phase() == Some(EnginePhase::Greeting) || since.elapsed() > RESET
                });
            }
            self.rests();
            self.is_wanted()?;
            if self.zero_set && self.worst.is_none() {
                return Ok(());
            }
        }
        Err(Refusal::content(self.why(code!("grbl.zero_not_taken"))))
    }

    /// Fails if the user or a hold has ended the job, so that no further command is sent. `leaves` replaces
    /// the reason.
    pub(super) fn is_wanted(&self) -> Result<(), Refusal> {
        if self.interrupted {
            return Err(Refusal::content(Diagnostic::error(NOT_BEGUN)));
        }
        // The controller may still be held: send no more commands.
        let held = self.held.has_ended().then(|| error!("grbl.held_before"));
        held.map_or(Ok(()), |why| Err(Refusal::content(why)))
    }

    /// Returns `came`. If the user interrupted it, waits until the machine is stopped and returns the error
    /// `code`.
    pub(super) fn leaves<T>(&mut self, came: Result<T, Refusal>, code: &str) -> Result<T, Refusal> {
        self.hear();
        if self.interrupted && came.is_err() {
            self.comes_to_rest();
            return Err(Refusal { exit: Exit::Interrupted, ..Refusal::content(Diagnostic::error(code)) });
        }
        came
    }

    /// After Ctrl-C: waits until the engine has stopped the machine and the controller sent its banner, or
    /// the controller is gone. A held controller stays held when its port closes.
    pub(super) fn comes_to_rest(&mut self) {
        let since = Instant::now();
        let most = if self.info.is_some() { REST } else { UNMET };
        loop {
            let has_heard = self.station.has_heard_all();
            let told = self.next();
            self.hear();
            let rests = matches!(self.phase(), Some(EnginePhase::Ready | EnginePhase::Locked));
            if self.gone || since.elapsed() > most || (has_heard && told.is_none() && rests) {
                return;
            }
        }
    }

    pub(super) fn trusted(&self) -> bool {
        self.now.as_ref().is_some_and(|now| now.trust == Trust::Trusted)
    }

    /// Returns `true` if the machine is stopped and has reported its position.
    pub(super) fn has_stopped(&self) -> bool {
        use EnginePhase::{Locked, Ready, ToolChange};
        let is_in = |phase| matches!(phase, Ready | Locked | ToolChange);
        self.now.as_ref().is_some_and(|now| is_in(now.phase) && now.place_mm.is_some())
    }

    /// Waits until [`Self::has_stopped`]. Gives up after [`REST`].
    pub(super) fn rests(&mut self) {
        let since = Instant::now();
        self.until(|operator| since.elapsed() > REST || operator.has_stopped());
    }

    fn until_ended(&mut self, programs: &Programs) -> Ended {
        let asked = Instant::now();
        while self.ended.is_none() && !self.gone && !self.held.is_stuck() {
            if let Some((tool, worn)) = self.wanted.pop_front() {
                if let Some(worn) = worn {
                    say_worn(&worn.0, &worn.1);
                }
                self.change_tool(programs, tool);
            }
            match self.next() {
                Some(Told::ToolFetched { tool }) => {
                    say(format_args!("{}: the machine changed the tool itself.", pause_text(programs, tool)));
                }
                // Refused: the job did not start.
                _ if !self.begun && self.interrupted => {
                    self.comes_to_rest();
                    break;
                }
                _ if !self.begun && self.worst.is_some() && asked.elapsed() > Duration::from_secs(1) => break,
                _ => {}
            }
            self.hear();
        }
        self.tells_how_it_is_left();
        let ending = self.ended;
        let entry = super::ledger().ok().and_then(|ledger| ledger.interrupted().cloned());
        Ended { ending, entry: entry.unwrap_or_default() }
    }

    /// Waits until the user confirms the tool, or for the time of an unattended change.
    fn change_tool(&mut self, programs: &Programs, tool: u32) {
        say(format_args!("{}", pause_text(programs, tool)));
        if let Some(wait) = self.how.confirm_tools {
            let since = Instant::now();
            while since.elapsed() < wait && !self.gone && !self.interrupted && self.ended.is_none() {
                self.next();
                self.hear();
            }
            return self.confirm_tool();
        }
        say(
            "Type: x 1, y -0.5, z -0.1 to jog in mm; zero when the tool touches the board; probe; go. x 1 anyway: jog with the tool in the board.",
        );
        if self.how.setter.is_some() {
            say("After go, the machine measures the tool on the tool setter.");
        }
        // Lines typed before the question do not answer it.
        self.hear();
        self.lines.clear();
        self.types(true);
        let waits =
            |operator: &Self| operator.phase() == Some(EnginePhase::ToolChange) && operator.ended.is_none();
        while !self.gone && !self.interrupted && waits(self) {
            self.next();
            self.hear();
            let Some(line) = self.lines.pop_front() else {
                if self.lines_end {
                    self.ends_unattended(programs, tool);
                    break;
                }
                continue;
            };
            self.worst = None;
            self.station.attend();
            self.do_typed(&line);
            // Lines typed after a refused one relied on it.
            if self.worst.is_some() {
                self.ignores_typed();
            }
        }
        self.types(false);
    }

    /// Ends the job at a tool change because the input has ended.
    fn ends_unattended(&mut self, programs: &Programs, tool: u32) {
        let why = match programs.routine.pause(tool) {
            Pause::Stop { .. } => error!("grbl.held_unattended", ..),
            Pause::Tool { .. } => {
                error!("run.tool_unattended", bit = pause_text(programs, tool), ..)
            }
        };
        self.worst = Some(why.with("line", self.resume_line()));
        self.station.ask(EngineAsk::Stop);
    }

    /// Probes the tool if requested, and continues. Ends the job after [`TRIES`] failed attempts.
    fn confirm_tool(&mut self) {
        let mut why: Option<Diagnostic> = None;
        for _ in 0..TRIES {
            // An alarm or the user has ended the job.
            let is_over = self.gone || self.interrupted || self.ended.is_some();
            if is_over || self.phase() != Some(EnginePhase::ToolChange) {
                return;
            }
            // With a tool setter, probe the board only if the setter has no reference tool.
            let unknown = why.as_ref().is_some_and(|why| why.code == code!("setter.no_reference"));
            let probe = self.how.probe_mm().filter(|_| self.how.setter.is_none() || unknown);
            let measured = probe.map_or(Ok(()), |depth| self.find_height(depth));
            if measured.is_ok() && self.tool_ready() {
                return;
            }
            why = measured.err().or_else(|| self.worst.take());
        }
        self.worst = why;
        self.station.ask(EngineAsk::Stop);
    }

    fn do_typed(&mut self, line: &str) {
        let mut words = line.split_whitespace();
        match (words.next().unwrap_or_default(), words.next().and_then(|word| word.parse::<f64>().ok())) {
            (axis @ ("x" | "y" | "z"), Some(mm)) if mm.abs() <= 500.0 => {
                let axis = u8::from(axis == "y") + 2 * u8::from(axis == "z");
                let um = (mm * 1e3).round() as i32;
                let anyway = words.next() == Some("anyway");
                self.station.ask(EngineAsk::Jog { axis, um, mm_per_min: JOG_MM_PER_MIN, anyway });
                self.settle();
            }
            ("resume", _) if self.stands() => self.resumes(),
            ("zero", _) => self.zero_height(),
            ("probe", depth) => self.probe(depth.or(self.how.probe_mm()).unwrap_or(10.0)),
            ("go", _) => {
                self.tool_ready();
            }
            _ => {
                say("Type x, y or z and mm; zero; probe; or go.");
                self.ignores_typed();
            }
        }
    }

    /// Sets the height of the board at the tool. Waits until the controller has reported it, or refused.
    fn zero_height(&mut self) {
        (self.worst, self.zero_set) = (None, false);
        let Some(height_mm) = self.surface_mm() else { return };
        let said = self.said.len();
        self.station.ask(EngineAsk::SetZero { axes: [false, false, true], height_mm });
        self.until(|operator| operator.zero_set || operator.said.len() > said);
        self.rests();
    }

    /// Continues after a tool change; `false` if that was refused.
    fn tool_ready(&mut self) -> bool {
        self.rests();
        self.worst = None;
        self.station.ask(EngineAsk::ToolReady);
        self.until(|operator| operator.phase() != Some(EnginePhase::ToolChange) || operator.worst.is_some());
        // The controller may first measure the tool and retract.
        self.until(|operator| {
            let by_itself = [EnginePhase::Measuring, EnginePhase::Changing, EnginePhase::Jogging];
            operator.phase().is_none_or(|phase| !by_itself.contains(&phase))
        });
        let is_over = self.gone || self.interrupted || self.ended.is_some();
        is_over || self.phase() != Some(EnginePhase::ToolChange)
    }

    /// Probes the height of the board below the tool, before a job.
    pub(super) fn find_board(&mut self, depth_mm: f64) -> Result<(), Refusal> {
        self.find_height(depth_mm).map_err(|why| {
            self.worst = None;
            Refusal::content(why)
        })
    }

    /// The same; an error stays in `worst`.
    fn find_height(&mut self, depth_mm: f64) -> Result<(), Diagnostic> {
        (self.worst, self.zero_set) = (None, false);
        let said = self.said.len();
        self.probe(depth_mm);
        self.until(|operator| operator.zero_set || operator.said.len() > said);
        self.rests();
        if !self.zero_set && self.worst.is_none() {
            return Err(error!("grbl.zero_not_taken"));
        }
        self.worst.clone().map_or(Ok(()), Err)
    }

    fn probe(&mut self, depth_mm: f64) {
        let (mm_per_min, up_mm) = PROBE;
        let Some(surface_mm) = self.surface_mm() else { return };
        let plate_mm = self.how.plate_mm() + surface_mm;
        self.station.ask(EngineAsk::Probe { depth_mm, mm_per_min, plate_mm, up_mm });
        self.settle();
    }

    /// Waits until the requested jog ends.
    fn settle(&mut self) {
        let since = Instant::now();
        while self.phase() == Some(EnginePhase::ToolChange)
            && since.elapsed() < Duration::from_secs(1)
            && !self.gone
            && self.ended.is_none()
        {
            self.next();
        }
        self.until(|operator| !matches!(operator.phase(), Some(EnginePhase::Jogging | EnginePhase::Probing)));
    }
}
