//! Drives a model by short words, and describes the effects in short words.

use crate::engine::Stopped;
use crate::engine::messages::{
    Answer, Compared, Exported, FileRow, PlanReady, Reading, Request, Timed, UnderTile,
};
use crate::model::planning::{OnTheWay, PlanStep};
use crate::model::{
    AnewEvent, Clocks, Effect, Event, ExportEvent, FilesEvent, FrameEvent, JobEvent, KeepEvent, Lane,
    LinkEvent, Model, Offer, TemplateEvent, ToastAct, export, update,
};
use crate::said::Text;
use annulus_core::artwork::{FileKind, FileRead, Role};
use annulus_core::board::changes::{BoardChanges, Changed, Fate};
use annulus_core::board::{Board, Face, Hole};
use annulus_core::cam::usual::usual_bits;
use annulus_core::cam::work::{Operation, Work};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::geometry::Point;
use annulus_core::job::Program;
use annulus_core::machine::Value;
use annulus_core::post::OutputFile;
use annulus_core::project::saved::{Project, SaidOfFiles};
use annulus_core::proof::{Finding, FindingKind, Group, Pair, Verdict};
use annulus_core::units::Length;
use annulus_core::wire::{Tell, program};

#[derive(Default)]
pub(super) struct Story {
    pub(super) model: Model,
    asked: Vec<(&'static str, u32)>,
    pub(super) out: Vec<Effect>,
    count: i64,
}

fn kind(request: &Request) -> &'static str {
    match request {
        Request::Open(_) => "open",
        Request::Save(_) => "save",
        Request::Read(_) => "read",
        Request::Trace(_) => "trace",
        Request::WriteOver(_) => "write-over",
        Request::Plan(_) => "plan",
        Request::Prove(_) => "prove",
        Request::Export(_) => "export",
        Request::Lines(_) => "lines",
        Request::Check(_) => "check",
        Request::Time(_) => "time",
        Request::Compare(_) => "compare",
        Request::Underside(_) => "underside",
    }
}

fn word(effect: &Effect) -> String {
    match effect {
        Effect::Ask { request, .. } => kind(request).to_owned(),
        Effect::CallOff { lane: Lane::Times } => "end-timing".to_owned(),
        Effect::CallOff { .. } => "call-off".to_owned(),
        Effect::Wake { event, .. } => match &**event {
            Event::Frame(FrameEvent::Said { .. }) => "toast-goes".to_owned(),
            Event::Keep(KeepEvent::Rested { .. }) => "keep-rests".to_owned(),
            Event::Keep(KeepEvent::Drop { place }) => format!("drops-soon:{place}"),
            Event::Template(TemplateEvent::Rested { .. }) => "typing-rests".to_owned(),
            Event::Rested { .. } => "plan-rests".to_owned(),
            other => format!("{other:?}"),
        },
        Effect::Save { name, .. } => format!("save:{name}"),
        Effect::ChooseFiles { anew } => if *anew { "choose-anew" } else { "choose" }.to_owned(),
        Effect::ChooseDialect => "choose-dialect".to_owned(),
        Effect::FollowLink { address } => format!("fetch {address}"),
        Effect::Sample => "sample".to_owned(),
        Effect::LookInStore => "look".to_owned(),
        Effect::WriteStore { place, files, .. } => {
            let place = place.map_or_else(|| "new".to_owned(), |place| place.to_string());
            format!("write:{place}{}", if files.is_some() { "+files" } else { "" })
        }
        Effect::LeaveInStore { place, .. } => format!("leave:{place}"),
        Effect::LetGoOfPlace { place } => format!("let-go:{place}"),
        Effect::TakeFromStore { place, .. } => format!("take:{place}"),
        Effect::DropFromStore { place } => format!("drop:{place}"),
        other => format!("{other:?}"),
    }
}

fn diagnostic(severity: Severity) -> Diagnostic {
    Diagnostic::new(severity, "board.something")
}

/// A job that drills, isolates and cuts out.
pub(super) fn work() -> Work {
    let operation = |word: &str| Operation::usual(word, Face::Top).unwrap();
    let operations = ["drill", "isolate", "cut_out"].map(operation).to_vec();
    Work { bits: usual_bits(), operations, ..Work::default() }
}

