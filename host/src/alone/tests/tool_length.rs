//! Tests of manual tool changes: at the change position, lifted before any other move, and never a cut with
//! a tool of unknown length.

use super::port::{machine, opened};
use super::world::World;
use super::*;
use annulus_core::wire::{ArmedJob, ChangeReport, LengthKnown};

const PARK_MM: [f64; 2] = [120.0, 80.0];
/// The board is at -30, the change height 20 mm above it.
const SURFACE_MM: f64 = -30.0;
const CHANGE_MM: f64 = -10.0;

fn three_tools() -> Program {
    drilled::holes(&virtual_drill(), 6, 3, |hole| [600, 800, 1_000][hole / 2])
}

/// A drill that changes tools at the park position, with tool lengths as `lengths` sets them.
fn bench(files: &Memory, lengths: &str, speed: f64) -> Bench {
    let word = |word: &str| Value::Text(word.to_owned());
    let rows = [
        ("park.at", word("place")),
        ("park.x", Value::Number(PARK_MM[0])),
        ("park.y", Value::Number(PARK_MM[1])),
        ("change.lengths", word(lengths)),
    ];
    let mut bench = Bench::open_at(files, speed);
    bench.ask(&Ask::Configure {
        changes: rows.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(),
    });
    assert_eq!(bench.refused(), None);
    bench.home();
    bench
}

fn ready(files: &Memory, lengths: &str, speed: f64) -> Bench {
    let mut bench = bench(files, lengths, speed);
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(200));
    bench
}

impl Bench {
    fn change(&mut self) -> ChangeReport {
        let status = self.until(|status| status.state == State::ToolChange);
        let change = status.change.expect("a change of our own");
        let [x, y, z] = status.machine_mm;
        assert!((x - PARK_MM[0]).abs() < 0.02 && (y - PARK_MM[1]).abs() < 0.02, "{:?}", status.machine_mm);
        assert!(z > CHANGE_MM - 3.0, "{z}");
        assert_eq!((change.is_up, change.is_at_place, status.spindle_rpm), (true, true, 0));
        change
    }

    fn tried(&mut self, ask: &Ask) -> Option<String> {
        self.heard.retain(|tell| !matches!(tell, Tell::Refused { .. }));
        self.ask(ask);
        self.turn(Duration::from_millis(200));
        self.refused().map(str::to_owned)
    }

    fn jogged(&mut self, axis: u8, distance_um: i32) -> Option<String> {
        let refused = self.tried(&Ask::Jog { axis, distance_um, anyway: false });
        while self.status().state == State::Jogging {
            self.ask(&Ask::JogOn);
            self.turn(TURN);
        }
        refused
    }

    fn lengths(&self) -> Vec<String> {
        let armed = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Armed(ArmedJob { checks, .. }) => Some(checks.clone()),
            _ => None,
        });
        let codes = armed.unwrap().into_iter().map(|row| row.finding.code);
        codes.filter(|code| code.starts_with("preflight.length")).collect()
    }

    fn surface_mm(&self) -> f64 {
        let told = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Machine { settings, .. } => Some(settings.clone()),
            _ => None,
        });
        let found =
            told.unwrap().into_iter().find(|(key, _)| key == "stroke.surface").map(|(_, value)| value);
        let Some(Value::Number(mm)) = found else { panic!("no surface") };
        mm
    }
}

#[test]
fn equal_lengths_change_at_the_parking_position_without_probing() {
    let (files, program) = (Memory::default(), three_tools());
    let mut bench = ready(&files, "equal", 50.0);
    bench.start(&program, 0);
    assert_eq!(bench.lengths(), ["preflight.lengths_equal"]);
    for bit in 0..3 {
        let change = bench.change();
        assert_eq!((change.bit, change.length), (bit, LengthKnown::Equal));
        bench.ask(&Ask::ToolChanged);
        bench.until(|status| status.state != State::ToolChange);
    }
    assert_eq!(bench.finish(), (Ending::Done, 6));
    let status = bench.until(|status| status.state == State::Ready);
    assert_eq!((status.alarm, status.change), (None, None));
    assert_eq!(against(&files, &program, status.zero_mm.unwrap()), (0, 0));
}

