//! The worker's side: handles requests one after the other.

use super::cache::Cache;
use super::messages::{Envelope, WorkerReport};
use super::work;
use crate::trusted;
use annulus_core::error;
use wasm_bindgen::prelude::*;
use web_sys::{DedicatedWorkerGlobalScope, MessageEvent, Worker, WorkerOptions, WorkerType};

const SCRIPT: &str = "worker.js";

#[wasm_bindgen]
extern "C" {
    /// The compiled engine, fetched once (`www/boot.js`).
    #[wasm_bindgen(catch, js_name = annulusEngine)]
    async fn compiled() -> Result<JsValue, JsValue>;
}

/// Starts a worker and sends it the compiled engine; messages that arrive earlier wait in the worker. If the
/// engine cannot be loaded, the worker reports an error.
pub fn hire(name: &str) -> Result<Worker, JsValue> {
    let options = WorkerOptions::new();
    options.set_type(WorkerType::Module);
    options.set_name(name);
    let constructor: js_sys::Function =
        js_sys::Reflect::get(&js_sys::global(), &"Worker".into())?.dyn_into()?;
    let arguments = js_sys::Array::of2(&trusted::script_url(SCRIPT), &options);
    let worker: Worker = js_sys::Reflect::construct(&constructor, &arguments)?.unchecked_into();
    let hired = worker.clone();
    wasm_bindgen_futures::spawn_local(async move {
        let engine = compiled().await.unwrap_or_else(|error| error);
        let _ = hired.post_message(&engine);
    });
    Ok(worker)
}

/// Posts bytes by transfer, without a copy.
pub(super) fn send(
    post: impl FnOnce(&JsValue, &JsValue) -> Result<(), JsValue>,
    bytes: &[u8],
) -> Result<(), JsValue> {
    let buffer = js_sys::Uint8Array::from(bytes).buffer();
    post(&buffer, &js_sys::Array::of1(&buffer))
}

/// Starts to listen. Called once, when the wasm starts in a worker.
pub fn serve() {
    let Ok(scope) = js_sys::global().dyn_into::<DedicatedWorkerGlobalScope>() else { return };
    std::panic::set_hook(Box::new(|panic| report(&WorkerReport::Panicked(panic.to_string()))));
    let mut cache = Cache::default();
    let listener = Closure::<dyn FnMut(MessageEvent)>::new(move |event: MessageEvent| {
        let bytes = js_sys::Uint8Array::new(&event.data()).to_vec();
        match postcard::from_bytes::<Envelope>(&bytes) {
            Ok(envelope) => perform(envelope, &mut cache),
            Err(error) => report(&WorkerReport::Panicked(error.to_string())),
        }
    });
    scope.set_onmessage(Some(listener.as_ref().unchecked_ref()));
    listener.forget();
}

fn perform(Envelope { id, request }: Envelope, cache: &mut Cache) {
    let mut told = 0;
    let mut progress = |done: u64, total: u64| {
        let hundredths = done * 100 / total.max(1);
        // At most a hundred reports per request.
        if hundredths > told {
            told = hundredths;
            report(&WorkerReport::Progress { id, done, total });
        }
    };
    let answer = work::perform(request, cache, &mut progress);
    report(&WorkerReport::Done { id, answer });
}

fn report(report: &WorkerReport) {
    let Ok(scope) = js_sys::global().dyn_into::<DedicatedWorkerGlobalScope>() else { return };
    // An answer that cannot be encoded is reported as a failure, or the page would wait forever.
    let bytes = postcard::to_allocvec(report).or_else(|error| {
        let diagnostic = error!("engine.fell_over", reason = error);
        let WorkerReport::Done { id, .. } = report else { return Err(()) };
        postcard::to_allocvec(&WorkerReport::Done { id: *id, answer: Err(vec![diagnostic]) }).map_err(drop)
    });
    if let Ok(bytes) = bytes {
        let _ = send(|message, moved| scope.post_message_with_transfer(message, moved), &bytes);
    }
}
