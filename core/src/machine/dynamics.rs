//! The rule of the table of dynamics, and the proof that a table may drive an axis.
//!
//! ```text
//! distance d ──▶  … 6   5   4   3   2   1   0     remaining distance after the current step
//! state k         may be entered from k − 1 while d > enter[k]
//!                 must be left to k − 1 if d < leave[k]      (checked first)
//! ```
//!
//! [`check`] runs the table instead of analysing its numbers. A situation is a state and a distance, and has
//! exactly one successor. Beyond the largest threshold, all distances behave alike: the state rises, or stays
//! at the top. A motor that moves away from its target slows down by one state per step. So a finite window
//! of distances contains every possible course, from rest and after a change of target at any time. The check
//! follows each situation of the window once.
//!
//! Distances in steps, times in interrupts. Source: R. Arendt's laboratory drill; `docs/motion-profiles.md`
//! A.3 to A.6.

use super::Dynamics;
use crate::diagnostic::Diagnostic;
use crate::{code, warning};

/// Most states per direction, without rest.
pub const MOST_STATES: usize = 16;

pub const FARTHEST: u32 = 10_000;

/// Longest time between two steps, in interrupts.
pub const SLOWEST: u32 = 10_000;

pub fn top(dynamics: &Dynamics) -> usize {
    dynamics.enter.len().min(dynamics.leave.len()).min(dynamics.period.len().saturating_sub(1))
}

/// Interrupts per step in `state`, at least 1.
pub fn period(dynamics: &Dynamics, state: i32) -> u32 {
    let of = dynamics.period.get(state.unsigned_abs() as usize);
    of.or(dynamics.period.last()).copied().unwrap_or(1).max(1)
}

/// The fastest state with at most `most_hz` steps per second at `interrupt_hz`; 0 if even that is too fast.
pub fn state_within(dynamics: &Dynamics, interrupt_hz: f64, most_hz: f64) -> usize {
    let rate_hz = |state: &usize| interrupt_hz / f64::from(period(dynamics, *state as i32));
    (0..=top(dynamics)).rev().find(|state| rate_hz(state) <= most_hz).unwrap_or(0)
}

/// The state after a step with `distance` steps left, signed by the direction of counting
/// (`docs/motion-profiles.md` A.4). Total, even for tables that [`check`] refuses.
pub fn next_state(dynamics: &Dynamics, state: i32, distance: i64) -> i32 {
    let side = if state != 0 { i64::from(state.signum()) } else { distance.signum() };
    let ahead = distance.saturating_mul(side);
    let slow = state.unsigned_abs() as usize;
    let below = |row: Option<&u32>| row.is_some_and(|threshold| ahead < i64::from(*threshold));
    let above = |row: Option<&u32>| row.is_some_and(|threshold| ahead > i64::from(*threshold));
    if slow > 0 && below(dynamics.leave.get(slow - 1)) {
        state - side as i32
    } else if slow < top(dynamics) && above(dynamics.enter.get(slow)) {
        state + side as i32
    } else {
        state
    }
}

/// Checks that `dynamics` may drive a motor: warnings, or all errors. Bounded in time for any table: sizes
/// beyond [`MOST_STATES`], [`FARTHEST`] and [`SLOWEST`] are refused before anything runs.
///
/// Tables are refused if they overshoot a target at which they could have stopped, slow down and speed up
/// again on the way (hunting), or never come to rest. Warnings are a last step faster than the first, and a
/// longer move that takes less time than a shorter one.
pub fn check(dynamics: &Dynamics) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
    let misshapen = shape(dynamics);
    if !misshapen.is_empty() {
        return Err(misshapen);
    }
    let map = Map::of(dynamics);
    let refusals = map.refusals();
    if refusals.is_empty() { Ok(map.warnings()) } else { Err(refusals) }
}

