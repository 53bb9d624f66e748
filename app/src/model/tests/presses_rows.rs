//! The guard of presses: which presses count.
//!
//! ```text
//! jog@10        the pad's button is shown 10 px down     jog@10-off  shown, but can't be pressed
//! none          no control is shown                      +999        milliseconds pass
//! press:jog@10  a pointer presses that button            tap         a pointer presses there, no control
//! key:jog@10    a key presses it                         right       an armed key moves the machine
//! ```

use super::compare;
use crate::model::presses::{MovingControl, PressEvent};
use crate::model::{Clocks, Effect, Event, FrameEvent, HandEvent, LinkEvent, Model, update};

struct Told {
    model: Model,
    ms: f64,
    verdicts: Vec<&'static str>,
}

/// The control named `word`: its action, its distance from the top, and `-off` if it can't be pressed.
/// `home2` is another element with the same action.
fn control(word: &str) -> MovingControl {
    let (name, place) = word.split_once('@').expect("act@place");
    let (place, usable) = place.strip_suffix("-off").map_or((place, true), |place| (place, false));
    let top: i32 = place.parse().expect("px");
    let act = name.trim_end_matches(char::is_numeric);
    let id = name.bytes().map(u32::from).sum();
    MovingControl { id, act: act.to_owned(), edges_px: [5, top, 53, top + 44], usable }
}

fn told(words: &str) -> Told {
    let mut told = Told { model: Model::default(), ms: 0.0, verdicts: Vec::new() };
    for word in words.split_whitespace() {
        let clock = Clocks { page_ms: told.ms, wall_ms: told.ms };
        update(&mut told.model, Event::Clock { clock });
        let at_px = Some([20.0, 20.0]);
        let event = match word.split_once(':') {
            Some(("press", word)) => PressEvent::Pressed { control: Some(control(word)), at_px },
            Some(("key", word)) => PressEvent::Pressed { control: Some(control(word)), at_px: None },
            Some(("click", word)) => PressEvent::Clicked { control: control(word) },
            _ if word == "tap" => PressEvent::Pressed { control: None, at_px },
            _ if word == "tap-away" => PressEvent::Pressed { control: None, at_px: Some([300.0, 20.0]) },
            _ if word == "none" => PressEvent::Shown { controls: Vec::new() },
            _ if word.starts_with('+') => {
                told.ms += word[1..].parse::<f64>().expect("ms");
                continue;
            }
            _ => PressEvent::Shown { controls: word.split('&').map(control).collect() },
        };
        let judged = !matches!(event, PressEvent::Shown { .. });
        update(&mut told.model, event.into());
        if judged && !word.starts_with("tap") {
            told.verdicts.push(if told.model.presses.refused { "nothing" } else { "acts" });
        }
    }
    told
}

#[test]
fn press_counts_one_second_after_its_control_moved() {
    compare(
        &[
            // The control appears.
            ("jog@10 +999 press:jog@10", "nothing"),
            ("jog@10 +1000 press:jog@10", "acts"),
            ("press:jog@10", "nothing"),
            ("none +5000 press:jog@10", "nothing"),
            // The control moves, noticed before the press or by the press.
            ("jog@10 +5000 jog@40 +900 press:jog@40", "nothing"),
            ("jog@10 +5000 jog@40 +1000 press:jog@40", "acts"),
            ("jog@10 +5000 press:jog@40", "nothing"),
            // Slow movement counts, a pixel of rounding does not.
            ("jog@10 +5000 jog@12 +100 jog@14 +100 press:jog@14", "nothing"),
            ("jog@10 +5000 jog@11 +100 press:jog@12", "acts"),
            // The control disappears and reappears, as under a dialog.
            ("jog@10 +5000 none +5000 jog@10 +500 press:jog@10", "nothing"),
            // The control has just been enabled.
            ("jog@10-off +5000 jog@10 +500 press:jog@10", "nothing"),
            ("jog@10-off +5000 press:jog@10", "nothing"),
            // Another control at the same position, or the same one with another action.
            ("home@10 +5000 home2@10 +500 press:home2@10", "nothing"),
            ("home@10 +5000 jog@10 +500 press:jog@10", "nothing"),
            // Other controls may change.
            ("jog@10&home@90 +5000 jog@10&home@120 +10 press:jog@10", "acts"),
            // Keys and screen readers are guarded too.
            ("start@10 +300 key:start@10", "nothing"),
            ("start@10 +1000 key:start@10", "acts"),
            // The control moves between press and click.
            ("start@10 +2000 press:start@10 +50 click:start@10", "acts acts"),
            ("start@10 +2000 press:start@10 +50 click:start@40", "acts nothing"),
            ("start@10 +10 press:start@10 +50 click:start@10", "nothing nothing"),
        ],
        told,
        |told| told.verdicts.join(" "),
    );
}

#[test]
fn double_click_does_not_press_a_second_control() {
    compare(
        &[
            ("jog@10 +5000 tap +300 press:jog@10", "nothing"),
            ("jog@10 +5000 tap +1000 press:jog@10", "acts"),
            ("jog@10 +5000 tap-away +300 press:jog@10", "acts"),
            (
                "jog@10 +5000 tap +300 press:jog@10 +300 press:jog@10 +500 press:jog@10",
                "nothing nothing acts",
            ),
            // Repeated presses of the same button count.
            ("jog@10 +5000 press:jog@10 +200 press:jog@10 +200 press:jog@10", "acts acts acts"),
            ("home@10&jog@20 +5000 press:home@10 +200 press:jog@20", "acts nothing"),
        ],
        told,
        |told| told.verdicts.join(" "),
    );
}

#[test]
fn armed_keys_do_not_jog_while_the_pad_is_fresh() {
    let waits = |words: &str| {
        let mut model = told(words).model;
        update(&mut model, Event::Link(LinkEvent::Hand(HandEvent::Arm { on: Some(true) })));
        let key = HandEvent::KeyDown { way: Some((0, true)), ten: false, repeat: false };
        model.link.phase = crate::model::link::LinkPhase::Open;
        model.link.control.yours = true;
        model.link.status =
            Some(std::sync::Arc::new(super::line::status(annulus_core::control::State::Ready, None)));
        let effects = update(&mut model, Event::Link(LinkEvent::Hand(key)));
        let long = |effect: &Effect| matches!(effect, Effect::Wake { after_ms: 300, .. });
        effects.iter().any(long)
    };
    assert!(!waits("jog@10 +300 jog@10"));
    assert!(waits("jog@10 +1000 jog@10"));
    assert!(waits(""), "a pad that nobody showed the guard");
}

#[test]
fn press_that_acts_removes_the_notification() {
    compare(
        &[
            ("jog@10 press:jog@10", "1"),
            ("jog@10 press:jog@10 +500 press:jog@10", "1"),
            ("jog@10 press:jog@10 +1000 tap", "1"),
            ("jog@10 press:jog@10 +1000 press:jog@10", "0"),
            ("jog@10 press:jog@10 +1000 key:jog@10", "0"),
            ("jog@10 press:jog@10 +1000 press:jog@10 +50 click:jog@40", "1"),
        ],
        told,
        |told| told.model.frame.toasts.len().to_string(),
    );
}

#[test]
fn ignored_press_shows_a_notification() {
    let mut told = told("jog@10 press:jog@10");
    let number = told.model.frame.toasts.first().expect("a short word").number;
    update(&mut told.model, FrameEvent::Said { number }.into());
    assert!(told.model.frame.toasts.is_empty());
}
