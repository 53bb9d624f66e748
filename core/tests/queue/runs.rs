//! Tests of queues on the virtual drill, without a bridge.

use super::words::{one_in, random_row};
use crate::programs::{Chance, machines};
use annulus_core::job::Input;
use annulus_core::machine::{HomeEnd, Machine, Value, apply, lab, six_spindles, virtual_drill};
use annulus_core::motion::cycles;
use annulus_core::pins::{Pins, Playhead, Recorder, Written};
use annulus_core::queue::{
    Harm, Mode, Rehearsal, Rest, Rig, RowState, Standing, WorkCommand, check, print, read,
};
use annulus_core::steps::TICK_HZ;
use annulus_core::units::Length;
use annulus_core::virtual_drill::{Faults, VirtualDrill, VirtualHole};
use std::sync::{Arc, Mutex};

fn twin(machine: &Machine, faults: Faults) -> (VirtualDrill, Arc<Mutex<Vec<VirtualHole>>>) {
    let holes = Arc::new(Mutex::new(Vec::new()));
    let sink = Arc::clone(&holes);
    (VirtualDrill::new(machine, 3, faults, Box::new(move |hole| sink.lock().unwrap().push(*hole))), holes)
}

fn rehearse(text: &str, bench: Rig) -> Rehearsal {
    let queue = read("q", text).unwrap_or_else(|why| panic!("{why:?}"));
    Rehearsal::new(queue, vec!["lamp".into(), "vacuum".into(), "pump".into()], bench)
}

const FOUR: &str = "\
SPINDLE 20000
REPEAT 2
  MOVE_BY 40 0
  CALL hole
  MOVE_TO 5 10
  CALL hole
END
SUB hole
  KMD_WIERTLO_DOL
  KMD_WIERTLO_GORA
END
";

#[test]
fn queue_drills_holes_at_its_positions() {
    for machine in machines() {
        let (mut twin, holes) = twin(&machine, Faults::default());
        let bench = Rig::homed(&machine, &mut twin).unwrap();
        let home = bench.standing.position;
        assert_eq!(twin.real()[..], home[..3], "{}: homing ends at a known step", machine.name);
        assert_eq!(bench.standing, Standing::just_homed(&machine));
        let mut run = rehearse(FOUR, bench);
        assert_eq!(
            run.go(&machine, Mode::ToEnd, &mut twin, usize::MAX),
            Some(Rest::Done),
            "{}",
            machine.name
        );
        let mm = |axis: usize, steps: i64| machine.axis(axis).scale.length(steps).mm();
        let to = |x: f64, y: f64| {
            let steps = |axis: usize, way| {
                home[axis] + machine.axis(axis).scale.steps(annulus_core::units::Length::from_mm(way))
            };
            (mm(0, steps(0, x)), mm(1, steps(1, y)))
        };
        let (x, y) = (home[0], home[1]);
        let (a, b) = ((mm(0, x + 40), mm(1, y)), to(5.0, 10.0));
        let forty = mm(0, 40) - mm(0, 0);
        let wanted = [a, b, (b.0 + forty, b.1), b];
        let holes = holes.lock().unwrap();
        let spindles = machine.spindles as usize;
        assert_eq!(holes.len(), 4 * spindles, "{}: every spindle has a board of its own", machine.name);
        let first = holes.iter().map(|hole| hole.spindle).min();
        for (hole, (x, y)) in holes.iter().filter(|hole| Some(hole.spindle) == first).zip(wanted) {
            assert!((hole.x_mm - x).abs() < 1e-3 && (hole.y_mm - y).abs() < 1e-3, "{hole:?} {x} {y}");
            assert!(hole.depth_mm >= machine.process.board_thickness.mm());
        }
        assert!(twin.broken().is_none() && twin.lost() == [0; 3]);
        let results = run.run().results();
        let turns: Vec<u32> = results.iter().map(|result| result.turns).collect();
        assert_eq!(turns, [1, 1, 2, 2, 2, 2, 2, 0, 4, 4, 4]);
        assert!(
            results
                .iter()
                .all(|row| row.state == if row.turns > 0 { RowState::Done } else { RowState::Waiting })
        );
        assert!(results[8].ms > 50.0, "a stroke takes its time: {:?}", results[8]);
        let ends: Vec<usize> = run.trail().iter().map(|(row, _)| *row).collect();
        assert_eq!(ends[..6], [2, 8, 9, 4, 8, 9]);
    }
}

