//! A table of fields of one type: settings of a machine, parameters of a job, values of a tool. File, page,
//! command line, manual and tests use the tables.
//!
//! ```text
//! fields! { Machine;
//!     ("foot.time", "ms", Number(0.0, 5_000.0), BUILT, foot.time_ms)         key, unit, kind, flags, place
//!     ("x.scale", "steps", Number(0.01, 1e5), BUILT; |m| …, |m, v| …)        or read and write
//! }
//! ```

use super::Machine;
use super::value::{Value, ValueKind};
pub(crate) use super::value::{number, text};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::units::Length;

/// What a person sets up: the groups of the settings, in the order of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    Machine,
    Motion,
    Spindle,
    Tools,
    Probing,
    Wiring,
}

impl Group {
    pub const ALL: [Self; 6] =
        [Self::Machine, Self::Motion, Self::Spindle, Self::Tools, Self::Probing, Self::Wiring];

    /// Its word in addresses and message keys.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Machine => "machine",
            Self::Motion => "motion",
            Self::Spindle => "spindle",
            Self::Tools => "tools",
            Self::Probing => "probing",
            Self::Wiring => "wiring",
        }
    }
}

/// Attributes of a field, as a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Flags(u16);

impl Flags {
    pub(crate) const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// True if all of `wanted` are set.
    const fn has(self, wanted: Self) -> bool {
        self.0 & wanted.0 == wanted.0
    }
}

pub(crate) const NONE: Flags = Flags(0);
/// The step stream depends on it, so that it is part of the fingerprint.
pub(crate) const STREAM: Flags = Flags(1);
/// A drill is built from it: after a change, the position is lost.
pub(crate) const BUILT: Flags = Flags(1 << 1);
/// It selects which hardware is driven. For safety, only the machine file changes it, never a page.
pub(crate) const FILE: Flags = Flags(1 << 2).and(BUILT);
/// It describes the wiring of an adapter. A page that drives the adapter directly, without a machine file,
/// may change it.
pub(crate) const ADAPTER: Flags = Flags(1 << 3).and(FILE);
/// Its numbers are pairs.
pub(crate) const PAIRS: Flags = Flags(1 << 4);
/// Its numbers are boxes of four: low X, low Y, high X, high Y.
pub(crate) const BOXES: Flags = Flags(1 << 5);
/// Most people never change it: the page folds it away.
pub(crate) const ADVANCED: Flags = Flags(1 << 6);
/// The page lists it under probing, not in the group of its section.
pub(crate) const PROBING: Flags = Flags(1 << 7);
/// Without meaning on a machine with one spindle.
pub(crate) const SEVERAL: Flags = Flags(1 << 8);
/// Without meaning on a controller that plans its own motion.
pub(crate) const STEPS: Flags = Flags(1 << 9);

/// One row of a table of fields of `T`.
#[derive(Clone, Copy, Debug)]
pub struct Field<T: 'static> {
    /// Section and name, for example `x.max_speed`.
    pub key: &'static str,
    /// Unit of the numbers; empty for words.
    pub unit: &'static str,
    pub kind: ValueKind,
    pub(crate) flags: Flags,
    /// Its value; `None` if the row is not for this object, or if the machine gives the value.
    pub(crate) read: fn(&T) -> Option<Value>,
    pub(crate) write: fn(&mut T, &Value),
    /// For a row with a default from the machine.
    pub(crate) of_machine: Option<OfMachine<T>>,
}

/// One row of the table of machine settings.
pub type Setting = Field<Machine>;

/// A default from the machine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OfMachine<T: 'static> {
    /// True if the row is for this object.
    pub(crate) has: fn(&T) -> bool,
    /// The machine's value.
    pub(crate) usual: fn(&T, &Machine) -> Value,
    /// Resets to the machine's value.
    pub(crate) clear: fn(&mut T),
}

/// The word in files for a value from the machine.
pub const OF_MACHINE: &str = "machine";

impl<T> Field<T> {
    /// The value set in `of`; `None` if the row is not for it, or if the machine gives the value.
    pub fn get(&self, of: &T) -> Option<Value> {
        (self.read)(of)
    }

