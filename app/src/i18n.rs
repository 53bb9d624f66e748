//! Every word on the page comes from here: a key of the locale tables, in the language the person chose.
//!
//! ```text
//! t!("page.stop")               a boxed closure: text that follows the language
//! say!("page.hole", n = 3)      a String, now (inside closures that follow the language by themselves)
//! key!("page.state.ready")      the key, checked like the others
//! ```
//!
//! Comes in: keys and arguments, the language of the page. Goes out: text. Does not know who shows it.

use crate::format::Unit;
use crate::page;
use crate::said::Text;
pub(crate) use crate::said::key;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::locale;
use leptos::prelude::*;
use leptos::reactive::diagnostics::SpecialNonReactiveZone;

/// Text that is made anew whenever what it is made of changes. All of it is of one type, so that what shows it is compiled once.
pub(crate) type Words = Box<dyn Fn() -> String + Send + Sync>;

/// Text that follows the language.
macro_rules! t {
    ($key:literal $(, $name:ident = $value:expr)* $(,)?) => {
        Box::new(move || $crate::i18n::text($key, &[$((stringify!($name), ($value).to_string())),*]))
            as $crate::i18n::Words
    };
}
/// Text now.
macro_rules! say {
    ($key:literal $(, $name:ident = $value:expr)* $(,)?) => {
        $crate::i18n::text($key, &[$((stringify!($name), ($value).to_string())),*])
    };
}
pub(crate) use {say, t};

/// The language now; whoever asks inside an effect follows it, whoever asks elsewhere says something once.
pub fn language() -> String {
    let _once_is_fine = SpecialNonReactiveZone::enter();
    page::language().and_then(|language| language.try_get()).unwrap_or_else(|| locale::FALLBACK.to_owned())
}

/// A sentence that was found before.
pub fn sentence(text: &Text) -> String {
    match text {
        Text::Key { key, args } => self::text(key, args),
        Text::Found(diagnostic) => message(diagnostic),
    }
}

/// The text of `key`.
pub fn text(key: &str, args: &[(&str, String)]) -> String {
    let args: Vec<_> = args.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
    locale::text(&language(), key, &args)
}

/// A measure that stands alone, as the language writes it.
pub fn number(text: impl AsRef<str>) -> String {
    locale::number(&language(), text.as_ref())
}

/// The word for the unit of lengths on show.
pub fn unit_word() -> String {
    match page::frame().unit.get() {
        Unit::Millimetre => say!("page.unit.mm"),
        Unit::Inch => say!("page.unit.inch"),
    }
}

/// The word for the unit of a table, which may have another one in this language.
pub fn unit_of(unit: &'static str) -> String {
    if unit == "rpm" { say!("page.unit.rpm") } else { unit.to_owned() }
}

/// What happened and what it means.
pub fn message(diagnostic: &Diagnostic) -> String {
    diagnostic.message(&language())
}

/// What to do about it.
pub fn advice(diagnostic: &Diagnostic) -> String {
    diagnostic.advice(&language())
}
