//! Tests of a stalled host: a page that carries no bytes, a worker without time. Also the page's permission
//! for a jog.

use super::level::one_bit;
use super::{Bench, Memory, NOW, ZERO, changer, holes, setter};
use crate::grbl::tests::Automaton;
use annulus_core::control::{Ending, State, Trust};
use annulus_core::wire::{Ask, Tell};
use std::time::Duration;

impl Bench {
    fn board_alone(&mut self, ms: u64) -> Vec<u8> {
        let mut said = Vec::new();
        for _ in 0..ms {
            NOW.set(NOW.get() + Duration::from_millis(1));
            self.board.tick();
            said.extend(self.board.said());
        }
        said
    }

    fn stuck(&mut self, ms: u64) {
        let (mut said, mut written) = (Vec::new(), Vec::new());
        for _ in 0..ms / 10 {
            said.extend(self.board_alone(10));
            self.station.advance();
            written.push(self.station.written());
        }
        for bytes in written.iter().filter(|bytes| !bytes.is_empty()) {
            self.board.hear(bytes);
            self.station.carried();
        }
        self.station.bytes(said);
        self.turn();
        // After the long silence the page has lost control.
        self.ask(&Ask::TakeControl { force: false });
    }

    fn asleep(&mut self, ms: u64) {
        let said = self.board_alone(ms);
        self.station.bytes(said);
        self.turn();
        self.ask(&Ask::TakeControl { force: false });
    }

    /// Page and worker, or only the page, stall longer than a job may continue unasked.
    fn stall(&mut self, stuck: bool) {
        if stuck { self.stuck(6_000) } else { self.asleep(6_000) }
    }

    pub(super) fn said(&self, code: &str) -> usize {
        let is = |tell: &&Tell| matches!(tell, Tell::Refused { why } if why.code == code);
        self.heard.iter().filter(is).count()
    }

    fn running() -> (Self, annulus_core::job::Program) {
        let program = holes(10);
        let mut bench = Self::ready(&Memory::default());
        let key = bench.upload(&program);
        bench.start(&key, 0);
        bench.state(State::ToolChange);
        assert_eq!(bench.refused(&Ask::ToolChanged), None);
        bench.until(|status| status.holes_done == 2);
        (bench, program)
    }
}

#[test]
fn long_computer_stall_pauses_the_job_without_losing_holes() {
    for (ms, stuck) in [(6_000, true), (6_000, false), (60_000, true), (3_600_000, false)] {
        let (mut bench, program) = Bench::running();
        if stuck {
            bench.stuck(ms);
        } else {
            bench.asleep(ms);
        }
        let status = bench.state(State::Paused);
        assert_eq!((status.trust, status.alarm), (Trust::Trusted, None), "{ms} ms, stuck {stuck}");
        assert_eq!(bench.said("grbl.computer_stood"), 1);
        let place = bench.board.place();
        (0..3_000).for_each(|_| bench.millisecond());
        assert_eq!(bench.board.place(), place, "nothing moves before a person wants it");
        assert_eq!(bench.refused(&Ask::Resume), None);
        assert_eq!(bench.finish(), (Ending::Done, 10));
        assert_eq!(bench.made(&program), (vec![1; 10], 0));
    }
}

#[test]
fn stalled_measurement_or_macro_holds_the_job() {
    let program = one_bit(4);
    for (measures, stuck) in [(true, true), (true, false), (false, true), (false, false)] {
        let mut board = Automaton::new([-20.0, -30.0, -10.0]);
        board.rack = Some(|_| 0.0);
        let mut bench = Bench::ready_with(&Memory::default(), board);
        let asks = if measures {
            bench.board.surface = Some(setter::surface);
            vec![setter::at(&setter::SETTER.numbers()), setter::on("setter")]
        } else {
            vec![changer::lines("G53 G0 Z-1\nM6 T{tool}\nG53 G0 X-200")]
        };
        asks.iter().for_each(|ask| assert_eq!(bench.refused(ask), None));
        let key = bench.upload(&program);
        bench.start(&key, 0);
        if measures {
            bench.until(|status| status.state == State::ToolChange && status.measuring.is_none());
            assert_eq!(bench.refused(&Ask::ToolChanged), None);
        }
        bench.until(|status| status.measuring.is_some() || status.changing.is_some());
        bench.stall(stuck);
        // A refused request does not let the job continue.
        assert_eq!(bench.refused(&Ask::Resume).as_deref(), Some("grbl.not_now"));
        let status = bench.state(State::Paused);
        assert_eq!((status.trust, status.alarm), (Trust::Trusted, None), "{measures} {stuck}");
        assert_eq!(bench.said("grbl.computer_stood"), 1, "{measures} {stuck}");
        let place = bench.board.place();
        (0..3_000).for_each(|_| bench.millisecond());
        assert_eq!(bench.board.place(), place, "{measures} {stuck}");
        assert_eq!(bench.refused(&Ask::Resume), None);
        assert_eq!(bench.finish(), (Ending::Done, 4), "{measures} {stuck}");
        assert_eq!(bench.made(&program), (vec![1; 4], 0), "{measures} {stuck}");
    }
}

