//! Drawings in the store of this browser, each with all its edits, and which of them is that of this tab. One that another tab has is
//! opened as a copy, which is kept at a place of its own.
//!
//! Comes in: texts. Goes out: texts, as events. Does not know what a drawing is.

use super::left::LeftTexts;
use super::locks::{Claims, RELOAD_MS};
use super::store::{finished, get, table};
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

/// Where this tab keeps which drawing is its own.
const OWN: &str = "annulus.drawing";

/// How the lock of a place is called, before its number.
const LOCK: &str = "annulus drawing ";

/// Where drawings are put while the page is being left.
const LEFT: LeftTexts = LeftTexts("annulus.left.drawing.");

/// The example of the manual, on our own server.
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

/// A kept drawing without its text.
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

/// Keeps a drawing at once.
pub(super) fn leave(place: u32, text: &str, at_ms: f64) {
    LEFT.put(place, text, at_ms);
}

async fn row(place: u32) -> Option<Earlier> {
    row_of(place, &get(&row_key(place)).await.ok()?)
}

/// When a place was written, in ms since 1970; before all times where nothing is kept there.
async fn written_ms(place: u32) -> f64 {
    row(place).await.map_or(f64::NEG_INFINITY, |row| row.at_ms)
}

/// The places that this tab has, and its last two drawings: the one that was put aside may come back.
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
    /// Which drawing is that of this tab; none for one that is not kept yet.
    pub(super) fn own(&self, place: Option<u32>) {
        if let Some(storage) = tab_storage() {
            let _ = match place {
                Some(place) => storage.set_item(OWN, &place.to_string()),
                None => storage.remove_item(OWN),
            };
        }
        let [last, before] = self.latest.get();
        if place.is_some() && place != last {
            self.latest.set([place, last]);
            before.filter(|before| Some(*before) != place).inspect(|before| self.claims.let_go(*before));
        }
    }

    /// What is at a place: where it is kept from now on, none for a copy of what another tab has; its text.
    async fn taken(&self, place: u32, patience_ms: u32) -> (Option<u32>, Option<String>) {
        let own = self.claims.take_soon(place, patience_ms).await.then_some(place);
        (own, text(place).await)
    }

    /// Tells what is there; the text of the drawing of this tab where that is wanted.
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

    /// Writes a drawing; without a place it takes one that is free, else the one that was written longest ago.
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

    /// Takes a drawing.
    pub(super) fn take(&self, place: u32) {
        let this = self.clone();
        spawn_local(async move {
            let (place, text) = this.taken(place, 0).await;
            send(DrawEvent::Opened { place, is_copy: place.is_none(), text });
        });
    }

    /// Forgets a drawing, unless another tab has it.
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

/// Fetches the example.
pub(super) fn example() {
    spawn_local(async {
        let answer = browser::request("GET", EXAMPLE, &[], None).await.filter(|answer| answer.status == 200);
        let text = answer.and_then(|answer| String::from_utf8(answer.body).ok());
        send(DrawEvent::Opened { place: None, is_copy: false, text });
    });
}
