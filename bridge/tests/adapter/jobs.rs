//! Tests of jobs on an adapter: complete, stopped, over a bad cable, with the cable pulled, with the
//! emergency stop.
//!
//! The adapter is emulated cycle by cycle and takes six times real time, on a busy computer even more. So
//! every run drills a small job, and only the long tests do the rest.

use super::shop::Shop;
use annulus_core::control::{Ending, State, Trust};
use annulus_core::steps::{digest, replay_stream, stream_of};
use annulus_core::wire::Ask;

/// Returns `true` if long tests are enabled; if not, reports the skipped test.
fn is_long() -> bool {
    let is_long = std::env::var_os("ANNULUS_LONG").is_some();
    if !is_long {
        println!("skipped: a long test, which ANNULUS_LONG runs");
    }
    is_long
}

fn counts(steps: &[bool]) -> [usize; 2] {
    let up = steps.iter().filter(|up| **up).count();
    [up, steps.len() - up]
}

#[test]
fn small_board_is_drilled_with_the_exact_steps_of_the_stream() {
    let mut shop = Shop::homed(1);
    exact(&mut shop, 1);
}

#[test]
fn garbled_frames_do_not_change_the_steps_of_a_board() {
    if !is_long() {
        return;
    }
    let mut shop = Shop::homed(3);
    exact(&mut shop, 3);
    // Rarer than the longest frame: a frame damaged every time would never arrive.
    shop.bench.garble(Some(1500));
    shop.begin(0);
    assert_eq!(shop.ended(), (Ending::Done, 3));
    shop.agrees();
    shop.judge(3, 0);
}

#[test]
fn three_phase_outputs_drill_a_board_and_survive_an_estop() {
    if !is_long() {
        return;
    }
    let mut shop = Shop::homed_by_phases(2);
    exact(&mut shop, 2);
    pressed(&mut shop);
}

fn exact(shop: &mut Shop, count: u32) {
    let before = shop.agrees();
    let stream = stream_of(&shop.program, &shop.machine).unwrap();
    assert_eq!(shop.begin(0), digest(&stream), "the bridge plays this very stream");
    shop.until(|status| status.state == State::Running);
    shop.spindle(true);
    assert_eq!(shop.ended(), (Ending::Done, count));
    let status = shop.until(|status| status.state == State::Ready);
    assert_eq!((status.trust, shop.bench.record().spindle), (Trust::Trusted, false));
    let after = shop.agrees();
    shop.judge(count, 0);
    let surface = shop.machine.z.scale.steps(shop.machine.process.surface);
    let mut stepped: [Vec<bool>; 3] = Default::default();
    for pulse in replay_stream(&stream) {
        for (axis, own) in stepped.iter_mut().enumerate().filter(|(axis, _)| pulse.axes >> axis & 1 == 1) {
            own.push(pulse.forward >> axis & 1 == 1);
        }
    }
    for (axis, stepped) in stepped.iter().enumerate() {
        let made = &after.steps[axis][before.steps[axis].len()..];
        let zero = if axis == 2 { surface } else { shop.rested[axis] };
        // To the start of the stream, the stream, and up at the end.
        let there = zero + stream.start[axis] - shop.rested[axis];
        let end = stream.segments.last().map_or(0, |last| last.end[axis]);
        let home = status.steps[axis] - (zero + end);
        let leads = [there, home]
            .iter()
            .fold([0, 0], |[up, down], way| [up + (*way).max(0) as usize, down + (-way).max(0) as usize]);
        let wanted = counts(stepped);
        assert_eq!(counts(made), [0, 1].map(|way| wanted[way] + leads[way]), "axis {axis}");
        let begin = there.unsigned_abs() as usize;
        assert_eq!(made[begin..begin + stepped.len()], stepped[..], "axis {axis}");
    }
    let steps: usize = stepped.iter().map(Vec::len).sum();
    println!("{steps} steps of the stream, {} bytes over the cable", after.bytes - before.bytes);
}

#[test]
fn job_resumes_after_stop_unplugged_cable_and_killed_bridge() {
    if !is_long() {
        return;
    }
    let mut shop = Shop::homed(2);
    stopped(&mut shop);
    unplugged(&mut shop);
    killed(shop);
}

fn amid(shop: &mut Shop) {
    shop.begin(0);
    shop.until(|status| status.holes_done >= 1 && status.stage.is_some());
}

fn goes_on(shop: &mut Shop) {
    let leg = shop.offered();
    shop.start(leg);
    assert_eq!(shop.ended().0, Ending::Done);
    shop.until(|status| status.state == State::Ready);
    shop.agrees();
    shop.judge(2, 1);
}

fn stopped(shop: &mut Shop) {
    amid(shop);
    shop.page.ask(&Ask::Stop);
    assert_eq!(shop.ended().0, Ending::Stopped);
    let status = shop.until(|status| status.state == State::Ready);
    assert_eq!((status.trust, status.spindle_rpm), (Trust::Trusted, 0));
    shop.agrees();
    goes_on(shop);
}

fn unplugged(shop: &mut Shop) {
    amid(shop);
    shop.bench.plug(false);
    shop.bench.rests();
    shop.spindle(false);
    shop.bench.plug(true);
    let status = shop.until(|status| status.state == State::Alarm);
    assert_eq!((status.alarm.unwrap().code.as_str(), status.trust), ("adapter.ran_dry", Trust::Trusted));
    assert_eq!(shop.acknowledged(), State::Ready);
    shop.agrees();
    goes_on(shop);
}

fn killed(mut shop: Shop) {
    amid(&mut shop);
    shop.kill();
    shop.bench.rests();
    shop.spindle(false);
}

#[test]
fn job_resumes_after_estop_power_loss_and_homing() {
    if !is_long() {
        return;
    }
    let mut shop = Shop::homed(2);
    pressed(&mut shop);

    amid(&mut shop);
    shop.bench.plug(false);
    shop.bench.power();
    shop.bench.plug(true);
    let status = shop.until(|status| status.state == State::Alarm);
    assert_eq!((status.alarm.unwrap().code.as_str(), status.trust), ("adapter.restarted", Trust::Lost));
    assert_eq!(shop.acknowledged(), State::NotHomed);
    shop.home();
    goes_on(&mut shop);
}

fn pressed(shop: &mut Shop) {
    amid(shop);
    shop.bench.press(true);
    let status = shop.until(|status| status.state == State::Alarm);
    assert_eq!((status.alarm.unwrap().code.as_str(), status.trust), ("adapter.emergency_stop", Trust::Lost));
    shop.spindle(false);
    shop.acknowledge();
    assert_eq!(shop.page.refusal(), "adapter.emergency_stop", "while it is pressed");
    shop.bench.press(false);
    assert_eq!(shop.acknowledged(), State::NotHomed);
    shop.home();
    goes_on(shop);
}
