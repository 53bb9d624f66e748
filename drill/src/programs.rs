//! Programs that were brought, by their keys: the newest, so many and no more.
//!
//! Comes in: a key and bytes. Goes out: the bytes of a key. Does not know jobs: whoever has one says which program stays.

use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::program;

/// So many are kept; the oldest goes first.
const MOST: usize = 8;

/// Keys and bytes, the oldest first.
#[derive(Default)]
pub(crate) struct Programs(Vec<(String, Vec<u8>)>);

impl Programs {
    /// Those that are known from the beginning.
    pub(crate) fn of(known: Option<(String, Vec<u8>)>) -> Self {
        Self(known.into_iter().collect())
    }

    /// Keeps `bytes` under `key`, their SHA-256, if they are a program. That which `stays` does not go for it.
    pub(crate) fn keep(
        &mut self,
        key: &str,
        bytes: Vec<u8>,
        stays: Option<&String>,
    ) -> Result<(), Diagnostic> {
        if program::key(&bytes) != key {
            return Err(Diagnostic::error("control.wrong_key"));
        }
        program::decode(&bytes)?;
        self.0.retain(|(other, _)| other != key);
        self.0.push((key.to_owned(), bytes));
        if self.0.len() > MOST {
            let goes = self.0.iter().position(|(other, _)| stays != Some(other));
            self.0.remove(goes.unwrap_or(0));
        }
        Ok(())
    }

    /// The bytes kept under `key`.
    pub(crate) fn bytes(&self, key: &str) -> Option<&[u8]> {
        self.0.iter().find(|(other, _)| other == key).map(|(_, bytes)| bytes.as_slice())
    }
}
