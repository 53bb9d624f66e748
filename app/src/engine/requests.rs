//! The page's side of a worker: sends requests, returns answers to their callers, and starts a new worker
//! after a crash or a cancel.
//!
//! ```text
//! page     read ──▶ ┌──────────┐ ── Envelope ──▶ ┌────────┐
//!          plan ──▶ │ requests │                 │ worker │
//!  progress ◀────── │          │ ◀── Report ──── └────────┘
//!    answer ◀────── └──────────┘      cancel, panic: worker ends, the next request starts another
//! ```

use super::messages::{Answer, Envelope, Request, WorkerReport};
use super::{Stopped, worker};
use annulus_core::error;
use futures_channel::oneshot;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{ErrorEvent, MessageEvent, Worker};

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
pub(super) struct Requests {
    staff: Option<Staff>,
    next: u32,
    pending: BTreeMap<u32, Pending>,
    last_words: Option<String>,
}

/// Sends `request` at once and returns a future of its answer. `progress` receives shares from 0 to 1.
pub(super) fn ask(
    requests: &Rc<RefCell<Requests>>,
    request: Request,
    progress: Box<dyn FnMut(f64)>,
) -> impl Future<Output = Result<Answer, Stopped>> + use<> {
    let (answer, coming) = oneshot::channel();
    let handed = hand_over(requests, request, Pending { answer, progress });
    async move {
        if let Err(reason) = handed {
            let diagnostic = error!("engine.cannot_start", reason = reason);
            return Err(Stopped::Refused(vec![diagnostic]));
        }
        coming.await.unwrap_or(Err(Stopped::Cancelled))
    }
}

/// Terminates the worker; all waiting requests are answered as cancelled.
pub(super) fn cancel(requests: &Rc<RefCell<Requests>>) {
    let pending = {
        let mut requests = requests.borrow_mut();
        if let Some(staff) = requests.staff.take() {
            staff.worker.terminate();
        }
        std::mem::take(&mut requests.pending)
    };
    drop(pending);
}

fn hand_over(requests: &Rc<RefCell<Requests>>, request: Request, pending: Pending) -> Result<(), String> {
    let words = |error: JsValue| format!("{error:?}");
    if requests.borrow().staff.is_none() {
        let staff = hire(requests).map_err(words)?;
        requests.borrow_mut().staff = Some(staff);
    }
    let mut requests = requests.borrow_mut();
    requests.next += 1;
    let id = requests.next;
    let bytes = postcard::to_allocvec(&Envelope { id, request }).map_err(|error| error.to_string())?;
    requests.pending.insert(id, pending);
    let Some(staff) = &requests.staff else { return Err(String::new()) };
    worker::send(|message, moved| staff.worker.post_message_with_transfer(message, moved), &bytes)
        .map_err(words)
}

fn hire(requests: &Rc<RefCell<Requests>>) -> Result<Staff, JsValue> {
    let worker = worker::hire("annulus engine")?;
    let mine = Rc::downgrade(requests);
    let on_message = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        if let Some(requests) = mine.upgrade() {
            hear(&requests, &event.data());
        }
    });
    let mine = Rc::downgrade(requests);
    let on_error = Closure::<dyn FnMut(ErrorEvent)>::new(move |event: ErrorEvent| {
        event.prevent_default();
        if let Some(requests) = mine.upgrade() {
            fell_over(&requests, &event.message());
        }
    });
    worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
    worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
    Ok(Staff { worker, _on_message: on_message, _on_error: on_error })
}

fn hear(requests: &Rc<RefCell<Requests>>, data: &JsValue) {
    let bytes = js_sys::Uint8Array::new(data).to_vec();
    match postcard::from_bytes(&bytes) {
        Ok(WorkerReport::Progress { id, done, total }) => {
            tell_progress(requests, id, done as f64 / (total as f64).max(1.0));
        }
        Ok(WorkerReport::Done { id, answer }) => {
            let pending = requests.borrow_mut().pending.remove(&id);
            if let Some(pending) = pending {
                let _ = pending.answer.send(answer.map_err(Stopped::Refused));
            }
        }
        Ok(WorkerReport::Panicked(words)) => requests.borrow_mut().last_words = Some(words),
        Err(error) => fell_over(requests, &error.to_string()),
    }
}

/// `requests` is not borrowed during the callback, so that it may send another request.
fn tell_progress(requests: &Rc<RefCell<Requests>>, id: u32, share: f64) {
    let taken = requests
        .borrow_mut()
        .pending
        .get_mut(&id)
        .map(|pending| std::mem::replace(&mut pending.progress, Box::new(|_| {})));
    let Some(mut progress) = taken else { return };
    progress(share.clamp(0.0, 1.0));
    if let Some(pending) = requests.borrow_mut().pending.get_mut(&id) {
        pending.progress = progress;
    }
}

/// The worker crashed: all waiting requests get the reason. The next request starts a new worker.
fn fell_over(requests: &Rc<RefCell<Requests>>, reason: &str) {
    let (pending, words) = {
        let mut requests = requests.borrow_mut();
        if let Some(staff) = requests.staff.take() {
            staff.worker.terminate();
            // This runs in the worker's own callback, which must live until it returns.
            wasm_bindgen_futures::spawn_local(async move { drop(staff) });
        }
        let words = requests.last_words.take().unwrap_or_else(|| reason.to_owned());
        (std::mem::take(&mut requests.pending), words)
    };
    for (_, pending) in pending {
        let diagnostic = error!("engine.fell_over", reason = &words);
        let _ = pending.answer.send(Err(Stopped::Refused(vec![diagnostic])));
    }
}

impl Drop for Requests {
    fn drop(&mut self) {
        if let Some(staff) = &self.staff {
            staff.worker.terminate();
        }
    }
}
