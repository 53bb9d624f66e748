//! Tests that every parameter of an axis, of the system and of the process has an effect. Changed one at a
//! time, each changes a stream, a cycle, a plan or an output, or is refused. The table is that of the
//! manual's page on the machine.

use crate::programs::{Chance, one_by_one, random_program};
use annulus_core::board::{Board, Hole};
use annulus_core::cam::toolpaths::{Means, lower_work, plan_work};
use annulus_core::cam::work::Work;
use annulus_core::cam::{HoleOrder, PlanOptions};
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Leg, Mark, Otherwise};
use annulus_core::machine::{self, Machine, Steps, Value, preset, six_spindles, virtual_drill};
use annulus_core::magazine::{Change, Held, StockedTool, ToolStock, change_s};
use annulus_core::motion::cycles;
use annulus_core::pins::Motors;
use annulus_core::units::Length;
use annulus_core::{check, motion, queue, steps};
use std::fs;
use std::path::Path;

/// One aspect of a machine, as text for comparison.
pub(crate) type Look = fn(&Machine) -> String;

fn stream(machine: &Machine) -> String {
    let mut program = random_program(&mut Chance::new(3), machine, 4);
    let deep = Length::from_mm(-0.2);
    let mill =
        |x: f64, y: f64| Command::Mill { to: Point::from_mm(x, y), height: deep, feed_um_per_s: 9_000 };
    let commands = vec![
        Command::Rapid { to: Point::from_mm(5.0, 5.0) },
        Command::Plunge { to: deep, feed_um_per_s: 1_000, gate: None },
        mill(15.0, 5.0),
        mill(15.0, 9.0),
        mill(5.0, 9.3),
        Command::Retract { to: machine.process.safe_height },
    ];
    let last = program.legs.len() - 1;
    program.legs.insert(last, Leg { mark: Mark::Toolpath(0), commands });
    let timeline = match motion::timeline(&program, machine) {
        Ok(timeline) => timeline,
        Err(why) => return why.code,
    };
    steps::stream(&timeline, machine).map_or_else(|why| why.code, |stream| steps::digest(&stream))
}

/// Positions of the tools on the board's surface.
fn tips(machine: &Machine) -> String {
    format!("{:?}", annulus_core::check::corner_zero(machine))
}

fn homing(machine: &Machine) -> String {
    format!("{:?}", cycles::home(machine).unwrap())
}

/// A manual drill cycle, as in the Lab.
fn stroke(machine: &Machine) -> String {
    let mut from = Steps::default();
    from[2] = machine.z.scale.steps(machine.process.surface + machine.process.safe_height);
    let bottom = Length::ZERO - machine.process.board_thickness;
    format!("{:?}", cycles::stroke(machine, from, bottom, None).unwrap())
}

/// The downward move to a board whose height is probed, and to just above it, which takes less time.
fn touch(machine: &Machine) -> String {
    let mut to = Steps::default();
    to[2] = machine.z.scale.steps(machine.process.surface);
    let down = |otherwise| cycles::touch(machine, (Steps::default(), to), Some(otherwise)).unwrap();
    let (touches, nears) = (down(Otherwise::Alarm), down(Otherwise::GoOn));
    let ticks = |timeline: &motion::Timeline| timeline.moves[0].duration_ticks;
    assert!(ticks(&nears) < ticks(&touches) && 6 * ticks(&nears) > ticks(&touches));
    format!("{touches:?} {nears:?}")
}

fn plan(machine: &Machine) -> String {
    let hole = |x: f64, size_um: i64| Hole {
        at: Point::from_mm(x, 4.0),
        diameter: Some(Length::from_um(size_um)),
        plated: None,
        source: 0,
        tool_code: 1,
        line: 1,
    };
    let board = Board { holes: vec![hole(1.0, 800), hole(2.0, 840), hole(3.0, 1_000)], ..Board::default() };
    let work = Work::drilling(&board, machine, HoleOrder::File);
    let options = PlanOptions::default();
    let means = Means { options: &options, rapid_time: &|a, b| a.distance_mm(b) };
    let (planned, _) = plan_work(&board, &work, machine, &means, &mut |_| true).unwrap();
    let program = lower_work(&planned, &work, machine);
    format!("{:b} {:?}", program.spindles, program.legs)
}

