//! The integer automaton that steps a motor, interrupt by interrupt.
//!
//! ```text
//! interrupts  . . . . . . . . . . . . . . . . . . . . . . . . .
//! steps                   |       |   | | | | | |   |       |             |
//! state      0            1       2   3 …         2    1        0              at rest
//!              period[0]     [1]   [2]  [3]     [2]   [1]           [0]
//! ```
//!
//! After every step the state may go one up or one down, by what distance is left ([`next_state`]). A new target may be given
//! at any time; the motor brakes, turns round and comes back where that is needed. A table that
//! [`check`] accepts ends every move exactly at its target, in state 0.
//!
//! Comes in: a table, targets in steps, interrupts. Goes out: steps, with the numbers of their interrupts counted from the
//! command, which is given before interrupt 1. Source: R. Arendt's laboratory drill; `docs/motion-profiles.md` A.4 and A.5. Does not know
//! frequencies or lengths.

use crate::diagnostic::Diagnostic;
use crate::machine::Dynamics;
use crate::machine::dynamics::{period, top};
use serde::{Deserialize, Serialize};

pub use crate::machine::dynamics::{FARTHEST, MOST_STATES, SLOWEST, check, next_state, state_within};

/// One step: the motor is given the next column of its phase table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableStep {
    /// Position after it, in steps.
    pub position: i64,
    /// Whether the axis counts up.
    pub forward: bool,
    /// State after it, −S … S.
    pub state: i32,
}

/// One axis in motion.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Automaton {
    dynamics: Dynamics,
    position: i64,
    target: i64,
    state: i32,
    /// Interrupts since the last step, or since the command at rest.
    count: u32,
}

impl Automaton {
    /// At rest at `position`, which is its target.
    pub fn new(dynamics: Dynamics, position: i64) -> Self {
        Self { dynamics, position, target: position, state: 0, count: 0 }
    }

    /// Where it is, in steps.
    pub fn position(&self) -> i64 {
        self.position
    }

    /// Where it goes, in steps.
    pub fn target(&self) -> i64 {
        self.target
    }

    /// How fast: 0 at rest, S at full speed, negative when counting down.
    pub fn state(&self) -> i32 {
        self.state
    }

    /// Whether it rests at its target.
    pub fn is_at_rest(&self) -> bool {
        self.state == 0 && self.position == self.target
    }

    /// Sets another target. It counts from the next interrupt on; nothing else is reset.
    pub fn retarget(&mut self, target: i64) {
        self.target = target;
    }

    /// Serves one interrupt.
    pub fn interrupt(&mut self) -> Option<TableStep> {
        if self.is_at_rest() {
            self.count = 0;
            return None;
        }
        self.count += 1;
        if self.count < period(&self.dynamics, self.state) {
            return None;
        }
        self.count = 0;
        let distance = self.target.saturating_sub(self.position);
        let way = if self.state != 0 { i64::from(self.state.signum()) } else { distance.signum() };
        self.position = self.position.saturating_add(way);
        let left = self.target.saturating_sub(self.position);
        self.state = next_state(&self.dynamics, self.state, left);
        Some(TableStep { position: self.position, forward: way > 0, state: self.state })
    }
}

/// So many steps in a row at the same interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SteadyStretch {
    /// Interrupts before each step, counted from the step before it, or from the command.
    pub interval: u32,
    /// How many steps.
    pub count: u64,
}

/// The steps of a move of `distance` steps from rest, either way. A handful of stretches for any distance: the middle, where
/// the state stays, is one of them. Refused when the table would run over the target, or has no states.
pub fn stretches(dynamics: &Dynamics, distance: u64) -> Result<Vec<SteadyStretch>, Diagnostic> {
    let refuse = |code: &str| Diagnostic::error(code).with("distance", distance).with("state", 0);
    if dynamics.period.is_empty() {
        return Err(refuse("automaton.lengths").with("states", 0).with("enter", 0).with("leave", 0));
    }
    let mut out: Vec<SteadyStretch> = Vec::new();
    let (mut state, mut left) = (0, i64::try_from(distance).unwrap_or(i64::MAX));
    while left > 0 {
        let interval = period(dynamics, state);
        let after = next_state(dynamics, state, left - 1);
        // A state that does not change now stays until the distance at which it is left: it cannot rise any more, since
        // what is left only shrinks.
        let leave = usize::try_from(state - 1).ok().and_then(|row| dynamics.leave.get(row));
        let steps = if after == state { left - leave.map_or(0, |leave| i64::from(*leave)) } else { 1 };
        left -= steps;
        state = after;
        match out.last_mut() {
            Some(last) if last.interval == interval => last.count += steps as u64,
            _ => out.push(SteadyStretch { interval, count: steps as u64 }),
        }
    }
    if state == 0 {
        Ok(out)
    } else {
        Err(refuse("automaton.overshoots").with("speed", state).with("by", state))
    }
}

/// The interrupts of all steps of a move from rest. See [`stretches`] for long moves.
pub fn steps(dynamics: &Dynamics, distance: u64) -> Result<impl Iterator<Item = u64>, Diagnostic> {
    let mut now = 0;
    let stretches = stretches(dynamics, distance)?;
    let intervals =
        stretches.into_iter().flat_map(|stretch| (0..stretch.count).map(move |_| stretch.interval));
    Ok(intervals.map(move |interval| {
        now += u64::from(interval);
        now
    }))
}

/// How many interrupts a move from rest takes. Without steps: quick for any distance.
pub fn total(dynamics: &Dynamics, distance: u64) -> Result<u64, Diagnostic> {
    let stretches = stretches(dynamics, distance)?;
    let times = stretches.iter().map(|stretch| u64::from(stretch.interval).saturating_mul(stretch.count));
    Ok(times.fold(0, u64::saturating_add))
}

/// The same table without the states above `state`: it never goes faster. A table that [`check`] accepts stays accepted.
pub fn capped(dynamics: &Dynamics, state: usize) -> Dynamics {
    let top = top(dynamics).min(state);
    Dynamics {
        period: dynamics.period.iter().take(top + 1).copied().collect(),
        enter: dynamics.enter.iter().take(top).copied().collect(),
        leave: dynamics.leave.iter().take(top).copied().collect(),
    }
}
