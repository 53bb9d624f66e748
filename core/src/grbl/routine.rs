//! A program as the engine runs it: sections that start over their position with the tip clear of the board.
//! A job can be resumed at any section.
//!
//! ```text
//!  section  ── approach ──┬── check: is the tip where it should be? ──┬── work ──▶ next section
//!   hole 17   rapid X Y   │                                           │  down, feed, up
//!   change    M5 up, park │                                           │  (the user)
//! ```
//!
//! Lengths in whole nanometres, feeds in mm/min.

use crate::diagnostic::Diagnostic;
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// Tip position: X, Y, Z in work coordinates.
pub type TipPlace = [Length; 3];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Course {
    /// As fast as the axes can.
    Rapid,
    Line,
    /// An arc about this centre in XY; a full circle if start and end are equal.
    Arc {
        centre: [Length; 2],
        ccw: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoutineMove {
    pub course: Course,
    pub to: TipPlace,
    /// Meaningless for rapids.
    pub feed_mm_per_min: f64,
    /// Line of the file, from 1.
    pub line: u32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Spindle {
    #[default]
    Off,
    /// Clockwise, at this speed in rpm.
    On(f64),
    Back(f64),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RoutineAction {
    Go(RoutineMove),
    Spindle {
        to: Spindle,
        /// Line of the file, from 1; 0 if the engine adds it.
        line: u32,
    },
    Wait {
        seconds: f64,
        line: u32,
    },
    Coolant {
        /// M7.
        mist: bool,
        /// M8.
        flood: bool,
        line: u32,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pause<'r> {
    Tool {
        /// Number of the T word, or position in the job, from 1.
        number: u32,
        /// Comment of the program about the tool.
        said: &'r str,
    },
    /// The program only stops.
    Stop {
        /// Comment of the program.
        said: &'r str,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SectionKind {
    Hole(u32),
    Toolpath(u32),
    /// The user inserts this tool: index into [`Routine::tools`].
    Change(u32),
    Finish,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    pub kind: SectionKind,
    /// First line in the file, from 1.
    pub line: u32,
    /// Position that is checked before the tip descends.
    pub entry: TipPlace,
    pub spindle: Spindle,
    /// Coolant at the entry: mist, flood.
    pub coolant: [bool; 2],
    /// Number of actions before the entry.
    pub approach: usize,
    pub actions: Vec<RoutineAction>,
}

impl Section {
    /// True for sections that cut the board.
    pub fn cuts(&self) -> bool {
        matches!(self.kind, SectionKind::Hole(_) | SectionKind::Toolpath(_))
    }

    /// Tip position after the section.
    pub fn end(&self) -> TipPlace {
        let last = self.actions.get(self.approach..).unwrap_or_default().iter().rev();
        let mut moves =
            last.filter_map(|action| if let RoutineAction::Go(step) = action { Some(step.to) } else { None });
        moves.next().unwrap_or(self.entry)
    }
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Routine {
    pub name: String,
    /// SHA-256 of the source files, in hexadecimal.
    pub key: String,
    pub tools: Vec<String>,
    pub numbers: Vec<Option<u32>>,
    /// Those that are no tools: the program only stops there, as a plain M0 does.
    pub stops: Vec<u32>,
    pub sections: Vec<Section>,
    /// Height at which the tip may travel anywhere.
    pub safe: Length,
    /// Key of the height map that the depth already follows ([`crate::level::HeightMap::key`]).
    pub levelled: Option<String>,
    /// Source programs in order: first section and name.
    pub programs: Vec<(usize, String)>,
    pub warnings: Vec<Diagnostic>,
}

impl Routine {
    /// The program of a section; for a single program the name of the job.
    pub fn program_of(&self, section: usize) -> &str {
        let several = self.programs.iter().filter(|_| self.programs.len() > 1);
        let last = several.take_while(|(first, _)| *first <= section).last();
        last.map_or(&self.name, |(_, name)| name)
    }

    /// What a person is asked for at a pause: index into its tools.
    pub fn pause(&self, tool: u32) -> Pause<'_> {
        let at = tool as usize;
        let said = self.tools.get(at).map_or("", String::as_str);
        if self.stops.contains(&tool) {
            return Pause::Stop { said };
        }
        let number = self.numbers.get(at).copied().flatten();
        let is_number = number.is_some_and(|number| said == format!("T{number}"));
        Pause::Tool { number: number.unwrap_or(tool + 1), said: if is_number { "" } else { said } }
    }

    /// Holes and toolpaths in it.
    pub fn cuts(&self) -> (u32, u32) {
        self.counted(self.sections.len())
    }

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

    /// True if the routine has a tool change.
    pub fn changes_tools(&self) -> bool {
        self.sections.iter().any(|section| matches!(section.kind, SectionKind::Change(_)))
    }

    /// Tool of section `at`: from the last change before it.
    pub fn tool_at(&self, at: usize) -> Option<u32> {
        self.sections.iter().take(at).rev().find_map(|section| match section.kind {
            SectionKind::Change(tool) if !self.stops.contains(&tool) => Some(tool),
            _ => None,
        })
    }

    /// Lowest and highest tip position, including the extremes of arcs; `None` if nothing moves.
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

/// An arc, in mm and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bow {
    pub centre_mm: [f64; 2],
    pub radius_mm: f64,
    /// Angle of the start.
    pub begin_rad: f64,
    /// Angle of the arc, positive counter-clockwise; a full turn if start and end are equal.
    pub sweep_rad: f64,
}

impl Bow {
    /// The arc between two positions.
    pub fn of(from: TipPlace, to: TipPlace, centre: [Length; 2], ccw: bool) -> Self {
        let centre = centre.map(Length::mm);
        let angle = |place: TipPlace| libm::atan2(place[1].mm() - centre[1], place[0].mm() - centre[0]);
        let (begin, end) = (angle(from), angle(to));
        let full = 2.0 * core::f64::consts::PI;
        let mut sweep = end - begin;
        // The controller treats a smaller angle as zero, so the arc becomes a full turn.
        const SAME_RAD: f64 = 5e-7;
        if ccw && sweep <= SAME_RAD {
            sweep += full;
        } else if !ccw && sweep >= -SAME_RAD {
            sweep -= full;
        }
        let radius = libm::hypot(from[0].mm() - centre[0], from[1].mm() - centre[1]);
        Self { centre_mm: centre, radius_mm: radius, begin_rad: begin, sweep_rad: sweep }
    }

    /// Angle from the start to `angle_rad` in the arc's direction, at least 0.
    pub fn turn_to(&self, angle_rad: f64) -> f64 {
        let full = 2.0 * core::f64::consts::PI;
        let turn =
            if self.sweep_rad >= 0.0 { angle_rad - self.begin_rad } else { self.begin_rad - angle_rad };
        turn - full * libm::floor(turn / full)
    }

    /// Point at `share` of the arc, 0 to 1.
    pub fn at(&self, share: f64) -> [f64; 2] {
        let angle = self.begin_rad + self.sweep_rad * share;
        [
            self.centre_mm[0] + self.radius_mm * libm::cos(angle),
            self.centre_mm[1] + self.radius_mm * libm::sin(angle),
        ]
    }

    /// Length in XY.
    pub fn length(&self) -> f64 {
        self.radius_mm * libm::fabs(self.sweep_rad)
    }
}