#[test]
fn parking_lifts_first_with_the_spindle_off() {
    let place = |machine: Machine, more: &[(&str, Value)]| {
        let own = [
            ("park.at", Value::Text("place".to_owned())),
            ("park.x", Value::Number(7.0)),
            ("park.y", Value::Number(machine.y.max.mm())),
        ];
        let changes: Vec<_> =
            own.iter().chain(more).map(|(key, to)| ((*key).to_owned(), to.clone())).collect();
        apply(&machine, &changes).unwrap()
    };
    let play = [("x.backlash", Value::Number(0.1)), ("y.backlash", Value::Number(0.1))];
    let apart = [place(virtual_drill(), &play), place(lab(), &[]), place(six_spindles(), &[])];
    for machine in machines().into_iter().chain(apart) {
        let (mut drill, holes) = twin(&machine, Faults::default());
        let bench = Rig::homed(&machine, &mut drill).unwrap();
        let surface = machine.z.scale.steps(machine.process.surface);
        let (lowest, highest) = (drill.real(), drill.real());
        let mut pins = Watched { twin: &mut drill, lowest, highest, surface, dragged: false };
        let mut run = rehearse("SPINDLE 20000\nMOVE_BY 900 40\nDRILL_DOWN\nPARK\n", bench);
        let rest = run.go(&machine, Mode::ToEnd, &mut pins, usize::MAX);
        assert_eq!((rest, pins.dragged), (Some(Rest::Done), false), "{}", machine.name);
        let parked = cycles::park_place(&machine);
        assert_eq!(drill.real()[..2], parked, "{}", machine.name);
        assert!(drill.real()[2] >= cycles::top(&machine) && drill.broken().is_none(), "{}", machine.name);
        assert_eq!(drill.lost(), [0; 3], "{}", machine.name);
        let standing = run.bench().standing;
        assert_eq!((standing.rpm, standing.position[..2].to_vec()), (0, parked.to_vec()), "{}", machine.name);
        assert_eq!(holes.lock().unwrap().len(), machine.spindles as usize, "{}", machine.name);
    }
}

#[test]
fn queue_runs_by_rows_and_to_breakpoints() {
    let machine = virtual_drill();
    let text = "* SPINDLE 9000\nREPEAT 2\n* MOVE_BY 10 0\nEND\nMOVE_BY 0 7\nWAIT 20\n";
    let (mut twin, _) = twin(&machine, Faults::default());
    let bench = Rig::homed(&machine, &mut twin).unwrap();
    let mut run = rehearse(text, bench.clone());
    let mut rows = Vec::new();
    loop {
        rows.push(run.run().row());
        match run.go(&machine, Mode::Step, &mut twin, usize::MAX) {
            Some(Rest::Held) => {}
            end => break assert_eq!(end, Some(Rest::Done)),
        }
    }
    assert_eq!(rows, [0, 1, 2, 3, 2, 3, 4, 5].map(Some));
    let waited = run.run().results()[5].ms;
    assert_eq!(waited, 20.0);

    let mut run = rehearse(text, run.bench());
    let mut stops = Vec::new();
    while let Some(Rest::Held) = run.go(&machine, Mode::ToBreakpoint, &mut twin, usize::MAX) {
        stops.push(run.run().row().unwrap());
    }
    assert_eq!(stops, [0, 2, 2], "the first row's breakpoint counts, and each turn");
    assert!(run.run().ended());
    assert_eq!(run.go(&machine, Mode::ToEnd, &mut twin, usize::MAX), None, "what ended does not go on");
    let moved = twin.real()[0] - bench.standing.position[0];
    assert_eq!(moved, 40, "two queues of twice ten steps");

    let mut run = rehearse(text, run.bench());
    assert_eq!(run.go(&machine, Mode::ToBreakpoint, &mut twin, 9), Some(Rest::Held));
    assert_eq!(run.go(&machine, Mode::ToEnd, &mut twin, usize::MAX), Some(Rest::Done));
}

