//! Tests of connected pages: who has control, who may stop, and invalid frames.

use super::client::{Page, Running};
use annulus_core::control::State;
use annulus_core::machine::Value;
use annulus_core::wire::{Ask, Control, FRAME_LIMIT, Tell, auth};
use tungstenite::Message;

fn is_in(tell: &Tell, states: &[State]) -> bool {
    matches!(tell, Tell::Status(status) if states.contains(&status.state))
}

#[test]
fn new_page_receives_control_and_machine() {
    let bridge = Running::start();
    let mut page = bridge.page();
    page.until(|tell| matches!(tell, Tell::Control(Control { yours: false, taken: false, viewers: 1 })));
    page.until(|tell| matches!(tell, Tell::Machine { settings, .. } if !settings.is_empty()));
    page.ask(&Ask::Ping { stamp: 12.5 });
    page.until(|tell| *tell == Tell::Pong { stamp: 12.5 });
}

#[test]
fn one_page_has_control_and_others_are_refused() {
    let bridge = Running::start();
    let (mut one, mut two) = (bridge.page(), bridge.page());
    assert!(one.take_control(false));
    two.until(|tell| matches!(tell, Tell::Control(Control { yours: false, taken: true, viewers: 2 })));
    assert!(!two.take_control(false));
    for ask in [
        Ask::Home,
        Ask::SetZero,
        Ask::Resume,
        Ask::Jog { axis: 0, distance_um: 100, anyway: false },
        Ask::AcknowledgeAlarm,
    ] {
        two.ask(&ask);
        assert_eq!(two.refusal(), "control.needed", "{ask:?}");
    }
    assert!(two.take_control(true));
    one.until(|tell| matches!(tell, Tell::Control(Control { yours: false, taken: true, .. })));
    one.ask(&Ask::Home);
    assert_eq!(one.refusal(), "control.needed");
    two.ask(&Ask::ReleaseControl);
    one.until(|tell| matches!(tell, Tell::Control(Control { taken: false, .. })));
    assert!(one.take_control(false));
}

#[test]
fn control_lapses_when_its_page_leaves_or_is_silent() {
    let bridge = Running::start();
    let mut viewer = bridge.page();
    let mut gone = bridge.page();
    assert!(gone.take_control(false));
    viewer.until(|tell| matches!(tell, Tell::Control(Control { taken: true, .. })));
    drop(gone);
    viewer.until(|tell| matches!(tell, Tell::Control(Control { taken: false, viewers: 1, .. })));
    let mut silent = bridge.page();
    assert!(silent.take_control(false));
    viewer.until(|tell| matches!(tell, Tell::Control(Control { taken: true, .. })));
    viewer.until(|tell| matches!(tell, Tell::Control(Control { taken: false, viewers: 2, .. })));
}

fn stops_what_moves(one: &mut Page, two: &mut Page) {
    assert!(one.take_control(false));
    one.ask(&Ask::Home);
    two.until(|tell| is_in(tell, &[State::Homing]));
    two.ask(&Ask::Stop);
    two.until(|tell| !is_in(tell, &[State::Homing, State::Stopping]) && matches!(tell, Tell::Status(_)));
}

#[test]
fn page_without_control_stops_the_machine() {
    let bridge = Running::start();
    let (mut one, mut two) = (bridge.page(), bridge.page());
    stops_what_moves(&mut one, &mut two);
}

#[test]
fn link_scope_limits_requests_but_never_stop() {
    let bridge = Running::start();
    let job = || "0".repeat(64);
    let rows = [
        ("view", Ask::TakeControl { force: true }),
        ("view", Ask::Home),
        ("jog", Ask::Arm { job: job(), from_leg: 0 }),
        ("jog", Ask::Resume),
        ("run", Ask::Configure { changes: vec![] }),
    ];
    for (scope, ask) in rows {
        let mut page = bridge.page_that_may(scope);
        page.ask(&ask);
        assert_eq!(page.refusal(), "control.scope", "{scope} {ask:?}");
    }
    let (mut one, mut two) = (bridge.page_that_may("jog"), bridge.page_that_may("view"));
    stops_what_moves(&mut one, &mut two);
}

