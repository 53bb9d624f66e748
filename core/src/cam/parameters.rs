//! Table of a job's parameters: key, unit, range, get and set. Used by job files, the command line and the
//! page.
//!
//! The message of each key is `work.<key with dots as underscores>` in the locale tables.
//!
//! ```text
//!   SETUP       rows of the setup                      [setup]       in a job file
//!   BIT         rows of a tool                         [[bit]]
//!   OPERATION   rows of an operation; rows of other    [[operation]]
//!               kinds have no value
//! ```

use super::HoleOrder;
use super::work::{
    Clear, CutDirection, CutOut, CutSide, Drill, Flip, Holes, Isolate, Lines, MillHoles, Operation,
    OperationKind, Setup, Work, Zero,
};
use crate::board::Face;
use crate::diagnostic::{Diagnostic, nearest};
use crate::error;
use crate::geometry::{Bounds, Point};
use crate::job::{Bit, Cutter};
use crate::machine::{Machine, Value, ValueKind};
use crate::units::Length;

/// One row of the table, a parameter of `T`.
#[derive(Clone, Copy, Debug)]
pub struct Parameter<T: 'static> {
    /// Group and name, for example `isolate.passes`; names are unique within a `T`.
    pub key: &'static str,
    /// Unit of the numbers, empty for words.
    pub unit: &'static str,
    pub kind: ValueKind,
    /// Its value; `None` if the row is not for this object, or if the machine gives the value.
    get: fn(&T) -> Option<Value>,
    set: fn(&mut T, &Value),
    /// For a row with a default from the machine.
    of_machine: Option<OfMachine<T>>,
}

/// A default from the machine.
#[derive(Clone, Copy, Debug)]
struct OfMachine<T: 'static> {
    /// True if the row is for this object.
    has: fn(&T) -> bool,
    /// The machine's value.
    usual: fn(&T, &Machine) -> Value,
    /// Resets to the machine's value.
    clear: fn(&mut T),
}

/// The word in files for a value from the machine.
pub const OF_MACHINE: &str = "machine";

impl<T> Parameter<T> {
    /// The value set in `of`; `None` if the row is not for it, or if the machine gives the value.
    pub fn value(&self, of: &T) -> Option<Value> {
        (self.get)(of)
    }

    /// The value in `of` on `machine`; `None` if the row is not for it.
    pub fn value_on(&self, of: &T, machine: &Machine) -> Option<Value> {
        let given =
            || self.of_machine.as_ref().filter(|own| (own.has)(of)).map(|own| (own.usual)(of, machine));
        self.value(of).or_else(given)
    }

    /// True if the row is for `of`.
    pub fn belongs_to(&self, of: &T) -> bool {
        self.value(of).is_some() || self.is_of_machine(of)
    }

    /// True if the machine gives the value, because none is set.
    pub fn is_of_machine(&self, of: &T) -> bool {
        self.value(of).is_none() && self.of_machine.as_ref().is_some_and(|own| (own.has)(of))
    }

    /// True if the machine gives a default.
    pub fn follows_machine(&self) -> bool {
        self.of_machine.is_some()
    }

    /// The name after the dot.
    pub fn name(&self) -> &'static str {
        self.key.split_once('.').map_or(self.key, |(_, name)| name)
    }

    /// Key of its message in the locale tables.
    pub fn sentence_key(&self) -> String {
        format!("work.{}", self.key.replace('.', "_"))
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
        let group = match (self.key, value) {
            ("setup.exclusions", Value::Numbers(_)) => 4,
            (_, Value::Numbers(_)) => 2,
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
                (self.set)(of, value);
                Ok(())
            }
        }
    }
}

