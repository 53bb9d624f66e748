//! Runs the model's effects: workers, timers, files, socket, store. Results come back as events.
//!
//! ```text
//! update ─▶ Effect ─▶ worker │ timer │ socket │ download │ store ─▶ Event ─▶ update
//! ```

mod awake;
mod camera;
mod drawings;
mod drill;
mod files;
mod follow;
mod from_elsewhere;
mod jobs;
mod last_stop;
mod limits;
mod locks;
mod preferences;
mod presses;
mod serial;
mod session;
mod site;
mod socket;
mod store;

use crate::browser;
use crate::engine::messages::Request;
use crate::engine::{Engine, PassingEngine};
use crate::model::{Clocks, Effect, Event, LabEvent, Lane, LinkEvent, PlayEvent};
use crate::page::{Surroundings, send};
use crate::widgets::save_bytes;
use awake::Awake;
use camera::Camera;
use drawings::Drawings;
use follow::Followed;
use last_stop::Beside;
use leptos::prelude::{request_animation_frame, set_timeout};
use socket::Line;
use std::cell::RefCell;
use std::time::Duration;
use store::Places;

#[derive(Default)]
struct Running {
    workers: Workers,
    line: Line,
    places: Places,
    drawings: Drawings,
    awake: Awake,
    camera: Camera,
    followed: Followed,
    beside: Beside,
}

/// Builds what [`crate::page::begin`] needs.
pub fn surroundings() -> Surroundings {
    let mut running = Running::default();
    // With a bridge every page has its own link, so STOP need not go through another tab.
    if site::alone() {
        running.beside = Beside::listening();
    }
    running.line.serial.listen();
    running.awake.listen();
    running.followed.listen();
    files::listen(running.followed.clone());
    let clock = || Clocks { page_ms: browser::now_ms(), wall_ms: browser::clock_ms() };
    Surroundings { run: Box::new(move |effect| run(&running, effect)), clock }
}

/// Starts everything that sends events without an effect. Called once, after the page was created.
pub fn begin() {
    store::listen();
    site::begin();
    from_elsewhere::begin(site::alone());
    preferences::begin();
    presses::begin();
    camera::begin();
    if let Some(text) = session::kept_bench() {
        send(LabEvent::Kept { text });
    }
    serial::begin();
    socket::begin();
}

fn pair(token: String) {
    leptos::task::spawn_local(async move {
        send(LinkEvent::Paired { session: session::pair(token).await });
    });
}

fn run(running: &Running, effect: Effect) {
    let Running { workers, line, places, drawings, awake, camera, followed, beside } = running;
    match effect {
        Effect::Ask { lane, number, request } => workers.ask(lane, number, *request),
        Effect::CallOff { lane } => workers.call_off(lane),
        Effect::Wake { after_ms, event } => {
            set_timeout(move || send(*event), Duration::from_millis(u64::from(after_ms)));
        }
        Effect::Save { name, kind, bytes } => save_bytes(&name, kind, &bytes),
        Effect::Frame => request_animation_frame(|| send(PlayEvent::Frame)),
        Effect::Pair { token } => pair(token),
        Effect::Connect => line.connect(),
        Effect::ChoosePort => line.serial.choose(),
        Effect::ConnectController => line.connect_controller(),
        Effect::LeavePort => line.leave_port(),
        Effect::KeepController { on } => session::keep_controller(on),
        Effect::KeepBoard { greeting } => session::keep_board(&greeting),
        Effect::Guard { on } => line.serial.guard(on),
        Effect::HoldPort => line.serial.hold(),
        Effect::Send { text } => line.send(&text),
        Effect::StopBeside { heard } => beside.tell(heard),
        Effect::KeepControl { had } => session::keep_control(had),
        Effect::KeepBench { text } => session::keep_bench(&text),
        Effect::ForgetSession => session::forget(),
        Effect::Renew { on } => line.renew(on),
        Effect::Upload { number, bytes, session } => line.upload(number, bytes, session),
        Effect::Fetch { number, key, session } => line.fetch(number, key, session),
        Effect::ChooseFiles { anew } => files::choose(anew, followed),
        Effect::ChooseDialect => files::choose_dialect(),
        Effect::FollowLink { address } => from_elsewhere::put_in(address),
        Effect::Sample => files::sample(),
        Effect::Speak { language } => preferences::speak(language),
        Effect::Colours { word } => preferences::show_colours(word),
        Effect::KeepSigns { on } => preferences::keep_signs(on),
        Effect::KeepOwnKeys { text } => preferences::keep_own_keys(&text),
        Effect::KeepPanels { text } => preferences::keep_panels(&text),
        Effect::KeepMachines { text } => preferences::keep_machines(&text),
        Effect::StayAwake { on } => awake.want(on),
        Effect::Camera { on } => camera.want(on),
        Effect::KeepCamera { offset_mm } => camera::keep(offset_mm),
        Effect::LookInStore => places.look(),
        Effect::WriteStore { place, name, job, files, at_ms } => places.write(place, name, job, files, at_ms),
        Effect::LeaveInStore { place, job, at_ms } => store::leave(place, &job, at_ms),
        Effect::LeaveDrawing { place, text, at_ms } => drawings::leave(place, &text, at_ms),
        Effect::LetGoOfPlace { place } => places.let_go(place),
        Effect::TakeFromStore { place, is_free } => places.take(place, is_free),
        Effect::LookForDrawings { own } => drawings.look(own),
        Effect::KeepDrawing { of, place, name, text, at_ms } => drawings.keep(of, place, name, text, at_ms),
        Effect::TakeDrawing { place } => drawings.take(place),
        Effect::DropDrawing { place } => drawings.forget(place),
        Effect::OwnDrawing { place } => drawings.own(place),
        Effect::DrawExample => drawings::example(),
        Effect::TakeUpdate => site::take_update(),
        Effect::DropFromStore { place } => places.forget(place),
    }
}

/// The workers: one holds the board, one checks templates, and one exists per further request. The one that
/// computes the times of a plan also ends with its answer, because the times of a large board need much
/// memory.
#[derive(Default)]
struct Workers {
    board: Engine,
    times: RefCell<PassingEngine>,
    template: Engine,
}

impl Workers {
    fn there(&self, lane: Lane) -> Option<Engine> {
        match lane {
            Lane::Board => Some(self.board.clone()),
            Lane::Template => Some(self.template.clone()),
            Lane::Times => self.times.borrow().there(),
            Lane::Beside => None,
        }
    }

    /// Sends a request; its answer arrives as an event.
    fn ask(&self, lane: Lane, number: u32, request: Request) {
        let engine = match lane {
            Lane::Board | Lane::Template => self.there(lane).unwrap_or_default(),
            Lane::Times | Lane::Beside => Engine::new(),
        };
        if lane == Lane::Times {
            self.times.replace(engine.passing());
        }
        // Sent before any await, so that a later cancel applies to it.
        let answer = engine.ask(request, move |share| send(Event::Progress { number, share }));
        leptos::task::spawn_local(async move {
            let answer = answer.await;
            drop(engine);
            send(Event::Answered { number, answer });
        });
    }

    fn call_off(&self, lane: Lane) {
        if let Some(engine) = self.there(lane) {
            engine.cancel();
        }
    }
}
