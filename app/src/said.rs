//! A text to show later: a key of the locale tables with its arguments, or a diagnostic of the core.
//!
//! ```text
//! key!("page.state.ready")      a key, checked by the compiler
//! ```

/// A checked key.
pub(crate) use annulus_core::code as key;
use annulus_core::diagnostic::Diagnostic;

/// A text for people, not yet in a language.
#[derive(Clone, Debug, PartialEq)]
pub enum Text {
    Key {
        key: &'static str,
        args: Vec<(&'static str, String)>,
    },
    /// A diagnostic of the core; its message is shown.
    Found(Diagnostic),
}

impl Text {
    /// A key without arguments.
    pub const fn of(key: &'static str) -> Self {
        Self::Key { key, args: Vec::new() }
    }
}
