//! Tests of the manually opened clamp: it stays closed while the spindle turns.

use super::*;
use annulus_core::job::Input;
use annulus_core::machine::{RackTool, apply};
use annulus_core::magazine::{Held, StockedTool};
use annulus_core::wire::MagazineReport;

const TOOL: &str = "T4 drill 0.8 life 2";

fn changes() -> Vec<(String, Value)> {
    let rack = Value::Texts(vec![TOOL.to_owned()]);
    let by_magazine = Value::Text("magazine".to_owned());
    [("rack.tools", rack), ("rack.change", by_magazine)].map(|(key, value)| (key.to_owned(), value)).to_vec()
}

fn is_open(bench: &Bench) -> bool {
    bench.status().inputs & Input::ClampOpen.bit() != 0
}

fn told(bench: &Bench) -> MagazineReport {
    let told = bench.heard.iter().rev();
    let mut told =
        told.filter_map(|tell| if let Tell::Magazine(report) = tell { Some(report) } else { None });
    told.next().unwrap().as_ref().clone()
}

fn held(bench: &Bench) -> Held {
    told(bench).stock.spindle
}

/// A job in real time whose tool is worn after two holes; the user has just been asked.
fn worn() -> Bench {
    let machine = apply(&virtual_drill(), &changes()).unwrap();
    let program = drilled::holes(&machine, 4, 4, |_| 800);
    let mut bench = Bench::open_at(&Memory::default(), 1.0);
    bench.ask(&Ask::Configure { changes: changes() });
    assert_eq!(bench.refused(), None);
    bench.home();
    bench.ask(&Ask::SetZero);
    let tool = StockedTool { number: 4, bit: RackTool::read(TOOL).unwrap().bit() };
    bench.ask(&Ask::Stock { places: vec![Some(tool)], spindle: Held::Nothing });
    assert_eq!(bench.refused(), None);
    bench.turn(Duration::from_millis(200));
    bench.start(&program, 0);
    bench.until(|status| status.state == State::ToolChange && status.holes_done == 2);
    bench
}

#[test]
fn clamp_opens_only_after_the_spindle_stopped() {
    let mut bench = worn();
    bench.ask(&Ask::OpenClamp);
    assert_eq!(bench.refused(), Some("magazine.spindle_turns"));
    (0..100).for_each(|_| bench.turn(TURN));
    assert!(!is_open(&bench) && held(&bench) != Held::Unknown);
    let wait_ms = virtual_drill().magazine.spin_down_ms as u64;
    (0..wait_ms / 50).for_each(|_| bench.ping_later(Duration::from_millis(50)));
    bench.ask(&Ask::OpenClamp);
    bench.until(|status| status.inputs & Input::ClampOpen.bit() != 0);
    assert_eq!(held(&bench), Held::Unknown);
}

#[test]
fn worn_tool_change_reports_no_magazine_change() {
    let bench = worn();
    let report = told(&bench);
    assert_eq!((report.changes, report.stock.change), (false, None), "it fetches nothing for a worn tool");
}
