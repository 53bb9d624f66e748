//! Cache of verified sweeps of an axis, so that equal sweeps are not checked again.
//!
//! ```text
//! rest ─▶ first step │ run run run … │ rest            equal tick for tick, at any start time: a cache hit
//! ```

use crate::steps::stream::Run;

/// Cached sweeps per axis, least recently used out first.
const MOST: usize = 8;

const LONGEST: usize = 10_000;

#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep<'a> {
    pub(super) runs: &'a [Run],
    /// The axis rested before the first step long enough that earlier motion doesn't matter.
    pub(super) rested: bool,
    /// Ticks from the last step to the end of the segment; none if the axis rests long.
    pub(super) tail: Option<i128>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reach {
    pub(super) low: i64,
    pub(super) high: i64,
    pub(super) end: i64,
    /// The last step counts up.
    pub(super) forward: bool,
}

#[derive(Debug)]
struct Kept {
    runs: Vec<Run>,
    rested: bool,
    tail: Option<i128>,
    way: Reach,
}

/// Verified sweeps, the latest first.
#[derive(Debug)]
pub(super) struct Known {
    kept: Vec<Kept>,
    most: usize,
}

impl Default for Known {
    fn default() -> Self {
        Self { kept: Vec::new(), most: MOST }
    }
}

impl Known {
    pub(super) fn find(&mut self, sweep: &Sweep<'_>) -> Option<Reach> {
        let place = self.kept.iter().position(|kept| kept.is(sweep))?;
        self.kept[..=place].rotate_right(1);
        self.kept.first().map(|kept| kept.way)
    }

    /// Caches a verified sweep.
    pub(super) fn learn(&mut self, sweep: &Sweep<'_>) {
        let Some(last) = sweep.runs.last().filter(|_| sweep.runs.len() <= LONGEST) else { return };
        let mut way = Reach { low: 0, high: 0, end: 0, forward: last.forward };
        for run in sweep.runs {
            way.end += i64::from(run.count) * if run.forward { 1 } else { -1 };
            (way.low, way.high) = (way.low.min(way.end), way.high.max(way.end));
        }
        let Sweep { runs, rested, tail } = *sweep;
        self.kept.insert(0, Kept { runs: runs.to_vec(), rested, tail, way });
        self.kept.truncate(self.most);
    }

    /// A cache that stays empty.
    #[cfg(test)]
    pub(super) fn nothing() -> Self {
        Self { kept: Vec::new(), most: 0 }
    }
}

impl Kept {
    fn is(&self, sweep: &Sweep<'_>) -> bool {
        let same = self.rested == sweep.rested && self.tail == sweep.tail;
        let (Some((own, own_later)), Some((first, later))) =
            (self.runs.split_first(), sweep.runs.split_first())
        else {
            return false;
        };
        // After a rest, a run of one step only sets the start time, so its interval may differ.
        let whenever = sweep.rested && first.count == 1;
        let begins =
            if whenever { Run { interval: own.interval, fraction: own.fraction, ..*first } } else { *first };
        same && *own == begins && own_later == later
    }
}
