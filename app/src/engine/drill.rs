//! The virtual drill of a page that has no bridge: in a worker of its own, which gives it the time.
//!
//! ```text
//! page ── speed, frames, programs ──▶ worker ── Alone ──▶ files of this site
//!      ◀── frames, answers ──────────    └─ a turn every 8 ms while something moves
//! ```
//!
//! Comes in: what the page posts: first the speed, then frames as text, and `[number, key]`, `[number, key, bytes]` for programs.
//! Goes out: frames as text; `[number, reason, bytes]` for programs; `true` where nothing is kept, `null` when it is over. Does not
//! know what a frame says.

use super::files::{self, Store};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::Tell;
use annulus_drill::Alone;
use js_sys::{Array, Uint8Array};
use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::spawn_local;
use web_sys::{DedicatedWorkerGlobalScope, MessageEvent};

/// The name of the worker.
pub const NAME: &str = "annulus drill";

/// Longest time between two turns.
const LONGEST_MS: u128 = 1_000;

/// The drill, once it is there, and what came before.
struct Room {
    scope: DedicatedWorkerGlobalScope,
    drill: Option<Alone<Store>>,
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

/// Whether this worker is to be the drill.
pub fn is_here() -> bool {
    scope().is_some_and(|scope| scope.name() == NAME)
}

/// Begins to listen. Called once, when the wasm is started in the worker of the drill.
pub fn serve() {
    let Some(scope) = scope() else { return };
    std::panic::set_hook(Box::new(|panic| {
        web_sys::console::error_1(&panic.to_string().into());
        // What the journal has is safe; the page begins another worker.
        post(&JsValue::NULL);
    }));
    let room = Room { scope: scope.clone(), drill: None, early: Vec::new(), turns: None, timer: None };
    let room = Rc::new(RefCell::new(room));
    let again = Rc::clone(&room);
    room.borrow_mut().turns = Some(Closure::new(move || turn(&again)));
    let listener = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        let data = event.data();
        if let Some(speed) = data.as_f64() {
            spawn_local(begin(Rc::clone(&room), speed));
        } else {
            hear(&room, data);
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

async fn begin(room: Shared, speed: f64) {
    let scope = room.borrow().scope.clone();
    let opened = files::open(&scope).await.and_then(|store| {
        if matches!(store, Store::Memory(_)) {
            post(&true.into());
        }
        Alone::open(store, speed, js_sys::Date::now() as u64, time)
    });
    match opened {
        Ok(mut drill) => {
            drill.connect();
            let early = {
                let mut room = room.borrow_mut();
                room.drill = Some(drill);
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
        let Some(drill) = &mut room.drill else { return room.early.push(data) };
        match data.as_string() {
            Some(text) => drill.hear(&text),
            None => program(drill, &data.unchecked_into()),
        }
    }
    turn(room);
}

/// Brings a program, or gives one back.
fn program(drill: &mut Alone<Store>, asked: &Array) {
    let key = asked.get(1).as_string().unwrap_or_default();
    let answer = if asked.length() == 3 {
        drill.upload(&key, Uint8Array::new(&asked.get(2)).to_vec()).map(|()| JsValue::NULL)
    } else {
        let bytes = drill.job(&key).map(|bytes| Uint8Array::from(bytes).into());
        bytes.ok_or_else(|| Diagnostic::error("control.no_such_job"))
    };
    let why = answer
        .as_ref()
        .err()
        .map_or(JsValue::NULL, |why| serde_json::to_string(why).unwrap_or_default().into());
    post(&Array::of3(&asked.get(0), &why, &answer.unwrap_or(JsValue::NULL)));
}

/// One turn, and a time for the next.
fn turn(room: &Shared) {
    let mut room = room.borrow_mut();
    let Some(drill) = &mut room.drill else { return };
    let next = drill.advance();
    for frame in drill.frames() {
        post(&frame.into());
    }
    let Room { scope, turns: Some(turns), timer, .. } = &mut *room else { return };
    if let Some(timer) = timer.take() {
        scope.clear_timeout_with_handle(timer);
    }
    let next_ms = i32::try_from(next.as_millis().min(LONGEST_MS)).unwrap_or_default();
    let turns = turns.as_ref().unchecked_ref();
    *timer = scope.set_timeout_with_callback_and_timeout_and_arguments_0(turns, next_ms).ok();
}
