//! Drawings in the browser's store, each with its history, and which of them is this tab's. A drawing that
//! another tab has opens as a copy, which gets its own slot.

use super::locks::{Claims, RELOAD_MS};
use super::store::{LeftTexts, finished, get, table};
use crate::browser::{self, tab_storage};
use crate::model::DrawEvent;
use crate::model::drawing::{Earlier, PLACES};
use crate::page::send;
use js_sys::Array;
use leptos::task::spawn_local;
use std::cell::Cell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::IdbTransactionMode;

/// Key of this tab's drawing in session storage.
const OWN: &str = "annulus.drawing";

/// Prefix of the lock names; the slot's number follows.
const LOCK: &str = "annulus drawing ";

/// Drawings saved while the page closes.
const LEFT: LeftTexts = LeftTexts("annulus.left.drawing.");

/// The manual's example, on our own server.
const EXAMPLE: &str = "drawings/robot.json";

fn row_key(place: u32) -> JsValue {
    format!("drawing/{place}").into()
}

fn text_key(place: u32) -> JsValue {
    format!("drawing/{place}/text").into()
}

fn own_place() -> Option<u32> {
    tab_storage()?.get_item(OWN).ok()??.parse().ok()
}

/// A saved drawing without its text.
fn row_of(place: u32, row: &JsValue) -> Option<Earlier> {
    let row: &Array = row.dyn_ref()?;
    Some(Earlier { place, at_ms: row.get(0).as_f64()?, name: row.get(1).as_string()?, elsewhere: false })
}

async fn text(place: u32) -> Option<String> {
    let at_ms = row(place).await?.at_ms;
    match LEFT.since(place, at_ms) {
        Some((_, text)) => Some(text),
        None => get(&text_key(place)).await.ok()?.as_string(),
    }
}

/// Saves a drawing synchronously.
pub(super) fn leave(place: u32, text: &str, at_ms: f64) {
    LEFT.put(place, text, at_ms);
}

async fn row(place: u32) -> Option<Earlier> {
    row_of(place, &get(&row_key(place)).await.ok()?)
}

/// When a slot was written, ms since 1970; negative infinity if it is empty.
async fn written_ms(place: u32) -> f64 {
    row(place).await.map_or(f64::NEG_INFINITY, |row| row.at_ms)
}

/// The slots of this tab, and its last two drawings, because the user may go back to the one before.
#[derive(Clone)]
pub(super) struct Drawings {
    claims: Claims,
    latest: Rc<Cell<[Option<u32>; 2]>>,
}

impl Default for Drawings {
    fn default() -> Self {
        Self { claims: Claims::new(LOCK), latest: Rc::default() }
    }
}

impl Drawings {
    /// Sets this tab's drawing; `None` if it is not saved yet.
    pub(super) fn own(&self, place: Option<u32>) {
        if let Some(storage) = tab_storage() {
            let _ = match place {
                Some(place) => storage.set_item(OWN, &place.to_string()),
                None => storage.remove_item(OWN),
            };
        }
        // Only the last two drawings stay held; the one before them is released.
        let [last, before] = self.latest.get();
        if place.is_some() && place != last {
            self.latest.set([place, last]);
            before.filter(|before| Some(*before) != place).inspect(|before| self.claims.let_go(*before));
        }
    }

    /// Reads a drawing: the slot if this tab has it (`None`: a copy of another tab's), and the text.
    async fn taken(&self, place: u32, patience_ms: u32) -> (Option<u32>, Option<String>) {
        let own = self.claims.take_soon(place, patience_ms).await.then_some(place);
        (own, text(place).await)
    }

    /// Lists the saved drawings, with the text of this tab's own one if requested.
    pub(super) fn look(&self, with_own: bool) {
        let (this, held) = (self.clone(), self.claims.elsewhere(PLACES));
        spawn_local(async move {
            let held = held.await;
            let mut earlier = Vec::new();
            for place in 0..PLACES {
                let elsewhere = held.contains(&place);
                earlier.extend(row(place).await.map(|row| Earlier { elsewhere, ..row }));
            }
            let own = match own_place().filter(|_| with_own) {
                Some(place) => match this.taken(place, RELOAD_MS).await {
                    (place, Some(text)) => Some((place, text)),
                    (_, None) => None,
                },
                None => None,
            };
            send(DrawEvent::Found { own, earlier });
        });
    }

    /// Saves a drawing. Without a slot it gets a free one, else the one written longest ago.
    pub(super) fn keep(&self, of: u32, place: Option<u32>, name: String, text: String, at_ms: f64) {
        let this = self.clone();
        spawn_local(async move {
            let claimed = if place.is_none() { this.claims.claim(PLACES, written_ms).await } else { None };
            let Some(there) = place.or(claimed) else {
                return send(DrawEvent::Kept { of, place: None });
            };
            let done = put(there, &name, &text, at_ms).await;
            if let Err(why) = &done {
                web_sys::console::warn_1(why);
                claimed.inspect(|place| this.claims.let_go(*place));
            }
            this.claims.settle(there);
            send(DrawEvent::Kept { of, place: done.is_ok().then_some(there) });
        });
    }

    pub(super) fn take(&self, place: u32) {
        let this = self.clone();
        spawn_local(async move {
            let (place, text) = this.taken(place, 0).await;
            send(DrawEvent::Opened { place, is_copy: place.is_none(), text });
        });
    }

    /// Deletes a drawing, unless another tab has it.
    pub(super) fn forget(&self, place: u32) {
        let this = self.clone();
        spawn_local(async move {
            if this.claims.take(place).await {
                if let Err(why) = dropped(place).await {
                    web_sys::console::warn_1(&why);
                }
                this.claims.let_go(place);
            }
            this.look(false);
        });
    }
}

async fn put(place: u32, name: &str, text: &str, at_ms: f64) -> Result<(), JsValue> {
    let (table, done) = table(IdbTransactionMode::Readwrite).await?;
    table.put_with_key(&Array::of2(&at_ms.into(), &name.into()), &row_key(place))?;
    table.put_with_key(&text.into(), &text_key(place))?;
    finished(&done).await?;
    LEFT.stored(place, at_ms);
    Ok(())
}

async fn dropped(place: u32) -> Result<(), JsValue> {
    let (table, done) = table(IdbTransactionMode::Readwrite).await?;
    table.delete(&row_key(place))?;
    table.delete(&text_key(place))?;
    finished(&done).await?;
    LEFT.clear(place);
    Ok(())
}

pub(super) fn example() {
    spawn_local(async {
        let answer = browser::request("GET", EXAMPLE, &[], None).await.filter(|answer| answer.status == 200);
        let text = answer.and_then(|answer| String::from_utf8(answer.body).ok());
        send(DrawEvent::Opened { place: None, is_copy: false, text });
    });
}
