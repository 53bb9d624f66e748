//! Tests of automatic tool changes: stopped at every step, resumed as offered, every hole drilled once with
//! its tool.

use super::*;
use annulus_core::machine::apply;
use annulus_core::magazine::{ChangeStep, Held, Seen, StockedTool, change_s};
use annulus_core::wire::{ArmedJob, MagazineReport};
use annulus_host::line;

/// Drills of 0.6, 0.8 and 1.0 mm, two holes each.
fn three_tools(machine: &Machine) -> Program {
    let base = grid(machine, 6);
    let bit = |um: i64| Bit {
        diameter: Length::from_um(um),
        name: format!("{um}"),
        cutter: Cutter::Drill,
        handling: Default::default(),
    };
    let mut legs = Vec::new();
    for (hole, leg) in (0..).zip(base.legs.iter().filter(|leg| matches!(leg.mark, Mark::Hole(_)))) {
        if hole % 2 == 0 {
            let commands = vec![
                Command::Spindle { rpm: 0 },
                Command::AwaitBit { bit: hole / 2 },
                Command::Spindle { rpm: 20_000 },
                Command::Dwell { us: (machine.process.spin_up_ms * 1e3) as u32 },
            ];
            legs.push(Leg { mark: Mark::ToolChange(hole / 2), commands });
        }
        legs.push(leg.clone());
    }
    legs.extend(base.legs.last().cloned());
    Program { bits: vec![bit(600), bit(800), bit(1_000)], legs, ..base }
}

fn changer() -> Machine {
    Machine { tool_change: ToolChange::Magazine, ..virtual_drill() }
}

impl Bench {
    fn magazine(&self) -> MagazineReport {
        let tells = self.drill.greeting();
        let report = |tell| if let Tell::Magazine(report) = tell { Some(*report) } else { None };
        tells.into_iter().find_map(report).unwrap()
    }

    fn fill(&self, program: &Program) {
        let places = (1..)
            .zip(&program.bits)
            .map(|(number, bit)| Some(StockedTool { number, bit: bit.clone() }))
            .collect();
        self.drill.ask(Ask::Stock { places, spindle: Held::Nothing }).unwrap();
    }

    /// Waits until a change starts `step` after `changes` others, then presses STOP; or until the job is
    /// over.
    fn stop_at(&mut self, step: ChangeStep, changes: u32) -> bool {
        let mut begun = 0;
        loop {
            match self.tells.blocking_recv() {
                Some(Tell::Magazine(report)) if report.changes => {
                    let now = report.stock.change.map(|change| change.step);
                    begun += u32::from(now == Some(ChangeStep::RaiseZ));
                    if now == Some(step) && begun > changes {
                        self.drill.ask(Ask::Stop).unwrap();
                        return true;
                    }
                }
                Some(Tell::Ended(_)) => return false,
                Some(_) => {}
                None => panic!("the drill is gone"),
            }
        }
    }

    fn go_on(&self, program: &Program) {
        let bytes = program::encode(program);
        let job = program::key(&bytes);
        let from_leg = self.offer().unwrap();
        let tells = self.drill.ask(Ask::Arm { job: job.clone(), from_leg }).unwrap();
        let Some(Tell::Armed(ArmedJob { stream_digest, checks, .. })) = tells.into_iter().next() else {
            panic!("no verdict")
        };
        assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
        self.drill.ask(Ask::Start { job, stream_digest, from_leg }).unwrap();
    }

