//! Tests of a page with an adapter at its port: whole boards, and all kinds of failures.

use super::world::World;
use super::*;
use crate::adapter::own_firmware;
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Cutter, Mark, Stage};
use annulus_core::pins::ShortTouches;
use annulus_core::wire::OtherFirmware;
use annulus_link::bytes::Writer;
use annulus_link::cobs::Unstuffer;
use annulus_link::frame::{FRAME, Header, ON_LINE, open, seal};
use annulus_link::message::{Refused, Tell as Told, Touches};

pub(super) fn machine() -> Machine {
    Machine { output: Output::Adapter, ..virtual_drill() }
}

pub(super) fn opened(files: &Memory, mut world: World, seed: u64) -> Bench {
    let port = world.port_again();
    Bench::of(Alone::at_port(files.clone(), port, seed, now).unwrap(), Some(world))
}

pub(super) fn ready(files: &Memory) -> Bench {
    let mut bench = opened(files, World::new(&machine(), files), 1);
    bench.home();
    assert_eq!(bench.status().state, State::Ready, "{:?}", bench.status().alarm);
    bench.ask(&Ask::SetZero);
    bench.turn(Duration::from_millis(100));
    bench
}

fn drilling(files: &Memory, program: &Program, holes: u32) -> Bench {
    let mut bench = ready(files);
    bench.start(program, 0);
    bench.until(|status| status.state == State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.holes_done >= holes);
    bench
}

fn program(count: usize) -> Program {
    drilled::holes(&machine(), count, 8, |_| 800)
}

impl Bench {
    pub(super) fn world(&mut self) -> &mut World {
        self.world.as_mut().unwrap()
    }

    fn go_on(&mut self) {
        let (key, leg) = self.offer().unwrap();
        self.start_again(&key, leg);
        self.is_done();
    }

    /// Finishes the job, and checks that no tool broke.
    fn is_done(&mut self) {
        assert_eq!(self.finish().0, Ending::Done);
        assert_eq!(self.world().broken(), None);
    }

    fn acknowledge(&mut self, code: &str) -> Status {
        let status = self.until(|status| status.state == State::Alarm);
        assert_eq!(status.alarm.unwrap().code, code);
        for _ in 0..100 {
            (0..50).for_each(|_| self.turn(TURN));
            // Control lapsed during the silence.
            self.ask(&Ask::TakeControl { force: true });
            self.ask(&Ask::AcknowledgeAlarm);
            self.turn(TURN);
            if self.status().alarm.is_none() {
                return self.status().clone();
            }
        }
        panic!("{:?} {:?}", self.refused(), self.status());
    }
}

#[test]
fn board_is_drilled_whole_over_a_bad_cable() {
    let (files, program) = (Memory::default(), program(40));
    let mut bench = ready(&files);
    for garbled in [false, true] {
        bench.world().garble = garbled.then(|| (Chance::new(3), 2_000));
        bench.start(&program, 0);
        assert_eq!(bench.finish(), (Ending::Done, 40));
        let status = bench.until(|status| status.state == State::Ready);
        assert_eq!((status.trust, status.spindle_rpm, &status.alarm), (Trust::Trusted, 0, &None));
        let real = bench.world().real();
        assert_eq!(real[..], status.steps[..3], "what it counts is where it is");
        let (missing, doubled) = against(&files, &program, status.zero_mm.unwrap());
        assert_eq!((missing, doubled), (0, if garbled { 40 } else { 0 }));
    }
}

pub(super) fn milled() -> Program {
    let mut program = program(1);
    let (height, feed_um_per_s) = (Length::from_um(-100), 10_000);
    let mill = |x, y| Command::Mill { to: Point::from_mm(x, y), height, feed_um_per_s };
    let circle = |x, y, r| Command::MillArc {
        to: Point::from_mm(x, y),
        height,
        center: Point::from_mm(x + r, y),
        ccw: true,
        feed_um_per_s,
    };
    program.bits[0].cutter = Cutter::Mill;
    for leg in program.legs.iter_mut().filter(|leg| matches!(leg.mark, Mark::Hole(_))) {
        leg.mark = Mark::Toolpath(0);
        leg.commands = vec![
            Command::Rapid { to: Point::from_mm(2.0, 6.0) },
            Command::Plunge { to: height, feed_um_per_s: 1_000, gate: None },
            circle(2.0, 6.0, 5.0),
            mill(20.0, 11.0),
            circle(20.0, 11.0, 1.0),
            mill(2.0, 16.0),
            mill(2.0, 6.0),
            Command::Retract { to: program.safe_height },
        ];
    }
    program
}

