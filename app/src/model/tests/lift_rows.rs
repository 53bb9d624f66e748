//! *Lift first*, and the button that is held to jog X and Y although the tool may be in the board.

use super::line::Line;
use crate::model::{Effect, Event, HandEvent, LinkEvent, update};
use annulus_core::wire::{Status, Tell};

/// A machine that is ready and reports this distance for *Lift first*.
fn low(lift_first_mm: Option<f64>) -> Line {
    let mut line = Line::told("ready");
    tell(&mut line, lift_first_mm);
    line
}

fn tell(line: &mut Line, lift_first_mm: Option<f64>) {
    let before = line.model.link.status.as_deref().expect("a status").clone();
    let tell = Some(Box::new(Tell::Status(Box::new(Status { lift_first_mm, ..before }))));
    update(&mut line.model, LinkEvent::Heard { tell }.into());
}

fn hand(line: &mut Line, event: HandEvent) -> Vec<Effect> {
    update(&mut line.model, event.into())
}

fn asked(effects: &[Effect]) -> Vec<String> {
    let text = |effect: &Effect| match effect {
        Effect::Send { text } => Some(text.clone()),
        _ => None,
    };
    effects.iter().filter_map(text).collect()
}

#[test]
fn lift_first_raises_z_by_the_reported_height() {
    let mut line = low(Some(3.08));
    let sent = asked(&hand(&mut line, HandEvent::LiftFirst));
    assert!(sent[0].contains(r#""axis":2,"distance_um":3080"#), "{sent:?}");
    assert!(asked(&hand(&mut low(None), HandEvent::LiftFirst)).is_empty());
}

#[test]
fn long_press_allows_xy_jog_until_the_tool_is_lifted() {
    let x = HandEvent::Clicked { way: (0, true) };
    let mut line = low(Some(3.0));
    assert!(asked(&hand(&mut line, x))[0].contains(r#""anyway":false"#), "the machine refuses it");
    // Released too early.
    let wake = hand(&mut line, HandEvent::InsistDown);
    hand(&mut line, HandEvent::InsistUp);
    let [Effect::Wake { after_ms: 1_500, event }] = wake.as_slice() else { panic!("{wake:?}") };
    let (number, after) = match &**event {
        Event::Link(LinkEvent::Hand(HandEvent::Insisted { number })) => (*number, true),
        _ => (0, false),
    };
    assert!(after, "{event:?}");
    hand(&mut line, HandEvent::Insisted { number });
    assert!(!line.model.link.hand.anyway);
    // Held long enough.
    hand(&mut line, HandEvent::InsistDown);
    hand(&mut line, HandEvent::Insisted { number: number + 2 });
    assert!(line.model.link.hand.anyway);
    assert!(asked(&hand(&mut line, x))[0].contains(r#""anyway":true"#));
    let z = HandEvent::Clicked { way: (2, true) };
    assert!(asked(&hand(&mut line, z))[0].contains(r#""anyway":false"#));
    tell(&mut line, None);
    tell(&mut line, Some(2.0));
    assert!(!line.model.link.hand.anyway, "the next time it is asked for again");
}
