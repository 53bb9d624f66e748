//! The page's side of the worker: hands requests over, gives answers back to who asked, and starts a new worker when
//! the old one fell over or was sent away.
//!
//! ```text
//! page     read ──▶ ┌──────┐ ── Envelope ──▶ ┌────────┐
//!          plan ──▶ │ desk │                 │ worker │
//!  progress ◀────── │      │ ◀── Report ──── └────────┘
//!    answer ◀────── └──────┘      cancel, panic: worker ends, the next request starts another
//! ```
//!
//! Comes in: requests. Goes out: futures of answers. Does not know what is read or planned.

use super::Stopped;
use super::messages::{Answer, Envelope, Report, Request};
use crate::trusted;
use annulus_core::diagnostic::Diagnostic;
use futures_channel::oneshot;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{ErrorEvent, MessageEvent, Worker, WorkerOptions, WorkerType};

/// Address of the script that starts a worker.
const SCRIPT: &str = "worker.js";

struct Pending {
    answer: oneshot::Sender<Result<Answer, Stopped>>,
    progress: Box<dyn FnMut(f64)>,
}

struct Staff {
    worker: Worker,
    _on_message: Closure<dyn FnMut(MessageEvent)>,
    _on_error: Closure<dyn FnMut(ErrorEvent)>,
}

#[derive(Default)]
pub(super) struct Desk {
    staff: Option<Staff>,
    next: u32,
    pending: BTreeMap<u32, Pending>,
    /// What the worker said before it fell over.
    last_words: Option<String>,
}

/// Hands `request` over at once; its answer is to be waited for. `progress` is told shares from 0 to 1 meanwhile.
pub(super) fn ask(
    desk: &Rc<RefCell<Desk>>,
    request: Request,
    progress: Box<dyn FnMut(f64)>,
) -> impl Future<Output = Result<Answer, Stopped>> + use<> {
    let (answer, coming) = oneshot::channel();
    let handed = hand_over(desk, request, Pending { answer, progress });
    async move {
        if let Err(reason) = handed {
            let diagnostic = Diagnostic::error("engine.cannot_start").with("reason", reason);
            return Err(Stopped::Refused(vec![diagnostic]));
        }
        coming.await.unwrap_or(Err(Stopped::Cancelled))
    }
}

/// Ends whatever is in work; who waits for it is told that it was cancelled.
pub(super) fn cancel(desk: &Rc<RefCell<Desk>>) {
    let pending = {
        let mut desk = desk.borrow_mut();
        if let Some(staff) = desk.staff.take() {
            staff.worker.terminate();
        }
        std::mem::take(&mut desk.pending)
    };
    drop(pending);
}

fn hand_over(desk: &Rc<RefCell<Desk>>, request: Request, pending: Pending) -> Result<(), String> {
    let words = |error: JsValue| format!("{error:?}");
    if desk.borrow().staff.is_none() {
        let staff = hire(desk).map_err(words)?;
        desk.borrow_mut().staff = Some(staff);
    }
    let mut desk = desk.borrow_mut();
    desk.next += 1;
    let id = desk.next;
    let bytes = postcard::to_allocvec(&Envelope { id, request }).map_err(|error| error.to_string())?;
    desk.pending.insert(id, pending);
    let Some(staff) = &desk.staff else { return Err(String::new()) };
    send(|message, moved| staff.worker.post_message_with_transfer(message, moved), &bytes).map_err(words)
}

/// Posts bytes so that the other side gets them without a copy.
pub(super) fn send(
    post: impl FnOnce(&JsValue, &JsValue) -> Result<(), JsValue>,
    bytes: &[u8],
) -> Result<(), JsValue> {
    let buffer = js_sys::Uint8Array::from(bytes).buffer();
    post(&buffer, &js_sys::Array::of1(&buffer))
}

fn hire(desk: &Rc<RefCell<Desk>>) -> Result<Staff, JsValue> {
    let options = WorkerOptions::new();
    options.set_type(WorkerType::Module);
    options.set_name("annulus engine");
    let constructor: js_sys::Function =
        js_sys::Reflect::get(&js_sys::global(), &"Worker".into())?.dyn_into()?;
    let arguments = js_sys::Array::of2(&trusted::script_url(SCRIPT), &options);
    let worker: Worker = js_sys::Reflect::construct(&constructor, &arguments)?.unchecked_into();
    let mine = Rc::downgrade(desk);
    let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        if let Some(desk) = mine.upgrade() {
            hear(&desk, &event.data());
        }
    });
    let mine = Rc::downgrade(desk);
    let on_error = Closure::<dyn FnMut(ErrorEvent)>::new(move |event: ErrorEvent| {
        event.prevent_default();
        if let Some(desk) = mine.upgrade() {
            fell_over(&desk, &event.message());
        }
    });
    worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
    worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
    worker.post_message(&wasm_bindgen::module())?;
    Ok(Staff { worker, _on_message: on_message, _on_error: on_error })
}

fn hear(desk: &Rc<RefCell<Desk>>, data: &JsValue) {
    let bytes = js_sys::Uint8Array::new(data).to_vec();
    match postcard::from_bytes(&bytes) {
        Ok(Report::Progress { id, done, total }) => {
            tell_progress(desk, id, done as f64 / (total as f64).max(1.0));
        }
        Ok(Report::Done { id, answer }) => {
            let pending = desk.borrow_mut().pending.remove(&id);
            if let Some(pending) = pending {
                let _ = pending.answer.send(answer.map_err(Stopped::Refused));
            }
        }
        Ok(Report::Panicked(words)) => desk.borrow_mut().last_words = Some(words),
        Err(error) => fell_over(desk, &error.to_string()),
    }
}

/// The desk is not borrowed while the page is told, so that it may ask for something else.
fn tell_progress(desk: &Rc<RefCell<Desk>>, id: u32, share: f64) {
    let taken = desk
        .borrow_mut()
        .pending
        .get_mut(&id)
        .map(|pending| std::mem::replace(&mut pending.progress, Box::new(|_| {})));
    let Some(mut progress) = taken else { return };
    progress(share.clamp(0.0, 1.0));
    if let Some(pending) = desk.borrow_mut().pending.get_mut(&id) {
        pending.progress = progress;
    }
}

/// The worker is gone. Who waits is told why; the next request starts another.
fn fell_over(desk: &Rc<RefCell<Desk>>, reason: &str) {
    let (pending, words) = {
        let mut desk = desk.borrow_mut();
        if let Some(staff) = desk.staff.take() {
            staff.worker.terminate();
            // This runs inside the worker's own handler: it must live until that returns.
            wasm_bindgen_futures::spawn_local(async move { drop(staff) });
        }
        let words = desk.last_words.take().unwrap_or_else(|| reason.to_owned());
        (std::mem::take(&mut desk.pending), words)
    };
    for (_, pending) in pending {
        let diagnostic = Diagnostic::error("engine.fell_over").with("reason", &words);
        let _ = pending.answer.send(Err(Stopped::Refused(vec![diagnostic])));
    }
}

impl Drop for Desk {
    fn drop(&mut self) {
        if let Some(staff) = &self.staff {
            staff.worker.terminate();
        }
    }
}
