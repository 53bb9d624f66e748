//! The height map of the board on a controller: touched, kept, followed by jobs, forgotten.
//!
//! Comes in: asks, touches. Goes out: tells, the map in a file, orders whose depth follows it. Does not know how depth is corrected.

use super::attended::Told;
use super::order::Order;
use super::station::Station;
use super::surface::Touching;
use crate::files::{File, Files};
use crate::journal::sealed;
use crate::prepare::row;
use annulus_core::controller::{EngineAsk, SurveyStart, settings};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::level::{HeightMap, ProbeGrid, key_of};
use annulus_core::units::Length;
use annulus_core::wire::{HeightMapReport, PreflightRow, RowVerdict, Tell};

/// How fast the tip goes down to the board, and from place to place, mm/min.
const DOWN_MM_PER_MIN: f64 = 60.0;
const OVER_MM_PER_MIN: f64 = 800.0;

/// What there is to be touched, and how.
pub(super) struct SurveyWish {
    pub(super) grid: ProbeGrid,
    pub(super) job: String,
    pub(super) clear_um: u32,
    pub(super) depth_um: u32,
    pub(super) now_s: u64,
}

impl<F: Files> Station<F> {
    /// Begins to touch the board.
    pub(super) fn survey(&mut self, wish: SurveyWish) -> Result<(), Diagnostic> {
        if !self.hand.height_known {
            return Err(Diagnostic::error("grbl.no_height"));
        }
        let mm = |um: u32| f64::from(um) / 1e3;
        let start = SurveyStart {
            grid: wish.grid,
            clear_mm: mm(wish.clear_um),
            depth_mm: mm(wish.depth_um) + mm(wish.clear_um),
            mm_per_min: DOWN_MM_PER_MIN,
            over_mm_per_min: OVER_MM_PER_MIN,
        };
        self.engine_asked(EngineAsk::Survey(start))?;
        let count = wish.grid.count();
        let (job, now_s, grid) = (wish.job, wish.now_s, Some(wish.grid));
        self.surface.touching = Touching { job, now_s, grid, heights: vec![None; count], done: 0, of: count };
        self.tell_surface();
        Ok(())
    }

    /// A touch, or the end of all.
    pub(super) fn touched(&mut self, told: &Told) {
        match told {
            Told::Touched { index, height, done, of } => {
                let touching = &mut self.surface.touching;
                if let Some(place) = touching.heights.get_mut(*index) {
                    *place = Some(*height);
                }
                (touching.done, touching.of) = (*done, *of);
            }
            Told::Surveyed { survey } => {
                let touching = std::mem::take(&mut self.surface.touching);
                let heights = survey.as_ref().and_then(|survey| survey.done());
                if let (Some(grid), Some(heights)) = (touching.grid, heights) {
                    let (job, measured_s, homed) = (touching.job, touching.now_s, self.homes());
                    let map = HeightMap { grid, heights, job, zero: self.zero_now(), homed, measured_s };
                    self.surface.fresh = true;
                    if let Err(why) = self.keep_surface(Some(map)) {
                        self.line.tell(&Tell::Refused { why });
                    }
                }
            }
            _ => return,
        }
        self.tell_surface();
    }

    /// Keeps the map, or forgets the one that there is.
    pub(super) fn keep_surface(&mut self, map: Option<HeightMap>) -> Result<(), Diagnostic> {
        self.surface.map = map;
        let written = self.ledger.keep(File::HeightMap, &sealed(&self.surface.map));
        self.tell_surface();
        written
    }

    /// Without switches a place means nothing over a reset.
    pub(super) fn surface_is_lost(&mut self) {
        self.surface.fresh = false;
        self.tell_surface();
    }

    fn homes(&self) -> bool {
        settings::on(&self.attended.controller().info.values, 22)
    }

    fn zero_now(&self) -> [Length; 2] {
        let zero_mm = self.attended.controller().zero_mm.unwrap_or_default();
        [Length::from_mm(zero_mm[0]), Length::from_mm(zero_mm[1])]
    }

    /// Why the map that there is does not fit to the zero; none where it does.
    fn misplaced(&self, map: &HeightMap) -> Option<Diagnostic> {
        let stale = (!map.homed && !self.surface.fresh)
            .then(|| Diagnostic::error("level.other_zero").with("mm", "?"));
        stale.or_else(|| map.refused(&map.job, self.zero_now(), self.homes()))
    }

    /// The height of the board over the work zero where the tip is now, mm; 0 where no map says it.
    pub(super) fn surface_mm(&self) -> f64 {
        let place = self.attended.controller().place().unwrap_or_default();
        let map = self.surface.map.as_ref().filter(|map| self.misplaced(map).is_none());
        map.map_or(0.0, |map| map.height(Point::from_mm(place[0], place[1])).mm())
    }

    /// The order as it follows the map of its job, and what there is to read of that.
    pub(super) fn levelled(&self, order: Order, resumed: bool) -> (Order, Vec<PreflightRow>) {
        let fails = |order, why| (order, vec![row(RowVerdict::Fail, why)]);
        let before = self.ledger.entry().levelled.clone().filter(|_| resumed);
        let map = match (&self.surface.map, &before) {
            (Some(map), Some(key)) if map.key() == *key => map,
            (_, Some(_)) => return fails(order, Diagnostic::error("level.other_map")),
            // It was begun without one.
            (_, None) if resumed => return (order, Vec::new()),
            (None, None) => return (order, Vec::new()),
            (Some(map), None) if map.job != key_of(&order.program) => {
                return (order, vec![row(RowVerdict::Warn, Diagnostic::warning("level.not_used"))]);
            }
            (Some(map), None) => map,
        };
        // What is taken up without switches had its zero set again by hand, at the same place.
        let by_hand = resumed && !self.homes() && self.hand.zero_set;
        if let Some(why) = self.misplaced(map).filter(|_| !by_hand) {
            return fails(order, why);
        }
        match order.following(map) {
            Ok((order, correction)) => {
                let mm = format!("{:.3}", correction.largest().mm());
                let why = Diagnostic::warning("level.follows").with("mm", mm);
                (order, vec![row(RowVerdict::Warn, why)])
            }
            Err(why) => fails(order, why),
        }
    }

    /// Why an order that follows a map may not begin any more; none where it may.
    pub(super) fn unfollowed(&self, order: &Order) -> Option<Diagnostic> {
        let follows = order.routine.levelled.as_ref()?;
        match &self.surface.map {
            Some(map) if map.key() == *follows => None,
            _ => Some(Diagnostic::error("level.other_map")),
        }
    }

    /// How it stands, for the page.
    pub(super) fn surface_tell(&self) -> Tell {
        let touching = &self.surface.touching;
        let goes = touching.grid.is_some();
        let map = self.surface.map.as_ref().filter(|_| !goes);
        let heights = match map {
            Some(map) => map.heights.iter().copied().map(Some).collect(),
            None => touching.heights.clone(),
        };
        let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        let survey = self.attended.controller().survey();
        Tell::HeightMap(Box::new(HeightMapReport {
            grid: map.map(|map| map.grid).or(touching.grid),
            heights,
            job: map.map_or_else(|| touching.job.clone(), |map| map.job.clone()),
            measured_s: map.map_or(0, |map| map.measured_s),
            goes,
            next: survey.and_then(|survey| survey.next_index()).map(count),
            done: count(touching.done),
            of: count(touching.of),
            refused: map.and_then(|map| self.misplaced(map)),
        }))
    }

    /// Tells it.
    pub(super) fn tell_surface(&mut self) {
        let tell = self.surface_tell();
        self.line.tell(&tell);
    }
}
