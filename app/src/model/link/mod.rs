//! The link to the bridge, virtual drill or controller: its phase, the received state, control, and requests.
//!
//! ```text
//! Unpaired ─ token ─▶ Connecting ─ Hello accepted ─▶ Open ─ closed ─▶ Lost ─ retries, ever longer ─▶ Open
//! request ─▶ Effect::Send ─▶ bridge ─▶ LinkEvent::Heard ─▶ model    every 250 ms: ping, age, STOP confirmed?
//! ```

pub mod contacts;
pub mod controller;
pub mod drilled;
pub mod hand;
mod heard;
mod jog;
pub mod rest;
mod stop;
pub mod way_back;

use super::{Effect, Model};
use crate::health::{self, Claim, Freshness, Ousted, StopWay};
use crate::lab::log::{Log, LogEvent as Noted};
use annulus_core::control::{State, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Value;
use annulus_core::queue::RowResult;
use annulus_core::wire::{
    ArmedJob, Ask, CheckModeReport, Control, HeightMapReport, InterruptedJob, JobEnd, MagazineReport,
    OtherFirmware, Outputs, Paired, QueueStatus, Status, Tell, ToolsReport,
};
pub use contacts::Contacts;
pub use controller::{Controller, ControllerEvent, Support};
pub use hand::{Hand, HandEvent};
use jog::Jog;
use std::sync::Arc;

pub const TICK_MS: u32 = 250;
const PING_EVERY_MS: f64 = 800.0;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkPhase {
    /// No session: the page was not opened through the link that the bridge prints.
    #[default]
    Unpaired,
    Connecting,
    Open,
    /// Was open; the page tries to reconnect.
    Lost,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LastJob {
    pub end: JobEnd,
    pub by_you: bool,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct MachineQueue {
    /// Empty if there is no queue.
    pub text: String,
    /// The latest status, without results.
    pub status: QueueStatus,
    pub results: Vec<RowResult>,
}

#[derive(Clone, Debug, Default)]
pub struct Link {
    pub phase: LinkPhase,
    /// A machine has been connected since the page was opened.
    pub ever: bool,
    pub status: Option<Arc<Status>>,
    /// Age of the data.
    pub freshness: Freshness,
    pub control: Control,
    pub settings: Arc<Vec<(String, Value)>>,
    /// Injected faults; `None` if the machine cannot inject faults.
    pub faults: Option<Vec<String>>,
    pub fingerprint: String,
    pub armed: Option<ArmedJob>,
    /// Result of a job in the controller's check mode.
    pub checked: Option<Arc<CheckModeReport>>,
    pub interrupted: Option<InterruptedJob>,
    pub ended: Option<LastJob>,
    /// Timing quality of the bridge; `None` for a virtual drill.
    pub timing: Option<Arc<Timing>>,
    pub refused: Option<Diagnostic>,
    pub ousted: Option<Ousted>,
    /// The adapter's firmware has another version; `None` once the user closed the notice.
    pub other_firmware: Option<OtherFirmware>,
    /// Round trip of a ping, ms.
    pub delay_ms: Option<f64>,
    /// STOP was pressed and not confirmed in time.
    pub stop_unconfirmed: bool,
    pub log: Arc<Log>,
    pub queue: MachineQueue,
    /// The outputs and their lock.
    pub outputs: Outputs,
    /// Wear of the tools in the rack.
    pub tools: ToolsReport,
    /// The board's surface as a controller has probed it.
    pub height_map: Arc<HeightMapReport>,
    /// Contents of the magazine; `None` for a machine without one.
    pub magazine: Option<Arc<MagazineReport>>,
    /// Contact heights of the drill cycles of the running or last job.
    pub contacts: Arc<Contacts>,
    pub(super) session: Option<Paired>,
    /// Failed attempts since the link was open last.
    attempt: u32,
    /// Counts attempts, made or planned: a due retry runs only if no other attempt happened since.
    pub(in crate::model) tries: u32,
    heard_ms: f64,
    pinged_ms: f64,
    /// The bridge does not know this page's session.
    unknown: bool,
    claim: Claim,
    /// The latest of requesting and releasing control was releasing it.
    released: bool,
    stop: StopWay,
    pressed_ms: Option<f64>,
    escaped_ms: Option<f64>,
    pub hand: Hand,
    /// A controller at a serial port of this computer, which replaces the bridge.
    pub controller: Controller,
    jog: Jog,
}

#[derive(Clone, Debug, PartialEq)]
pub enum LinkEvent {
    Begun {
        token: Option<String>,
        /// This tab's session, if it survived a reload.
        kept: Option<Paired>,
        /// This tab had control before the reload and did not release it.
        had_control: bool,
    },
    Paired {
        session: Option<Paired>,
    },
    Retry {
        /// Value of `tries` when the attempt was planned; an outdated one is ignored.
        number: u32,
    },
    ReconnectNow,
    Heard {
        /// `None` if the message could not be read.
        tell: Option<Box<Tell>>,
    },
    Closed,
    /// A message could not be sent because the socket is not open.
    NotSent,
    Tick,
    Ask {
        wish: Ask,
    },
    Stop,
    StopBeside,
    /// The tab that owns the machine confirmed STOP.
    StopHeardBeside,
    StopLooked,
    /// Escape was pressed while no overlay was open.
    Escape,
    Pause,
    Hand(HandEvent),
    /// Send the next keep-alive of a jog.
    Renew {
        hidden: bool,
    },
    Close {
        notice: Notice,
    },
    Forget,
    ClearLog,
    Controller(ControllerEvent),
}

/// Notices that stay until the user closes them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    Refused,
    Ousted,
    Ended,
    OtherFirmware,
    Stop,
}

impl Link {
    /// The machine's state, if one is connected.
    pub fn state(&self) -> Option<State> {
        self.status.as_ref().map(|status| status.state)
    }

    /// True if the machine waits for the user to touch off a tool.
    pub fn touches_off(&self) -> bool {
        let changes = self.status.as_ref().is_some_and(|status| status.change.is_some());
        self.controller.touches_off(self.state()) || (changes && self.state() == Some(State::ToolChange))
    }

    pub fn busy(&self) -> bool {
        !matches!(self.state(), None | Some(State::Ready | State::NotHomed | State::Alarm))
    }

    /// True if this page may request motion.
    pub fn may_act(&self) -> bool {
        self.phase == LinkPhase::Open && self.control.yours && self.freshness == Freshness::Fresh
    }

    /// True if homing gives the machine its position; without limit switches, the work zero that the user
    /// sets does.
    pub fn homes(&self) -> bool {
        self.controller.who.as_ref().is_none_or(|who| who.homes())
    }

    fn note(&mut self, wall_ms: f64, event: Noted) {
        Arc::make_mut(&mut self.log).add(wall_ms, event);
    }
}

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
            // A new request replaces the refusal of the one before.
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

/// Pairs if the address has a token, else continues this tab's session.
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

/// Sends a request to the bridge. Without a socket it is dropped; only STOP is stored (see `stop`).
pub(super) fn ask(model: &mut Model, wish: &Ask) -> Vec<Effect> {
    let Ok(text) = serde_json::to_string(wish) else { return Vec::new() };
    // The log leaves out routine requests. The name is the value of the JSON's first field, `t`.
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

fn claim(link: &mut Link, now: Claim) -> Option<Effect> {
    (std::mem::replace(&mut link.claim, now) != now).then_some(Effect::KeepControl { had: now.had })
}

/// The socket is closed: this connection no longer has control.
fn closed(model: &mut Model) -> Vec<Effect> {
    let link = &mut model.link;
    let was_open = link.phase == LinkPhase::Open;
    stop::broke(link);
    link.control = Control::default();
    if was_open {
        link.note(model.clock.wall_ms, Noted::Link { open: false });
    }
    // A retry with a session that the bridge does not know is pointless.
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
