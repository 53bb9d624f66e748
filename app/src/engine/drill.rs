//! The machine of a page that has no bridge behind it, in a worker of its own, which gives it the time: the virtual drill, or what is
//! at a port whose bytes the page carries: a controller, or a USB step adapter.
//!
//! ```text
//! page ── speed, frames, programs, bytes ──▶ worker ── Alone or Station ──▶ files of this site
//!      ◀── frames, answers, bytes ──────────    └─ a turn every 8 ms while something moves
//! ```
//!
//! Comes in: what the page posts: first the speed, or `true` where an adapter is at the port; then frames as text, `[number, key]` and
//! `[number, key, bytes]` for programs, bytes of the port, `false` when bytes for it were handed to it, `null` when it is gone, `true` when it is there again. Goes out: bytes for the port; frames as text; `[number, reason, bytes]` for programs; `true`
//! where nothing is kept, `false` where nobody answers at the port, `null` when it is over. Does not know what a frame says.

use super::files::{self, Store};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::Tell;
use annulus_drill::controller::Station;
use annulus_drill::{Alone, File, Port};
use js_sys::{Array, Uint8Array};
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::spawn_local;
use web_sys::{DedicatedWorkerGlobalScope, MessageEvent};

/// The name of the worker that is the virtual drill.
pub const VIRTUAL: &str = "annulus drill";

/// The name of the worker that attends what is at a port.
pub const CONTROLLER: &str = "annulus controller";

/// Longest time between two turns.
const LONGEST_MS: u128 = 1_000;

/// The machine.
enum Served {
    Virtual(Box<Alone<Store>>),
    Controller(Box<Station<Store>>),
    Adapter(Box<Alone<Store>>, Port),
}

/// What the page has begin.
#[derive(Clone, Copy)]
enum Wanted {
    /// What the worker's name says, so many times faster than life.
    Named(f64),
    /// The machine of the adapter at the port.
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

/// The machine, once it is there, and what came before.
struct Room {
    scope: DedicatedWorkerGlobalScope,
    served: Option<Served>,
    early: Vec<JsValue>,
    turns: Option<Closure<dyn FnMut()>>,
    timer: Option<i32>,
}

type Shared = Rc<RefCell<Room>>;

fn scope() -> Option<DedicatedWorkerGlobalScope> {
    js_sys::global().dyn_into().ok()
}

/// The time since the worker began.
fn time() -> Duration {
    let now_ms =
        scope().and_then(|scope| scope.performance()).map_or_else(js_sys::Date::now, |clock| clock.now());
    Duration::from_secs_f64(now_ms.max(0.0) * 1e-3)
}

/// Whether this worker is to be a machine.
pub fn is_here() -> bool {
    scope().is_some_and(|scope| [VIRTUAL, CONTROLLER].contains(&scope.name().as_str()))
}

/// Begins to listen. Called once, when the wasm is started in the worker of a machine.
pub fn serve() {
    let Some(scope) = scope() else { return };
    std::panic::set_hook(Box::new(|panic| {
        web_sys::console::error_1(&panic.to_string().into());
        // What the journal has is safe; the page begins another worker.
        post(&JsValue::NULL);
    }));
    let room = Room { scope: scope.clone(), served: None, early: Vec::new(), turns: None, timer: None };
    let room = Rc::new(RefCell::new(room));
    let again = Rc::clone(&room);
    room.borrow_mut().turns = Some(Closure::new(move || turn(&again)));
    let listener = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        let data = event.data();
        let adapter = data.as_bool().filter(|adapter| *adapter && room.borrow().served.is_none());
        match data.as_f64().map(Wanted::Named).or(adapter.map(|_| Wanted::Adapter)) {
            Some(wanted) => spawn_local(begin(Rc::clone(&room), wanted)),
            None => hear(&room, data),
        }
    });
    scope.set_onmessage(Some(listener.as_ref().unchecked_ref()));
    listener.forget();
}

fn post(message: &JsValue) {
    if let Some(scope) = scope() {
        let _ = scope.post_message(message);
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
        post(&true.into());
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
            let mut station = Station::open(store, speed, time)?;
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
            early.into_iter().for_each(|data| hear(&room, data));
            turn(&room);
        }
        Err(why) => {
            post(&serde_json::to_string(&Tell::Refused { why }).unwrap_or_default().into());
            post(&JsValue::NULL);
        }
    }
}

/// Takes what the page posted.
fn hear(room: &Shared, data: JsValue) {
    {
        let mut room = room.borrow_mut();
        let Some(served) = &mut room.served else { return room.early.push(data) };
        match (data.as_string(), served) {
            (Some(text), served) => served.hear(&text),
            (None, Served::Controller(station)) if data.as_bool() == Some(false) => station.carried(),
            // An adapter says itself what it has.
            (None, _) if data.as_bool() == Some(false) => return,
            (None, Served::Controller(station)) if data.is_null() => station.unplugged(),
            (None, Served::Controller(station)) if data.is_instance_of::<Uint8Array>() => {
                station.bytes(Uint8Array::new(&data).to_vec());
            }
            (None, Served::Adapter(_, port)) if data.is_null() => port.gone(),
            (None, Served::Adapter(_, port)) if data.is_truthy() && data.as_bool().is_some() => port.opened(),
            (None, Served::Adapter(_, port)) if data.is_instance_of::<Uint8Array>() => {
                port.bytes(&Uint8Array::new(&data).to_vec());
            }
            (None, served) => program(served, &data.unchecked_into()),
        }
    }
    turn(room);
}

/// Brings a program, or gives one back.
fn program(served: &mut Served, asked: &Array) {
    let key = asked.get(1).as_string().unwrap_or_default();
    let answer = if asked.length() == 3 {
        served.upload(&key, Uint8Array::new(&asked.get(2)).to_vec()).map(|()| JsValue::NULL)
    } else {
        let bytes = served.job(&key).map(|bytes| Uint8Array::from(bytes).into());
        bytes.ok_or_else(|| Diagnostic::error("control.no_such_job"))
    };
    let why = answer
        .as_ref()
        .err()
        .map_or(JsValue::NULL, |why| serde_json::to_string(why).unwrap_or_default().into());
    post(&Array::of3(&asked.get(0), &why, &answer.unwrap_or(JsValue::NULL)));
}

/// One turn, and a time for the next. What goes to the port goes first.
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
        post(&Uint8Array::from(bytes.as_slice()));
    }
    if let Served::Controller(station) = served {
        over = station.is_over().then(|| if station.greeted() { JsValue::NULL } else { false.into() });
    }
    for frame in served.frames() {
        post(&frame.into());
    }
    if let Some(why) = over {
        post(&why);
        // What comes from now on goes nowhere: the page ends this worker.
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
