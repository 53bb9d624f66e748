//! Converts planned toolpaths to a program: requests each tool; each hole and each toolpath becomes a leg.
//!
//! ```text
//!   plunge   ●          ramp  ●──╮             helix  ●──╮  one lap for every pass, then one lap
//!            │                   ╰──●──────           ●──╯  at the bottom
//!            ●─────── path        (the ramp again at the bottom)
//! ```
//!
//! The order of legs is the order of parts, tasks, drill cycles and toolpaths. Picture, simulation and output
//! all use this program. Between passes, a closed toolpath stays down and an open one is cut back and forth.

use super::super::suits;
use super::super::usual::Speeds;
use super::super::work::Work;
use super::cut::{self, Piece};
use super::{BitTask, DrillCycle, EntryMove, Planned, Toolpath};
use crate::board::Face;
use crate::geometry::{Path, PathSegment, Point};
use crate::job::{Bit, Command, Gate, Input, Leg, Mark, Otherwise, Program};
use crate::machine::{Machine, RackTool, StrokeEnd};
use crate::units::Length;

/// A duration in whole µs, never negative.
fn micros(us: f64) -> u32 {
    libm::round(us) as u32
}

pub fn lower_work(planned: &Planned, work: &Work, machine: &Machine) -> Program {
    let mut writer = Writer {
        machine,
        origin: planned.origin,
        bits: Vec::new(),
        legs: vec![Leg { mark: Mark::Prepare, commands: vec![Command::Spindle { rpm: 0 }] }],
        rpm: 0,
        toolpaths: 0,
    };
    // Holes that are not in the board, such as mouse-bites, get the numbers after the board's.
    let mut strays = planned.board.holes.len() as u32;
    for part in &planned.parts {
        let Some(operation) = work.operations.get(part.operation as usize) else { continue };
        for task in &part.tasks {
            let speeds = &suits::with_bit(operation, &task.bit, machine);
            writer.take(&task.bit, speeds);
            for stroke in &task.drill_cycles {
                let hole = stroke.hole.unwrap_or_else(|| {
                    strays += 1;
                    strays - 1
                });
                let commands = writer.stroke(stroke, task, speeds);
                writer.push(Mark::Hole(hole), commands, speeds);
            }
            for way in &task.toolpaths {
                let commands = writer.way(way, speeds);
                let mark = Mark::Toolpath(writer.toolpaths);
                writer.push(mark, commands, speeds);
                writer.toolpaths += 1;
            }
        }
    }
    let home = vec![Command::Spindle { rpm: 0 }, Command::Rapid { to: Point::default() }];
    writer.legs.push(Leg { mark: Mark::Finish, commands: home });
    Program {
        name: called(&planned.board.name, work.setup.face),
        machine: machine.fingerprint(),
        origin: planned.origin,
        bits: writer.bits,
        spindles: planned.spindles,
        safe_height: machine.process.safe_height,
        legs: writer.legs,
        accepted: planned.accepted.clone(),
    }
}

/// Name of a side's program: from the board's name, if any.
fn called(board: &str, face: Face) -> String {
    let side = face.name();
    if board.is_empty() { side.to_owned() } else { format!("{board}-{side}") }
}

struct Writer<'a> {
    machine: &'a Machine,
    origin: Point,
    bits: Vec<Bit>,
    legs: Vec<Leg>,
    /// Current speed of the spindle; 0 while it is off.
    rpm: u32,
    toolpaths: u32,
}

