//! Opens files: picked, dropped (files, folders, zips), or the sample board.
//!
//! ```text
//! drop ─▶ entries ─▶ files, folder by folder ───┐
//! Open… ─▶ the browser's picker, else an input ─┼─▶ (name, bytes)* ─▶ FilesEvent::Chosen, AnewEvent::Chosen
//! sample ─▶ our own server ─────────────────────┘
//!   └─▶ if the browser gives handles, the files are watched
//! ```
//!
//! Files stay in this page: nothing is uploaded.

use super::follow::{self, Followed, bytes_of};
use super::limits::{MOST_FILES, too_much, too_much_of, unreadable};
use crate::browser;
use crate::model::{AnewEvent, FilesEvent, FrameEvent, TemplateEvent};
use crate::page::send;
use crate::said::{Text, key};
use js_sys::{Array, Function, Promise, Reflect};
use leptos::ev;
use leptos::prelude::*;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{
    DataTransfer, File, FileList, FileSystemDirectoryEntry, FileSystemEntry, FileSystemFileEntry,
    FileSystemFileHandle, HtmlInputElement,
};

const SAMPLE_FOLDER: &str = "examples/";
const SAMPLE: [&str; 3] = ["sensor.drl", "sensor-top.gbr", "sensor-outline.gbr"];

type Named = (String, File);

fn toast(text: Text) {
    send(FrameEvent::Say { text });
}

fn chosen_now(files: Vec<(String, Vec<u8>)>) {
    send(FilesEvent::Chosen { files });
}

/// Shows that this many files are being read; 0 ends it.
pub(super) fn coming(files: usize) {
    send(FilesEvent::Coming { files });
}

fn anew_chosen(files: Vec<(String, Vec<u8>)>) {
    send(AnewEvent::Chosen { files });
}

pub(super) fn sample() {
    coming(SAMPLE.len());
    leptos::task::spawn_local(async {
        match fetched_sample().await {
            Some(files) => chosen_now(files),
            None => toast(Text::of(key!("page.open.no_sample"))),
        }
        coming(0);
    });
}

async fn fetched_sample() -> Option<Vec<(String, Vec<u8>)>> {
    let mut files = Vec::new();
    for name in SAMPLE {
        let answer = browser::request("GET", &format!("{SAMPLE_FOLDER}{name}"), &[], None).await?;
        if answer.status != 200 {
            return None;
        }
        files.push((name.to_owned(), answer.body));
    }
    Some(files)
}

type Taken = fn(Vec<(String, Vec<u8>)>);

/// Lets the user pick files, or new exports of the open board. Files from the browser's own picker are
/// watched.
pub(super) fn choose(anew: bool, followed: &Followed) {
    let chosen: Taken = if anew { anew_chosen } else { chosen_now };
    let Some(picked) = follow::picked() else { return choose_by_field(chosen) };
    let followed = followed.clone();
    leptos::task::spawn_local(async move {
        match JsFuture::from(picked).await {
            Ok(handles) => {
                let handles: Vec<FileSystemFileHandle> =
                    Array::from(&handles).iter().map(JsCast::unchecked_into).collect();
                coming(handles.len());
                let files = followed.read(handles).await;
                if !files.is_empty() {
                    chosen(files);
                }
                coming(0);
            }
            // The picker is not allowed in an embedded page.
            Err(why) if !is_called_off(&why) => choose_by_field(chosen),
            Err(_) => {}
        }
    });
}

/// True if the user cancelled.
fn is_called_off(why: &JsValue) -> bool {
    Reflect::get(why, &"name".into()).is_ok_and(|name| name == "AbortError")
}

fn choose_by_field(chosen: Taken) {
    let made =
        document().create_element("input").ok().and_then(|made| made.dyn_into::<HtmlInputElement>().ok());
    let Some(input) = made else { return };
    input.set_type("file");
    input.set_multiple(true);
    let field = input.clone();
    let changed = Closure::once_into_js(move || {
        if let Some(list) = field.files() {
            take(in_list(&list), chosen);
        }
    });
    input.set_onchange(Some(changed.unchecked_ref()));
    input.click();
}

pub(super) fn choose_dialect() {
    let made =
        document().create_element("input").ok().and_then(|made| made.dyn_into::<HtmlInputElement>().ok());
    let Some(input) = made else { return };
    input.set_type("file");
    let chosen = input.clone();
    let changed = Closure::once_into_js(move || {
        let Some(file) = chosen.files().and_then(|files| files.get(0)) else { return };
        leptos::task::spawn_local(async move {
            if let Some(bytes) = bytes_of(&file).await {
                send(TemplateEvent::Keep { text: String::from_utf8_lossy(&bytes).into_owned() });
            }
        });
    });
    input.set_onchange(Some(changed.unchecked_ref()));
    input.click();
}

