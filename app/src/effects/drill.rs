//! The link to a machine of this page, virtual drill or controller: a worker in place of the socket.

use super::last_stop;
use crate::browser::window;
use crate::engine::messages::{FromDrill, ToDrill};
use crate::engine::{drill, worker};
use crate::model::{FrameEvent, LinkEvent, StartEvent};
use crate::page;
use crate::said::{Text, key};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::program;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{ErrorEvent, MessageEvent, UrlSearchParams, Worker};

const SPEED: &str = "speed";

/// Programs in transfer: whether it is an upload, and the key.
type Coming = Rc<RefCell<BTreeMap<u32, (bool, String)>>>;

pub(super) enum ForPort {
    Bytes(Vec<u8>),
    Silent,
}

/// A worker with its callbacks. Dropping both together silences late messages of a terminated worker.
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

/// Starts the worker for the machine `name`; the machine starts with [`begin`] or [`begin_adapter`].
pub(super) fn hire(name: &str, port: impl Fn(ForPort) + 'static) -> Option<Drill> {
    let worker = worker::hire(name).ok()?;
    let coming = Coming::default();
    let (answered, own) = (Rc::clone(&coming), worker.clone());
    let message = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        let Some(for_port) = drill::told(&event.data()).and_then(|told| hear(&answered, told)) else {
            return;
        };
        let is_carried = matches!(for_port, ForPort::Bytes(_));
        port(for_port);
        // Acknowledged, because the worker notices by the delay that this page was suspended.
        if is_carried {
            drill::tell(&own, &ToDrill::Carried);
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

pub(super) fn begin(worker: &Worker) -> bool {
    drill::tell(worker, &ToDrill::Start { speed: speed() })
}

/// Starts the machine of the adapter at the port, or reports that the adapter was plugged in again.
pub(super) fn begin_adapter(worker: &Worker) -> bool {
    drill::tell(worker, &ToDrill::AdapterOpened)
}

pub(super) fn open() -> Option<Drill> {
    let drill = hire(drill::VIRTUAL, |_| ())?;
    let stop = drill::encoded(&ToDrill::Frame(last_stop::word()));
    last_stop::is(&drill.worker, "postMessage", &stop);
    begin(&drill.worker).then_some(drill)
}

fn hear(coming: &Coming, told: FromDrill) -> Option<ForPort> {
    match told {
        FromDrill::Frame(text) => {
            page::send(LinkEvent::Heard { tell: serde_json::from_str(&text).ok().map(Box::new) });
        }
        FromDrill::Bytes(bytes) => return Some(ForPort::Bytes(bytes)),
        FromDrill::Silent => return Some(ForPort::Silent),
        FromDrill::Lost => page::send(LinkEvent::Closed),
        FromDrill::NothingKept => {
            page::send(FrameEvent::Say { text: Text::of(key!("page.alone.nothing_kept")) });
        }
        FromDrill::Program { number, answer: bytes } => {
            let asked = coming.borrow_mut().remove(&number);
            if let Some((brought, key)) = asked {
                answer(number, brought, key, bytes);
            }
        }
    }
    None
}

fn answer(number: u32, brought: bool, key: String, bytes: Result<Vec<u8>, Diagnostic>) {
    if brought {
        page::send(StartEvent::Uploaded { number, answer: bytes.map(|_| key) });
    } else {
        page::send(StartEvent::Fetched { number, answer: bytes });
    }
}

impl Drill {
    pub(super) fn worker(&self) -> &Worker {
        &self.worker
    }

    pub(super) fn send(&self, text: &str) -> bool {
        drill::tell(&self.worker, &ToDrill::Frame(text.to_owned()))
    }

    pub(super) fn upload(&self, number: u32, bytes: Vec<u8>) {
        let key = program::key(&bytes);
        self.coming.borrow_mut().insert(number, (true, key.clone()));
        drill::tell(&self.worker, &ToDrill::Upload { number, key, program: bytes });
    }

    pub(super) fn fetch(&self, number: u32, key: String) {
        self.coming.borrow_mut().insert(number, (false, key.clone()));
        drill::tell(&self.worker, &ToDrill::Fetch { number, key });
    }
}
