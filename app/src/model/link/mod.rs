//! The line to the bridge: how far it is, what the bridge said, who has control, and what this page asks for.
//!
//! ```text
//! Unpaired ─ token ─▶ Connecting ─ Hello accepted ─▶ Open ─ closed ─▶ Lost ─ tried again, with growing patience ─▶ Open
//! wish ─▶ Effect::Send ─▶ bridge ─▶ LinkEvent::Heard ─▶ what is shown       (and every 250 ms: ping, age, STOP heard?)
//! ```
//!
//! Comes in: messages of `wire`, wishes, the beat of the clock. Goes out: what is shown, messages to be sent. Does not know the
//! socket.

pub mod at_change;
pub mod contacts;
pub mod controller;
pub mod drilled;
pub mod hand;
mod heard;
mod jog;
mod stop;
pub mod way_back;

use super::{Effect, Model};
use crate::health::{self, Claim, Freshness, Ousted, StopWay};
use crate::lab::log::{Log, LogEvent as Noted};
use annulus_core::control::{Ending, State, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Value;
use annulus_core::queue::RowResult;
use annulus_core::wire::{
    Ask, CheckModeReport, HeightMapReport, MagazineReport, OtherFirmware, Outputs, Paired, PreflightRow,
    QueuePhase, Status, Tell, ToolsReport,
};
pub use contacts::Contacts;
pub use controller::{Controller, ControllerEvent, Support};
pub use hand::{Hand, HandEvent};
use jog::Jog;
use std::sync::Arc;

/// How often the line is looked at, in ms.
pub const TICK_MS: u32 = 250;
/// How often it is pinged.
const PING_EVERY_MS: f64 = 800.0;

/// How far the connection is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkPhase {
    /// No session: the page was opened without the link that the bridge prints.
    #[default]
    Unpaired,
    /// On the way.
    Connecting,
    /// Hello accepted.
    Open,
    /// Was open, is being tried again.
    Lost,
}

/// Who may move the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Control {
    /// This page.
    pub yours: bool,
    /// Some page.
    pub taken: bool,
    /// Pages that watch.
    pub viewers: u32,
}

/// The bridge's verdict on a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Armed {
    /// SHA-256 of the program's bytes.
    pub job: String,
    /// Digest of the step stream as the bridge computed it.
    pub stream_digest: String,
    /// Its depth follows the height map that there is.
    pub levelled: bool,
    /// Row by row.
    pub checks: Vec<PreflightRow>,
}

/// A job that can be taken up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interrupted {
    /// Which.
    pub job: String,
    /// Its name.
    pub name: String,
    /// Where to go on.
    pub next_leg: u32,
    /// Holes done for certain.
    pub holes_done: u32,
    /// Holes in all.
    pub holes_total: u32,
    /// Toolpaths done for certain.
    pub toolpaths_done: u32,
    /// Toolpaths in all.
    pub toolpaths_total: u32,
}

/// How the last job ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JobEnded {
    /// Which.
    pub job: String,
    /// Why.
    pub ending: Ending,
    /// Holes drilled.
    pub holes_done: u32,
    /// Toolpaths milled.
    pub toolpaths_done: u32,
    /// It was stopped, and STOP was pressed in this page.
    pub by_you: bool,
}

/// The machine's queue of work commands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MachineQueue {
    /// Its text; empty where there is none.
    pub text: String,
    /// What it is doing.
    pub phase: QueuePhase,
    /// The row in work or next.
    pub row: Option<usize>,
    /// Results, one a row.
    pub results: Vec<RowResult>,
    /// Why it failed.
    pub why: Option<Diagnostic>,
}

