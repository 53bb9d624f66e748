//! Tests of tool changes on the virtual drill: every step interrupted before, during and after, with
//! sensors and without, then continued as offered. The stock must match reality, and no tool may be pushed
//! onto another.

use crate::operator::{OnTime, Orders};
use crate::programs::rounds;
use annulus_core::chance::Chance;
use annulus_core::job::{Bit, Cutter, Input};
use annulus_core::machine::{Machine, Output, Overlap, ToolChange, Value, apply, virtual_drill};
use annulus_core::magazine::{Change, ChangeStep, Held, Seen, StepWork, StockedTool, ToolStock, change_s};
use annulus_core::motion::cycles;
use annulus_core::pins::{Motors, Order, Outcome, Pins, Playhead, Steady, play};
use annulus_core::steps::{Segment, segment};
use annulus_core::units::Length;
use annulus_core::virtual_drill::{Faults, VirtualDrill};

fn tool(number: u32) -> StockedTool {
    let diameter = Length::from_um(500 + 100 * i64::from(number));
    StockedTool {
        number,
        bit: Bit { diameter, name: format!("{number}"), cutter: Cutter::Drill, handling: Default::default() },
    }
}

fn machine() -> Machine {
    let base = virtual_drill();
    let overlap = Overlap { on: false, ..base.overlap };
    let mut machine = Machine { tool_change: ToolChange::Magazine, overlap, ..base };
    machine.foot.on = true;
    machine
}

/// The same machine on a card, with all sensors of the magazine wired or none.
fn carded(has_sensors: bool) -> Machine {
    let first = [0, 1, 2, 3, 4, 5, 6].map(f64::from);
    let further: Vec<f64> = (7..13).map(|bit| if has_sensors { f64::from(bit) } else { -1.0 }).collect();
    let sensors = [&first[..], &further].concat();
    let text = |text: &str| Value::Text(text.to_owned());
    let changes = [
        ("card.output_names", text("foot clamp")),
        ("card.outputs", Value::Numbers(vec![25.0, 26.0])),
        ("card.sensors", Value::Numbers(sensors)),
        ("machine.output", text("card")),
    ];
    let changes = changes.map(|(key, value)| (key.to_owned(), value));
    apply(&machine(), &changes).unwrap()
}

struct Bench {
    machine: Machine,
    told: u32,
    drill: Steady<VirtualDrill>,
    line: Playhead,
    stock: ToolStock,
}

impl Bench {
    fn new(machine: &Machine, stock: ToolStock, faults: Faults) -> Self {
        let twin = Machine { output: Output::Virtual, ..machine.clone() };
        let mut drill = Steady::new(VirtualDrill::new(&twin, 1, faults, Box::new(|_| {})));
        drill.stock(0, &stock);
        let mut line = Playhead::default();
        line.position[..3].copy_from_slice(&drill.inner().real());
        Self { machine: machine.clone(), told: machine.told_inputs(), drill, line, stock }
    }

    fn inputs(&mut self) -> u32 {
        self.drill.inputs(self.line.tick) & self.told
    }

    fn play(&mut self, piece: &Segment, stop: Option<f64>) -> Outcome {
        let at = stop.map_or(u64::MAX, |share| self.line.tick + (share * piece.duration_ticks as f64) as u64);
        let mut operator = Orders([(at, Order::Stop), (at, Order::Stop)], self.line.tick);
        let motors = Motors { start_stop_hz: f64::INFINITY, ..Motors::of(&self.machine) };
        let mut clock = OnTime(self.line.tick);
        play(piece, &motors, &mut self.line, &mut self.drill, &mut clock, &mut operator)
    }

    /// Executes a step: its output, then its segments. Returns `true` if they were played to the end.
    fn work(&mut self, work: &StepWork, stop: Option<f64>) -> bool {
        if let Some((place, on)) = work.output {
            self.drill.output(self.line.tick, place, on);
        }
        work.segments.iter().all(|piece| {
            let outcome = self.play(piece, stop);
            assert!(matches!(outcome, Outcome::Completed | Outcome::Stopped), "{outcome:?}");
            outcome == Outcome::Completed
        })
    }

