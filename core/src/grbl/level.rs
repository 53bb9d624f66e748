//! Makes the depth of a routine follow the board's surface, for our programs and foreign G-code.
//!
//! A levelled routine is marked and is not levelled twice. Lengths in whole nanometres.

use super::routine::{Course, Routine, RoutineAction, RoutineMove, Section, SectionKind, TipPlace};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::{Bounds, Point};
use crate::level::{Correction, FollowedCourse, Follower, HeightMap, job_key};
use crate::units::Length;

/// The routine follows the surface of `map` within `tolerance`; also returns the corrections made.
pub fn level_routine(
    routine: &Routine,
    map: &HeightMap,
    tolerance: Length,
) -> Result<(Routine, Correction), Diagnostic> {
    if routine.levelled.is_some() {
        return Err(error!("level.twice"));
    }
    let mut follower = Follower::new(map, routine.safe, tolerance)?;
    let mut at: TipPlace = [Length::ZERO, Length::ZERO, routine.safe];
    let mut sections = Vec::with_capacity(routine.sections.len());
    for section in &routine.sections {
        sections.push(followed(section, &mut follower, &mut at)?);
    }
    let levelled = Routine { sections, levelled: Some(map.key()), ..routine.clone() };
    Ok((levelled, follower.correction()))
}

fn followed(
    section: &Section,
    follower: &mut Follower<'_>,
    at: &mut TipPlace,
) -> Result<Section, Diagnostic> {
    let (mut actions, mut approach) = (Vec::with_capacity(section.actions.len()), 0);
    for (index, action) in section.actions.iter().enumerate() {
        if index == section.approach {
            (approach, *at) = (actions.len(), section.entry);
        }
        let RoutineAction::Go(step) = action else {
            actions.push(*action);
            continue;
        };
        let ends = pieces(follower, *at, step)?;
        actions.extend(ends.into_iter().map(|to| RoutineAction::Go(RoutineMove { to, ..*step })));
        *at = step.to;
    }
    if section.approach >= section.actions.len() {
        (approach, *at) = (actions.len(), section.entry);
    }
    let [x, y, z] = section.entry;
    let entry = [x, y, follower.height(Point::new(x, y), z)?];
    Ok(Section { entry, approach, actions, ..section.clone() })
}

fn pieces(
    follower: &mut Follower<'_>,
    at: TipPlace,
    step: &RoutineMove,
) -> Result<Vec<TipPlace>, Diagnostic> {
    let course = match step.course {
        Course::Rapid | Course::Line => FollowedCourse::Line,
        Course::Arc { centre: [x, y], ccw } => FollowedCourse::Arc { centre: Point::new(x, y), ccw },
    };
    let place = |[x, y, z]: TipPlace| (Point::new(x, y), z);
    let ends = follower.pieces(place(at), place(step.to), course)?;
    Ok(ends.into_iter().map(|(to, height)| [to.x, to.y, height]).collect())
}

/// Key of a height map: [`job_key`] of the routine's name and of where it cuts.
pub fn level_key(routine: &Routine) -> String {
    let plane = |[x, y, _]: TipPlace| Point::new(x, y);
    let (mut holes, mut toolpaths) = (Vec::new(), Vec::new());
    for section in &routine.sections {
        match section.kind {
            SectionKind::Hole(_) => holes.push(plane(section.entry)),
            SectionKind::Toolpath(_) => {
                let work = section.actions.iter().skip(section.approach);
                let steps = work.filter_map(|action| match action {
                    RoutineAction::Go(step) => Some(plane(step.to)),
                    _ => None,
                });
                toolpaths.extend(steps);
            }
            SectionKind::Change(_) | SectionKind::Finish => {}
        }
    }
    job_key(&routine.name, Point::default(), holes, toolpaths)
}

/// Bounds of all positions below the work zero; `None` if there are none.
pub fn cut_bounds(routine: &Routine) -> Option<Bounds> {
    let mut bounds: Option<Bounds> = None;
    let mut add = |[x, y, _]: TipPlace| {
        let place = Point::new(x, y);
        bounds = Some(bounds.map_or(Bounds::of(place), |all| all.with(place)));
    };
    for section in &routine.sections {
        let mut at = section.entry;
        for action in section.actions.iter().skip(section.approach) {
            let RoutineAction::Go(step) = action else { continue };
            if at[2].min(step.to[2]) < Length::ZERO {
                add(at);
                add(step.to);
                if let Course::Arc { centre, ccw } = step.course {
                    super::routine::furthest(at, step.to, centre, ccw).into_iter().for_each(&mut add);
                }
            }
            at = step.to;
        }
    }
    bounds
}
