//! Every word on the page comes from here: a key of the locale tables, in the language the person chose.
//!
//! ```text
//! t!("page.stop")               a closure: text that follows the language
//! say!("page.hole", n = 3)      a String, now (inside closures that follow the language by themselves)
//! key!("page.state.ready")      the key, checked like the others
//! ```
//!
//! Comes in: keys and arguments. Goes out: text. Does not know who shows it.

use annulus_core::locale;
use annulus_core::remark::Remark;
use leptos::prelude::*;
use leptos::reactive::diagnostics::SpecialNonReactiveZone;
use std::sync::LazyLock;

static LANGUAGE: LazyLock<ArcRwSignal<String>> =
    LazyLock::new(|| ArcRwSignal::new(locale::FALLBACK.to_owned()));

/// The language now; whoever asks inside an effect follows it, whoever asks elsewhere says something once.
pub fn language() -> String {
    let _once_is_fine = SpecialNonReactiveZone::enter();
    LANGUAGE.try_get().unwrap_or_else(|| locale::FALLBACK.to_owned())
}

/// Chooses the language of the page.
pub fn choose(language: &str) {
    LANGUAGE.set(language.to_owned());
}

/// The text of `key`.
pub fn text(key: &str, args: &[(&str, String)]) -> String {
    let args: Vec<_> = args.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
    locale::text(&language(), key, &args)
}

/// What happened and what it means.
pub fn message(remark: &Remark) -> String {
    remark.message(&language())
}

/// What to do about it.
pub fn advice(remark: &Remark) -> String {
    remark.advice(&language())
}

/// Text that follows the language.
macro_rules! t {
    ($key:literal $(, $name:ident = $value:expr)* $(,)?) => {
        move || $crate::i18n::text($key, &[$((stringify!($name), ($value).to_string())),*])
    };
}
/// Text now.
macro_rules! say {
    ($key:literal $(, $name:ident = $value:expr)* $(,)?) => {
        $crate::i18n::text($key, &[$((stringify!($name), ($value).to_string())),*])
    };
}
/// A key, to be said later.
macro_rules! key {
    ($key:literal) => {
        $key
    };
}
pub(crate) use {key, say, t};
