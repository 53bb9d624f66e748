//! The worker that drives the machine of a page without a bridge. The machine is the virtual drill, or a
//! controller or USB step adapter at a port whose bytes the page carries.
//!
//! ```text
//! page ── speed, frames, programs, bytes ──▶ worker ── Alone or PageStation ──▶ files of this site
//!      ◀── frames, answers, bytes ──────────    └─ a turn every 8 ms while something moves
//! ```

use super::files::{self, Store};
use super::messages::{FromDrill, ToDrill};
use super::worker;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::wire::Tell;
use annulus_host::grbl::PageStation;
use annulus_host::{Alone, File, Port};
use js_sys::Uint8Array;
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::spawn_local;
use web_sys::{DedicatedWorkerGlobalScope, MessageEvent, Worker};

pub const VIRTUAL: &str = "annulus drill";

pub const CONTROLLER: &str = "annulus controller";

const LONGEST_MS: u128 = 1_000;

enum Served {
    Virtual(Box<Alone<Store>>),
    Controller(Box<PageStation<Store>>),
    Adapter(Box<Alone<Store>>, Port),
}

#[derive(Clone, Copy)]
enum Wanted {
    /// The machine of the worker's name, with this time scale.
    Named(f64),
    Adapter,
}

impl Served {
    fn hear(&mut self, text: &str) {
        match self {
            Self::Virtual(drill) | Self::Adapter(drill, _) => drill.hear(text),
            Self::Controller(station) => station.hear(text),
        }
    }

    fn frames(&mut self) -> Vec<String> {
        match self {
            Self::Virtual(drill) | Self::Adapter(drill, _) => drill.frames(),
            Self::Controller(station) => station.frames(),
        }
    }

    fn upload(&mut self, key: &str, bytes: Vec<u8>) -> Result<(), Diagnostic> {
        match self {
            Self::Virtual(drill) | Self::Adapter(drill, _) => drill.upload(key, bytes),
            Self::Controller(station) => station.upload(key, bytes),
        }
    }

    fn job(&self, key: &str) -> Option<&[u8]> {
        match self {
            Self::Virtual(drill) | Self::Adapter(drill, _) => drill.job(key),
            Self::Controller(station) => station.job(key),
        }
    }

    fn advance(&mut self) -> Duration {
        match self {
            Self::Virtual(drill) | Self::Adapter(drill, _) => drill.advance(),
            Self::Controller(station) => station.advance(),
        }
    }
}

/// The machine, once it is started, and the messages that arrived before.
struct Room {
    scope: DedicatedWorkerGlobalScope,
    served: Option<Served>,
    early: Vec<ToDrill>,
    turns: Option<Closure<dyn FnMut()>>,
    timer: Option<i32>,
}

type Shared = Rc<RefCell<Room>>;

fn scope() -> Option<DedicatedWorkerGlobalScope> {
    js_sys::global().dyn_into().ok()
}

fn time() -> Duration {
    let now_ms =
        scope().and_then(|scope| scope.performance()).map_or_else(js_sys::Date::now, |clock| clock.now());
    Duration::from_secs_f64(now_ms.max(0.0) * 1e-3)
}

pub fn is_here() -> bool {
    scope().is_some_and(|scope| [VIRTUAL, CONTROLLER].contains(&scope.name().as_str()))
}

/// Starts to listen. Called once, when the wasm starts in the worker of a machine.
pub fn serve() {
    let Some(scope) = scope() else { return };
    std::panic::set_hook(Box::new(|panic| {
        web_sys::console::error_1(&panic.to_string().into());
        // The journal is safe; the page starts another worker.
        post(&FromDrill::Lost);
    }));
    let room = Room { scope: scope.clone(), served: None, early: Vec::new(), turns: None, timer: None };
    let room = Rc::new(RefCell::new(room));
    let again = Rc::clone(&room);
    room.borrow_mut().turns = Some(Closure::new(move || turn(&again)));
    let listener = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        let bytes = Uint8Array::new(&event.data()).to_vec();
        let Ok(message) = postcard::from_bytes(&bytes) else { return };
        match message {
            ToDrill::Start { speed } => spawn_local(begin(Rc::clone(&room), Wanted::Named(speed))),
            ToDrill::AdapterOpened if room.borrow().served.is_none() => {
                spawn_local(begin(Rc::clone(&room), Wanted::Adapter));
            }
            message => hear(&room, message),
        }
    });
    scope.set_onmessage(Some(listener.as_ref().unchecked_ref()));
    listener.forget();
}

/// A message as bytes, to send later.
pub fn encoded(message: &ToDrill) -> Uint8Array {
    Uint8Array::from(postcard::to_allocvec(message).unwrap_or_default().as_slice())
}

/// Sends a message to the worker of a machine; false if that failed.
pub fn tell(worker: &Worker, message: &ToDrill) -> bool {
    let send =
        |bytes: Vec<u8>| worker::send(|data, moved| worker.post_message_with_transfer(data, moved), &bytes);
    postcard::to_allocvec(message).is_ok_and(|bytes| send(bytes).is_ok())
}

