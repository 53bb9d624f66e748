//! The line to the bridge as signals, and the wishes of the screens.
//!
//! Goes out: signals to be read, events. Does not know the socket.

use super::slots::Slots;
use super::{send, signals as all};
pub use crate::health::{Freshness, Ousted};
use crate::lab::log::Log;
pub use crate::model::link::{
    Armed, Contacts, Control, Controller, Hand, Interrupted, JobEnded, LinkPhase, MachineQueue, Notice,
};
use crate::model::start::Preflight;
use crate::model::{Eye, Job, LinkEvent, PlannedMap, SettingsDraft, SoughtHole, TouchOff};
use annulus_core::align::BoardFit;
use annulus_core::control::{State, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Value;
use annulus_core::wire::{
    Ask, CheckModeReport, HeightMapReport, MagazineReport, OtherFirmware, Outputs, Status, ToolsReport,
};
use leptos::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Everything the bridge said, each part a signal. Copies are the same line.
#[derive(Clone, Copy)]
pub struct Link {
    /// How far the connection is.
    pub phase: ReadSignal<LinkPhase>,
    /// Whether a machine was connected since the page was opened.
    pub ever: ReadSignal<bool>,
    /// How things stand.
    pub status: ReadSignal<Option<Arc<Status>>>,
    /// How old that is.
    pub freshness: ReadSignal<Freshness>,
    /// Who may move the machine.
    pub control: ReadSignal<Control>,
    /// The machine's settings.
    pub settings: ReadSignal<Arc<Vec<(String, Value)>>>,
    /// What was typed of them and is not applied.
    pub draft: ReadSignal<SettingsDraft>,
    /// The last verdict on a job.
    pub armed: ReadSignal<Option<Armed>>,
    /// What a controller has read of a job in its check mode.
    pub checked: ReadSignal<Option<Arc<CheckModeReport>>>,
    /// A job to be taken up.
    pub interrupted: ReadSignal<Option<Interrupted>>,
    /// How the last one ended.
    pub ended: ReadSignal<Option<JobEnded>>,
    /// What the bridge's clock is worth; none where the drill is virtual.
    pub timing: ReadSignal<Option<Arc<Timing>>>,
    /// The faults that were provoked; none on a machine that has none on demand.
    pub faults: ReadSignal<Option<Vec<String>>>,
    /// Why the last wish was refused.
    pub refused: ReadSignal<Option<Diagnostic>>,
    /// Why this page lost control.
    pub ousted: ReadSignal<Option<Ousted>>,
    /// The adapter's firmware is another one, and nobody closed that it is.
    pub other_firmware: ReadSignal<Option<OtherFirmware>>,
    /// There and back, ms.
    pub delay_ms: ReadSignal<Option<f64>>,
    /// STOP was pressed and nobody said that it was heard.
    pub stop_unconfirmed: ReadSignal<bool>,
    /// What happened so far.
    pub log: ReadSignal<Arc<Log>>,
    /// The queue of work commands that the machine has.
    pub queue: ReadSignal<MachineQueue>,
    /// The outputs and their lock.
    pub outputs: ReadSignal<Outputs>,
    /// What became of the tools of the rack.
    pub tools: ReadSignal<ToolsReport>,
    /// What is known of the surface of the board on a controller.
    pub height_map: ReadSignal<Arc<HeightMapReport>>,
    /// What lies in the magazine; none on a machine without one.
    pub magazine: ReadSignal<Option<Arc<MagazineReport>>>,
    /// Where strokes ended on their sensor.
    pub contacts: ReadSignal<Arc<Contacts>>,
    /// The dialog of the height map is open.
    pub levels: ReadSignal<bool>,
    /// How far apart the board would be touched, mm.
    pub spacing_mm: ReadSignal<u8>,
    /// Where it would be touched now, or why not.
    pub planned_map: ReadSignal<Option<Result<PlannedMap, Diagnostic>>>,
    /// Touching off.
    pub touch_off: ReadSignal<TouchOff>,
    /// The second side: its holes, the one that is sought, the fit.
    pub sought: ReadSignal<Vec<SoughtHole>>,
    /// Which of them is sought.
    pub aimed: ReadSignal<usize>,
    /// How the board lies, or why that cannot be told.
    pub board_fit: ReadSignal<Option<Result<BoardFit, Diagnostic>>>,
    /// The job goes along.
    pub goes_along: ReadSignal<bool>,
    /// Holes were found whose places count no more.
    pub holes_forgotten: ReadSignal<bool>,
    /// The camera.
    pub eye: ReadSignal<Eye>,
    /// What its crosshair sees, from the spindle, mm.
    pub camera_mm: ReadSignal<Option<[f64; 2]>>,
    /// Where the tip made a dot, machine mm.
    pub dot_mm: ReadSignal<Option<[f64; 2]>>,
    /// The job the machine has, where that is another one than was planned.
    pub fetched: ReadSignal<Option<Arc<Job>>>,
    /// The job that the Machine screen shows.
    pub shown_job: ReadSignal<Option<Arc<Job>>>,
    /// The pre-flight on show.
    pub preflight: ReadSignal<Option<Preflight>>,
    /// Warnings of it that were ticked, by code.
    pub ticked: ReadSignal<BTreeSet<String>>,
    /// The pad that moves by hand.
    pub hand: ReadSignal<Hand>,
    /// The controller at a port of this computer, where the page has one.
    pub controller: ReadSignal<Controller>,
}

/// The line.
pub fn link() -> Link {
    all().link
}

pub(super) fn signals(slots: &mut Slots) -> Link {
    Link {
        phase: slots.part(|model| &model.link.phase),
        ever: slots.part(|model| &model.link.ever),
        status: slots.handle(|model| &model.link.status),
        freshness: slots.part(|model| &model.link.freshness),
        control: slots.part(|model| &model.link.control),
        settings: slots.kept(|model| &model.link.settings),
        faults: slots.part(|model| &model.link.faults),
        draft: slots.part(|model| &model.settings),
        armed: slots.part(|model| &model.link.armed),
        checked: slots.handle(|model| &model.link.checked),
        interrupted: slots.part(|model| &model.link.interrupted),
        ended: slots.part(|model| &model.link.ended),
        timing: slots.handle(|model| &model.link.timing),
        refused: slots.part(|model| &model.link.refused),
        ousted: slots.part(|model| &model.link.ousted),
        other_firmware: slots.part(|model| &model.link.other_firmware),
        delay_ms: slots.part(|model| &model.link.delay_ms),
        stop_unconfirmed: slots.part(|model| &model.link.stop_unconfirmed),
        log: slots.kept(|model| &model.link.log),
        queue: slots.part(|model| &model.link.queue),
        outputs: slots.part(|model| &model.link.outputs),
        tools: slots.part(|model| &model.link.tools),
        height_map: slots.kept(|model| &model.link.height_map),
        magazine: slots.handle(|model| &model.link.magazine),
        contacts: slots.kept(|model| &model.link.contacts),
        levels: slots.part(|model| &model.level.open),
        spacing_mm: slots.part(|model| &model.level.spacing_mm),
        planned_map: slots.part(|model| &model.level.planned),
        touch_off: slots.part(|model| &model.touch_off),
        sought: slots.part(|model| &model.second_side.holes),
        aimed: slots.part(|model| &model.second_side.aimed),
        board_fit: slots.part(|model| &model.second_side.fit),
        goes_along: slots.part(|model| &model.second_side.applied),
        holes_forgotten: slots.part(|model| &model.second_side.forgotten),
        eye: slots.part(|model| &model.second_side.eye),
        camera_mm: slots.part(|model| &model.second_side.offset_mm),
        dot_mm: slots.part(|model| &model.second_side.dot_mm),
        fetched: slots.handle(|model| &model.start.fetched),
        shown_job: slots.handle(|model| &model.start.shown),
        preflight: slots.part(|model| &model.start.preflight),
        ticked: slots.part(|model| &model.start.ticked),
        hand: slots.part(|model| &model.link.hand),
        controller: slots.part(|model| &model.link.controller),
    }
}

/// Asks the bridge for something.
pub fn ask(wish: Ask) {
    send(LinkEvent::Ask { wish });
}

/// Stops the machine.
pub fn stop() {
    send(LinkEvent::Stop);
}

impl Link {
    /// What the machine is doing, if one is there.
    pub fn state(self) -> Option<State> {
        self.status.with(|status| status.as_ref().map(|status| status.state))
    }

    /// Whether anything moves or is about to.
    pub fn busy(self) -> bool {
        !matches!(self.state(), None | Some(State::Ready | State::NotHomed | State::Alarm))
    }

    /// Whether this page may ask for motion now.
    pub fn may_act(self) -> bool {
        self.phase.get() == LinkPhase::Open
            && self.control.get().yours
            && self.freshness.get() == Freshness::Fresh
    }

    /// Whether homing tells the machine where it is; a mill without switches knows it from a zero that a person sets.
    pub fn homes(self) -> bool {
        self.controller.with(|controller| controller.who.as_ref().is_none_or(|who| who.homes()))
    }
}
