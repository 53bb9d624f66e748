//! Builds a program from moves of the tool's tip.
//!
//! ```text
//!   tip over the board, XY moves      ─▶ Rapid: the cut before it becomes a leg
//!   tip moves down, up                ─▶ Plunge, Retract
//!   XY moves, tip in the board        ─▶ Mill, MillArc
//!   a leg of a drill with only moves down and up ─▶ a hole; any other ─▶ a path
//! ```

use super::titles::{Named, named};
use super::{MOST_DIAGNOSTICS, ReadBack};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::job::{Bit, Command, Cutter, Leg, Mark, Program};
use crate::units::Length;
use crate::{code, error};
use std::collections::{BTreeMap, BTreeSet};

const START: Length = Length::from_um(10_000);
/// Positions beyond this, in mm, can't be on a board.
const FARTHEST_MM: f64 = 2_000.0;
const MOST_COMMANDS: usize = 4_000_000;

/// Position and height of the tip, in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tip {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
}

impl Tip {
    fn at(self) -> Point {
        Point::from_mm(self.x, self.y)
    }
}

pub(super) struct Hand {
    file: String,
    line: u32,
    pub(super) tip: Tip,
    known: BTreeMap<u32, Bit>,
    /// Tools named in the file.
    named: BTreeSet<u32>,
    /// Numbers of the tools in order of use.
    used: Vec<u32>,
    current: Option<u32>,
    commands: Vec<Command>,
    count: usize,
    turns: bool,
    /// Speed of the spindle; `None` if not given.
    rpm: Option<f64>,
    legs: Vec<Leg>,
    cuts: bool,
    side: Option<String>,
    thickness: Option<Length>,
    diagnostics: Vec<Diagnostic>,
    others: Vec<Diagnostic>,
}

impl Hand {
    pub(super) fn new(file: &str, tools: &BTreeMap<u32, Bit>) -> Self {
        Self {
            file: file.to_owned(),
            line: 0,
            tip: Tip { x: 0.0, y: 0.0, z: START.mm() },
            known: tools.clone(),
            named: BTreeSet::new(),
            used: Vec::new(),
            current: None,
            commands: Vec::new(),
            count: 0,
            turns: false,
            rpm: None,
            legs: Vec::new(),
            cuts: false,
            side: None,
            thickness: None,
            diagnostics: Vec::new(),
            others: Vec::new(),
        }
    }

    /// Starts another line; refused beyond the limit of commands.
    pub(super) fn at_line(&mut self, line: u32) -> Result<(), Diagnostic> {
        self.line = line;
        self.few_enough()
    }

    fn few_enough(&self) -> Result<(), Diagnostic> {
        if self.count <= MOST_COMMANDS {
            return Ok(());
        }
        Err(error!("readback.too_many", most = MOST_COMMANDS).at(&self.file, self.line, 0))
    }

    fn push(&mut self, command: Command) {
        self.count += 1;
        self.commands.push(command);
    }

    pub(super) fn refuse(&self, code: &str, found: impl ToString) -> Diagnostic {
        Diagnostic::error(code).with("found", found).at(&self.file, self.line, 0)
    }

    /// A refusal, at the line being read.
    pub(super) fn placed(&self, why: Diagnostic) -> Diagnostic {
        why.at(&self.file, self.line, 0)
    }

    /// Another controller would refuse the current line.
    pub(super) fn other_refuses(&mut self, why: Diagnostic) {
        let why = self.placed(why);
        self.others.push(why);
    }

    pub(super) fn warning(&mut self, code: &str, found: impl ToString) {
        if self.diagnostics.len() < MOST_DIAGNOSTICS
            && !self.diagnostics.iter().any(|known| known.code == code)
        {
            self.diagnostics
                .push(Diagnostic::warning(code).with("found", found).at(&self.file, self.line, 0));
        }
    }

    pub(super) fn comment(&mut self, text: &str) {
        if let Some(Named { number, bit, goes_in }) = named(text) {
            if let Some(bit) = bit {
                // The user's tools take precedence over the file.
                self.known.entry(number).or_insert(bit);
                self.named.insert(number);
            }
            if goes_in {
                self.take(number);
            }
        }
        if let Some(side) = text.trim().to_ascii_lowercase().strip_prefix("side:") {
            let side = side.trim();
            self.side = Some(side.to_owned()).filter(|side| matches!(side.as_str(), "top" | "bottom"));
        }
        self.thickness = self.thickness.or_else(|| thickness(text));
    }

