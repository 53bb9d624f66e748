//! The contact heights of the drill cycles of the running or last job, per hole.
//!
//! ```text
//! Touched { leg, height } ─▶ Contacts ─ with the job's program ─▶ a row per hole, largest deviation first
//! ```

use annulus_core::geometry::Point;
use annulus_core::job::{Mark, Program};
use std::collections::BTreeMap;

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    /// SHA-256 of the program's bytes.
    pub job: String,
    /// Height of the tool tip above the work zero at contact, by segment, µm.
    heights_um: BTreeMap<u32, f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactRow {
    /// Position of the hole, work coordinates.
    pub at: Point,
    /// Height of the tool tip above the work zero.
    pub height_mm: f64,
    pub off_mm: f64,
}

impl Contacts {
    /// Records a contact. A repeated segment replaces its earlier contact; another job clears all.
    pub(super) fn touched(&mut self, job: &str, leg: u32, height_um: f64) {
        if self.job != job {
            *self = Self { job: job.to_owned(), ..Self::default() };
        }
        self.heights_um.insert(leg, height_um);
    }

    /// The median height, mm; the lower one of two.
    pub fn middle_mm(&self) -> Option<f64> {
        let mut all: Vec<f64> = self.heights_um.values().copied().collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len().saturating_sub(1) / 2).map(|um| um / 1e3)
    }

    /// A row per hole of `program`, the furthest from the median first.
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
