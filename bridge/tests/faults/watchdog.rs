//! Tests that bridge and executor watch each other: one of the two is killed or suspended. The machine is
//! on an I/O card with a port file, its spindle on. Only the output bytes in the file are judged.

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

    /// Waits until the outputs satisfy `wanted`. Returns how long that took.
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

    /// STOP after the executor died: something has turned the spindle and the windings on again.
    fn stop_works(&mut self) {
        let device = OpenOptions::new().write(true).open(&self.shop.device).unwrap();
        for _ in 0..3 {
            device.write_all_at(&[0x25, 0x49, 0x2A, 1], 0).unwrap();
            self.page.ask(&Ask::Stop);
            self.until(|bytes| bytes == [0; 4]);
        }
    }

    fn works_again(mut self) {
        self.page.ask(&Ask::AcknowledgeAlarm);
        // A status from before the answer still shows the alarm; do not take it for a new one.
        let read = |status: &Status| status.state == State::NotHomed;
        while !read(&until_status(&mut self.page, |status| read(status) || status.alarm.is_some())) {}
        jog(&mut self.page, 0, 1_000, |status| status.state == State::NotHomed && status.steps[0] == 5);
    }
}

fn signal(pid: u32, name: &str) {
    assert!(Command::new("kill").args([name, &pid.to_string()]).status().unwrap().success());
}

#[test]
fn killed_executor_switches_all_outputs_off() {
    let rounds = if std::env::var_os("ANNULUS_LONG").is_some() { 12 } else { 2 };
    for round in 0..rounds {
        let mut scene = Scene::on_its_way();
        thread::sleep(Duration::from_millis(37 * round));
        signal(scene.executor(), "-KILL");
        let took = scene.until(|bytes| bytes == [0; 4]);
        println!("round {round}: everything off after {took:?}");
        assert_eq!(scene.alarm("output.executor_gone").spindle_rpm, 0, "it is off");
        scene.stop_works();
        scene.works_again();
    }
}

#[test]
fn frozen_executor_is_ended_and_all_outputs_are_off() {
    let mut scene = Scene::on_its_way();
    signal(scene.executor(), "-STOP");
    let took = scene.until(|bytes| bytes == [0; 4]);
    println!("everything off after {took:?}");
    scene.alarm("output.executor_silent");
    scene.stop_works();
    scene.works_again();
}

#[test]
fn frozen_bridge_makes_the_executor_stop_in_a_ramp() {
    let mut scene = Scene::on_its_way();
    signal(scene.bridge.child.id(), "-STOP");
    let took = scene.until(|bytes| bytes[3] == 0);
    println!("the spindle is off after {took:?}");
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
    // After waking up, the bridge reports the alarm, and continues after it is acknowledged.
    signal(scene.bridge.child.id(), "-CONT");
    scene.alarm("output.bridge_silent");
    // The page's control lapsed meanwhile.
    assert!(scene.page.take_control(true));
    scene.works_again();
}

#[test]
fn failure_to_switch_outputs_off_is_reported() {
    let mut scene = Scene::on_its_way();
    let aside = scene.shop.device.with_extension("aside");
    fs::rename(&scene.shop.device, aside).unwrap();
    signal(scene.executor(), "-KILL");
    let status = scene.alarm("output.not_safe");
    assert!(status.spindle_rpm > 0, "it may still turn");
    let said = status.alarm.unwrap().message("en");
    assert!(said.contains("card.bin"), "{said}");
}