#[test]
fn job_takes_few_bytes_per_step() {
    // Includes all other traffic: status requests and keep-alives.
    for (what, program, most) in [("drilling", program(40), 0.25), ("milling", milled(), 0.35)] {
        let mut bench = ready(&Memory::default());
        let before = (bench.world().steps, bench.world().bytes);
        bench.start(&program, 0);
        bench.until(|status| status.state == State::ToolChange);
        let change = bench.world().bytes;
        bench.ask(&Ask::ToolChanged);
        bench.finish();
        let world = bench.world();
        let (steps, bytes) = (world.steps - before.0, world.bytes - before.1);
        let each = bytes as f64 / steps as f64;
        println!(
            "{what}: {bytes} bytes for {steps} steps, {each:.3} a step; until the bit is in {}",
            change - before.1
        );
        assert!(each <= most, "{what}: {each}");
    }
}

#[test]
fn stop_or_brief_unplugging_resumes_without_homing() {
    for seed in 0..6 {
        let (files, program) = (Memory::default(), program(16));
        let mut chance = Chance::new(seed);
        let mut bench = drilling(&files, &program, 1);
        (0..chance.below(300)).for_each(|_| bench.turn(TURN));
        if seed % 3 == 0 {
            bench.ask(&Ask::Stop);
            bench.until(|status| status.state == State::Ready);
        } else {
            bench.world().plug(false);
            let before = bench.world().steps;
            (0..200).for_each(|_| bench.turn(TURN));
            let rests = bench.world().steps;
            (0..200).for_each(|_| bench.turn(TURN));
            assert!(bench.world().steps == rests && rests > before, "it rests by itself");
            bench.world().plug(true);
            let status = bench.acknowledge("adapter.ran_dry");
            assert_eq!((status.state, status.trust), (State::Ready, Trust::Trusted), "seed {seed}");
        }
        let status = bench.status().clone();
        assert_eq!(bench.world().real()[..], status.steps[..3], "seed {seed}");
        bench.go_on();
        let (missing, doubled) = against(&files, &program, status.zero_mm.unwrap());
        assert!(missing == 0 && doubled <= 1, "seed {seed}: {missing} missing, {doubled} twice");
    }
}

#[test]
fn long_unplugging_requires_homing_before_resume() {
    for is_stopped in [true, false] {
        let (files, program) = (Memory::default(), program(12));
        let mut bench = drilling(&files, &program, 2);
        let since = now();
        bench.world().plug(false);
        (0..500).for_each(|_| bench.turn(TURN));
        assert_eq!(bench.status().alarm, None, "it is waited for");
        if is_stopped {
            bench.ask(&Ask::Stop);
        }
        let status = bench.until(|status| status.state == State::Alarm);
        let (waited, code) = (now() - since, status.alarm.unwrap().code);
        assert_eq!((code.as_str(), status.trust), ("adapter.unplugged", Trust::Lost));
        let most = Duration::from_secs(if is_stopped { 15 } else { 25 });
        assert!(waited < most && (is_stopped || waited >= Duration::from_secs(20)), "{waited:?}");
        let rests = bench.world().steps;
        bench.world().plug(true);
        assert_eq!(bench.acknowledge("adapter.unplugged").trust, Trust::Lost);
        assert_eq!(bench.world().steps, rests, "nothing moves by itself");
        bench.home();
        bench.go_on();
        let (missing, doubled) = against(&files, &program, bench.status().zero_mm.unwrap());
        assert!(missing == 0 && doubled <= 1, "{missing} missing, {doubled} twice");
    }
}