pub(super) fn listen(followed: Followed) {
    let over = window_event_listener(ev::dragover, |event| {
        if brings_files(&event) {
            event.prevent_default();
            mark(true);
        }
    });
    let leave = window_event_listener(ev::dragleave, |event| {
        if event.related_target().is_none() {
            mark(false);
        }
    });
    let dropped = window_event_listener(ev::drop, move |event| {
        mark(false);
        if let Some(data) = event.data_transfer().filter(|_| brings_files(&event)) {
            event.prevent_default();
            take_drop(&data, &followed);
        }
    });
    on_cleanup(move || {
        over.remove();
        leave.remove();
        dropped.remove();
    });
}

/// True if files from outside are dragged, and not a row of the tree or a text of this page.
fn brings_files(event: &web_sys::DragEvent) -> bool {
    event.data_transfer().is_some_and(|data| data.types().includes(&"Files".into(), 0))
}

fn mark(on: bool) {
    if let Some(body) = document().body() {
        let _ = body.class_list().toggle_with_force("dropping", on);
    }
}

fn in_list(list: &FileList) -> Vec<Named> {
    (0..list.length()).filter_map(|index| list.get(index)).map(|file| (file.name(), file)).collect()
}

/// Entries and handles must be requested before any await: afterwards the drop is empty.
fn take_drop(data: &DataTransfer, followed: &Followed) {
    let items = data.items();
    let handles = follow::handles(&items);
    let followed = followed.clone();
    let entries: Vec<FileSystemEntry> =
        (0..items.length()).filter_map(|index| items.get(index)?.webkit_get_as_entry().ok()?).collect();
    if entries.is_empty() {
        if let Some(list) = data.files() {
            take(in_list(&list), chosen_now);
        }
        return;
    }
    coming(entries.len());
    leptos::task::spawn_local(async move {
        let mut found = Vec::new();
        let mut waiting = entries;
        while let Some(entry) = waiting.pop() {
            if let Some(text) = too_much(found.len() + 1, 0) {
                coming(0);
                return toast(text);
            }
            let name = entry.full_path().trim_start_matches('/').to_owned();
            if entry.is_file() {
                found.extend(file_of(entry.unchecked_into()).await.map(|file| (name, file)));
            } else {
                waiting.extend(inside(entry.unchecked_into()).await);
            }
        }
        found.sort_by(|a, b| a.0.cmp(&b.0));
        let names = found.iter().map(|(name, file)| (name.clone(), file.last_modified())).collect();
        take(found, chosen_now);
        followed.follow(names, handles).await;
    });
}

async fn answer(call: impl FnOnce(&Function, &Function)) -> Option<JsValue> {
    let mut call = Some(call);
    let promise = Promise::new(&mut |resolve, reject| {
        if let Some(call) = call.take() {
            call(&resolve, &reject);
        }
    });
    JsFuture::from(promise).await.ok()
}

async fn file_of(entry: FileSystemFileEntry) -> Option<File> {
    let file = answer(|resolve, reject| entry.file_with_callback_and_callback(resolve, reject)).await?;
    file.dyn_into().ok()
}

/// Reads a folder in portions, until an empty one arrives.
async fn inside(folder: FileSystemDirectoryEntry) -> Vec<FileSystemEntry> {
    let reader = folder.create_reader();
    let mut found = Vec::new();
    loop {
        let portion = answer(|resolve, reject| {
            let _ = reader.read_entries_with_callback_and_callback(resolve, reject);
        });
        let portion = portion.await.and_then(|portion| portion.dyn_into::<Array>().ok());
        match portion {
            Some(portion) if portion.length() > 0 && found.len() < MOST_FILES => {
                found.extend(portion.iter().filter_map(|entry| entry.dyn_into::<FileSystemEntry>().ok()));
            }
            _ => return found,
        }
    }
}

fn take(files: Vec<Named>, chosen: Taken) {
    if let Some(text) = too_much_of(files.iter().map(|(_, file)| file)) {
        coming(0);
        return toast(text);
    }
    coming(files.len());
    leptos::task::spawn_local(async move {
        let mut read = Vec::new();
        for (name, file) in files {
            match bytes_of(&file).await {
                Some(bytes) => read.push((name, bytes)),
                None => toast(unreadable(name)),
            }
        }
        if !read.is_empty() {
            chosen(read);
        }
        coming(0);
    });
}
