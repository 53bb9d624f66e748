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

use super::job::Job;
use super::known::Known;
use super::routine::{Course, Routine, RoutineAction, RoutineMove, Section, SectionKind, TipPlace};
use crate::diagnostic::Diagnostic;
use crate::units::Length;
use crate::{error, warning};
use std::sync::Arc;

/// Height of the tool changes of `routine`; `None` if it has none.
fn change_height(routine: &Routine) -> Option<Length> {
    let changes = routine.sections.iter().filter(|section| matches!(section.kind, SectionKind::Change(_)));
    changes.map(|section| section.entry[2]).max()
}

/// Height that the tip must reach between cuts, regardless of the change height.
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

/// Height of the first lift after a section's last cut.
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

/// A routine with `most` of room above its zero.
#[derive(Debug, PartialEq)]
enum Fit {
    Whole,
    /// Tool changes are lowered from this height.
    Lower(Box<Routine>, Length),
    /// The tip must reach this height between cuts, and can't.
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

/// Drops rapids that lead nowhere once their height is limited.
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

impl Known {
    /// Largest tip height above the work zero: where homing leaves Z. `None` if Z was not homed.
    fn most_height(&self) -> Option<Length> {
        let top = self.room_mm(2)?[1];
        // Rounded down: the axis must not reach its end. 1e-6 absorbs the error of the subtraction.
        let um = libm::floor((top - self.zero_mm?[2]) * 1e3 + 1e-6);
        Some(Length::from_um(um as i64))
    }

    /// Lowers the tool changes to the available room, with a warning.
    pub(super) fn fitted(&self, routine: &Arc<Routine>) -> (Arc<Routine>, Option<Diagnostic>) {
        match self.most_height().map(|most| (most, fit(routine, most))) {
            Some((most, Fit::Lower(lower, change))) => {
                let told = warning!("grbl.change_lower", wanted = change.mm(), ..);
                (Arc::new(*lower), Some(told.with("height", most.mm())))
            }
            _ => (Arc::clone(routine), None),
        }
    }

    /// Problem if the tool in the spindle is too long: its tip doesn't clear the board.
    pub(super) fn no_room(&self, job: &Job) -> Option<Diagnostic> {
        let most = self.most_height()?;
        let Fit::TooHigh(needed) = fit(job.whole(), most) else { return None };
        let why = error!("grbl.no_room_above", needed = needed.mm(), ..);
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

#[cfg(test)]
mod tests {
    use super::super::gcode::read;
    use super::*;

    const HEAD: &str = "G21 G90 G94\nM5\nG0 Z20\nG0 X0 Y0\n(MSG, one)\nM0\nM3 S1\n";

    fn routine(text: &str) -> Routine {
        read("a", &[("a.nc".to_owned(), format!("{HEAD}{text}M5\nG0 Z20\nG0 X0 Y0\nM2\n"))]).unwrap()
    }

    fn highest(routine: &Routine) -> f64 {
        routine.reach().unwrap()[1][2].mm()
    }

    #[test]
    fn change_height_is_limited_by_travel_and_cuts() {
        let hole = "G0 X5 Y5\nG0 Z0.5\nG1 Z-1.8 F100\nG0 Z2\n";
        let far = format!("{hole}G0 X9 Y9\nG0 Z0.5\nG1 Z-1.8\nG0 Z2\n");
        let over_clamps = format!("{hole}G0 Z15\nG0 X9 Y9\nG0 Z0.5\nG1 Z-1.8\nG0 Z2\n");
        for (text, most, expected) in [
            (hole, 25.0, Some(20.0)),
            (hole, 20.0, Some(20.0)),
            (hole, 19.0, Some(19.0)),
            (hole, 2.0, Some(2.0)),
            (hole, 1.9, None),
            (&far, 3.5, Some(3.5)),
            (&over_clamps, 15.0, Some(15.0)),
            (&over_clamps, 14.9, None),
        ] {
            let before = routine(text);
            let found = match fit(&before, Length::from_mm(most)) {
                Fit::Whole => Some(highest(&before)),
                Fit::Lower(lower, from) => {
                    assert_eq!(from, Length::from_mm(20.0));
                    assert_eq!(lower.sections.len(), before.sections.len());
                    assert_eq!((lower.cuts(), &lower.key), (before.cuts(), &before.key));
                    assert!(lower.safe.mm() <= most);
                    Some(highest(&lower))
                }
                Fit::TooHigh(_) => None,
            };
            assert_eq!(found, expected, "{text} {most}");
        }
    }

    #[test]
    fn program_without_changes_is_unchanged() {
        let text = "G21 G90 G94\nM3 S1\nG0 Z30\nG0 X5 Y5\nG1 Z-1 F100\nG0 Z30\nM2\n";
        let routine = read("a", &[("a.nc".to_owned(), text.to_owned())]).unwrap();
        assert_eq!(fit(&routine, Length::from_mm(5.0)), Fit::Whole);
    }
}