#[test]
fn tool_of_unknown_length_does_not_cut() {
    let (files, program) = (Memory::default(), three_tools());
    let mut bench = ready(&files, "touch", 20.0);
    bench.start(&program, 0);
    assert_eq!(bench.lengths(), ["preflight.length_asked", "preflight.lengths_asked"]);
    // The first tool is requested before the head moves to the board.
    assert_eq!(bench.change().length, LengthKnown::No);
    let refused = |code: &str| Some(code.to_owned());
    assert_eq!(bench.tried(&Ask::ToolChanged), refused("control.length_first"));
    // No tool was measured yet, so none can be as long as the last one.
    assert_eq!(bench.tried(&Ask::SameLength), refused("control.no_length_yet"));
    assert_eq!(bench.tried(&Ask::ToolChanged), refused("control.length_first"));
    for ask in [Ask::Home, Ask::SetZero, Ask::UndoZero] {
        assert_eq!(bench.tried(&ask), refused("control.in_change"), "{ask:?}");
    }
    assert_eq!(bench.status().state, State::ToolChange);
    // To above the board at the change height; X and Y may not move below it.
    assert_eq!(bench.jogged(0, -100_000), None);
    assert_eq!(bench.jogged(1, -60_000), None);
    assert_eq!(bench.jogged(2, -12_000), None);
    assert_eq!(bench.jogged(0, 1_000), refused("control.tip_low"));
    assert_eq!(bench.status().state, State::ToolChange);
    assert_eq!(bench.tried(&Ask::Probe { depth_um: 20_000, plate_um: 0 }), None);
    let status = bench.until(|status| status.state == State::ToolChange);
    assert_eq!(
        status.change.map(|change| (change.length, change.is_up)),
        Some((LengthKnown::Measured, true))
    );
    assert!((bench.surface_mm() - SURFACE_MM).abs() < 0.01, "{}", bench.surface_mm());
    // Back to the change position, then continue.
    assert_eq!(bench.tried(&Ask::Park), None);
    assert_eq!(bench.change().length, LengthKnown::Measured);
    assert_eq!(bench.tried(&Ask::ToolChanged), None);
    // The next tool's length is unknown until the user declares it.
    let change = bench.change();
    assert_eq!((change.bit, change.length), (1, LengthKnown::No));
    assert_eq!(bench.tried(&Ask::ToolChanged), refused("control.length_first"));
    assert_eq!(bench.tried(&Ask::SameLength), None);
    assert_eq!(bench.change().length, LengthKnown::Measured);
    assert_eq!(bench.tried(&Ask::ToolChanged), None);
    // A tool 0.1 mm longer touches the board with the head 0.1 mm higher, and the holes still go through.
    assert_eq!(bench.change().length, LengthKnown::No);
    let surface_mm = bench.surface_mm();
    let z = bench.status().machine_mm[2];
    assert_eq!(bench.jogged(2, ((surface_mm + 0.1 - z) * 1e3) as i32), None);
    assert_eq!(bench.tried(&Ask::SetHeight), None);
    assert!((bench.surface_mm() - surface_mm - 0.1).abs() < 0.01, "{}", bench.surface_mm());
    assert_eq!(bench.tried(&Ask::ToolChanged), None);
    let status = bench.until(|status| status.state == State::Ready);
    assert_eq!(against(&files, &program, status.zero_mm.unwrap()), (0, 0));
    assert_eq!(bench.status().alarm, None);
}

#[test]
fn tool_used_for_zero_counts_for_the_first_change() {
    let (files, program) = (Memory::default(), three_tools());
    let mut bench = ready(&files, "touch", 50.0);
    let z = bench.status().machine_mm[2];
    bench.jogged(2, ((SURFACE_MM - z) * 1e3) as i32);
    assert_eq!(bench.tried(&Ask::SetHeight), None);
    bench.start(&program, 0);
    assert_eq!(bench.lengths(), ["preflight.length_of_first", "preflight.lengths_asked"]);
    assert_eq!(bench.change().length, LengthKnown::Measured);
    bench.ask(&Ask::ToolChanged);
    assert_eq!(bench.change().length, LengthKnown::No);
    // Stop here; the next start with another tool must not use this tool's length.
    bench.ask(&Ask::Stop);
    bench.until(|status| status.state == State::Ready);
    bench.start(&program, 0);
    assert_eq!(bench.change().length, LengthKnown::No);
}

#[test]
fn failed_probe_leaves_the_tool_change_open() {
    let (files, program) = (Memory::default(), three_tools());
    let mut bench = ready(&files, "touch", 50.0);
    bench.start(&program, 0);
    bench.change();
    // The board is 20 mm below. The probing takes several turns, so the next status of the change follows
    // it.
    assert_eq!(bench.tried(&Ask::Probe { depth_um: 15_000, plate_um: 0 }), None);
    let status = bench.until(|status| status.state == State::ToolChange);
    assert_eq!(bench.refused(), Some("level.no_board"));
    assert_eq!((status.alarm, status.trust), (None, Trust::Trusted));
    assert_eq!(status.change.map(|change| (change.length, change.is_up)), Some((LengthKnown::No, true)));
}

