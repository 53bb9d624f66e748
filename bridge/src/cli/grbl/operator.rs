//! The person at the controller, as the command line has them: homes, sets zero, starts, changes tools, stops.
//!
//! Comes in: a job, a port, what is typed, Ctrl-C. Goes out: how it ended. Does not know how anything moves.

use super::how::How;
use super::keys::{Keys, Typing, Word, listen};
use super::program::Programs;
use super::{GREETING, TouchArgs, WhichMap, controller_object, time_s};
use crate::cli::{Answer, Exit, Refusal, counted, diagnostic_objects, say};
use crate::controller::Owner;
use crate::controller::ledger::Ledger;
use annulus_core::control::{Ending, Trust};
use annulus_core::controller::{EngineAsk, EnginePhase, EngineStart, Info, settings};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::level::{Correction, HeightMap};
use annulus_core::machine::{RackTool, ToolWear};
use annulus_drill::controller::{AttendedJob, ControllerGlimpse, JobTools, Told, unlike_mill};
use serde_json::json;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// How fast the probe goes down, mm/min, and how far it is lifted afterwards, mm.
const PROBE: (f64, f64) = (60.0, 2.0);
/// How fast moves by hand are, mm/min.
const JOG_MM_PER_MIN: f64 = 300.0;
/// How often homing, or a zero, is asked for when the line was damaged.
const TRIES: u32 = 3;
/// Within so long a board that is reset begins to greet.
const RESET: Duration = Duration::from_secs(1);
/// How long it may take to come to rest, and to say so.
const REST: Duration = Duration::from_secs(30);
/// The same of a board that did not say who it is.
const UNMET: Duration = Duration::from_secs(6);
/// What is said of a job that a person ended before it began.
const NOT_BEGUN: &str = "grbl.not_begun";
/// Most lines that wait to be done.
pub(super) const MOST_LINES: usize = 64;

/// Stands for the person.
pub(super) struct Operator {
    pub(super) owner: Owner,
    /// The speed of its line.
    bits_per_s: u32,
    pub(super) how: How,
    words: Receiver<Word>,
    /// What was typed and not done yet.
    pub(super) lines: VecDeque<String>,
    /// The keys, where this is at a terminal.
    pub(super) keys: Option<Keys>,
    pub(super) info: Option<Info>,
    pub(super) now: Option<ControllerGlimpse>,
    said: Vec<Diagnostic>,
    /// The tools of the job that are worn before it begins, or will be before it ends.
    worn: Vec<Diagnostic>,
    pub(super) worst: Option<Diagnostic>,
    zero_set: bool,
    pub(super) gone: bool,
    pub(super) interrupted: bool,
    quiet: bool,
    /// The board's surface, where depth follows it.
    pub(super) map: Option<HeightMap>,
    /// By how much depth was corrected to that.
    pub(super) corrected: Option<Correction>,
    ledger: Ledger,
    /// How the job ended, whatever was waited for then.
    ended: Option<Ending>,
    /// Tools that a person was asked for, and not heard of yet.
    wanted: VecDeque<Wanted>,
    /// The job has begun.
    begun: bool,
}

/// A tool that a person is asked for: its index, and what is said of one that is worn.
type Wanted = (u32, Option<Box<(RackTool, ToolWear)>>);

/// What a job came to.
struct Ended {
    ending: Option<Ending>,
    entry: AttendedJob,
}

impl Operator {
    /// Opens the port.
    pub(super) fn new(
        how: &How,
        ledger: &Ledger,
        job: (AttendedJob, Option<JobTools>),
        quiet: bool,
    ) -> Result<Self, Refusal> {
        let (port, bits_per_s) = how.port.open()?;
        let owner = Owner::new(port, ledger.clone(), job, how.speed);
        let (sends, words) = channel();
        let keys = listen(sends, if how.confirm_tools.is_none() { Typing::Lines } else { Typing::Keys });
        Ok(Self {
            owner,
            bits_per_s,
            how: how.clone(),
            words,
            lines: VecDeque::new(),
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
            ledger: ledger.clone(),
            ended: None,
            wanted: VecDeque::new(),
            begun: false,
        })
    }