#[test]
fn queue_in_short_pieces_gives_the_same_result() {
    let machine = lab();
    let play = |pieces: usize| {
        let (mut twin, holes) = twin(&machine, Faults::default());
        let bench = Rig::homed(&machine, &mut twin).unwrap();
        let mut run = rehearse(FOUR, bench);
        let mut calls = 0;
        let rest = loop {
            calls += 1;
            if let Some(rest) = run.go(&machine, Mode::ToEnd, &mut twin, pieces) {
                break rest;
            }
        };
        let holes = holes.lock().unwrap().clone();
        (rest, run.run().results().to_vec(), run.trail().to_vec(), holes, run.bench(), calls)
    };
    let (whole, parts) = (play(usize::MAX), play(1));
    assert_eq!(
        (whole.0, &whole.1, &whole.2, &whole.3, &whole.4),
        (parts.0, &parts.1, &parts.2, &parts.3, &parts.4)
    );
    assert!(whole.5 == 1 && parts.5 > 10);
}

/// Pins that record the range of each axis, and whether X or Y moved with the tool low.
struct Watched<'a> {
    twin: &'a mut VirtualDrill,
    lowest: [i64; 3],
    highest: [i64; 3],
    surface: i64,
    dragged: bool,
}

impl Pins for Watched<'_> {
    fn step(&mut self, at_tick: u64, axes: u8, forward: u8) {
        self.twin.step(at_tick, axes, forward);
        let real = self.twin.real();
        self.dragged |= axes & 3 != 0 && real[2] < self.surface;
        for (axis, real) in real.into_iter().enumerate() {
            self.lowest[axis] = self.lowest[axis].min(real);
            self.highest[axis] = self.highest[axis].max(real);
        }
    }
    fn spindle(&mut self, at_tick: u64, rpm: u32) {
        self.twin.spindle(at_tick, rpm);
    }
    fn inputs(&mut self, at_tick: u64) -> u32 {
        self.twin.inputs(at_tick)
    }
    fn safe(&mut self) {
        self.twin.safe();
    }
}

/// A random queue without waits for inputs. About half of them pass the dry check.
fn random_text(chance: &mut Chance) -> String {
    let mut text = String::from("SPINDLE 20000\n");
    let mut open = 0;
    for _ in 0..chance.bits() % 14 {
        match chance.bits() % 10 {
            0 if open < 3 => {
                text.push_str(&format!("REPEAT {}\n", chance.bits() % 4 + 1));
                open += 1;
            }
            1 if open > 0 => {
                text.push_str("END\n");
                open -= 1;
            }
            2 | 3 => text.push_str("DRILL_DOWN\nDRILL_UP\n"),
            _ => {
                let row = random_row(chance);
                if matches!(row.command, Some(WorkCommand::WaitInput { .. } | WorkCommand::Home { .. })) {
                    continue;
                }
                let (word, values) = row.command.unwrap().split();
                let values: Vec<_> = values.iter().map(ToString::to_string).collect();
                text.push_str(&format!("{} {}\n", word.name, values.join(" ")));
            }
        }
    }
    text.push_str(&"END\n".repeat(open));
    if one_in(chance, 4) {
        text.push_str("DRILL_UP\nHOME ALL\nMOVE_BY 3 4\n");
    }
    text
}