#[test]
fn drilling_time_limit_counts_executed_motion() {
    let (text, number) = (|word: &str| Value::Text(word.to_owned()), Value::Number);
    let changes = |longest_s| -> Vec<(String, Value)> {
        // One second of path to the end of the move; the bottom sensor turns on after 0.8 s.
        let changes = [
            ("overlap.on", text("no")),
            ("stroke.end", text("sensor")),
            ("stroke.breakthrough", number(2.0)),
            ("stroke.feed", number(3.6)),
            ("stroke.longest_drilling", number(longest_s)),
        ];
        changes.map(|(key, value)| (key.to_owned(), value)).to_vec()
    };
    for (longest_s, is_enough) in [(0.92, true), (0.5, false)] {
        let (files, changes) = (Memory::default(), changes(longest_s));
        let machine = annulus_core::machine::apply(&machine(), &changes).unwrap();
        let program = drilled::holes(&machine, 4, 8, |_| 800);
        let mut bench = opened(&files, World::new(&machine, &files), 1);
        bench.ask(&Ask::Configure { changes });
        assert_eq!(bench.refused(), None);
        bench.until(|status| status.trust == Trust::Lost && status.state == State::NotHomed);
        bench.home();
        bench.ask(&Ask::SetZero);
        bench.turn(Duration::from_millis(100));
        bench.start(&program, 0);
        bench.until(|status| status.state == State::ToolChange);
        bench.ask(&Ask::ToolChanged);
        if !is_enough {
            let status = bench.until(|status| status.state == State::Alarm);
            assert_eq!(status.alarm.unwrap().code, "control.drilling_too_long");
            continue;
        }
        // A stop within a drill cycle takes effect although more path was already sent.
        bench.until(|status| status.holes_done >= 1 && status.stage == Some(Stage::Drill));
        (0..100).for_each(|_| bench.turn(TURN));
        bench.ask(&Ask::Stop);
        let status = bench.until(|status| matches!(status.state, State::Ready | State::Alarm));
        assert_eq!((status.state, status.alarm), (State::Ready, None));
        bench.go_on();
    }
}

#[test]
fn two_second_hub_stall_loses_no_step() {
    let (files, program) = (Memory::default(), program(12));
    let mut bench = drilling(&files, &program, 1);
    bench.world().fast_ppm = 100;
    bench.world().stalled = true;
    (0..250).for_each(|_| bench.turn(TURN));
    bench.world().stalled = false;
    let status = bench.acknowledge("adapter.ran_dry");
    assert_eq!((status.state, status.trust), (State::Ready, Trust::Trusted));
    assert_eq!(bench.world().real()[..], status.steps[..3]);
    bench.go_on();
    let (missing, doubled) = against(&files, &program, status.zero_mm.unwrap());
    assert!(missing == 0 && doubled <= 1, "{missing} missing, {doubled} twice");
}

#[test]
fn closed_page_stops_the_adapter_and_resumes_after_homing() {
    let program = program(12);
    for seed in 0..8 {
        let (files, mut chance) = (Memory::default(), Chance::new(seed));
        let mut bench = drilling(&files, &program, 0);
        let zero_mm = bench.status().zero_mm.unwrap();
        (0..chance.below(1500)).for_each(|_| bench.turn(TURN));
        let Bench { drill, world: Some(mut world), .. } = bench else { panic!() };
        drop(drill);
        NOW.set(NOW.get() + Duration::from_secs(2));
        world.go_on();
        let rests = world.steps;
        NOW.set(NOW.get() + Duration::from_secs(2));
        world.go_on();
        assert_eq!(world.steps, rests, "seed {seed}: it rests by itself");
        let mut bench = opened(&files, world, 100 + seed);
        let Some((key, leg)) = bench.offer() else { continue };
        bench.home();
        assert_eq!(bench.status().zero_mm, Some(zero_mm), "seed {seed}");
        bench.start_again(&key, leg);
        bench.is_done();
        let (missing, doubled) = against(&files, &program, zero_mm);
        assert!(missing == 0 && doubled <= 1, "seed {seed}: {missing} missing, {doubled} twice");
    }
}

#[test]
fn rarely_called_page_runs_dry_and_loses_nothing() {
    let (files, program) = (Memory::default(), program(12));
    let mut bench = drilling(&files, &program, 1);
    // The adapter bridges a quarter of a second: it holds that much path.
    (0..8).for_each(|_| bench.turn(Duration::from_millis(240)));
    assert_eq!(bench.status().alarm, None);
    bench.turn(Duration::from_secs(3));
    let status = bench.acknowledge("adapter.ran_dry");
    assert_eq!(status.trust, Trust::Trusted);
    bench.go_on();
    let (missing, doubled) = against(&files, &program, status.zero_mm.unwrap());
    assert!(missing == 0 && doubled <= 1, "{missing} missing, {doubled} twice");
}

