//! Every text on the page: keys of the locale tables, in the chosen language.
//!
//! ```text
//! t!("page.stop")               a boxed closure: text that follows the language
//! say!("page.hole", n = 3)      a String, now (for closures that already follow the language)
//! key!("page.state.ready")      the key, checked like the others
//! ```

use crate::format::Unit;
use crate::page::{self, read};
use crate::said::Text;
pub(crate) use crate::said::key;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::locale;
use leptos::prelude::*;
use leptos::reactive::diagnostics::SpecialNonReactiveZone;

/// Reactive text. One boxed type for all, so that the code that shows it is compiled once.
pub(crate) type Words = Box<dyn Fn() -> String + Send + Sync>;

/// Text that follows the language.
macro_rules! t {
    ($($of:tt)*) => { Box::new(move || $crate::i18n::say!($($of)*)) as $crate::i18n::Words };
}
macro_rules! say {
    ($key:literal $(, $name:ident = $value:expr)* $(,)?) => {{
        const _: () =
            assert!(annulus_core::locale::fits($key, &[$(stringify!($name)),*], true), "wrong key or arguments");
        $crate::i18n::text($key, &[$((stringify!($name), ($value).to_string())),*])
    }};
}
pub(crate) use {say, t};

/// The current language. Reading it inside an effect subscribes to changes; elsewhere it is read once.
pub fn language() -> String {
    let _once_is_fine = SpecialNonReactiveZone::enter();
    page::language().and_then(|language| language.try_get()).unwrap_or_else(|| locale::FALLBACK.to_owned())
}

pub fn sentence(text: &Text) -> String {
    match text {
        Text::Key { key, args } => self::text(key, args),
        Text::Found(diagnostic) => message(diagnostic),
    }
}

pub fn text(key: &str, args: &[(&str, String)]) -> String {
    let args: Vec<_> = args.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
    locale::text(&language(), key, &args)
}

pub fn number(text: impl AsRef<str>) -> String {
    locale::number(&language(), text.as_ref())
}

pub fn unit_word() -> String {
    match read(|m| m.frame.unit) {
        Unit::Millimetre => say!("page.unit.mm"),
        Unit::Inch => say!("page.unit.inch"),
    }
}

/// The word for a unit in the locale tables; some languages write it differently.
pub fn unit_of(unit: &'static str) -> String {
    if unit == "rpm" { say!("page.unit.rpm") } else { unit.to_owned() }
}

/// The message: event and meaning.
pub fn message(diagnostic: &Diagnostic) -> String {
    diagnostic.message(&language())
}

pub fn advice(diagnostic: &Diagnostic) -> String {
    diagnostic.advice(&language())
}