pub(super) fn row(diagnostics: Vec<Diagnostic>) -> FileRow {
    let read = FileRead {
        name: "a.drl".to_owned(),
        kind: FileKind::Drill,
        role: Role::Drill,
        side: None,
        plated: None,
        generator: None,
        reason: diagnostic(Severity::Note),
        units: None,
        number_format: None,
        zeros: None,
        evidence: None,
        drill: None,
        gerber: None,
        diagnostics,
        fingerprint: 0,
        board: String::new(),
    };
    FileRow { read, drill: None }
}

fn hole() -> Hole {
    let at = Point::new(Length::from_um(1_000), Length::from_um(2_000));
    Hole { at, diameter: None, plated: None, source: 0, tool_code: 0, line: 0 }
}

fn reading(board_key: u32, diagnostics: Vec<Diagnostic>, holes: usize) -> Reading {
    let board = Board { name: "a".to_owned(), holes: vec![hole(); holes], ..Board::default() };
    Reading {
        board_key,
        board,
        files: vec![row(diagnostics)],
        used: vec![0],
        work: work(),
        ..Reading::default()
    }
}

fn planned(diagnostics: Vec<Diagnostic>) -> PlanReady {
    let empty = Program {
        name: "a".to_owned(),
        machine: String::new(),
        origin: Point::new(Length::from_nm(0), Length::from_nm(0)),
        bits: Vec::new(),
        spindles: 1,
        safe_height: Length::from_um(2_000),
        legs: Vec::new(),
        accepted: Vec::new(),
    };
    let program = program::encode(&empty);
    PlanReady { key: program::key(&program), program, diagnostics, ..PlanReady::default() }
}

/// A problem that must be read.
pub(super) fn finding(id: &str) -> Finding {
    let nets = vec!["A".to_owned(), "B".to_owned()];
    let found = Finding::new(FindingKind::Gap, Point::default(), Length::from_um(100), nets);
    Finding { id: id.to_owned(), ..found }
}

fn group(finding: &Finding) -> Group {
    let (kind, must_be_read, tool) = finding.cause();
    let (nets, least, ids) = (finding.nets.clone(), finding.width, vec![finding.id.clone()]);
    Group { kind, must_be_read, tool, count: 1, least, most: least, pairs: vec![Pair { nets, least, ids }] }
}

fn refused(code: &str) -> Result<Answer, Stopped> {
    Err(Stopped::Refused(vec![Diagnostic::error(code)]))
}