impl Writer<'_> {
    /// Requests `bit`, with the handling in the machine's tools, unless it is in the spindle.
    fn take(&mut self, bit: &Bit, speeds: &Speeds) {
        let known = self.machine.rack.iter().find(|tool| tool.is(bit));
        let bit = Bit { handling: known.map(RackTool::handling).unwrap_or_default(), ..bit.clone() };
        if self.bits.last() == Some(&bit) {
            return;
        }
        let index = self.bits.len() as u32;
        self.bits.push(bit);
        let mut commands = vec![
            Command::Spindle { rpm: 0 },
            Command::Rapid { to: Point::default() },
            Command::AwaitBit { bit: index },
        ];
        self.rpm = 0;
        commands.extend(self.turning(speeds));
        self.legs.push(Leg { mark: Mark::ToolChange(index), commands });
    }

    fn turning(&mut self, speeds: &Speeds) -> Vec<Command> {
        let rpm = speeds.spindle_rpm;
        if self.rpm == rpm {
            return Vec::new();
        }
        self.rpm = rpm;
        let mut commands = vec![Command::Spindle { rpm }];
        if self.machine.process.spin_up_ms > 0.0 {
            commands.push(Command::Dwell { us: micros(self.machine.process.spin_up_ms * 1e3) });
        }
        commands
    }

    fn push(&mut self, mark: Mark, commands: Vec<Command>, speeds: &Speeds) {
        let mut all = self.turning(speeds);
        all.extend(commands);
        all.shrink_to_fit();
        self.legs.push(Leg { mark, commands: all });
    }

    fn at(&self, at: Point) -> Point {
        Point::new(at.x - self.origin.x, at.y - self.origin.y)
    }

    /// One hole: down, perhaps in pecks, and up.
    fn stroke(&self, stroke: &DrillCycle, task: &BitTask, speeds: &Speeds) -> Vec<Command> {
        let process = &self.machine.process;
        let counted = self.machine.stroke_end == StrokeEnd::Counted;
        let gate = (!counted).then(|| Gate {
            input: Input::ZBottom,
            deadline_us: micros(self.machine.longest_drilling_s * 1e6),
            otherwise: Otherwise::Alarm,
        });
        let feed_um_per_s = speed(speeds.plunge_mm_per_s);
        let mut commands = vec![Command::Rapid { to: self.at(stroke.at) }];
        let pecks = match task.peck.nm() {
            peck if peck > 0 && counted => ((task.depth.nm() + peck - 1) / peck).clamp(1, 100),
            _ => 1,
        };
        for peck in 1..=pecks {
            let to = -Length::from_nm(task.depth.nm() * peck / pecks);
            commands.push(Command::Plunge { to, feed_um_per_s, gate });
            if peck < pecks {
                commands.push(Command::Retract { to: process.feed_height });
            }
        }
        if process.dwell_bottom_ms > 0.0 {
            commands.push(Command::Dwell { us: micros(process.dwell_bottom_ms * 1e3) });
        }
        commands.push(Command::Retract { to: process.safe_height });
        commands
    }

    fn way(&self, way: &Toolpath, speeds: &Speeds) -> Vec<Command> {
        let mut pen = Pen {
            writer: self,
            way,
            feed: speed(speeds.feed_mm_per_s),
            plunge: speed(speeds.plunge_mm_per_s),
            height: Length::ZERO,
            moving_s: 0.0,
            commands: vec![Command::Rapid { to: self.at(way.path.start) }],
        };
        pen.mill();
        pen.commands.push(Command::Retract { to: self.machine.process.safe_height });
        pen.commands
    }
}

/// A path longer than this, in s, is split by a short stop, because a single move has a longest duration.
const LONGEST_PATH_S: f64 = 240.0;

/// A speed in whole µm/s, at least 1.
fn speed(mm_per_s: f64) -> u32 {
    micros(mm_per_s * 1e3).max(1)
}

struct Pen<'a> {
    writer: &'a Writer<'a>,
    way: &'a Toolpath,
    feed: u32,
    plunge: u32,
    height: Length,
    moving_s: f64,
    commands: Vec<Command>,
}

