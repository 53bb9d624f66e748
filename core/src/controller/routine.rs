//! A program as the engine runs it: sections, each begun over its place with the tip clear of the board, so that a job can be taken up
//! at any of them.
//!
//! ```text
//!  section  ── approach ──┬── look: is it where it should be? ──┬── work ──▶ next section
//!   hole 17   rapid X Y   │                                     │  down, feed, up
//!   change    M5 up, park │                                     │  (a person)
//! ```
//!
//! Comes in: moves as `gcode` reads them. Goes out: a [`Routine`], in work coordinates. Lengths in whole nanometres, feeds in mm/min.
//! Does not know what a line on the wire looks like.

use crate::units::Length;
use serde::{Deserialize, Serialize};

/// A place of the tip: X, Y, Z in work coordinates.
pub type TipPlace = [Length; 3];

/// How a move goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Course {
    /// As fast as the axes can.
    Rapid,
    /// Straight, at feed.
    Line,
    /// Along an arc about this centre in the plane; a full circle where it ends where it begins.
    Arc {
        /// Its centre.
        centre: [Length; 2],
        /// Counter-clockwise.
        ccw: bool,
    },
}

/// One move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoutineMove {
    /// How.
    pub course: Course,
    /// Where it ends.
    pub to: TipPlace,
    /// Feed, mm/min; of no meaning for rapids.
    pub feed_mm_per_min: f64,
    /// Line of the file that it comes from, from 1.
    pub line: u32,
}

/// The spindle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Spindle {
    /// Off.
    #[default]
    Off,
    /// Clockwise, at this speed.
    On(f64),
    /// Counter-clockwise.
    Back(f64),
}

/// One thing to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RoutineAction {
    /// Move.
    Go(RoutineMove),
    /// Switch the spindle.
    Spindle {
        /// To this.
        to: Spindle,
        /// Line of the file that it comes from, from 1; 0 where the engine does it.
        line: u32,
    },
    /// Wait, in seconds.
    Wait {
        /// How long.
        seconds: f64,
        /// Line of the file.
        line: u32,
    },
    /// Switch mist and flood.
    Coolant {
        /// M7.
        mist: bool,
        /// M8.
        flood: bool,
        /// Line of the file.
        line: u32,
    },
}

/// What a section is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SectionKind {
    /// A hole, counted from 1.
    Hole(u32),
    /// A toolpath, counted from 1.
    Toolpath(u32),
    /// A person puts in this tool: index into [`Routine::tools`].
    Change(u32),
    /// What is left after the last cut.
    Finish,
}

/// A piece of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// What it is for.
    pub kind: SectionKind,
    /// Line of the file where it begins, from 1.
    pub line: u32,
    /// Where the tip is looked at before it goes down.
    pub entry: TipPlace,
    /// Spindle and feed in force at the entry.
    pub spindle: Spindle,
    /// Coolant in force there: mist, flood.
    pub coolant: [bool; 2],
    /// How many of the actions come before the entry.
    pub approach: usize,
    /// What to do.
    pub actions: Vec<RoutineAction>,
}

impl Section {
    /// Whether it leaves something in the board.
    pub fn cuts(&self) -> bool {
        matches!(self.kind, SectionKind::Hole(_) | SectionKind::Toolpath(_))
    }

    /// Where the tip is after it.
    pub fn end(&self) -> TipPlace {
        let last = self.actions.get(self.approach..).unwrap_or_default().iter().rev();
        let mut moves =
            last.filter_map(|action| if let RoutineAction::Go(step) = action { Some(step.to) } else { None });
        moves.next().unwrap_or(self.entry)
    }
}

/// A whole job.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Routine {
    /// Name for people.
    pub name: String,
    /// SHA-256 of what it was read from, as hexadecimal digits.
    pub key: String,
    /// What each tool is called.
    pub tools: Vec<String>,
    /// The number of each, where a T word says one.
    pub numbers: Vec<Option<u32>>,
    /// What to do, in order.
    pub sections: Vec<Section>,
    /// Height at which the tip may go anywhere.
    pub safe: Length,
    /// Its depth follows the surface of this map already ([`crate::level::HeightMap::key`]).
    pub levelled: Option<String>,
    /// The programs that it was read from, in order: with which section each begins, and what it is called.
    pub programs: Vec<(usize, String)>,
}

impl Routine {
    /// Of which program a section is: of several, its own name; of one, that of the job.
    pub fn program_of(&self, section: usize) -> &str {
        let several = self.programs.iter().filter(|_| self.programs.len() > 1);
        let last = several.take_while(|(first, _)| *first <= section).last();
        last.map_or(&self.name, |(_, name)| name)
    }

    /// Holes and toolpaths in it.
    pub fn cuts(&self) -> (u32, u32) {
        self.counted(self.sections.len())
    }

