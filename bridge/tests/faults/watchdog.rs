//! Bridge and executor watch each other (N15): a machine on an I/O card whose device is an ordinary file, the spindle on, and one
//! of the two killed or made to stand still. What is judged is the file alone: the bytes on the outputs.

use crate::server::card::{Scene, last_record};
use crate::server::client::PATIENCE;
use crate::server::work::{jog, until_status};
use annulus_core::control::{State, Trust};
use annulus_core::wire::{Ask, Status};
use std::fs::{self, OpenOptions};
use std::os::unix::fs::FileExt;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

/// Longer than this nobody takes on whatever computer; a clock that does not run takes for ever.
const AT_MOST: Duration = Duration::from_secs(5);

impl Scene {
    /// The executor is the bridge's only child.
    fn executor(&self) -> u32 {
        let tasks = fs::read_dir(format!("/proc/{}/task", self.bridge.child.id())).unwrap().flatten();
        let mut children = tasks.filter_map(|task| {
            let text = fs::read_to_string(task.path().join("children")).unwrap_or_default();
            text.split_whitespace().next().and_then(|pid| pid.parse().ok())
        });
        children.next().unwrap()
    }

    /// Waits until `wanted` holds for what is on the outputs, and says how long that took.
    fn until(&self, wanted: impl Fn([u8; 4]) -> bool) -> Duration {
        let since = Instant::now();
        while !wanted(self.shop.outputs()) {
            assert!(since.elapsed() < PATIENCE, "still {:02x?}", self.shop.outputs());
            thread::sleep(Duration::from_millis(1));
        }
        since.elapsed()
    }

    fn alarm(&mut self, code: &str) -> Status {
        let status = until_status(&mut self.page, |status| status.state == State::Alarm);
        assert_eq!((status.trust, status.alarm.as_ref().unwrap().code.as_str()), (Trust::Lost, code));
        status
    }

    /// STOP, when nobody is left who would do it: something turned the spindle and the windings on again.
    fn stop_works(&mut self) {
        let device = OpenOptions::new().write(true).open(&self.shop.device).unwrap();
        for _ in 0..3 {
            device.write_all_at(&[0x25, 0x49, 0x2A, 1], 0).unwrap();
            self.page.ask(&Ask::Stop);
            self.until(|bytes| bytes == [0; 4]);
        }
    }

    /// After the alarm was read it works as ever.
    fn works_again(mut self) {
        self.page.ask(&Ask::AcknowledgeAlarm);
        // What was told before the answer still has the alarm that was wanted: it says nothing of a busy computer.
        let read = |status: &Status| status.state == State::NotHomed;
        while !read(&until_status(&mut self.page, |status| read(status) || status.alarm.is_some())) {}
        jog(&mut self.page, 0, 1_000, |status| status.state == State::NotHomed && status.steps[0] == 5);
    }
}

fn signal(pid: u32, name: &str) {
    assert!(Command::new("kill").args([name, &pid.to_string()]).status().unwrap().success());
}

#[test]
fn a_killed_executor_leaves_nothing_on_and_stop_works() {
    let rounds = if std::env::var_os("ANNULUS_LONG").is_some() { 12 } else { 2 };
    for round in 0..rounds {
        let mut scene = Scene::on_its_way();
        thread::sleep(Duration::from_millis(37 * round));
        signal(scene.executor(), "-KILL");
        let took = scene.until(|bytes| bytes == [0; 4]);
        println!("round {round}: everything off after {took:?}");
        assert!(took < AT_MOST, "{took:?}");
        scene.alarm("output.executor_gone");
        scene.stop_works();
        scene.works_again();
    }
}

#[test]
fn an_executor_that_stands_still_is_ended_and_leaves_nothing_on() {
    let mut scene = Scene::on_its_way();
    signal(scene.executor(), "-STOP");
    let took = scene.until(|bytes| bytes == [0; 4]);
    println!("everything off after {took:?}");
    assert!(took < AT_MOST, "{took:?}");
    scene.alarm("output.executor_silent");
    scene.stop_works();
    scene.works_again();
}

#[test]
fn a_bridge_that_stands_still_is_not_waited_for() {
    let mut scene = Scene::on_its_way();
    signal(scene.bridge.child.id(), "-STOP");
    let took = scene.until(|bytes| bytes[3] == 0);
    println!("the spindle is off after {took:?}");
    assert!(took < AT_MOST, "{took:?}");
    scene.shop.until_let_go();
    let outputs = scene.shop.outputs();
    assert_eq!(outputs.map(|byte| byte & 0x60), [0; 4], "no forcing: {outputs:02x?}");
    let record = last_record(scene.bridge.home.as_ref().unwrap().path());
    assert_eq!(record["event"], "bridge_silent");
    // No abrupt stop: the intervals of X grow to the end.
    let steps = record["steps"].as_array().unwrap().iter();
    let ticks: Vec<i64> = steps
        .filter(|step| step[1].as_i64().unwrap() & 1 == 1)
        .map(|step| step[0].as_i64().unwrap())
        .collect();
    let intervals: Vec<i64> = ticks.windows(2).map(|two| two[1] - two[0]).collect();
    let ramp = &intervals[intervals.len() - 8..];
    assert!(ramp.windows(2).all(|two| two[1] >= two[0]) && ramp[7] > 2 * ramp[0], "{intervals:?}");
    // Woken up, the bridge says what happened, and goes on when that was read.
    signal(scene.bridge.child.id(), "-CONT");
    scene.alarm("output.bridge_silent");
    scene.works_again();
}

#[test]
fn outputs_that_cannot_be_switched_off_are_told_as_that() {
    let mut scene = Scene::on_its_way();
    let aside = scene.shop.device.with_extension("aside");
    fs::rename(&scene.shop.device, aside).unwrap();
    signal(scene.executor(), "-KILL");
    let status = scene.alarm("output.not_safe");
    let said = status.alarm.unwrap().message("en");
    assert!(said.contains("card.bin"), "{said}");
}