/// The line, and everything the bridge said.
#[derive(Clone, Debug, Default)]
pub struct Link {
    /// How far the connection is.
    pub phase: LinkPhase,
    /// Whether a machine was connected since the page was opened.
    pub ever: bool,
    /// How things stand.
    pub status: Option<Arc<Status>>,
    /// How old that is.
    pub freshness: Freshness,
    /// Who may move the machine.
    pub control: Control,
    /// The machine's settings.
    pub settings: Arc<Vec<(String, Value)>>,
    /// The faults that were provoked; none on a machine that has none on demand.
    pub faults: Option<Vec<String>>,
    /// Their fingerprint.
    pub fingerprint: String,
    /// The last verdict on a job.
    pub armed: Option<Armed>,
    /// What a controller has read of a job in its check mode.
    pub checked: Option<Arc<CheckModeReport>>,
    /// A job to be taken up.
    pub interrupted: Option<Interrupted>,
    /// How the last one ended.
    pub ended: Option<JobEnded>,
    /// What the bridge's clock is worth; none where the drill is virtual.
    pub timing: Option<Arc<Timing>>,
    /// Why the last wish was refused.
    pub refused: Option<Diagnostic>,
    /// Why this page lost control.
    pub ousted: Option<Ousted>,
    /// The adapter's firmware is another one, and nobody closed that it is.
    pub other_firmware: Option<OtherFirmware>,
    /// There and back, ms.
    pub delay_ms: Option<f64>,
    /// STOP was pressed and nobody said that it was heard.
    pub stop_unconfirmed: bool,
    /// What happened so far.
    pub log: Arc<Log>,
    /// The queue of work commands that the machine has.
    pub queue: MachineQueue,
    /// The outputs and their lock.
    pub outputs: Outputs,
    /// What became of the tools of the rack.
    pub tools: ToolsReport,
    /// What is known of the surface of the board on a controller.
    pub height_map: Arc<HeightMapReport>,
    /// What lies in the magazine; none on a machine without one.
    pub magazine: Option<Arc<MagazineReport>>,
    /// Where the strokes of the job in work, or of the last one, ended on their sensor.
    pub contacts: Arc<Contacts>,
    /// Who this page is to the bridge.
    pub(super) session: Option<Paired>,
    /// Tries since the line was open last.
    attempt: u32,
    /// Counts what was tried and what is to be: a try that is due is done only where nothing was tried since.
    pub(in crate::model) tries: u32,
    /// When the bridge was heard last, and pinged.
    heard_ms: f64,
    pinged_ms: f64,
    /// The bridge said that it does not know this page.
    unknown: bool,
    /// Whether this page holds on to control.
    claim: Claim,
    /// Of asking for control and giving it back, the last was giving it back.
    released: bool,
    /// Where a pressed STOP is on its way.
    stop: StopWay,
    /// When it was pressed.
    pressed_ms: Option<f64>,
    /// When Escape was pressed last.
    escaped_ms: Option<f64>,
    /// The pad that moves by hand.
    pub hand: Hand,
    /// The controller at a port of this computer, where the page has one in place of the bridge.
    pub controller: Controller,
    jog: Jog,
}

/// What happens to the line.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkEvent {
    /// The page was opened.
    Begun {
        /// The token of its address.
        token: Option<String>,
        /// The session of this tab, over a reload.
        kept: Option<Paired>,
        /// This tab had control when it was loaded last, and did not give it away.
        had_control: bool,
    },
    /// The token was exchanged for a session, or was not.
    Paired {
        /// The session.
        session: Option<Paired>,
    },
    /// It is time for another try.
    Retry {
        /// Which; one that was planned before another is not done any more.
        number: u32,
    },
    /// The person wants another try at once.
    ReconnectNow,
    /// The bridge was heard.
    Heard {
        /// What it said, where that could be read.
        tell: Option<Box<Tell>>,
    },
    /// The socket is gone.
    Closed,
    /// Something could not be sent: the socket is not open.
    NotSent,
    /// A quarter of a second went by.
    Tick,
    /// Something is asked of the bridge.
    Ask {
        /// What.
        wish: Ask,
    },
    /// STOP was pressed.
    Stop,
    /// STOP was pressed in another tab of this site.
    StopBeside,
    /// The tab that has the machine heard it.
    StopHeardBeside,
    /// STOP has had time to be heard.
    StopLooked,
    /// Escape was pressed where nothing else is open.
    Escape,
    /// The job is to pause, if one of ours runs.
    Pause,
    /// Something happens to the pad that moves by hand.
    Hand(HandEvent),
    /// It is time to say that this page is still there, while something moves by hand.
    Renew {
        /// The page is not seen.
        hidden: bool,
    },
    /// A notice was closed.
    Close {
        /// Which.
        notice: Notice,
    },
    /// The broken-off job is to be forgotten.
    Forget,
    /// The log is to be empty.
    ClearLog,
    /// Something happens about a controller at a port of this computer.
    Controller(ControllerEvent),
}

