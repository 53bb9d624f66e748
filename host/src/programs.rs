//! Uploaded programs by key; only the newest are saved.

use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::wire::program;

/// Most programs; the oldest is dropped first.
const MOST: usize = 8;

/// A program with its key.
pub struct Upload {
    key: String,
    bytes: Vec<u8>,
}

impl Upload {
    /// `bytes` under `key`, their SHA-256, if they are a program. Reading a large one takes a while.
    pub fn checked(key: &str, bytes: Vec<u8>) -> Result<Self, Diagnostic> {
        if program::key(&bytes) != key {
            return Err(error!("control.wrong_key"));
        }
        program::decode(&bytes)?;
        Ok(Self { key: key.to_owned(), bytes })
    }
}

/// Keys and bytes, the oldest first.
#[derive(Default)]
pub(crate) struct Programs(Vec<(String, Vec<u8>)>);

impl Programs {
    pub(crate) fn of(known: Option<(String, Vec<u8>)>) -> Self {
        Self(known.into_iter().collect())
    }

    /// Saves a program. The program named by `stays` is never dropped.
    pub(crate) fn keep(&mut self, Upload { key, bytes }: Upload, stays: Option<&String>) {
        self.0.retain(|(other, _)| *other != key);
        self.0.push((key, bytes));
        if self.0.len() > MOST {
            let goes = self.0.iter().position(|(other, _)| stays != Some(other));
            self.0.remove(goes.unwrap_or(0));
        }
    }

    /// Takes over the programs of `before`, as older ones.
    pub(crate) fn follow(&mut self, before: Self) {
        for (key, bytes) in std::mem::replace(&mut self.0, before.0) {
            self.0.retain(|(other, _)| *other != key);
            self.0.push((key, bytes));
        }
    }

    pub(crate) fn bytes(&self, key: &str) -> Option<&[u8]> {
        self.0.iter().find(|(other, _)| other == key).map(|(_, bytes)| bytes.as_slice())
    }
}