#[test]
fn emergency_stop_or_power_loss_requires_homing() {
    let (files, program) = (Memory::default(), program(12));
    let mut bench = drilling(&files, &program, 2);
    bench.world().pressed = true;
    let status = bench.until(|status| status.state == State::Alarm && status.stage.is_none());
    assert_eq!(status.alarm.unwrap().code, "adapter.emergency_stop");
    // While it is pressed, the alarm returns.
    bench.ask(&Ask::AcknowledgeAlarm);
    bench.turn(Duration::from_millis(500));
    bench.until(|status| status.state == State::Alarm);
    bench.world().pressed = false;
    assert_eq!(bench.acknowledge("adapter.emergency_stop").trust, Trust::Lost);
    bench.home();
    let (key, leg) = bench.offer().unwrap();
    bench.start_again(&key, leg);
    bench.until(|status| status.state == State::ToolChange);
    bench.ask(&Ask::ToolChanged);
    bench.until(|status| status.holes_done >= 5);
    bench.world().power();
    assert_eq!(bench.acknowledge("adapter.restarted").trust, Trust::Lost);
    bench.home();
    bench.go_on();
    let (missing, doubled) = against(&files, &program, bench.status().zero_mm.unwrap());
    assert!(missing == 0 && doubled <= 2, "{missing} missing, {doubled} twice");
}

#[test]
fn adapter_timing_fault_requires_homing() {
    let (files, program) = (Memory::default(), program(12));
    let mut bench = drilling(&files, &program, 2);
    bench.world().fault();
    assert_eq!(bench.acknowledge("adapter.fault").trust, Trust::Lost);
    bench.home();
    bench.go_on();
    let (missing, doubled) = against(&files, &program, bench.status().zero_mm.unwrap());
    assert!(missing == 0 && doubled <= 1, "{missing} missing, {doubled} twice");
}

#[test]
fn missing_or_foreign_device_at_the_port_gives_an_alarm() {
    let files = Memory::default();
    let mut world = World::new(&machine(), &files);
    world.plug(false);
    let port = world.port.clone();
    let mut bench = Bench::of(Alone::at_port(files, port.clone(), 1, now).unwrap(), None);
    let alarm = |bench: &mut Bench| bench.until(|status| status.alarm.is_some()).alarm.unwrap().code;
    assert_eq!(alarm(&mut bench), "adapter.unplugged");
    port.opened();
    bench.ask(&Ask::AcknowledgeAlarm);
    assert_eq!(alarm(&mut bench), "adapter.no_answer");
    bench.ask(&Ask::TakeControl { force: true });
    bench.ask(&Ask::AcknowledgeAlarm);
    for _ in 0..2_000 {
        port.bytes(b"\r\nGrbl 1.1h ['$' for help]\r\nerror:2\r\n");
        bench.turn(TURN);
    }
    assert_eq!(alarm(&mut bench), "adapter.another_program");
}

/// Frames of an adapter with other protocol versions, one for every hello in `bytes`.
fn refusals(bytes: &[u8], frames: &mut Unstuffer<FRAME>) -> Vec<u8> {
    let mut answer = Vec::new();
    for byte in bytes {
        let Some((header, _)) = frames.take(*byte).and_then(open) else { continue };
        let tell = Told::from(Refused { oldest: 7, newest: 9 });
        let (mut payload, mut line) = ([0; 16], [0; ON_LINE]);
        let mut out = Writer::new(&mut payload);
        tell.put(&mut out);
        let length = out.end().unwrap();
        let header = Header { number: 0, kind: tell.kind(), ..header };
        let length = seal(header, &payload[..length], &mut line).unwrap();
        answer.extend_from_slice(&line[..length]);
    }
    answer
}

#[test]
fn adapter_with_another_version_gives_an_alarm() {
    let (port, mut frames) = (crate::alone::Port::default(), Unstuffer::new());
    port.opened();
    let mut bench = Bench::of(Alone::at_port(Memory::default(), port.clone(), 1, now).unwrap(), None);
    for _ in 0..100 {
        port.bytes(&refusals(&port.written(), &mut frames));
        bench.turn(TURN);
    }
    let alarm = bench.until(|status| status.alarm.is_some()).alarm.unwrap();
    assert_eq!(alarm.code, "adapter.other_version");
}

