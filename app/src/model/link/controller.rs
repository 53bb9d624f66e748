//! A GRBL-family controller or a USB step adapter at a serial port. The page drives it itself, or the bridge
//! drives the controller.
//!
//! ```text
//! bridge or virtual drill ── click, port dialog ──▶ chosen ─▶ ConnectController ─▶ same link, same messages
//!                         ◀───── disconnect ──────
//! ```

use super::{Link, LinkPhase, closed, connect};
use crate::model::{Effect, Model, second_side};
use annulus_core::code;
use annulus_core::control::State;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::{ControllerReport, Status};
use std::sync::Arc;

/// Whether the browser offers Web Serial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Support {
    #[default]
    Unknown,
    Yes,
    Missing,
    Insecure,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Controller {
    pub support: Support,
    /// The user has granted this page a port before, so no dialog is needed.
    pub known: bool,
    /// The page talks to a serial port instead of the bridge or its virtual drill.
    pub chosen: bool,
    /// A USB step adapter: the page plans the motion, as for the virtual drill.
    pub is_adapter: bool,
    pub who: Option<Arc<ControllerReport>>,
    guarded: bool,
    /// The port is exactly the one that the user chose, not only one like it.
    very: bool,
    before: Option<String>,
    /// The disturbed line was already reported since the port was opened.
    disturbed: bool,
}

impl Controller {
    /// True for a controller that plans its own motion, at this page's port or at the bridge's.
    pub fn plans(&self) -> bool {
        if self.chosen { !self.is_adapter } else { self.who.is_some() }
    }

    /// True during a manual tool change of our own drill: Park returns to where tools are changed.
    pub fn parks_in_change(&self, status: Option<&Status>) -> bool {
        let is_manual = |status: &Status| status.state == State::ToolChange && status.change.is_some();
        !self.plans() && status.is_some_and(is_manual)
    }

