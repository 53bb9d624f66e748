//! A board of scattered islands, and a program that isolates it.

use annulus_core::board::{Board, Copper, Face};
use annulus_core::chance::Chance;
use annulus_core::geometry::{Path, PathSegment, Point, Region, circle, grow, stroke, union};
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::units::Length;

/// Distance between cells, mm.
const PITCH_MM: f64 = 3.0;

/// Islands of two pads and a bent track each, one per cell; `count` is rounded up to a square number.
pub fn islands(count: usize) -> Board {
    let side = (1..).find(|side| side * side >= count).unwrap_or(1);
    cells(side, side)
}

/// Like [`islands`], with this number of columns and rows.
pub fn cells(columns: usize, rows: usize) -> Board {
    let mut chance = Chance::new(1);
    let mut outlines = Vec::new();
    for cell in 0..columns * rows {
        let (left, bottom) = ((cell % columns) as f64 * PITCH_MM, (cell / columns) as f64 * PITCH_MM);
        let mut place = |low: f64, high: f64| {
            Point::from_mm(left + chance.between(low, high), bottom + chance.between(0.9, PITCH_MM - 0.9))
        };
        let (one, bend, other) = (place(0.8, 1.1), place(1.2, 1.8), place(1.9, 2.2));
        outlines.extend([one, other].map(|pad| circle(pad, Length::from_mm(1.1))));
        if let Some(track) = Path::through(&[one, bend, other]) {
            outlines.extend(stroke(&track, Length::from_mm(0.3)));
        }
    }
    let copper = Copper { face: Face::Top, region: union(&outlines), ..Copper::default() };
    Board { copper: vec![copper], ..Board::default() }
}

/// Two passes around every island, 0.2 mm wide.
pub fn isolated(board: &Board) -> Program {
    let nothing = Region::default();
    let copper = board.copper.first().map_or(&nothing, |copper| &copper.region);
    let cutter = Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 60_000 };
    let bit =
        Bit { diameter: Length::from_mm(3.0), name: "V".to_owned(), cutter, handling: Default::default() };
    let depth = bit.depth_for(Length::from_um(200)).unwrap_or_default();
    let mut legs = vec![Leg { mark: Mark::ToolChange(0), commands: vec![Command::AwaitBit { bit: 0 }] }];
    for away_um in [101, 241] {
        for (way, path) in (0..).zip(grow(copper, Length::from_um(away_um)).paths()) {
            legs.push(Leg { mark: Mark::Toolpath(way), commands: along(path, -depth) });
        }
    }
    Program {
        name: "islands".to_owned(),
        machine: String::new(),
        origin: Point::default(),
        bits: vec![bit],
        spindles: 1,
        safe_height: Length::from_mm(2.0),
        legs,
        accepted: Vec::new(),
    }
}

fn along(path: &Path, height: Length) -> Vec<Command> {
    let feed_um_per_s = 5_000;
    let down = Command::Plunge { to: height, feed_um_per_s, gate: None };
    let mill = |segment: &PathSegment| match *segment {
        PathSegment::Line { to } => Command::Mill { to, height, feed_um_per_s },
        PathSegment::Arc { to, centre, clockwise } => {
            Command::MillArc { to, height, center: centre, ccw: !clockwise, feed_um_per_s }
        }
    };
    let mut commands = vec![Command::Rapid { to: path.start }, down];
    commands.extend(path.segments.iter().map(mill));
    commands.push(Command::Retract { to: Length::from_mm(2.0) });
    commands
}
