//! Boards that arrive with the page's address: a link to a board, or files shared with the page.
//!
//! ```text
//!   ?url=https://…/board.zip, or a typed link ─▶ fetched without cookies ─▶ FilesEvent::Fetched
//!   ?shared=FILES BYTES ─▶ read from the service worker's cache ──────────▶ FilesEvent::Chosen
//! ```
//!
//! The parameters are removed from the address, so that a reload does not fetch the board again.

use super::files::coming;
use super::limits::{MOST_BYTES, too_much};
use crate::browser::window;
use crate::model::{FilesEvent, FrameEvent};
use crate::page::send;
use crate::said::{Text, key};
use js_sys::{Array, Reflect, Uint8Array};
use leptos::task::spawn_local;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{Cache, Request, RequestCredentials, RequestInit, RequestMode, Response, Url, UrlSearchParams};

/// Prefix of the cache in which the service worker stores shared files; the site's folder follows.
const SHARED: &str = "annulus-shared ";

#[wasm_bindgen]
extern "C" {
    type Pieces;
    #[wasm_bindgen(method, catch)]
    async fn read(this: &Pieces) -> Result<JsValue, JsValue>;
    #[wasm_bindgen(method, catch)]
    async fn cancel(this: &Pieces) -> Result<JsValue, JsValue>;
}

/// Handles the address. Called once. `alone`: the site has no bridge.
pub(super) fn begin(alone: bool) {
    let search = window().location().search().unwrap_or_default();
    let Ok(asked) = UrlSearchParams::new_with_str(&search) else { return };
    if let Some(address) = asked.get("url") {
        tidy(&asked, "url");
        if alone {
            open(address);
        } else {
            send(FrameEvent::Tell { text: Text::of(key!("page.link_to.bridge")) });
        }
    }
    if let Some(shared) = asked.get("shared") {
        tidy(&asked, "shared");
        spawn_local(async move {
            // The service worker does not store files beyond the limits.
            let sizes = || shared.split_once(' ').map(|(files, bytes)| (files.parse(), bytes.parse()));
            let too_much = match sizes() {
                Some((Ok(files), Ok(bytes))) => too_much(files, bytes),
                _ => None,
            };
            match (too_much, put_by().await) {
                (Some(text), _) => send(FrameEvent::Tell { text }),
                (None, Ok(files)) if !files.is_empty() => send(FilesEvent::Chosen { files }),
                _ => send(FrameEvent::Tell { text: Text::of(key!("page.link_to.not_shared")) }),
            }
        });
    }
}

/// Opens a link that the user typed; it must be absolute.
pub(super) fn put_in(address: String) {
    if Url::new(address.trim()).is_ok() {
        open(address);
    } else {
        send(FrameEvent::Tell { text: with_address(key!("page.link_to.bad"), address.trim()) });
    }
}

fn open(address: String) {
    coming(1);
    spawn_local(async move {
        match fetched(address.trim()).await {
            Ok(file) => send(FilesEvent::Fetched { files: vec![file] }),
            Err(text) => send(FrameEvent::Tell { text }),
        }
        coming(0);
    });
}

fn tidy(asked: &UrlSearchParams, name: &str) {
    asked.delete(name);
    let rest = String::from(asked.to_string());
    let (path, hash) =
        (window().location().pathname().unwrap_or_default(), window().location().hash().unwrap_or_default());
    let query = if rest.is_empty() { String::new() } else { format!("?{rest}") };
    let address = format!("{path}{query}{hash}");
    if let Ok(history) = window().history() {
        let _ = history.replace_state_with_url(&JsValue::NULL, "", Some(&address));
    }
}

fn with_address(key: &'static str, address: &str) -> Text {
    Text::Key { key, args: vec![("address", address.to_owned())] }
}

async fn fetched(address: &str) -> Result<(String, Vec<u8>), Text> {
    let here = window().location().href().unwrap_or_default();
    let bad = || with_address(key!("page.link_to.bad"), address);
    let url = Url::new_with_base(address, &here).map_err(|_| bad())?;
    if !matches!(url.protocol().as_str(), "https:" | "http:") {
        return Err(bad());
    }
    let asked = RequestInit::new();
    asked.set_credentials(RequestCredentials::Omit);
    asked.set_mode(RequestMode::Cors);
    // A browser does not reveal whether the file is missing or the site forbids access (CORS).
    let unreachable = |_| with_address(key!("page.link_to.unreachable"), &url.href());
    let answer = JsFuture::from(window().fetch_with_str_and_init(&url.href(), &asked)).await;
    let answer: Response = answer.map_err(unreachable)?.unchecked_into();
    if !answer.ok() {
        let args = vec![("address", url.href()), ("status", answer.status().to_string())];
        return Err(Text::Key { key: key!("page.link_to.status"), args });
    }
    let said = answer.headers().get("content-length").ok().flatten().and_then(|length| length.parse().ok());
    let too_large = || Text::Key {
        key: key!("page.link_to.too_large"),
        args: vec![("most", (MOST_BYTES / 1024 / 1024).to_string())],
    };
    if said.is_some_and(|bytes: usize| bytes > MOST_BYTES) {
        return Err(too_large());
    }
    let bytes = bytes_of(&answer).await.map_err(unreachable)?.ok_or_else(too_large)?;
    let name = url.pathname().rsplit('/').next().unwrap_or_default().to_owned();
    let name = js_sys::decode_uri_component(&name).map_or(name, String::from);
    Ok((if name.is_empty() { "board".to_owned() } else { name }, bytes))
}

/// Reads an answer in pieces; `None` if it exceeds the limit, in which case the rest is not downloaded.
async fn bytes_of(answer: &Response) -> Result<Option<Vec<u8>>, JsValue> {
    let Some(body) = answer.body() else { return Ok(Some(Vec::new())) };
    let pieces: Pieces = body.get_reader().unchecked_into();
    let mut bytes = Vec::new();
    loop {
        let piece = pieces.read().await?;
        if Reflect::get(&piece, &"done".into())?.is_truthy() {
            return Ok(Some(bytes));
        }
        let piece: Uint8Array = Reflect::get(&piece, &"value".into())?.unchecked_into();
        if bytes.len() + piece.length() as usize > MOST_BYTES {
            let _ = pieces.cancel().await;
            return Ok(None);
        }
        bytes.extend(piece.to_vec());
    }
}

/// The shared files; deletes them from the cache.
async fn put_by() -> Result<Vec<(String, Vec<u8>)>, JsValue> {
    let caches = window().caches()?;
    let scope = Url::new_with_base("./", &window().location().href()?)?.href();
    let name = format!("{SHARED}{scope}");
    let cache: Cache = JsFuture::from(caches.open(&name)).await?.unchecked_into();
    let asked: Array = JsFuture::from(cache.keys()).await?.unchecked_into();
    let mut files = Vec::new();
    for request in asked.iter().map(JsCast::unchecked_into::<Request>) {
        let answer: Response = JsFuture::from(cache.match_with_request(&request)).await?.unchecked_into();
        let bytes = Uint8Array::new(&JsFuture::from(answer.array_buffer()?).await?).to_vec();
        let name = request.url().rsplit('/').next().unwrap_or_default().to_owned();
        files.push((js_sys::decode_uri_component(&name).map_or(name, String::from), bytes));
    }
    let _ = JsFuture::from(caches.delete(&name)).await;
    Ok(files)
}