fn change(machine: &Machine) -> String {
    let bit = |number: i64| annulus_core::job::Bit {
        diameter: Length::from_um(100 * number),
        name: String::new(),
        cutter: annulus_core::job::Cutter::Drill,
        handling: Default::default(),
    };
    let tool = |number: u32| StockedTool { number, bit: bit(i64::from(number)) };
    let spindle = Held::Tool { tool: tool(1), place: Some(0) };
    let mut stock = ToolStock::reported(vec![None, Some(tool(2))], spindle, machine).unwrap();
    let at = Steps::default();
    let mut change = Change::new(&mut stock, &bit(2), (at, [false; 2])).unwrap().unwrap();
    let mut all = String::new();
    while let Some(step) = change.step() {
        let work = match change.begin(machine, &mut stock, (at, step.before().on)) {
            Ok(work) => work,
            Err(why) => return all + &why.code,
        };
        all += &format!("{step:?} {work:?}\n");
        change.done(machine, &mut stock, step.after().on).unwrap();
    }
    all + &format!("{:?}", change_s(machine, true))
}

/// Whether the machine has a tool magazine, and how tools are changed.
fn mode(machine: &Machine) -> String {
    format!("{:?} {:?}", machine.has_magazine(), machine.tool_change)
}

fn parking(machine: &Machine) -> String {
    format!("{:?}", queue::park(machine, Steps::default()).unwrap())
}

/// The moves to the position for a manual tool change, with known tool lengths.
fn changing(machine: &Machine) -> String {
    let zero = [400, 800];
    let moves = queue::to_change(machine, machine.on_surface(), zero, true).unwrap();
    format!("{moves:?} {}", machine.has_equal_lengths())
}

fn executor(machine: &Machine) -> String {
    format!("{:?} {:?}", Motors::of(machine), machine.output_names())
}

fn levels(machine: &Machine) -> String {
    format!("{:?}", [0, 1].map(|byte| machine.wiring().low_bits(byte)))
}

fn with_magazine() -> Machine {
    let on = ("rack.change".to_owned(), Value::Text("magazine".to_owned()));
    machine::apply(&one_by_one(), &[on]).unwrap()
}

fn with_foot() -> Machine {
    let on = ("foot.on".to_owned(), Value::Text("yes".to_owned()));
    machine::apply(&one_by_one(), &[on]).unwrap()
}

/// A virtual drill whose X homes to an index pulse.
fn with_index() -> Machine {
    machine::apply(&virtual_drill(), &[("x.index".to_owned(), Value::Text("yes".to_owned()))]).unwrap()
}

fn parked_apart() -> Machine {
    machine::apply(&virtual_drill(), &[("park.at".to_owned(), Value::Text("place".to_owned()))]).unwrap()
}

/// Result of the independent check for holes and cuts, measured from the corner.
fn verdict(machine: &Machine) -> String {
    let program = random_program(&mut Chance::new(3), machine, 4);
    let timeline = motion::timeline(&program, machine).unwrap();
    let stream = steps::stream(&timeline, machine).unwrap();
    format!("{:?}", check::verify(&stream, machine, check::corner_zero(machine)))
}

pub(crate) const LOOKS: &[Look] =
    &[plan, stream, verdict, tips, homing, stroke, touch, mode, parking, executor, levels, change, changing];

/// Machines such that every setting has a meaning on at least one of them.
pub(crate) fn machines() -> Vec<Machine> {
    let lab = machine::lab();
    let all =
        [virtual_drill(), six_spindles(), lab, with_magazine(), with_foot(), with_index(), parked_apart()];
    let index = ["y.index", "z.index"].map(|key| (key.to_owned(), Value::Text("yes".to_owned())));
    let with_others = machine::apply(&virtual_drill(), &index).unwrap();
    all.into_iter().chain([breakout(), with_others]).collect()
}

fn breakout() -> Machine {
    preset("breakout").unwrap()
}

/// The paper's name, the setting's key, another value, the machine, and the aspect that must change.
type Row = (&'static str, &'static str, Value, fn() -> Machine, Look);

