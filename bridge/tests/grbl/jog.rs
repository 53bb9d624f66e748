//! Tests of jogs on the real firmware, which are sent in pieces. Measures whether they are smooth, and how
//! far they continue after the cable is pulled. Read from the step pins.

use super::edge::Desk;
use super::firmware::{Board, STEPS, instrument, settings};
use super::judge::edge;
use annulus_core::grbl::{EngineAsk, EnginePhase};

const START: [f64; 3] = [-40.0, -40.0, -20.0];
const MM_PER_MIN: f64 = 1_000.0;
const MM_PER_S: f64 = MM_PER_MIN / 60.0;
const WAY_MM: f64 = 60.0;
/// Most travel in the controller: 0.2 s, one piece, and the time of a report and its handling; in seconds
/// of travel.
const MOST_S: f64 = 0.6;

fn jog() -> EngineAsk {
    EngineAsk::Jog { axis: 0, um: (-WAY_MM * 1e3) as i32, mm_per_min: MM_PER_MIN, anyway: false }
}

fn board(acceleration: f64, options: &[&str]) -> Option<Board> {
    let mut settings = settings(false);
    settings.retain(|(number, _)| !(120..=122).contains(number));
    settings.extend([120, 121, 122].map(|number| (number, acceleration)));
    Some(Board::new(instrument()?, &settings, START, options))
}

fn gone_mm(desk: &Desk, from_mm: f64) -> f64 {
    desk.now.as_ref().and_then(|now| now.place_mm).map_or(0.0, |place| from_mm - place[0])
}

fn times(board: &Board) -> Vec<f64> {
    let text = std::fs::read_to_string(board.edges()).unwrap();
    text.lines().filter_map(edge).filter(|(axis, ..)| *axis == 0).map(|(_, _, cycle)| cycle / 16e6).collect()
}

/// Jogs once. Returns the number of slow positions, of all positions, and of lines sent.
fn slow_places(acceleration: f64) -> Option<(u32, u32, usize)> {
    let mut board = board(acceleration, &[])?;
    let mut desk = Desk::at(&board);
    desk.until("a place", |desk| desk.now.as_ref().is_some_and(|now| now.place_mm.is_some()));
    desk.ask(jog());
    desk.until("rest", |desk| desk.phase() == Some(EnginePhase::Ready));
    let lines = desk.sent.iter().filter(|line| line.starts_with("$J=")).count();
    board.end();
    let times = times(&board);
    assert_eq!(times.len(), (WAY_MM * STEPS) as usize);
    // The speed over every tenth of a millimetre, without acceleration and braking.
    let brake_mm = MM_PER_S * MM_PER_S / (2.0 * acceleration);
    let (span, skip) = ((STEPS / 10.0) as usize, ((brake_mm + 0.2) * STEPS) as usize);
    let speeds = (skip..times.len() - skip - span).map(|at| 0.1 / (times[at + span] - times[at]));
    let (slow, all) =
        speeds.fold((0, 0), |(slow, all), speed| (slow + u32::from(speed < 0.97 * MM_PER_S), all + 1));
    println!("{acceleration} mm/s²: {lines} lines, {slow} of {all} places slower than they should be");
    Some((slow, all, lines))
}

#[test]
fn jog_of_several_lines_is_smooth() {
    if instrument().is_none() {
        return;
    }
    for acceleration in [500.0, 100.0, 10.0] {
        // A busy computer sends lines late, which only slows a move down: one of several moves must be
        // smooth.
        let is_even = |(slow, all, lines): (u32, u32, usize)| slow * 5 <= all && lines > 10;
        let even = (0..8).any(|_| slow_places(acceleration).is_some_and(is_even));
        assert!(even, "{acceleration} mm/s²");
    }
}

