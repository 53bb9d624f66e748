//! Default speeds follow the machine; values that the user set stay.

use super::*;
use crate::cam::parameters::{self, OF_MACHINE};
use crate::cam::suits;
use crate::machine::{Machine, Value, apply, hobby_3018, lab, preset, preset_words};

fn program_on(work: &Work, machine: &Machine) -> Program {
    let options = PlanOptions { iterations: Some(0), ..PlanOptions::default() };
    let rapid_time = |a: Point, b: Point| a.distance_mm(b);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let (planned, _) = plan_work(&coupon(), work, machine, &means, &mut |_| true).unwrap();
    lower_work(&planned, work, machine)
}

/// The fastest plunge of a program, in µm/s, and its highest spindle speed.
fn fastest(program: &Program) -> (u32, u32) {
    let commands = program.legs.iter().flat_map(|leg| &leg.commands);
    commands.fold((0, 0), |(down, most), command| match command {
        Command::Plunge { feed_um_per_s, .. } => (down.max(*feed_um_per_s), most),
        Command::Spindle { rpm } => (down, most.max(*rpm)),
        _ => (down, most),
    })
}

#[test]
fn job_opened_on_one_machine_gets_the_speeds_of_another() {
    for opened in ["virtual", "lab", "3018", "breakout"] {
        let work = Work::default_for(&coupon(), &preset(opened).unwrap());
        for (chosen, machine) in preset_words().map(|word| (word, preset(word).unwrap())) {
            let own = Work::default_for(&coupon(), &machine);
            assert_eq!(program_on(&work, &machine), program_on(&own, &machine), "{opened} {chosen}");
        }
    }
    let work = Work::default_for(&coupon(), &virtual_drill());
    assert_eq!(fastest(&program_on(&work, &virtual_drill())), (12_000, 30_000));
    assert_eq!(fastest(&program_on(&work, &hobby_3018())), (2_000, 10_000));
}

#[test]
fn explicit_speed_stays_on_every_machine() {
    for (key, value) in [("operation.feed", 4.0), ("operation.plunge", 1.0), ("operation.speed", 8_000.0)] {
        let row = parameters::find(parameters::OPERATION, key).unwrap();
        let mut work = Work::default_for(&coupon(), &virtual_drill());
        for operation in &mut work.operations {
            row.set(operation, &Value::Number(value)).unwrap();
        }
        for machine in [virtual_drill(), hobby_3018(), lab()] {
            for operation in &work.operations {
                assert_eq!(row.value_on(operation, &machine), Some(Value::Number(value)), "{key}");
                assert!(!row.is_of_machine(operation));
            }
        }
        parameters::assign(&mut work, key, OF_MACHINE).unwrap();
        assert_eq!(work.operations, Work::default_for(&coupon(), &lab()).operations, "{key}");
    }
}

#[test]
fn spindle_speed_is_limited_by_the_machine() {
    for most in [1_000.0, 9_000.0, 10_000.0, 24_000.0] {
        let change = ("spindle.max_speed".to_owned(), Value::Number(most));
        let machine = apply(&hobby_3018(), &[change]).unwrap();
        let work = Work::drilling(&coupon(), &machine, crate::cam::HoleOrder::File);
        let (_, rpm) = fastest(&program_on(&work, &machine));
        assert_eq!(f64::from(rpm), most.min(10_000.0));
    }
}

#[test]
fn program_for_a_faster_machine_is_reported() {
    let work = Work::default_for(&coupon(), &virtual_drill());
    let codes = |program: &Program, machine: &Machine| -> Vec<String> {
        suits::judged(program, machine).into_iter().map(|found| found.code).collect()
    };
    for machine in [virtual_drill(), hobby_3018(), lab()] {
        assert_eq!(codes(&program_on(&work, &machine), &machine), Vec::<String>::new());
    }
    let fast = program_on(&work, &virtual_drill());
    let found = codes(&fast, &hobby_3018());
    assert!(found.iter().any(|code| code == "job.plunge_fast"), "{found:?}");
    assert!(found.iter().any(|code| code == "job.spindle_fast"), "{found:?}");
}