fn rows() -> Vec<Row> {
    let number = Value::Number;
    let list = |numbers: &[f64]| Value::Numbers(numbers.to_vec());
    let word = |word: &str| Value::Text(word.to_owned());
    vec![
        ("installed", "machine.spindles", number(2.0), six_spindles, stream),
        ("enabled", "spindle.enabled", list(&[1.0, 0.0, 1.0]), six_spindles, plan),
        ("depth of each Z", "spindle.deeper", list(&[0.0, 0.3]), six_spindles, stream),
        ("offset of each Z", "spindle.longer", list(&[0.0, 0.3]), six_spindles, tips),
        ("margin of each Z", "spindle.margin", list(&[0.0, 40.0]), six_spindles, stream),
        ("home direction", "x.home_end", word("max"), virtual_drill, homing),
        ("backlash", "x.backlash", number(0.1), virtual_drill, stream),
        ("maximum speed", "x.max_speed", number(20.0), virtual_drill, stream),
        ("maximum acceleration", "y.max_acceleration", number(900.0), virtual_drill, stream),
        ("S ratio", "x.max_jerk", number(40_000.0), virtual_drill, stream),
        ("S ratio", "motion.plane", word("linear"), virtual_drill, stream),
        ("pulse equivalent", "x.scale", number(100.0), virtual_drill, stream),
        ("pulse equivalent", "x.scale_per", word("inch"), virtual_drill, stream),
        ("gear numerator", "x.gear_up", number(3.0), virtual_drill, stream),
        ("gear denominator", "z.gear_down", number(2.0), virtual_drill, stream),
        ("feedback direction", "parallel.outputs_low", list(&[9.0, 1.0]), breakout, levels),
        ("home speed", "z.home_speed", number(12.0), virtual_drill, homing),
        ("search distance", "y.home_search", number(260.0), virtual_drill, homing),
        ("offset move", "x.home_offset", number(2.0), virtual_drill, homing),
        ("index pulse", "x.index", word("yes"), virtual_drill, homing),
        ("index pulse", "x.index_within", number(3.0), with_index, homing),
        ("depth-check distance", "stroke.feed_height", number(0.5), virtual_drill, stroke),
        ("interpolation accuracy", "motion.corner", number(0.05), virtual_drill, stream),
        ("in-position period", "stroke.settle", number(25.0), virtual_drill, stream),
        ("magazine coordinates", "magazine.x", list(&[60.0, 90.0]), with_magazine, change),
        ("magazine coordinates", "magazine.y", list(&[180.0; 8]), with_magazine, change),
        ("magazine coordinates", "magazine.height", number(-22.0), with_magazine, change),
        ("magazine coordinates", "magazine.pause_x", number(35.0), with_magazine, change),
        ("magazine coordinates", "magazine.pause_y", number(140.0), with_magazine, change),
        ("magazine delay", "magazine.clamp_time", number(700.0), with_magazine, change),
        ("magazine delay", "magazine.spin_down", number(2_500.0), with_magazine, change),
        ("magazine clamp", "magazine.clamp", word("drawbar"), with_magazine, executor),
        ("presser foot", "foot.on", word("yes"), one_by_one, stream),
        ("presser foot", "foot.time", number(90.0), with_foot, stream),
        ("presser foot", "foot.output", word("press"), with_foot, executor),
        ("parking", "park.at", word("place"), virtual_drill, parking),
        ("parking", "park.x", number(40.0), parked_apart, parking),
        ("parking", "park.y", number(180.0), parked_apart, parking),
        ("tool change by hand", "change.at", word("zero"), virtual_drill, changing),
        ("tool change by hand", "change.height", number(12.0), virtual_drill, changing),
        ("tool change by hand", "change.lengths", word("touch"), virtual_drill, changing),
        ("depth detection", "stroke.contact_tolerance", number(0.3), virtual_drill, executor),
        ("depth-detection speed", "stroke.touch_speed", number(0.4), virtual_drill, touch),
        ("broken-bit tolerance", "stroke.contact_tolerance", number(0.1), virtual_drill, executor),
        ("feed", "stroke.feed", number(6.0), virtual_drill, plan),
        ("lift speed", "z.max_speed", number(30.0), virtual_drill, stream),
        ("down speed", "motion.down_speed", number(20.0), virtual_drill, stream),
        ("working stroke", "stroke.board_thickness", number(1.0), virtual_drill, plan),
        ("working stroke", "stroke.breakthrough", number(0.8), virtual_drill, plan),
        ("working stroke", "stroke.safe_height", number(3.0), virtual_drill, plan),
        ("lower dead point", "stroke.surface", number(-29.0), virtual_drill, stroke),
        ("spindle speed", "spindle.speed", number(24_000.0), virtual_drill, plan),
        ("maximum spindle speed", "spindle.max_speed", number(20_000.0), virtual_drill, plan),
        ("tool-change mode", "rack.change", word("magazine"), virtual_drill, mode),
    ]
}

