//! Sweeps of an axis that were walked and found lawful: the same one need not be walked again.
//!
//! ```text
//! rest ─▶ first step │ run run run … │ rest            the same tick for tick, whenever it begins: found
//! ```
//!
//! Comes in: runs between two rests. Goes out: whether the very same were there before, and where they lead. Knows no law.

use crate::steps::stream::Run;

/// So many sweeps of an axis are kept, those that came again last.
const MOST: usize = 8;

/// Longer sweeps are not kept, runs.
const LONGEST: usize = 10_000;

/// All that decides what is found in a sweep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep<'a> {
    pub(super) runs: &'a [Run],
    /// Whether the axis rests before the first step, long enough that nothing before it counts.
    pub(super) rested: bool,
    /// Ticks from the last step to the end of the segment; none where the axis rests long.
    pub(super) tail: Option<i128>,
}

/// Where a sweep leads, steps from where it began.
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

/// Sweeps that were found lawful, the latest first.
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
    /// Where the sweep leads, where the same one was found lawful.
    pub(super) fn find(&mut self, sweep: &Sweep<'_>) -> Option<Reach> {
        let place = self.kept.iter().position(|kept| kept.is(sweep))?;
        self.kept[..=place].rotate_right(1);
        self.kept.first().map(|kept| kept.way)
    }

    /// Keeps a sweep that was found lawful.
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

    /// Nothing is known, and nothing learnt.
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
        // After a rest a run of one step only says when.
        let whenever = sweep.rested && first.count == 1;
        let begins =
            if whenever { Run { interval: own.interval, fraction: own.fraction, ..*first } } else { *first };
        same && *own == begins && own_later == later
    }
}