const MOMENTS: [&str; 5] = ["asked", "jogging", "touched", "going back", "second asked"];

fn until_moment(bench: &mut Bench, moment: &str) {
    bench.change();
    match moment {
        "asked" => return,
        "jogging" => {
            bench.ask(&Ask::Jog { axis: 2, distance_um: -8_000, anyway: false });
            bench.until(|status| status.state == State::Jogging);
            return;
        }
        _ => {}
    }
    let z = bench.status().machine_mm[2];
    bench.jogged(2, ((SURFACE_MM - z) * 1e3) as i32);
    assert_eq!(bench.tried(&Ask::SetHeight), None);
    if moment == "touched" {
        return;
    }
    bench.ask(&Ask::ToolChanged);
    if moment == "going back" {
        bench.until(|status| status.state == State::Running && status.machine_mm[0] < PARK_MM[0] - 5.0);
        return;
    }
    bench.change();
}

/// Declares the tool as long as the last one, or touches it off if no tool was measured yet.
fn make_known(bench: &mut Bench) {
    if bench.tried(&Ask::SameLength).is_some() {
        let z = bench.status().machine_mm[2];
        assert_eq!(bench.jogged(2, ((SURFACE_MM - z) * 1e3) as i32), None);
        assert_eq!(bench.tried(&Ask::SetHeight), None);
    }
}

fn resumed(bench: &mut Bench) {
    let (key, leg) = bench.offer().unwrap();
    bench.start_again(&key, leg);
    while bench.until(|status| status.state == State::ToolChange || status.job.is_none()).job.is_some() {
        if bench.change().length == LengthKnown::No {
            make_known(bench);
        }
        assert_eq!(bench.tried(&Ask::ToolChanged), None);
    }
}

#[test]
fn tool_change_is_resumed_after_stop_or_kill_at_every_step() {
    let program = three_tools();
    for moment in MOMENTS {
        for kills in [false, true] {
            let files = Memory::default();
            let mut bench = ready(&files, "touch", 20.0);
            let zero_mm = bench.status().zero_mm.unwrap();
            bench.start(&program, 0);
            until_moment(&mut bench, moment);
            if kills {
                bench = self::bench(&files, "touch", 20.0);
            } else {
                bench.ask(&Ask::Stop);
                let status = bench.until(|status| status.state == State::Ready);
                assert_eq!((status.trust, status.change), (Trust::Trusted, None), "{moment}");
            }
            resumed(&mut bench);
            bench.until(|status| status.state == State::Ready);
            assert_eq!(bench.status().alarm, None, "{moment} {kills}");
            assert_eq!(against(&files, &program, zero_mm), (0, 0), "{moment} {kills}");
        }
    }
}

#[test]
fn xy_never_moves_with_a_low_tool_around_a_change() {
    for lengths in ["touch", "equal"] {
        let (files, program) = (Memory::default(), three_tools());
        let mut bench = ready(&files, lengths, 1.0);
        bench.start(&program, 0);
        let (mut before, mut changes) = (bench.status().machine_mm, 0);
        while changes < 2 {
            bench.turn(TURN);
            let now = bench.status().machine_mm;
            let aside = (0..2).any(|axis| (now[axis] - before[axis]).abs() > 0.5);
            let is_far = now[0] > 12.0;
            assert!(!(aside && is_far) || now[2].min(before[2]) > CHANGE_MM - 0.02, "{now:?} {lengths}");
            before = now;
            if bench.status().state == State::ToolChange {
                changes += 1;
                make_known(&mut bench);
                bench.tried(&Ask::ToolChanged);
            }
            if bench.heard.len().is_multiple_of(50) {
                bench.ask(&Ask::Ping { stamp: 0.0 });
            }
        }
    }
}

#[test]
fn adapter_asks_for_the_length_of_each_tool() {
    let files = Memory::default();
    let mut bench = opened(&files, World::new(&machine(), &files), 1);
    bench.ask(&Ask::Configure {
        changes: vec![("change.lengths".to_owned(), Value::Text("touch".to_owned()))],
    });
    bench.home();
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(100));
    let program = drilled::holes(&machine(), 4, 2, |hole| [600, 800][hole / 2]);
    bench.start(&program, 0);
    assert_eq!(bench.lengths(), ["preflight.length_asked", "preflight.lengths_asked"]);
    for bit in 0..2 {
        let status = bench.until(|status| status.state == State::ToolChange);
        let change = status.change.unwrap();
        assert_eq!((change.bit, change.length), (bit, LengthKnown::No));
        assert!(change.is_up && change.is_at_place, "{:?}", status.machine_mm);
        assert_eq!(bench.tried(&Ask::ToolChanged).as_deref(), Some("control.length_first"));
        let wanted_um = (SURFACE_MM - bench.status().machine_mm[2]) * 1e3;
        assert_eq!(bench.jogged(2, wanted_um as i32), None);
        assert_eq!(bench.tried(&Ask::SetHeight), None);
        assert_eq!(bench.tried(&Ask::ToolChanged), None);
    }
    assert_eq!(bench.finish(), (Ending::Done, 4));
    let status = bench.until(|status| status.state == State::Ready);
    assert_eq!(bench.world().real()[..], status.steps[..3], "no step was lost");
    assert_eq!(against(&files, &program, status.zero_mm.unwrap()), (0, 0));
}

