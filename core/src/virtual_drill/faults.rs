//! What can be broken of the virtual drill on demand: one table, for the command line, the manual and the tests (N20).
//!
//! ```text
//!  broken-bit        from the usual hole on
//!  broken-bit@12     from the twelfth hole on
//!  stuck-switch@0    from the beginning
//! ```
//!
//! Comes in: words. Goes out: [`Faults`]. Does not know who asks.

use super::{Faults, UnevenBoard};
use crate::diagnostic::{Diagnostic, nearest};
use crate::job::Input;
use crate::steps::TICK_HZ;

/// Most holes before a fault comes.
const MOST_HOLES: u32 = 1_000_000;

/// How far a bit slips, mm: less than the tip is clear of the board when the plane moves.
const SLIPS_MM: f64 = 0.25;

/// A fault that can be provoked.
#[derive(Clone, Copy, Debug)]
pub struct FaultRow {
    /// Its name.
    pub name: &'static str,
    /// After how many holes it usually comes; 0 is from the beginning.
    pub after: u32,
    /// The code of the alarm or refusal that tells of it; none where nothing has to be told.
    pub seen: Option<&'static str>,
    put: fn() -> Faults,
}

impl FaultRow {
    /// Key of what it is, in the locale tables.
    pub fn sentence_key(&self) -> String {
        format!("fault.{}", self.name.replace('-', "_"))
    }
}

fn none() -> Faults {
    Faults::default()
}

/// All of them, in the order of the manual.
pub const FAULTS: &[FaultRow] = &[
    FaultRow {
        name: "lost-step",
        after: 2,
        seen: Some("control.board_differs"),
        put: || Faults { throws: 3, ..none() },
    },
    FaultRow {
        name: "stuck-switch",
        after: 0,
        seen: Some("control.sensor_stuck"),
        put: || Faults { stuck_on: Input::XMin.bit(), ..none() },
    },
    FaultRow {
        name: "missing-switch",
        after: 0,
        seen: Some("control.sensor_not_found"),
        put: || Faults { stuck_off: Input::YMin.bit(), ..none() },
    },
    FaultRow { name: "bouncing-switch", after: 0, seen: None, put: || Faults { glitches: 0.01, ..none() } },
    FaultRow {
        name: "dull-bit",
        after: 2,
        seen: Some("control.end_sensor"),
        put: || Faults { dull_bit_hz: Some(300.0), ..none() },
    },
    FaultRow {
        name: "worn-bit",
        after: 0,
        seen: Some("control.end_sensor"),
        put: || Faults { bit_life: Some(3), ..none() },
    },
    FaultRow {
        name: "broken-bit",
        after: 2,
        seen: Some("control.board_differs"),
        put: || Faults { bit_breaks: true, ..none() },
    },
    FaultRow {
        name: "spindle-stops",
        after: 2,
        seen: Some("control.board_differs"),
        put: || Faults { spindle_stands: true, ..none() },
    },
    FaultRow {
        name: "contact-missing",
        after: 0,
        seen: Some("level.no_board"),
        put: || Faults { stuck_off: Input::Contact.bit(), ..none() },
    },
    FaultRow {
        name: "contact-early",
        after: 2,
        seen: Some("control.early_contact"),
        put: || Faults { bit_slips_mm: SLIPS_MM, ..none() },
    },
    FaultRow {
        name: "contact-closed",
        after: 0,
        seen: Some("control.end_sensor"),
        put: || Faults { stuck_on: Input::Contact.bit(), ..none() },
    },
    FaultRow {
        name: "board-not-flat",
        after: 0,
        seen: Some("control.board_differs"),
        put: || Faults { uneven: Some(UnevenBoard::BOWED), ..none() },
    },
    FaultRow {
        name: "late-host",
        after: 0,
        seen: Some("control.executor_late"),
        put: || Faults { late_host: Some(TICK_HZ / 100), ..none() },
    },
    FaultRow {
        name: "cable-pulled",
        after: 2,
        seen: Some("control.board_differs"),
        put: || Faults { unplugged: true, ..none() },
    },
    FaultRow {
        name: "cover-open",
        after: 2,
        seen: Some("control.cover_open"),
        put: || Faults { cover_open: true, ..none() },
    },
    FaultRow {
        name: "clamp-stuck",
        after: 2,
        seen: Some("magazine.clamp_closed"),
        put: || Faults { clamp_stuck: true, ..none() },
    },
    FaultRow {
        name: "tool-dropped",
        after: 2,
        seen: Some("magazine.no_tool"),
        put: || Faults { tool_drops: true, ..none() },
    },
    FaultRow {
        name: "place-occupied",
        after: 0,
        seen: Some("magazine.place_taken"),
        put: || Faults { place_occupied: true, ..none() },
    },
    FaultRow {
        name: "no-air",
        after: 2,
        seen: Some("magazine.no_air"),
        put: || Faults { no_air: true, ..none() },
    },
];

/// The fault of a word, `NAME` or `NAME@HOLES`, and after how many holes it comes.
pub fn named(word: &str) -> Result<(&'static FaultRow, u32), Diagnostic> {
    let (name, after) = word.split_once('@').map_or((word, None), |(name, after)| (name, Some(after)));
    let row = FAULTS.iter().find(|row| row.name == name).ok_or_else(|| {
        let near = nearest(name, FAULTS.iter().map(|row| row.name));
        Diagnostic::error("fault.unknown").with("name", name).with("near", near)
    })?;
    let after = match after {
        None => row.after,
        Some(text) => text
            .parse()
            .ok()
            .filter(|holes| *holes <= MOST_HOLES)
            .ok_or_else(|| Diagnostic::error("fault.when").with("word", word))?,
    };
    // How late a computer is belongs to its clock, from the beginning.
    let after = if (row.put)().late_host.is_some() { 0 } else { after };
    Ok((row, after))
}

/// The faults of these words, each `NAME` or `NAME@HOLES`; of several words with one name the last one counts.
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
    /// What is broken besides.
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

    /// What comes now that so many holes are made.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::locale;

    #[test]
    fn every_fault_has_a_name_a_sentence_and_comes_when_it_is_asked_for() {
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
