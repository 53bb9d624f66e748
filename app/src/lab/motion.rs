//! Dynamics as typed and as numbers, and the curves that the Lab plots. The core checks the tables.
//!
//! ```text
//! rows of text ─▶ Dynamics ─ core ─▶ steps ─▶ rate over time
//! limits ─ core ─▶ Profile ─▶ s, v, a, j over time, jumps vertical
//! ```

use crate::format::typed_whole;
use annulus_core::machine::Dynamics;
use annulus_core::motion::profile::Profile;
use annulus_core::steps::automaton::{Automaton, TableStep};
use serde::{Deserialize, Serialize};

/// A row of the dynamics table as typed. State 0 has no enter and leave distance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StateRow {
    /// Interrupts per step.
    pub period: String,
    /// Entered above this distance, steps.
    pub enter: String,
    /// Left below this distance, steps.
    pub leave: String,
}

/// A longer move isn't shown step by step.
pub const MOST_STEPS: u64 = 20_000;

const POINTS: usize = 32;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Column {
    Period,
    Enter,
    Leave,
}

/// The table as rows of text, state 0 first.
pub fn rows(dynamics: &Dynamics) -> Vec<StateRow> {
    let text = |list: &[u32], at: Option<usize>| {
        at.and_then(|at| list.get(at)).map(u32::to_string).unwrap_or_default()
    };
    let row = |state: usize| StateRow {
        period: text(&dynamics.period, Some(state)),
        enter: text(&dynamics.enter, state.checked_sub(1)),
        leave: text(&dynamics.leave, state.checked_sub(1)),
    };
    (0..dynamics.period.len()).map(row).collect()
}

/// The number of a cell.
pub fn count(text: &str) -> Option<u32> {
    typed_whole(text, (0, u32::MAX))
}

/// Parses the rows; fails with the cells that aren't whole numbers.
pub fn dynamics(rows: &[StateRow]) -> Result<Dynamics, Vec<(usize, Column)>> {
    let mut table = Dynamics { period: Vec::new(), enter: Vec::new(), leave: Vec::new() };
    let mut wrong = Vec::new();
    for (state, row) in rows.iter().enumerate() {
        let mut read = |text: &str, column: Column| {
            let number = count(text);
            if number.is_none() {
                wrong.push((state, column));
            }
            number.unwrap_or_default()
        };
        table.period.push(read(&row.period, Column::Period));
        if state > 0 {
            table.enter.push(read(&row.enter, Column::Enter));
            table.leave.push(read(&row.leave, Column::Leave));
        }
    }
    if wrong.is_empty() { Ok(table) } else { Err(wrong) }
}

pub fn with_cell(rows: &[StateRow], state: usize, column: Column, text: String) -> Vec<StateRow> {
    let mut next = rows.to_vec();
    if let Some(row) = next.get_mut(state) {
        *match column {
            Column::Period => &mut row.period,
            Column::Enter => &mut row.enter,
            Column::Leave => &mut row.leave,
        } = text;
    }
    next
}

/// Adds a state as fast as the last one, entered one step later and left two steps earlier.
pub fn with_state(rows: &[StateRow]) -> Vec<StateRow> {
    let mut next = rows.to_vec();
    let further =
        |text: &str, by: u32| count(text).map_or(by, |number| number.saturating_add(by)).to_string();
    let last = rows.last().cloned().unwrap_or_default();
    let period = if last.period.is_empty() { "1".to_owned() } else { last.period };
    next.push(StateRow { period, enter: further(&last.enter, 1), leave: further(&last.leave, 2) });
    next
}

/// Removes the fastest state, unless it is the only one.
pub fn without_state(rows: &[StateRow]) -> Vec<StateRow> {
    rows[..rows.len().saturating_sub(1).max(1).min(rows.len())].to_vec()
}

/// The interrupt of a step, counted from the command, and the step.
pub type Numbered = (u64, TableStep);

/// Every step of a move of `distance` steps from standstill. Empty if longer than [`MOST_STEPS`]; cut off if
/// the table never stops.
pub fn steps(dynamics: &Dynamics, distance: i64) -> Vec<Numbered> {
    let count = distance.unsigned_abs();
    if count > MOST_STEPS || dynamics.period.is_empty() {
        return Vec::new();
    }
    let mut axis = Automaton::new(dynamics.clone(), 0);
    axis.retarget(distance);
    let mut found = Vec::new();
    let most = 4 * count + 64;
    let mut interrupt = 0;
    while !axis.is_at_rest() && (found.len() as u64) < most {
        interrupt += 1;
        found.extend(axis.interrupt().map(|step| (interrupt, step)));
    }
    found
}