    /// True if the controller waits for a touch-off. Our own drills know their tool lengths and do not wait.
    pub fn touches_off(&self, state: Option<State>) -> bool {
        self.plans() && state == Some(State::ToolChange)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum ControllerEvent {
    /// The page was opened; sent before the link starts.
    Looked {
        support: Support,
        kept: bool,
        before: Option<String>,
    },
    /// Whether the user has granted this page any port.
    Known {
        any: bool,
    },
    Wanted {
        /// Show the port dialog; else use the known port.
        ask: bool,
    },
    Chosen,
    Opened {
        /// A USB step adapter, recognized by its USB identifiers.
        adapter: bool,
        /// The port is exactly the one that the user chose, not only one like it.
        very: bool,
    },
    /// Several ports match the earlier one, and the browser cannot distinguish them.
    Several,
    /// Received data was disturbed, but the port is still open.
    Disturbed {
        /// The browser's name of the error.
        kind: String,
        times: u32,
    },
    /// The port could not be chosen or opened, or nothing answers.
    Failed {
        why: Diagnostic,
    },
    /// Nothing answers at this baud rate: try the next one.
    OtherSpeed,
    Plugged,
    LetGo,
    /// The page is closing; the browser's confirmation is over.
    PageLeft,
}

pub(super) fn update(model: &mut Model, event: ControllerEvent) -> Vec<Effect> {
    let busy = model.link.busy();
    let controller = &mut model.link.controller;
    match event {
        ControllerEvent::Looked { support, kept, before } => {
            (controller.support, controller.chosen) = (support, kept && support == Support::Yes);
            controller.before = before;
            Vec::new()
        }
        ControllerEvent::Known { any } => {
            controller.known = any;
            Vec::new()
        }
        ControllerEvent::Wanted { .. } if controller.support != Support::Yes || busy => Vec::new(),
        ControllerEvent::Wanted { ask: true } => vec![Effect::ChoosePort],
        ControllerEvent::Wanted { ask: false } | ControllerEvent::Chosen => turn_to(model, true),
        ControllerEvent::Opened { adapter, very } => {
            (controller.is_adapter, controller.very, controller.disturbed) = (adapter, very, false);
            Vec::new()
        }
        ControllerEvent::Several if controller.chosen => is_to_choose(model, code!("serial.several")),
        ControllerEvent::Several => Vec::new(),
        ControllerEvent::Disturbed { kind, times } => {
            disturbed(&mut model.link, &kind, times);
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
            // The worker accepted our hello, so the phase was Open although no controller answered the
            // worker.
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
        // No hold for an adapter, which stops when its data ends, or for a bridge, which continues the job.
        ControllerEvent::PageLeft if controller.chosen && controller.plans() && busy => {
            vec![Effect::HoldPort]
        }
        ControllerEvent::PageLeft => Vec::new(),
    }
}

/// The controller identified itself. On a port of this page that the user did not choose, only the known
/// controller is accepted. The bridge's port needs no check: its command line names it.
pub(super) fn greeted(model: &mut Model, who: ControllerReport) -> Vec<Effect> {
    let controller = &mut model.link.controller;
    if !controller.chosen {
        controller.who = Some(Arc::new(who));
        return Vec::new();
    }
    let greeting = format!("{} {} {:?}", who.flavour, who.version, who.values);
    let is_other = controller.before.as_ref().is_some_and(|before| *before != greeting);
    if is_other && !controller.very {
        return is_to_choose(model, code!("serial.other_board"));
    }
    controller.who = Some(Arc::new(who));
    if controller.before.as_ref() == Some(&greeting) {
        return Vec::new();
    }
    controller.before = Some(greeting.clone());
    vec![Effect::KeepBoard { greeting }]
}

/// Only the user can decide which controller is meant: disconnect and show why.
fn is_to_choose(model: &mut Model, code: &str) -> Vec<Effect> {
    let effects = turn_to(model, false);
    model.link.refused = Some(Diagnostic::error(code));
    effects
}

/// Reports a disturbed line once, and updates the count while the notice is open. At a wrong baud rate all
/// data is disturbed, so nothing is reported before a controller has answered.
fn disturbed(link: &mut Link, kind: &str, times: u32) {
    const CODE: &str = code!("serial.disturbed");
    let is_there = link.controller.who.is_some() || link.controller.is_adapter;
    let is_read = link.refused.as_ref().is_some_and(|why| why.code == CODE);
    if is_there && (is_read || !std::mem::replace(&mut link.controller.disturbed, true)) {
        link.refused = Some(Diagnostic::warning(CODE).with("kind", kind).with("times", times));
    }
}

/// Switches between controller and bridge: everything known about the machine before is dropped.
fn turn_to(model: &mut Model, chosen: bool) -> Vec<Effect> {
    let before = std::mem::take(&mut model.link);
    let known = before.controller.known || chosen;
    let controller = Controller { chosen, known, is_adapter: false, who: None, ..before.controller };
    let phase = if chosen || before.session.is_some() { LinkPhase::Connecting } else { LinkPhase::Unpaired };
    let (session, log) = (before.session, before.log);
    model.link = Link { phase, session, log, controller, ..Link::default() };
    model.start.preflight = None;
    second_side::forget(&mut model.second_side);
    let mut effects = vec![Effect::KeepController { on: chosen }];
    if !chosen {
        effects.push(Effect::LeavePort);
    }
    if phase == LinkPhase::Connecting {
        effects.extend(connect(model));
    }
    effects
}

/// The browser asks before the page is left if leaving stops a job or loses a project or drawing that cannot
/// be saved.
pub(in crate::model) fn follow(model: &mut Model) -> Vec<Effect> {
    let unkept = model.keeping.failed.is_some() && model.board.document.is_some();
    let drawing = model.draw.unkept() && !model.draw.editor.drawing().is_empty();
    let link = &model.link;
    let has_job = link.status.as_ref().is_some_and(|status| status.job.is_some());
    // Without a bridge the virtual drill runs in this page; a bridge continues without the page.
    let drills = link.controller.chosen || model.frame.alone && has_job;
    let on = unkept || drawing || drills && link.busy();
    let changed = std::mem::replace(&mut model.link.controller.guarded, on) != on;
    Vec::from_iter(changed.then_some(Effect::Guard { on }))
}
