//! Tests of parking on the real firmware: up first, then aside, to the set position. Read from the step
//! pins.

use super::edge::Desk;
use super::firmware::{Board, TRAVEL, instrument, settings};
use super::judge::edge;
use annulus_core::control::Trust;
use annulus_core::grbl::{EngineAsk, EnginePhase};

const START: [f64; 3] = [-40.0, -40.0, -20.0];

#[test]
fn parking_raises_z_before_xy_and_stops_at_the_position() {
    let Some(instrument) = instrument() else { return };
    // Homing ends one millimetre from the switches, at the high ends.
    for (from_low_mm, [x, y]) in [(None, [-1.0, -1.0]), (Some([30.0, 20.0]), [30.0 - TRAVEL, 20.0 - TRAVEL])]
    {
        let mut board = Board::new(instrument, &settings(true), START, &[]);
        let mut desk = Desk::at(&board);
        desk.ask(EngineAsk::Home);
        let rests = |desk: &Desk| {
            let now = desk.now.as_ref();
            desk.phase() == Some(EnginePhase::Ready) && now.is_some_and(|now| now.place_mm.is_some())
        };
        let is_homed = |desk: &Desk| desk.now.as_ref().is_some_and(|now| now.trust == Trust::Trusted);
        desk.until("homing", |desk| rests(desk) && is_homed(desk));
        for (axis, um) in [(0, -25_000), (2, -15_000)] {
            desk.ask(EngineAsk::Jog { axis, um, mm_per_min: 1_000.0, anyway: false });
            desk.until("a move by hand", rests);
        }
        let before = board.rests();
        let edges_before = board.snapshot()["edges_total"].as_u64().unwrap();
        desk.ask(EngineAsk::Park { from_low_mm });
        desk.until("it is parked", rests);
        let parked = board.steps_at([x, y, -1.0]);
        assert_eq!(board.rests(), parked, "{from_low_mm:?}");
        assert!(is_homed(&desk));
        board.end();
        let text = std::fs::read_to_string(board.edges()).unwrap();
        let mut z = before[2];
        for (axis, at, _) in text.lines().filter_map(edge).skip(edges_before as usize) {
            if axis == 2 {
                z = at;
            } else {
                assert_eq!(z, parked[2], "X or Y moved with Z at {z}");
            }
        }
    }
}