/// Parameters of every axis with another value for the virtual drill, and the aspect that must change.
fn of_axes() -> Vec<(String, Value, Look)> {
    let number = Value::Number;
    let word = |word: &str| Value::Text(word.to_owned());
    let mut rows: Vec<(String, Value, Look)> = Vec::new();
    for axis in ["x", "y", "z"] {
        let is_z = axis == "z";
        let each: Vec<(&str, Value, Look)> = vec![
            ("max_speed", number(21.0), stream),
            ("max_acceleration", number(900.0), stream),
            ("max_jerk", number(40_000.0), stream),
            ("scale", number(100.0), stream),
            ("scale_per", word("inch"), stream),
            ("gear_up", number(2.0), stream),
            ("gear_down", number(2.0), stream),
            ("home_speed", number(9.0), homing),
            ("home_search", number(390.0), homing),
            ("home_offset", number(3.0), homing),
            ("index", word("yes"), homing),
        ];
        rows.extend(each.into_iter().map(|(name, value, look)| (format!("{axis}.{name}"), value, look)));
        if !is_z {
            rows.push((format!("{axis}.backlash"), number(0.1), stream));
            rows.push((format!("{axis}.home_end"), word("max"), homing));
        }
    }
    rows
}

#[test]
fn every_axis_parameter_has_an_effect() {
    for (key, value, look) in of_axes() {
        let changed = machine::apply(&virtual_drill(), &[(key.clone(), value.clone())]);
        let after = changed.unwrap_or_else(|why| panic!("{key}: {why:?}"));
        assert_ne!(look(&virtual_drill()), look(&after), "{key} = {value} does nothing");
    }
}

#[test]
fn every_parameter_has_an_effect() {
    for (name, key, value, machine, look) in rows() {
        let before = machine();
        // A magazine needs as many places along Y as along X.
        let mut changes = vec![(key.to_owned(), value.clone())];
        if key == "magazine.x" {
            changes.push(("magazine.y".to_owned(), Value::Numbers(vec![190.0; 2])));
        }
        let after = machine::apply(&before, &changes).unwrap_or_else(|why| panic!("{name}, {key}: {why:?}"));
        assert_ne!(look(&before), look(&after), "{name}: {key} = {value} does nothing");
    }
}

#[test]
fn touch_speed_is_limited_by_the_stopping_distance() {
    let mill = machine::hobby_3018();
    let at = |mm_per_s| machine::apply(&mill, &[("stroke.touch_speed".to_owned(), Value::Number(mm_per_s))]);
    // 0.1 mm at 30 mm/s²: 2.44 mm/s.
    assert!(at(2.4).is_ok());
    assert_eq!(at(2.5).unwrap_err()[0].code, "machine.touch_too_fast");
}

#[test]
fn job_selects_the_spindles() {
    let machine = six_spindles();
    let program = random_program(&mut Chance::new(3), &machine, 3);
    let digest = |spindles| {
        let program = annulus_core::job::Program { spindles, ..program.clone() };
        let timeline = motion::timeline(&program, &machine).unwrap();
        steps::digest(&steps::stream(&timeline, &machine).unwrap())
    };
    assert_ne!(digest(0b11_1111), digest(0b10_0001));
}

#[test]
fn manual_lists_every_parameter() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/manual/machine.md");
    let manual = fs::read_to_string(page).unwrap();
    for (name, key, ..) in rows() {
        let said = manual
            .lines()
            .any(|line| line.starts_with('|') && line.contains(name) && line.contains(&format!("`{key}`")));
        assert!(said, "the manual has no row of {name} with {key}");
    }
}

#[test]
fn gear_ratio_is_exact_over_any_distance() {
    let mut scale = virtual_drill().x.scale;
    (scale.gear_up, scale.gear_down) = (3, 7);
    for turns in [1_i64, 7, 70, 7_000_000] {
        // 80 steps per millimetre, times 3/7.
        assert_eq!(scale.steps(Length::from_um(7_000 * turns)), 240 * turns);
        assert_eq!(scale.length(240 * turns), Length::from_um(7_000 * turns));
    }
    assert!((scale.steps_per_mm() - 240.0 / 7.0).abs() < 1e-12);
}
