//! Height maps from the command line: probes the board at a controller, saves the map, and lets a job follow
//! it.

use super::operator::Operator;
use super::program::{self, Programs};
use super::{BoardArgs, TouchArgs, WhichMap, files, own_ledger};
use crate::cli::{Answer, Exit, Refusal, height_map, say};
use annulus_core::geometry::Point;
use annulus_core::grbl::{
    EngineAsk, EnginePhase, SurveyNews, SurveyStart, cut_bounds, level_routine, settings,
};
use annulus_core::level::{HeightMap, ProbeGrid, TOLERANCE};
use annulus_core::units::Length;
use annulus_core::{code, error};
use annulus_host::grbl::{AttendedJob, Told};
use std::sync::Arc;
use std::time::SystemTime;

/// Probes a board and saves its height map.
pub(super) fn run(args: &BoardArgs, json: bool) -> Result<Answer, Refusal> {
    super::no_controller(&args.job.on, args.how.port.port.as_deref())?;
    let ledger = own_ledger()?;
    let programs = super::aligned(program::read(&args.job, &args.more, &ledger)?, &args.how)?;
    let (how, job) = (args.how(), (AttendedJob::default(), None));
    let mut operator = Operator::new(&how, &ledger, job, how.typing(), json)?;
    let map = operator.meets().and_then(|()| operator.measure_board(&programs, &args.touches));
    let map = operator.leaves(map, code!("level.stopped"))?;
    Ok(Answer { object: height_map::object(&map), text: height_map::text(&map), exit: Exit::Done })
}

impl Operator {
    /// Height of the board below the tool, relative to the work zero, mm. 0 without a map; `None` if the
    /// position is unknown.
    pub(super) fn surface_mm(&mut self) -> Option<f64> {
        self.rests();
        let Some(map) = &self.map else { return Some(0.0) };
        let place = self.now.as_ref().and_then(|now| now.place_mm);
        if place.is_none() {
            let why = error!("grbl.no_report");
            say(format_args!("{} {}", why.message("en"), why.advice("en")));
            self.worst = Some(why);
        }
        place.map(|[x, y, _]| map.height(Point::from_mm(x, y)).mm())
    }

    /// Returns `true` if the machine homes.
    pub(super) fn homes(&self) -> bool {
        self.info.as_ref().is_some_and(|info| settings::on(&info.values, 22))
    }

    fn zero(&self) -> [Length; 2] {
        let zero_mm = self.now.as_ref().and_then(|now| now.zero_mm).unwrap_or_default();
        [Length::from_mm(zero_mm[0]), Length::from_mm(zero_mm[1])]
    }

    /// The programs with their depth corrected by a height map, if requested or if the resumed job had one.
    pub(super) fn followed(
        &mut self,
        programs: &Programs,
        before: Option<&AttendedJob>,
        which: Option<(WhichMap, &TouchArgs)>,
    ) -> Result<Option<Programs>, Refusal> {
        let resumed = before.and_then(|entry| entry.levelled.as_ref());
        let map = match (which, resumed) {
            (Some((WhichMap::Measure, touches)), _) => self.measure_board(programs, touches)?,
            (Some((WhichMap::Saved, _)), _) => {
                let map = files().map().map_err(Refusal::content)?;
                let refused = map.refused(&programs.level_key, self.zero(), self.homes());
                // Without homing, coordinates restart each time the port is opened: equal numbers are another
                // position.
                let unknown = || error!("level.other_zero", mm = "?");
                let refused = refused.or_else(|| (!self.homes()).then(unknown));
                refused.map_or(Ok(map), |why| Err(Refusal::content(why)))?
            }
            (None | Some((WhichMap::None, _)), Some(key)) => {
                let map = files().map().map_err(Refusal::content)?;
                let same = map.key() == *key;
                let homes = self.homes();
                // Without homing, the saved zero means nothing after a reset: the user has set it again.
                let refused = map.refused(&programs.level_key, self.zero(), homes).filter(|_| homes);
                if let Some(why) = refused.or_else(|| (!same).then(|| error!("level.other_map"))) {
                    return Err(Refusal::content(why));
                }
                map
            }
            (None | Some((WhichMap::None, _)), None) => return Ok(None),
        };
        let (routine, correction) =
            level_routine(&programs.routine, &map, TOLERANCE).map_err(Refusal::content)?;
        say(format_args!("Depth follows the height map, by up to {:.3} mm.", correction.largest().mm()));
        self.map = Some(map);
        self.corrected = Some(correction);
        Ok(Some(Programs {
            routine: Arc::new(routine),
            level_key: programs.level_key.clone(),
            files: programs.files.clone(),
            counted: programs.counted.clone(),
            diagnostics: Vec::new(),
            written: Arc::clone(&programs.written),
        }))
    }

    /// Probes the board over the whole cut area and saves the map.
    pub(super) fn measure_board(
        &mut self,
        programs: &Programs,
        touches: &TouchArgs,
    ) -> Result<HeightMap, Refusal> {
        let bounds = cut_bounds(&programs.routine);
        let bounds = bounds.ok_or_else(|| Refusal::content(error!("level.nothing_cut")))?;
        let mm = Length::from_mm;
        let grid = ProbeGrid::over(bounds, mm(touches.grid), mm(touches.margin)).map_err(Refusal::content)?;
        if let Some(depth) = self.how.probe_mm() {
            self.find_board(depth)?;
        }
        self.is_wanted()?;
        self.worst = None;
        let start = SurveyStart::usual(grid, touches.clear, touches.depth);
        self.station.ask(EngineAsk::Survey(start));
        let survey = self.until_surveyed();
        self.rests();
        self.is_wanted()?;
        let heights = survey.and_then(|survey| survey.done());
        let Some(heights) = heights.filter(|_| !self.interrupted) else {
            return Err(Refusal::content(self.why(code!("level.stopped"))));
        };
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let measured_s = now.map_or(0, |since| since.as_secs());
        let (job, zero) = (programs.level_key.clone(), self.zero());
        let map = HeightMap { grid, heights, job, zero, homed: self.homes(), measured_s };
        files().keep_map(&map).map_err(Refusal::surroundings)?;
        Ok(map)
    }

    fn until_surveyed(&mut self) -> Option<Box<annulus_core::level::Survey>> {
        let mut begun = false;
        while !self.gone && !self.held.is_stuck() {
            match self.next() {
                Some(Told::Survey(SurveyNews::Over { survey })) => return survey,
                Some(Told::Survey(SurveyNews::Touched { height, done, of, .. })) => {
                    say(format_args!("{done} of {of}: {:.3} mm", height.mm()));
                }
                _ => {}
            }
            begun |= self.phase() == Some(EnginePhase::Surveying);
            if !begun && (self.worst.is_some() || self.interrupted) {
                return None;
            }
            self.hear();
        }
        None
    }
}
