//! Tests that the board is compared with the program after every run, and of what is refused before one.

use super::*;
use annulus_core::virtual_drill::faults;
use annulus_core::wire::DrilledReport;

/// Ten holes, the last five with the spindle almost stopped.
fn slow_spindle() -> Program {
    let mut program = grid(&machine(), 10);
    let slow = Leg {
        mark: Mark::Prepare,
        commands: vec![Command::Spindle { rpm: 100 }, Command::Dwell { us: 5_000_000 }],
    };
    program.legs.insert(7, slow);
    program
}

#[test]
fn broken_tool_raises_an_alarm_that_lists_missing_holes() {
    let mut bench = Bench::new(&machine(), Faults::default());
    bench.start(&slow_spindle());
    assert_eq!(bench.ended(), (Ending::Done, 10), "no sensor of this machine tells");
    assert_eq!(bench.record().len(), 5, "the board itself");
    let status = bench.wait(|status| status.state == State::Alarm);
    let told = DrilledReport { missing: 5, broken: 1, ..DrilledReport::default() };
    assert_eq!((status.drilled, status.trust), (Some(told), Trust::Trusted));
    let missing = status.missing.unwrap();
    let again = slow_spindle().only(|leg| missing.legs.iter().any(|(a, b)| (*a..*b).contains(&(leg as u32))));
    assert_eq!(again.hole_count(), 5, "what is missing is named leg by leg: {missing:?}");
    let why = status.alarm.unwrap();
    assert_eq!(why.code, "control.board_differs");
    assert!(why.message("en").contains('5'), "{}", why.message("en"));
    bench.wait(|_| bench.drill.ask(Ask::AcknowledgeAlarm).is_ok());
    assert_eq!(bench.status().state, State::Ready);
    // With another board the same position is clean again, and the previous run no longer matters.
    bench.drill.ask(Ask::SetZero).unwrap();
    bench.start_here(&grid(&machine(), 4));
    assert_eq!(bench.ended(), (Ending::Done, 4));
    let status = bench.wait(|status| status.state == State::Ready);
    assert_eq!((status.drilled, status.missing), (Some(DrilledReport::default()), None));
}

#[test]
fn early_or_missing_contact_stops_at_the_hole_and_resumes_there() {
    let mut looks = machine();
    looks.process.contact_tolerance = Length::from_um(100);
    for (fault, code) in [("contact-early", "control.early_contact"), ("broken-bit", "control.no_contact")] {
        let mut bench = Bench::new(&looks, faults::read([fault]).unwrap());
        bench.start(&grid(&looks, 8));
        assert_eq!(bench.ended(), (Ending::Alarm, 2), "{fault}");
        let status = bench.wait(|status| status.state == State::Alarm && status.spindle_rpm == 0);
        assert_eq!(status.trust, Trust::Trusted, "{fault}");
        assert!(status.machine_mm[2] > -1.01, "{fault}: the tip is up: {status:?}");
        let why = status.alarm.unwrap();
        assert_eq!(why.code, code);
        assert!(fault != "contact-early" || why.message("en").contains("0.25 mm"), "{}", why.message("en"));
        bench.wait(|_| bench.drill.ask(Ask::AcknowledgeAlarm).is_ok());
        // Another tool is in: the same hole, and all later ones.
        bench.take_up(&grid(&looks, 8));
        assert_eq!(bench.ended(), (Ending::Done, 8), "{fault}");
        assert_eq!(counts(&bench.record(), 8), [1; 8], "{fault}");
    }
}

#[test]
fn shifted_holes_are_counted_and_planned_repeats_are_not() {
    let twice = {
        let mut program = grid(&machine(), 3);
        let again = program.legs[2].clone();
        program.legs.insert(3, again);
        program
    };
    let mut bench = Bench::new(&machine(), Faults::default());
    bench.start(&twice);
    bench.ended();
    let status = bench.wait(|status| status.drilled.is_some());
    assert_eq!(status.drilled, Some(DrilledReport::default()), "the program asks for it twice");
    // Twelve steps of Y lost before the second hole: it and the third are displaced.
    let faults = Faults { lost_steps: vec![(1, 16_500), (1, 16_600), (1, 16_700)], ..Faults::default() };
    let mut program = grid(&machine(), 3);
    program.legs[3].commands[0] = Command::Rapid { to: Point::from_mm(10.0, 180.0) };
    program.legs[4].commands[0] = Command::Rapid { to: Point::from_mm(12.5, 180.0) };
    let mut bench = Bench::new(&machine(), faults);
    bench.start(&program);
    bench.ended();
    let status = bench.wait(|status| status.state == State::Alarm);
    let told = status.drilled.unwrap();
    assert_eq!((told.missing, told.doubled, told.shifted, told.broken), (0, 0, 2, 0), "{told:?}");
    assert!(told.slipped_steps >= 12 && status.trust == Trust::Suspect, "{status:?}");
}