    /// Runs the job, from where `before` says.
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
        programs.diagnostics.iter().for_each(|diagnostic| say(diagnostic.message("en")));
        let from = before.map_or(0, |entry| entry.done);
        self.worn = programs.tools(&self.ledger).map(|tools| tools.worn_ahead(from)).unwrap_or_default();
        self.worn.iter().for_each(|why| say(format_args!("{} {}", why.message("en"), why.advice("en"))));
        if self.how.leaves_unmeasured(&programs.routine, from) {
            return Err(Refusal::content(Diagnostic::error("grbl.tools_unmeasured")));
        }
        if self.how.changer.is_some() && self.how.setter.is_none() && self.how.probe_mm().is_some() {
            return Err(Refusal::content(Diagnostic::error("changer.no_probe")));
        }
        self.meets()?;
        let followed = self.followed(programs, before, level)?;
        let programs = followed.as_ref().unwrap_or(programs);
        let zero_mm = before.and_then(|entry| entry.zero_mm);
        if let Some(tool) = programs.routine.tool_at(from).filter(|_| from > 0) {
            say(format_args!("{}", tool_name(programs, tool)));
        }
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
        let changer = self.how.changer_for(&routine, programs.tools(&self.ledger).as_ref());
        let start = EngineStart { routine, from, zero_mm, same_length, setter, changer, spin_up_s, accepted };
        self.owner.ask(EngineAsk::Start(start));
        self.tells_keys();
        let ended = self.until_ended(programs);
        Ok(self.answer(programs, &ended, seconds))
    }

    /// Waits until somebody is there, and until the machine knows its place.
    pub(super) fn meets(&mut self) -> Result<(), Refusal> {
        let since = Instant::now();
        self.until(|operator| {
            let greeted = operator.phase().is_some_and(|phase| phase != EnginePhase::Greeting);
            (operator.info.is_some() && greeted) || since.elapsed() > GREETING
        });
        self.is_wanted()?;
        if self.gone || self.info.is_none() {
            let busy = self.said.iter().find(|found| found.code == "grbl.busy_at_opening").cloned();
            return Err(Refusal::surroundings(busy.unwrap_or_else(|| self.why("grbl.no_answer"))));
        }
        self.compare_with_mill();
        self.find_place()
    }

    /// Says where the controller is not as the mill that it was said to be.
    fn compare_with_mill(&mut self) {
        let (Some(mill), Some(info)) = (self.how.mill, &self.info) else { return };
        self.tells(unlike_mill(mill, info.flavour(), &info.values));
    }

    /// Says these, and keeps them for the answer.
    pub(super) fn tells(&mut self, found: Vec<Diagnostic>) {
        found.iter().for_each(|why| say(format_args!("{} {}", why.message("en"), why.advice("en"))));
        self.said.extend(found);
    }

    pub(super) fn phase(&self) -> Option<EnginePhase> {
        self.now.as_ref().map(|now| now.phase)
    }

    pub(super) fn why(&self, code: &str) -> Diagnostic {
        self.worst.clone().unwrap_or_else(|| Diagnostic::error(code))
    }

    /// Takes what is told next.
    pub(super) fn next(&mut self) -> Option<Told> {
        let told = self.owner.next()?;
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
                // A key that came too late is no reason of anything.
                if found.severity == Severity::Error && !(self.begun && found.code == "grbl.not_now") {
                    self.worst.get_or_insert(found.clone());
                }
                if found.code == "grbl.override_not_taken" {
                    self.forgets_keys();
                }
                self.said.push(found.clone());
            }
            _ => {}
        }
        Some(told)
    }

    /// Goes on until something is so, or nobody is there, or a person or the controller ends it.
    pub(super) fn until(&mut self, so: impl Fn(&Self) -> bool) {
        while !so(self) && !self.gone && !self.interrupted && self.ended.is_none() {
            self.next();
            self.hear();
        }
    }

    /// Takes what came from outside: the first signal stops, lines wait until they are wanted.
    pub(super) fn hear(&mut self) {
        while let Ok(word) = self.words.try_recv() {
            match word {
                Word::Line(line) if self.lines.len() < MOST_LINES => self.lines.push_back(line),
                Word::Line(_) => {}
                Word::Key(key) => self.pressed(key),
                Word::Signal => {
                    self.interrupted = true;
                    say("Stopping.");
                    self.owner.ask(EngineAsk::Stop);
                }
            }
        }
    }

    /// Homes where it can, and sets zero where that was asked for.
    fn find_place(&mut self) -> Result<(), Refusal> {
        let homes = self.info.as_ref().is_some_and(|info| settings::on(&info.values, 22));
        for _ in 0..TRIES {
            if !homes || self.trusted() || self.gone || self.interrupted {
                break;
            }
            self.rests();
            self.is_wanted()?;
            let before = self.worst.take();
            let said = self.said.len();
            self.owner.ask(EngineAsk::Home);
            self.until(|operator| {
                operator.phase() == Some(EnginePhase::Homing) || operator.said.len() > said
            });
            self.until(|operator| operator.phase() != Some(EnginePhase::Homing));
            self.rests();
            // What went wrong first is why: what is tried behind it may be refused for that alone.
            let why = before.or_else(|| self.worst.take());
            self.worst = why.filter(|_| !self.trusted());
        }
        self.is_wanted()?;
        if homes && !self.trusted() {
            return Err(Refusal::content(self.why("grbl.not_homed")));
        }
        let zero = self.how.zero_at.map(|place| place.0);
        if zero.is_some() || self.how.zero_here {
            self.set_zero(zero)?;
        }
        Ok(())
    }

    /// Sets zero there, in machine coordinates, or here; until the controller reports it so.
    fn set_zero(&mut self, there: Option<[f64; 3]>) -> Result<(), Refusal> {
        for _ in 0..TRIES {
            (self.worst, self.zero_set) = (None, false);
            // Whatever is said meanwhile, a board that did not answer and was reset among it: what is not set by then will not be.
            let said = self.said.len();
            self.owner.ask(match there {
                Some(zero) => EngineAsk::ZeroAt { place_mm: zero.map(Some) },
                None => EngineAsk::SetZero { axes: [true; 3], height_mm: 0.0 },
            });
            self.until(|operator| operator.zero_set || operator.said.len() > said);
            if !self.zero_set {
                // A board that is reset for it greets soon.
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
        Err(Refusal::content(self.why("grbl.zero_not_taken")))
    }

    /// Nobody has ended it: what comes next may be asked for. Why it is not, whoever leaves says.
    pub(super) fn is_wanted(&self) -> Result<(), Refusal> {
        if self.interrupted { Err(Refusal::content(Diagnostic::error(NOT_BEGUN))) } else { Ok(()) }
    }

    /// Ends with that. What a person ended before it came to something is said to be so, once the board is at rest.
    pub(super) fn leaves<T>(&mut self, came: Result<T, Refusal>, code: &str) -> Result<T, Refusal> {
        self.hear();
        if self.interrupted && came.is_err() {
            self.comes_to_rest();
            return Err(Refusal { exit: Exit::Interrupted, ..Refusal::content(Diagnostic::error(code)) });
        }
        came
    }

    /// After Ctrl-C: until the engine has brought the board to rest and it has greeted, or nobody is there. A board that is held stays so
    /// when its port is closed.
    fn comes_to_rest(&mut self) {
        let since = Instant::now();
        let most = if self.info.is_some() { REST } else { UNMET };
        loop {
            let has_heard = self.owner.has_heard_all();
            let told = self.next();
            self.hear();
            let rests = matches!(self.phase(), Some(EnginePhase::Ready | EnginePhase::Locked));
            if self.gone || since.elapsed() > most || (has_heard && told.is_none() && rests) {
                return;
            }
        }
    }

    fn trusted(&self) -> bool {
        self.now.as_ref().is_some_and(|now| now.trust == Trust::Trusted)
    }

    /// Waits for rest, and for the first report; not for ever, where neither is understood.
    pub(super) fn rests(&mut self) {
        let since = Instant::now();
        self.until(|operator| {
            since.elapsed() > REST
                || operator.now.as_ref().is_some_and(|now| {
                    matches!(now.phase, EnginePhase::Ready | EnginePhase::Locked | EnginePhase::ToolChange)
                        && now.place_mm.is_some()
                })
        });
    }

    fn until_ended(&mut self, programs: &Programs) -> Ended {
        let asked = Instant::now();
        while self.ended.is_none() && !self.gone {
            if let Some((tool, worn)) = self.wanted.pop_front() {
                if let Some(worn) = worn {
                    say_worn(&worn.0, &worn.1);
                }
                self.change_tool(programs, tool);
            }
            match self.next() {
                Some(Told::ToolFetched { tool }) => {
                    say(format_args!("{}: put in by the machine.", tool_name(programs, tool)));
                }
                // A refusal: nothing was begun.
                _ if !self.begun && self.interrupted => {
                    self.comes_to_rest();
                    break;
                }
                _ if !self.begun && self.worst.is_some() && asked.elapsed() > Duration::from_secs(1) => break,
                _ => {}
            }
            self.hear();
        }
        let ending = self.ended;
        Ended { ending, entry: self.ledger.interrupted().unwrap_or_default() }
    }

    /// Waits, without any clock, until the person says that the tool is in.
    fn change_tool(&mut self, programs: &Programs, tool: u32) {
        say(format_args!("{}", tool_name(programs, tool)));
        if let Some(wait) = self.how.confirm_tools {
            let since = Instant::now();
            while since.elapsed() < wait && !self.gone && !self.interrupted && self.ended.is_none() {
                self.next();
                self.hear();
            }
            return self.confirm_tool();
        }
        say(
            "Type: x 1, y -0.5, z -0.1 to move by hand in mm; zero when the tip touches the board; probe; go.",
        );
        if self.how.setter.is_some() {
            say("The tool is measured on the tool setter behind go.");
        }
        // What was typed before the question does not answer it.
        self.hear();
        self.lines.clear();
        self.types(true);
        let waits =
            |operator: &Self| operator.phase() == Some(EnginePhase::ToolChange) && operator.ended.is_none();
        while !self.gone && !self.interrupted && waits(self) {
            self.next();
            self.hear();
            let Some(line) = self.lines.pop_front() else { continue };
            self.worst = None;
            self.owner.attend();
            self.do_typed(&line);
            // What was typed behind something that was refused counted on it.
            if self.worst.is_some() {
                self.lines.clear();
            }
        }
        self.types(false);
    }

    /// Measures the tool, where that was asked for, and goes on; ends the job where that is refused again and again.
    fn confirm_tool(&mut self) {
        let mut why: Option<Diagnostic> = None;
        for _ in 0..TRIES {
            // An alarm, or a person, has ended it.
            let is_over = self.gone || self.interrupted || self.ended.is_some();
            if is_over || self.phase() != Some(EnginePhase::ToolChange) {
                return;
            }
            // A tool setter wants the board touched only where it has no tool to go by.
            let unknown = why.as_ref().is_some_and(|why| why.code == "setter.no_reference");
            let probe = self.how.probe_mm().filter(|_| self.how.setter.is_none() || unknown);
            let measured = probe.map_or(Ok(()), |depth| self.find_height(depth));
            if measured.is_ok() && self.tool_ready() {
                return;
            }
            why = measured.err().or_else(|| self.worst.take());
        }
        self.worst = why;
        self.owner.ask(EngineAsk::Stop);
    }

    fn do_typed(&mut self, line: &str) {
        let mut words = line.split_whitespace();
        match (words.next().unwrap_or_default(), words.next().and_then(|word| word.parse::<f64>().ok())) {
            (axis @ ("x" | "y" | "z"), Some(mm)) if mm.abs() <= 500.0 => {
                let axis = u8::from(axis == "y") + 2 * u8::from(axis == "z");
                let um = (mm * 1e3).round() as i32;
                self.owner.ask(EngineAsk::Jog { axis, um, mm_per_min: JOG_MM_PER_MIN });
                self.settle();
            }
            ("resume", _) if self.stands() => self.resumes(),
            ("zero", _) => self.zero_height(),
            ("probe", depth) => self.probe(depth.or(self.how.probe_mm()).unwrap_or(10.0)),
            ("go", _) => {
                self.tool_ready();
            }
            _ => {
                say("x, y, z with mm; zero; probe; go.");
                self.lines.clear();
            }
        }
    }

    /// Where the tip is now is the height of the board: until it was written and read again, or refused.
    fn zero_height(&mut self) {
        (self.worst, self.zero_set) = (None, false);
        let Some(height_mm) = self.surface_mm() else { return };
        let said = self.said.len();
        self.owner.ask(EngineAsk::SetZero { axes: [false, false, true], height_mm });
        self.until(|operator| operator.zero_set || operator.said.len() > said);
        self.rests();
    }

    /// Goes on after a tool change; false where that was refused.
    fn tool_ready(&mut self) -> bool {
        self.rests();
        self.worst = None;
        self.owner.ask(EngineAsk::ToolReady);
        self.until(|operator| operator.phase() != Some(EnginePhase::ToolChange) || operator.worst.is_some());
        // It may be measured first; what comes of that, and the way up behind it.
        self.until(|operator| {
            let by_itself = [EnginePhase::Measuring, EnginePhase::Changing, EnginePhase::Jogging];
            operator.phase().is_none_or(|phase| !by_itself.contains(&phase))
        });
        let is_over = self.gone || self.interrupted || self.ended.is_some();
        is_over || self.phase() != Some(EnginePhase::ToolChange)
    }

    /// Finds the height of the board where the tip is over it, before a job.
    pub(super) fn find_board(&mut self, depth_mm: f64) -> Result<(), Refusal> {
        self.find_height(depth_mm).map_err(|why| {
            self.worst = None;
            Refusal::content(why)
        })
    }

    /// The same; what went wrong stays said.
    fn find_height(&mut self, depth_mm: f64) -> Result<(), Diagnostic> {
        (self.worst, self.zero_set) = (None, false);
        let said = self.said.len();
        self.probe(depth_mm);
        self.until(|operator| operator.zero_set || operator.said.len() > said);
        self.rests();
        if !self.zero_set && self.worst.is_none() {
            return Err(Diagnostic::error("grbl.zero_not_taken"));
        }
        self.worst.clone().map_or(Ok(()), Err)
    }

    fn probe(&mut self, depth_mm: f64) {
        let (mm_per_min, up_mm) = PROBE;
        let Some(surface_mm) = self.surface_mm() else { return };
        let plate_mm = self.how.plate_mm() + surface_mm;
        self.owner.ask(EngineAsk::Probe { depth_mm, mm_per_min, plate_mm, up_mm });
        self.settle();
    }

    /// Waits until a move by hand that was asked for is over.
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

    fn answer(&self, programs: &Programs, ended: &Ended, seconds: Option<f64>) -> Answer {
        let done = ended.ending == Some(Ending::Done);
        let (holes, toolpaths) =
            if done { programs.routine.cuts() } else { (ended.entry.holes, ended.entry.toolpaths) };
        let exit = match ended.ending {
            Some(Ending::Done) => Exit::Done,
            _ if self.interrupted => Exit::Interrupted,
            None if self.gone => Exit::Surroundings,
            _ => Exit::Content,
        };
        let now = self.now.as_ref();
        let resume_from = (!done).then_some(ended.entry.done);
        let line = resume_from.and_then(|at| programs.routine.sections.get(at)).map(|section| section.line);
        let mut object = json!({
            "controller": self.info.as_ref().map(controller_object),
            "bits_per_s": self.bits_per_s,
            "lines_sent": now.map_or(0, |now| now.sent),
            "lines_done": now.map_or(0, |now| now.answered),
            "holes_done": holes,
            "toolpaths_done": toolpaths,
            "sections": programs.routine.sections.len(),
            "stopped_because": ended.ending.unwrap_or(Ending::Alarm),
            "position_trust": now.map_or(Trust::Lost, |now| now.trust),
            "resume_from": resume_from.map(|section| json!({ "section": section, "line": line })),
            "largest_correction_um": self.corrected.map(|all| all.largest().nm() as f64 / 1e3),
            "estimated_s": seconds.map(crate::cli::rounded),
            "worn_tools": diagnostic_objects(&self.worn),
            "diagnostics": diagnostic_objects(&self.said),
        });
        let mut text =
            format!("{} drilled, {} milled.\n", counted(holes, "hole"), counted(toolpaths, "toolpath"));
        if exit != Exit::Done {
            let stopped = Diagnostic::error("grbl.stopped").with("holes", holes).with("toolpaths", toolpaths);
            let refusal = Refusal::content(self.worst.clone().unwrap_or(stopped));
            object["error"] = refusal.object()["error"].clone();
            text += &format!("{refusal}\n");
        }
        Answer { object, text, exit }
    }
}

/// Says that the life of a tool is over.
fn say_worn(tool: &RackTool, wear: &ToolWear) {
    let code = if tool.wears_by_way() { "preflight.tool_worn_way" } else { "preflight.tool_worn" };
    let why = Diagnostic::warning(code).with("number", tool.number).with("life", tool.life);
    let why = why.with("tool", tool.bit().titled()).with("done", wear.done());
    say(format_args!("{} {}", why.message("en"), why.advice("en")));
}

fn tool_name(programs: &Programs, tool: u32) -> String {
    let name = programs.routine.tools.get(tool as usize).map_or("", String::as_str);
    format!("Tool {}: {name}", tool + 1)
}
