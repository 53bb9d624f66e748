//! Probing with the contact sensor: the board point by point, its height or a plate on it, its edges, the
//! tool setter.
//!
//! ```text
//!  board    rise ─▶ over ─▶ near ─▶ down ─▶ rise …    contact during over or near: something is in the way
//!  height   look ─▶ down                              look: the contact must be open
//!  edge     look ─▶ side ─▶ back
//! ```
//!
//! `down` and `side` move slowly and stop where the contact closes; the position is latched at that step.
//! Probing uses the queue's states to run and hold. Nothing is journaled: an interrupted measurement starts
//! again.

mod survey;

use annulus_core::{code, error};
pub(crate) use survey::SurveyWish;

use self::survey::Surveying;
use super::Owner;
use super::moves::{Doing, rest, segments};
use crate::executor::Ended;
use crate::surface::KeptSurface;
use annulus_core::control::{Ending, Event, State, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::job::{Input, Otherwise};
use annulus_core::level::HeightMap;
use annulus_core::machine::{self, Steps, Value, axis_name};
use annulus_core::motion::cycles;
use annulus_core::queue::travel;
use annulus_core::steps::{Segment, Stage, Switching, TICK_HZ};
use annulus_core::units::Length;
use annulus_core::wire::Tell;
use std::sync::Arc;

/// Wait before reading the contact, ticks: 20 ms.
const LOOK_TICKS: u64 = TICK_HZ / 50;
/// Furthest search, thickest plate and widest tool (µm), and how far to back off an edge.
const FURTHEST_UM: u32 = 50_000;
const THICKEST_UM: u32 = 50_000;
const BACK: Length = Length::from_um(1_000);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TouchStep {
    Rise,
    Over,
    Near,
    Look,
    Down,
    Side,
    Back,
}

pub(crate) enum TouchFor {
    Survey(Surveying),
    /// The height of the board, at most `depth` below the tool, with a plate of this thickness on it.
    Height {
        depth: Length,
        plate: Length,
    },
    Setter,
    Edge {
        axis: usize,
        up: bool,
        reach: Length,
        radius: Length,
    },
}

pub(crate) struct Touching {
    pub(super) what: TouchFor,
    step: TouchStep,
    from: Steps,
    found: Option<Steps>,
}

pub(super) fn length(um: u32) -> Length {
    Length::from_um(i64::from(um))
}

impl Owner {
    pub(super) fn may_touch(&self) -> Result<(), Diagnostic> {
        self.may_move_in_change()?;
        if self.session.queue || self.touching.is_some() {
            return Err(error!("control.busy"));
        }
        if self.session.trust != Trust::Trusted {
            return Err(error!("control.not_homed"));
        }
        if self.machine.senses_contact() { Ok(()) } else { Err(error!("level.no_contact")) }
    }

    pub(super) fn begin_touching(&mut self, what: TouchFor) -> Result<(), Diagnostic> {
        let is_of_change =
            self.session.changes_by_hand() && matches!(what, TouchFor::Height { .. } | TouchFor::Setter);
        let event = if is_of_change { Event::Touch } else { Event::Queue };
        self.touching = Some(Touching { what, step: TouchStep::Look, from: self.position, found: None });
        self.try_event(event).inspect_err(|_| self.touching = None)
    }

    /// Starts to search for the board below the tool.
    pub(crate) fn touch_height(&mut self, depth_um: u32, plate_um: u32) -> Result<(), Diagnostic> {
        self.may_touch()?;
        if !(1..=FURTHEST_UM).contains(&depth_um) || plate_um > THICKEST_UM {
            return Err(error!("touch.bad"));
        }
        self.begin_touching(TouchFor::Height { depth: length(depth_um), plate: length(plate_um) })
    }

    pub(crate) fn touch_edge(
        &mut self,
        (axis, up): (u8, bool),
        reach_um: u32,
        tool_um: u32,
    ) -> Result<(), Diagnostic> {
        self.may_touch()?;
        if axis > 1 || !(1..=FURTHEST_UM).contains(&reach_um) || tool_um > THICKEST_UM {
            return Err(error!("touch.bad"));
        }
        let (axis, reach, radius) = (usize::from(axis), length(reach_um), length(tool_um / 2));
        self.begin_touching(TouchFor::Edge { axis, up, reach, radius })
    }

    /// The user states that the tool touches the board here.
    pub(crate) fn height_here(&mut self) -> Result<(), Diagnostic> {
        if self.session.trust != Trust::Trusted {
            return Err(error!("control.not_homed"));
        }
        if self.session.moving {
            return Err(error!("control.busy"));
        }
        self.may_move_in_change()?;
        self.set_surface(self.position, Length::ZERO)
    }

    /// Machine steps of a point of the board, if it is within the travel.
    pub(super) fn steps_at(&self, place: Point) -> Result<[i64; 2], Diagnostic> {
        let zero = self.session.zero().ok_or_else(|| error!("preflight.no_zero"))?;
        let place = [place.x, place.y];
        let at = [0, 1].map(|axis: usize| zero[axis] + self.machine.axis(axis).scale.steps(place[axis]));
        match (0..2).find(|axis| !self.travel_steps(*axis).contains(&at[*axis])) {
            Some(axis) => Err(error!("level.no_room", axis = axis_name(axis))),
            None => Ok(at),
        }
    }

    fn travel_steps(&self, axis: usize) -> std::ops::RangeInclusive<i64> {
        let settings = self.machine.axis(axis);
        settings.scale.steps(settings.min)..=settings.scale.steps(settings.max)
    }

    fn z_steps(&self, height: Length) -> i64 {
        self.machine.z.scale.steps(self.machine.process.surface + height)
    }

    pub(crate) fn touching_begins(&mut self) {
        self.tell(self.surface_tell());
        let what = self.touching.as_ref().map(|touching| &touching.what);
        let rises = matches!(what, Some(TouchFor::Survey(_) | TouchFor::Setter));
        self.touch(if rises { TouchStep::Rise } else { TouchStep::Look });
    }

    pub(crate) fn touching_goes_on(&mut self) -> Result<(), Diagnostic> {
        let rests = self.session.state == State::Paused;
        self.try_event(if rests { Event::Queue } else { Event::Resume })
    }

    fn touch(&mut self, step: TouchStep) {
        let from = self.position;
        let Some(touching) = &mut self.touching else { return };
        (touching.step, touching.from) = (step, from);
        match self.touch_moves(step).and_then(|moves| self.in_time(moves)) {
            Ok(moves) => self.give(Doing::Touch, moves),
            Err(why) => self.fails(why, self.session.trust),
        }
    }

    fn touch_moves(&self, step: TouchStep) -> Result<Vec<Segment>, Diagnostic> {
        let Some(touching) = &self.touching else { return Ok(Vec::new()) };
        let (machine, from) = (&self.machine, self.position);
        let look = |at: Steps| rest(Stage::Dwell, Switching::Spindle { rpm: 0 }, LOOK_TICKS, at);
        let down_to = |z: i64| {
            let mut to = from;
            cycles::together(machine, 2).for_each(|axis| to[axis] = z);
            (from, to)
        };
        let touch = |ways: (Steps, Steps), otherwise: Option<Otherwise>| {
            Ok(segments(&cycles::touch(machine, ways, otherwise)?, machine))
        };
        match (step, &touching.what) {
            (TouchStep::Rise, _) => {
                let z = from[2].max(self.clear_steps());
                let mut moves = segments(&cycles::retract(machine, from, z)?, machine);
                moves.push(look(down_to(z).1));
                Ok(moves)
            }
            (TouchStep::Over, what) => {
                let [x, y] = match what {
                    TouchFor::Setter => self.setter_place(),
                    _ => self.steps_at(self.next_place())?,
                };
                let mut to = from;
                (to[0], to[1]) = (x, y);
                let mut moves = travel(machine, from, to)?;
                let settle_ticks = (machine.settle_ms * 1e-3 * TICK_HZ as f64) as u64;
                moves.push(rest(Stage::Dwell, Switching::None, settle_ticks, to));
                Ok(moves)
            }
            (TouchStep::Near, _) => touch(down_to(self.clear_steps()), Some(Otherwise::GoOn)),
            (TouchStep::Look, _) => Ok(vec![look(from)]),
            (TouchStep::Down, what) => {
                let lowest = match what {
                    TouchFor::Survey(surveying) => {
                        self.z_steps(surveying.last - surveying.depth) + self.machine.reach()
                    }
                    TouchFor::Height { depth, .. } => from[2] - machine.z.scale.steps(*depth),
                    TouchFor::Setter => from[2] - machine.z.scale.steps(machine.change.setter.depth),
                    TouchFor::Edge { .. } => from[2],
                };
                let lowest = lowest.max(*self.travel_steps(2).start());
                touch(down_to(lowest), Some(Otherwise::Alarm))
            }
            (TouchStep::Side, TouchFor::Edge { axis, up, reach, .. }) => {
                touch(self.aside(*axis, *up, *reach), Some(Otherwise::Alarm))
            }
            (TouchStep::Back, TouchFor::Edge { axis, up, .. }) => touch(self.aside(*axis, !*up, BACK), None),
            (TouchStep::Side | TouchStep::Back, _) => Ok(Vec::new()),
        }
    }

    /// From here along an axis, at most to the end of its travel.
    fn aside(&self, axis: usize, up: bool, way: Length) -> (Steps, Steps) {
        let (from, travel) = (self.position, self.travel_steps(axis));
        let way = self.machine.axis(axis).scale.steps(way);
        let mut to = from;
        to[axis] = (from[axis] + if up { way } else { -way }).clamp(*travel.start(), *travel.end());
        (from, to)
    }

    fn clear_steps(&self) -> i64 {
        if self.touching.as_ref().is_some_and(|touching| matches!(touching.what, TouchFor::Setter)) {
            return cycles::top(&self.machine);
        }
        let Some(TouchFor::Survey(surveying)) = self.touching.as_ref().map(|touching| &touching.what) else {
            return self.position[2];
        };
        let clear = surveying.highest.max(Length::ZERO) + surveying.clear;
        self.z_steps(clear.min(self.machine.process.safe_height)) + self.machine.reach()
    }

    /// The next point of the board, or the tool's position.
    fn next_place(&self) -> Point {
        let next = self.touching.as_ref().and_then(|touching| match &touching.what {
            TouchFor::Survey(surveying) => surveying.survey.next(),
            TouchFor::Height { .. } | TouchFor::Setter | TouchFor::Edge { .. } => None,
        });
        next.unwrap_or_else(|| self.place(self.position))
    }

    /// Converts machine steps to work coordinates.
    fn place(&self, at: Steps) -> Point {
        let zero = self.session.zero().unwrap_or_default();
        let [x, y] = [0, 1].map(|axis: usize| self.machine.axis(axis).scale.length(at[axis] - zero[axis]));
        Point::new(x, y)
    }

    pub(crate) fn touched(&mut self, ended: Ended, inputs: u32) {
        if self.session.state == State::Stopping {
            return self.pending.push_back(Event::Rested);
        }
        let Some(touching) = &self.touching else { return };
        let (step, from) = (touching.step, touching.from);
        let closed = inputs & Input::Contact.bit() != 0;
        match (step, ended) {
            (TouchStep::Rise | TouchStep::Look, Ended::Completed) if closed => self.closed_already(),
            (TouchStep::Rise, Ended::Completed) => self.risen(),
            // Over the setter, check first that the contact is open.
            (TouchStep::Over, Ended::Completed) if matches!(touching.what, TouchFor::Setter) => {
                self.touch(TouchStep::Look);
            }
            (TouchStep::Over, Ended::Completed) => self.touch(TouchStep::Near),
            (TouchStep::Near, Ended::Completed) => self.touch(TouchStep::Down),
            (TouchStep::Look, Ended::Completed) => {
                let aside = matches!(touching.what, TouchFor::Edge { .. });
                self.touch(if aside { TouchStep::Side } else { TouchStep::Down });
            }
            // The contact closed without a move: it was closed before.
            (TouchStep::Down | TouchStep::Side, Ended::Gated(at)) if at == from => self.closed_already(),
            (TouchStep::Down | TouchStep::Side, Ended::Gated(at)) => self.touched_at(at),
            (TouchStep::Down, Ended::Unmet(_) | Ended::Completed)
                if matches!(touching.what, TouchFor::Setter) =>
            {
                self.touch_fails(error!("control.setter_not_met"));
            }
            (TouchStep::Down, Ended::Unmet(_) | Ended::Completed) => {
                let lowest = self.machine.lowest(&self.position);
                let reached = self.machine.z.scale.length(lowest) - self.machine.process.surface;
                let why = self.placed(error!("level.no_board", ..));
                self.touch_fails(why.with("mm", mm(reached)));
            }
            (TouchStep::Side, Ended::Unmet(_) | Ended::Completed) => {
                let axis = usize::from(from[0] == self.position[0]);
                let way = self.machine.axis(axis).scale.length((self.position[axis] - from[axis]).abs());
                let why = error!("touch.no_edge", axis = axis_name(axis), mm = mm(way));
                self.touch_fails(why);
            }
            (TouchStep::Back, Ended::Completed) => self.pending.push_back(Event::QueueDone),
            _ => {
                let why = self.placed(error!("level.in_the_way", ..));
                self.touch_fails(why);
            }
        }
    }

    fn placed(&self, why: Diagnostic) -> Diagnostic {
        let place = self.next_place();
        why.with("x", mm(place.x)).with("y", mm(place.y))
    }

    fn closed_already(&mut self) {
        self.touch_fails(error!("level.contact_closed"));
    }

    /// The probing failed. Raises an alarm; in a tool change, reports it and lifts the tool instead.
    fn touch_fails(&mut self, why: Diagnostic) {
        if !self.session.in_change {
            return self.fails(why, self.session.trust);
        }
        self.touching = None;
        self.tell(Tell::Refused { why });
        if let Err(why) = self.rise_in_change() {
            self.fails(why, self.session.trust);
        }
    }

    /// The board was found with the new tool of a tool change.
    pub(crate) fn touched_in_change(&mut self) -> Result<(), Diagnostic> {
        self.touching_over(Ending::Done);
        self.rise_in_change()
    }

    /// The tool is up: hold, finish, or go to the next point.
    fn risen(&mut self) {
        if self.session.state == State::Pausing {
            return self.pending.push_back(Event::QueueHeld);
        }
        match self.touching.take() {
            Some(Touching { what: TouchFor::Survey(surveying), .. }) if surveying.survey.next().is_none() => {
                self.surveyed(surveying);
            }
            touching => {
                self.touching = touching;
                self.touch(TouchStep::Over);
            }
        }
    }

    fn touched_at(&mut self, at: Steps) {
        let height = self.machine.z.scale.length(self.machine.lowest(&at)) - self.machine.process.surface;
        let Some(touching) = &mut self.touching else { return };
        touching.found = Some(at);
        match &mut touching.what {
            TouchFor::Survey(surveying) => {
                (surveying.last, surveying.highest) = (height, surveying.highest.max(height));
                if let Err(why) = surveying.survey.touch(height) {
                    return self.fails(why, self.session.trust);
                }
                self.tell(self.surface_tell());
                self.touch(TouchStep::Rise);
            }
            TouchFor::Height { .. } | TouchFor::Setter => self.pending.push_back(Event::QueueDone),
            TouchFor::Edge { .. } => self.touch(TouchStep::Back),
        }
    }

    /// The session ended the probing, for any reason; the axes are stopped.
    pub(crate) fn touching_over(&mut self, ending: Ending) {
        let Some(Touching { what, found, .. }) = self.touching.take() else { return };
        let stopped = |code| Err(Diagnostic::error(code));
        let set = match (what, found.filter(|_| ending == Ending::Done)) {
            (TouchFor::Survey(_), _) if ending == Ending::Stopped => stopped(code!("level.stopped")),
            _ if ending == Ending::Stopped => stopped(code!("touch.stopped")),
            (TouchFor::Height { plate, .. }, Some(at)) => self.set_surface(at, plate),
            (TouchFor::Setter, Some(at)) => self.met_setter(at),
            (TouchFor::Edge { axis, up, radius, .. }, Some(at)) => {
                self.set_edge(axis, up, radius, at);
                Ok(())
            }
            _ => Ok(()),
        };
        if let Err(why) = set {
            self.tell(Tell::Refused { why });
        }
        self.tell(self.surface_tell());
    }

    /// Sets the board surface from a touch at `at`, through a plate. If a height map belongs to this board,
    /// its height at this point is subtracted, and the map moves along.
    fn set_surface(&mut self, at: Steps, plate: Length) -> Result<(), Diagnostic> {
        let height = self.machine.z.scale.length(self.machine.lowest(&at)) - plate;
        let mapped = self.map_there().map_or(Length::ZERO, |map| map.height(self.place(at)));
        self.set_height(height - mapped)
    }

    /// The height map of the current board, if it fits the work zero.
    fn map_there(&self) -> Option<HeightMap> {
        let zero = self.session.zero().map(|_| self.zero_mm());
        let lies = |kept: &&KeptSurface| {
            zero.is_some_and(|zero| kept.map.refused(&kept.map.job, zero, true).is_none())
        };
        self.surface.as_deref().filter(lies).map(|kept| kept.map.clone())
    }

    pub(super) fn set_height(&mut self, height: Length) -> Result<(), Diagnostic> {
        let map = self.map_there();
        let changes = [("stroke.surface".to_owned(), Value::Number(height.mm()))];
        let changed = machine::apply(&self.machine, &changes)
            .map_err(|refusals| refusals.into_iter().next().unwrap_or_else(|| error!("control.busy")))?;
        let rebased = self.rebased(&changed)?;
        if rebased.is_none() {
            self.try_event(Event::Disarmed { position_lost: false })?;
        }
        self.outside.keep_settings(&changed)?;
        if let Some((work, job)) = self.work.as_mut().zip(rebased) {
            work.job = Arc::new(job);
        }
        self.height_is_known();
        // The executor is not rebuilt: the simulated board does not move.
        let height = changed.process.surface;
        (self.machine, self.prepared) = (changed, None);
        self.tell(self.machine_tell());
        match map {
            Some(map) => self.keep_surface(Some(KeptSurface { map, height })),
            None => {
                self.tell(self.surface_tell());
                Ok(())
            }
        }
    }

    fn set_edge(&mut self, axis: usize, up: bool, radius: Length, at: Steps) {
        let settings = self.machine.axis(axis);
        let (radius, play) = (settings.scale.steps(radius), settings.scale.steps(settings.backlash));
        let mut place_steps = self.session.zero().unwrap_or_else(|| self.table());
        // After a move down, the motor is below the table by the backlash.
        place_steps[axis] = if up { at[axis] + radius } else { at[axis] + play - radius };
        self.pending.push_back(Event::SetZero { place_steps });
    }
}

fn mm(length: Length) -> String {
    format!("{:.3}", length.mm())
}
