//! The open project kept in this browser, so that a reload, a crash or a closed window loses nothing (N24).
//!
//! ```text
//!  files, what was said ─ changed ─▶ packed in the worker ─┐
//!  job ─ changed ─ rests half a second ────────────────────┴▶ IndexedDB ─ next visit ─▶ an offer: Restore · Discard
//!
//!  two places:   offered until the person answers │ written by this visit
//! ```
//!
//! Comes in: the open board and its job, as they change. Goes out: records in the browser's own store of this address, and the
//! offer of one. Nothing is opened unless the person says so, and what is offered is not written over before. Does not know
//! how an offer is shown.

use crate::document::{self, Document, desk};
use crate::engine::Engine;
use crate::engine::messages::ToOpen;
use crate::i18n::say;
use crate::link::browser::{clock_ms, window};
use crate::widgets::toast;
use crate::workbench::bench;
use annulus_core::project;
use annulus_core::project::saved::Project;
use js_sys::{Array, Function, Promise, Uint8Array};
use leptos::prelude::*;
use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::time::Duration;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{
    IdbDatabase, IdbObjectStore, IdbOpenDbRequest, IdbRequest, IdbTransaction, IdbTransactionMode,
};

/// The database, and its one table.
const BASE: &str = "annulus";
const TABLE: &str = "projects";
/// Changes rest so long before they are kept.
const REST: Duration = Duration::from_millis(500);
/// How many projects are kept at most: the one on offer and the one that is open.
const PLACES: u32 = 2;

/// A project that was open before.
#[derive(Clone, Debug, PartialEq)]
pub struct Offer {
    place: u32,
    /// The name of its board.
    pub name: String,
    /// When it was kept last, in ms since 1970.
    pub at_ms: f64,
}

thread_local! {
    static OFFER: Cell<Option<RwSignal<Option<Offer>>>> = const { Cell::new(None) };
    /// Where this visit writes; none until it is known what is there.
    static PLACE: Cell<Option<u32>> = const { Cell::new(None) };
    /// The board whose files are in the store.
    static KEPT: RefCell<Option<Arc<Document>>> = const { RefCell::new(None) };
    static CHANGES: Cell<u32> = const { Cell::new(0) };
    static BUSY: Cell<bool> = const { Cell::new(false) };
    /// Something changed while the store was busy.
    static AGAIN: Cell<bool> = const { Cell::new(false) };
    /// That nothing can be kept was said.
    static TOLD: Cell<bool> = const { Cell::new(false) };
}

/// What there is to restore. Made by [`begin`].
pub fn offer() -> RwSignal<Option<Offer>> {
    OFFER.get().expect("the offer is made before the first screen")
}

/// Looks for what was kept, and keeps from now on what is open. After the desk and the bench.
pub fn begin() {
    OFFER.set(Some(RwSignal::new(None)));
    leptos::task::spawn_local(async {
        look().await;
        rest();
    });
    Effect::new(move |_| {
        desk().document.track();
        bench().work.track();
        rest();
    });
}

/// Keeps what is open once nothing has changed for a while.
fn rest() {
    let change = CHANGES.get() + 1;
    CHANGES.set(change);
    set_timeout(
        move || {
            if change == CHANGES.get() {
                leptos::task::spawn_local(keep());
            }
        },
        REST,
    );
}

/// Keeps what is open, again as long as it changes meanwhile.
async fn keep() {
    if BUSY.replace(true) {
        return AGAIN.set(true);
    }
    loop {
        AGAIN.set(false);
        if let Err(why) = store().await
            && !TOLD.replace(true)
        {
            web_sys::console::warn_1(&why);
            toast(say!("page.kept.failed"), None);
        }
        if !AGAIN.get() {
            break;
        }
    }
    BUSY.set(false);
}

/// Writes the job, and the files where they are not in the store yet.
async fn store() -> Result<(), JsValue> {
    let (document, work) = (desk().document.get_untracked(), bench().work.get_untracked());
    let (Some(document), Some(work), Some(place)) = (document, work, PLACE.get()) else { return Ok(()) };
    let known = KEPT.with_borrow(|kept| kept.as_ref().is_some_and(|kept| Arc::ptr_eq(kept, &document)));
    let mut files = None;
    if !known {
        let project = Project { files: document.files.clone(), said: document.said.clone(), job: None };
        let packed = Engine::new().save(project).await.map_err(|_| JsValue::from_str("not packed"))?;
        files = Some(Uint8Array::from(packed.as_slice()));
    }
    let row = Array::of3(
        &clock_ms().into(),
        &document.reading.board.name.as_str().into(),
        &project::write(&work).into(),
    );
    let (table, done) = table(IdbTransactionMode::Readwrite).await?;
    if let Some(files) = files {
        table.put_with_key(&files, &files_key(place))?;
    }
    table.put_with_key(&row, &job_key(place))?;
    finished(&done).await?;
    KEPT.set(Some(document));
    Ok(())
}

/// Offers the project that was kept last, and finds this visit a place beside it.
async fn look() {
    let mut found: Vec<Offer> = Vec::new();
    for place in 0..PLACES {
        found.extend(row(place).await.map(|(offer, _)| offer));
    }
    found.sort_by(|a, b| b.at_ms.total_cmp(&a.at_ms));
    let first = found.into_iter().next();
    PLACE.set(Some(first.as_ref().map_or(0, |offer| (offer.place + 1) % PLACES)));
    offer().set(first);
}

/// Opens what is on offer.
pub fn restore(wanted: Offer) {
    leptos::task::spawn_local(async move {
        let job = row(wanted.place).await.map(|(_, job)| job);
        let files =
            get(&files_key(wanted.place)).await.ok().and_then(|files| files.dyn_into::<Uint8Array>().ok());
        let Some(files) = files else { return toast(say!("page.kept.gone"), None) };
        let project = ToOpen { name: wanted.name.clone(), bytes: files.to_vec() };
        if document::reopen(project, job).await {
            PLACE.set(Some(wanted.place));
            offer().set(None);
        }
    });
}

/// Forgets what is on offer; then an older one may be.
pub fn discard(unwanted: Offer) {
    leptos::task::spawn_local(async move {
        let gone = async {
            let (table, done) = table(IdbTransactionMode::Readwrite).await?;
            table.delete(&files_key(unwanted.place))?;
            table.delete(&job_key(unwanted.place))?;
            finished(&done).await
        };
        if let Err(why) = gone.await {
            web_sys::console::warn_1(&why);
        }
        offer().set(None);
        look().await;
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

async fn get(key: &JsValue) -> Result<JsValue, JsValue> {
    let (table, _) = table(IdbTransactionMode::Readonly).await?;
    answered(&table.get(key)?).await
}

/// The table, and the transaction in which it may be used before anything else is waited for.
async fn table(mode: IdbTransactionMode) -> Result<(IdbObjectStore, IdbTransaction), JsValue> {
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
async fn answered(request: &IdbRequest) -> Result<JsValue, JsValue> {
    wait(|done, failed| {
        request.set_onsuccess(Some(done));
        request.set_onerror(Some(failed));
    })
    .await?;
    request.result()
}

/// Waits until a transaction is on the disk.
async fn finished(transaction: &IdbTransaction) -> Result<(), JsValue> {
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