#[test]
fn jog_cancel_button_stops_a_jog() {
    let Some(board) = board(500.0, &[]) else { return };
    let mut desk = Desk::at(&board);
    desk.until("a place", |desk| desk.now.as_ref().is_some_and(|now| now.place_mm.is_some()));
    let from_mm = desk.now.as_ref().and_then(|now| now.place_mm).unwrap()[0];
    desk.ask(jog());
    let mut pressed_mm = Vec::new();
    // The button acts like a jog cancel: no effect if the controller happens to be stopped because this
    // computer was late with a line. Then press it again.
    for at_mm in [10.0, 20.0, 30.0, 40.0] {
        let rests = |desk: &Desk| desk.phase() == Some(EnginePhase::Ready);
        let is_over = |desk: &Desk| !pressed_mm.is_empty() && rests(desk);
        desk.until("some way", |desk| is_over(desk) || gone_mm(desk, from_mm) > at_mm);
        if is_over(&desk) {
            break;
        }
        pressed_mm.push(gone_mm(&desk, from_mm));
        desk.presses(0x85);
    }
    desk.until("rest", |desk| desk.phase() == Some(EnginePhase::Ready));
    let rests_mm = -(board.rests()[0] as f64) / STEPS;
    println!("pressed after {pressed_mm:?} mm it rests at {rests_mm} mm");
    assert!(rests_mm < WAY_MM - 5.0, "{rests_mm} mm");
}

/// GRBL 1.1h stops reading lines, and reports Idle, if a jog cancel arrives just as the jog ends.
#[test]
fn controller_listens_after_cancels_at_the_end_of_a_jog() {
    let Some(board) = board(500.0, &[]) else { return };
    let mut desk = Desk::at(&board);
    for round in 0..40 {
        desk.ask(EngineAsk::Jog { axis: 0, um: -1_000, mm_per_min: MM_PER_MIN, anyway: false });
        desk.until("a move", |desk| desk.phase() == Some(EnginePhase::Jogging));
        let sent = desk.sent.len();
        desk.until("a line", |desk| desk.sent.len() > sent);
        std::thread::sleep(std::time::Duration::from_millis(20 + round % 10));
        for _ in 0..60 {
            desk.presses(b'?');
            desk.presses(0x85);
            std::thread::sleep(std::time::Duration::from_micros(500));
        }
        desk.ask(EngineAsk::JogCancel);
        desk.until("rest", |desk| desk.phase() == Some(EnginePhase::Ready));
        let deaf = desk.found.iter().filter(|code| *code == "grbl.answer_missing").count();
        assert_eq!(deaf, 0, "round {round}");
    }
}

#[test]
fn unplugged_cable_stops_a_jog() {
    for acceleration in [500.0, 10.0] {
        let Some(mut board) = board(acceleration, &["--no-dtr-reset"]) else { return };
        let mut desk = Desk::at(&board);
        desk.until("a place", |desk| desk.now.as_ref().is_some_and(|now| now.place_mm.is_some()));
        let from_mm = desk.now.as_ref().and_then(|now| now.place_mm).unwrap()[0];
        desk.ask(jog());
        desk.until("some way", |desk| gone_mm(desk, from_mm) > 30.0);
        board.plug(false);
        let sent = desk.sent.iter().filter_map(|line| line.strip_prefix("$J=G91G21X-")?.split_once('F'));
        let sent_mm: f64 = sent.filter_map(|(mm, _)| mm.parse::<f64>().ok()).sum();
        let rests_mm = -(board.rests()[0] as f64) / STEPS;
        board.end();
        let brake_mm = MM_PER_S * MM_PER_S / (2.0 * acceleration);
        println!(
            "{acceleration} mm/s²: at {} mm by its last report, rests at {rests_mm} mm",
            gone_mm(&desk, from_mm)
        );
        assert!(rests_mm <= sent_mm + 0.01 && rests_mm < WAY_MM - 1.0, "{rests_mm} of {sent_mm} mm");
        let went_on_mm = rests_mm - gone_mm(&desk, from_mm);
        assert!(went_on_mm <= MOST_S * MM_PER_S + brake_mm, "{acceleration} mm/s²: {went_on_mm} mm");
    }
}