/// A worker's answer by its word, and the kind of request that it answers.
fn answer(word: &str, number: u32) -> Option<(&'static str, Result<Answer, Stopped>)> {
    let read = |diagnostics, holes| Ok(Answer::Read(Box::new(reading(number, diagnostics, holes))));
    let plan = |diagnostics| Ok(Answer::Planned(Box::new(planned(diagnostics))));
    let project =
        |job: Option<String>| Answer::Opened(Project { files: files(7), said: SaidOfFiles::default(), job });
    let proof = |ids: &[&str]| {
        let findings: Vec<Finding> = ids.iter().map(|id| finding(id)).collect();
        let groups = findings.iter().map(group).collect();
        Ok(Answer::Proved(Verdict { findings, groups, ..Verdict::default() }))
    };
    let export = |names: &[&str], unread: Vec<(Face, u32)>| {
        let file = |name: &&str| OutputFile {
            name: (*name).to_owned(),
            text: "G21".to_owned(),
            ..OutputFile::default()
        };
        let sides = vec![names.iter().map(file).collect()];
        Ok(Answer::Exported(Box::new(Exported { sides, unread, ..Exported::default() })))
    };
    Some(match word {
        "opened" => ("open", Ok(project(None))),
        "open-refused" => ("open", refused("saved.broken")),
        "certain" => ("read", read(Vec::new(), 1)),
        "warning" => ("read", read(vec![diagnostic(Severity::Warning)], 1)),
        "error" => ("read", read(vec![diagnostic(Severity::Error)], 1)),
        "empty" => ("read", read(Vec::new(), 0)),
        "read-refused" => ("read", refused("engine.fell_over")),
        "read-stopped" => ("read", Err(Stopped::Cancelled)),
        "plan" => ("plan", plan(Vec::new())),
        "plan-error" => ("plan", plan(vec![Diagnostic::error("plan.no_tool")])),
        "plan-refused" => ("plan", refused("plan.nothing")),
        "plan-stopped" => ("plan", Err(Stopped::Cancelled)),
        "gone" => ("plan", refused("engine.board_gone")),
        "prove" => ("prove", proof(&[])),
        "prove-two" => ("prove", proof(&["one", "two"])),
        "prove-refused" => ("prove", refused("engine.fell_over")),
        "time" => ("time", Ok(Answer::Timed(Timed { stream_digest: "d".to_owned(), ..Timed::default() }))),
        "time-refused" => ("time", refused("steps.too_long")),
        "time-stopped" => ("time", Err(Stopped::Cancelled)),
        "exported" => ("export", export(&["a.nc"], Vec::new())),
        "exported-two" => ("export", export(&["a.nc", "b.nc"], Vec::new())),
        "export-unread" => ("export", export(&[], vec![(Face::Bottom, 2)])),
        "export-refused" => ("export", refused("post.broken")),
        "export-gone" => ("export", refused("engine.board_gone")),
        "lines" => ("lines", Ok(Answer::Lines(Vec::new()))),
        "lines-refused" => ("lines", refused("post.broken")),
        "lines-stopped" => ("lines", Err(Stopped::Cancelled)),
        "lines-gone" => ("lines", refused("engine.board_gone")),
        "saved" => ("save", Ok(Answer::Saved(vec![1, 2, 3]))),
        "save-refused" => ("save", refused("saved.too_large")),
        "compared" => ("compare", Ok(Answer::Compared(Box::new(compared(None))))),
        "compared-carried" => ("compare", Ok(Answer::Compared(Box::new(compared(Some(shifted_work())))))),
        "compare-refused" => ("compare", refused("engine.fell_over")),
        "underside" => ("underside", Ok(Answer::Underside(vec![tile()]))),
        "underside-stopped" => ("underside", Err(Stopped::Cancelled)),
        "underside-gone" => ("underside", refused("engine.board_gone")),
        "underside-refused" => ("underside", refused("engine.fell_over")),
        "checked" => ("check", Ok(Answer::Checked(crate::engine::messages::Checked::default()))),
        _ => return None,
    })
}

fn tile() -> UnderTile {
    UnderTile { first: [0, 0], depths_um: vec![100] }
}

fn files(number: u8) -> Vec<(String, Vec<u8>)> {
    vec![("a.drl".to_owned(), vec![number]), ("b.drl".to_owned(), vec![number])]
}

fn saved_project() -> Vec<(String, Vec<u8>)> {
    let project = Project { files: files(7), said: SaidOfFiles::default(), job: None };
    vec![("a.annulus".to_owned(), annulus_core::project::saved::write(&project).unwrap())]
}

fn other_files() -> Vec<(String, Vec<u8>)> {
    vec![("c.drl".to_owned(), vec![2]), ("d.drl".to_owned(), vec![2])]
}

/// A comparison that finds one more hole; `work` is the job that was carried over.
fn compared(work: Option<Work>) -> Compared {
    let added = Changed { fate: Fate::Added, before: None, now: Some(hole()) };
    let changes = BoardChanges { holes: vec![added], ..BoardChanges::default() };
    Compared { changes, work, ..Compared::default() }
}

/// A job as returned by a comparison, recognizable by its first depth.
pub(super) fn shifted_work() -> Work {
    let mut work = work();
    work.operations[0].depth = Length::from_um(77);
    work
}

fn described(settings: Vec<(String, Value)>) -> Event {
    let tell = Tell::Machine { settings, fingerprint: String::new(), faults: None };
    LinkEvent::Heard { tell: Some(Box::new(tell)) }.into()
}

pub(super) fn offer(place: u32, at_ms: f64) -> Offer {
    Offer { place, name: format!("kept {place}"), at_ms, elsewhere: false }
}

impl Story {
    pub(super) fn told(words: &str) -> Self {
        let mut story = Self::default();
        words.split_whitespace().for_each(|word| story.tell(word));
        story
    }

