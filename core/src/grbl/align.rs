//! A routine for a rotated or shifted board: every position moves with the board.

use super::routine::{Course, Routine, RoutineAction, RoutineMove, TipPlace};
use crate::align::BoardFit;
use crate::geometry::Point;
use crate::units::Length;
use sha2::{Digest, Sha256};

#[must_use]
pub fn aligned_routine(routine: &Routine, fit: &BoardFit) -> Routine {
    let plane = |[x, y]: [Length; 2]| {
        let at = fit.moved(Point::new(x, y));
        [at.x, at.y]
    };
    let place = |[x, y, z]: TipPlace| {
        let [x, y] = plane([x, y]);
        [x, y, z]
    };
    let mut moved = routine.clone();
    for section in &mut moved.sections {
        section.entry = place(section.entry);
        for action in &mut section.actions {
            let RoutineAction::Go(RoutineMove { course, to, .. }) = action else { continue };
            *to = place(*to);
            if let Course::Arc { centre, .. } = course {
                *centre = plane(*centre);
            }
        }
    }
    let numbers = [fit.turn_rad, fit.shift_mm[0], fit.shift_mm[1]];
    let mut digest = Sha256::new();
    digest.update(routine.key.as_bytes());
    numbers.iter().for_each(|number| digest.update(number.to_bits().to_le_bytes()));
    moved.key = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    moved
}