/// What stays on show until somebody closes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    /// Why the last wish was refused.
    Refused,
    /// Why control was lost.
    Ousted,
    /// How the last job ended.
    Ended,
    /// That the adapter's firmware is another one.
    OtherFirmware,
    /// That STOP was not confirmed.
    Stop,
}

impl Link {
    /// What the machine is doing, if one is there.
    pub fn state(&self) -> Option<State> {
        self.status.as_ref().map(|status| status.state)
    }

    /// Whether anything moves or is about to.
    pub fn busy(&self) -> bool {
        !matches!(self.state(), None | Some(State::Ready | State::NotHomed | State::Alarm))
    }

    /// Writes into the log.
    fn note(&mut self, wall_ms: f64, event: Noted) {
        Arc::make_mut(&mut self.log).add(wall_ms, event);
    }
}

/// Takes one event in.
pub(super) fn update(model: &mut Model, event: LinkEvent) -> Vec<Effect> {
    match event {
        LinkEvent::Begun { token, kept, had_control } => begun(model, token, kept, had_control),
        LinkEvent::Paired { session } => paired(model, session),
        LinkEvent::Retry { number } if number == model.link.tries => connect(model),
        LinkEvent::Retry { .. } => Vec::new(),
        LinkEvent::ReconnectNow => {
            model.link.attempt = 0;
            connect(model)
        }
        LinkEvent::Heard { tell } => heard::heard(model, tell),
        LinkEvent::Closed => closed(model),
        LinkEvent::NotSent => {
            stop::broke(&mut model.link);
            Vec::new()
        }
        LinkEvent::Tick => tick(model),
        LinkEvent::Ask { wish } => {
            // Why the wish before was refused has been read, or does not matter any more.
            model.link.refused = None;
            ask(model, &wish)
        }
        LinkEvent::Stop => stop::pressed(model),
        LinkEvent::StopBeside => stop::beside(model),
        LinkEvent::StopHeardBeside => {
            stop::heard_beside(&mut model.link);
            Vec::new()
        }
        LinkEvent::StopLooked => {
            stop::look(model);
            Vec::new()
        }
        LinkEvent::Escape => stop::escape(model),
        LinkEvent::Pause => stop::pause(model),
        LinkEvent::Hand(event) => hand::update(model, event),
        LinkEvent::Renew { hidden } => jog::renew(model, hidden),
        LinkEvent::Close { notice } => {
            close(&mut model.link, notice);
            Vec::new()
        }
        LinkEvent::Forget => {
            let effects = ask(model, &Ask::ForgetInterrupted);
            model.link.interrupted = None;
            effects
        }
        LinkEvent::ClearLog => {
            Arc::make_mut(&mut model.link.log).clear();
            Vec::new()
        }
        LinkEvent::Controller(event) => controller::update(model, event),
    }
}

fn close(link: &mut Link, notice: Notice) {
    match notice {
        Notice::Refused => link.refused = None,
        Notice::Ousted => link.ousted = None,
        Notice::Ended => link.ended = None,
        Notice::OtherFirmware => link.other_firmware = None,
        Notice::Stop => link.stop_unconfirmed = false,
    }
}