#[test]
fn pages_cannot_change_the_output_hardware() {
    let bridge = Running::start();
    let mut page = bridge.page();
    assert!(page.take_control(false));
    for (key, value) in
        [("machine.output", Value::Text("card".into())), ("machine.card_address", Value::Number(672.0))]
    {
        page.ask(&Ask::Configure { changes: vec![(key.to_owned(), value)] });
        assert_eq!(page.refusal(), "control.in_file_only", "{key}");
    }
}

#[test]
fn malformed_frames_are_refused_without_motion() {
    let bridge = Running::start();
    let mut page = bridge.page();
    assert!(page.take_control(false));
    let rows = [
        ("", "socket.malformed"),
        ("{\"t\":\"home\"", "socket.malformed"),
        ("{\"t\":\"open_port\",\"address\":672}", "socket.unknown"),
        ("{\"t\":\"jog\",\"axis\":0,\"distance_um\":\"far\"}", "socket.unknown"),
        ("[{\"t\":\"home\"}]", "socket.unknown"),
    ];
    for (frame, code) in rows {
        page.say(frame);
        assert_eq!(page.refusal(), code, "{frame}");
    }
    page.until(|tell| is_in(tell, &[State::NotHomed]));
}

#[test]
fn oversized_or_too_frequent_frames_close_the_socket() {
    let bridge = Running::start();
    let long = |length: usize| format!("{{\"t\":\"ping\",\"stamp\":1{}}}", " ".repeat(length));
    let mut page = bridge.page();
    page.say(&long(FRAME_LIMIT));
    assert_eq!(page.last_words(), ["socket.too_large"]);

    let mut page = bridge.page();
    page.say(&long(8 * FRAME_LIMIT));
    assert_eq!(page.last_words(), [""; 0], "far too large: closed without reading it");

    let mut page = bridge.page();
    let _ = page.socket.send(Message::binary(vec![0; 10]));
    assert_eq!(page.last_words(), ["socket.not_text"]);

    let mut page = bridge.page();
    for _ in 0..2_000 {
        page.ask(&Ask::Ping { stamp: 0.0 });
    }
    assert_eq!(page.last_words(), ["socket.too_fast"]);
    bridge.page();
}

#[test]
fn page_that_does_not_read_delays_no_other_page() {
    let bridge = Running::start();
    let deaf = bridge.page();
    let mut other = bridge.page();
    for stamp in 0..60 {
        other.ask(&Ask::Ping { stamp: f64::from(stamp) });
        other.until(|tell| *tell == Tell::Pong { stamp: f64::from(stamp) });
        other.until(|tell| matches!(tell, Tell::Status(_)));
    }
    drop(deaf);
}

#[test]
fn page_65_is_refused_until_a_seat_is_free() {
    let bridge = Running::start();
    let pages: Vec<Page> = (0..64).map(|_| bridge.page_that_may("view")).collect();
    let (session, key) = bridge.pair("view");
    let mut late = Page { session: session.clone(), key: key.clone(), socket: bridge.upgrade(&[]).unwrap() };
    let nonce = late.nonce();
    late.hello(&session, &auth::hello(&key, &nonce));
    assert_eq!(late.last_words(), ["door.full"], "everybody has one seat, and there are no more");
    drop(pages);
    // A seat is free as soon as the bridge notices that a page left.
    let again = (0..100).find_map(|_| {
        std::thread::sleep(std::time::Duration::from_millis(100));
        let mut page =
            Page { session: session.clone(), key: key.clone(), socket: bridge.upgrade(&[]).unwrap() };
        let nonce = page.nonce();
        page.hello(&session, &auth::hello(&key, &nonce));
        matches!(page.next(), Some(Tell::Welcome { .. })).then_some(())
    });
    assert!(again.is_some());
}
