//! Watches the files that the open board was read from: checks them whenever the user returns to the page.
//!
//! ```text
//!   drop, picker, file handler ─▶ handles ─▶ page gets focus ─▶ written since? ─▶ AnewEvent::OnDisk
//! ```
//!
//! Needs file handles, which not every browser offers.

use super::limits::{too_much_of, unreadable};
use crate::browser::window;
use crate::model::{AnewEvent, FilesEvent, FrameEvent};
use crate::page::send;
use js_sys::{Array, Function, Object, Promise, Reflect, Uint8Array};
use leptos::ev;
use leptos::prelude::{on_cleanup, window_event_listener};
use leptos::task::spawn_local;
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{
    DataTransferItemList, File, FileSystemDirectoryHandle, FileSystemFileHandle, FileSystemHandle,
};

#[derive(Clone)]
struct One {
    name: String,
    handle: FileSystemFileHandle,
    /// When it was written, ms since 1970.
    written_ms: f64,
}

#[derive(Clone, Default)]
pub(super) struct Followed(Rc<RefCell<Vec<One>>>);

/// Handles of dropped items. They must be requested during the drop event.
pub(super) fn handles(items: &DataTransferItemList) -> Vec<Promise> {
    let ask = |index| {
        let item = items.get(index)?;
        let ask: Function = Reflect::get(&item, &"getAsFileSystemHandle".into()).ok()?.dyn_into().ok()?;
        ask.call0(&item).ok()?.dyn_into().ok()
    };
    (0..items.length()).filter_map(ask).collect()
}

/// Handles of the files that the user picks; `None` if the browser has no such picker.
pub(super) fn picked() -> Option<Promise> {
    let pick: Function = Reflect::get(&window(), &"showOpenFilePicker".into()).ok()?.dyn_into().ok()?;
    let options = Object::new();
    Reflect::set(&options, &"multiple".into(), &true.into()).ok()?;
    pick.call1(&window(), &options).ok()?.dyn_into().ok()
}

impl Followed {
    /// Listens for focus, and for files that the system opens with the page.
    pub(super) fn listen(&self) {
        let looking = self.clone();
        let looked = window_event_listener(ev::focus, move |_| looking.look());
        on_cleanup(move || looked.remove());
        self.take_launched();
    }

    /// Watches the files `names` with their times of writing, if they are among `handles` or in folders among
    /// them. Replaces watched files of equal name.
    pub(super) async fn follow(&self, names: Vec<(String, f64)>, handles: Vec<Promise>) {
        let mut roots: Vec<FileSystemHandle> = Vec::new();
        for handle in handles {
            if let Ok(handle) = JsFuture::from(handle).await
                && handle.is_object()
            {
                roots.push(handle.unchecked_into());
            }
        }
        let mut found = Vec::new();
        for (name, written_ms) in names {
            let mut parts = name.split('/');
            let root = parts.next().and_then(|first| roots.iter().find(|root| root.name() == first));
            let Some(root) = root else { continue };
            if let Some(handle) = inside(root.clone(), parts).await {
                found.push(One { name, handle, written_ms });
            }
        }
        self.add(found);
    }

    /// Watches these files in place of those of equal name.
    fn add(&self, found: Vec<One>) {
        let mut followed = self.0.borrow_mut();
        followed.retain(|one| !found.iter().any(|other| other.name == one.name));
        followed.extend(found);
    }

    /// Reads and watches files; reports those that are unreadable or that all together are too large.
    pub(super) async fn read(&self, handles: Vec<FileSystemFileHandle>) -> Vec<(String, Vec<u8>)> {
        let mut given = Vec::new();
        for handle in handles {
            match file_of(&handle).await {
                Some(file) => given.push((handle, file)),
                None => send(FrameEvent::Say { text: unreadable(handle.name()) }),
            }
        }
        if let Some(text) = too_much_of(given.iter().map(|(_, file)| file)) {
            send(FrameEvent::Say { text });
            return Vec::new();
        }
        let (mut files, mut found) = (Vec::new(), Vec::new());
        for (handle, file) in given {
            match bytes_of(&file).await {
                Some(bytes) => {
                    files.push((file.name(), bytes));
                    found.push(One { name: file.name(), handle, written_ms: file.last_modified() });
                }
                None => send(FrameEvent::Say { text: unreadable(file.name()) }),
            }
        }
        self.add(found);
        files
    }

