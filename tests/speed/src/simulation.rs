//! Simulation of a million segments: milling a whole board in short straight lines.

use crate::machine;
use annulus_core::chance::Chance;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::motion;
use annulus_core::post::{self, Manner};
use annulus_core::sim::{Carving, Playback, ProgramLines, Stock, nearest};
use annulus_core::units::Length;
use std::sync::Arc;

/// Size of the board, mm.
const BOARD_MM: [f64; 2] = [100.0, 80.0];
/// Segments per row, and per toolpath.
const ROW_PIECES: usize = 2_000;
const TOOLPATH_PIECES: usize = 10_000;
/// Cells carved per frame of the page.
const FRAME_CELLS: u64 = 1_200_000;

/// A job to simulate.
pub struct Simulation {
    program: Program,
    playback: Arc<Playback>,
    carving: Carving,
}

/// A path of `segments` straight lines, in rows over the board.
pub fn program(segments: usize) -> Program {
    let rows = segments.div_ceil(ROW_PIECES).max(1);
    let per_row = segments.div_ceil(rows).max(1);
    let height = Length::from_um(-60);
    let place = |segment: usize| {
        let (row, along) = (segment / per_row, (segment % per_row) as f64 / per_row as f64);
        let share = if row % 2 == 0 { along } else { 1.0 - along };
        let aside_mm = if segment.is_multiple_of(2) { 0.02 } else { -0.02 };
        let up_mm = (row as f64 + 0.5) / rows as f64 * (BOARD_MM[1] - 1.0);
        Point::from_mm(share * BOARD_MM[0], up_mm + aside_mm)
    };
    let legs = (0..segments).step_by(TOOLPATH_PIECES).zip(0..).map(|(first, number)| {
        let down = Command::Plunge { to: height, feed_um_per_s: 5_000, gate: None };
        let last = (first + TOOLPATH_PIECES).min(segments);
        let mill = |segment| Command::Mill { to: place(segment + 1), height, feed_um_per_s: 20_000 };
        let mut commands = vec![Command::Rapid { to: place(first) }, down];
        commands.extend((first..last).map(mill));
        commands.push(Command::Retract { to: Length::from_um(2_000) });
        Leg { mark: Mark::Toolpath(number), commands }
    });
    let change = Leg { mark: Mark::ToolChange(0), commands: vec![Command::AwaitBit { bit: 0 }] };
    let bit = Bit {
        diameter: Length::from_um(100),
        name: String::new(),
        cutter: Cutter::Mill,
        handling: Default::default(),
    };
    Program {
        name: "segments".to_owned(),
        machine: String::new(),
        origin: Point::default(),
        bits: vec![bit],
        spindles: 1,
        safe_height: Length::from_um(2_000),
        legs: std::iter::once(change).chain(legs).collect(),
        accepted: Vec::new(),
    }
}

impl Simulation {
    /// With this number of segments, played once.
    pub fn new(segments: usize) -> Self {
        let program = program(segments);
        let timeline = motion::timeline(&program, &machine()).expect("the machine is sound");
        let playback = Arc::new(Playback::new(timeline));
        let bounds = Bounds::of(Point::default()).with(Point::from_mm(BOARD_MM[0], BOARD_MM[1]));
        let stock = Stock::new(bounds, Length::from_um(1_600)).expect("a board");
        let mut carving = Carving::new(playback.clone(), program.bits.clone(), stock);
        carving.seek(playback.total_s(), u64::MAX);
        Self { program, playback, carving }
    }

    /// Carves the whole board; returns the number of cut cells.
    pub fn carved(&self) -> u64 {
        let mut carving = self.carving.clone();
        carving.seek(0.0, u64::MAX);
        let uncut = carving.stock().clone();
        let mut carving = Carving::new(self.playback.clone(), self.program.bits.clone(), uncut);
        carving.seek(self.playback.total_s(), u64::MAX);
        let tiles = carving.stock().tiles().filter_map(|tile| tile.depths_um);
        tiles.map(|depths| depths.iter().filter(|depth| **depth > 0).count() as u64).sum()
    }

    /// Jumps to a hundred random times; returns the total number of frames needed.
    pub fn jumps(&self) -> u64 {
        let (mut chance, mut carving, mut frames) = (Chance::new(3), self.carving.clone(), 0);
        for _ in 0..100 {
            let t_s = chance.between(0.0, self.playback.total_s());
            frames += 1;
            while !carving.seek(t_s, FRAME_CELLS) {
                frames += 1;
            }
        }
        frames
    }

    /// A hundred frames of a playback, ten seconds of the job each; returns the number of cells in changed
    /// tiles.
    pub fn frames(&self) -> u64 {
        let mut carving = self.carving.clone();
        let mut looked = 0;
        for frame in 0..100 {
            let before = carving.stock().clone();
            carving.seek(f64::from(frame) * 10.0, FRAME_CELLS);
            looked += carving.stock().changed(&before).count() as u64;
        }
        looked
    }

    /// Queries a playback as a frame does, ten thousand times.
    pub fn moments(&self) -> u64 {
        let mut chance = Chance::new(5);
        let seconds = (0..10_000).map(|_| chance.between(0.0, self.playback.total_s()));
        let asked = seconds.filter_map(|t_s| Some((self.playback.at(t_s)?, self.playback.command_at(t_s)?)));
        asked.map(|(now, place)| u64::from(now.leg) + u64::from(place.command)).sum()
    }

    /// A press in the picture; returns the time that it leads to, ms.
    pub fn pressed(&self) -> u64 {
        let timeline = self.playback.timeline();
        let found = nearest(&timeline.moves, &timeline.mm_per_step, [40.0, 40.0]);
        found.map_or(0, |(at_s, _)| (at_s * 1e3) as u64)
    }

    /// The lines of the program with their times; returns their number.
    pub fn lines(&self) -> u64 {
        let files =
            post::write("grbl", &self.program, &Manner::default()).and_then(Result::ok).unwrap_or_default();
        let lines = ProgramLines::new(files.into_iter().flat_map(|file| file.commands).collect());
        let every = (0..lines.len()).step_by(100);
        every.map(|line| u64::from(lines.start_s(line, &self.playback) >= 0.0)).sum::<u64>() * 100
    }
}
