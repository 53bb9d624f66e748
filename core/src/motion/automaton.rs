//! The integer automaton that steps a motor, interrupt by interrupt.
//!
//! ```text
//! interrupts  . . . . . . . . . . . . . . . . . . . . . . . . .
//! steps                   |       |   | | | | | |   |       |             |
//! state      0            1       2   3 …         2    1        0              at rest
//!              period[0]     [1]   [2]  [3]     [2]   [1]           [0]
//! ```
//!
//! After every step the state may change by one, up or down, depending on the remaining distance
//! ([`next_state`]). The target may change at any time; if necessary, the motor brakes, reverses and returns.
//! With a table that [`check`] accepts, every move ends exactly at its target, in state 0.
//!
//! Source: R. Arendt's laboratory drill; `docs/motion-profiles.md` A.4 and A.5.

use crate::code;
use crate::diagnostic::Diagnostic;
use crate::machine::Dynamics;
use crate::machine::dynamics::{period, top};
use serde::{Deserialize, Serialize};

pub use crate::machine::dynamics::{FARTHEST, MOST_STATES, SLOWEST, check, next_state, state_within};

/// One step: the motor gets the next column of its phase table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableStep {
    pub position: i64,
    /// True if the axis counts up.
    pub forward: bool,
    /// State after the step, −S … S.
    pub state: i32,
}

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
    /// At rest at `position`, which is also its target.
    pub fn new(dynamics: Dynamics, position: i64) -> Self {
        Self { dynamics, position, target: position, state: 0, count: 0 }
    }

    pub fn position(&self) -> i64 {
        self.position
    }

    pub fn target(&self) -> i64 {
        self.target
    }

    /// Speed state: 0 at rest, S at full speed, negative while counting down.
    pub fn state(&self) -> i32 {
        self.state
    }

    pub fn is_at_rest(&self) -> bool {
        self.state == 0 && self.position == self.target
    }

    /// Sets another target, effective from the next interrupt on; nothing else is reset.
    pub fn retarget(&mut self, target: i64) {
        self.target = target;
    }

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

/// Consecutive steps at one interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SteadyStretch {
    /// Interrupts before each step, counted from the previous step, or from the command.
    pub interval: u32,
    pub count: u64,
}

/// Steps of a move over `distance` steps from rest, in either direction. Few stretches for any distance,
/// because the middle with its constant state is one. Fails if the table would overshoot, or has no states.
pub fn stretches(dynamics: &Dynamics, distance: u64) -> Result<Vec<SteadyStretch>, Diagnostic> {
    let refuse = |code: &str| Diagnostic::error(code).with("distance", distance).with("state", 0);
    if dynamics.period.is_empty() {
        return Err(refuse(code!("automaton.lengths")).with("states", 0).with("enter", 0).with("leave", 0));
    }
    let mut out: Vec<SteadyStretch> = Vec::new();
    let (mut state, mut left) = (0, i64::try_from(distance).unwrap_or(i64::MAX));
    while left > 0 {
        let interval = period(dynamics, state);
        let after = next_state(dynamics, state, left - 1);
        // A state that doesn't change now stays until its leave distance: it can't rise later, because the
        // remaining distance only shrinks.
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
        Err(refuse(code!("automaton.overshoots")).with("speed", state).with("by", state))
    }
}

/// Interrupts of all steps of a move from rest. For long moves, use [`stretches`].
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

/// Duration in interrupts of a move from rest. Fast for any distance, because it doesn't visit steps.
pub fn total(dynamics: &Dynamics, distance: u64) -> Result<u64, Diagnostic> {
    let stretches = stretches(dynamics, distance)?;
    let times = stretches.iter().map(|stretch| u64::from(stretch.interval).saturating_mul(stretch.count));
    Ok(times.fold(0, u64::saturating_add))
}

/// The table limited to states up to `state`, for a lower speed. If [`check`] accepts a table, it accepts the
/// result.
pub fn capped(dynamics: &Dynamics, state: usize) -> Dynamics {
    let top = top(dynamics).min(state);
    Dynamics {
        period: dynamics.period.iter().take(top + 1).copied().collect(),
        enter: dynamics.enter.iter().take(top).copied().collect(),
        leave: dynamics.leave.iter().take(top).copied().collect(),
    }
}
