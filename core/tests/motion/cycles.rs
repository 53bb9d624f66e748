//! Tests of homing and jogs: direction, gates and end positions.

use crate::programs::machines;
use annulus_core::job::{Input, Otherwise, Stage};
use annulus_core::machine::{HomeEnd, Steps, Value, apply, virtual_drill};
use annulus_core::motion::{cycles, laws};
use annulus_core::steps;

#[test]
fn homing_seeks_backs_off_locates_and_offsets() {
    for machine in machines() {
        let homing = cycles::home(&machine).unwrap();
        assert_eq!(homing.iter().map(|(axis, _)| *axis).collect::<Vec<_>>(), [2, 0, 1]);
        for (axis, plan) in homing {
            laws::laws(&plan, &machine).unwrap();
            let stages: Vec<_> = plan.moves.iter().map(|planned| planned.stage).collect();
            assert_eq!(stages, [Stage::Seek, Stage::BackOff, Stage::Locate, Stage::Offset]);
            let towards = if machine.axis(axis).home == HomeEnd::Min { -1 } else { 1 };
            for planned in &plan.moves {
                let way = (planned.to[axis] - planned.from[axis]).signum();
                let gated = matches!(planned.stage, Stage::Seek | Stage::Locate);
                assert_eq!(way, if gated { towards } else { -towards }, "{:?}", planned.stage);
                assert_eq!(planned.gate.is_some(), gated);
                if let Some(gate) = planned.gate {
                    assert_eq!((gate.input, gate.otherwise), (machine.home_input(axis), Otherwise::Alarm));
                    assert!(u64::from(gate.deadline_us) * 10 > planned.duration_ticks);
                }
            }
            let stream = steps::stream(&plan, &machine).unwrap();
            assert_eq!(stream.segments.last().unwrap().end, plan.end());
        }
    }
    assert_eq!(machines()[0].home_input(2), Input::ZTop);
}

#[test]
fn homing_with_an_index_pulse_adds_one_index_move() {
    let on = ("x.index".to_owned(), Value::Text("yes".to_owned()));
    let machine = apply(&virtual_drill(), &[on]).unwrap();
    let plan = cycles::home_axis(&machine, 0).unwrap();
    laws::laws(&plan, &machine).unwrap();
    let stages: Vec<_> = plan.moves.iter().map(|planned| planned.stage).collect();
    assert_eq!(stages, [Stage::Seek, Stage::BackOff, Stage::Locate, Stage::Index, Stage::Offset]);
    let index = &plan.moves[3];
    assert_eq!(index.gate.map(|gate| (gate.input, gate.otherwise)), Some((Input::XIndex, Otherwise::Alarm)));
    assert_eq!(index.to[0] - index.from[0], machine.x.scale.steps(machine.x.index_within));
    assert_eq!(cycles::home_axis(&machine, 1).unwrap().moves.len(), 4, "Y has none");
}

#[test]
fn go_to_lifts_first_and_lowers_last() {
    let mut from = Steps::default();
    from[..3].copy_from_slice(&[100, 200, -50]);
    let mut to = Steps::default();
    to[..3].copy_from_slice(&[400, 100, 30]);
    for machine in machines() {
        for (from, to, stages) in
            [(from, to, [Stage::Retract, Stage::Travel]), (to, from, [Stage::Travel, Stage::Approach])]
        {
            let plan = cycles::go_to(&machine, from, to).unwrap();
            assert_eq!(plan.end(), to);
            assert_eq!(plan.moves.iter().map(|planned| planned.stage).collect::<Vec<_>>(), stages);
        }
        let jog = cycles::jog(&machine, from, 1, -7, 1.0).unwrap();
        assert_eq!(jog.end()[..3], [100, 193, -50]);
        assert!(cycles::jog(&machine, from, 9, 1, 1.0).unwrap().moves.is_empty(), "no such axis");
        assert_eq!(cycles::retract(&machine, from, 0).unwrap().end()[..3], [100, 200, 0]);
        assert_eq!(cycles::rejoin(&machine, Stage::Retract, from, to).unwrap().end(), to);
    }
}