#[test]
fn checked_queue_never_leaves_the_range() {
    let (mut passed, mut refused, mut strokes) = (0, 0, 0);
    let outputs = ["lamp", "vacuum", "pump"].map(str::to_owned);
    for machine in [virtual_drill(), lab()] {
        let (mut base, _) = twin(&machine, Faults::default());
        let home = Rig::homed(&machine, &mut base).unwrap();
        for seed in 0..250 {
            let mut chance = Chance::new(seed);
            let text = random_text(&mut chance);
            let queue = read("q", &text).unwrap_or_else(|why| panic!("seed {seed}: {why:?}\n{text}"));
            let Ok(promised) = check(&queue, &machine, &outputs, &home.standing) else {
                refused += 1;
                continue;
            };
            passed += 1;
            let (mut drill, holes) = twin(&machine, Faults::default());
            let bench = Rig::homed(&machine, &mut drill).unwrap();
            assert_eq!(bench, home, "the twin is the same every time");
            let surface = machine.z.scale.steps(machine.process.surface);
            let (lowest, highest) = (drill.real(), drill.real());
            let mut pins = Watched { twin: &mut drill, lowest, highest, surface, dragged: false };
            let mut run = Rehearsal::new(queue.clone(), outputs.to_vec(), bench);
            let rest = run.go(&machine, Mode::ToEnd, &mut pins, usize::MAX);
            let told = format!("{} seed {seed}\n{}", machine.name, print(&queue));
            assert_eq!(rest, Some(Rest::Done), "{told}");
            let homes = text.contains("HOME");
            for axis in 0..3 {
                let settings = machine.axis(axis);
                // Homing moves to the limit switch, slightly beyond the range.
                let (low, high) = (settings.scale.steps(settings.min), settings.scale.steps(settings.max));
                let inside = pins.lowest[axis] >= low && pins.highest[axis] <= high;
                assert!(homes || inside, "{axis}: {:?} {:?} {told}", pins.lowest, pins.highest);
            }
            assert!(!pins.dragged, "{told}");
            assert!(drill.broken().is_none() && drill.lost() == [0; 3], "{told}");
            assert_eq!(drill.real()[..], run.bench().standing.position[..3], "{told}");
            assert_eq!(drill.real()[..2], promised.end.position[..2], "{told}");
            assert!(holes.lock().unwrap().len() <= promised.strokes as usize, "{told}");
            strokes += promised.strokes;
        }
    }
    assert!(
        passed > 80 && refused > 80 && strokes > 80,
        "{passed} passed, {refused} refused, {strokes} strokes"
    );
}

fn indexed() -> Machine {
    let on = ["x.index", "y.index", "z.index"].map(|key| (key.to_owned(), Value::Text("yes".to_owned())));
    apply(&virtual_drill(), &on).unwrap()
}

#[test]
fn index_pulse_homing_ignores_switch_scatter() {
    let play =
        [("x.backlash".to_owned(), Value::Number(0.1)), ("y.home_end".to_owned(), Value::Text("max".into()))];
    let scatters = Faults { scatter_steps: 25, ..Faults::default() };
    for machine in [virtual_drill(), indexed(), apply(&indexed(), &play).unwrap()] {
        let has_index = machine.x.index;
        let away = if machine.y.home == HomeEnd::Min { 700 } else { -700 };
        let (mut drill, _) = twin(&machine, scatters.clone());
        let mut bench = Rig::homed(&machine, &mut drill).unwrap();
        let mut places = std::collections::BTreeSet::new();
        for round in 0..12 {
            let mut run = rehearse(&format!("MOVE_BY 900 {away}\nHOME ALL\n"), bench.clone());
            let rest = run.go(&machine, Mode::ToEnd, &mut drill, usize::MAX);
            let found = |rest: &Option<Rest>| match rest {
                Some(Rest::Failed { why, .. }) => why.code.clone(),
                rest => format!("{rest:?}"),
            };
            // Without an index pulse, the count differs from the position of the switch.
            let is_well = rest == Some(Rest::Done) || !has_index && found(&rest) == "control.lost_count";
            assert!(is_well, "round {round}: {rest:?}");
            bench = run.bench();
            places.insert([0, 1, 2].map(|axis: usize| drill.real()[axis]));
        }
        let rests = [0, 1, 2].map(|axis| cycles::home_place(&machine, axis));
        if has_index {
            assert_eq!(places.into_iter().collect::<Vec<_>>(), [rests], "{}", machine.name);
        } else {
            assert!(places.len() > 6, "the switch scatters: {places:?}");
        }
    }
}

