//! Faults that can be injected into the virtual drill: one table for the command line, the manual and the
//! tests; and the shape of an uneven board.
//!
//! ```text
//!  broken-bit        starts at its default hole
//!  broken-bit@12     starts at the twelfth hole
//!  stuck-switch@0    starts at once
//! ```

use super::Faults;
use crate::diagnostic::{Diagnostic, nearest};
use crate::job::Input;
use crate::steps::TICK_HZ;
use crate::{code, error};
use std::f64::consts::PI;

const MOST_HOLES: u32 = 1_000_000;

/// Slip of a bit, mm: less than the tip's clearance over the board while XY moves.
const SLIPS_MM: f64 = 0.25;

#[derive(Clone, Copy, Debug)]
pub struct FaultRow {
    pub name: &'static str,
    /// Default number of holes before the fault starts; 0 is at once.
    pub after: u32,
    /// Code of the alarm or problem that the fault must cause; none if it causes none.
    pub seen: Option<&'static str>,
    put: fn() -> Faults,
}

impl FaultRow {
    pub fn sentence_key(&self) -> String {
        format!("fault.{}", self.name.replace('-', "_"))
    }
}

fn none() -> Faults {
    Faults::default()
}

/// All faults, in the order of the manual.
pub const FAULTS: &[FaultRow] = &[
    FaultRow {
        name: "lost-step",
        after: 2,
        seen: Some(code!("control.board_differs")),
        put: || Faults { throws: 3, ..none() },
    },
    FaultRow {
        name: "stuck-switch",
        after: 0,
        seen: Some(code!("control.sensor_stuck")),
        put: || Faults { stuck_on: Input::XMin.bit(), ..none() },
    },
    FaultRow {
        name: "missing-switch",
        after: 0,
        seen: Some(code!("control.sensor_not_found")),
        put: || Faults { stuck_off: Input::YMin.bit(), ..none() },
    },
    FaultRow { name: "bouncing-switch", after: 0, seen: None, put: || Faults { glitches: 0.01, ..none() } },
    FaultRow {
        name: "dull-bit",
        after: 2,
        seen: Some(code!("control.end_sensor")),
        put: || Faults { dull_bit_hz: Some(300.0), ..none() },
    },
    FaultRow {
        name: "worn-bit",
        after: 0,
        seen: Some(code!("control.end_sensor")),
        put: || Faults { bit_life: Some(3), ..none() },
    },
    FaultRow {
        name: "broken-bit",
        after: 2,
        seen: Some(code!("control.board_differs")),
        put: || Faults { bit_breaks: true, ..none() },
    },
    FaultRow {
        name: "spindle-stops",
        after: 2,
        seen: Some(code!("control.board_differs")),
        put: || Faults { spindle_stands: true, ..none() },
    },
    FaultRow {
        name: "contact-missing",
        after: 0,
        seen: Some(code!("level.no_board")),
        put: || Faults { stuck_off: Input::Contact.bit(), ..none() },
    },
    FaultRow {
        name: "contact-early",
        after: 2,
        seen: Some(code!("control.early_contact")),
        put: || Faults { bit_slips_mm: SLIPS_MM, ..none() },
    },
    FaultRow {
        name: "contact-closed",
        after: 0,
        seen: Some(code!("control.end_sensor")),
        put: || Faults { stuck_on: Input::Contact.bit(), ..none() },
    },
    FaultRow {
        name: "board-not-flat",
        after: 0,
        seen: Some(code!("control.board_differs")),
        put: || Faults { uneven: Some(UnevenBoard::BOWED), ..none() },
    },
    FaultRow {
        name: "late-host",
        after: 0,
        seen: Some(code!("control.executor_late")),
        put: || Faults { late_host: Some(TICK_HZ / 100), ..none() },
    },
    FaultRow {
        name: "cable-pulled",
        after: 2,
        seen: Some(code!("control.board_differs")),
        put: || Faults { unplugged: true, ..none() },
    },
    FaultRow {
        name: "cover-open",
        after: 2,
        seen: Some(code!("control.cover_open")),
        put: || Faults { cover_open: true, ..none() },
    },
    FaultRow {
        name: "clamp-stuck",
        after: 2,
        seen: Some(code!("magazine.clamp_closed")),
        put: || Faults { clamp_stuck: true, ..none() },
    },
    FaultRow {
        name: "tool-dropped",
        after: 2,
        seen: Some(code!("magazine.no_tool")),
        put: || Faults { tool_drops: true, ..none() },
    },
    FaultRow {
        name: "place-occupied",
        after: 0,
        seen: Some(code!("magazine.place_taken")),
        put: || Faults { place_occupied: true, ..none() },
    },
    FaultRow {
        name: "no-air",
        after: 2,
        seen: Some(code!("magazine.no_air")),
        put: || Faults { no_air: true, ..none() },
    },
];