/// Steps per second over time; each rate holds from the previous step on.
pub fn rates(steps: &[Numbered], interrupt_hz: f64) -> Vec<[f64; 2]> {
    let mut points = Vec::with_capacity(steps.len() + 1);
    let mut before = 0;
    for (interrupt, _) in steps {
        points.push([before as f64 / interrupt_hz, interrupt_hz / (interrupt - before).max(1) as f64]);
        before = *interrupt;
    }
    points.extend(points.last().map(|_| [before as f64 / interrupt_hz, 0.0]));
    points
}

pub fn states(steps: &[Numbered], interrupt_hz: f64) -> Vec<[f64; 2]> {
    let points = steps.iter().map(|(at, step)| [*at as f64 / interrupt_hz, f64::from(step.state)]);
    std::iter::once([0.0, 0.0]).chain(points).collect()
}

/// A quantity of `profile` over ms, sampled per phase, so that jumps are vertical.
pub fn curve(profile: &Profile, value: impl Fn(&Profile, f64) -> f64) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    let mut start = 0.0;
    for length in profile.phases().into_iter().filter(|length| *length > 0.0) {
        // Slightly inside the phase, so that each side of a jump has its own value.
        let hair = 1e-9 * length;
        for k in 0..POINTS {
            let share = k as f64 / (POINTS - 1) as f64;
            let inside = (share * length).clamp(hair, length - hair);
            points.push([1000.0 * (start + share * length), value(profile, start + inside)]);
        }
        start += length;
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::motion::profile::{Limits, MotionLaw, plan};

    #[test]
    fn dynamics_rows_and_table_convert_both_ways() {
        let table = Dynamics::arendt();
        assert_eq!(dynamics(&rows(&table)), Ok(table.clone()));
        let wrong = with_cell(&rows(&table), 2, Column::Leave, "three".into());
        assert_eq!(dynamics(&wrong), Err(vec![(2, Column::Leave)]));
        assert_eq!(without_state(&with_state(&rows(&table))), rows(&table));
        let more = dynamics(&with_state(&rows(&table))).unwrap();
        assert_eq!(
            (more.period, more.enter, more.leave),
            (vec![7, 4, 2, 1, 1], vec![1, 2, 3, 4], vec![2, 3, 5, 7])
        );
        let mut few = rows(&table);
        for _ in 0..9 {
            few = without_state(&few);
        }
        assert_eq!(few.len(), 1);
        assert_eq!(without_state(&[]), []);
        assert_eq!(dynamics(&with_state(&[])).unwrap().period, [1]);
    }

    #[test]
    fn step_times_match_the_papers_table() {
        let table = Dynamics::arendt();
        let at = |distance| steps(&table, distance).iter().map(|(at, _)| *at).collect::<Vec<_>>();
        assert_eq!(at(5), [7, 11, 13, 17, 24]);
        assert_eq!(at(-5), [7, 11, 13, 17, 24]);
        assert!(at(0).is_empty());
        assert_eq!(at(100).last(), Some(&121));
        assert!(at(i64::MIN).is_empty());
        let rates = rates(&steps(&table, 5), 500.0);
        assert_eq!((rates[0], rates[2]), ([0.0, 500.0 / 7.0], [11.0 / 500.0, 250.0]));
        assert_eq!(rates.last(), Some(&[24.0 / 500.0, 0.0]));
        let states: Vec<f64> = states(&steps(&table, 5), 500.0).iter().map(|point| point[1]).collect();
        assert_eq!(states, [0.0, 1.0, 2.0, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn endless_dynamics_table_is_cut_off() {
        let endless = Dynamics { period: vec![1, 1], enter: vec![0], leave: vec![0] };
        assert!(steps(&endless, 10).len() <= 104);
    }

    #[test]
    fn curves_include_their_jumps() {
        let limits = Limits { speed_mm_per_s: 100.0, acceleration_mm_per_s2: 1000.0, jerk_mm_per_s3: 1e5 };
        let profile = plan(MotionLaw::Linear, 50.0, limits).unwrap();
        let a = curve(&profile, Profile::acceleration);
        assert_eq!((a.first().unwrap()[1], a.last().unwrap()[1]), (1000.0, -1000.0));
        let s = curve(&profile, Profile::position_mm);
        assert!((s.last().unwrap()[1] - 50.0).abs() < 1e-6 && s.windows(2).all(|two| two[0][0] <= two[1][0]));
    }
}