    /// Checks that every hole was drilled once with its tool, and that nothing broke.
    fn is_whole(&self, trace: &str) {
        let status = self.wait(|status| matches!(status.state, State::Ready | State::Alarm));
        assert_eq!((status.state, &status.alarm), (State::Ready, &None), "{trace}");
        let record = std::fs::read_to_string(self.folder.path().join(RECORD)).unwrap();
        let mut holes: Vec<(i64, &str)> = record
            .lines()
            .map(|line| {
                let words: Vec<&str> = line.split(' ').collect();
                ((words[0].parse::<f64>().unwrap() * 1e4) as i64, words[words.len() - 1])
            })
            .collect();
        holes.sort_unstable();
        let tools: Vec<&str> = holes.iter().map(|(_, tool)| *tool).collect();
        assert_eq!(
            tools,
            ["D0.6000", "D0.6000", "D0.8000", "D0.8000", "D1.0000", "D1.0000"],
            "{trace}: {record}"
        );
        holes.dedup();
        assert_eq!(holes.len(), 6, "{trace}: {record}");
        let report = self.magazine();
        assert_eq!((report.stock.change, report.changes), (None, false), "{trace}");
        let held = matches!(&report.stock.spindle, Held::Tool { tool, place: Some(2) } if tool.number == 3);
        assert!(held, "{trace}: {:?}", report.stock.spindle);
        let lie: Vec<u32> =
            report.stock.places.iter().map(|place| place.as_ref().map_or(0, |tool| tool.number)).collect();
        assert_eq!(lie[..3], [1, 2, 0], "{trace}");
    }
}

#[test]
fn planned_time_includes_the_tool_changes() {
    let left_s = |machine: &Machine, spindle: Option<Held>| {
        let bench = Bench::new(machine, Faults::default());
        let program = three_tools(machine);
        if let Some(spindle) = spindle {
            let held = if let Held::Tool { tool, .. } = &spindle { tool.number } else { 0 };
            let lie = (1..).zip(&program.bits).map(|(number, bit)| StockedTool { number, bit: bit.clone() });
            let places = lie.map(|tool| (tool.number != held).then_some(tool)).collect();
            bench.drill.ask(Ask::Stock { places, spindle }).unwrap();
        }
        let (.., checks) = bench.arm(&program);
        let time = checks.iter().find(|row| row.finding.code == "preflight.time").unwrap();
        let number = |name: &str| time.finding.argument(&[name]).unwrap().parse::<f64>().unwrap();
        60.0 * number("minutes") + number("seconds")
    };
    let machine = changer();
    let change_s = |has_old| change_s(&machine, has_old).unwrap();
    let by_hand_s = left_s(&self::machine(), None);
    let first = StockedTool { number: 1, bit: three_tools(&machine).bits[0].clone() };
    let rows = [
        (Held::Nothing, change_s(false) + 2.0 * change_s(true)),
        (Held::Tool { tool: first, place: Some(0) }, 2.0 * change_s(true)),
    ];
    for (spindle, changes_s) in rows {
        let counted_s = left_s(&machine, Some(spindle)) - by_hand_s;
        assert!((counted_s - changes_s).abs() <= 1.0 && changes_s > 10.0, "{counted_s} {changes_s}");
    }
}

#[test]
fn tool_change_stopped_at_any_step_resumes() {
    let machine = changer();
    let program = three_tools(&machine);
    let mut stops = 0;
    // The first change starts with an empty spindle, the second puts a tool back.
    for (step, changes) in ChangeStep::ALL.into_iter().flat_map(|step| [(step, 0), (step, 1)]) {
        let trace = format!("{step:?} of change {changes}");
        let mut bench = Bench::new(&machine, Faults::default());
        bench.fill(&program);
        bench.start(&program);
        if bench.stop_at(step, changes) {
            stops += 1;
            let status = bench.wait(|status| matches!(status.state, State::Ready | State::Alarm));
            assert_eq!((status.state, &status.alarm), (State::Ready, &None), "{trace}");
            // The stop may have come after the last step.
            let interrupted = bench.drill.greeting().iter().any(|tell| matches!(tell, Tell::Interrupted(_)));
            assert!(interrupted, "{trace}");
            let report = bench.magazine();
            assert!(report.stock.change.is_none() || report.goes_on_with.is_some(), "{trace}: {report:?}");
            bench.go_on(&program);
        }
        bench.wait(|status| status.job.is_none() && status.state != State::Stopping);
        bench.is_whole(&trace);
    }
    assert!(stops > 40, "{stops}");
}

