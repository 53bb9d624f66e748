//! Lets the controller read a job in its check mode: it parses every line, and nothing moves.

use super::how::How;
use super::keys::Typing;
use super::operator::Operator;
use super::{CheckArgs, GREETING, controller_object, ledger, program};
use crate::cli::{Answer, Exit, Refusal, counted, diagnostic_objects, say};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::{CheckNews, EngineAsk, EnginePhase};
use annulus_core::{code, error, note};
use annulus_host::grbl::{AttendedJob, Told};
use serde_json::json;
use std::sync::Arc;
use std::time::Instant;

/// Progress of the check.
struct Check {
    /// There are several programs, so messages name the program of a line.
    several: bool,
    refused: Vec<Diagnostic>,
    over: Option<Over>,
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
    let ledger = ledger()?;
    let programs = program::read(&args.job, &args.more, &ledger)?;
    let (how, job) = (How::at(&args.port, args.speed), (AttendedJob::default(), None));
    let mut operator = Operator::new(&how, &ledger, job, Typing::Nothing, true)?;
    let said = said_of(&programs);
    operator.tells(said.clone());
    let ready = operator.find().and_then(|()| operator.gets_ready(args.home));
    if operator.interrupted {
        operator.comes_to_rest();
        let why = Refusal::content(error!("grbl.check_stopped"));
        return Err(Refusal { exit: Exit::Interrupted, ..why });
    }
    ready?;
    let (routine, written) = (Arc::clone(&programs.routine), Arc::clone(&programs.written));
    operator.station.ask(EngineAsk::Check { routine, written });
    let mut check = Check { several: programs.files.len() > 1, refused: Vec::new(), over: None };
    check.follow(&mut operator);
    if operator.interrupted {
        operator.comes_to_rest();
    }
    Ok(check.answer(&operator, &said))
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

impl Operator {
    fn is_found(&self) -> bool {
        self.info.is_some() && self.has_stopped()
    }

    /// Waits until the controller is identified and the machine is stopped.
    fn find(&mut self) -> Result<(), Refusal> {
        let since = Instant::now();
        self.until(|operator| operator.is_found() || since.elapsed() > GREETING);
        let why = || Refusal::surroundings(self.why(code!("grbl.no_answer")));
        if self.is_found() { Ok(()) } else { Err(why()) }
    }

    /// Homes the machine if wanted; otherwise only unlocks it, which moves nothing.
    fn gets_ready(&mut self, homes: bool) -> Result<(), Refusal> {
        self.worst = None;
        if homes && !self.homes() {
            return Err(Refusal::content(error!("grbl.cannot_home")));
        }
        if homes && !self.interrupted {
            self.station.ask(EngineAsk::Home);
            self.until(|operator| operator.phase() == Some(EnginePhase::Homing) || operator.worst.is_some());
            self.until(|operator| operator.phase() != Some(EnginePhase::Homing) && operator.has_stopped());
            let why = || Refusal::content(self.why(code!("grbl.not_homed")));
            return if self.trusted() { Ok(()) } else { Err(why()) };
        }
        if self.phase() == Some(EnginePhase::Locked) {
            self.station.ask(EngineAsk::Unlock);
            self.until(|operator| operator.phase() == Some(EnginePhase::Ready) || operator.worst.is_some());
        }
        let why = || Refusal::content(self.why(code!("grbl.no_answer")));
        if self.worst.is_some() || self.gone { Err(why()) } else { Ok(()) }
    }
}

impl Check {
    /// Waits for the result. On an interrupt the controller ends the check itself.
    fn follow(&mut self, operator: &mut Operator) {
        let mut begun = false;
        while self.over.is_none() && !operator.gone && (begun || operator.worst.is_none()) {
            if let Some(Told::Check(news)) = operator.next() {
                self.hears(news);
            }
            operator.hear();
            begun |= operator.phase() == Some(EnginePhase::Checking);
        }
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

    fn answer(&self, operator: &Operator, said: &[Diagnostic]) -> Answer {
        let none = Over { done: 0, of: 0, refused: 0, why: None };
        let over = self.over.as_ref().unwrap_or(&none);
        let first = self.refused.first().and_then(|why| why.place.clone());
        let refused = (over.refused > 0).then(|| {
            let line = first.as_ref().map_or(0, |at| at.line);
            let why = error!("grbl.check_refused", refused = over.refused, ..);
            Diagnostic { place: first.filter(|_| self.several), ..why.with("of", over.of).with("line", line) }
        });
        let unread = || operator.worst.clone().unwrap_or_else(|| error!("grbl.check_unplugged"));
        let why = over.why.clone().or(refused).or_else(|| self.over.is_none().then(unread));
        let exit = match why {
            _ if operator.interrupted => Exit::Interrupted,
            Some(_) if operator.gone => Exit::Surroundings,
            Some(_) => Exit::Content,
            None => Exit::Done,
        };
        let mut object = json!({
            "controller": operator.info.as_ref().map(controller_object),
            "bits_per_s": operator.station.bits_per_s,
            "lines": over.of,
            "lines_read": over.done,
            "lines_refused": over.refused,
            "refused": diagnostic_objects(&self.refused),
            "checked": "file",
            "diagnostics": diagnostic_objects(said),
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