fn with_faults(machine: &Machine, faults: Faults, text: &str) -> (Rest, Rehearsal) {
    let (mut sound, _) = twin(machine, Faults::default());
    let bench = Rig::homed(machine, &mut sound).unwrap();
    let (mut faulty, _) = twin(machine, faults);
    // First, the faulty drill moves to the same place.
    let here = faulty.real();
    let mut tick = 0;
    for (axis, here) in here.into_iter().enumerate() {
        for at in 0..(bench.standing.position[axis] - here).abs() {
            tick = (at as u64 + 1) * TICK_HZ / 200;
            let bit = 1 << axis;
            faulty.step(tick, bit, if bench.standing.position[axis] > here { bit } else { 0 });
        }
    }
    let line = Playhead { tick: tick + TICK_HZ, ..bench.line };
    let mut run = rehearse(text, Rig { line, standing: bench.standing });
    let rest = run.go(machine, Mode::ToEnd, &mut faulty, usize::MAX).unwrap();
    (rest, run)
}

#[test]
fn faults_stop_the_queue_at_its_row_with_a_named_alarm() {
    let stuck = |input: Input| Faults { stuck_on: input.bit(), ..Faults::default() };
    let never = |input: Input| Faults { stuck_off: input.bit(), ..Faults::default() };
    let drill = "SPINDLE 20000\nMOVE_BY 50 0\nDRILL_DOWN\nDRILL_UP\n";
    let rows: Vec<(Machine, Faults, &str, &str, usize, Harm)> = vec![
        (virtual_drill(), stuck(Input::XMax), drill, "control.end_sensor", 1, Harm::Suspect),
        (virtual_drill(), stuck(Input::Contact), drill, "control.end_sensor", 1, Harm::Suspect),
        (virtual_drill(), stuck(Input::ZBottom), drill, "control.end_sensor", 2, Harm::Suspect),
        (lab(), never(Input::ZBottom), drill, "control.drilling_too_long", 2, Harm::None),
        (virtual_drill(), stuck(Input::ZTop), "WAIT 1\nHOME ALL", "control.sensor_stuck", 1, Harm::Lost),
        (virtual_drill(), never(Input::YMin), "HOME ALL", "control.sensor_not_found", 0, Harm::Lost),
        (indexed(), never(Input::XIndex), "HOME ALL", "control.index_not_found", 0, Harm::Lost),
        (indexed(), stuck(Input::YIndex), "WAIT 1\nHOME ALL", "control.index_unclear", 1, Harm::Lost),
        (
            virtual_drill(),
            Faults { lost_steps: (1..9).map(|n| (0, 30_000 + n)).collect(), ..Faults::default() },
            "MOVE_TO 290 0\nMOVE_TO 0 0\nMOVE_TO 290 0\nMOVE_TO 0 0\nHOME ALL",
            "control.lost_count",
            4,
            Harm::None,
        ),
        (
            virtual_drill(),
            never(Input::Contact),
            "WAIT_INPUT CONTACT ON 30",
            "queue.input_timeout",
            0,
            Harm::None,
        ),
        (
            virtual_drill(),
            stuck(Input::Contact),
            "WAIT_INPUT CONTACT OFF 30",
            "queue.input_timeout",
            0,
            Harm::None,
        ),
    ];
    for (machine, faults, text, code, row, harm) in rows {
        let (rest, run) = with_faults(&machine, faults, text);
        let Rest::Failed { why, harm: left } = rest else { panic!("{text}: {rest:?}") };
        assert_eq!((why.code.as_str(), left), (code, harm), "{text}");
        assert_eq!(why.place.as_ref().map(|place| place.line as usize), Some(row + 1), "{why:?}");
        let results = run.run().results();
        assert_eq!(results[row].state, RowState::Refused, "{text}");
        assert_eq!(results[row].why.as_ref(), Some(&why));
        assert!(results[..row].iter().all(|result| result.state == RowState::Done));
        assert!(results[row + 1..].iter().all(|result| result.state == RowState::Waiting));
        if harm == Harm::Lost {
            assert!(!run.bench().standing.all_homed(), "{text}");
        }
    }
}