/// Rows: holes on the board beyond the journal's, counted from the hole where the job resumes; and the
/// expected report.
#[test]
fn only_the_resumed_hole_may_be_drilled_twice() {
    let rows = [(vec![], 0, 0), (vec![0], 1, 0), (vec![3], 0, 1), (vec![0, 3, 4], 1, 2)];
    for (there, twice, doubled) in rows {
        let folder = tempfile::tempdir().unwrap();
        let drill = Drill::open_with(folder.path(), machine(), 20.0, Faults::default()).unwrap();
        let tells = drill.watch();
        let mut bench = Bench { drill, folder, tells };
        bench.start(&grid(&machine(), 40));
        bench.wait(|status| status.holes_done >= 2);
        bench.drill.ask(Ask::StopAfterHole).unwrap();
        let (ending, done) = bench.ended();
        assert!(ending == Ending::StoppedAfterHole && done < 30, "{ending:?} after {done}");
        // As if the bridge had been killed before it recorded them.
        let path = bench.folder.path().join(RECORD);
        let mut record = fs::OpenOptions::new().append(true).open(path).unwrap();
        for hole in &there {
            let at = place(done + hole);
            writeln!(record, "{:.4} {:.4} 2.1000", at.x.mm() + 1.0, at.y.mm() + 1.0).unwrap();
        }
        bench.wait(|status| status.state == State::Ready);
        bench.take_up(&grid(&machine(), 40));
        assert_eq!(bench.ended(), (Ending::Done, 40));
        let state = if doubled > 0 { State::Alarm } else { State::Ready };
        let status = bench.wait(|status| status.state == state && status.drilled.is_some());
        let expected: Vec<u32> = (0..twice).map(|_| done + 1).collect();
        assert_eq!(status.drilled_twice, expected, "{there:?}");
        assert_eq!(status.drilled, Some(DrilledReport { doubled, ..DrilledReport::default() }), "{there:?}");
        assert_eq!(
            status.alarm.map(|why| why.code),
            (doubled > 0).then(|| "control.board_differs".to_owned())
        );
    }
}

#[test]
fn arming_refuses_impossible_speeds_and_unknown_tools() {
    let bench = Bench::new(&machine(), Faults::default());
    bench.home();
    bench.drill.ask(Ask::SetZero).unwrap();
    let with = |place: [usize; 2], command: Command| {
        let mut program = grid(&machine(), 2);
        program.legs[place[0]].commands[place[1]] = command;
        program
    };
    let rows = [
        (with([1, 0], Command::Spindle { rpm: u32::MAX }), "check.spindle_speed"),
        (with([1, 0], Command::Spindle { rpm: 300_001 }), "check.spindle_speed"),
        (with([0, 0], Command::AwaitBit { bit: 9 }), "preflight.no_such_bit"),
        (with([0, 0], Command::AwaitBit { bit: 1 }), "preflight.no_such_bit"),
    ];
    for (program, code) in rows {
        let (job, stream_digest, checks) = bench.arm(&program);
        let failed: Vec<_> = checks.iter().filter(|row| row.verdict == RowVerdict::Fail).collect();
        assert!(failed.iter().any(|row| row.finding.code == code), "{code}: {failed:?}");
        assert!(failed.iter().all(|row| !row.finding.message("en").contains('{')), "{failed:?}");
        let refused = bench.drill.ask(Ask::Start { job, stream_digest, from_leg: 0 }).unwrap_err();
        assert_eq!(refused.code, "control.not_armed");
    }
    let (.., checks) = bench.arm(&with([1, 0], Command::Spindle { rpm: 300_000 }));
    assert!(checks.iter().all(|row| row.verdict != RowVerdict::Fail), "{checks:?}");
}

#[test]
fn second_stop_holds_the_tool_during_its_lift() {
    let folder = tempfile::tempdir().unwrap();
    let drill = Drill::open_with(folder.path(), machine(), 5.0, Faults::default()).unwrap();
    let tells = drill.watch();
    let mut bench = Bench { drill, folder, tells };
    bench.start(&grid(&machine(), 2));
    bench.wait(|status| status.state == State::Running && status.spindle_rpm > 0);
    // So slow that the lift takes seconds.
    bench.drill.ask(Ask::FeedOverride { percent: 10 }).unwrap();
    bench.drill.ask(Ask::Stop).unwrap();
    let low = bench.status().steps[2];
    bench.wait(|status| status.state == State::Stopping && status.steps[2] > low + 40);
    // A second press within half a second counts as the first.
    std::thread::sleep(Duration::from_millis(550));
    for _ in 0..5 {
        bench.drill.ask(Ask::Stop).unwrap();
    }
    assert_eq!(bench.ended().0, Ending::Stopped);
    let held = bench.wait(|status| status.state == State::Ready && status.spindle_rpm == 0);
    let top = machine().z.scale.steps(machine().z.max - machine().z.home_offset);
    assert!(held.steps[2] < top - 100, "it rose on: {} of {top}", held.steps[2]);
    assert_eq!(held.trust, Trust::Trusted);
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(bench.status().steps, held.steps, "and it stays");
    // The user jogs up; then everything works as before.
    bench.drill.ask(Ask::FeedOverride { percent: 100 }).unwrap();
    bench.drill.ask(Ask::Jog { axis: 2, distance_um: 1_000, anyway: false }).unwrap();
    bench.wait(|status| status.state == State::Ready && status.steps[2] > held.steps[2]);
}

