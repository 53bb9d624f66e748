//! The line to a machine of this page, virtual drill or controller: a worker in the place of the socket.
//!
//! Comes in: text and programs to send. Goes out: what is heard, as events, and what is meant for a port. Does not know what it means.

use super::last_stop;
use crate::browser::window;
use crate::engine::{drill, worker};
use crate::model::{FrameEvent, LinkEvent, StartEvent};
use crate::page;
use crate::said::{Text, key};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::program;
use js_sys::{Array, Uint8Array};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{ErrorEvent, MessageEvent, UrlSearchParams, Worker};

/// How many times faster than life it runs, in the address.
const SPEED: &str = "speed";

/// Programs on their way: whether they are brought, and their key.
type Coming = Rc<RefCell<BTreeMap<u32, (bool, String)>>>;

/// What the worker says that is not for the page.
pub(super) enum ForPort {
    /// These bytes are to be written.
    Bytes(Uint8Array),
    /// Nobody answers there.
    Silent,
}

/// One worker with the closures it calls; dropping them together keeps a late message of an ended worker silent.
pub(super) struct Drill {
    worker: Worker,
    coming: Coming,
    _message: Closure<dyn FnMut(MessageEvent)>,
    _error: Closure<dyn FnMut(ErrorEvent)>,
}

impl Drop for Drill {
    fn drop(&mut self) {
        self.worker.set_onmessage(None);
        self.worker.set_onerror(None);
        self.worker.terminate();
        for (number, (brought, key)) in std::mem::take(&mut *self.coming.borrow_mut()) {
            answer(number, brought, key, Err(Diagnostic::error(key!("page.link.no_answer"))));
        }
    }
}

fn speed() -> f64 {
    let search = window().location().search().unwrap_or_default();
    let asked = UrlSearchParams::new_with_str(&search).ok().and_then(|search| search.get(SPEED));
    asked.and_then(|speed| speed.parse().ok()).unwrap_or(1.0)
}

/// A worker that is the machine of this name, and begins when it is told to.
pub(super) fn hire(name: &str, port: impl Fn(ForPort) + 'static) -> Option<Drill> {
    let worker = worker::hire(name).ok()?;
    let coming = Coming::default();
    let (answered, own) = (Rc::clone(&coming), worker.clone());
    let message = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        let Some(for_port) = hear(&answered, &event.data()) else { return };
        let is_carried = matches!(for_port, ForPort::Bytes(_));
        port(for_port);
        if is_carried {
            let _ = own.post_message(&false.into());
        }
    });
    let error = Closure::<dyn FnMut(ErrorEvent)>::new(|event: ErrorEvent| {
        event.prevent_default();
        page::send(LinkEvent::Closed);
    });
    worker.set_onmessage(Some(message.as_ref().unchecked_ref()));
    worker.set_onerror(Some(error.as_ref().unchecked_ref()));
    Some(Drill { worker, coming, _message: message, _error: error })
}

/// Has the machine begin.
pub(super) fn begin(worker: &Worker) -> bool {
    worker.post_message(&speed().into()).is_ok()
}

/// Has the machine of the adapter at the port begin, or says that it is there again.
pub(super) fn begin_adapter(worker: &Worker) -> bool {
    worker.post_message(&true.into()).is_ok()
}

/// A worker that has the virtual drill.
pub(super) fn open() -> Option<Drill> {
    let drill = hire(drill::VIRTUAL, |_| ())?;
    last_stop::is(&drill.worker, "postMessage", &last_stop::word());
    begin(&drill.worker).then_some(drill)
}

fn hear(coming: &Coming, data: &JsValue) -> Option<ForPort> {
    if let Some(text) = data.as_string() {
        let tell = serde_json::from_str(&text).ok().map(Box::new);
        page::send(LinkEvent::Heard { tell });
    } else if data.is_null() {
        page::send(LinkEvent::Closed);
    } else if data.is_instance_of::<Uint8Array>() {
        return Some(ForPort::Bytes(data.clone().unchecked_into()));
    } else if data.as_bool() == Some(false) {
        return Some(ForPort::Silent);
    } else if let Some(told) = data.dyn_ref::<Array>() {
        answered(coming, told);
    } else {
        page::send(FrameEvent::Say { text: Text::of(key!("page.alone.nothing_kept")) });
    }
    None
}

/// A program was brought, or came.
fn answered(coming: &Coming, told: &Array) {
    let number = told.get(0).as_f64().unwrap_or_default() as u32;
    let Some((brought, key)) = coming.borrow_mut().remove(&number) else { return };
    let why = told.get(1).as_string().and_then(|why| serde_json::from_str::<Diagnostic>(&why).ok());
    let bytes = || told.get(2).dyn_into::<Uint8Array>().map(|bytes| bytes.to_vec()).unwrap_or_default();
    answer(number, brought, key, why.map_or_else(|| Ok(bytes()), Err));
}

fn answer(number: u32, brought: bool, key: String, bytes: Result<Vec<u8>, Diagnostic>) {
    if brought {
        page::send(StartEvent::Uploaded { number, answer: bytes.map(|_| key) });
    } else {
        page::send(StartEvent::Fetched { number, answer: bytes });
    }
}

impl Drill {
    /// The worker itself.
    pub(super) fn worker(&self) -> &Worker {
        &self.worker
    }

    /// Sends a frame.
    pub(super) fn send(&self, text: &str) -> bool {
        self.worker.post_message(&text.into()).is_ok()
    }

    /// Brings a program; its key is told.
    pub(super) fn upload(&self, number: u32, bytes: &[u8]) {
        let key = program::key(bytes);
        let message = Array::of3(&number.into(), &key.as_str().into(), &Uint8Array::from(bytes));
        self.ask(number, true, key, &message);
    }

    /// Tells the bytes of a program.
    pub(super) fn fetch(&self, number: u32, key: String) {
        let message = Array::of2(&number.into(), &key.as_str().into());
        self.ask(number, false, key, &message);
    }

    fn ask(&self, number: u32, brought: bool, key: String, message: &Array) {
        self.coming.borrow_mut().insert(number, (brought, key));
        let _ = self.worker.post_message(message);
    }
}