    pub(super) fn send(&mut self, event: impl Into<Event>) {
        self.out = update(&mut self.model, event.into());
        for effect in &self.out {
            if let Effect::Ask { number, request, .. } = effect {
                self.asked.push((kind(request), *number));
            }
        }
    }

    /// The number of the last request of kind `wanted`, or of the one `before` it.
    fn number(&self, wanted: &str, before: usize) -> u32 {
        let numbers = self.asked.iter().rev().filter(|(kind, _)| *kind == wanted).map(|(_, number)| *number);
        numbers.clone().nth(before).unwrap_or_else(|| panic!("nobody asked to {wanted}"))
    }

    /// The number of the last request whose progress is shown: not the times that are computed during a
    /// proof.
    fn in_work(&self) -> Option<u32> {
        let beside = if self.way() == "timing" { "" } else { "time" };
        self.asked.iter().rev().find(|(kind, _)| *kind != beside).map(|(_, number)| *number)
    }

    pub(super) fn tell(&mut self, told: &str) {
        let (before, word) = told.strip_prefix("old-").map_or((0, told), |word| (1, word));
        if word.starts_with("prove") && self.way() == "resting" {
            // The proof starts only after the delay for further changes.
            self.tell("plan-rested");
        }
        if let Some((kind, _)) = answer(word, 0) {
            let number = self.number(kind, before);
            let (_, answer) = answer(word, number).unwrap();
            return self.send(Event::Answered { number, answer });
        }
        self.count += 1;
        match self.event(told) {
            Some(event) => self.send(event),
            None => panic!("no such word: {told}"),
        }
    }

    fn event(&mut self, word: &str) -> Option<Event> {
        let lines = || Self::lines_event(word);
        self.file_event(word)
            .or_else(|| self.job_event(word))
            .or_else(|| self.keep_event(word))
            .or_else(lines)
    }

    fn file_event(&mut self, word: &str) -> Option<Event> {
        let event = match word {
            "open" => FilesEvent::Chosen { files: files(1) },
            "open-other" => FilesEvent::Chosen { files: other_files() },
            "fetched" => FilesEvent::Fetched { files: other_files() },
            "open-anew" => FilesEvent::Chosen { files: vec![("a.drl".to_owned(), vec![3])] },
            "open-anew-whole" => FilesEvent::Chosen { files: files(3) },
            "open-project" => FilesEvent::Chosen { files: saved_project() },
            "choose" => FilesEvent::Choose,
            "sample" => FilesEvent::Sample,
            "review" => FilesEvent::Review,
            "reviewed" => FilesEvent::Reviewed,
            "discard" => FilesEvent::Discarded,
            "back" => FilesEvent::Back,
            "say-board" => FilesEvent::Board { name: "other".to_owned() },
            "say-aligned" => FilesEvent::Aligned { on: true },
            "flip-use" => FilesEvent::FlipUse { row: 0 },
            "accept" => FilesEvent::FlipAccepted { code: "board.something".to_owned() },
            "load-bit" => FilesEvent::Loaded { bit: Some(Length::from_um(800)) },
            _ => return None,
        };
        Some(event.into())
    }

    fn job_event(&mut self, word: &str) -> Option<Event> {
        let event = match word {
            "edit" | "type" => {
                let mut work = (**self.model.job.work.as_ref()?).clone();
                work.operations.get_mut(0)?.depth = Length::from_um(100 + self.count);
                let field = (word == "type").then_some("operation.depth");
                JobEvent::Change { field, work: Box::new(work) }
            }
            "same" => {
                JobEvent::Change { field: None, work: Box::new((**self.model.job.work.as_ref()?).clone()) }
            }
            "undo" => JobEvent::Undo { back: true },
            "redo" => JobEvent::Undo { back: false },
            "bottom" => JobEvent::Turn { face: Face::Bottom },
            "top" => JobEvent::Turn { face: Face::Top },
            "choose-last" => JobEvent::Choose { at: 2 },
            "up" => JobEvent::Shift { up: true },
            "down" => JobEvent::Shift { up: false },
            "drag" => JobEvent::Move { from: 0, to: 2 },
            "add" => JobEvent::Add { word: "mill_holes".to_owned() },
            "add-nothing" => JobEvent::Add { word: "fold".to_owned() },
            "remove" => JobEvent::Remove,
            "mark" => JobEvent::Mark { at: 1 },
            "see-one" => JobEvent::Read { names: vec!["one".to_owned()], on: true },
            "unsee-one" => JobEvent::Read { names: vec!["one".to_owned()], on: false },
            "see-all" => JobEvent::AllSeen,
            _ => return self.export_event(word),
        };
        Some(event.into())
    }

