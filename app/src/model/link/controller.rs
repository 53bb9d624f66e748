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
use annulus_core::controller::{ResetOnOpen, ToolLengths};
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
    /// How the length of a tool is found there.
    pub lengths: ToolLengths,
    /// What opening its port may do to the board.
    pub reset_on_open: ResetOnOpen,
    /// The lines by which it changes tools itself; none where a person does.
    pub changer: Vec<String>,
}

impl Who {
    /// Whether homing tells it where it is: by `$22`.
    pub fn homes(&self) -> bool {
        self.values.iter().any(|(number, value)| *number == 22 && *value != 0.0)
    }
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
    /// The port is the very one that the person chose.
    very: bool,
    /// How the board greeted that this tab had last.
    before: Option<String>,
    /// That its line is disturbed was said since the port was opened.
    disturbed: bool,
}

impl Who {
    /// What a board says of itself, by which it is known again.
    fn greeting(&self) -> String {
        format!("{} {} {:?}", self.flavour, self.version, self.values)
    }
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
        /// How the board greeted that it had last.
        before: Option<String>,
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
        /// It is the very port that the person chose, and not only one like it.
        very: bool,
    },
    /// Which of several ports is the one of before the browser does not say.
    Several,
    /// What came over the line was disturbed, and the port is open all the same.
    Disturbed {
        /// What the browser calls it.
        kind: String,
        /// How often that was since the port was opened.
        times: u32,
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
        ControllerEvent::Several if controller.chosen => is_to_choose(model, "serial.several"),
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

/// A board said who it is. Behind another port than the one that the person chose only the board of before is spoken with.
pub(super) fn greeted(model: &mut Model, who: Who) -> Vec<Effect> {
    let (controller, greeting) = (&mut model.link.controller, who.greeting());
    let is_other = controller.before.as_ref().is_some_and(|before| *before != greeting);
    if is_other && !controller.very {
        return is_to_choose(model, "serial.other_board");
    }
    controller.who = Some(Arc::new(who));
    if controller.before.as_ref() == Some(&greeting) {
        return Vec::new();
    }
    controller.before = Some(greeting.clone());
    vec![Effect::KeepBoard { greeting }]
}

/// Which board it is to be only the person can say.
fn is_to_choose(model: &mut Model, code: &str) -> Vec<Effect> {
    let effects = turn_to(model, false);
    model.link.refused = Some(Diagnostic::error(code));
    effects
}

/// Says once that the line is disturbed, and counts while that is read. At a wrong speed a line is nothing but disturbance: nothing is
/// said before somebody is there.
fn disturbed(link: &mut Link, kind: &str, times: u32) {
    const CODE: &str = "serial.disturbed";
    let is_there = link.controller.who.is_some() || link.controller.is_adapter;
    let is_read = link.refused.as_ref().is_some_and(|why| why.code == CODE);
    if is_there && (is_read || !std::mem::replace(&mut link.controller.disturbed, true)) {
        link.refused = Some(Diagnostic::warning(CODE).with("kind", kind).with("times", times));
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

/// While the page feeds a job to a controller, or drills one itself, or the open project or the drawing cannot be kept, the browser asks
/// before it is left.
pub(in crate::model) fn follow(model: &mut Model) -> Option<Effect> {
    let unkept = model.keeping.failed.is_some() && model.board.document.is_some();
    let drawing = model.draw.unkept() && !model.draw.editor.drawing().is_empty();
    let link = &model.link;
    let has_job = link.status.as_ref().is_some_and(|status| status.job.is_some());
    // Without a bridge the virtual drill lives in the page; a bridge goes on without it.
    let drills = link.controller.chosen || model.frame.alone && has_job;
    let on = unkept || drawing || drills && link.busy();
    let changed = std::mem::replace(&mut model.link.controller.guarded, on) != on;
    changed.then_some(Effect::Guard { on })
}
