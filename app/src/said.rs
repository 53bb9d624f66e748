//! A sentence that is said later: its key in the locale tables with what goes into it, or a diagnostic of the core.
//!
//! ```text
//! key!("page.state.ready")      a key, checked against the tables like those of the screens
//! ```
//!
//! Comes in: keys, arguments, diagnostics. Goes out: plain data. Does not know the language.

use annulus_core::diagnostic::Diagnostic;

/// A key, to be said later.
macro_rules! key {
    ($key:literal) => {
        $key
    };
}
pub(crate) use key;

/// A sentence for people, in no language yet.
#[derive(Clone, Debug, PartialEq)]
pub enum Text {
    /// A key of the locale tables, and what goes into its sentence by name.
    Key {
        /// The key.
        key: &'static str,
        /// Names and values.
        args: Vec<(&'static str, String)>,
    },
    /// What the core found; its message is said.
    Found(Diagnostic),
}

impl Text {
    /// The sentence of `key`, which takes nothing.
    pub const fn of(key: &'static str) -> Self {
        Self::Key { key, args: Vec::new() }
    }
}