    fn export_event(&mut self, word: &str) -> Option<Event> {
        Some(match word {
            "write" => ExportEvent::Write { purpose: export::Purpose::Files }.into(),
            "sheet" => ExportEvent::Write { purpose: export::Purpose::RunSheet }.into(),
            "panel" => ExportEvent::Panel { on: true }.into(),
            "panel-closed" => ExportEvent::Panel { on: false }.into(),
            "save-sheet" => ExportEvent::SaveRunSheet.into(),
            "close-sheet" => ExportEvent::CloseRunSheet.into(),
            "save-project" => ExportEvent::SaveProject.into(),
            "template" => TemplateEvent::Open.into(),
            "template-done" => TemplateEvent::Close.into(),
            "typed" => TemplateEvent::Keep { text: format!("name = \"Mine\" # {}", self.count) }.into(),
            "typing-rested" => {
                let last = self.last_wake(|event| matches!(event, Event::Template(_)))?;
                Event::clone(&last)
            }
            "cancel" => Event::Cancelled,
            "plan-rested" => {
                Event::Rested { number: self.model.on_the_way.number().unwrap_or(self.model.request) }
            }
            "plan-rested-before" => Event::Rested { number: self.model.on_the_way.number()? - 1 },
            "soon" => Event::Clock { clock: self.later(150.0) },
            "machine" => {
                let value = Value::Text(format!("Drill {}", self.count));
                described(vec![("machine.name".to_owned(), value)])
            }
            "machine-again" => described(Vec::new()),
            "half" => Event::Progress { number: self.in_work()?, share: 0.5 },
            "old-half" => Event::Progress { number: self.asked.first()?.1, share: 0.5 },
            _ => return None,
        })
    }

    fn later(&self, ms: f64) -> Clocks {
        let Clocks { page_ms, wall_ms } = self.model.clock;
        Clocks { page_ms: page_ms + ms, wall_ms: wall_ms + ms }
    }

    fn anew_event(&mut self, word: &str) -> Option<Event> {
        let written = |number| vec![("b.drl".to_owned(), vec![number])];
        let event = match word {
            "choose-anew" => AnewEvent::Choose,
            "chosen-anew" => AnewEvent::Chosen { files: other_files() },
            "chosen-anew-one" => AnewEvent::Chosen { files: vec![("a.drl".to_owned(), vec![3])] },
            "chosen-anew-mixed" => AnewEvent::Chosen {
                files: vec![("a.drl".to_owned(), vec![3]), ("c.drl".to_owned(), vec![2])],
            },
            "chosen-anew-project" => AnewEvent::Chosen { files: saved_project() },
            "on-disk" => AnewEvent::OnDisk { files: written(9) },
            "on-disk-a" => AnewEvent::OnDisk { files: vec![("a.drl".to_owned(), vec![8])] },
            "on-disk-same" => AnewEvent::OnDisk { files: written(1) },
            "take-from-disk" => {
                let toasts = &self.model.frame.toasts;
                let offer = toasts.iter().find(|toast| toast.act == Some(ToastAct::TakeAnew))?;
                return Some(FrameEvent::Taken { number: offer.number }.into());
            }
            "seen" => AnewEvent::Seen,
            "as-before" => AnewEvent::Back,
            "another" => AnewEvent::Another,
            _ => return None,
        };
        Some(event.into())
    }