#[test]
fn tool_setter_measures_tools_after_one_of_known_length() {
    let (files, program) = (Memory::default(), three_tools());
    let mut bench = ready(&files, "touch", 20.0);
    let refused = |code: &str| Some(code.to_owned());
    assert_eq!(bench.tried(&Ask::MeasureTool), refused("control.nothing_to_do"));
    let number = |key: &str, mm: f64| (key.to_owned(), Value::Number(mm));
    let setter = ("change.setter".to_owned(), Value::Text("yes".to_owned()));
    let changes = vec![setter.clone(), number("change.setter_x", 900.0)];
    assert_eq!(bench.tried(&Ask::Configure { changes }), refused("machine.setter_out_of_reach"));
    bench.start(&program, 0);
    bench.change();
    assert_eq!(bench.tried(&Ask::MeasureTool), refused("control.no_setter"));
    bench.ask(&Ask::Stop);
    bench.until(|status| status.state == State::Ready);
    let changes = vec![setter, number("change.setter_x", 200.0), number("change.setter_y", 150.0)];
    assert_eq!(bench.tried(&Ask::Configure { changes }), None);
    bench.start(&program, 0);
    bench.change();
    // This tool's length is unknown, and no tool has touched the setter.
    assert_eq!(bench.tried(&Ask::MeasureTool), refused("control.no_reference"));
    let wanted_um = (SURFACE_MM - bench.status().machine_mm[2]) * 1e3;
    assert_eq!(bench.jogged(2, wanted_um as i32), None);
    assert_eq!(bench.tried(&Ask::SetHeight), None);
    assert_eq!(bench.tried(&Ask::MeasureTool), None);
    let status = bench.until(|status| status.state == State::ToolChange);
    assert!((status.machine_mm[0] - 200.0).abs() < 0.02, "over the setter: {:?}", status.machine_mm);
    assert_eq!(
        status.change.map(|change| (change.length, change.is_up)),
        Some((LengthKnown::Measured, true))
    );
    let surface_mm = bench.surface_mm();
    assert_eq!(bench.tried(&Ask::ToolChanged), None);
    // Each later tool is compared with the first.
    for _ in 0..2 {
        assert_eq!(bench.change().length, LengthKnown::No);
        assert_eq!(bench.tried(&Ask::MeasureTool), None);
        let status = bench.until(|status| status.state == State::ToolChange);
        assert_eq!(status.change.map(|change| change.length), Some(LengthKnown::Measured));
        assert!((bench.surface_mm() - surface_mm).abs() < 0.01, "{}", bench.surface_mm());
        assert_eq!(bench.tried(&Ask::ToolChanged), None);
    }
    assert_eq!(bench.finish(), (Ending::Done, 6));
    let status = bench.until(|status| status.state == State::Ready);
    assert_eq!(against(&files, &program, status.zero_mm.unwrap()), (0, 0));
    // On another board the comparison is no longer valid.
    bench.start(&program, 0);
    bench.change();
    assert_eq!(bench.tried(&Ask::MeasureTool), refused("control.no_reference"));
    // `change.setter_depth` limits how far Z moves down: 1 mm does not reach the setter.
    bench.ask(&Ask::Stop);
    bench.until(|status| status.state == State::Ready);
    let changes = vec![number("change.setter_depth", 1.0)];
    assert_eq!(bench.tried(&Ask::Configure { changes }), None);
    bench.start(&program, 0);
    bench.change();
    assert_eq!(bench.tried(&Ask::SameLength), None);
    bench.heard.clear();
    bench.ask(&Ask::MeasureTool);
    bench.until(|status| status.state == State::Jogging);
    let status = bench.until(|status| status.state != State::Jogging);
    let why = bench.refused().map(str::to_owned).or(status.alarm.map(|alarm| alarm.code));
    assert_eq!(why.as_deref(), Some("control.setter_not_met"), "{:?}", status.state);
}