impl Pen<'_> {
    fn mill(&mut self) {
        let path = &self.way.path;
        let whole = path.length_mm();
        if path.segments.is_empty() || whole <= 0.0 {
            let deepest = self.way.depths.last().copied().unwrap_or_default();
            self.down(deepest);
            return;
        }
        match self.way.entry {
            EntryMove::Ramp(slope) if path.is_closed() => self.ramped(slope, whole),
            EntryMove::Helix if path.is_closed() => self.ramped(0.0, whole),
            _ => self.plunged(whole),
        }
    }

    fn down(&mut self, depth: Length) {
        self.height = -depth;
        self.moving_s = 0.0;
        self.commands.push(Command::Plunge { to: -depth, feed_um_per_s: self.plunge, gate: None });
    }

    /// Pass by pass; an open path back and forth.
    fn plunged(&mut self, whole: f64) {
        let way = self.way;
        let back = way.path.reversed();
        let closed = way.path.is_closed();
        let turned: Vec<(f64, f64)> =
            way.tabs.iter().rev().map(|tab| (whole - tab.1, whole - tab.0)).collect();
        for (pass, &depth) in way.depths.iter().enumerate() {
            let (path, tabs) =
                if pass % 2 == 1 && !closed { (&back, &turned) } else { (&way.path, &way.tabs) };
            let first = tabs.first().is_some_and(|tab| tab.0 <= 0.0);
            // The plunge must not cut a tab at the start.
            self.down(if first { depth.min(way.tab_depth) } else { depth });
            self.stretch(path, tabs, (0.0, whole), (depth, depth));
        }
    }

    /// Down along the path: by `slope` for every mm, or with 0 one lap for every pass; a ramp ends with a
    /// final lap.
    fn ramped(&mut self, slope: f64, whole: f64) {
        let way = self.way;
        let mut before = Length::ZERO;
        let mut ramp = whole;
        self.down(Length::ZERO);
        for &depth in &way.depths {
            let needed = if slope > 0.0 { (depth - before).mm() / slope } else { whole };
            ramp = needed.min(whole);
            self.stretch(&way.path, &way.tabs, (0.0, ramp), (before, depth));
            if ramp < whole {
                self.stretch(&way.path, &way.tabs, (ramp, whole), (depth, depth));
            }
            before = depth;
        }
        self.stretch(&way.path, &way.tabs, (0.0, ramp), (before, before));
    }

    /// From one length along `path` to another with linear depth; over tabs no deeper than allowed.
    fn stretch(&mut self, path: &Path, tabs: &[(f64, f64)], span: (f64, f64), depths: (Length, Length)) {
        let mut cuts = vec![span.0, span.1];
        cuts.extend(tabs.iter().flat_map(|tab| [tab.0, tab.1]));
        let depth_at = |length: f64| {
            let share = (length - span.0) / (span.1 - span.0).max(1e-9);
            depths.0 + Length::from_mm((depths.1 - depths.0).mm() * share.clamp(0.0, 1.0))
        };
        for piece in cut::cut_at(path, &cuts) {
            let middle = (piece.begin_mm + piece.end_mm) / 2.0;
            if middle < span.0 || middle > span.1 {
                continue;
            }
            let over_tab = tabs.iter().any(|tab| tab.0 < middle && middle < tab.1);
            let most = if over_tab { self.way.tab_depth } else { Length::LIMIT };
            self.piece(&piece, -depth_at(piece.begin_mm).min(most), -depth_at(piece.end_mm).min(most));
        }
    }

    fn piece(&mut self, piece: &Piece, begin: Length, end: Length) {
        let takes_s = (piece.end_mm - piece.begin_mm) * 1e3 / f64::from(self.feed);
        if self.moving_s > 0.0 && self.moving_s + takes_s > LONGEST_PATH_S {
            self.commands.push(Command::Dwell { us: 0 });
            self.moving_s = 0.0;
        }
        self.moving_s += takes_s;
        // A rounding difference is no step.
        if (begin - self.height).abs() > Length::from_nm(10) {
            let feed_um_per_s = if begin < self.height { self.plunge } else { self.feed };
            self.commands.push(Command::Mill {
                to: self.writer.at(piece.from),
                height: begin,
                feed_um_per_s,
            });
        }
        self.height = end;
        let (height, feed_um_per_s) = (end, self.feed);
        self.commands.push(match piece.segment {
            PathSegment::Line { to } => Command::Mill { to: self.writer.at(to), height, feed_um_per_s },
            PathSegment::Arc { to, centre, clockwise } => Command::MillArc {
                to: self.writer.at(to),
                height,
                center: self.writer.at(centre),
                ccw: !clockwise,
                feed_um_per_s,
            },
        });
    }
}