    /// Reports the files that were written since the last check.
    fn look(&self) {
        let followed = self.clone();
        spawn_local(async move {
            let all = followed.0.borrow().clone();
            let mut written = Vec::new();
            for one in all {
                let Some(file) = file_of(&one.handle).await else { continue };
                if file.last_modified() != one.written_ms {
                    written.push((one.name, file));
                }
            }
            let mut anew = Vec::new();
            let said = too_much_of(written.iter().map(|(_, file)| file));
            for (name, file) in written {
                // Too much to read: remember the new times, so that the user sees the message only once.
                if said.is_some() {
                    followed.seen(&name, file.last_modified());
                } else if let Some(bytes) = bytes_of(&file).await {
                    followed.seen(&name, file.last_modified());
                    anew.push((name, bytes));
                }
            }
            if let Some(text) = said {
                send(FrameEvent::Say { text });
            }
            if !anew.is_empty() {
                send(AnewEvent::OnDisk { files: anew });
            }
        });
    }

    fn seen(&self, name: &str, written_ms: f64) {
        let mut followed = self.0.borrow_mut();
        followed.iter_mut().filter(|one| one.name == name).for_each(|one| one.written_ms = written_ms);
    }

    /// Opens the files that the system opens with the page, now and later.
    fn take_launched(&self) {
        let queue = Reflect::get(&window(), &"launchQueue".into()).unwrap_or(JsValue::UNDEFINED);
        let set =
            Reflect::get(&queue, &"setConsumer".into()).ok().and_then(|set| set.dyn_into::<Function>().ok());
        let Some(set) = set else { return };
        let followed = self.clone();
        let launched = Closure::<dyn FnMut(JsValue)>::new(move |launch: JsValue| {
            let files = Reflect::get(&launch, &"files".into()).ok();
            let Some(files) = files.and_then(|files| files.dyn_into::<Array>().ok()) else { return };
            let (followed, handles) = (followed.clone(), files.iter().map(JsCast::unchecked_into).collect());
            spawn_local(async move {
                let files = followed.read(handles).await;
                if !files.is_empty() {
                    send(FilesEvent::Chosen { files });
                }
            });
        });
        let _ = set.call1(&queue, launched.as_ref());
        launched.forget();
    }
}

/// The file at `path` below `root`; `root` itself if the path is empty.
async fn inside<'a>(
    root: FileSystemHandle,
    path: impl Iterator<Item = &'a str>,
) -> Option<FileSystemFileHandle> {
    let mut here = root;
    let mut path = path.peekable();
    while let Some(part) = path.next() {
        let folder: FileSystemDirectoryHandle = here.dyn_into().ok()?;
        let next = if path.peek().is_some() {
            folder.get_directory_handle(part)
        } else {
            folder.get_file_handle(part)
        };
        here = JsFuture::from(next).await.ok()?.unchecked_into();
    }
    here.dyn_into().ok()
}

async fn file_of(handle: &FileSystemFileHandle) -> Option<File> {
    JsFuture::from(handle.get_file()).await.ok()?.dyn_into().ok()
}

/// The bytes of a file; `None` if it cannot be read, for example because it was written meanwhile.
pub(super) async fn bytes_of(file: &File) -> Option<Vec<u8>> {
    let buffer = JsFuture::from(file.array_buffer()).await.ok()?;
    Some(Uint8Array::new(&buffer).to_vec())
}
