//! A controller of the GRBL family, or a USB step adapter, at a port of this computer, which the page drives itself: what the browser
//! can, whether this page chose one, who it is.
//!
//! ```text
//! bridge or virtual drill ── a click, the browser's dialog ──▶ chosen ─▶ ConnectController ─▶ the same line, the same messages
//!                         ◀─────────────── let go ────────────
//! ```
//!
//! Comes in: wishes, what the browser says. Goes out: effects. Does not know ports.

use super::{Link, LinkPhase, closed, connect};
use crate::model::{Effect, Model, second_side};
use annulus_core::control::State;
use annulus_core::diagnostic::Diagnostic;
use std::sync::Arc;

/// Whether the browser lets a page use serial ports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Support {
    /// It was not asked yet.
    #[default]
    Unknown,
    /// It does.
    Yes,
    /// It does not have that at all.
    Missing,
    /// Not on a page that came over an open line.
    Insecure,
}

/// Who the controller is.
#[derive(Clone, Debug, PartialEq)]
pub struct Who {
    /// `GRBL`, `grblHAL` or `FluidNC`.
    pub flavour: String,
    /// Its version.
    pub version: String,
    /// Its numbered settings.
    pub values: Vec<(u16, f64)>,
    /// The mill that a person said it is.
    pub mill: Option<String>,
}

/// The controller, as far as the page has one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Controller {
    /// Whether the browser can.
    pub support: Support,
    /// A person let this page use a port before: no dialog is needed.
    pub known: bool,
    /// This page speaks with a controller, in place of the bridge or of its own virtual drill.
    pub chosen: bool,
    /// What is there is a USB step adapter: it plays what the page planned, as the virtual drill does.
    pub is_adapter: bool,
    /// Who it is, once it said so.
    pub who: Option<Arc<Who>>,
    /// The browser asks before the page is left.
    guarded: bool,
}

impl Controller {
    /// Whether there is one that plans its own motion.
    pub fn plans(&self) -> bool {
        self.chosen && !self.is_adapter
    }

    /// Whether a tool may be touched off by hand now: it waits for that, unlike a drill that knows the heights of its bits.
    pub fn touches_off(&self, state: Option<State>) -> bool {
        self.plans() && state == Some(State::ToolChange)
    }
}

/// What happens about it.
#[derive(Clone, Debug, PartialEq)]
pub enum ControllerEvent {
    /// The page was opened; told before the line begins.
    Looked {
        /// Whether the browser can.
        support: Support,
        /// This tab had a controller when it was loaded last, and did not let go of it.
        kept: bool,
    },
    /// Which ports a person let this page use is known.
    Known {
        /// There is one.
        any: bool,
    },
    /// A controller is wanted.
    Wanted {
        /// One that the person is to choose; else the one that is known.
        ask: bool,
    },
    /// The person chose a port.
    Chosen,
    /// The port is open.
    Opened {
        /// A USB step adapter is there, by its number.
        adapter: bool,
    },
    /// The port could not be chosen or opened, or nobody answers.
    Failed {
        /// Why.
        why: Diagnostic,
    },
    /// Nobody answers at this speed; the next is to be tried.
    OtherSpeed,
    /// A device that is known was plugged in.
    Plugged,
    /// The person has done with it.
    LetGo,
    /// The page is being left, whatever the person was asked.
    PageLeft,
}

/// Takes one event in.
pub(super) fn update(model: &mut Model, event: ControllerEvent) -> Vec<Effect> {
    let busy = model.link.busy();
    let controller = &mut model.link.controller;
    match event {
        ControllerEvent::Looked { support, kept } => {
            (controller.support, controller.chosen) = (support, kept && support == Support::Yes);
            Vec::new()
        }
        ControllerEvent::Known { any } => {
            controller.known = any;
            Vec::new()
        }
        ControllerEvent::Wanted { .. } if controller.support != Support::Yes || busy => Vec::new(),
        ControllerEvent::Wanted { ask: true } => vec![Effect::ChoosePort],
        ControllerEvent::Wanted { ask: false } | ControllerEvent::Chosen => turn_to(model, true),
        ControllerEvent::Opened { adapter } => {
            controller.is_adapter = adapter;
            Vec::new()
        }
        ControllerEvent::Failed { why } if controller.chosen => {
            model.link.refused = Some(why);
            closed(model)
        }
        ControllerEvent::Failed { why } => {
            model.link.refused = Some(why);
            Vec::new()
        }
        ControllerEvent::OtherSpeed if controller.chosen => {
            // The worker took the page's hello; nobody was there behind it.
            model.link.phase = LinkPhase::Connecting;
            connect(model)
        }
        ControllerEvent::Plugged if controller.chosen => {
            model.link.attempt = 0;
            connect(model)
        }
        ControllerEvent::OtherSpeed => Vec::new(),
        ControllerEvent::Plugged => {
            controller.known = true;
            Vec::new()
        }
        ControllerEvent::LetGo if controller.chosen && !busy => turn_to(model, false),
        ControllerEvent::LetGo => Vec::new(),
        // An adapter comes to rest by itself.
        ControllerEvent::PageLeft if controller.plans() && busy => vec![Effect::HoldPort],
        ControllerEvent::PageLeft => Vec::new(),
    }
}

/// The machine of the page is another one from now on: what was told of the one before is forgotten.
fn turn_to(model: &mut Model, chosen: bool) -> Vec<Effect> {
    let before = std::mem::take(&mut model.link);
    let known = before.controller.known || chosen;
    let controller = Controller { chosen, known, is_adapter: false, who: None, ..before.controller };
    let phase = if chosen || before.session.is_some() { LinkPhase::Connecting } else { LinkPhase::Unpaired };
    let (session, log) = (before.session, before.log);
    model.link = Link { phase, session, log, controller, ..Link::default() };
    model.start.preflight = None;
    let mut effects = vec![Effect::KeepController { on: chosen }];
    if !chosen {
        effects.push(Effect::LeavePort);
    }
    if phase == LinkPhase::Connecting {
        effects.extend(connect(model));
    }
    effects
}

/// While the page feeds a job to a controller, or the open project cannot be kept, the browser asks before it is left.
pub(in crate::model) fn follow(model: &mut Model) -> Option<Effect> {
    let unkept = model.keeping.failed.is_some() && model.board.document.is_some();
    let on = unkept || model.link.controller.chosen && model.link.busy();
    let changed = std::mem::replace(&mut model.link.controller.guarded, on) != on;
    changed.then_some(Effect::Guard { on })
}
    second_side::forget(&mut model.second_side);
