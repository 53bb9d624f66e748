//! Lets the controller read a job in its check mode: it parses every line, and nothing moves.

use super::keys::{Typing, Word, listen};
use super::{CheckArgs, GREETING, controller_object, ledger, program};
use crate::cli::{Answer, Exit, Refusal, counted, diagnostic_objects, say};
use crate::grbl::Client;
use annulus_core::control::Trust;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::grbl::{CheckNews, EngineAsk, EnginePhase, Info, settings};
use annulus_core::{code, error, note};
use annulus_host::grbl::{AttendedJob, ControllerGlimpse, Told};
use serde_json::json;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::Instant;

/// Operates the controller while it reads the job.
struct Reader {
    station: Client,
    words: Receiver<Word>,
    info: Option<Info>,
    now: Option<ControllerGlimpse>,
    /// The first error, if any.
    worst: Option<Diagnostic>,
    refused: Vec<Diagnostic>,
    over: Option<Over>,
    /// The controller has started to read.
    begun: bool,
    /// There are several programs, so messages name the program of a line.
    several: bool,
    gone: bool,
    interrupted: bool,
    /// Messages about the programs and the check.
    said: Vec<Diagnostic>,
}

/// Result of the check.
struct Over {
    done: u32,
    of: u32,
    refused: u32,
    why: Option<Diagnostic>,
}

pub(super) fn run(args: &CheckArgs) -> Result<Answer, Refusal> {
    super::no_controller(&args.job.on, args.port.port.as_deref())?;
    let programs = program::read(&args.job, &args.more, &ledger()?)?;
    let station = args.port.open((AttendedJob::default(), None), args.speed)?;
    let (sends, words) = channel();
    listen(sends, Typing::Nothing);
    let (info, now, worst, over) = (None, None, None, None);
    let (refused, begun, gone, interrupted) = (Vec::new(), false, false, false);
    let several = programs.files.len() > 1;
    let said = said_of(&programs);
    said.iter().for_each(|why| say(told(why)));
    let mut reader =
        Reader { station, words, info, now, worst, refused, over, begun, several, gone, interrupted, said };
    let ready = reader.meets().and_then(|()| reader.gets_ready(args.home));
    if reader.interrupted {
        reader.comes_to_rest();
        let why = Refusal::content(error!("grbl.check_stopped"));
        return Err(Refusal { exit: Exit::Interrupted, ..why });
    }
    ready?;
    let (routine, written) = (Arc::clone(&programs.routine), Arc::clone(&programs.written));
    reader.station.ask(EngineAsk::Check { routine, written });
    reader.until(|reader| reader.over.is_some() || (reader.worst.is_some() && !reader.begun));
    if reader.interrupted {
        reader.comes_to_rest();
    }
    Ok(reader.answer())
}

/// Messages about the programs, including lines that Annulus rewrites when it runs them.
fn said_of(programs: &program::Programs) -> Vec<Diagnostic> {
    let mut said = programs.diagnostics.clone();
    said.push(note!("grbl.check_as_written", lines = programs.written.len()));
    let changed: Vec<String> =
        programs.written.iter().filter(|line| line.is_changed).map(|line| line.line.to_string()).collect();
    if !changed.is_empty() {
        said.push(note!("grbl.check_changed", lines = changed.join(", ")));
    }
    said
}

fn told(why: &Diagnostic) -> String {
    let at = why.place.as_ref().map_or(String::new(), |at| format!("{}:{}: ", at.file, at.line));
    format!("{at}{} {}", why.message("en"), why.advice("en"))
}

impl Reader {
    fn phase(&self) -> Option<EnginePhase> {
        self.now.as_ref().map(|now| now.phase)
    }

    /// Returns `true` if the controller is stopped and has reported its position.
    fn rests(&self) -> bool {
        self.now.as_ref().is_some_and(|now| {
            matches!(now.phase, EnginePhase::Ready | EnginePhase::Locked) && now.place_mm.is_some()
        })
    }

    /// Handles the next notice of the engine, if any, and input from outside.
    fn next(&mut self) -> bool {
        let told = self.station.next();
        let is_told = told.is_some();
        match told {
            Some(Told::Greeted(info)) => self.info = Some(*info),
            Some(Told::Now(now)) => {
                self.begun |= now.phase == EnginePhase::Checking;
                self.now = Some(*now);
            }
            Some(Told::Gone) => self.gone = true,
            Some(Told::Found(found)) => {
                say(format_args!("{} {} ({})", found.message("en"), found.advice("en"), found.code));
                if found.severity == Severity::Error {
                    self.worst.get_or_insert(found);
                }
            }
            Some(Told::Check(news)) => self.hears(news),
            _ => {}
        }
        while let Ok(Word::Signal) = self.words.try_recv() {
            self.interrupted = true;
            say("Stopping.");
            self.station.ask(EngineAsk::Stop);
        }
        is_told
    }