#[test]
fn worn_tool_is_requested_between_holes_and_again_after_stop() {
    let rack = ["T1 drill 0.6", "T2 drill 0.8 life 1", "T3 drill 1"].map(str::to_owned).to_vec();
    let machine = apply(&changer(), &[("rack.tools".to_owned(), Value::Texts(rack))]).unwrap();
    let program = three_tools(&machine);
    let bench = Bench::new(&machine, Faults::default());
    bench.fill(&program);
    bench.start(&program);
    let asked = |status: &Status| status.state == State::ToolChange && status.holes_done == 3;
    let hits = || {
        let told = bench.drill.greeting().into_iter();
        let mut told =
            told.filter_map(|tell| if let Tell::Tools(report) = tell { Some(report) } else { None });
        told.next().unwrap().wear.iter().find(|wear| wear.number == 2).map_or(0, |wear| wear.hits)
    };
    let status = bench.wait(|status| asked(status) && status.spindle_rpm == 0);
    assert!(status.machine_mm[2] > -1.01, "the tip is all the way up: {status:?}");
    assert_eq!((hits(), bench.magazine().changes), (1, false));
    // After a stop here, the resumed job asks again.
    bench.drill.ask(Ask::Stop).unwrap();
    bench.wait(|status| status.state == State::Ready);
    bench.go_on(&program);
    bench.wait(asked);
    assert_eq!((hits(), bench.magazine().changes), (1, false));
    bench.drill.ask(Ask::ToolChanged).unwrap();
    bench.wait(|status| status.job.is_none() && status.state != State::Stopping);
    bench.is_whole("worn");
    assert_eq!(hits(), 1, "a new one, and one hole");
}

#[test]
fn clamp_opened_in_a_stopped_change_makes_the_tool_unknown() {
    let machine = changer();
    let program = three_tools(&machine);
    let mut bench = Bench::new(&machine, Faults::default());
    let code = |bench: &Bench| bench.drill.ask(Ask::OpenClamp).err().map(|why| why.code);
    bench.fill(&program);
    assert_eq!(code(&bench).as_deref(), Some("magazine.nothing_stopped"));
    bench.start(&program);
    assert_eq!(code(&bench).as_deref(), Some("control.busy"));
    // The old tool is over its slot, and clamped.
    assert!(bench.stop_at(ChangeStep::YToOld, 1));
    bench.wait(|status| status.state == State::Ready);
    let clamp = |bench: &Bench| bench.status().inputs & Input::ClampOpen.bit() != 0;
    let held = |bench: &Bench| matches!(bench.magazine().stock.spindle, Held::Tool { .. });
    assert!(held(&bench) && !clamp(&bench));
    bench.wait(|_| bench.drill.ask(Ask::OpenClamp).is_ok());
    bench.wait(|status| status.inputs & Input::ClampOpen.bit() != 0);
    let report = bench.magazine();
    assert_eq!((&report.stock.spindle, report.goes_on_with), (&Held::Unknown, None));
    let change = report.stock.change.unwrap();
    assert_eq!((change.step, change.uncertain().0.number), (ChangeStep::YToOld, 1));
    let bytes = program::encode(&program);
    let (job, from_leg) = (program::key(&bytes), bench.offer().unwrap());
    let tells = bench.drill.ask(Ask::Arm { job, from_leg }).unwrap();
    let Some(Tell::Armed(ArmedJob { checks, .. })) = tells.into_iter().next() else { panic!("no verdict") };
    assert!(checks.iter().any(|row| row.finding.code == "magazine.spindle_unknown"), "{checks:?}");
    bench.drill.ask(Ask::ToolSeen { seen: Seen::InSpindle }).unwrap();
    assert!(held(&bench));
    bench.go_on(&program);
    bench.wait(|status| status.job.is_none() && status.state != State::Stopping);
    bench.is_whole("opened by hand");
    let without = Bench::new(&virtual_drill(), Faults::default());
    assert_eq!(code(&without).as_deref(), Some("magazine.none"));
}

