//! The height map of the board on a controller: measured, saved, used by jobs, forgotten.

use super::order::Order;
use super::station::Station;
use super::surface::{HeightSet, Touching};
use crate::files::{File, Files};
use crate::journal::sealed;
use crate::prepare::row;
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::grbl::{EngineAsk, SurveyNews, SurveyStart, settings};
use annulus_core::level::{HeightMap, ProbeGrid, key_of, same_job};
use annulus_core::units::Length;
use annulus_core::wire::{HeightMapReport, PreflightRow, RowVerdict, Tell};
use annulus_core::{error, warning};

pub(super) struct SurveyWish {
    pub(super) grid: ProbeGrid,
    pub(super) job: String,
    pub(super) clear_um: u32,
    pub(super) depth_um: u32,
    pub(super) now_s: u64,
}

impl<F: Files> Station<F> {
    pub(super) fn survey(&mut self, wish: SurveyWish) -> Result<(), Diagnostic> {
        if self.hand.height.is_none() {
            return Err(error!("grbl.no_height"));
        }
        let mm = |um: u32| f64::from(um) / 1e3;
        let start = SurveyStart::usual(wish.grid, mm(wish.clear_um), mm(wish.depth_um));
        self.engine_asked(EngineAsk::Survey(start))?;
        // None of its moves needs a renewal by the page.
        self.hand.until = None;
        let count = wish.grid.count();
        let (job, now_s, grid) = (wish.job, wish.now_s, Some(wish.grid));
        self.surface.touching = Touching { job, now_s, grid, heights: vec![None; count], done: 0, of: count };
        self.tell_surface();
        Ok(())
    }

    /// Takes one probed height, or the end of the measurement.
    pub(super) fn touched(&mut self, news: &SurveyNews) {
        match news {
            SurveyNews::Touched { index, height, done, of } => {
                let touching = &mut self.surface.touching;
                if let Some(place) = touching.heights.get_mut(*index) {
                    *place = Some(*height);
                }
                (touching.done, touching.of) = (*done, *of);
            }
            SurveyNews::Over { survey } => {
                let touching = std::mem::take(&mut self.surface.touching);
                let heights = survey.as_ref().and_then(|survey| survey.done());
                if let (Some(grid), Some(heights)) = (touching.grid, heights) {
                    let (job, measured_s, homed) = (touching.job, touching.now_s, self.homes());
                    let map = HeightMap { grid, heights, job, zero: self.zero_now(), homed, measured_s };
                    self.surface.fresh = true;
                    // The map was measured from this zero, so the zero now refers to this map.
                    if let Some(height) = &mut self.hand.height {
                        height.map = Some(map.key());
                    }
                    if let Err(why) = self.keep_surface(Some(map)) {
                        self.tell(Tell::Refused { why });
                    }
                }
            }
        }
        self.tell_surface();
    }

    /// Saves the map; `None` forgets it.
    pub(super) fn keep_surface(&mut self, map: Option<HeightMap>) -> Result<(), Diagnostic> {
        self.surface.map = map;
        let written = self.ledger.keep(File::HeightMap, &sealed(&self.surface.map));
        self.tell_surface();
        written
    }

    /// After a reset without limit switches, the map no longer matches the board's position.
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

    /// Why the map does not fit the work zero; `None` if it fits.
    fn misplaced(&self, map: &HeightMap) -> Option<Diagnostic> {
        let stale = (!map.homed && !self.surface.fresh).then(|| error!("level.other_zero", mm = "?"));
        stale.or_else(|| map.refused(&map.job, self.zero_now(), self.homes()))
    }

    /// Height of the board over the work zero at the tool's position, mm, and the map that a Z zero set
    /// there refers to. During a job that is the job's map, before it the saved one. Fails if the position
    /// is unknown.
    pub(super) fn surface_mm(&self) -> Result<(f64, HeightSet), Diagnostic> {
        let controller = self.attended.controller();
        if self.homes() && controller.trust != Trust::Trusted {
            return Err(error!("control.not_homed"));
        }
        let map = self.surface.map.as_ref().filter(|map| match &self.work {
            Some(work) => work.order.routine.levelled == Some(map.key()),
            None => self.misplaced(map).is_none() || self.placed_by_hand(map),
        });
        let Some(map) = map else { return Ok((0.0, HeightSet { of_board: true, map: None })) };
        let [x, y, _] = controller.place().ok_or_else(|| error!("grbl.no_report"))?;
        let height_mm = map.height(Point::from_mm(x, y)).mm();
        Ok((height_mm, HeightSet { of_board: false, map: Some(map.key()) }))
    }

    /// Returns `true` if `map` belongs to the interrupted job and the user has set the zero again. Without
    /// limit switches nothing else locates the board.
    fn placed_by_hand(&self, map: &HeightMap) -> bool {
        let followed = self.offer.is_some() && self.ledger.entry().levelled == Some(map.key());
        followed && !self.homes() && self.hand.zero_set
    }

    /// The order with depths that follow the map of its job, and the pre-flight rows about it.
    pub(super) fn levelled(&self, order: Order, from: usize, resumed: bool) -> (Order, Vec<PreflightRow>) {
        let fails = |order, why| (order, vec![row(RowVerdict::Fail, why)]);
        let before = self.ledger.entry().levelled.clone().filter(|_| resumed);
        let (map, told) = match (&self.surface.map, &before) {
            (Some(map), Some(key)) if map.key() == *key => (Some(map), None),
            (_, Some(_)) => return fails(order, error!("level.other_map")),
            // The job was started without a map.
            (_, None) if resumed => (None, None),
            (None, None) => (None, None),
            (Some(map), None) if !same_job(&map.job, &key_of(&order.program)) => {
                (None, Some(warning!("level.not_used")))
            }
            (Some(map), None) => (Some(map), None),
        };
        let (order, told) = match map.map(|map| order.following(map)) {
            None => (order, told),
            Some(Err(why)) => return fails(order, why),
            Some(Ok((order, correction))) => {
                let mm = format!("{:.3}", correction.largest().mm());
                (order, Some(warning!("level.follows", mm = mm)))
            }
        };
        match self.unfollowed(&order, from) {
            Some(why) => fails(order, why),
            None => (order, told.map(|why| row(RowVerdict::Warn, why)).into_iter().collect()),
        }
    }

    /// Height map reasons why an order may not start with section `from`. Compares the map that it follows
    /// with the one that the Z zero refers to.
    pub(super) fn unfollowed(&self, order: &Order, from: usize) -> Option<Diagnostic> {
        let follows = order.routine.levelled.as_deref();
        if let Some(key) = follows {
            let map = self.surface.map.as_ref().filter(|map| map.key() == *key);
            let Some(map) = map else { return Some(error!("level.other_map")) };
            // A zero set by the user is accepted for a resumed job. A new job may be on another board.
            let goes_on = from > 0 && self.placed_by_hand(map);
            if let Some(why) = self.misplaced(map).filter(|_| !goes_on) {
                return Some(why);
            }
        }
        let suits = self.hand.height.as_ref().is_none_or(|height| height.suits(follows));
        (!suits && !self.height_as_left(from)).then(|| error!("level.other_height"))
    }

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

    pub(super) fn tell_surface(&mut self) {
        let tell = self.surface_tell();
        self.tell(tell);
    }
}
