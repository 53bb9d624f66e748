//! Tests of a job on a machine with a magazine, through the bytes of a card. Every step of a change is
//! switched and checked by wires, and a worn tool is replaced between two holes.

use super::{Bench, CLAMP, SPINDLE, text};
use crate::server::drill;
use annulus_core::control::{Ending, State, Trust};
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::machine::{Machine, Value};
use annulus_core::magazine::{Held, StockedTool, ToolStock};
use annulus_core::units::Length;
use annulus_core::virtual_drill::Faults;
use annulus_core::wire::{Ask, Tell, ToolsReport};
use std::thread;
use std::time::Duration;

const DIAMETERS_UM: [i64; 2] = [600, 800];

fn bit(um: i64) -> Bit {
    let diameter = Length::from_um(um);
    Bit { diameter, name: format!("{um}"), cutter: Cutter::Drill, handling: Default::default() }
}

pub(super) fn of_two_tools(machine: &Machine) -> Program {
    let at = (0..4).map(|hole| Point::from_mm(f64::from(hole) * 2.0, 0.0));
    let mut program = drill::holes(machine, Vec::new(), (at, 10_000), drill::back());
    program.bits = DIAMETERS_UM.map(bit).to_vec();
    let fetch = |bit: u32| Leg {
        mark: Mark::ToolChange(bit),
        commands: vec![
            Command::Spindle { rpm: 0 },
            Command::AwaitBit { bit },
            Command::Spindle { rpm: 20_000 },
            Command::Dwell { us: 50_000 },
        ],
    };
    program.legs.insert(3, fetch(1));
    program.legs.insert(0, fetch(0));
    program
}

/// A machine with a magazine; its first tool lasts two holes.
pub(super) fn with_magazine() -> [(&'static str, Value); 2] {
    let rack = ["T1 drill 0.6 life 2", "T2 drill 0.8"].map(str::to_owned).to_vec();
    [("rack.change", text("magazine")), ("rack.tools", Value::Texts(rack))]
}

impl Bench {
    /// States that the tools are in slots 1 and 2.
    pub(super) fn fill(&mut self) {
        let places: Vec<_> =
            (1..).zip(DIAMETERS_UM).map(|(number, um)| Some(StockedTool { number, bit: bit(um) })).collect();
        let stock = ToolStock::reported(places.clone(), Held::Nothing, &self.machine).unwrap();
        self.seen().lay(&stock);
        self.page.ask(&Ask::Stock { places, spindle: Held::Nothing });
    }

    fn tools_are(&mut self, so: impl Fn(&ToolsReport) -> bool) {
        let told = self.heard.iter().rev();
        let mut told =
            told.filter_map(|tell| if let Tell::Tools(report) = tell { Some(report) } else { None });
        if !told.next().is_some_and(&so) {
            self.hear(|tell| matches!(tell, Tell::Tools(report) if so(report)));
        }
    }
}

fn hits(report: &ToolsReport, number: u32) -> u64 {
    report.wear.iter().find(|wear| wear.number == number).map_or(0, |wear| wear.hits)
}

#[test]
fn card_magazine_changes_tools_and_requests_a_worn_one() {
    let mut bench = Bench::new(&with_magazine(), Faults::default());
    bench.ready([2_000, 2_000]);
    bench.fill();
    let program = of_two_tools(&bench.machine);
    bench.start(&program);
    // The user is not asked for tools that the machine fetches, but must replace a worn one.
    let status = bench.until(|status| status.state == State::ToolChange && status.holes_done == 2);
    bench.tools_are(|report| (report.wanted, report.in_spindle, hits(report, 1)) == (Some(1), Some(1), 2));
    assert!(status.machine_mm[2] > -1.01, "the tip is all the way up: {status:?}");
    let rests = bench.seen().drill.real();
    bench.let_run();
    for _ in 0..10 {
        thread::sleep(Duration::from_millis(300));
        bench.page.ask(&Ask::Ping { stamp: 0.0 });
    }
    assert_eq!(bench.seen().drill.real(), rests, "nothing moves until it is answered");
    assert_eq!(bench.seen().bytes[3] & (SPINDLE | CLAMP), 0, "the spindle stands, the clamp holds");
    bench.page.ask(&Ask::ToolChanged);
    bench.tools_are(|report| hits(report, 1) == 0);
    assert_eq!(bench.ended(), (Ending::Done, 4));
    assert_eq!(bench.rests(), None);
    assert_eq!(bench.status.as_ref().unwrap().trust, Trust::Trusted);
    bench.tools_are(|report| (hits(report, 1), hits(report, 2)) == (1, 1));
    let seen = bench.seen();
    let tools: Vec<_> = seen.holes().iter().map(|hole| hole.bit_mm.unwrap()).collect();
    assert_eq!((tools, seen.drill.broken()), (vec![0.6, 0.6, 0.6, 0.8], None));
    let lie: Vec<_> = seen.drill.lie().iter().map(|tool| tool.as_ref().map(|tool| tool.number)).collect();
    assert_eq!((lie, seen.drill.held().map(|tool| tool.number)), (vec![Some(1), None, None], Some(2)));
    assert_eq!(seen.bytes[3] & (SPINDLE | CLAMP), 0);
}
