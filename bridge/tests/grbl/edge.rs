//! Tests that edges and height of the board are found on the real firmware, with the engine that bridge and
//! page share.

use super::firmware::{Board, SPEED, STEPS, instrument, settings};
use annulus_core::control::Trust;
use annulus_core::grbl::{BoardHeight, EngineAsk, EngineEvent, EnginePhase};
use annulus_host::grbl::{Attended, AttendedJob, ControllerGlimpse, Due, Told};
use std::io::{Read, Write};
use std::time::{Duration, Instant};

const START: [f64; 3] = [-100.0, -100.0, -60.0];
const TOLERANCE_MM: f64 = 0.013;

pub(super) struct Desk {
    port: Box<dyn serialport::SerialPort>,
    attended: Attended,
    began: Instant,
    pub(super) now: Option<ControllerGlimpse>,
    pub(super) found: Vec<String>,
    zeros: u32,
    pub(super) sent: Vec<String>,
}

impl Desk {
    pub(super) fn at(board: &Board) -> Self {
        let port = serialport::new(board.port(), 115_200).timeout(Duration::from_millis(10)).open().unwrap();
        let (attended, began) = (Attended::new(AttendedJob::default()), Instant::now());
        let mut desk =
            Self { port, attended, began, now: None, found: Vec::new(), zeros: 0, sent: Vec::new() };
        desk.event(EngineEvent::Opened);
        desk.until("somebody there", |desk| {
            matches!(desk.phase(), Some(EnginePhase::Ready | EnginePhase::Locked))
        });
        desk
    }

    pub(super) fn phase(&self) -> Option<EnginePhase> {
        self.now.as_ref().map(|now| now.phase)
    }

    fn event(&mut self, event: EngineEvent) {
        let now_ms = (self.began.elapsed().as_secs_f64() * 1e3 * SPEED) as u64;
        for due in self.attended.event(now_ms, event) {
            match due {
                Due::Write(bytes) => {
                    self.port.write_all(&bytes).unwrap();
                    self.sent.push(String::from_utf8_lossy(&bytes).into_owned());
                }
                Due::Tell(Told::Now(now)) => self.now = Some(*now),
                Due::Tell(Told::Found(found)) => self.found.push(found.code),
                Due::Tell(Told::ZeroSet) => self.zeros += 1,
                Due::Tell(_) | Due::Keep(_) | Due::Close => {}
            }
        }
    }

    /// Sends a real-time character, like a button at the controller.
    pub(super) fn presses(&mut self, sign: u8) {
        self.port.write_all(&[sign]).unwrap();
    }

    pub(super) fn ask(&mut self, ask: EngineAsk) {
        self.event(EngineEvent::Ask(ask));
    }

    pub(super) fn until(&mut self, what: &str, so: impl Fn(&Self) -> bool) {
        let since = Instant::now();
        while !so(self) {
            assert!(since.elapsed() < Duration::from_secs(60), "{what}: {:?} {:?}", self.now, self.found);
            let mut bytes = [0; 256];
            match self.port.read(&mut bytes) {
                Ok(count) if count > 0 => self.event(EngineEvent::Bytes(bytes[..count].to_vec())),
                _ => self.event(EngineEvent::Tick),
            }
        }
    }

    fn edge(&mut self, axis: u8, reach_mm: f64) -> [f64; 3] {
        let zeros = self.zeros;
        self.ask(EngineAsk::Edge { axis, reach_mm, mm_per_min: 60.0, radius_mm: 0.5, back_mm: 1.0 });
        self.until("an edge", |desk| {
            desk.zeros > zeros && desk.phase() == Some(EnginePhase::Ready)
                || desk.phase() == Some(EnginePhase::Locked)
        });
        self.until("its place", |desk| desk.now.as_ref().is_some_and(|now| now.zero_mm.is_some()));
        self.now.as_ref().and_then(|now| now.zero_mm).unwrap()
    }
}

/// A board with a steep edge at `at`, mm along `axis` in carriage coordinates: 20 mm per mm.
fn walled(axis: usize, at: f64, rises_up: bool) -> String {
    let slope = if rises_up { 20.0 } else { -20.0 };
    let mut plane = [START[2] - slope * at, 0.0, 0.0];
    plane[1 + axis] = slope;
    plane.map(|value: f64| value.to_string()).join(",")
}

