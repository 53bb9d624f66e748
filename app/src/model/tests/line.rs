//! Drives a model with a link by short words, and describes the effects in short words.

use crate::engine::messages::{Answer, Timed};
use crate::lab::log::Topic;
use crate::model::link::{LinkPhase, Notice};
use crate::model::{
    Clocks, ControllerEvent, Effect, Event, FrameEvent, HandEvent, Job, LinkEvent, Model, StartEvent,
    Support, update,
};
use annulus_core::control::{Ending, State, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::job::Program;
use annulus_core::level::ProbeGrid;
use annulus_core::machine::Value;
use annulus_core::units::Length;
use annulus_core::wire::{
    ArmedJob, Ask, Control, ControllerReport, HeightMapReport, InterruptedJob, JobEnd, MissingReport,
    OtherFirmware, Paired, PreflightRow, RowVerdict, Status, Tell, program,
};
use std::sync::Arc;

/// A model with a simulated bridge.
pub(super) struct Line {
    pub(super) model: Model,
    out: Vec<Effect>,
    uploads: Vec<u32>,
    fetches: Vec<u32>,
    timings: Vec<u32>,
    waking: Vec<LinkEvent>,
    stop_ms: f64,
    page_ms: f64,
}

pub(super) fn empty() -> Program {
    Program {
        name: "a".to_owned(),
        machine: String::new(),
        origin: Point::new(Length::from_nm(0), Length::from_nm(0)),
        bits: Vec::new(),
        spindles: 1,
        safe_height: Length::from_um(2_000),
        legs: Vec::new(),
        accepted: Vec::new(),
    }
}

fn session() -> Paired {
    serde_json::from_str(r#"{"ok":true,"session":"s","key":"00"}"#).expect("a session")
}

pub(super) fn status(state: State, job: Option<&str>) -> Status {
    let text = r#"{"steps":STEPS,"machine_mm":[0,0,0],"work_mm":[0,0,0],"zero_mm":null,"target_mm":null,
        "lower_dead_point_mm":null,"job":null,"job_name":null,"leg":null,"hole":null,"holes_done":0,"holes_total":0,
        "stage":null,"command":null,"bit":null,"bit_mm":null,"spindle_rpm":0,"inputs":0,"phases":[0,0,0],
        "elapsed_s":0,"left_s":0,"alarm":null,"state":"ready","trust":"trusted"}"#;
    let steps = serde_json::to_string(&annulus_core::machine::Steps::default()).unwrap();
    let mut status: Status = serde_json::from_str(&text.replace("STEPS", &steps)).expect("a status");
    status.state = state;
    status.trust = Trust::Trusted;
    status.job = job.map(str::to_owned);
    status.alarm = (state == State::Alarm).then(|| Diagnostic::error("control.limit"));
    status
}

fn word(effect: &Effect) -> String {
    match effect {
        Effect::Send { text } => text.split('"').nth(3).unwrap_or_default().to_owned(),
        Effect::Wake { after_ms, .. } => format!("wake:{after_ms}"),
        Effect::Pair { .. } => "pair".to_owned(),
        Effect::Connect => "connect".to_owned(),
        Effect::KeepControl { had: true } => "keep-control".to_owned(),
        Effect::KeepControl { had: false } => "give-up-control".to_owned(),
        Effect::ForgetSession => "forget-session".to_owned(),
        Effect::Renew { on: true } => "renew".to_owned(),
        Effect::Renew { on: false } => "no-renew".to_owned(),
        Effect::ChoosePort => "choose-port".to_owned(),
        Effect::ConnectController => "connect-controller".to_owned(),
        Effect::LeavePort => "leave-port".to_owned(),
        Effect::StopBeside { heard } => if *heard { "heard-beside" } else { "stop-beside" }.to_owned(),
        Effect::KeepController { on } => format!("keep-controller:{on}"),
        Effect::KeepBoard { .. } => "keep-board".to_owned(),
        Effect::Guard { on } => format!("guard:{on}"),
        Effect::HoldPort => "hold-port".to_owned(),
        Effect::Upload { .. } => "upload".to_owned(),
        Effect::Fetch { .. } => "fetch".to_owned(),
        Effect::Ask { .. } => "time".to_owned(),
        other => format!("{other:?}"),
    }
}

fn state(word: &str) -> State {
    match word {
        "Ready" => State::Ready,
        "Running" => State::Running,
        "Pausing" => State::Pausing,
        "Paused" => State::Paused,
        "ToolChange" => State::ToolChange,
        "Jogging" => State::Jogging,
        "Stopping" => State::Stopping,
        "Alarm" => State::Alarm,
        other => panic!("no such state: {other}"),
    }
}

fn tell(tell: Tell) -> Event {
    LinkEvent::Heard { tell: Some(Box::new(tell)) }.into()
}

fn control(yours: bool, taken: bool) -> Event {
    tell(Tell::Control(Control { yours, taken, viewers: 1 }))
}

fn refused(code: &str) -> Event {
    tell(Tell::Refused { why: Diagnostic::error(code) })
}

fn ended(ending: Ending) -> Event {
    tell(Tell::Ended(JobEnd { job: "k".to_owned(), ending, holes_done: 3, toolpaths_done: 0 }))
}

/// The bridge's preflight result for `job`; `digest` is that of its step stream.
fn armed(job: &str, digest: &str, levelled: bool, verdict: Option<RowVerdict>) -> Event {
    let row = |verdict| PreflightRow { finding: Diagnostic::warning("preflight.lid"), verdict };
    let checks = verdict.map(row).into_iter().collect();
    tell(Tell::Armed(ArmedJob { job: job.to_owned(), stream_digest: digest.to_owned(), levelled, checks }))
}

fn map() -> HeightMapReport {
    let bounds = Bounds { min: Point::default(), max: Point::from_mm(20.0, 20.0) };
    let grid = ProbeGrid::over(bounds, Length::from_um(10_000), Length::ZERO).unwrap();
    let heights = vec![Some(Length::ZERO); grid.count()];
    HeightMapReport { grid: Some(grid), heights, ..HeightMapReport::default() }
}

fn controller_event(word: &str) -> Option<ControllerEvent> {
    Some(match word {
        "serial" => ControllerEvent::Looked { support: Support::Yes, kept: false, before: None },
        "serial-kept" => ControllerEvent::Looked { support: Support::Yes, kept: true, before: None },
        "serial-other-kept" => {
            ControllerEvent::Looked { support: Support::Yes, kept: true, before: Some("another".to_owned()) }
        }
        "no-serial" => ControllerEvent::Looked { support: Support::Missing, kept: true, before: None },
        "port-known" => ControllerEvent::Known { any: true },
        "want" => ControllerEvent::Wanted { ask: true },
        "want-known" => ControllerEvent::Wanted { ask: false },
        "chosen" => ControllerEvent::Chosen,
        "adapter" => ControllerEvent::Opened { adapter: true, very: true },
        "opened" => ControllerEvent::Opened { adapter: false, very: true },
        "opened-like-it" => ControllerEvent::Opened { adapter: false, very: false },
        "several" => ControllerEvent::Several,
        "disturbed" => ControllerEvent::Disturbed { kind: "FramingError".to_owned(), times: 1 },
        "disturbed-again" => ControllerEvent::Disturbed { kind: "FramingError".to_owned(), times: 2 },
        "port-failed" => ControllerEvent::Failed { why: Diagnostic::error("serial.not_opened") },
        "other-speed" => ControllerEvent::OtherSpeed,
        "plugged" => ControllerEvent::Plugged,
        "let-go" => ControllerEvent::LetGo,
        "page-left" => ControllerEvent::PageLeft,
        _ => return None,
    })
}

impl Line {
    pub(super) fn told(words: &str) -> Self {
        let mut line = Self {
            model: Model::default(),
            out: Vec::new(),
            uploads: Vec::new(),
            fetches: Vec::new(),
            timings: Vec::new(),
            waking: Vec::new(),
            stop_ms: 0.0,
            page_ms: 1_000.0,
        };
        words.split_whitespace().for_each(|word| line.tell(word));
        line
    }

    fn send(&mut self, event: Event) {
        let clock = Clocks { page_ms: self.page_ms, wall_ms: self.page_ms };
        update(&mut self.model, Event::Clock { clock });
        self.out = update(&mut self.model, event);
        for effect in &self.out {
            match effect {
                Effect::Upload { number, .. } => self.uploads.push(*number),
                Effect::Fetch { number, .. } => self.fetches.push(*number),
                Effect::Ask { number, .. } => self.timings.push(*number),
                Effect::Wake { event, .. } => self.waking.extend(match &**event {
                    Event::Link(event) => Some(event.clone()),
                    _ => None,
                }),
                _ => {}
            }
        }
    }

    fn tell(&mut self, word: &str) {
        if let Some(ms) = word.strip_prefix('+') {
            self.page_ms += ms.parse::<f64>().unwrap();
            self.out.clear();
            return;
        }
        match word {
            "linked" => ["begin-kept", "challenge", "welcome"].into_iter().for_each(|word| self.tell(word)),
            "ready" => ["linked", "yours", "status:Ready"].into_iter().for_each(|word| self.tell(word)),
            "mill" => {
                ["serial", "begin-kept", "chosen", "challenge", "welcome", "yours", "who", "status:Ready"]
                    .into_iter()
                    .for_each(|word| self.tell(word));
            }
            "planned" => {
                let program = empty();
                let (bytes, key) = (program::encode(&program), "own".to_owned());
                let stream_digest = "digest".to_owned();
                self.model.board.job = Some(Arc::new(Job { program, bytes, key, stream_digest }));
                self.out.clear();
            }
            _ => {
                let event = self.event(word).unwrap_or_else(|| panic!("no such word: {word}"));
                if word == "stop" {
                    self.stop_ms = self.page_ms;
                }
                self.send(event);
            }
        }
    }

    fn event(&self, word: &str) -> Option<Event> {
        if word == "alone" {
            return Some(FrameEvent::Alone.into());
        }
        self.link_event(word)
            .or_else(|| controller_event(word).map(LinkEvent::Controller))
            .map(Event::Link)
            .or_else(|| self.told_event(word))
            .or_else(|| self.start_event(word))
    }

    fn link_event(&self, word: &str) -> Option<LinkEvent> {
        let begun = |token: Option<&str>, kept: Option<Paired>, had_control: bool| LinkEvent::Begun {
            token: token.map(str::to_owned),
            kept,
            had_control,
        };
        let ask = |wish: Ask| LinkEvent::Ask { wish };
        let close = |notice: Notice| LinkEvent::Close { notice };
        Some(match word {
            "begin" => begun(None, None, false),
            "begin-token" => begun(Some("t"), None, false),
            "begin-kept" => begun(None, Some(session()), false),
            "begin-kept-control" => begun(None, Some(session()), true),
            "paired" => LinkEvent::Paired { session: Some(session()) },
            "not-paired" => LinkEvent::Paired { session: None },
            "retry" => LinkEvent::Retry { number: self.model.link.tries },
            "retry-before" => LinkEvent::Retry { number: self.model.link.tries.wrapping_sub(1) },
            "again" => LinkEvent::ReconnectNow,
            "closed" => LinkEvent::Closed,
            "not-sent" => LinkEvent::NotSent,
            "tick" => LinkEvent::Tick,
            "unread" => LinkEvent::Heard { tell: None },
            "stop" => LinkEvent::Stop,
            "stop-beside" => LinkEvent::StopBeside,
            "heard-beside" => LinkEvent::StopHeardBeside,
            "looked" => LinkEvent::StopLooked,
            "escape" => LinkEvent::Escape,
            "pause" => LinkEvent::Pause,
            "step" => LinkEvent::Hand(HandEvent::Clicked { way: (0, true) }),
            "gone" => LinkEvent::Hand(HandEvent::Gone),
            "shown" => LinkEvent::Hand(HandEvent::Shown),
            "down" => LinkEvent::Hand(HandEvent::Down { way: (0, true), pointer: 1 }),
            "down-second" => LinkEvent::Hand(HandEvent::Down { way: (1, true), pointer: 2 }),
            "other-down" => LinkEvent::Hand(HandEvent::OtherDown { pointer: 2 }),
            "same-down" => LinkEvent::Hand(HandEvent::OtherDown { pointer: 1 }),
            "up" => LinkEvent::Hand(HandEvent::Up { pointer: 1, clicked: true }),
            "off" => LinkEvent::Hand(HandEvent::Up { pointer: 1, clicked: false }),
            "up-second" => LinkEvent::Hand(HandEvent::Up { pointer: 2, clicked: true }),
            "arm" => LinkEvent::Hand(HandEvent::Arm { on: None }),
            "focus-left" => LinkEvent::Hand(HandEvent::FocusLeft),
            "right" => {
                LinkEvent::Hand(HandEvent::KeyDown { way: Some((0, true)), ten: false, repeat: false })
            }
            "right-again" => {
                LinkEvent::Hand(HandEvent::KeyDown { way: Some((0, true)), ten: false, repeat: true })
            }
            "right-ten" => {
                LinkEvent::Hand(HandEvent::KeyDown { way: Some((0, true)), ten: true, repeat: false })
            }
            "other-key" => LinkEvent::Hand(HandEvent::KeyDown { way: None, ten: false, repeat: false }),
            "right-up" => LinkEvent::Hand(HandEvent::KeyUp { way: Some((0, true)), shift: false }),
            "left-up" => LinkEvent::Hand(HandEvent::KeyUp { way: Some((0, false)), shift: false }),
            "shift-up" => LinkEvent::Hand(HandEvent::KeyUp { way: None, shift: true }),
            "finer" => LinkEvent::Hand(HandEvent::Finer { finer: true }),
            "long" | "idle" => return self.due(word == "long"),
            "renew" => LinkEvent::Renew { hidden: false },
            "renew-hidden" => LinkEvent::Renew { hidden: true },
            "forget" => LinkEvent::Forget,
            "clear-log" => LinkEvent::ClearLog,
            "home" => ask(Ask::Home),
            "take" => ask(Ask::TakeControl { force: false }),
            "release" => ask(Ask::ReleaseControl),
            "close:refused" => close(Notice::Refused),
            "close:ousted" => close(Notice::Ousted),
            "close:ended" => close(Notice::Ended),
            "close:stop" => close(Notice::Stop),
            "close:firmware" => close(Notice::OtherFirmware),
            _ => return None,
        })
    }

    /// The latest timer of a press (`long`) or of unused keys.
    fn due(&self, long: bool) -> Option<LinkEvent> {
        let wanted = |event: &LinkEvent| match event {
            LinkEvent::Hand(HandEvent::Long { .. }) => long,
            LinkEvent::Hand(HandEvent::Idle { .. }) => !long,
            _ => false,
        };
        self.waking.iter().rev().find(|event| wanted(event)).cloned()
    }

    fn told_event(&self, word: &str) -> Option<Event> {
        if let Some(words) = word.strip_prefix("status:") {
            let (state_word, job) =
                words.split_once(':').map_or((words, None), |(state, job)| (state, Some(job)));
            return Some(tell(Tell::Status(Box::new(status(state(state_word), job)))));
        }
        let machine = |fingerprint: &str| {
            let name = ("machine.name".to_owned(), Value::Text("Drill one".to_owned()));
            tell(Tell::Machine { settings: vec![name], fingerprint: fingerprint.to_owned(), faults: None })
        };
        Some(match word {
            "challenge" => {
                tell(Tell::Challenge { proto: 1, min: 1, bridge: String::new(), nonce: "00".to_owned() })
            }
            "welcome" => tell(Tell::Welcome { viewer: 1 }),
            "other-firmware" | "newer-firmware" => {
                let found = if word == "other-firmware" { 0xA } else { 0xB };
                let other_firmware = Some(OtherFirmware { found, wanted: 0xC });
                tell(Tell::Status(Box::new(Status { other_firmware, ..status(State::Ready, None) })))
            }
            "unknown" => refused("socket.session"),
            "refused" => refused("control.busy"),
            "taken" => refused("control.taken"),
            "nothing-to-do" => refused("control.nothing_to_do"),
            "yours" => control(true, true),
            "others" => control(false, true),
            "nobody" => control(false, false),
            "pong" => tell(Tell::Pong { stamp: self.stop_ms }),
            "pong-before" => tell(Tell::Pong { stamp: self.stop_ms - 1.0 }),
            "ended" => ended(Ending::Done),
            "stopped" => ended(Ending::Stopped),
            "interrupted" => tell(Tell::Interrupted(InterruptedJob {
                job: "k".to_owned(),
                name: "a".to_owned(),
                next_leg: 7,
                holes_done: 3,
                holes_total: 9,
                toolpaths_done: 0,
                toolpaths_total: 0,
            })),
            "machine" | "machine-same" => machine("f"),
            "who" | "who-else" => tell(Tell::Controller(ControllerReport {
                flavour: "GRBL".to_owned(),
                version: "1.1h".to_owned(),
                values: vec![(110, if word == "who" { 5_000.0 } else { 4_000.0 })],
                mill: None,
                lengths: annulus_core::grbl::ToolLengths::default(),
                reset_on_open: annulus_core::grbl::ResetOnOpen::default(),
                changer: Vec::new(),
            })),
            "armed-mill" => armed("own", "", false, None),
            "armed" => armed("own", "digest", false, None),
            "armed-other-steps" => armed("own", "other", false, None),
            "armed-other-job" => armed("other", "digest", false, None),
            "armed-levelled" => armed("own", "digest", true, None),
            "map" => tell(Tell::HeightMap(Box::new(map()))),
            "armed-fail" => armed("own", "digest", false, Some(RowVerdict::Fail)),
            "armed-warn" => armed("own", "digest", false, Some(RowVerdict::Warn)),
            _ => return None,
        })
    }

    fn start_event(&self, word: &str) -> Option<Event> {
        let uploaded = |before: usize, good: bool| {
            let number = *self.uploads.iter().rev().nth(before).expect("nothing was uploaded");
            let answer = if good { Ok("own".to_owned()) } else { Err(Diagnostic::error("x")) };
            StartEvent::Uploaded { number, answer }
        };
        let fetched = |answer: Result<Vec<u8>, Diagnostic>| StartEvent::Fetched {
            number: *self.fetches.last().expect("nothing was fetched"),
            answer,
        };
        let event = match word {
            "preflight" => StartEvent::Open,
            "uploaded" => uploaded(0, true),
            "old-uploaded" => uploaded(1, true),
            "not-uploaded" => uploaded(0, false),
            "start" => StartEvent::Start,
            "close-it" => StartEvent::Close,
            "tick-it" => StartEvent::Tick { warning: "preflight.lid".to_owned() },
            "resume" => StartEvent::Resume {
                offer: InterruptedJob {
                    job: "k".to_owned(),
                    name: "a".to_owned(),
                    next_leg: 7,
                    holes_done: 3,
                    holes_total: 9,
                    toolpaths_done: 0,
                    toolpaths_total: 0,
                },
            },
            "missing" => StartEvent::Again {
                missing: MissingReport { job: "k".to_owned(), ..MissingReport::default() },
            },
            "fetched" => fetched(Ok(program::encode(&empty()))),
            "fetched-broken" => fetched(Ok(vec![1, 2, 3])),
            "not-fetched" => fetched(Err(Diagnostic::error("x"))),
            "timed" => {
                let number = *self.timings.last().expect("nothing was timed");
                let timed = Timed { stream_digest: "digest".to_owned(), ..Timed::default() };
                return Some(Event::Answered { number, answer: Ok(Answer::Timed(timed)) });
            }
            _ => return None,
        };
        Some(event.into())
    }

    pub(super) fn out(&self) -> String {
        let wakes = |effect: &&Effect| matches!(effect, Effect::StayAwake { .. });
        self.out.iter().filter(|effect| !wakes(effect)).map(word).collect::<Vec<_>>().join(" ")
    }

    /// Whether the last word turned the screen wake lock on or off.
    pub(super) fn awake(&self) -> String {
        let asked = self.out.iter().filter_map(|effect| match effect {
            Effect::StayAwake { on } => Some(if *on { "lit" } else { "dark" }),
            _ => None,
        });
        asked.collect::<Vec<_>>().join(" ")
    }

    pub(super) fn phase(&self) -> &'static str {
        match self.model.link.phase {
            LinkPhase::Unpaired => "unpaired",
            LinkPhase::Connecting => "connecting",
            LinkPhase::Open => "open",
            LinkPhase::Lost => "lost",
        }
    }

    pub(super) fn log(&self) -> String {
        use crate::lab::log::LogEvent as Noted;
        let mut entries = self.model.link.log.newest(|_| true);
        entries.reverse();
        let word = |event: &Noted| match (event, event.kind()) {
            (Noted::Settings, _) => "settings",
            (Noted::Control { .. }, _) => "control",
            (_, Topic::Machine) => "machine",
            (_, Topic::Trouble) => "trouble",
            (_, Topic::Asked) => "asked",
            (_, Topic::Link) => "link",
        };
        entries.iter().map(|entry| word(&entry.event)).collect::<Vec<_>>().join(" ")
    }
}

/// Runs every row and compares the result; reports all rows that differ.
pub(super) fn compare(rows: &[(&str, &str)], after: impl Fn(&Line) -> String) {
    super::compare(rows, Line::told, after);
}
