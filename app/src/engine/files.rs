//! The files of a machine in the page: in the site's private folder (OPFS), or in memory if the browser
//! offers none.
//!
//! Only one tab can have a file open; a second one is refused.

use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_host::{File, Files};
use js_sys::Reflect;
use std::collections::BTreeMap;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{
    DedicatedWorkerGlobalScope, FileSystemDirectoryHandle, FileSystemFileHandle,
    FileSystemGetDirectoryOptions, FileSystemGetFileOptions, FileSystemReadWriteOptions,
    FileSystemSyncAccessHandle,
};

pub(super) const DRILL: &str = "annulus-drill";

pub(super) const ADAPTER: &str = "annulus-adapter";

pub(super) enum Store {
    Kept(BTreeMap<File, FileSystemSyncAccessHandle>),
    /// In memory, lost with the page.
    Memory(BTreeMap<File, Vec<u8>>),
}

fn words(error: JsValue) -> String {
    let message = Reflect::get(&error, &"message".into()).ok().and_then(|message| message.as_string());
    message.unwrap_or_else(|| format!("{error:?}"))
}

/// Opens the files in `folder`. Refused if another tab has them open; in memory if the browser has no private
/// folder.
pub(super) async fn open(
    scope: &DedicatedWorkerGlobalScope,
    folder: &str,
    files: &[File],
) -> Result<Store, Diagnostic> {
    let Ok(folder) = folder_of(scope, folder).await else { return Ok(Store::Memory(BTreeMap::new())) };
    let mut kept = BTreeMap::new();
    for &file in files {
        match handle(&folder, file).await {
            Ok(handle) => {
                kept.insert(file, handle);
            }
            Err(error) => {
                kept.values().for_each(FileSystemSyncAccessHandle::close);
                let name = Reflect::get(&error, &"name".into()).ok().and_then(|name| name.as_string());
                return match name.as_deref() {
                    Some("NoModificationAllowedError") => Err(error!("drill.other_tab")),
                    _ => Ok(Store::Memory(BTreeMap::new())),
                };
            }
        }
    }
    Ok(Store::Kept(kept))
}

async fn folder_of(
    scope: &DedicatedWorkerGlobalScope,
    name: &str,
) -> Result<FileSystemDirectoryHandle, JsValue> {
    let storage = Reflect::get(&scope.navigator(), &"storage".into())?;
    if storage.is_undefined() {
        return Err(storage);
    }
    let root = JsFuture::from(scope.navigator().storage().get_directory()).await?;
    let made = FileSystemGetDirectoryOptions::new();
    made.set_create(true);
    let root: FileSystemDirectoryHandle = root.dyn_into()?;
    JsFuture::from(root.get_directory_handle_with_options(name, &made)).await?.dyn_into()
}

async fn handle(
    folder: &FileSystemDirectoryHandle,
    file: File,
) -> Result<FileSystemSyncAccessHandle, JsValue> {
    let made = FileSystemGetFileOptions::new();
    made.set_create(true);
    let file = JsFuture::from(folder.get_file_handle_with_options(file.name(), &made)).await?;
    let file: FileSystemFileHandle = file.dyn_into()?;
    JsFuture::from(file.create_sync_access_handle()).await?.dyn_into()
}

fn put(file: &FileSystemSyncAccessHandle, at: f64, bytes: &[u8]) -> Result<(), JsValue> {
    let place = FileSystemReadWriteOptions::new();
    place.set_at(at);
    let written = file.write_with_u8_array_and_options(bytes, &place)?;
    if written == bytes.len() as f64 { Ok(()) } else { Err("there is no room".into()) }
}

impl Files for Store {
    fn read(&mut self, file: File) -> Result<Vec<u8>, String> {
        match self {
            Self::Memory(files) => Ok(files.get(&file).cloned().unwrap_or_default()),
            Self::Kept(files) => {
                let Some(file) = files.get(&file) else { return Ok(Vec::new()) };
                let mut bytes = vec![0; file.get_size().map_err(words)? as usize];
                let start = FileSystemReadWriteOptions::new();
                start.set_at(0.0);
                let read = file.read_with_u8_array_and_options(&mut bytes, &start).map_err(words)?;
                bytes.truncate(read as usize);
                Ok(bytes)
            }
        }
    }

    fn write(&mut self, file: File, bytes: &[u8]) -> Result<(), String> {
        match self {
            Self::Memory(files) => {
                files.insert(file, bytes.to_vec());
                Ok(())
            }
            Self::Kept(files) => {
                let Some(file) = files.get(&file) else { return Err(String::new()) };
                put(file, 0.0, bytes)
                    .and_then(|()| file.truncate_with_f64(bytes.len() as f64))
                    .and_then(|()| file.flush())
                    .map_err(words)
            }
        }
    }

    fn append(&mut self, file: File, bytes: &[u8]) -> Result<(), String> {
        match self {
            Self::Memory(files) => {
                files.entry(file).or_default().extend_from_slice(bytes);
                Ok(())
            }
            Self::Kept(files) => {
                let Some(file) = files.get(&file) else { return Err(String::new()) };
                file.get_size().and_then(|end| put(file, end, bytes)).map_err(words)
            }
        }
    }
}