    /// The owner's actions after an interrupted change: lets the clamp finish, raises the tool and reads
    /// the sensors.
    fn made_safe(&mut self) {
        self.line.tick += self.stock.wait_before_lift_ticks(&self.machine);
        self.drill.inputs(self.line.tick);
        let top = cycles::top(&self.machine).max(self.line.position[2]);
        let up = cycles::retract(&self.machine, self.line.position, top).unwrap();
        for planned in &up.moves {
            assert_eq!(self.play(&segment(planned, &self.machine), None), Outcome::Completed);
        }
        let (inputs, over) =
            (self.inputs(), Change::is_over_place(&self.machine, &self.stock, &self.line.position));
        self.stock.settle(self.told, inputs, over);
        if self.stock.spindle == Held::Unknown {
            let seen = self.look();
            self.stock.seen(seen).unwrap();
            self.drill.stock(self.line.tick, &self.stock);
        }
        if matches!(self.stock.spindle, Held::Tool { .. }) {
            let clamp = self.machine.output_place("clamp").unwrap();
            self.drill.output(self.line.tick, clamp, false);
            self.line.tick += self.machine.magazine.clamp_ticks();
            self.drill.inputs(self.line.tick);
        }
    }

    fn look(&self) -> Seen {
        let (tool, place) = self.stock.change.as_ref().unwrap().uncertain();
        let drill = self.drill.inner();
        let lies = drill.lie()[usize::from(*place)].as_ref() == Some(tool);
        match (drill.held() == Some(tool), lies) {
            (true, _) => Seen::InSpindle,
            (_, true) => Seen::InPlace,
            _ => Seen::TakenAway,
        }
    }