    pub(super) fn take(&mut self, number: u32) {
        if self.current == Some(number) {
            return;
        }
        self.flush();
        self.current = Some(number);
        let index = self.used.iter().position(|known| *known == number).unwrap_or_else(|| {
            self.used.push(number);
            self.used.len() - 1
        }) as u32;
        self.count += 1;
        let commands = vec![Command::AwaitBit { bit: index }];
        self.legs.push(Leg { mark: Mark::ToolChange(index), commands });
    }

    /// Sets the spindle speed; 0 is off.
    pub(super) fn spindle(&mut self, rpm: f64) {
        self.push(Command::Spindle { rpm: rpm.clamp(0.0, 1e6) as u32 });
    }

    /// Switches the spindle on, at the last or next speed, or off.
    pub(super) fn turn(&mut self, on: bool) {
        self.turns = on;
        // On without a known speed still counts as on.
        let rpm = self.rpm.map_or(1.0, |rpm| if rpm > 0.0 { rpm.max(1.0) } else { 0.0 });
        self.spindle(if on { rpm } else { 0.0 });
    }

    /// Sets the speed of the spindle, now or for the next start.
    pub(super) fn speed(&mut self, rpm: f64) {
        self.rpm = Some(rpm);
        if self.turns {
            self.turn(true);
        }
    }

    pub(super) fn know(&mut self, number: u32, bit: Bit) {
        self.known.entry(number).or_insert(bit);
    }

    fn checked(&self, to: Tip) -> Result<(), Diagnostic> {
        self.few_enough()?;
        if [to.x, to.y, to.z].iter().all(|mm| mm.abs() <= FARTHEST_MM) {
            Ok(())
        } else {
            Err(self.refuse(code!("readback.out_of_reach"), format!("X {} Y {} Z {}", to.x, to.y, to.z)))
        }
    }

    pub(super) fn line_to(&mut self, to: Tip, fast: bool) -> Result<(), Diagnostic> {
        self.checked(to)?;
        let from = std::mem::replace(&mut self.tip, to);
        let height = Length::from_mm(to.z);
        let in_board = from.z < 0.0 || to.z < 0.0;
        if in_board {
            self.begin();
            if fast && (to.z < from.z || (to.x, to.y) != (from.x, from.y)) {
                self.warning(code!("readback.fast_in_board"), format!("X {} Y {} Z {}", to.x, to.y, to.z));
            }
        }
        if (to.x, to.y) == (from.x, from.y) {
            match (to.z < from.z, to.z > from.z) {
                (true, _) => {
                    self.cuts |= to.z < 0.0;
                    self.push(Command::Plunge { to: height, feed_um_per_s: 1, gate: None });
                }
                (_, true) => self.push(Command::Retract { to: height }),
                _ => {}
            }
        } else if in_board {
            self.cuts = true;
            self.push(Command::Mill { to: to.at(), height, feed_um_per_s: 1 });
        } else {
            self.flush();
            self.push(Command::Rapid { to: to.at() });
            if to.z != from.z {
                self.push(Command::Retract { to: height });
            }
        }
        Ok(())
    }

    /// Moves along an arc or a helix; equal ends are a full turn.
    pub(super) fn arc_to(&mut self, to: Tip, (x, y): (f64, f64), ccw: bool) -> Result<(), Diagnostic> {
        self.checked(to)?;
        self.checked(Tip { x, y, z: 0.0 })?;
        let from = self.tip;
        let radius = |tip: Tip| libm::hypot(tip.x - x, tip.y - y);
        if libm::fabs(radius(from) - radius(to)) > 0.02 + 0.002 * radius(from) {
            return Err(self.refuse(code!("readback.no_arc"), format!("X {} Y {}", to.x, to.y)));
        }
        if from.z >= 0.0 && to.z >= 0.0 {
            return self.line_to(to, true);
        }
        self.begin();
        self.tip = to;
        self.cuts = true;
        let (to, height) = (to.at(), Length::from_mm(to.z));
        self.push(Command::MillArc { to, height, center: Point::from_mm(x, y), ccw, feed_um_per_s: 1 });
        Ok(())
    }