#[test]
fn stop_lifts_every_spindle_even_if_the_first_is_up() {
    let machine = Machine { tool_change: ToolChange::Unattended, ..six_spindles() };
    let top = machine.z.scale.steps(machine.z.max - machine.z.home_offset);
    let surface = machine.z.scale.steps(machine.process.surface);
    // Only Z2 and Z4, one slow hole: stopped in the board, and paused between two holes of a chain.
    let mut program = Program { spindles: 0b1010, ..grid(&machine, 30) };
    let mut bench = Bench::new(&machine, Faults::default());
    bench.start(&program);
    bench.drill.ask(Ask::Pause).unwrap();
    let held = bench.wait(|status| status.state == State::Paused && status.spindle_rpm == 0);
    assert!(held.steps[2..].iter().all(|height| *height > surface), "{:?}", held.steps);
    bench.drill.ask(Ask::Resume).unwrap();
    bench.wait(|status| status.holes_done > held.holes_done);
    bench.drill.ask(Ask::Stop).unwrap();
    let status = bench.wait(|status| status.state == State::Ready);
    assert_eq!(bench.ended().0, Ending::Stopped);
    assert_eq!(status.steps[2..], [top; 6]);
    let slow = program.legs.iter_mut().flat_map(|leg| &mut leg.commands);
    slow.for_each(|command| {
        if let Command::Plunge { feed_um_per_s, .. } = command {
            *feed_um_per_s = 20;
        }
    });
    let bench = Bench::new(&machine, Faults::default());
    bench.start(&program);
    let low = bench.wait(|status| status.steps[3] < surface);
    assert!(low.steps[2] > surface, "Z1 stays up");
    bench.drill.ask(Ask::Stop).unwrap();
    let status = bench.wait(|status| status.state == State::Ready);
    assert_eq!((status.trust, status.steps[2..].to_vec()), (Trust::Trusted, vec![top; 6]));
}

#[test]
fn different_spindles_finish_a_paused_and_resumed_board() {
    let own: [(&str, &[f64]); 3] = [
        ("spindle.deeper", &[0.0, 0.4, 0.0, -0.7]),
        ("spindle.longer", &[0.0, 0.0, 1.5, -2.25, 0.8]),
        ("spindle.margin", &[0.0, 0.0, 0.0, 0.0, 12.0]),
    ];
    let own: Vec<_> =
        own.iter().map(|(key, numbers)| ((*key).to_owned(), Value::Numbers(numbers.to_vec()))).collect();
    let machine = annulus_core::machine::apply(&six_spindles(), &own).unwrap();
    let machine = Machine { tool_change: ToolChange::Unattended, ..machine };
    let top = machine.z.scale.steps(machine.z.max - machine.z.home_offset);
    let program = Program { spindles: 0b11_1111, ..grid(&machine, 120) };
    let folder = tempfile::tempdir().unwrap();
    let drill = Drill::open_with(folder.path(), machine.clone(), 20.0, Faults::default()).unwrap();
    let tells = drill.watch();
    let mut bench = Bench { drill, folder, tells };
    bench.start(&program);
    bench.wait(|status| status.holes_done > 3);
    bench.drill.ask(Ask::Pause).unwrap();
    let held = bench.wait(|status| status.state == State::Paused && status.spindle_rpm == 0);
    let surface = machine.on_surface();
    let lowest = machine.spindle_axes().map(|axis| held.steps[axis] - surface[axis]).min();
    assert!(lowest > Some(0), "a tip stays in the board: {:?}", held.steps);
    bench.drill.ask(Ask::Resume).unwrap();
    bench.wait(|status| status.holes_done > held.holes_done + 3);
    bench.drill.ask(Ask::Stop).unwrap();
    let status = bench.wait(|status| status.state == State::Ready);
    assert_eq!(bench.ended().0, Ending::Stopped);
    assert_eq!((status.trust, status.steps[2..].to_vec()), (Trust::Trusted, vec![top; 6]));
    bench.take_up(&program);
    assert_eq!(bench.ended().0, Ending::Done);
    let status = bench.wait(|status| status.drilled.is_some());
    assert_eq!(status.drilled, Some(DrilledReport::default()));
}