pub fn told(data: &JsValue) -> Option<FromDrill> {
    postcard::from_bytes(&Uint8Array::new(data).to_vec()).ok()
}

fn post(message: &FromDrill) {
    if let (Some(scope), Ok(bytes)) = (scope(), postcard::to_allocvec(message)) {
        let _ = worker::send(|data, moved| scope.post_message_with_transfer(data, moved), &bytes);
    }
}

async fn open(scope: &DedicatedWorkerGlobalScope, wanted: Wanted) -> Result<Served, Diagnostic> {
    let controls = scope.name() == CONTROLLER;
    let names: &[File] = if controls { &File::CONTROLLER } else { &File::DRILL };
    let store = match wanted {
        Wanted::Named(_) => files::open(scope, files::DRILL, names).await?,
        Wanted::Adapter => files::open(scope, files::ADAPTER, &File::DRILL).await?,
    };
    if matches!(store, Store::Memory(_)) {
        post(&FromDrill::NothingKept);
    }
    let seed = js_sys::Date::now() as u64;
    Ok(match wanted {
        Wanted::Adapter => {
            let port = Port::default();
            port.opened();
            let mut drill = Alone::at_port(store, port.clone(), seed, time)?;
            drill.connect();
            Served::Adapter(Box::new(drill), port)
        }
        Wanted::Named(speed) if controls => {
            let mut station = PageStation::open(store, speed, time)?;
            station.connect();
            Served::Controller(Box::new(station))
        }
        Wanted::Named(speed) => {
            let mut drill = Alone::open(store, speed, seed, time)?;
            drill.connect();
            Served::Virtual(Box::new(drill))
        }
    })
}

async fn begin(room: Shared, wanted: Wanted) {
    let scope = room.borrow().scope.clone();
    match open(&scope, wanted).await {
        Ok(served) => {
            let early = {
                let mut room = room.borrow_mut();
                room.served = Some(served);
                std::mem::take(&mut room.early)
            };
            early.into_iter().for_each(|message| hear(&room, message));
            turn(&room);
        }
        Err(why) => {
            post(&FromDrill::Frame(serde_json::to_string(&Tell::Refused { why }).unwrap_or_default()));
            post(&FromDrill::Lost);
        }
    }
}

fn hear(room: &Shared, message: ToDrill) {
    {
        let mut room = room.borrow_mut();
        let Some(served) = &mut room.served else { return room.early.push(message) };
        match (message, served) {
            (ToDrill::Frame(text), served) => served.hear(&text),
            (ToDrill::Upload { number, key, program }, served) => {
                let answer = served.upload(&key, program).map(|()| Vec::new());
                post(&FromDrill::Program { number, answer });
            }
            (ToDrill::Fetch { number, key }, served) => {
                let program = served.job(&key).map(<[u8]>::to_vec);
                let answer = program.ok_or_else(|| error!("control.no_such_job"));
                post(&FromDrill::Program { number, answer });
            }
            (ToDrill::Bytes(bytes), Served::Controller(station)) => station.bytes(bytes),
            (ToDrill::Carried, Served::Controller(station)) => station.carried(),
            (ToDrill::Unplugged, Served::Controller(station)) => station.unplugged(),
            (ToDrill::Bytes(bytes), Served::Adapter(_, port)) => port.bytes(&bytes),
            (ToDrill::Unplugged, Served::Adapter(_, port)) => port.gone(),
            (ToDrill::AdapterOpened, Served::Adapter(_, port)) => port.opened(),
            // An adapter acknowledges bytes in its own protocol.
            (ToDrill::Carried, _) => return,
            (ToDrill::Start { .. } | ToDrill::AdapterOpened | ToDrill::Bytes(_) | ToDrill::Unplugged, _) => {}
        }
    }
    turn(room);
}

/// One turn, and the timer for the next. Bytes for the port are sent first.
fn turn(room: &Shared) {
    let mut room = room.borrow_mut();
    let Some(served) = &mut room.served else { return };
    let next = served.advance();
    let mut over = None;
    let bytes = match served {
        Served::Virtual(_) => Vec::new(),
        Served::Controller(station) => station.written(),
        Served::Adapter(_, port) => port.written(),
    };
    if !bytes.is_empty() {
        post(&FromDrill::Bytes(bytes));
    }
    if let Served::Controller(station) = served {
        let why = if station.greeted() { FromDrill::Lost } else { FromDrill::Silent };
        over = station.is_over().then_some(why);
    }
    for frame in served.frames() {
        post(&FromDrill::Frame(frame));
    }
    if let Some(why) = over {
        post(&why);
        // The page terminates this worker, so later messages are ignored.
        room.served = None;
        return;
    }
    let Room { scope, turns: Some(turns), timer, .. } = &mut *room else { return };
    if let Some(timer) = timer.take() {
        scope.clear_timeout_with_handle(timer);
    }
    let next_ms = i32::try_from(next.as_millis().min(LONGEST_MS)).unwrap_or_default();
    let turns = turns.as_ref().unchecked_ref();
    *timer = scope.set_timeout_with_callback_and_timeout_and_arguments_0(turns, next_ms).ok();
}