    pub(super) fn arc_through(&mut self, middle: Tip, to: Tip) -> Result<(), Diagnostic> {
        let from = self.tip;
        let (ax, ay, bx, by) = (middle.x - from.x, middle.y - from.y, to.x - from.x, to.y - from.y);
        let turn = ax * by - ay * bx;
        if libm::fabs(turn) < 1e-9 {
            self.line_to(middle, false)?;
            return self.line_to(to, false);
        }
        let (a, b) = (ax * ax + ay * ay, bx * bx + by * by);
        let centre = (from.x + (by * a - ay * b) / (2.0 * turn), from.y + (ax * b - bx * a) / (2.0 * turn));
        self.arc_to(to, centre, turn > 0.0)
    }

    /// A cut starts. Without a requested tool it uses the only tool that the file names, or the only known
    /// one.
    fn begin(&mut self) {
        if self.current.is_some() {
            return;
        }
        let only = |mut numbers: Vec<u32>| numbers.pop().filter(|_| numbers.is_empty());
        let named = only(self.named.iter().copied().collect());
        if let Some(number) = named.or_else(|| only(self.known.keys().copied().collect())) {
            let commands = std::mem::take(&mut self.commands);
            self.take(number);
            self.commands = commands;
        }
    }

    /// Starts a separate hole, perhaps at the position of the last one.
    pub(super) fn another(&mut self) {
        self.flush();
    }

    /// Ends a leg with the commands since the last move over the board.
    fn flush(&mut self) {
        let mut commands = std::mem::take(&mut self.commands);
        if commands.is_empty() {
            return;
        }
        commands.shrink_to_fit();
        // Which of these are holes is known with the tools.
        let mark = if std::mem::take(&mut self.cuts) { Mark::Toolpath(0) } else { Mark::Prepare };
        self.legs.push(Leg { mark, commands });
    }

    /// The program. Refused if an unknown tool is used.
    pub(super) fn finish(mut self, of_files: bool) -> Result<ReadBack, Diagnostic> {
        self.flush();
        let mut bits = Vec::new();
        for number in &self.used {
            let Some(bit) = self.known.get(number) else {
                let why = error!("readback.no_tool", number = number);
                return Err(why.at(&self.file, 0, 0));
            };
            bits.push(bit.clone());
        }
        let cuts = self.legs.iter().any(|leg| matches!(leg.mark, Mark::Toolpath(_)));
        number(&mut self.legs, &bits);
        if bits.is_empty() && cuts {
            let why = error!("readback.no_tool", number = 1);
            return Err(why.at(&self.file, 0, 0));
        }
        let name = self.file.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
        let program = Program {
            name,
            machine: String::new(),
            origin: Point::default(),
            bits,
            spindles: 1,
            safe_height: START,
            legs: self.legs,
            accepted: Vec::new(),
        };
        let (side, thickness) = (self.side, self.thickness);
        // A header with the board's thickness is from Annulus: the file is for the intended controller.
        let others = if thickness.is_some() { Vec::new() } else { self.others };
        Ok(ReadBack { program, side, thickness, of_files, diagnostics: self.diagnostics, others })
    }
}

/// The board's thickness from a header: `board: 1.6 mm thick`.
fn thickness(text: &str) -> Option<Length> {
    let lower = text.trim().to_ascii_lowercase();
    let mm: f64 = lower.strip_prefix("board:")?.trim().strip_suffix("mm thick")?.trim().parse().ok()?;
    (0.1..=20.0).contains(&mm).then(|| Length::from_mm(mm))
}

/// Numbers the cuts: drill cycles of drills are holes. Everything else is a toolpath, even if a mill or a
/// V-bit only moves down and up.
fn number(legs: &mut [Leg], bits: &[Bit]) {
    let (mut holes, mut toolpaths, mut drills) = (0, 0, false);
    for leg in legs {
        match leg.mark {
            Mark::ToolChange(bit) => {
                drills = bits.get(bit as usize).is_some_and(|bit| bit.cutter == Cutter::Drill);
            }
            Mark::Toolpath(_) if drills && is_stroke(&leg.commands) => {
                leg.mark = Mark::Hole(holes);
                holes += 1;
            }
            Mark::Toolpath(_) => {
                leg.mark = Mark::Toolpath(toolpaths);
                toolpaths += 1;
            }
            _ => {}
        }
    }
}

/// True if commands only move down and up at one position.
fn is_stroke(commands: &[Command]) -> bool {
    !commands.iter().any(|command| matches!(command, Command::Mill { .. } | Command::MillArc { .. }))
}