/// Errors before the table runs: lengths, sizes, a higher state that is slower.
fn shape(dynamics: &Dynamics) -> Vec<Diagnostic> {
    let error = |code: &str| Diagnostic::error(code);
    let states = dynamics.period.len();
    let (enter, leave) = (dynamics.enter.len(), dynamics.leave.len());
    if states == 0 || enter + 1 != states || leave + 1 != states {
        let diagnostic = error(code!("automaton.lengths")).with("states", states);
        return vec![diagnostic.with("enter", enter).with("leave", leave)];
    }
    if enter > MOST_STATES {
        return vec![
            error(code!("automaton.too_many_states")).with("states", enter).with("most", MOST_STATES),
        ];
    }
    let mut diagnostics = Vec::new();
    for (state, period) in dynamics.period.iter().enumerate() {
        if !(1..=SLOWEST).contains(period) {
            let diagnostic =
                error(code!("automaton.period_range")).with("state", state).with("period", period);
            diagnostics.push(diagnostic.with("most", SLOWEST));
        }
    }
    for (state, pair) in dynamics.period.windows(2).enumerate() {
        if pair[1] > pair[0] {
            let diagnostic =
                error(code!("automaton.period_order")).with("state", state + 1).with("period", pair[1]);
            diagnostics.push(diagnostic.with("slower", state).with("before", pair[0]));
        }
    }
    for (row, name) in [(&dynamics.enter, "enter"), (&dynamics.leave, "leave")] {
        for (state, distance) in row.iter().enumerate().filter(|(_, distance)| **distance > FARTHEST) {
            let diagnostic =
                error(code!("automaton.distance_range")).with("row", name).with("state", state + 1);
            diagnostics.push(diagnostic.with("distance", distance).with("most", FARTHEST));
        }
    }
    diagnostics
}

/// Outcome of a situation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Fate {
    /// Interrupts to the end, if there is one.
    time: u64,
    last: u32,
    /// The speed rises before the motor reverses or rests.
    rises: bool,
    /// The speed falls and rises again later.
    hunts: bool,
    /// The motor overshoots its target.
    over: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Known {
    Nothing,
    OnTheWay,
    Endless,
    Ends(Fate),
}

type Situation = (i32, i64);

struct Map<'a> {
    dynamics: &'a Dynamics,
    top: i32,
    /// Starts have distances −window … window; the array extends `top` + 1 further.
    window: i64,
    known: Vec<Known>,
}

/// Direction of the next step; 0 at rest at the target.
fn way(situation: Situation) -> i32 {
    if situation.0 != 0 { situation.0.signum() } else { situation.1.signum() as i32 }
}

impl<'a> Map<'a> {
    fn of(dynamics: &'a Dynamics) -> Self {
        let top = top(dynamics) as i32;
        let farthest = dynamics.enter.iter().chain(&dynamics.leave).max().copied().unwrap_or(0);
        let window = i64::from(farthest) + i64::from(top) + 2;
        let width = 2 * (window + i64::from(top) + 1) + 1;
        let known = vec![Known::Nothing; (2 * top + 1) as usize * width as usize];
        let mut map = Self { dynamics, top, window, known };
        for state in -top..=top {
            for distance in -window..=window {
                map.walk((state, distance));
            }
        }
        map
    }

    fn index(&self, (state, distance): Situation) -> usize {
        let reach = self.window + i64::from(self.top) + 1;
        let width = (2 * reach + 1) as usize;
        (state + self.top) as usize * width + (distance + reach).clamp(0, 2 * reach) as usize
    }

    fn fate(&self, situation: Situation) -> Option<Fate> {
        match self.known[self.index(situation)] {
            Known::Ends(fate) => Some(fate),
            _ => None,
        }
    }

    fn next(&self, situation: Situation) -> Situation {
        let distance = situation.1 - i64::from(way(situation));
        (next_state(self.dynamics, situation.0, distance), distance)
    }

    fn walk(&mut self, start: Situation) {
        let mut path = Vec::new();
        let mut here = start;
        while here != (0, 0) && self.known[self.index(here)] == Known::Nothing {
            let index = self.index(here);
            self.known[index] = Known::OnTheWay;
            path.push(here);
            here = self.next(here);
        }
        if here == (0, 0) {
            let index = self.index(here);
            self.known[index] = Known::Ends(Fate::default());
        }
        for situation in path.into_iter().rev() {
            let index = self.index(situation);
            self.known[index] = match self.known[self.index(self.next(situation))] {
                Known::Ends(after) => Known::Ends(self.before(situation, after)),
                // A course that returns to itself never ends.
                _ => Known::Endless,
            };
        }
    }