/// The row of `table` called `name`, with or without its group.
pub fn find<T>(table: &'static [Parameter<T>], name: &str) -> Option<&'static Parameter<T>> {
    table.iter().find(|row| row.key == name || row.name() == name)
}

/// Sets `key` in `work`: `setup.…` in its setup, `operation.…` in every operation, and rows of a kind in
/// every operation of that kind. `isolate.depth` is `operation.depth` in every isolation. Numbers and words
/// are text. Fails if the row is unknown or no operation has it.
pub fn assign(work: &mut Work, key: &str, text: &str) -> Result<(), Diagnostic> {
    let unknown = || {
        let known = SETUP.iter().map(|row| row.key).chain(OPERATION.iter().map(|row| row.key));
        let diagnostic = error!("work.unknown_key", key = key, ..);
        diagnostic.with("nearest", nearest(key, known))
    };
    if let Some(row) = SETUP.iter().find(|row| row.key == key) {
        return row.set(&mut work.setup, &valued(row.kind, text));
    }
    let kind = key.split_once('.').filter(|(kind, _)| OperationKind::WORDS.contains(kind));
    let shared = kind.map(|(_, name)| format!("operation.{name}"));
    let own = |row: &&Parameter<Operation>| row.key == key || Some(row.key) == shared.as_deref();
    let row = OPERATION.iter().find(own).ok_or_else(unknown)?;
    let mut found = false;
    let meant = |operation: &&mut Operation| {
        let of_kind = kind.is_none_or(|(kind, _)| operation.action.word() == kind);
        row.belongs_to(operation) && (of_kind || row.key == key)
    };
    for operation in work.operations.iter_mut().filter(meant) {
        row.set(operation, &valued(row.kind, text))?;
        found = true;
    }
    if found { Ok(()) } else { Err(error!("work.nothing_has", key = key)) }
}

/// Converts text to the kind of value; remains text if it is no number.
fn valued(kind: ValueKind, text: &str) -> Value {
    let plain = || Value::Text(text.to_owned());
    let list = text.trim();
    // In a job file a list is in brackets.
    let list = list.strip_prefix('[').and_then(|list| list.strip_suffix(']')).unwrap_or(list);
    let numbers = || list.split([',', ' ']).filter(|word| !word.is_empty()).map(|word| word.parse().ok());
    match kind {
        ValueKind::Text(_) | ValueKind::Choice(_) | ValueKind::Tools => plain(),
        ValueKind::Number(..) | ValueKind::Whole(..) => {
            text.trim().parse().map_or_else(|_| plain(), Value::Number)
        }
        ValueKind::Numbers(..) | ValueKind::Wholes(..) => {
            numbers().collect::<Option<Vec<f64>>>().map_or_else(plain, Value::Numbers)
        }
    }
}

fn number(value: &Value) -> f64 {
    if let Value::Number(number) = value { *number } else { 0.0 }
}

fn text(value: &Value) -> &str {
    if let Value::Text(text) = value { text } else { "" }
}

/// Pairs of numbers as points.
fn points(value: &Value) -> Vec<Point> {
    let Value::Numbers(numbers) = value else { return Vec::new() };
    numbers.as_chunks::<2>().0.iter().map(|[x, y]| Point::from_mm(*x, *y)).collect()
}

fn pairs(points: impl IntoIterator<Item = Point>) -> Value {
    Value::Numbers(points.into_iter().flat_map(|at| [at.x.mm(), at.y.mm()]).collect())
}

/// Pairs of a drill's diameter in mm and its angle in degrees.
fn drill_points(value: &Value) -> Vec<(Length, f64)> {
    let Value::Numbers(numbers) = value else { return Vec::new() };
    numbers.as_chunks::<2>().0.iter().map(|[drill, degrees]| (Length::from_mm(*drill), *degrees)).collect()
}

/// Names separated by semicolons; without any semicolon, by commas.
fn names(value: &Value) -> Vec<String> {
    let between = if text(value).contains(';') { ';' } else { ',' };
    text(value).split(between).map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

/// The inverse of [`names`]: the name of a V-bit contains a comma.
fn named(names: &[String]) -> Value {
    let comma = names.iter().any(|name| name.contains(','));
    let text = names.join(if comma { "; " } else { ", " });
    Value::Text(if comma && names.len() == 1 { text + ";" } else { text })
}

macro_rules! row {
    ($key:literal, $unit:literal, $kind:expr, $get:expr, $set:expr) => {
        Parameter { key: $key, unit: $unit, kind: $kind, get: $get, set: $set, of_machine: None }
    };
}
/// A row of every operation with a default from the machine.
macro_rules! speed {
    ($key:literal, $unit:literal, $kind:expr, $field:ident as $number:ty) => {
        Parameter {
            key: $key,
            unit: $unit,
            kind: $kind,
            get: |o: &Operation| o.$field.map(|value| Value::Number(f64::from(value))),
            set: |o: &mut Operation, v: &Value| o.$field = Some(number(v) as $number),
            of_machine: Some(OfMachine {
                has: |_| true,
                usual: |o, machine| Value::Number(f64::from(o.speeds(machine).$field)),
                clear: |o| o.$field = None,
            }),
        }
    };
}
/// A row of the field that `$part` reaches, read by `$read` and written by `$write`.
macro_rules! part {
    ($key:literal, $unit:literal, $kind:expr, $variant:ident :: $field:ident, $read:expr, $write:expr) => {
        row!(
            $key,
            $unit,
            $kind,
            |o: &Operation| match &o.action {
                OperationKind::$variant($variant { $field, .. }) => Some($read($field)),
                _ => None,
            },
            |o: &mut Operation, v: &Value| if let OperationKind::$variant(part) = &mut o.action {
                part.$field = $write(v);
            }
        )
    };
}
macro_rules! mm {
    ($key:literal, $low:literal, $high:literal, $variant:ident :: $field:ident) => {
        part!(
            $key,
            "mm",
            ValueKind::Number($low, $high),
            $variant::$field,
            |length: &Length| Value::Number(length.mm()),
            |v: &Value| Length::from_mm(number(v))
        )
    };
}
macro_rules! plain {
    ($key:literal, $unit:literal, $low:literal, $high:literal, $variant:ident :: $field:ident) => {
        part!(
            $key,
            $unit,
            ValueKind::Number($low, $high),
            $variant::$field,
            |n: &f64| Value::Number(*n),
            number
        )
    };
}
macro_rules! whole {
    ($key:literal, $low:literal, $high:literal, $variant:ident :: $field:ident) => {
        part!(
            $key,
            "",
            ValueKind::Whole($low, $high),
            $variant::$field,
            |n: &u32| Value::Number(f64::from(*n)),
            |v: &Value| number(v) as u32
        )
    };
}
macro_rules! flag {
    ($key:literal, $variant:ident :: $field:ident) => {
        part!($key, "", ValueKind::Choice(&["no", "yes"]), $variant::$field, yes_no, |v: &Value| text(v)
            == "yes")
    };
}
macro_rules! words {
    ($key:literal, $variant:ident :: $field:ident, $($word:literal => $value:path),+) => {
        row!($key, "", ValueKind::Choice(&[$($word),+]),
            |o: &Operation| match &o.action {
                OperationKind::$variant(part) => {
                    Some(Value::Text(match part.$field { $($value => $word),+ }.to_owned()))
                }
                _ => None,
            },
            |o: &mut Operation, v: &Value| if let OperationKind::$variant(part) = &mut o.action {
                part.$field = match text(v) { $($word => $value,)+ _ => part.$field };
            })
    };
}
macro_rules! list {
    ($key:literal, $variant:ident :: $field:ident) => {
        part!($key, "", ValueKind::Text(400), $variant::$field, |bits: &Vec<String>| named(bits), names)
    };
}

fn yes_no(yes: &bool) -> Value {
    Value::Text(if *yes { "yes" } else { "no" }.to_owned())
}

fn face_word(face: Face) -> Value {
    Value::Text(if face == Face::Top { "top" } else { "bottom" }.to_owned())
}

fn face(value: &Value) -> Face {
    if text(value) == "bottom" { Face::Bottom } else { Face::Top }
}

const FACES: ValueKind = ValueKind::Choice(&["top", "bottom"]);
/// Boxes as four numbers each: low X, low Y, high X, high Y.
const PLACES: ValueKind = ValueKind::Numbers(-2000.0, 2000.0);

fn zones(setup: &Setup) -> Option<Value> {
    Some(pairs(setup.exclusions.iter().flat_map(|zone| [zone.min, zone.max])))
}

fn set_zones(setup: &mut Setup, value: &Value) {
    let corners = points(value);
    let boxes = corners.as_chunks::<2>().0.iter().map(|[a, b]| Bounds::of(*a).with(*b));
    setup.exclusions = boxes.collect();
}

macro_rules! setup {
    ($key:literal, $kind:expr, $($field:ident).+) => {
        row!($key, "mm", $kind, |s: &Setup| Some(Value::Number(s.$($field).+.mm())),
            |s: &mut Setup, v: &Value| s.$($field).+ = Length::from_mm(number(v)))
    };
}
macro_rules! count {
    ($key:literal, $low:literal, $high:literal, $($field:ident).+) => {
        row!($key, "", ValueKind::Whole($low, $high), |s: &Setup| Some(Value::Number(f64::from(s.$($field).+))),
            |s: &mut Setup, v: &Value| s.$($field).+ = number(v) as u32)
    };
}

/// The rows of the setup.
pub const SETUP: &[Parameter<Setup>] = &[
    row!("setup.face", "", FACES, |s: &Setup| Some(face_word(s.face)), |s: &mut Setup, v: &Value| s.face =
        face(v)),
    row!(
        "setup.flip",
        "",
        ValueKind::Choice(&["left_right", "top_bottom"]),
        |s: &Setup| Some(Value::Text(
            if s.flip == Flip::LeftRight { "left_right" } else { "top_bottom" }.to_owned()
        )),
        |s: &mut Setup, v: &Value| s.flip =
            if text(v) == "top_bottom" { Flip::TopBottom } else { Flip::LeftRight }
    ),
    count!("setup.columns", 1.0, 50.0, panel.columns),
    count!("setup.rows", 1.0, 50.0, panel.rows),
    setup!("setup.gap", ValueKind::Number(0.0, 100.0), panel.gap),
    count!("setup.pairs", 0.0, 4.0, alignment.pairs),
    setup!("setup.pin", ValueKind::Number(0.3, 10.0), alignment.diameter),
    setup!("setup.pin_margin", ValueKind::Number(0.0, 50.0), alignment.margin),
    setup!("setup.pin_depth", ValueKind::Number(0.0, 30.0), alignment.depth),
    row!(
        "setup.zero",
        "",
        ValueKind::Choice(&["corner", "blank", "file"]),
        |s: &Setup| Some(Value::Text(
            match s.zero {
                Zero::Board => "corner",
                Zero::Blank => "blank",
                Zero::File => "file",
            }
            .to_owned()
        )),
        |s: &mut Setup, v: &Value| s.zero = match text(v) {
            "blank" => Zero::Blank,
            "file" => Zero::File,
            _ => Zero::Board,
        }
    ),
    setup!("setup.margin", ValueKind::Number(0.0, 50.0), margin),
    row!("setup.exclusions", "mm", PLACES, zones, set_zones),
];

fn vee(bit: &Bit) -> Option<(Length, u32)> {
    if let Cutter::Vee { tip, angle_mdeg } = bit.cutter { Some((tip, angle_mdeg)) } else { None }
}

fn form(bit: &Bit) -> Option<Value> {
    let word = match bit.cutter {
        Cutter::Drill => "drill",
        Cutter::Mill => "mill",
        Cutter::Vee { .. } => "vee",
    };
    Some(Value::Text(word.to_owned()))
}

fn set_form(bit: &mut Bit, value: &Value) {
    bit.cutter = match text(value) {
        "drill" => Cutter::Drill,
        "mill" => Cutter::Mill,
        _ if vee(bit).is_some() => bit.cutter,
        _ => Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 30_000 },
    };
}

/// The rows of a tool.
pub const BIT: &[Parameter<Bit>] = &[
    row!(
        "bit.name",
        "",
        ValueKind::Text(60),
        |b: &Bit| Some(Value::Text(b.name.clone())),
        |b: &mut Bit, v: &Value| b.name = text(v).to_owned()
    ),
    row!("bit.form", "", ValueKind::Choice(&["drill", "mill", "vee"]), form, set_form),
    row!(
        "bit.diameter",
        "mm",
        ValueKind::Number(0.05, 20.0),
        |b: &Bit| Some(Value::Number(b.diameter.mm())),
        |b: &mut Bit, v: &Value| b.diameter = Length::from_mm(number(v))
    ),
    row!(
        "bit.tip",
        "mm",
        ValueKind::Number(0.0, 10.0),
        |b: &Bit| vee(b).map(|(tip, _)| Value::Number(tip.mm())),
        |b: &mut Bit, v: &Value| if let Cutter::Vee { tip, .. } = &mut b.cutter {
            *tip = Length::from_mm(number(v));
        }
    ),
    row!(
        "bit.angle",
        "°",
        ValueKind::Number(1.0, 179.0),
        |b: &Bit| vee(b).map(|(_, angle)| Value::Number(f64::from(angle) * 1e-3)),
        |b: &mut Bit, v: &Value| if let Cutter::Vee { angle_mdeg, .. } = &mut b.cutter {
            *angle_mdeg = libm::round(number(v) * 1e3) as u32;
        }
    ),
];

macro_rules! common {
    ($key:literal, $unit:literal, $kind:expr, $get:expr, $set:expr) => {
        row!($key, $unit, $kind, |o: &Operation| Some($get(o)), $set)
    };
}

/// Largest difference between a hole and its drill; default from the machine.
const TOLERANCE: Parameter<Operation> = Parameter {
    key: "drill.tolerance",
    unit: "mm",
    kind: ValueKind::Number(0.0, 1.0),
    get: |o| drill(o)?.tolerance.map(|tolerance| Value::Number(tolerance.mm())),
    set: |o, value| set_tolerance(o, Some(Length::from_mm(number(value)))),
    of_machine: Some(OfMachine {
        has: |o| drill(o).is_some(),
        usual: |_, machine| Value::Number(machine.rack_tolerance.mm()),
        clear: |o| set_tolerance(o, None),
    }),
};

fn drill(operation: &Operation) -> Option<&Drill> {
    if let OperationKind::Drill(drill) = &operation.action { Some(drill) } else { None }
}

fn set_tolerance(operation: &mut Operation, tolerance: Option<Length>) {
    if let OperationKind::Drill(drill) = &mut operation.action {
        drill.tolerance = tolerance;
    }
}

/// The rows of an operation.
pub const OPERATION: &[Parameter<Operation>] = &[
    common!(
        "operation.name",
        "",
        ValueKind::Text(60),
        |o: &Operation| Value::Text(o.name.clone()),
        |o, v| o.name = text(v).to_owned()
    ),
    common!("operation.on", "", ValueKind::Choice(&["no", "yes"]), |o: &Operation| yes_no(&o.on), |o, v| o
        .on =
        text(v) == "yes"),
    common!("operation.face", "", FACES, |o: &Operation| face_word(o.face), |o, v| o.face = face(v)),
    common!("operation.bit", "", ValueKind::Text(60), |o: &Operation| Value::Text(o.bit.clone()), |o, v| o
        .bit =
        text(v).to_owned()),
    speed!("operation.feed", "mm/s", ValueKind::Number(0.01, 500.0), feed_mm_per_s as f64),
    speed!("operation.plunge", "mm/s", ValueKind::Number(0.01, 500.0), plunge_mm_per_s as f64),
    speed!("operation.speed", "rpm", ValueKind::Whole(1.0, 300_000.0), spindle_rpm as u32),
    common!(
        "operation.depth",
        "mm",
        ValueKind::Number(0.0, 30.0),
        |o: &Operation| Value::Number(o.depth.mm()),
        |o, v| o.depth = Length::from_mm(number(v))
    ),
    common!(
        "operation.depth_per_pass",
        "mm",
        ValueKind::Number(0.0, 30.0),
        |o: &Operation| Value::Number(o.depth_per_pass.mm()),
        |o, v| o.depth_per_pass = Length::from_mm(number(v))
    ),
    whole!("isolate.passes", 1.0, 20.0, Isolate::passes),
    plain!("isolate.overlap", "%", 0.0, 95.0, Isolate::overlap_percent),
    words!("isolate.direction", Isolate::direction,
        "climb" => CutDirection::Climb, "conventional" => CutDirection::Conventional),
    mm!("isolate.loop_overlap", 0.0, 10.0, Isolate::loop_overlap),
    flag!("isolate.voronoi", Isolate::voronoi),
    flag!("isolate.slivers", Isolate::slivers),
    list!("isolate.further", Isolate::further),
    plain!("clear.stepover", "%", 5.0, 100.0, Clear::stepover_percent),
    mm!("clear.margin", 0.0, 10.0, Clear::margin),
    words!("clear.direction", Clear::direction,
        "climb" => CutDirection::Climb, "conventional" => CutDirection::Conventional),
    list!("clear.further", Clear::further),
    words!("engrave.of", Engrave::of,
        "legend" => Lines::Legend, "outline" => Lines::Outline, "copper" => Lines::Copper),
    words!("drill.holes", Drill::holes, "board" => Holes::Board, "alignment" => Holes::Alignment),
    words!("drill.order", Drill::order,
        "shortest" => HoleOrder::Shortest, "fastest" => HoleOrder::Fastest, "file" => HoleOrder::File),
    TOLERANCE,
    mm!("drill.peck", 0.0, 30.0, Drill::peck),
    plain!("drill.point", "°", 60.0, 180.0, Drill::point_deg),
    part!(
        "drill.points",
        "",
        ValueKind::Numbers(0.05, 180.0),
        Drill::points,
        |points: &Vec<(Length, f64)>| Value::Numbers(
            points.iter().flat_map(|(drill, degrees)| [drill.mm(), *degrees]).collect()
        ),
        drill_points
    ),
    flag!("mill_holes.slots", MillHoles::slots),
    flag!("mill_holes.holes", MillHoles::holes),
    words!("mill_holes.direction", MillHoles::direction,
        "climb" => CutDirection::Climb, "conventional" => CutDirection::Conventional),
    list!("mill_holes.further", MillHoles::further),
    words!("cut_out.side", CutOut::side, "outside" => CutSide::Outside, "on" => CutSide::On),
    words!("cut_out.direction", CutOut::direction,
        "climb" => CutDirection::Climb, "conventional" => CutDirection::Conventional),
    whole!("cut_out.tabs", 0.0, 100.0, CutOut::tabs),
    mm!("cut_out.tab_width", 0.0, 50.0, CutOut::tab_width),
    mm!("cut_out.tab_height", 0.0, 20.0, CutOut::tab_height),
    part!(
        "cut_out.tab_at",
        "mm",
        PLACES,
        CutOut::tab_at,
        |at: &Vec<Point>| pairs(at.iter().copied()),
        points
    ),
    flag!("cut_out.bites", CutOut::bites),
    mm!("cut_out.bite_hole", 0.1, 5.0, CutOut::bite_hole),
    mm!("cut_out.bite_pitch", 0.1, 20.0, CutOut::bite_pitch),
    plain!("cut_out.ramp", "°", 0.0, 45.0, CutOut::ramp_deg),
    list!("cut_out.further", CutOut::further),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::locale;
    use crate::machine::virtual_drill;

    fn described<T>(table: &[Parameter<T>]) {
        for row in table {
            assert!(
                locale::lookup("en", &row.sentence_key()).is_some(),
                "no sentence {}",
                row.sentence_key()
            );
        }
    }

    #[test]
    fn every_parameter_has_a_text_and_a_settable_value() {
        described(SETUP);
        described(BIT);
        described(OPERATION);
        let machine = virtual_drill();
        let mut seen = 0;
        for word in OperationKind::WORDS {
            let usual = Operation::usual(word, Face::Top).unwrap();
            assert_eq!(usual.action.word(), word);
            for row in OPERATION {
                let Some(value) = row.value_on(&usual, &machine) else {
                    let refusal = row.set(&mut usual.clone(), &Value::Number(1.0)).unwrap_err();
                    assert_eq!(refusal.code, "work.not_of_this_kind");
                    continue;
                };
                let mut same = usual.clone();
                row.set(&mut same, &value).unwrap();
                assert_eq!(row.value(&same), Some(value), "{}", row.key);
                if row.follows_machine() {
                    row.set(&mut same, &Value::Text(OF_MACHINE.to_owned())).unwrap();
                }
                assert_eq!(same, usual, "{}", row.key);
                seen += 1;
            }
        }
        assert!(seen > OPERATION.len());
        assert!(Operation::usual("fold", Face::Top).is_none());
    }

    #[test]
    fn operation_keys_apply_to_one_kind() {
        let operations: Vec<Operation> =
            ["isolate", "drill"].map(|word| Operation::usual(word, Face::Top).unwrap()).into();
        let mut work = Work { operations, ..Work::default() };
        let before = work.operations[1].depth;
        assign(&mut work, "isolate.depth", "0.123").unwrap();
        let depths: Vec<Length> = work.operations.iter().map(|operation| operation.depth).collect();
        assert_eq!(depths, [Length::from_um(123), before]);
        let rows = [
            ("isolate.depht", "0.1", "work.unknown_key"),
            ("isolate.pases", "2", "work.unknown_key"),
            ("mill_holes.depth", "2", "work.nothing_has"),
            ("operation.speed", "0", "machine.setting_range"),
            ("setup.exclusions", "1, 2, 3", "work.uneven_list"),
            ("setup.exclusions", "[1, 2, 3]", "work.uneven_list"),
            ("setup.exclusions", "[1, 2, 3", "machine.setting_kind"),
        ];
        for (key, value, code) in rows {
            let why = assign(&mut work, key, value).unwrap_err();
            assert_eq!(why.code, code, "{key}");
            assert!(code != "machine.setting_kind" || why.advice("en").contains("job file"), "{why:?}");
        }
        assign(&mut work, "setup.exclusions", "[1, 2, 3, 4]").unwrap();
        let zone = work.setup.exclusions[0];
        assert_eq!((zone.min, zone.max), (Point::from_mm(1.0, 2.0), Point::from_mm(3.0, 4.0)));
        let why = assign(&mut work, "isolate.pases", "2").unwrap_err();
        assert!(why.message("en").contains("isolate.passes"), "{why:?}");
        let range = assign(&mut work, "isolate.passes", "0").unwrap_err();
        assert!(range.message("en").contains("cannot be 0."), "{range:?}");
    }

    #[test]
    fn names_are_unique_within_each_kind() {
        for word in OperationKind::WORDS {
            let usual = Operation::usual(word, Face::Top).unwrap();
            let mut names: Vec<_> =
                OPERATION.iter().filter(|row| row.belongs_to(&usual)).map(Parameter::name).collect();
            let all = names.len();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), all, "{word}");
        }
    }

    #[test]
    fn invalid_values_are_refused() {
        let mut operation = Operation::usual("isolate", Face::Top).unwrap();
        let before = operation.clone();
        let rows = [
            ("isolate.passes", Value::Number(1.5), "machine.setting_range"),
            ("isolate.passes", Value::Number(21.0), "machine.setting_range"),
            ("isolate.overlap", Value::Number(100.0), "machine.setting_range"),
            ("isolate.direction", Value::Text("left".into()), "machine.setting_choice"),
            ("operation.feed", Value::Text("fast".into()), "machine.setting_kind"),
        ];
        for (key, value, code) in rows {
            let row = find(OPERATION, key).unwrap();
            assert_eq!(row.set(&mut operation, &value).unwrap_err().code, code, "{key}");
            assert_eq!(operation, before);
        }
    }
}
