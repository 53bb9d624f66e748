//! The browser's store (IndexedDB): slots, each with a project's files and its job, and each used by at most
//! one tab.

use super::locks::{Claims, RELOAD_MS};
use crate::browser::{kept_storage, window};
use crate::model::keeping::PLACES;
use crate::model::{Event, KeepEvent, Offer};
use crate::page::send;
use js_sys::{Array, Function, Promise, Reflect, Uint8Array};
use leptos::ev;
use leptos::prelude::{document, window_event_listener};
use leptos::task::spawn_local;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{
    IdbDatabase, IdbObjectStore, IdbOpenDbRequest, IdbRequest, IdbTransaction, IdbTransactionMode,
};

const BASE: &str = "annulus";
const TABLE: &str = "projects";

/// Prefix of the lock names; the slot's number follows.
const LOCK: &str = "annulus project ";

#[derive(Clone)]
pub(super) struct Places(Claims);

impl Default for Places {
    fn default() -> Self {
        Self(Claims::new(LOCK))
    }
}

/// Reports when the page becomes visible, hidden or closes.
pub(super) fn listen() {
    let looked = window_event_listener(ev::focus, |_| send(KeepEvent::Looked));
    let hidden = Closure::<dyn FnMut()>::new(|| {
        if document().hidden() {
            send(KeepEvent::Leaving);
        }
    });
    let _ = document().add_event_listener_with_callback("visibilitychange", hidden.as_ref().unchecked_ref());
    hidden.forget();
    // The browser waits for the handler of `beforeunload`; a slow page may be terminated before `pagehide`.
    let leaving = window_event_listener(ev::beforeunload, |_| send(KeepEvent::Leaving));
    let left = window_event_listener(ev::pagehide, |_| send(KeepEvent::Leaving));
    leptos::prelude::on_cleanup(move || {
        looked.remove();
        leaving.remove();
        left.remove();
    });
}

impl Places {
    /// Lists the saved projects, and reports when another tab releases one.
    pub(super) fn look(&self) {
        let (held, claims) = (self.0.elsewhere(PLACES), self.0.clone());
        spawn_local(async move {
            let held = held.await;
            for place in &held {
                claims.when_free(*place, || send(KeepEvent::Looked));
            }
            let mut offers: Vec<Offer> = Vec::new();
            for place in 0..PLACES {
                let elsewhere = held.contains(&place);
                offers.extend(row(place).await.map(|(offer, _)| Offer { elsewhere, ..offer }));
            }
            send(KeepEvent::Found { offers });
            if let Some(bytes) = used().await {
                send(KeepEvent::Measured { bytes });
            }
        });
    }

    pub(super) fn write(
        &self,
        place: Option<u32>,
        name: String,
        job: String,
        files: Option<Vec<u8>>,
        at_ms: f64,
    ) {
        let this = self.clone();
        spawn_local(async move {
            let claimed = if place.is_none() { this.0.claim(PLACES, written_ms).await } else { None };
            let Some(there) = place.or(claimed) else {
                return send(KeepEvent::Written { place: None, full: false });
            };
            if claimed.is_some() {
                // Not awaited, because some browsers ask the user first.
                spawn_local(keep_for_good());
            }
            let done = put(there, &name, &job, files, at_ms).await;
            if let Err(why) = &done {
                web_sys::console::warn_1(why);
                claimed.inspect(|place| this.let_go(*place));
            }
            this.0.settle(there);
            let full = done.as_ref().is_err_and(is_full);
            send(KeepEvent::Written { place: done.is_ok().then_some(there), full });
        });
    }

    pub(super) fn let_go(&self, place: u32) {
        self.0.let_go(place);
    }

    /// Reads a slot, and holds it unless another tab does. If `is_free`, waits for a lock that may be this
    /// tab's own from before a reload.
    pub(super) fn take(&self, place: u32, is_free: bool) {
        let this = self.clone();
        spawn_local(async move {
            let own = this.0.take_soon(place, if is_free { RELOAD_MS } else { 0 }).await;
            let job = row(place).await.map(|(_, job)| job);
            let files =
                get(&files_key(place)).await.ok().and_then(|files| files.dyn_into::<Uint8Array>().ok());
            send(KeepEvent::Taken { place, files: files.map(|files| files.to_vec()), job, own });
        });
    }

    /// Deletes a slot's contents, unless a tab has it.
    pub(super) fn forget(&self, place: u32) {
        let this = self.clone();
        spawn_local(async move {
            if this.0.hold(place).await {
                if let Err(why) = dropped(place).await {
                    web_sys::console::warn_1(&why);
                }
                this.let_go(place);
            }
            send(Event::Keep(KeepEvent::Dropped));
        });
    }
}

/// When a slot was written, ms since 1970; negative infinity if it is empty.
async fn written_ms(place: u32) -> f64 {
    row(place).await.map_or(f64::NEG_INFINITY, |(offer, _)| offer.at_ms)
}

/// Storage that the browser uses for the page, in bytes; `None` if it does not report that.
async fn used() -> Option<u64> {
    let storage = window().navigator().storage();
    if storage.is_undefined() {
        return None;
    }
    let told = JsFuture::from(storage.estimate().ok()?).await.ok()?;
    Some(Reflect::get(&told, &"usage".into()).ok()?.as_f64()? as u64)
}

/// Asks the browser not to delete the data when the disk is nearly full.
async fn keep_for_good() {
    let storage = window().navigator().storage();
    if !storage.is_undefined()
        && let Ok(asked) = storage.persist()
    {
        let _ = JsFuture::from(asked).await;
    }
}