    fn keep_event(&mut self, word: &str) -> Option<Event> {
        if let Some(event) = self.anew_event(word) {
            return Some(event);
        }
        Some(match word {
            "begin" => Event::Begun,
            "found-none" => KeepEvent::Found { offers: Vec::new() }.into(),
            "found-one" => KeepEvent::Found { offers: vec![offer(0, 1.0)] }.into(),
            "found-second" => KeepEvent::Found { offers: vec![offer(1, 1.0)] }.into(),
            "found-fourth" => KeepEvent::Found { offers: vec![offer(4, 1.0)] }.into(),
            "found-two" => KeepEvent::Found { offers: vec![offer(0, 1.0), offer(1, 2.0)] }.into(),
            "rested" => Event::Keep(KeepEvent::Rested { change: self.model.keeping_change() }),
            "rested-before" => Event::Keep(KeepEvent::Rested { change: self.model.keeping_change() - 1 }),
            "looked" => KeepEvent::Looked.into(),
            "leaving" => KeepEvent::Leaving.into(),
            "written" => KeepEvent::Written { place: Some(4), full: false }.into(),
            "written-fifth" => KeepEvent::Written { place: Some(5), full: false }.into(),
            "not-written" => KeepEvent::Written { place: None, full: false }.into(),
            "full" => KeepEvent::Written { place: None, full: true }.into(),
            "restore" => KeepEvent::Restore { offer: self.model.keeping.offers.first()?.clone() }.into(),
            "taken" | "taken-nothing" | "taken-elsewhere" => {
                let bytes = (word != "taken-nothing").then(|| vec![1]);
                let place = self.model.keeping.offers.first()?.place;
                KeepEvent::Taken { place, files: bytes, job: None, own: word != "taken-elsewhere" }.into()
            }
            "forget" => KeepEvent::Discard { offer: self.model.keeping.offers.first()?.clone() }.into(),
            "take-back" => FrameEvent::Taken { number: self.model.frame.toasts.last()?.number }.into(),
            "drop" => KeepEvent::Drop { place: 0 }.into(),
            "forgotten" => KeepEvent::Dropped.into(),
            _ => return None,
        })
    }

    fn last_wake(&self, wanted: impl Fn(&Event) -> bool) -> Option<Box<Event>> {
        self.out.iter().find_map(|effect| match effect {
            Effect::Wake { event, .. } if wanted(event) => Some(event.clone()),
            _ => None,
        })
    }

    pub(super) fn out(&self) -> String {
        self.out.iter().map(word).collect::<Vec<_>>().join(" ")
    }

    pub(super) fn way(&self) -> &'static str {
        match &self.model.on_the_way {
            OnTheWay::Nothing => "nothing",
            OnTheWay::Opening { .. } => "opening",
            OnTheWay::Reading { .. } => "reading",
            OnTheWay::Planning { again: true, .. } => "planning-again",
            OnTheWay::Planning { step: PlanStep::Plan, .. } => "planning",
            OnTheWay::Planning { step: PlanStep::Rest { .. }, .. } => "resting",
            OnTheWay::Planning { step: PlanStep::Prove { .. }, .. } => "proving",
            OnTheWay::Planning { step: PlanStep::Time { .. }, .. } => "timing",
        }
    }

    pub(super) fn known(&self) -> String {
        let board = &self.model.board;
        let facts = [
            (board.document.is_some(), "board"),
            (board.reviewing, "review"),
            (board.plan.is_some(), "plan"),
            (board.proved.is_some(), "proof"),
            (board.job.is_some(), "job"),
            (board.stale, "stale"),
            (!board.refused.is_empty(), "refused"),
        ];
        facts.iter().filter(|(on, _)| *on).map(|(_, word)| *word).collect::<Vec<_>>().join(" ")
    }

    /// Request in progress, known parts, and effects of the last word.
    pub(super) fn stands(&self) -> String {
        format!("{} | {} | {}", self.way(), self.known(), self.out())
    }

    pub(super) fn toasts(&self) -> Vec<String> {
        let key = |text: &Text| match text {
            Text::Key { key, .. } => (*key).to_owned(),
            Text::Found(diagnostic) => diagnostic.code.clone(),
        };
        self.model.frame.toasts.iter().map(|toast| key(&toast.text)).collect()
    }
}

/// Runs every row and compares the result; reports all rows that differ.
pub(super) fn compare(rows: &[(&str, &str)], after: impl Fn(&Story) -> String) {
    super::compare(rows, Story::told, after);
}
