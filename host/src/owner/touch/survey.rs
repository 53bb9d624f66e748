//! The height map of the board: measured, saved, forgotten, reported. Heights are over the board surface in
//! the settings.

use super::super::Owner;
use super::{TouchFor, length};
use crate::surface::KeptSurface;
use annulus_core::control::Event;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::level::{HeightMap, ProbeGrid, Survey};
use annulus_core::units::Length;
use annulus_core::wire::{HeightMapReport, Tell};
use std::sync::Arc;

/// Limit of the travel height over the highest point, and of the search depth, µm.
const MOST_UM: u32 = 20_000;

pub(crate) struct SurveyWish {
    pub(crate) grid: ProbeGrid,
    pub(crate) job: String,
    pub(crate) clear_um: u32,
    pub(crate) depth_um: u32,
    pub(crate) now_s: u64,
}

pub(crate) struct Surveying {
    pub(super) survey: Survey,
    job: String,
    now_s: u64,
    pub(super) clear: Length,
    pub(super) depth: Length,
    /// The last measured height, and the highest.
    pub(super) last: Length,
    pub(super) highest: Length,
}

impl Owner {
    pub(crate) fn survey(&mut self, wish: SurveyWish) -> Result<(), Diagnostic> {
        self.may_touch()?;
        if !wish.grid.is_sound() {
            return Err(error!("level.no_grid", most = ProbeGrid::MOST));
        }
        let sound = |um: u32| (1..=MOST_UM).contains(&um);
        if !sound(wish.clear_um) || !sound(wish.depth_um) {
            return Err(error!("level.bad_survey"));
        }
        for corner in [wish.grid.low, wish.grid.high] {
            self.steps_at(corner)?;
        }
        self.begin_touching(TouchFor::Survey(Surveying {
            survey: Survey::new(wish.grid),
            job: wish.job,
            now_s: wish.now_s,
            clear: length(wish.clear_um),
            depth: length(wish.depth_um),
            last: Length::ZERO,
            highest: Length::ZERO,
        }))
    }

    /// All points are measured: saves the map.
    pub(super) fn surveyed(&mut self, surveying: Surveying) {
        let (grid, heights) = (*surveying.survey.grid(), surveying.survey.done().unwrap_or_default());
        let (job, measured_s, zero) = (surveying.job, surveying.now_s, self.zero_mm());
        let map = HeightMap { grid, heights, job, zero, homed: true, measured_s };
        let kept = KeptSurface { map, height: self.machine.process.surface };
        if let Err(why) = self.keep_surface(Some(kept)) {
            self.tell(Tell::Refused { why });
        }
        self.pending.push_back(Event::QueueDone);
    }

    /// The work zero in machine coordinates.
    pub(super) fn zero_mm(&self) -> [Length; 2] {
        let zero = self.session.zero().unwrap_or_default();
        [0, 1].map(|axis: usize| self.machine.axis(axis).scale.length(zero[axis]))
    }

    /// Saves a map, or deletes it. Disarms the job, because it was checked with the previous map.
    pub(super) fn keep_surface(&mut self, surface: Option<KeptSurface>) -> Result<(), Diagnostic> {
        let kept = self.outside.keep_surface(surface.as_ref());
        self.surface = surface.map(Arc::new);
        (self.prepared, self.session.armed) = (None, None);
        self.tell(self.surface_tell());
        kept
    }

    pub(crate) fn forget_surface(&mut self) -> Result<(), Diagnostic> {
        if self.work.is_some() || self.touching.is_some() {
            return Err(error!("control.busy"));
        }
        self.keep_surface(None)
    }

    pub(crate) fn surface_tell(&self) -> Tell {
        let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        let report = match (self.touching.as_ref().map(|touching| &touching.what), &self.surface) {
            (Some(TouchFor::Survey(surveying)), _) => {
                let (done, of) = surveying.survey.progress();
                HeightMapReport {
                    grid: Some(*surveying.survey.grid()),
                    heights: surveying.survey.heights(),
                    job: surveying.job.clone(),
                    goes: true,
                    next: surveying.survey.next_index().map(count),
                    done: count(done),
                    of: count(of),
                    ..HeightMapReport::default()
                }
            }
            (_, Some(kept)) => HeightMapReport {
                grid: Some(kept.map.grid),
                heights: kept.map.heights.iter().copied().map(Some).collect(),
                job: kept.map.job.clone(),
                measured_s: kept.map.measured_s,
                refused: kept.misplaced(&self.machine, self.session.zero()),
                ..HeightMapReport::default()
            },
            (_, None) => HeightMapReport::default(),
        };
        Tell::HeightMap(Box::new(report))
    }
}
