//! How long a job takes, section by section.

use super::lines::{WireLine, WordsInForce};
use super::routine::{Routine, SectionKind};
use super::settings::Values;
use super::timing::{Clockwork, PlannerLimits};

pub(super) fn time_s(limits: PlannerLimits, lines: &[WireLine]) -> f64 {
    let mut clock = Clockwork::new(limits);
    for line in lines {
        match &line.piece {
            Some(piece) => clock.go(piece),
            None => clock.rest(wait_of(&line.text)),
        }
    }
    clock.rest(0.0);
    clock.spent_s()
}

pub(super) fn wait_of(text: &str) -> f64 {
    text.strip_prefix("G4P").and_then(|wait| wait.parse().ok()).unwrap_or(0.0)
}

/// Duration from section `from` on, s, starting at `at_mm` in work coordinates. Includes position checks,
/// excludes tool changes. `None` if the settings are incomplete.
pub fn estimate_s(
    routine: &Routine,
    values: &Values,
    blocks: usize,
    from: usize,
    at_mm: [f64; 3],
) -> Option<f64> {
    Some(estimates_s(routine, values, blocks, from, at_mm)?.into_iter().sum())
}

/// As [`estimate_s`], for each section.
pub fn estimates_s(
    routine: &Routine,
    values: &Values,
    blocks: usize,
    from: usize,
    at_mm: [f64; 3],
) -> Option<Vec<f64>> {
    /// Duration of a position check: modal words, their answers, the query and its report.
    const LOOK_S: f64 = 0.07;
    let limits = PlannerLimits::of(values, blocks)?;
    let mut pen = WordsInForce::standing(at_mm);
    let mut each_s = Vec::new();
    for (index, section) in routine.sections.iter().enumerate().skip(from) {
        let fresh = index == from || matches!(routine.sections[index - 1].kind, SectionKind::Change(_));
        let lines: Vec<WireLine> = if fresh {
            let up = pen.rise(section, routine.safe);
            up.into_iter().chain(pen.over(section, routine.safe, 0.0)).collect()
        } else {
            section.actions.iter().take(section.approach).flat_map(|action| pen.act(action)).collect()
        };
        let work = section.actions.iter().skip(section.approach).flat_map(|action| pen.act(action));
        let lines: Vec<WireLine> = lines.into_iter().chain(work).collect();
        each_s.push(time_s(limits.clone(), &lines) + LOOK_S);
    }
    Some(each_s)
}