    /// Changes to `bit`. `stops` gives the share of a step after which the change stops; 0 is before the
    /// step. Returns `true` if the tool is fitted.
    fn change(
        &mut self,
        bit: &Bit,
        stops: &mut dyn FnMut(ChangeStep) -> Option<f64>,
    ) -> Result<bool, String> {
        let back = self.line.position;
        let change = Change::new(&mut self.stock, bit, (back, [false; 2]));
        let Some(mut change) = change.map_err(|why| why.code)? else { return Ok(true) };
        while let Some(step) = change.step() {
            let stop = stops(step);
            if stop == Some(0.0) {
                return Ok(false);
            }
            let inputs = self.inputs();
            let work = change.begin(&self.machine, &mut self.stock, (self.line.position, inputs));
            let work = work.map_err(|why| why.code)?;
            if !self.work(&work, stop.filter(|share| *share < 1.0)) {
                return Ok(false);
            }
            let inputs = self.inputs();
            let is_done = change.done(&self.machine, &mut self.stock, inputs).map_err(|why| why.code)?;
            if is_done {
                assert_eq!(self.line.position, back, "the job goes on where it was");
                return Ok(true);
            }
            if stop.is_some() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The stock must match reality, no tool may be in two places, and nothing may have broken.
    fn is_true(&self, trace: &str) {
        let drill = self.drill.inner();
        assert_eq!(drill.broken(), None, "{trace}");
        assert_eq!(drill.lie(), self.stock.places, "{trace}");
        let held = if let Held::Tool { tool, .. } = &self.stock.spindle { Some(tool) } else { None };
        assert_eq!(drill.held(), held, "{trace}");
        let mut numbers: Vec<u32> =
            self.stock.places.iter().flatten().chain(held).map(|tool| tool.number).collect();
        let count = numbers.len();
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers.len(), count, "no tool twice: {trace}");
    }
}

/// Tools 1 to 4, the first one in the spindle or in its place.
fn stock(machine: &Machine, in_spindle: bool) -> ToolStock {
    let mut places: Vec<_> = (1..=4).map(|number| Some(tool(number))).collect();
    let spindle = if in_spindle {
        Held::Tool { tool: places[0].take().unwrap(), place: Some(0) }
    } else {
        Held::Nothing
    };
    ToolStock::reported(places, spindle, machine).unwrap()
}

#[test]
fn unstopped_tool_change_runs_every_step() {
    let mut bench = Bench::new(&machine(), stock(&machine(), true), Faults::default());
    let mut steps = Vec::new();
    let mut note = |step| {
        steps.push(step);
        None
    };
    assert_eq!(bench.change(&tool(3).bit, &mut note), Ok(true));
    assert_eq!(steps, ChangeStep::ALL);
    bench.is_true("unstopped");
    assert_eq!(
        (bench.stock.spindle.clone(), bench.stock.change.clone()),
        (Held::Tool { tool: tool(3), place: Some(2) }, None)
    );
    assert_eq!(bench.change(&tool(3).bit, &mut |_| Some(0.0)), Ok(true), "it is in already");
    // The announced time must be the duration of these moves.
    let said_s = change_s(&machine(), true).unwrap();
    let empty_s = change_s(&machine(), false).unwrap();
    assert!(said_s > empty_s && empty_s > 3.0 && said_s < 60.0, "{said_s} {empty_s}");
}

#[test]
fn stopped_tool_change_resumes_at_every_step() {
    let mut seen = std::collections::BTreeSet::new();
    for (has_old, sensors) in
        [(true, None), (false, None), (true, Some(true)), (true, Some(false)), (false, Some(false))]
    {
        let machine = sensors.map_or_else(machine, carded);
        for (step, share) in
            ChangeStep::ALL.into_iter().flat_map(|step| [0.0, 0.5, 1.0].map(|share| (step, share)))
        {
            let trace = format!("{step:?} {share} old {has_old} sensors {sensors:?}");
            let mut bench = Bench::new(&machine, stock(&machine, has_old), Faults::default());
            let mut once = Some(());
            let mut stop = |now: ChangeStep| (now == step).then(|| once.take().map(|()| share)).flatten();
            match bench.change(&tool(3).bit, &mut stop) {
                Ok(true) => {}
                Ok(false) => {
                    bench.made_safe();
                    seen.insert(
                        bench.stock.goes_on_with().unwrap_or_else(|| panic!("{trace}: {:?}", bench.stock)),
                    );
                    bench.is_true(&trace);
                    assert_eq!(bench.change(&tool(3).bit, &mut |_| None), Ok(true), "{trace}");
                }
                Err(code) => panic!("{trace}: {code}"),
            }
            bench.is_true(&trace);
            assert!(bench.stock.holds(&tool(3).bit), "{trace}");
            assert_eq!(bench.stock.lies(0), Some(&tool(1)), "{trace}");
        }
    }
    assert_eq!(seen.len(), 3, "put back, fetched, gone on: {seen:?}");
}

#[test]
fn repeatedly_stopped_tool_changes_never_collide() {
    let seed = 20_261_126_u64;
    println!("seed {seed}");
    let mut chance = Chance::new(seed);
    let machines = [machine(), carded(true), carded(false)];
    let mut stopped = 0;
    for round in 0..rounds(100) {
        let machine = &machines[chance.below(3)];
        let mut bench = Bench::new(machine, stock(machine, chance.below(2) == 0), Faults::default());
        for change in 0..3 {
            let wanted = tool(1 + chance.below(4) as u32).bit;
            for attempt in 0.. {
                let trace = format!("seed {seed} round {round} change {change} attempt {attempt}");
                assert!(attempt < 60, "{trace}");
                let often = 0.15 / f64::from(attempt + 1);
                let mut stop = |_| (chance.unit() < often).then(|| chance.unit());
                match bench.change(&wanted, &mut stop) {
                    Ok(true) => {
                        bench.is_true(&trace);
                        break;
                    }
                    Ok(false) => {
                        stopped += 1;
                        bench.made_safe();
                        bench.is_true(&trace);
                    }
                    Err(code) => panic!("{trace}: {code}"),
                }
            }
            assert!(bench.stock.holds(&wanted));
        }
    }
    assert!(stopped > 10, "{stopped}");
}

#[test]
fn clamp_and_magazine_faults_stop_at_their_step() {
    // (fault, step at which it shows, its alarm, whether the spindle's content is known then)
    type Row = (fn(&mut Faults), ChangeStep, &'static str, bool);
    let rows: [Row; 5] = [
        (|faults| faults.clamp_stuck = true, ChangeStep::WaitOpen, "magazine.clamp_closed", true),
        (|faults| faults.tool_drops = true, ChangeStep::RaiseFromNew, "magazine.no_tool", false),
        (|faults| faults.no_air = true, ChangeStep::RaiseZ, "magazine.no_air", true),
        (|faults| faults.cover_open = true, ChangeStep::RaiseZ, "magazine.cover_open", true),
        (|faults| faults.stuck_off = Input::ToolHeld.bit(), ChangeStep::XToOld, "magazine.no_tool", false),
    ];
    for (put, step, code, is_known) in rows {
        let mut faults = Faults::default();
        put(&mut faults);
        let mut bench = Bench::new(&machine(), stock(&machine(), true), faults);
        let found = bench.change(&tool(3).bit, &mut |_| None);
        assert_eq!(found, Err(code.to_owned()));
        assert_eq!(bench.stock.change.as_ref().map(|change| change.step), Some(step), "{code}");
        let (inputs, over) =
            (bench.inputs(), Change::is_over_place(&bench.machine, &bench.stock, &bench.line.position));
        bench.stock.settle(bench.told, inputs, over);
        assert_eq!(bench.stock.goes_on_with().is_some(), is_known, "{code}: {:?}", bench.stock);
        assert_eq!(bench.drill.inner().broken(), None, "{code}");
        // Repaired; if the content is unknown, the user has looked.
        if !is_known {
            let seen = if bench.drill.inner().held().is_some() { Seen::InSpindle } else { Seen::TakenAway };
            bench.stock.seen(seen).unwrap();
        }
        let mut stock = bench.stock.clone();
        let lost = stock.place_of(&tool(3).bit).is_none() && !stock.holds(&tool(3).bit);
        if lost {
            // The tool was picked up and put back into its place.
            stock.places[2] = Some(tool(3));
        }
        let mut mended = Bench::new(&machine(), stock, Faults::default());
        assert_eq!(mended.change(&tool(3).bit, &mut |_| None), Ok(true), "{code}");
        mended.is_true(code);
    }
}

#[test]
fn occupied_slot_refuses_a_second_tool() {
    let faults = Faults { place_occupied: true, ..Faults::default() };
    let mut bench = Bench::new(&machine(), stock(&machine(), false), faults);
    assert_eq!(bench.change(&tool(2).bit, &mut |_| None), Ok(true));
    // The tool in place 2 is missing from the stock.
    assert_eq!(bench.change(&tool(3).bit, &mut |_| None), Err("magazine.place_taken".to_owned()));
    assert_eq!(bench.drill.inner().broken(), None);
    assert!(bench.drill.inner().held() == Some(&tool(2)), "it is still held");
}

#[test]
fn impossible_fetch_is_refused_before_motion() {
    let machine = machine();
    let rows: [(ToolStock, u32, &str); 3] = [
        (ToolStock { spindle: Held::Unknown, ..stock(&machine, true) }, 3, "magazine.spindle_unknown"),
        (stock(&machine, true), 9, "magazine.no_such_tool"),
        (
            ToolStock {
                places: (2..=9).map(|number| Some(tool(number))).collect(),
                spindle: Held::Tool { tool: tool(1), place: None },
                change: None,
            },
            3,
            "magazine.no_room",
        ),
    ];
    for (stock, wanted, code) in rows {
        let mut bench = Bench::new(&machine, stock, Faults::default());
        let before = bench.line;
        assert_eq!(bench.change(&tool(wanted).bit, &mut |_| None), Err(code.to_owned()));
        assert_eq!(bench.line.position, before.position);
    }
}
