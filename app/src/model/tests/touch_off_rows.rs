//! Touch-off: the request for each target, and when a step is finished.

use crate::model::{Event, Model, TouchOffEvent, TouchTarget, TouchedPart, update};
use annulus_core::control::State;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::Ask;
use std::sync::Arc;

/// A model with this target; [`stands`] sets the state of its machine.
fn model(x: i8, y: i8) -> Model {
    let mut model = Model::default();
    tell(&mut model, TouchOffEvent::Target { target: TouchTarget { x, y } });
    model
}

fn tell(model: &mut Model, event: TouchOffEvent) {
    update(model, event.into());
}

fn stands(model: &mut Model, state: State) {
    model.link.status = Some(Arc::new(super::line::status(state, None)));
    update(model, Event::Begun);
}

#[test]
fn touch_target_is_a_corner_an_edge_or_the_height() {
    let edge = |axis, up| TouchedPart::Edge { axis, up };
    let rows = [
        ((0, 0), vec![TouchedPart::Height]),
        ((-1, 0), vec![edge(0, true)]),
        ((1, 0), vec![edge(0, false)]),
        ((0, -1), vec![edge(1, true)]),
        ((1, 1), vec![edge(0, false), edge(1, false)]),
        ((-1, -1), vec![edge(0, true), edge(1, true)]),
    ];
    for ((x, y), parts) in rows {
        assert_eq!(TouchTarget { x, y }.parts(), parts, "{x} {y}");
    }
}

#[test]
fn typed_touch_off_lengths_are_used_and_invalid_ones_refused() {
    let mut edge = model(-1, 0);
    for (text, tool_um) in
        [("3,175", Some(3_175)), ("1", Some(1_000)), ("x", None), ("-1", None), ("80", None)]
    {
        tell(&mut edge, TouchOffEvent::Tool { text: text.to_owned() });
        let wanted = tool_um.map(|tool_um| Ask::Edge { axis: 0, up: true, reach_um: 10_000, tool_um });
        assert_eq!(edge.touch_off.wish(false), wanted, "{text}");
    }
    let mut height = model(0, 0);
    tell(&mut height, TouchOffEvent::Plate { text: "15.5".to_owned() });
    for (plans, depth_um) in [(false, 45_000), (true, 10_000)] {
        let wanted = Ask::Probe { depth_um, plate_um: 15_500 };
        assert_eq!(height.touch_off.wish(plans), Some(wanted));
    }
}

#[test]
fn touch_off_step_completes_after_motion_without_refusal() {
    let mut corner = model(-1, -1);
    stands(&mut corner, State::Ready);
    tell(&mut corner, TouchOffEvent::Touch);
    stands(&mut corner, State::Ready);
    assert_eq!(corner.touch_off.done, 0, "it has not moved yet");
    stands(&mut corner, State::Running);
    stands(&mut corner, State::Stopping);
    stands(&mut corner, State::Ready);
    assert_eq!(
        (corner.touch_off.done, corner.touch_off.next()),
        (1, Some(TouchedPart::Edge { axis: 1, up: true }))
    );
    // After an alarm or a refusal the step is not finished.
    for refused in [false, true] {
        tell(&mut corner, TouchOffEvent::Touch);
        stands(&mut corner, State::Running);
        if refused {
            corner.link.refused = Some(Diagnostic::error("touch.no_edge"));
        } else {
            stands(&mut corner, State::Alarm);
        }
        stands(&mut corner, State::Ready);
        assert_eq!(corner.touch_off.done, 1, "{refused}");
    }
    corner.link.refused = None;
    tell(&mut corner, TouchOffEvent::Touch);
    stands(&mut corner, State::Running);
    stands(&mut corner, State::Ready);
    assert_eq!(corner.touch_off.next(), None);
    tell(&mut corner, TouchOffEvent::Target { target: TouchTarget { x: 1, y: 0 } });
    assert_eq!(corner.touch_off.done, 0, "another place begins anew");
}