#[test]
fn stuck_clamp_opens_after_the_alarm_is_acknowledged() {
    let machine = changer();
    let program = three_tools(&machine);
    let faults = annulus_core::virtual_drill::faults::read(["clamp-stuck@2"]).unwrap();
    let bench = Bench::new(&machine, faults);
    bench.fill(&program);
    bench.start(&program);
    let status = bench.wait(|status| status.state == State::Alarm);
    assert_eq!(status.alarm.map(|why| why.code).as_deref(), Some("magazine.clamp_closed"));
    let code = |ask| bench.drill.ask(ask).err().map(|why| why.code);
    assert_eq!(code(Ask::OpenClamp).as_deref(), Some("control.alarm_unread"));
    bench.wait(|_| bench.drill.ask(Ask::AcknowledgeAlarm).is_ok());
    bench.wait(|status| status.state == State::Ready);
    bench.wait(|_| bench.drill.ask(Ask::OpenClamp).is_ok());
    assert_eq!(bench.magazine().stock.spindle, Held::Unknown);
    assert_eq!(code(Ask::ToolSeen { seen: Seen::TakenAway }), None);
    let report = bench.magazine();
    assert_eq!(
        (report.stock.spindle, report.goes_on_with),
        (Held::Nothing, Some(ChangeStep::RaiseBeforeNew))
    );
}

#[test]
fn worn_tool_is_replaced_in_the_open_clamp() {
    let rack = ["T1 drill 0.6", "T2 drill 0.8 life 1", "T3 drill 1"].map(str::to_owned).to_vec();
    let machine = apply(&changer(), &[("rack.tools".to_owned(), Value::Texts(rack))]).unwrap();
    let program = three_tools(&machine);
    let bench = Bench::new(&machine, Faults::default());
    bench.fill(&program);
    bench.start(&program);
    bench.wait(|status| status.state == State::ToolChange && status.holes_done == 3);
    let code = |ask| bench.drill.ask(ask).err().map(|why| why.code);
    bench.wait(|_| bench.drill.ask(Ask::OpenClamp).is_ok());
    bench.wait(|status| status.inputs & Input::ClampOpen.bit() != 0);
    let open = bench.status().inputs;
    assert_eq!((open & Input::ToolHeld.bit(), &bench.magazine().stock.spindle), (0, &Held::Unknown));
    assert_eq!(code(Ask::ToolChanged).as_deref(), Some("magazine.clamp_by_hand"));
    assert_eq!(code(Ask::ToolSeen { seen: Seen::TakenAway }).as_deref(), Some("control.busy"));
    assert_eq!(bench.status().state, State::ToolChange);
    bench.drill.ask(Ask::ToolSeen { seen: Seen::InSpindle }).unwrap();
    let closed = Input::ToolHeld.bit();
    bench.wait(|status| status.inputs & (closed | Input::ClampOpen.bit()) == closed);
    bench.wait(|_| bench.magazine().stock.spindle != Held::Unknown);
    assert_eq!(bench.magazine().stock.change, None);
    bench.drill.ask(Ask::ToolChanged).unwrap();
    bench.wait(|status| status.job.is_none() && status.state != State::Stopping);
    bench.is_whole("a new one by hand");
}

#[test]
fn stop_with_open_clamp_asks_for_the_tool_and_resumes() {
    let rack = ["T1 drill 0.6", "T2 drill 0.8 life 1", "T3 drill 1"].map(str::to_owned).to_vec();
    let machine = apply(&changer(), &[("rack.tools".to_owned(), Value::Texts(rack))]).unwrap();
    let program = three_tools(&machine);
    let bench = Bench::new(&machine, Faults::default());
    bench.fill(&program);
    bench.start(&program);
    let asked = |status: &Status| status.state == State::ToolChange && status.holes_done == 3;
    bench.wait(asked);
    bench.wait(|_| bench.drill.ask(Ask::OpenClamp).is_ok());
    bench.wait(|status| status.inputs & Input::ClampOpen.bit() != 0);
    bench.drill.ask(Ask::Stop).unwrap();
    bench.wait(|status| status.state == State::Ready);
    let report = bench.magazine();
    assert_eq!((report.stock.spindle, report.goes_on_with), (Held::Unknown, None));
    assert_eq!(report.stock.change.map(|change| change.uncertain().0.number), Some(2));
    bench.drill.ask(Ask::ToolSeen { seen: Seen::InSpindle }).unwrap();
    bench.go_on(&program);
    bench.wait(asked);
    bench.drill.ask(Ask::ToolChanged).unwrap();
    bench.wait(|status| status.job.is_none() && status.state != State::Stopping);
    bench.is_whole("stopped with the clamp open");
}

