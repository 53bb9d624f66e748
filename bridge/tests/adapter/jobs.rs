//! Jobs on an adapter: whole, stopped, over a bad cable, with the cable pulled, with the emergency stop.
//!
//! The adapter of these tests is emulated cycle by cycle and takes six times as long as life, on a busy computer more than anybody
//! waits for: a small job is always drilled, the others are among the long tests.

use super::shop::Shop;
use annulus_core::control::{Ending, State, Trust};
use annulus_core::steps::{digest, replay_stream, stream_of};
use annulus_core::wire::Ask;

/// Whether long tests are run; where they are not it is said that this one is left out.
fn is_long() -> bool {
    let is_long = std::env::var_os("ANNULUS_LONG").is_some();
    if !is_long {
        println!("skipped: a long test, which ANNULUS_LONG runs");
    }
    is_long
}

/// Steps of an axis, up and down.
fn counts(steps: &[bool]) -> [usize; 2] {
    let up = steps.iter().filter(|up| **up).count();
    [up, steps.len() - up]
}

#[test]
fn a_small_board_is_drilled_whole_and_the_pins_step_as_the_stream_says() {
    let mut shop = Shop::homed(1);
    exact(&mut shop, 1);
}

#[test]
fn a_board_is_drilled_whole_and_the_pins_step_as_the_stream_says_over_a_bad_cable_too() {
    if !is_long() {
        return;
    }
    let mut shop = Shop::homed(3);
    exact(&mut shop, 3);
    // Rarer than the longest frame: one that is spoiled every time never comes.
    shop.bench.garble(Some(1500));
    shop.begin(0);
    assert_eq!(shop.ended(), (Ending::Done, 3));
    shop.agrees();
    shop.judge(3, 0);
}

#[test]
fn a_board_is_drilled_whole_by_the_phases_of_three_motors_and_after_the_emergency_stop_too() {
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
        // To where the stream begins, the stream, and up at the end.
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
fn a_job_that_was_stopped_or_whose_cable_was_pulled_goes_on_where_it_was() {
    if !is_long() {
        return;
    }
    let mut shop = Shop::homed(2);
    stopped(&mut shop);
    unplugged(&mut shop);
    killed(shop);
}

/// In the middle of the job, after the first hole.
fn amid(shop: &mut Shop) {
    shop.begin(0);
    shop.until(|status| status.holes_done >= 1 && status.stage.is_some());
}

/// What was broken off goes on, and every hole is there.
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
fn after_the_emergency_stop_and_after_a_loss_of_power_it_is_homed_and_the_job_goes_on() {
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
