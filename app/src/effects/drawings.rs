//! Drawings in the store of this browser, each with all its edits, and which of them is that of this tab.
//!
//! Comes in: texts. Goes out: texts, as events. Does not know what a drawing is.

use super::store::{answered, finished, get, table};
use crate::browser::{self, tab_storage};
use crate::model::DrawEvent;
use crate::model::drawing::{Earlier, PLACES};
use crate::page::send;
use js_sys::Array;
use leptos::task::spawn_local;
use wasm_bindgen::prelude::*;
use web_sys::IdbTransactionMode;

/// Where this tab keeps which drawing is its own.
const OWN: &str = "annulus.drawing";

/// The example of the manual, on our own server.
const EXAMPLE: &str = "drawings/robot.json";

fn row_key(place: u32) -> JsValue {
    format!("drawing/{place}").into()
}

fn text_key(place: u32) -> JsValue {
    format!("drawing/{place}/text").into()
}

/// Which drawing is that of this tab; none for one that is not kept yet.
pub(super) fn own(place: Option<u32>) {
    if let Some(storage) = tab_storage() {
        let _ = match place {
            Some(place) => storage.set_item(OWN, &place.to_string()),
            None => storage.remove_item(OWN),
        };
    }
}

fn own_place() -> Option<u32> {
    tab_storage()?.get_item(OWN).ok()??.parse().ok()
}

/// A kept drawing without its text.
fn row_of(place: u32, row: &JsValue) -> Option<Earlier> {
    let row: &Array = row.dyn_ref()?;
    Some(Earlier { place, at_ms: row.get(0).as_f64()?, name: row.get(1).as_string()? })
}

async fn text(place: u32) -> Option<String> {
    get(&text_key(place)).await.ok()?.as_string()
}

/// Tells what is there; the text of the drawing of this tab where that is wanted.
pub(super) fn look(with_own: bool) {
    spawn_local(async move {
        let mut earlier = Vec::new();
        for place in 0..PLACES {
            let row = get(&row_key(place)).await.ok();
            earlier.extend(row.and_then(|row| row_of(place, &row)));
        }
        let wanted = own_place().filter(|_| with_own);
        let own = match wanted {
            Some(place) => text(place).await.map(|text| (place, text)),
            None => None,
        };
        send(DrawEvent::Found { own, earlier });
    });
}

/// Writes a drawing; without a place it takes one that is free, else the one that was written longest ago.
pub(super) fn keep(of: u32, place: Option<u32>, name: String, text: String, at_ms: f64) {
    spawn_local(async move {
        let place = match put(place, &name, &text, at_ms).await {
            Ok(place) => Some(place),
            Err(why) => {
                web_sys::console::warn_1(&why);
                None
            }
        };
        send(DrawEvent::Kept { of, place });
    });
}

async fn put(place: Option<u32>, name: &str, text: &str, at_ms: f64) -> Result<u32, JsValue> {
    // A place is looked for and taken in one transaction: no other tab takes the same one.
    let (table, done) = table(IdbTransactionMode::Readwrite).await?;
    let place = match place {
        Some(place) => place,
        None => {
            let mut oldest: Option<(f64, u32)> = None;
            for place in 0..PLACES {
                let row = answered(&table.get(&row_key(place))?).await?;
                let at_ms = row_of(place, &row).map_or(f64::NEG_INFINITY, |row| row.at_ms);
                if oldest.is_none_or(|(least, _)| at_ms < least) {
                    oldest = Some((at_ms, place));
                }
            }
            oldest.map_or(0, |(_, place)| place)
        }
    };
    table.put_with_key(&Array::of2(&at_ms.into(), &name.into()), &row_key(place))?;
    table.put_with_key(&text.into(), &text_key(place))?;
    finished(&done).await?;
    Ok(place)
}

/// Takes a drawing.
pub(super) fn take(place: u32) {
    spawn_local(async move {
        send(DrawEvent::Opened { place: Some(place), text: text(place).await });
    });
}

/// Forgets a drawing.
pub(super) fn forget(place: u32) {
    spawn_local(async move {
        let gone = async {
            let (table, done) = table(IdbTransactionMode::Readwrite).await?;
            table.delete(&row_key(place))?;
            table.delete(&text_key(place))?;
            finished(&done).await
        };
        if let Err(why) = gone.await {
            web_sys::console::warn_1(&why);
        }
        look(false);
    });
}

/// Fetches the example.
pub(super) fn example() {
    spawn_local(async {
        let answer = browser::request("GET", EXAMPLE, &[], None).await.filter(|answer| answer.status == 200);
        let text = answer.and_then(|answer| String::from_utf8(answer.body).ok());
        send(DrawEvent::Opened { place: None, text });
    });
}