    fn hears(&mut self, news: CheckNews) {
        match news {
            CheckNews::Read { done, of } => say(format_args!("{done} of {of} lines read.")),
            CheckNews::Refused { why } => {
                say(self.told_at(&why));
                self.refused.push(why);
            }
            CheckNews::Over { done, of, refused, why } => self.over = Some(Over { done, of, refused, why }),
        }
    }

    /// Runs the engine until `so` holds or the controller is gone. On an interrupt the controller ends the
    /// check itself.
    fn until(&mut self, so: impl Fn(&Self) -> bool) {
        while !so(self) && !self.gone {
            self.next();
        }
    }

    /// After Ctrl-C: waits until the engine has stopped the machine, or the controller is gone.
    fn comes_to_rest(&mut self) {
        let since = Instant::now();
        while !self.gone && since.elapsed() < GREETING {
            let has_heard = self.station.has_heard_all();
            if !self.next() && has_heard && self.rests() {
                return;
            }
        }
    }

    fn why(&self, code: &str) -> Refusal {
        Refusal::content(self.worst.clone().unwrap_or_else(|| Diagnostic::error(code)))
    }

    fn meets(&mut self) -> Result<(), Refusal> {
        let since = Instant::now();
        self.until(|reader| {
            (reader.info.is_some() && reader.rests()) || reader.interrupted || since.elapsed() > GREETING
        });
        if self.info.is_some() && self.rests() {
            return Ok(());
        }
        Err(Refusal::surroundings(self.worst.clone().unwrap_or_else(|| error!("grbl.no_answer"))))
    }

    /// Homes the machine if wanted; otherwise only unlocks it, which moves nothing.
    fn gets_ready(&mut self, homes: bool) -> Result<(), Refusal> {
        let has_switches = self.info.as_ref().is_some_and(|info| settings::on(&info.values, 22));
        self.worst = None;
        if homes && !has_switches {
            return Err(Refusal::content(error!("grbl.cannot_home")));
        }
        if homes && !self.interrupted {
            self.station.ask(EngineAsk::Home);
            self.until(|reader| reader.phase() == Some(EnginePhase::Homing) || reader.worst.is_some());
            self.until(|reader| reader.phase() != Some(EnginePhase::Homing) && reader.rests());
            let trusted = self.now.as_ref().is_some_and(|now| now.trust == Trust::Trusted);
            return if trusted { Ok(()) } else { Err(self.why(code!("grbl.not_homed"))) };
        }
        if self.phase() == Some(EnginePhase::Locked) {
            self.station.ask(EngineAsk::Unlock);
            self.until(|reader| reader.phase() == Some(EnginePhase::Ready) || reader.worst.is_some());
        }
        if self.worst.is_some() || self.gone { Err(self.why(code!("grbl.no_answer"))) } else { Ok(()) }
    }

    fn answer(&self) -> Answer {
        let none = Over { done: 0, of: 0, refused: 0, why: None };
        let over = self.over.as_ref().unwrap_or(&none);
        let first = self.refused.first().and_then(|why| why.place.clone());
        let refused = (over.refused > 0).then(|| {
            let line = first.as_ref().map_or(0, |at| at.line);
            let why = error!("grbl.check_refused", refused = over.refused, ..);
            Diagnostic { place: first.filter(|_| self.several), ..why.with("of", over.of).with("line", line) }
        });
        let unread = || self.worst.clone().unwrap_or_else(|| error!("grbl.check_unplugged"));
        let why = over.why.clone().or(refused).or_else(|| self.over.is_none().then(unread));
        let exit = match why {
            _ if self.interrupted => Exit::Interrupted,
            Some(_) if self.gone => Exit::Surroundings,
            Some(_) => Exit::Content,
            None => Exit::Done,
        };
        let mut object = json!({
            "controller": self.info.as_ref().map(controller_object),
            "bits_per_s": self.station.bits_per_s,
            "lines": over.of,
            "lines_read": over.done,
            "lines_refused": over.refused,
            "refused": diagnostic_objects(&self.refused),
            "checked": "file",
            "diagnostics": diagnostic_objects(&self.said),
        });
        let mut text = format!("{} read, {} refused.\n", counted(over.done, "line"), over.refused);
        self.refused.iter().for_each(|why| text += &format!("{}\n", self.told_at(why)));
        if let Some(why) = why {
            let refusal = Refusal::content(why);
            object["error"] = refusal.object()["error"].clone();
            text += &format!("{refusal}\n");
        }
        Answer { object, text, exit }
    }

    /// Text of a refused line with its number, and its program if there are several.
    fn told_at(&self, why: &Diagnostic) -> String {
        let (file, line) = why.place.as_ref().map_or(("", 0), |at| (at.file.as_str(), at.line));
        let at = if self.several { format!("{file}, line {line}") } else { format!("Line {line}") };
        format!("{at}: {}", why.message("en"))
    }
}