    /// The value in `of` on `machine`; `None` if the row is not for it.
    pub fn value_on(&self, of: &T, machine: &Machine) -> Option<Value> {
        let given =
            || self.of_machine.as_ref().filter(|own| (own.has)(of)).map(|own| (own.usual)(of, machine));
        self.get(of).or_else(given)
    }

    /// True if the row is for `of`.
    pub fn belongs_to(&self, of: &T) -> bool {
        self.get(of).is_some() || self.is_of_machine(of)
    }

    /// True if the machine gives the value, because none is set.
    pub fn is_of_machine(&self, of: &T) -> bool {
        self.get(of).is_none() && self.of_machine.as_ref().is_some_and(|own| (own.has)(of))
    }

    /// True if the machine gives a default.
    pub fn follows_machine(&self) -> bool {
        self.of_machine.is_some()
    }

    /// The name after the dot.
    pub fn name(&self) -> &'static str {
        self.key.split_once('.').map_or(self.key, |(_, name)| name)
    }

    /// Sets the value in `of`. On error nothing changes. The word [`OF_MACHINE`] resets it.
    pub fn set(&self, of: &mut T, value: &Value) -> Result<(), Diagnostic> {
        if !self.belongs_to(of) {
            return Err(error!("work.not_of_this_kind", key = self.key));
        }
        if let (Some(own), Value::Text(word)) = (&self.of_machine, value)
            && word == OF_MACHINE
        {
            (own.clear)(of);
            return Ok(());
        }
        let group = match self.flags {
            flags if flags.has(BOXES) => 4,
            flags if flags.has(PAIRS) => 2,
            _ => 1,
        };
        if let Value::Numbers(numbers) = value
            && !numbers.len().is_multiple_of(group)
        {
            let uneven = error!("work.uneven_list", key = self.key, ..);
            return Err(uneven.with("count", numbers.len()).with("group", group));
        }
        match self.kind.refusal(self.key, self.unit, value) {
            Some(refusal) => Err(refusal),
            None => {
                (self.write)(of, value);
                Ok(())
            }
        }
    }

    /// Key of a job parameter's message in the locale tables.
    pub fn sentence_key(&self) -> String {
        format!("work.{}", self.key.replace('.', "_"))
    }
}

impl Setting {
    /// The value in `machine`: every machine has every setting.
    pub fn value(&self, machine: &Machine) -> Value {
        self.get(machine).unwrap_or(Value::Numbers(Vec::new()))
    }

    /// Message key of the name.
    pub fn name_key(&self) -> String {
        format!("setting.{}", self.key.replace('.', "_"))
    }

    /// Message key of what the name doesn't say.
    pub fn help_key(&self) -> String {
        format!("setting_help.{}", self.key.replace('.', "_"))
    }

    /// True if the step stream depends on it, so that it is part of the fingerprint.
    pub fn shapes_stream(&self) -> bool {
        self.flags.has(STREAM)
    }

    /// True if a drill is built from it: after a change, the position is lost.
    pub fn is_built_from(&self) -> bool {
        self.flags.has(BUILT)
    }

    /// Its group on the page; `of_section` is that of its section.
    pub fn group(&self, of_section: Group) -> Group {
        if self.flags.has(PROBING) { Group::Probing } else { of_section }
    }

    /// True if the page folds it away.
    pub fn is_advanced(&self) -> bool {
        self.flags.has(ADVANCED)
    }

    /// True if it has a meaning on `machine`. `plans` is true for a controller that plans its own motion.
    pub fn is_used(&self, machine: &Machine, plans: bool) -> bool {
        let is_several = machine.spindles > 1 || !self.flags.has(SEVERAL);
        is_several && !(plans && self.flags.has(STEPS))
    }

    /// True if only the machine file changes it.
    pub(super) fn is_in_file_only(&self) -> bool {
        self.flags.has(FILE)
    }

    /// True if it describes the wiring of an adapter.
    pub(super) fn is_adapter_wiring(&self) -> bool {
        self.flags.has(ADAPTER)
    }
}