    fn before(&self, here: Situation, after: Fate) -> Fate {
        let next = self.next(here);
        let interval = period(self.dynamics, here.0);
        let goes_on = way(next) == way(here);
        let (speed, later) = (here.0.abs(), next.0.abs());
        let rises_on = goes_on && after.rises;
        Fate {
            time: u64::from(interval) + after.time,
            last: if next == (0, 0) { interval } else { after.last },
            rises: later > speed || rises_on,
            hunts: after.hunts || (later < speed && rises_on),
            over: after.over || (next.1 == 0 && next.0 != 0),
        }
    }

    /// Situations from simple to complex: moves from rest by length, then states with a new target.
    fn situations(&self) -> impl Iterator<Item = Situation> {
        let (top, window) = (self.top, self.window);
        let both_ways = |distance: i64| [distance, -distance];
        let rest = (1..=window).flat_map(both_ways).map(|distance| (0, distance));
        let moving = (1..=top).flat_map(move |state| {
            (0..=window).flat_map(both_ways).flat_map(move |distance| [(state, distance), (-state, distance)])
        });
        rest.chain(moving)
    }

    /// The first situation of each kind of error.
    fn refusals(&self) -> Vec<Diagnostic> {
        let mut diagnostics = Vec::new();
        let mut first = |what: &str, is: &dyn Fn(Situation) -> bool| {
            if let Some((state, distance)) = self.situations().find(|situation| is(*situation)) {
                let retargeted = if state == 0 { "" } else { "_retargeted" };
                let diagnostic = Diagnostic::error(&format!("automaton.{what}{retargeted}"));
                let diagnostic = diagnostic.with("distance", distance).with("state", state);
                diagnostics.push(self.detail(diagnostic, what, (state, distance)));
            }
        };
        first("overshoots", &|here| self.could_stop(here) && self.fate(here).is_some_and(|fate| fate.over));
        first("hunts", &|here| self.fate(here).is_some_and(|fate| fate.hunts));
        first("never_rests", &|here| self.fate(here).is_none());
        diagnostics
    }

    /// True if slowing down by one state per step would stop before the target. No table can stop faster.
    fn could_stop(&self, (state, distance): Situation) -> bool {
        let ahead = distance * i64::from(state.signum());
        state == 0 || ahead >= i64::from(state.abs())
    }

    /// Adds the location and states of an error, by running it again.
    fn detail(&self, diagnostic: Diagnostic, what: &str, start: Situation) -> Diagnostic {
        let (mut here, mut fallen) = (start, None);
        let longest = 4 * (self.window + i64::from(self.top));
        for _ in 0..longest {
            let next = self.next(here);
            let (speed, later) = (here.0.abs(), next.0.abs());
            if way(next) != way(here) {
                fallen = None;
            } else if later < speed {
                fallen = Some((speed, next.1.abs()));
            }
            match fallen {
                Some((before, at)) if what == "hunts" && later > speed => {
                    let diagnostic = diagnostic.with("from", before).with("down", speed).with("up", later);
                    return diagnostic.with("fell", at).with("rose", next.1.abs());
                }
                _ if what == "overshoots" && next.1 == 0 && next.0 != 0 => {
                    return diagnostic.with("speed", later).with("by", self.beyond(next));
                }
                _ => here = next,
            }
        }
        diagnostic
    }

    /// Overshoot in steps beyond the target.
    fn beyond(&self, mut here: Situation) -> u64 {
        let mut steps = 0;
        while here.0 != 0 && steps < self.window as u64 {
            here = self.next(here);
            steps += 1;
        }
        steps
    }

    /// Warnings about an accepted table.
    fn warnings(&self) -> Vec<Diagnostic> {
        let mut diagnostics = Vec::new();
        let from_rest = |distance: i64| self.fate((0, distance)).unwrap_or_default();
        let slow = period(self.dynamics, 0);
        if let Some(distance) = (1..=self.window).find(|distance| from_rest(*distance).last != slow) {
            let diagnostic = warning!("automaton.fast_end", distance = distance, ..);
            diagnostics.push(diagnostic.with("interval", from_rest(distance).last).with("first", slow));
        }
        let faster = |distance: &i64| from_rest(*distance).time < from_rest(distance - 1).time;
        if let Some(distance) = (2..=self.window).find(faster) {
            let diagnostic = warning!("automaton.longer_is_faster", distance = distance, ..);
            let (time, shorter) = (from_rest(distance).time, from_rest(distance - 1).time);
            diagnostics
                .push(diagnostic.with("time", time).with("shorter", distance - 1).with("before", shorter));
        }
        diagnostics
    }
}
