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
    CutDirection, CutSide, Drill, Flip, Holes, Lines, Operation, OperationKind, Setup, Work, Zero,
};
use crate::board::Face;
use crate::diagnostic::{Diagnostic, nearest};
use crate::error;
use crate::geometry::{Bounds, Point};
use crate::job::{Bit, Cutter};
pub use crate::machine::OF_MACHINE;
use crate::machine::ValueKind::{Choice, Number, Numbers, Text, Whole};
use crate::machine::field::{BOXES, FieldValue, NONE, OfMachine, PAIRS, YES_NO, fields, number, text, words};
use crate::machine::{Field, Value, ValueKind, set_angle, set_tip, tip_and_angle};
use crate::units::Length;

/// The row of `table` called `name`, with or without its group.
pub fn find<T>(table: &'static [Field<T>], name: &str) -> Option<&'static Field<T>> {
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
    let own = |row: &&Field<Operation>| row.key == key || Some(row.key) == shared.as_deref();
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

/// Pairs of numbers as points.
fn points(value: &Value) -> Vec<Point> {
    let Value::Numbers(numbers) = value else { return Vec::new() };
    numbers.as_chunks::<2>().0.iter().map(|[x, y]| Point::from_mm(*x, *y)).collect()
}

fn pairs(points: impl IntoIterator<Item = Point>) -> Value {
    Value::Numbers(points.into_iter().flat_map(|at| [at.x.mm(), at.y.mm()]).collect())
}

fn placed(points: &[Point]) -> Value {
    pairs(points.iter().copied())
}

fn set_placed(own: &mut Vec<Point>, value: &Value) {
    *own = points(value);
}

/// Pairs of a drill's diameter in mm and its angle in degrees.
fn angles(points: &[(Length, f64)]) -> Value {
    Value::Numbers(points.iter().flat_map(|(drill, degrees)| [drill.mm(), *degrees]).collect())
}

fn set_angles(points: &mut Vec<(Length, f64)>, value: &Value) {
    let Value::Numbers(numbers) = value else { return };
    let pairs = numbers.as_chunks::<2>().0.iter();
    *points = pairs.map(|[drill, degrees]| (Length::from_mm(*drill), *degrees)).collect();
}

/// Names separated by semicolons; without any semicolon, by commas.
fn set_named(names: &mut Vec<String>, value: &Value) {
    let between = if text(value).contains(';') { ';' } else { ',' };
    let typed = text(value).split(between).map(str::trim).filter(|name| !name.is_empty());
    *names = typed.map(str::to_owned).collect();
}

/// The inverse of [`set_named`]: the name of a V-bit contains a comma.
fn named(names: &[String]) -> Value {
    let comma = names.iter().any(|name| name.contains(','));
    let text = names.join(if comma { "; " } else { ", " });
    Value::Text(if comma && names.len() == 1 { text + ";" } else { text })
}

words!(Face: "top" => Face::Top, "bottom" => Face::Bottom);
words!(Flip: "left_right" => Flip::LeftRight, "top_bottom" => Flip::TopBottom);
words!(Zero: "corner" => Zero::Board, "blank" => Zero::Blank, "file" => Zero::File);
words!(CutDirection: "climb" => CutDirection::Climb, "conventional" => CutDirection::Conventional);
words!(Lines: "legend" => Lines::Legend, "outline" => Lines::Outline, "copper" => Lines::Copper);
words!(Holes: "board" => Holes::Board, "alignment" => Holes::Alignment);
words!(HoleOrder: "shortest" => HoleOrder::Shortest, "fastest" => HoleOrder::Fastest,
    "file" => HoleOrder::File);
words!(CutSide: "outside" => CutSide::Outside, "on" => CutSide::On);

const PLACES: ValueKind = Numbers(-2000.0, 2000.0);

fn zones(setup: &Setup) -> Option<Value> {
    Some(pairs(setup.exclusions.iter().flat_map(|zone| [zone.min, zone.max])))
}

fn set_zones(setup: &mut Setup, value: &Value) {
    let corners = points(value);
    let boxes = corners.as_chunks::<2>().0.iter().map(|[a, b]| Bounds::of(*a).with(*b));
    setup.exclusions = boxes.collect();
}

/// The rows of the setup.
pub const SETUP: &[Field<Setup>] = fields! { Setup;
    ("setup.face", "", Face::KIND, NONE, face)
    ("setup.flip", "", Flip::KIND, NONE, flip)
    ("setup.columns", "", Whole(1.0, 50.0), NONE, panel.columns)
    ("setup.rows", "", Whole(1.0, 50.0), NONE, panel.rows)
    ("setup.gap", "mm", Number(0.0, 100.0), NONE, panel.gap)
    ("setup.pairs", "", Whole(0.0, 4.0), NONE, alignment.pairs)
    ("setup.pin", "mm", Number(0.3, 10.0), NONE, alignment.diameter)
    ("setup.pin_margin", "mm", Number(0.0, 50.0), NONE, alignment.margin)
    ("setup.pin_depth", "mm", Number(0.0, 30.0), NONE, alignment.depth)
    ("setup.zero", "", Zero::KIND, NONE, zero)
    ("setup.margin", "mm", Number(0.0, 50.0), NONE, margin)
    ("setup.exclusions", "mm", PLACES, BOXES; zones, set_zones)
};

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
        _ if tip_and_angle(&bit.cutter).is_some() => bit.cutter,
        _ => Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 30_000 },
    };
}