#[test]
fn unknown_tool_in_spindle_refuses_a_start() {
    let machine = changer();
    let program = three_tools(&machine);
    let faults = annulus_core::virtual_drill::faults::read(["tool-dropped@2"]).unwrap();
    let bench = Bench::new(&machine, faults);
    let code = |ask| bench.drill.ask(ask).unwrap_err().code;
    assert_eq!(code(Ask::ToolSeen { seen: Seen::InPlace }), "magazine.nothing_stopped");
    bench.home();
    bench.drill.ask(Ask::SetZero).unwrap();
    let refused = |bench: &Bench| {
        let (_, _, checks) = bench.arm(&program);
        checks.into_iter().find(|row| row.verdict == RowVerdict::Fail).map(|row| row.finding.code)
    };
    assert_eq!(refused(&bench).as_deref(), Some("magazine.spindle_unknown"));
    bench.drill.ask(Ask::Stock { places: vec![], spindle: Held::Nothing }).unwrap();
    assert_eq!(refused(&bench).as_deref(), Some("preflight.bit_not_in_magazine"));
    bench.fill(&program);
    bench.start_here(&program);
    let status = bench.wait(|status| status.state == State::Alarm);
    assert_eq!(status.alarm.map(|why| why.code).as_deref(), Some("magazine.no_tool"));
    let report = bench.magazine();
    assert_eq!(report.stock.change.map(|change| change.step), Some(ChangeStep::RaiseFromNew));
    assert_eq!((report.stock.spindle, report.goes_on_with), (Held::Unknown, None));
    // While the tool lifts, an alarm cannot be acknowledged.
    bench.wait(|_| bench.drill.ask(Ask::AcknowledgeAlarm).is_ok());
    bench.wait(|status| status.state == State::Ready);
    assert_eq!(refused(&bench).as_deref(), Some("magazine.spindle_unknown"));
    // The user puts it into its slot.
    bench.drill.ask(Ask::ToolSeen { seen: Seen::InPlace }).unwrap();
    assert_eq!(bench.magazine().goes_on_with, Some(ChangeStep::RaiseBeforeNew));
    bench.go_on(&program);
    bench.wait(|status| status.job.is_none() && status.state != State::Stopping);
    bench.is_whole("dropped");
}

#[test]
fn clamp_output_makes_the_tool_unknown() {
    let bench = Bench::new(&changer(), Faults::default());
    bench.fill(&three_tools(&changer()));
    bench.home();
    bench.drill.ask(Ask::OutputLease { minutes: 1 }).unwrap();
    bench.drill.ask(Ask::Output { name: "clamp".to_owned(), on: true, pulse_ms: None }).unwrap();
    assert_eq!(bench.magazine().stock.spindle, Held::Unknown);
    let without = Bench::new(&virtual_drill(), Faults::default());
    let ask = Ask::Stock { places: vec![], spindle: Held::Nothing };
    assert_eq!(without.drill.ask(ask).unwrap_err().code, "magazine.none");
}

#[test]
fn record_line_has_spindle_and_tool_diameter() {
    let hole = annulus_core::virtual_drill::VirtualHole {
        x_mm: 1.0,
        y_mm: 2.0,
        depth_mm: 1.8,
        tick: 0,
        spindle: 1,
        bit_mm: Some(0.8),
    };
    assert_eq!(line(&hole), "1.0000 2.0000 1.8000 Z2 D0.8000\n");
}