#[test]
fn edge_probe_sets_zero_with_the_tool_radius_on_both_sides() {
    let Some(instrument) = instrument() else { return };
    // Axis, position, and direction of approach.
    for (axis, at, up) in [(0, -95.0, true), (1, -106.0, false)] {
        let mut board =
            Board::new(instrument, &settings(false), START, &["--probe-z", &walled(axis, at, up)]);
        let mut desk = Desk::at(&board);
        desk.ask(EngineAsk::SetZero { axes: [true; 3], height_mm: 0.0 });
        desk.until("a zero", |desk| desk.zeros == 1);
        let before = desk.now.as_ref().and_then(|now| now.zero_mm).unwrap_or_default();
        let zero = desk.edge(axis as u8, if up { 10.0 } else { -10.0 });
        let (way, side) = (at - START[axis], if up { 1.0 } else { -1.0 });
        let wanted = way + side * 0.5;
        assert!((zero[axis] - wanted).abs() < TOLERANCE_MM, "{axis}: {} not {wanted}", zero[axis]);
        assert!((zero[1 - axis] - before[1 - axis]).abs() < 1e-9, "the other axis stays");
        assert_eq!(desk.now.as_ref().unwrap().trust, Trust::Trusted);
        // One millimetre off the edge, less the stopping distance after the touch.
        let rests = board.rests()[axis] as f64 / STEPS;
        assert!((rests - (way - side)).abs() < 0.1, "{rests}");
        board.end();
    }
}

#[test]
fn missed_edge_leaves_the_zero_unchanged() {
    let Some(instrument) = instrument() else { return };
    let mut board = Board::new(instrument, &settings(false), START, &["--probe-z", &walled(0, -95.0, true)]);
    let mut desk = Desk::at(&board);
    desk.ask(EngineAsk::SetZero { axes: [true; 3], height_mm: 0.0 });
    desk.until("a zero", |desk| desk.zeros == 1);
    desk.ask(EngineAsk::Edge { axis: 0, reach_mm: 3.0, mm_per_min: 60.0, radius_mm: 0.5, back_mm: 1.0 });
    desk.until("what became of it", |desk| desk.found.iter().any(|code| code == "grbl.alarm_5"));
    assert_eq!(desk.zeros, 1);
    board.end();
}

#[test]
fn probe_sets_the_height_with_the_plate_thickness() {
    let Some(instrument) = instrument() else { return };
    // The plate is 2 mm below the tool and 1.5 mm thick; with hard and soft braking.
    for acceleration in [500.0, 10.0] {
        let settings = [settings(false), vec![(122, acceleration)]].concat();
        let mut board = Board::new(instrument, &settings, START, &["--probe-z", "-62,0,0"]);
        let mut desk = Desk::at(&board);
        desk.ask(EngineAsk::SetZero { axes: [true; 3], height_mm: 0.0 });
        desk.until("a zero", |desk| desk.zeros == 1);
        desk.until("rest", |desk| desk.phase() == Some(EnginePhase::Ready));
        desk.ask(EngineAsk::Probe { depth_mm: 10.0, mm_per_min: 60.0, plate_mm: 1.5, up_mm: 2.0 });
        desk.until("the plate", |desk| {
            (desk.zeros == 2 || !desk.found.is_empty()) && desk.phase() == Some(EnginePhase::Ready)
        });
        desk.until("its place", |desk| desk.now.as_ref().is_some_and(|now| now.zero_mm.is_some()));
        assert_eq!((desk.zeros, &desk.found), (2, &Vec::new()), "{acceleration} mm/s²");
        let now = desk.now.as_ref().unwrap();
        let zero = now.zero_mm.unwrap();
        assert!((zero[2] + 2.0 + 1.5).abs() < TOLERANCE_MM, "{acceleration} mm/s²: {zero:?}");
        assert_eq!(
            (now.trust, desk.attended.controller().height()),
            (Trust::Trusted, BoardHeight::OfThisBit)
        );
        board.end();
    }
}