/// Parses `NAME` or `NAME@HOLES`: the fault, and the number of holes before it starts.
pub fn named(word: &str) -> Result<(&'static FaultRow, u32), Diagnostic> {
    let (name, after) = word.split_once('@').map_or((word, None), |(name, after)| (name, Some(after)));
    let row = FAULTS.iter().find(|row| row.name == name).ok_or_else(|| {
        let near = nearest(name, FAULTS.iter().map(|row| row.name));
        error!("fault.unknown", name = name, near = near)
    })?;
    let after = match after {
        None => row.after,
        Some(text) => text
            .parse()
            .ok()
            .filter(|holes| *holes <= MOST_HOLES)
            .ok_or_else(|| error!("fault.when", word = word))?,
    };
    // Lateness belongs to the clock, which can't change during a run.
    let after = if (row.put)().late_host.is_some() { 0 } else { after };
    Ok((row, after))
}

/// The faults of these words, each `NAME` or `NAME@HOLES`. If a name repeats, the last word counts.
pub fn read<'a>(words: impl IntoIterator<Item = &'a str>) -> Result<Faults, Diagnostic> {
    let mut wanted: Vec<(&'static FaultRow, u32)> = Vec::new();
    for word in words {
        let (row, after) = named(word)?;
        wanted.retain(|(before, _)| before.name != row.name);
        wanted.push((row, after));
    }
    let mut all = Faults::default();
    for (row, after) in wanted {
        all.named.push(format!("{}@{after}", row.name));
        let fault = (row.put)();
        if after == 0 {
            all.add(fault);
        } else {
            all.later.push((after, fault));
        }
    }
    Ok(all)
}

impl Faults {
    pub(super) fn add(&mut self, other: Self) {
        self.stuck_on |= other.stuck_on;
        self.stuck_off |= other.stuck_off;
        self.glitches = self.glitches.max(other.glitches);
        self.dull_bit_hz = other.dull_bit_hz.or(self.dull_bit_hz);
        self.bit_life = other.bit_life.or(self.bit_life);
        self.late_host = other.late_host.or(self.late_host);
        self.uneven = other.uneven.or(self.uneven);
        self.scatter_steps = self.scatter_steps.max(other.scatter_steps);
        self.throws += other.throws;
        self.bit_breaks |= other.bit_breaks;
        self.bit_slips_mm += other.bit_slips_mm;
        self.spindle_stands |= other.spindle_stands;
        self.unplugged |= other.unplugged;
        self.clamp_stuck |= other.clamp_stuck;
        self.tool_drops |= other.tool_drops;
        self.place_occupied |= other.place_occupied;
        self.no_air |= other.no_air;
        self.cover_open |= other.cover_open;
    }

    /// Activates the faults that are due after this many holes. True if there were any.
    pub(super) fn come(&mut self, holes: u32) -> bool {
        let (now, later) =
            std::mem::take(&mut self.later).into_iter().partition(|(after, _)| *after <= holes);
        self.later = later;
        let now: Vec<(u32, Self)> = now;
        let any = !now.is_empty();
        now.into_iter().for_each(|(_, fault)| self.add(fault));
        any
    }
}

/// Shape of a board that isn't flat: bowed, tilted, or with a step. All zeros is a flat board.
///
/// ```text
///  bow    ╭──────╮     step  ────┐        tilt  ╱╱╱
///       ──╯      ╰──             └────       ──╱
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnevenBoard {
    /// Height in the middle of every 100 mm, mm.
    pub bow_mm: f64,
    /// Slope along X and along Y, mm per mm.
    pub tilt_slope: [f64; 2],
    pub step_mm: f64,
    /// Start of the right part along X, machine mm.
    pub step_at_mm: f64,
}

impl UnevenBoard {
    /// Shape in the exercise: bowed, with the right side so low that holes do not break through.
    pub const BOWED: Self = Self { bow_mm: 0.15, tilt_slope: [-0.018, 0.001], step_mm: 0.0, step_at_mm: 0.0 };

    pub fn raised_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        let wave = |mm: f64| libm::sin(mm * PI / 100.0);
        let bow = self.bow_mm * wave(x_mm) * wave(y_mm);
        let step = if x_mm > self.step_at_mm { self.step_mm } else { 0.0 };
        bow + self.tilt_slope[0] * x_mm + self.tilt_slope[1] * y_mm + step
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::locale;

    #[test]
    fn every_fault_has_a_text_and_occurs_on_request() {
        for row in FAULTS {
            for language in ["en", "pl", "zh"] {
                assert!(!locale::text(language, &row.sentence_key(), &[]).is_empty(), "{}", row.name);
            }
            let usual = read([row.name]).unwrap();
            let first = read([format!("{}@0", row.name).as_str()]).unwrap();
            assert_ne!(first, Faults::default(), "{}", row.name);
            assert_eq!(first.later, [], "{}", row.name);
            assert_eq!(usual == first, row.after == 0 || row.name == "late-host", "{}", row.name);
        }
        let mut two = read(["broken-bit@3", "board-not-flat"]).unwrap();
        assert!(two.uneven.is_some() && !two.bit_breaks);
        assert!(!two.come(2) && two.come(3) && two.bit_breaks && !two.come(4));
        for (word, code) in [
            ("broken-bits", "fault.unknown"),
            ("", "fault.unknown"),
            ("broken-bit@", "fault.when"),
            ("broken-bit@-1", "fault.when"),
            ("broken-bit@99999999999", "fault.when"),
        ] {
            assert_eq!(read([word]).unwrap_err().code, code, "{word}");
        }
        assert_eq!(read(["broken-bits"]).unwrap_err().argument(&["near"]), Some("broken-bit"));
    }
}
