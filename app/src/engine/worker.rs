//! The worker's side: takes requests one after the other, does them, reports.
//!
//! Comes in: bytes of an [`Envelope`]. Goes out: bytes of [`Report`]s. Does not know the page.

use super::desk::send;
use super::messages::{Envelope, Report};
use super::shelf::Shelf;
use super::work;
use annulus_core::diagnostic::Diagnostic;
use wasm_bindgen::prelude::*;
use web_sys::{DedicatedWorkerGlobalScope, MessageEvent};

/// Begins to listen. Called once, when the wasm is started in a worker.
pub fn serve() {
    let Ok(scope) = js_sys::global().dyn_into::<DedicatedWorkerGlobalScope>() else { return };
    std::panic::set_hook(Box::new(|panic| report(&Report::Panicked(panic.to_string()))));
    let mut shelf = Shelf::default();
    let listener = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        let bytes = js_sys::Uint8Array::new(&event.data()).to_vec();
        match postcard::from_bytes::<Envelope>(&bytes) {
            Ok(envelope) => perform(envelope, &mut shelf),
            Err(error) => report(&Report::Panicked(error.to_string())),
        }
    });
    scope.set_onmessage(Some(listener.as_ref().unchecked_ref()));
    listener.forget();
}

fn perform(Envelope { id, request }: Envelope, shelf: &mut Shelf) {
    let mut told = 0;
    let mut progress = |done: u64, total: u64| {
        let hundredths = done * 100 / total.max(1);
        if hundredths > told {
            told = hundredths;
            report(&Report::Progress { id, done, total });
        }
    };
    let answer = work::perform(request, shelf, &mut progress);
    report(&Report::Done { id, answer });
}

fn report(report: &Report) {
    let Ok(scope) = js_sys::global().dyn_into::<DedicatedWorkerGlobalScope>() else { return };
    let bytes = postcard::to_allocvec(report).or_else(|error| {
        let diagnostic = Diagnostic::error("engine.fell_over").with("reason", error);
        let Report::Done { id, .. } = report else { return Err(()) };
        postcard::to_allocvec(&Report::Done { id: *id, answer: Err(vec![diagnostic]) }).map_err(drop)
    });
    if let Ok(bytes) = bytes {
        let _ = send(|message, moved| scope.post_message_with_transfer(message, moved), &bytes);
    }
}
