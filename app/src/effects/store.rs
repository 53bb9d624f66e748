//! The store of this browser: two places, each with the files of a project and its job.
//!
//! Comes in: records. Goes out: records, as events. Does not know what a project is.

use crate::browser::window;
use crate::model::keeping::PLACES;
use crate::model::{Event, KeepEvent, Offer};
use crate::page::send;
use js_sys::{Array, Function, Promise, Uint8Array};
use leptos::task::spawn_local;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{
    IdbDatabase, IdbObjectStore, IdbOpenDbRequest, IdbRequest, IdbTransaction, IdbTransactionMode,
};

/// The database, and its one table.
const BASE: &str = "annulus";
const TABLE: &str = "projects";

/// Tells what is there.
pub(super) fn look() {
    spawn_local(async {
        let mut offers: Vec<Offer> = Vec::new();
        for place in 0..PLACES {
            offers.extend(row(place).await.map(|(offer, _)| offer));
        }
        send(KeepEvent::Found { offers });
    });
}

/// Writes the job, and the files where there are some.
pub(super) fn write(place: u32, name: String, job: String, files: Option<Vec<u8>>, at_ms: f64) {
    spawn_local(async move {
        let done = put(place, &name, &job, files, at_ms).await;
        if let Err(why) = &done {
            web_sys::console::warn_1(why);
        }
        send(KeepEvent::Written { done: done.is_ok() });
    });
}

async fn put(place: u32, name: &str, job: &str, files: Option<Vec<u8>>, at_ms: f64) -> Result<(), JsValue> {
    let row = Array::of3(&at_ms.into(), &name.into(), &job.into());
    let files = files.map(|files| Uint8Array::from(files.as_slice()));
    let (table, done) = table(IdbTransactionMode::Readwrite).await?;
    if let Some(files) = files {
        table.put_with_key(&files, &files_key(place))?;
    }
    table.put_with_key(&row, &job_key(place))?;
    finished(&done).await
}

/// Takes what is at a place.
pub(super) fn take(place: u32) {
    spawn_local(async move {
        let job = row(place).await.map(|(_, job)| job);
        let files = get(&files_key(place)).await.ok().and_then(|files| files.dyn_into::<Uint8Array>().ok());
        send(KeepEvent::Taken { place, files: files.map(|files| files.to_vec()), job });
    });
}

/// Forgets what is at a place.
pub(super) fn forget(place: u32) {
    spawn_local(async move {
        let gone = async {
            let (table, done) = table(IdbTransactionMode::Readwrite).await?;
            table.delete(&files_key(place))?;
            table.delete(&job_key(place))?;
            finished(&done).await
        };
        if let Err(why) = gone.await {
            web_sys::console::warn_1(&why);
        }
        send(Event::Keep(KeepEvent::Dropped));
    });
}

fn files_key(place: u32) -> JsValue {
    format!("{place}/files").into()
}

fn job_key(place: u32) -> JsValue {
    format!("{place}/job").into()
}

/// What is kept at a place, without its files, and its job.
async fn row(place: u32) -> Option<(Offer, String)> {
    let row: Array = get(&job_key(place)).await.ok()?.dyn_into().ok()?;
    let (at_ms, name, job) = (row.get(0).as_f64()?, row.get(1).as_string()?, row.get(2).as_string()?);
    Some((Offer { place, name, at_ms }, job))
}

/// What is kept under a key.
pub(super) async fn get(key: &JsValue) -> Result<JsValue, JsValue> {
    let (table, _) = table(IdbTransactionMode::Readonly).await?;
    answered(&table.get(key)?).await
}

/// The table, and the transaction in which it may be used before anything else is waited for.
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
    // It closes once the transaction is through.
    base.close();
    Ok((transaction.object_store(TABLE)?, transaction))
}

/// What a request gives.
pub(super) async fn answered(request: &IdbRequest) -> Result<JsValue, JsValue> {
    wait(|done, failed| {
        request.set_onsuccess(Some(done));
        request.set_onerror(Some(failed));
    })
    .await?;
    request.result()
}

/// Waits until a transaction is on the disk.
pub(super) async fn finished(transaction: &IdbTransaction) -> Result<(), JsValue> {
    wait(|done, failed| {
        transaction.set_oncomplete(Some(done));
        transaction.set_onerror(Some(failed));
        transaction.set_onabort(Some(failed));
    })
    .await
}

/// Waits for one of two callbacks.
async fn wait(set: impl FnOnce(&Function, &Function)) -> Result<(), JsValue> {
    let mut set = Some(set);
    let promise = Promise::new(&mut |done, failed| {
        if let Some(set) = set.take() {
            set(&done, &failed);
        }
    });
    JsFuture::from(promise).await.map(drop)
}