fn is_full(why: &JsValue) -> bool {
    let name = why.dyn_ref::<web_sys::DomException>().map(web_sys::DomException::name);
    matches!(name.as_deref(), Some("QuotaExceededError" | "NS_ERROR_DOM_QUOTA_REACHED"))
}

async fn put(place: u32, name: &str, job: &str, files: Option<Vec<u8>>, at_ms: f64) -> Result<(), JsValue> {
    let row = Array::of3(&at_ms.into(), &name.into(), &job.into());
    let files = files.map(|files| Uint8Array::from(files.as_slice()));
    let (table, done) = table(IdbTransactionMode::Readwrite).await?;
    if let Some(files) = files {
        table.put_with_key(&files, &files_key(place))?;
    }
    table.put_with_key(&row, &job_key(place))?;
    finished(&done).await?;
    LEFT.stored(place, at_ms);
    Ok(())
}

/// Jobs saved while the page closes.
const LEFT: LeftTexts = LeftTexts("annulus.left.");

/// Saves a job synchronously.
pub(super) fn leave(place: u32, job: &str, at_ms: f64) {
    LEFT.put(place, job, at_ms);
}

async fn dropped(place: u32) -> Result<(), JsValue> {
    let (table, done) = table(IdbTransactionMode::Readwrite).await?;
    table.delete(&files_key(place))?;
    table.delete(&job_key(place))?;
    finished(&done).await?;
    LEFT.clear(place);
    Ok(())
}

fn files_key(place: u32) -> JsValue {
    format!("{place}/files").into()
}

fn job_key(place: u32) -> JsValue {
    format!("{place}/job").into()
}

/// A slot's project without its files, and its job.
async fn row(place: u32) -> Option<(Offer, String)> {
    let row: Array = get(&job_key(place)).await.ok()?.dyn_into().ok()?;
    let (at_ms, name, job) = (row.get(0).as_f64()?, row.get(1).as_string()?, row.get(2).as_string()?);
    let (at_ms, job) = LEFT.since(place, at_ms).unwrap_or((at_ms, job));
    Some((Offer { place, name, at_ms, elsewhere: false }, job))
}

pub(super) async fn get(key: &JsValue) -> Result<JsValue, JsValue> {
    let (table, _) = table(IdbTransactionMode::Readonly).await?;
    answered(&table.get(key)?).await
}

/// The table and its transaction, which must be used before anything else is awaited.
pub(super) async fn table(mode: IdbTransactionMode) -> Result<(IdbObjectStore, IdbTransaction), JsValue> {
    let factory = window().indexed_db()?.ok_or_else(|| JsValue::from_str("no store"))?;
    let opening: IdbOpenDbRequest = factory.open_with_u32(BASE, 1)?;
    let made = opening.clone();
    let make = Closure::once_into_js(move || {
        if let Ok(base) = made.result() {
            let _ = base.unchecked_into::<IdbDatabase>().create_object_store(TABLE);
        }
    });
    opening.set_onupgradeneeded(Some(make.unchecked_ref()));
    let base: IdbDatabase = answered(&opening).await?.dyn_into()?;
    let transaction = base.transaction_with_str_and_mode(TABLE, mode)?;
    // Takes effect after the transaction.
    base.close();
    Ok((transaction.object_store(TABLE)?, transaction))
}

pub(super) async fn answered(request: &IdbRequest) -> Result<JsValue, JsValue> {
    wait(|done, failed| {
        request.set_onsuccess(Some(done));
        request.set_onerror(Some(failed));
    })
    .await?;
    request.result()
}

/// Waits until a transaction is written to disk; the error if it was aborted.
pub(super) async fn finished(transaction: &IdbTransaction) -> Result<(), JsValue> {
    let done = wait(|done, failed| {
        transaction.set_oncomplete(Some(done));
        transaction.set_onabort(Some(failed));
    });
    done.await.map_err(|event| transaction.error().map_or(event, JsValue::from))
}

async fn wait(set: impl FnOnce(&Function, &Function)) -> Result<(), JsValue> {
    let mut set = Some(set);
    let promise = Promise::new(&mut |done, failed| {
        if let Some(set) = set.take() {
            set(&done, &failed);
        }
    });
    JsFuture::from(promise).await.map(drop)
}

/// Texts saved while the page closes: synchronously in local storage, because nothing asynchronous completes
/// then. Each kind has a prefix for its keys.
#[derive(Clone, Copy)]
pub(super) struct LeftTexts(pub &'static str);

impl LeftTexts {
    fn key(self, place: u32) -> String {
        format!("{}{place}", self.0)
    }

    /// Saves a text. If there is no room, the store's version is at most half a second old.
    pub(super) fn put(self, place: u32, text: &str, at_ms: f64) {
        if let Some(storage) = kept_storage() {
            let _ = storage.set_item(&self.key(place), &format!("{at_ms} {text}"));
        }
    }

    pub(super) fn since(self, place: u32, at_ms: f64) -> Option<(f64, String)> {
        let text = kept_storage()?.get_item(&self.key(place)).ok()??;
        let (left_ms, text) = text.split_once(' ')?;
        let left_ms = left_ms.parse().ok().filter(|left_ms| *left_ms > at_ms)?;
        Some((left_ms, text.to_owned()))
    }

    /// The store has the version of `at_ms`: deletes the text unless it is newer.
    pub(super) fn stored(self, place: u32, at_ms: f64) {
        if self.since(place, at_ms).is_none() {
            self.clear(place);
        }
    }

    pub(super) fn clear(self, place: u32) {
        if let Some(storage) = kept_storage() {
            let _ = storage.remove_item(&self.key(place));
        }
    }
}