/// A type of values in fields.
pub(crate) trait FieldValue {
    fn value(&self) -> Value;

    /// Takes `value`; one of another kind changes nothing.
    fn set(&mut self, value: &Value);
}

/// A type of numbers in fields; lengths are in mm.
pub(crate) trait Numeric: Copy {
    fn number(self) -> f64;
    fn of(number: f64) -> Self;
}

impl Numeric for Length {
    fn number(self) -> f64 {
        self.mm()
    }

    fn of(number: f64) -> Self {
        Self::from_mm(number)
    }
}

macro_rules! numeric {
    ($($type:ty),+) => {$(
        impl Numeric for $type {
            fn number(self) -> f64 {
                f64::from(self)
            }

            fn of(number: f64) -> Self {
                number as Self
            }
        }
    )+};
}
numeric!(f64, i8, u8, u16, u32);

macro_rules! single {
    ($($type:ty),+) => {$(
        impl FieldValue for $type {
            fn value(&self) -> Value {
                Value::Number(self.number())
            }

            fn set(&mut self, value: &Value) {
                if let Value::Number(number) = value {
                    *self = Self::of(*number);
                }
            }
        }
    )+};
}
single!(f64, i8, u8, u32, Length);

impl<T: Numeric> FieldValue for Vec<T> {
    fn value(&self) -> Value {
        Value::Numbers(self.iter().map(|item| item.number()).collect())
    }

    fn set(&mut self, value: &Value) {
        if let Value::Numbers(numbers) = value {
            *self = numbers.iter().map(|number| T::of(*number)).collect();
        }
    }
}

impl FieldValue for String {
    fn value(&self) -> Value {
        Value::Text(self.clone())
    }

    fn set(&mut self, value: &Value) {
        if let Value::Text(text) = value {
            self.clone_from(text);
        }
    }
}

/// The kind of a `bool`.
pub(crate) const YES_NO: ValueKind = ValueKind::Choice(&["no", "yes"]);

impl FieldValue for bool {
    fn value(&self) -> Value {
        Value::Text(if *self { "yes" } else { "no" }.to_owned())
    }

    fn set(&mut self, value: &Value) {
        if let Value::Text(word) = value {
            *self = word == "yes";
        }
    }
}

/// The words of an enum in fields; all of them are its `KIND`.
macro_rules! words {
    ($type:ty: $($word:literal => $variant:path),+ $(,)?) => {
        impl $type {
            pub(crate) const KIND: $crate::machine::ValueKind =
                $crate::machine::ValueKind::Choice(&[$($word),+]);
        }

        impl $crate::machine::field::FieldValue for $type {
            fn value(&self) -> $crate::machine::Value {
                $crate::machine::Value::Text(match self { $($variant => $word),+ }.to_owned())
            }

            fn set(&mut self, value: &$crate::machine::Value) {
                if let $crate::machine::Value::Text(word) = value {
                    match word.as_str() {
                        $($word => *self = $variant,)+
                        _ => {}
                    }
                }
            }
        }
    };
}

/// Rows of a table of fields of one type.
macro_rules! fields {
    (@row $of:ty; $key:expr, $unit:expr, $kind:expr, $flags:expr; $read:expr, $write:expr) => {
        $crate::machine::Field::<$of> {
            key: $key,
            unit: $unit,
            kind: $kind,
            flags: $flags,
            read: $read,
            write: $write,
            of_machine: None,
        }
    };
    (@row $of:ty; $key:expr, $unit:expr, $kind:expr, $flags:expr, $($place:tt)+) => {
        fields!(@row $of; $key, $unit, $kind, $flags;
            |of: &$of| Some($crate::machine::field::FieldValue::value(&of.$($place)+)),
            |of: &mut $of, value: &$crate::machine::Value| {
                $crate::machine::field::FieldValue::set(&mut of.$($place)+, value);
            })
    };
    ($of:ty; $(($($row:tt)+))+) => {
        &[$(fields!(@row $of; $($row)+)),+]
    };
}
pub(crate) use {fields, words};
