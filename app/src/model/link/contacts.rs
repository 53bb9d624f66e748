//! Where the strokes of the job in work, or of the last one, ended on their sensor, hole by hole (M3).
//!
//! ```text
//! Touched { leg, height } ─▶ Contacts ─ with the job's program ─▶ a row a hole, the one that is furthest from the middle first
//! ```
//!
//! Comes in: touches as they are told, the program. Goes out: rows, mm. Knows no words and no colours.

use annulus_core::geometry::Point;
use annulus_core::job::{Mark, Program};
use std::collections::BTreeMap;

/// What was told of the strokes of one job.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    /// SHA-256 of the program's bytes.
    pub job: String,
    /// Height of the tip over the work zero by leg, µm.
    heights_um: BTreeMap<u32, f64>,
}

/// Where one stroke ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactRow {
    /// Where the hole is, work coordinates.
    pub at: Point,
    /// Height of the tip over the work zero.
    pub height_mm: f64,
    /// How much higher than the one in the middle of all.
    pub off_mm: f64,
}

impl Contacts {
    /// A stroke of `job` ended. That of a leg that is done again counts in place of the one before; another job begins anew.
    pub(super) fn touched(&mut self, job: &str, leg: u32, height_um: f64) {
        if self.job != job {
            *self = Self { job: job.to_owned(), ..Self::default() };
        }
        self.heights_um.insert(leg, height_um);
    }

    /// The height of the middle one of all, mm; none where there is none.
    pub fn middle_mm(&self) -> Option<f64> {
        let mut all: Vec<f64> = self.heights_um.values().copied().collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len().saturating_sub(1) / 2).map(|um| um / 1e3)
    }

    /// A row a hole of `program`, the one that is furthest from the middle first.
    pub fn rows(&self, program: &Program) -> Vec<ContactRow> {
        let Some(middle_mm) = self.middle_mm() else { return Vec::new() };
        let row = |(leg, height_um): (&u32, &f64)| {
            let at = *leg as usize;
            program.legs.get(at).filter(|leg| matches!(leg.mark, Mark::Hole(_)))?;
            let height_mm = height_um / 1e3;
            Some(ContactRow { at: program.start_of_leg(at + 1), height_mm, off_mm: height_mm - middle_mm })
        };
        let mut rows: Vec<ContactRow> = self.heights_um.iter().filter_map(row).collect();
        rows.sort_by(|one, other| other.off_mm.abs().total_cmp(&one.off_mm.abs()));
        rows
    }
}