/// Pairs if the address says so, else takes up the session of this tab; then connects and keeps connected.
fn begun(model: &mut Model, token: Option<String>, kept: Option<Paired>, had: bool) -> Vec<Effect> {
    model.link.claim = Claim { had };
    match (token, kept) {
        (Some(token), _) => {
            model.link.phase = LinkPhase::Connecting;
            vec![Effect::Pair { token }]
        }
        (None, Some(kept)) => paired(model, Some(kept)),
        (None, None) if model.link.controller.chosen => connect(model),
        (None, None) => Vec::new(),
    }
}

fn paired(model: &mut Model, session: Option<Paired>) -> Vec<Effect> {
    let none = session.is_none();
    model.link.session = session;
    if none && !model.link.controller.chosen {
        model.link.phase = LinkPhase::Unpaired;
        return Vec::new();
    }
    connect(model)
}

fn connect(model: &mut Model) -> Vec<Effect> {
    let link = &mut model.link;
    if link.phase == LinkPhase::Open {
        return Vec::new();
    }
    if link.phase == LinkPhase::Unpaired {
        link.phase = LinkPhase::Connecting;
    }
    link.unknown = false;
    link.tries = link.tries.wrapping_add(1);
    vec![if link.controller.chosen { Effect::ConnectController } else { Effect::Connect }]
}

/// Asks the bridge for something; without a socket nothing happens (STOP is kept by its own file).
pub(super) fn ask(model: &mut Model, wish: &Ask) -> Vec<Effect> {
    let Ok(text) = serde_json::to_string(wish) else { return Vec::new() };
    let said = !matches!(wish, Ask::Hello { .. } | Ask::Ping { .. } | Ask::JogOn);
    let name = text.split('"').nth(3).filter(|_| said).map(str::to_owned);
    let mut effects = vec![Effect::Send { text }];
    match wish {
        Ask::ReleaseControl => {
            model.link.released = true;
            effects.extend(claim(&mut model.link, Claim::default()));
        }
        Ask::TakeControl { .. } => model.link.released = false,
        _ => {}
    }
    if let Some(name) = name {
        model.link.note(model.clock.wall_ms, Noted::Asked(name));
    }
    effects
}

/// Keeps the claim, over a reload too.
fn claim(link: &mut Link, now: Claim) -> Option<Effect> {
    (std::mem::replace(&mut link.claim, now) != now).then_some(Effect::KeepControl { had: now.had })
}

/// The socket is gone. Whoever has control from now on, it is not this connection.
fn closed(model: &mut Model) -> Vec<Effect> {
    let link = &mut model.link;
    let was_open = link.phase == LinkPhase::Open;
    stop::broke(link);
    link.control = Control::default();
    if was_open {
        link.note(model.clock.wall_ms, Noted::Link { open: false });
    }
    if link.unknown {
        link.session = None;
        link.phase = LinkPhase::Unpaired;
        return vec![Effect::ForgetSession];
    }
    link.phase = if was_open || link.ever { LinkPhase::Lost } else { LinkPhase::Connecting };
    let after_ms = health::retry_ms(link.attempt);
    link.attempt = link.attempt.saturating_add(1);
    link.tries = link.tries.wrapping_add(1);
    let again = LinkEvent::Retry { number: link.tries };
    vec![Effect::Wake { after_ms, event: Box::new(again.into()) }]
}

fn ping_if_due(model: &mut Model) -> Vec<Effect> {
    let now = model.clock.page_ms;
    if model.link.phase != LinkPhase::Open || now - model.link.pinged_ms < PING_EVERY_MS {
        return Vec::new();
    }
    model.link.pinged_ms = now;
    ask(model, &Ask::Ping { stamp: now })
}

fn tick(model: &mut Model) -> Vec<Effect> {
    let effects = ping_if_due(model);
    if model.link.ever {
        model.link.freshness = health::freshness(model.clock.page_ms - model.link.heard_ms);
    }
    effects
}