/// The rows of a tool.
pub const BIT: &[Field<Bit>] = fields! { Bit;
    ("bit.name", "", Text(60), NONE, name)
    ("bit.form", "", Choice(&["drill", "mill", "vee"]), NONE; form, set_form)
    ("bit.diameter", "mm", Number(0.05, 20.0), NONE, diameter)
    ("bit.tip", "mm", Number(0.0, 10.0), NONE;
        |bit| tip_and_angle(&bit.cutter).map(|(tip, _)| Value::Number(tip.mm())),
        |bit, v| set_tip(&mut bit.cutter, v))
    ("bit.angle", "°", Number(1.0, 179.0), NONE;
        |bit| tip_and_angle(&bit.cutter).map(|(_, mdeg)| Value::Number(f64::from(mdeg) * 1e-3)),
        |bit, v| set_angle(&mut bit.cutter, v))
};

/// A row of every operation.
macro_rules! common {
    ($key:literal, $unit:literal, $kind:expr, $field:ident) => {
        fields!(@row Operation; $key, $unit, $kind, NONE, $field)
    };
}
/// A row of every operation with a default from the machine.
macro_rules! speed {
    ($key:literal, $unit:literal, $kind:expr, $field:ident) => {
        Field::<Operation> {
            of_machine: Some(OfMachine::<Operation> {
                has: |_| true,
                usual: |o, machine| o.speeds(machine).$field.value(),
                clear: |o| o.$field = None,
            }),
            ..fields!(@row Operation; $key, $unit, $kind, NONE;
                |o| o.$field.map(|own| own.value()), |o, v| o.$field.get_or_insert_default().set(v))
        }
    };
}
/// A row of one kind of operation, perhaps with functions that read and write its field.
macro_rules! part {
    ($key:literal, $unit:literal, $kind:expr, $variant:ident :: $field:ident) => {
        part!($key, $unit, $kind, NONE, $variant::$field, FieldValue::value, FieldValue::set)
    };
    ($key:literal, $unit:literal, $kind:expr, $flags:expr, $variant:ident :: $field:ident,
        $read:expr, $write:expr) => {
        fields!(@row Operation; $key, $unit, $kind, $flags;
            |o| if let OperationKind::$variant(part) = &o.action { Some($read(&part.$field)) } else { None },
            |o, v| if let OperationKind::$variant(part) = &mut o.action { $write(&mut part.$field, v) })
    };
}
/// A row of names of tools.
macro_rules! list {
    ($key:literal, $variant:ident :: $field:ident) => {
        part!($key, "", Text(400), NONE, $variant::$field, named, set_named)
    };
}