#[test]
fn firmware_without_filters_is_refused_for_filtered_sensors() {
    let files = Memory::default();
    let mut bench = ready(&files);
    bench.world().knows_no_filters = true;
    let filters = Value::Numbers(vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 30.0]);
    bench.ask(&Ask::Configure { changes: vec![("adapter.filters".to_owned(), filters)] });
    let alarm = |bench: &mut Bench| bench.until(|status| status.alarm.is_some()).alarm.unwrap().code;
    // The contact sensor is not wired, so nothing is filtered.
    bench.until(|status| status.trust == Trust::Lost);
    assert_eq!(bench.status().alarm, None);
    let filters = Value::Numbers(vec![30.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    bench.ask(&Ask::Configure { changes: vec![("adapter.filters".to_owned(), filters)] });
    assert_eq!(alarm(&mut bench), "adapter.no_filters");
}

#[test]
fn different_adapter_firmware_is_reported_and_works() {
    let own = own_firmware();
    for (found, wanted) in [(own, None), (7, Some(OtherFirmware { found: 7, wanted: own }))] {
        let files = Memory::default();
        let mut world = World::new(&machine(), &files);
        world.flashed(found);
        let mut bench = opened(&files, world, 1);
        bench.until(|status| status.state == State::NotHomed);
        bench.home();
        let status = bench.status();
        assert_eq!((status.state, status.other_firmware, &status.alarm), (State::Ready, wanted, &None));
        if let Some(other) = wanted {
            let said = format!("{} {}", other.warning().message("en"), other.warning().advice("en"));
            let is_whole = ["00000007", &format!("{own:08x}"), "`annulus firmware flash`"];
            assert!(is_whole.iter().all(|part| said.contains(part)) && !said.contains('{'), "{said}");
        }
    }
}

#[test]
fn page_sets_adapter_wiring_but_not_the_output() {
    let files = Memory::default();
    let mut bench = ready(&files);
    let set = |key: &str, value| Ask::Configure { changes: vec![(key.to_owned(), value)] };
    bench.ask(&set("machine.output", Value::Text("card".to_owned())));
    assert_eq!(bench.refused(), Some("control.in_file_only"));
    bench.heard.clear();
    let low = Value::Numbers(vec![0.0, 0.0, 1.0, 0.0]);
    bench.ask(&set("adapter.steps_low", low.clone()));
    assert_eq!(bench.refused(), None);
    let status = bench.until(|status| status.trust == Trust::Lost);
    assert_eq!(status.alarm, None, "wired otherwise, it must be homed");
    bench.home();
    let again = opened(&files, bench.world.take().unwrap(), 9);
    let kept = again.heard.iter().any(|tell| match tell {
        Tell::Machine { settings, .. } => settings.contains(&("adapter.steps_low".to_owned(), low.clone())),
        _ => false,
    });
    assert!(kept, "the next page has the same wiring");
}

#[test]
fn touches_too_short_for_the_filter_are_reported() {
    let files = Memory::default();
    let mut bench = ready(&files);
    assert_eq!(bench.status().touches, None, "nothing is filtered");
    let filters = Value::Numbers(vec![0.0, 200.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    bench.ask(&Ask::Configure { changes: vec![("adapter.filters".to_owned(), filters)] });
    assert_eq!(bench.refused(), None);
    let mut touches = Touches::default();
    (touches.short[1], touches.longest_us[1], touches.short[7]) = (12, 150, 3);
    bench.world().touches = touches;
    let status = bench.until(|status| status.touches.is_some_and(|touches| touches[1].count > 0));
    let told = status.touches.unwrap();
    assert_eq!(told[1], ShortTouches { count: 12, longest_us: 150 });
    assert_eq!(told.map(|own| own.count), [0, 12, 0, 0, 0, 0, 0], "what no sensor is wired to is not told");
    bench.home();
    assert_eq!(bench.world().filters_us()[1], 200);
}

#[test]
fn page_configures_phases_and_the_adapter_drives_them() {
    let mut bench = ready(&Memory::default());
    let (text, number) = (|word: &str| Value::Text(word.to_owned()), Value::Number);
    let mut changes = vec![
        ("adapter.outputs".to_owned(), text("phases")),
        ("drive.max_step_rate".to_owned(), number(10_000.0)),
        ("x.max_speed".to_owned(), number(100.0)),
        ("y.max_speed".to_owned(), number(100.0)),
        ("z.max_speed".to_owned(), number(20.0)),
        ("motion.down_speed".to_owned(), number(20.0)),
    ];
    bench.ask(&Ask::Configure { changes: changes.clone() });
    assert_eq!(bench.refused(), Some("machine.adapter_no_input"), "as shipped, sensors are at inputs 0 to 5");
    assert!(!bench.world().drives_phases());
    bench.heard.clear();
    changes.push(("adapter.sensors".to_owned(), Value::Numbers(vec![0.0, -1.0, 1.0, -1.0, 2.0, -1.0, -1.0])));
    bench.ask(&Ask::Configure { changes });
    assert_eq!(bench.refused(), None);
    let status = bench.until(|status| status.trust == Trust::Lost);
    assert_eq!(status.alarm, None, "wired otherwise, it must be homed");
    (0..2_000).for_each(|_| bench.turn(TURN));
    assert!(bench.world().drives_phases());
    assert_eq!(bench.status().alarm, None);
}