    /// Holes and toolpaths in the first `sections`.
    pub fn counted(&self, sections: usize) -> (u32, u32) {
        let mut counts = (0, 0);
        for section in self.sections.iter().take(sections) {
            match section.kind {
                SectionKind::Hole(_) => counts.0 += 1,
                SectionKind::Toolpath(_) => counts.1 += 1,
                _ => {}
            }
        }
        counts
    }

    /// Whether a tool is asked for anywhere in it.
    pub fn changes_tools(&self) -> bool {
        self.sections.iter().any(|section| matches!(section.kind, SectionKind::Change(_)))
    }

    /// The tool that section `at` works with: the last change before it.
    pub fn tool_at(&self, at: usize) -> Option<u32> {
        self.sections.iter().take(at).rev().find_map(|section| match section.kind {
            SectionKind::Change(tool) => Some(tool),
            _ => None,
        })
    }

    /// The lowest and the highest place of the tip, with the places of arcs that reach furthest; none where nothing moves.
    pub fn reach(&self) -> Option<[TipPlace; 2]> {
        let mut all: Option<[TipPlace; 2]> = None;
        let mut add = |place: TipPlace| {
            let [low, high] = all.get_or_insert([place, place]);
            for axis in 0..3 {
                low[axis] = low[axis].min(place[axis]);
                high[axis] = high[axis].max(place[axis]);
            }
        };
        for section in &self.sections {
            let mut at = section.entry;
            add(at);
            for action in section.actions.iter().skip(section.approach) {
                let RoutineAction::Go(step) = action else { continue };
                if let Course::Arc { centre, ccw } = step.course {
                    for place in furthest(at, step.to, centre, ccw) {
                        add(place);
                    }
                }
                at = step.to;
                add(at);
            }
        }
        all
    }
}

/// The places of an arc that are furthest to either side.
pub(super) fn furthest(from: TipPlace, to: TipPlace, centre: [Length; 2], ccw: bool) -> Vec<TipPlace> {
    let arc = Bow::of(from, to, centre, ccw);
    let mut found = Vec::new();
    for quarter in 0..4 {
        let angle = f64::from(quarter) * core::f64::consts::FRAC_PI_2;
        let turn = arc.turn_to(angle);
        if turn <= libm::fabs(arc.sweep_rad) {
            let (x, y) = (
                arc.centre_mm[0] + arc.radius_mm * libm::cos(angle),
                arc.centre_mm[1] + arc.radius_mm * libm::sin(angle),
            );
            found.push([Length::from_mm(x), Length::from_mm(y), to[2].max(from[2])]);
        }
    }
    found
}

/// An arc in numbers: mm and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bow {
    /// Centre in the plane.
    pub centre_mm: [f64; 2],
    /// Radius.
    pub radius_mm: f64,
    /// Angle where it begins.
    pub begin_rad: f64,
    /// How far it turns, positive counter-clockwise; a full turn where it ends where it begins.
    pub sweep_rad: f64,
}

impl Bow {
    /// The arc from one place to another.
    pub fn of(from: TipPlace, to: TipPlace, centre: [Length; 2], ccw: bool) -> Self {
        let centre = centre.map(Length::mm);
        let angle = |place: TipPlace| libm::atan2(place[1].mm() - centre[1], place[0].mm() - centre[0]);
        let (begin, end) = (angle(from), angle(to));
        let full = 2.0 * core::f64::consts::PI;
        let mut sweep = end - begin;
        // The controller takes less than this for none at all.
        const SAME_RAD: f64 = 5e-7;
        if ccw && sweep <= SAME_RAD {
            sweep += full;
        } else if !ccw && sweep >= -SAME_RAD {
            sweep -= full;
        }
        let radius = libm::hypot(from[0].mm() - centre[0], from[1].mm() - centre[1]);
        Self { centre_mm: centre, radius_mm: radius, begin_rad: begin, sweep_rad: sweep }
    }

    /// How far it turns, in its own sense and at least 0, until it is at `angle_rad`.
    pub fn turn_to(&self, angle_rad: f64) -> f64 {
        let full = 2.0 * core::f64::consts::PI;
        let turn =
            if self.sweep_rad >= 0.0 { angle_rad - self.begin_rad } else { self.begin_rad - angle_rad };
        turn - full * libm::floor(turn / full)
    }

    /// Where it is after that `share` of it, 0 to 1.
    pub fn at(&self, share: f64) -> [f64; 2] {
        let angle = self.begin_rad + self.sweep_rad * share;
        [
            self.centre_mm[0] + self.radius_mm * libm::cos(angle),
            self.centre_mm[1] + self.radius_mm * libm::sin(angle),
        ]
    }

    /// Its length in the plane.
    pub fn length(&self) -> f64 {
        self.radius_mm * libm::fabs(self.sweep_rad)
    }
}