/// Largest difference between a hole and its drill; default from the machine.
const TOLERANCE: Field<Operation> = Field::<Operation> {
    of_machine: Some(OfMachine::<Operation> {
        has: |o| drill(o).is_some(),
        usual: |_, machine| machine.rack_tolerance.value(),
        clear: |o| set_tolerance(o, None),
    }),
    ..fields!(@row Operation; "drill.tolerance", "mm", Number(0.0, 1.0), NONE;
        |o| drill(o)?.tolerance.map(|own| own.value()),
        |o, v| set_tolerance(o, Some(Length::from_mm(number(v)))))
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
pub const OPERATION: &[Field<Operation>] = &[
    common!("operation.name", "", Text(60), name),
    common!("operation.on", "", YES_NO, on),
    common!("operation.face", "", Face::KIND, face),
    common!("operation.bit", "", Text(60), bit),
    speed!("operation.feed", "mm/s", Number(0.01, 500.0), feed_mm_per_s),
    speed!("operation.plunge", "mm/s", Number(0.01, 500.0), plunge_mm_per_s),
    speed!("operation.speed", "rpm", Whole(1.0, 300_000.0), spindle_rpm),
    common!("operation.depth", "mm", Number(0.0, 30.0), depth),
    common!("operation.depth_per_pass", "mm", Number(0.0, 30.0), depth_per_pass),
    part!("isolate.passes", "", Whole(1.0, 20.0), Isolate::passes),
    part!("isolate.overlap", "%", Number(0.0, 95.0), Isolate::overlap_percent),
    part!("isolate.direction", "", CutDirection::KIND, Isolate::direction),
    part!("isolate.loop_overlap", "mm", Number(0.0, 10.0), Isolate::loop_overlap),
    part!("isolate.voronoi", "", YES_NO, Isolate::voronoi),
    part!("isolate.slivers", "", YES_NO, Isolate::slivers),
    list!("isolate.further", Isolate::further),
    part!("clear.stepover", "%", Number(5.0, 100.0), Clear::stepover_percent),
    part!("clear.margin", "mm", Number(0.0, 10.0), Clear::margin),
    part!("clear.direction", "", CutDirection::KIND, Clear::direction),
    list!("clear.further", Clear::further),
    part!("engrave.of", "", Lines::KIND, Engrave::of),
    part!("drill.holes", "", Holes::KIND, Drill::holes),
    part!("drill.order", "", HoleOrder::KIND, Drill::order),
    TOLERANCE,
    part!("drill.peck", "mm", Number(0.0, 30.0), Drill::peck),
    part!("drill.point", "°", Number(60.0, 180.0), Drill::point_deg),
    part!("drill.points", "", Numbers(0.05, 180.0), PAIRS, Drill::points, angles, set_angles),
    part!("mill_holes.slots", "", YES_NO, MillHoles::slots),
    part!("mill_holes.holes", "", YES_NO, MillHoles::holes),
    part!("mill_holes.direction", "", CutDirection::KIND, MillHoles::direction),
    list!("mill_holes.further", MillHoles::further),
    part!("cut_out.side", "", CutSide::KIND, CutOut::side),
    part!("cut_out.direction", "", CutDirection::KIND, CutOut::direction),
    part!("cut_out.tabs", "", Whole(0.0, 100.0), CutOut::tabs),
    part!("cut_out.tab_width", "mm", Number(0.0, 50.0), CutOut::tab_width),
    part!("cut_out.tab_height", "mm", Number(0.0, 20.0), CutOut::tab_height),
    part!("cut_out.tab_at", "mm", PLACES, PAIRS, CutOut::tab_at, placed, set_placed),
    part!("cut_out.bites", "", YES_NO, CutOut::bites),
    part!("cut_out.bite_hole", "mm", Number(0.1, 5.0), CutOut::bite_hole),
    part!("cut_out.bite_pitch", "mm", Number(0.1, 20.0), CutOut::bite_pitch),
    part!("cut_out.ramp", "°", Number(0.0, 45.0), CutOut::ramp_deg),
    list!("cut_out.further", CutOut::further),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::locale;
    use crate::machine::virtual_drill;

    fn described<T>(table: &[Field<T>]) {
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
                assert_eq!(row.get(&same), Some(value), "{}", row.key);
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
                OPERATION.iter().filter(|row| row.belongs_to(&usual)).map(Field::name).collect();
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