#[test]
fn queue_outputs_are_switched_pulsed_and_cleared_at_the_end() {
    let machine = virtual_drill();
    let text = "OUTPUT lamp ON\nOUTPUT vacuum ON 20\nWAIT 10\nOUTPUT pump ON\nOUTPUT lamp OFF";
    let mut pins = Recorder::default();
    let mut run = rehearse(text, Rig::default());
    assert_eq!(run.go(&machine, Mode::ToEnd, &mut pins, usize::MAX), Some(Rest::Done));
    let ms = TICK_HZ / 1_000;
    let switched =
        [(0, 0, true), (0, 1, true), (20, 1, false), (30, 2, true), (30, 0, false), (30, 2, false)];
    assert_eq!(pins.written, switched.map(|(at, place, on)| Written::Output { tick: at * ms, place, on }));
    // A wait for an input ends when the input changes, and a stop turns off active outputs.
    let text = "OUTPUT pump ON\nWAIT_INPUT CONTACT ON 500\nWAIT 900";
    let mut pins = Recorder { script: vec![(42 * ms, Input::Contact.bit())], ..Recorder::default() };
    let mut run = rehearse(text, Rig::default());
    assert_eq!(run.go(&machine, Mode::Step, &mut pins, usize::MAX), Some(Rest::Held));
    assert_eq!(run.go(&machine, Mode::Step, &mut pins, usize::MAX), Some(Rest::Held));
    let waited = run.run().results()[1].ms;
    assert!((42.0..48.0).contains(&waited), "{waited}");
}

#[test]
fn row_out_of_range_is_refused_at_its_turn() {
    let machine = virtual_drill();
    let (mut twin, _) = twin(&machine, Faults::default());
    let bench = Rig::homed(&machine, &mut twin).unwrap();
    let mut run = rehearse("WAIT 5\nMOVE_TO -5 0", bench.clone());
    let Some(Rest::Failed { why, harm: Harm::None }) = run.go(&machine, Mode::ToEnd, &mut twin, usize::MAX)
    else {
        panic!("it moved")
    };
    assert_eq!((why.code.as_str(), twin.real()[0]), ("queue.outside", bench.standing.position[0]));
    let unknown = Rig { standing: Standing::default(), ..bench };
    let mut run = rehearse("MOVE_BY 1 0", unknown);
    assert!(
        matches!(run.go(&machine, Mode::Step, &mut twin, 5), Some(Rest::Failed { why, .. }) if why.code == "queue.not_homed")
    );
}

#[test]
fn queue_stroke_takes_each_spindle_to_its_own_bottom() {
    let deeper = ("spindle.deeper".to_owned(), Value::Numbers(vec![0.0, 0.3, -0.2]));
    let longer = ("spindle.longer".to_owned(), Value::Numbers(vec![0.0, 0.0, 0.0, 0.8]));
    let machine = apply(&six_spindles(), &[deeper, longer]).unwrap();
    let (mut drill, holes) = twin(&machine, Faults::default());
    let rig = Rig::homed(&machine, &mut drill).unwrap();
    let mut run = rehearse("SPINDLE 20000\nDRILL_DOWN", rig);
    assert_eq!(run.go(&machine, Mode::ToEnd, &mut drill, usize::MAX), Some(Rest::Done));
    assert_eq!(holes.lock().unwrap().len(), 6);
    let (rig, surface) = (run.bench(), machine.on_surface());
    assert_eq!(rig.standing.position, rig.line.position, "it is where the check said");
    let through = machine.process.board_thickness + machine.process.breakthrough;
    for (axis, deeper) in machine.spindle_axes().zip([0.0, 0.3, -0.2, 0.0, 0.0, 0.0]) {
        let depth = surface[axis] - rig.line.position[axis];
        let wanted = machine.z.scale.steps(through + Length::from_mm(deeper));
        assert_eq!(depth, wanted, "axis {axis}");
    }
}