#[test]
fn stalled_parking_ends_before_it_moves_sideways() {
    for stuck in [true, false] {
        let mut board = Automaton::new([-20.0, -30.0, -10.0]);
        // The pull-off distance after homing.
        board.settings.push((27, 1.0));
        let mut bench = Bench::ready_with(&Memory::default(), board);
        assert_eq!(bench.refused(&Ask::Park), None);
        bench.state(State::Parking);
        bench.stall(stuck);
        bench.state(State::Ready);
        (0..3_000).for_each(|_| bench.millisecond());
        let place = bench.board.place();
        assert!((0..2).all(|axis| (place[axis] - ZERO[axis]).abs() < 0.05), "stuck {stuck}: {place:?}");
    }
}

#[test]
fn request_to_continue_clears_the_stall() {
    let program = one_bit(4);
    for stalls_in in [State::Ready, State::ToolChange, State::Paused] {
        let mut bench = Bench::ready(&Memory::default());
        let stall = |bench: &mut Bench, state: State| {
            if state == stalls_in {
                bench.stall(true);
            }
        };
        let key = bench.upload(&program);
        stall(&mut bench, State::Ready);
        bench.start(&key, 0);
        bench.state(State::ToolChange);
        stall(&mut bench, State::ToolChange);
        assert_eq!(bench.refused(&Ask::ToolChanged), None);
        bench.until(|status| status.holes_done == 2);
        bench.ask(&Ask::Pause);
        bench.state(State::Paused);
        stall(&mut bench, State::Paused);
        assert_eq!(bench.refused(&Ask::Resume), None);
        assert_eq!(bench.finish(), (Ending::Done, 4), "{stalls_in:?}");
        assert_eq!(bench.said("grbl.computer_stood"), 0, "{stalls_in:?}");
    }
}

#[test]
fn late_computer_is_not_taken_for_a_silent_controller() {
    for stuck in [true, false] {
        let (mut bench, program) = Bench::running();
        for ms in [1_500, 2_500, 3_500] {
            (0..777).for_each(|_| bench.millisecond());
            if stuck { bench.stuck(ms) } else { bench.asleep(ms) }
        }
        assert_eq!(bench.finish(), (Ending::Done, 10), "stuck {stuck}");
        assert_eq!((bench.made(&program), bench.said("grbl.computer_stood")), ((vec![1; 10], 0), 0));
    }
}

#[test]
fn silent_controller_with_a_live_computer_is_closed() {
    let (mut bench, _) = Bench::running();
    for _ in 0..600 {
        bench.board_alone(10);
        bench.station.advance();
        if !bench.station.written().is_empty() {
            bench.station.carried();
        }
    }
    bench.turn();
    assert!(bench.station.is_over());
    assert_eq!((bench.said("grbl.unplugged"), bench.said("grbl.computer_stood")), (1, 0));
    assert_eq!(bench.status().map(|status| status.trust), Some(Trust::Lost));
}

#[test]
fn unplugged_jog_ends_soon_and_ignores_late_renewals() {
    let mut bench = Bench::plug(&Memory::default(), Automaton::new([-20.0, -30.0, -10.0]));
    bench.ask(&Ask::Home);
    bench.state(State::Ready);
    // At 300 mm/min, for 0.25 s.
    bench.ask(&Ask::Jog { axis: 2, distance_um: -2_000_000, anyway: false });
    (0..100).for_each(|_| bench.millisecond());
    let from = bench.board.place()[2];
    bench.station.unplugged();
    bench.board_alone(30_000);
    let way = from - bench.board.place()[2];
    assert!((0.1..1.25).contains(&way), "it went on for {way} mm");
    // The page renews the jog too late, because the worker was late too.
    let mut bench = bench.replug();
    bench.ask(&Ask::Home);
    bench.state(State::Ready);
    bench.ask(&Ask::Jog { axis: 2, distance_um: -2_000_000, anyway: false });
    (0..50).for_each(|_| bench.millisecond());
    let said = bench.board_alone(200);
    bench.ask(&Ask::JogOn);
    bench.station.bytes(said);
    (0..100).for_each(|_| bench.millisecond());
    bench.ask(&Ask::JogOn);
    let rests = bench.state(State::Ready).machine_mm[2];
    (0..1_000).for_each(|_| bench.millisecond());
    assert_eq!(bench.status().map(|status| status.machine_mm[2]), Some(rests));
    assert!((-3.5..-1.0).contains(&rests), "{rests}");
}

#[test]
fn door_opened_during_a_tool_change_is_reported_and_resumed() {
    let program = holes(10);
    let mut bench = Bench::ready(&Memory::default());
    let key = bench.upload(&program);
    bench.start(&key, 0);
    bench.state(State::ToolChange);
    bench.board.held = Some("Door:0");
    let status = bench.state(State::Paused);
    assert_eq!((status.trust, bench.said("grbl.door")), (Trust::Trusted, 1));
    (0..40_000).for_each(|_| bench.millisecond());
    assert_eq!(bench.said("grbl.door"), 1, "once");
    assert_eq!(bench.refused(&Ask::Resume), None);
    bench.state(State::ToolChange);
    assert_eq!(bench.refused(&Ask::ToolChanged), None);
    assert_eq!(bench.finish(), (Ending::Done, 10));
    assert_eq!(bench.made(&program), (vec![1; 10], 0));
}
