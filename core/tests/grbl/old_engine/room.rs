//! Height of tool changes: as programmed, or lower if Z has less room below its limit switch.
//!
//! ```text
//!   ─── switch ───          zero at −20, pull-off 1:  19 mm of room
//!   ─ pull-off ───  most    program changes at 20:    change at 19, with a warning
//!   ─── change ───          most below the height between cuts: refused, the tool can't be changed
//!   ─── cuts ─────  needed
//! ```
//!
//! Each tool has its own Z zero, so the room is computed again at every zero.

use super::ends::Ends;
use super::engine::Controller;
use super::routine::{Course, Routine, RoutineAction, RoutineMove, Section, SectionKind, TipPlace};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::units::Length;
use std::sync::Arc;

fn change_height(routine: &Routine) -> Option<Length> {
    let changes = routine.sections.iter().filter(|section| matches!(section.kind, SectionKind::Change(_)));
    changes.map(|section| section.entry[2]).max()
}

fn needed(routine: &Routine, change: Length) -> Length {
    let mut at = None;
    let mut needed = Length::ZERO;
    for section in &routine.sections {
        for action in &section.actions {
            let RoutineAction::Go(step) = action else { continue };
            let before: Option<TipPlace> = at.replace(step.to);
            let in_plane = before.is_some_and(|from| from[..2] != step.to[..2]);
            if in_plane && step.course == Course::Rapid && step.to[2] < change {
                needed = needed.max(step.to[2]);
            }
        }
        if section.cuts() {
            needed = needed.max(retract_height(section));
        }
    }
    needed
}

fn retract_height(section: &Section) -> Length {
    let moves = section.actions.iter().filter_map(|action| match action {
        RoutineAction::Go(step) => Some(step),
        _ => None,
    });
    let mut lifted = None;
    for step in moves {
        match step.course {
            Course::Rapid if step.to[2] > Length::ZERO => lifted = lifted.or(Some(step.to[2])),
            Course::Rapid => {}
            Course::Line | Course::Arc { .. } => lifted = None,
        }
    }
    lifted.unwrap_or(section.entry[2])
}

#[derive(Debug, PartialEq)]
enum Fit {
    Whole,
    Lower(Box<Routine>, Length),
    TooHigh(Length),
}

fn fit(routine: &Routine, most: Length) -> Fit {
    let Some(change) = change_height(routine) else { return Fit::Whole };
    let needed = needed(routine, change);
    match () {
        () if needed > most => Fit::TooHigh(needed),
        () if change <= most => Fit::Whole,
        () => Fit::Lower(Box::new(lowered(routine, (most, change))), change),
    }
}

fn lowered(routine: &Routine, (most, change): (Length, Length)) -> Routine {
    let bounded = |height: Length| if height <= change { height.min(most) } else { height };
    let mut at = None;
    let sections = routine.sections.iter().map(|section| lowered_section(section, &bounded, &mut at));
    Routine { sections: sections.collect(), safe: bounded(routine.safe), ..routine.clone() }
}

fn lowered_section(
    section: &Section,
    bounded: &dyn Fn(Length) -> Length,
    at: &mut Option<TipPlace>,
) -> Section {
    let (mut actions, mut approach) = (Vec::with_capacity(section.actions.len()), 0);
    for (index, action) in section.actions.iter().enumerate() {
        if index == section.approach {
            approach = actions.len();
        }
        let RoutineAction::Go(step) = action else {
            actions.push(*action);
            continue;
        };
        let [x, y, z] = step.to;
        let to = if step.course == Course::Rapid { [x, y, bounded(z)] } else { step.to };
        if at.replace(to) != Some(to) || step.course != Course::Rapid {
            actions.push(RoutineAction::Go(RoutineMove { to, ..*step }));
        }
    }
    if section.approach >= section.actions.len() {
        approach = actions.len();
    }
    let [x, y, z] = section.entry;
    Section { entry: [x, y, bounded(z)], approach, actions, ..section.clone() }
}

impl Controller {
    /// Largest tip height above the work zero: where homing leaves Z. `None` if Z was not homed.
    fn most_height(&self) -> Option<Length> {
        let top = self.room_mm(2)?[1];
        let um = libm::floor((top - self.zero_mm?[2]) * 1e3 + 1e-6);
        Some(Length::from_um(um as i64))
    }

    pub(super) fn fitted(&self, routine: &Arc<Routine>) -> (Arc<Routine>, Option<Diagnostic>) {
        match self.most_height().map(|most| (most, fit(routine, most))) {
            Some((most, Fit::Lower(lower, change))) => {
                let told = Diagnostic::warning("grbl.change_lower").with("wanted", change.mm());
                (Arc::new(*lower), Some(told.with("height", most.mm())))
            }
            _ => (Arc::clone(routine), None),
        }
    }

    pub(super) fn fit_run(&mut self) {
        let Some(run) = &self.run else { return };
        let (routine, _) = self.fitted(run.whole());
        if let Some(run) = &mut self.run {
            run.take_routine(routine);
        }
    }

    /// Problem if the tool in the spindle is too long: its tip doesn't clear the board.
    pub(super) fn no_room(&self) -> Option<Diagnostic> {
        let (run, most) = self.run.as_ref().zip(self.most_height())?;
        let Fit::TooHigh(needed) = fit(run.whole(), most) else { return None };
        let why = Diagnostic::error("grbl.no_room_above").with("needed", needed.mm());
        Some(why.with("room", most.mm()))
    }

    /// Range of an axis for a job. With hard limits, the switch that the axis homed to is excluded.
    pub(super) fn reach_mm(&self, axis: usize) -> Option<[f64; 2]> {
        let ([low, high], room) = (self.ends_mm(axis)?, self.room_mm(axis)?);
        if !super::settings::on(&self.info.values, 21) {
            return Some([low, high]);
        }
        Some(if self.info.homes_low(axis) { [room[0], high] } else { [low, room[1]] })
    }
}
