//! The board carved up to any second: forwards from the current state, backwards from the previous
//! checkpoint.
//!
//! ```text
//! work   0 ──── ● ──── ● ──── ● ──── ●──▶        ● a checkpoint: a copy of the stock, at intervals
//! seek              ◀──────── t                  from the ● before t, at most one interval of work
//! explore                           ▶▶▶ ●        beyond everything carved yet, in idle time
//! ```
//!
//! A seek does a limited amount of work; call it again until it is done.

use super::carve::Stock;
use super::playback::Playback;
use super::swept::swept;
use crate::job::Bit;
use std::sync::Arc;

/// Cells visited between two checkpoints, initially.
const CHECKPOINT_CELLS: u64 = 250_000;
/// Above this number of checkpoints, or of unshared tiles (128 MB), every other checkpoint is dropped and the
/// interval doubles.
const MOST_CHECKPOINTS: usize = 512;
const MOST_TILES: usize = 16_384;

/// Progress of the carving: complete moves, complete paths of the next move, and a share of the next path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Place {
    moved: usize,
    ways: usize,
    share: f64,
    at_s: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Carving {
    playback: Arc<Playback>,
    bits: Vec<Bit>,
    stock: Stock,
    place: Place,
    checkpoints: Vec<(Place, Stock)>,
    since_cells: u64,
    apart_cells: u64,
    /// Tiles that a checkpoint does not share with the previous one.
    own_tiles: usize,
    /// State for further exploring: progress, stock, cells since its last checkpoint.
    furthest: (Place, Stock, u64),
}

impl Carving {
    /// Starts with an uncut board.
    pub fn new(playback: Arc<Playback>, bits: Vec<Bit>, stock: Stock) -> Self {
        let checkpoints = vec![(Place::default(), stock.clone())];
        let furthest = (Place::default(), stock.clone(), 0);
        Self {
            playback,
            bits,
            stock,
            place: Place::default(),
            checkpoints,
            since_cells: 0,
            apart_cells: CHECKPOINT_CELLS,
            own_tiles: 0,
            furthest,
        }
    }

    /// The board as carved.
    pub fn stock(&self) -> &Stock {
        &self.stock
    }

    pub fn at_s(&self) -> f64 {
        self.place.at_s
    }

    pub fn checkpoints(&self) -> usize {
        self.checkpoints.len()
    }

    /// Carves up to second `t_s`, or stops after about `most_cells` cells. True if complete.
    pub fn seek(&mut self, t_s: f64, most_cells: u64) -> bool {
        self.jump(t_s);
        self.carve_to(t_s, most_cells)
    }

    /// Carves about `most_cells` cells beyond everything carved yet, so that every second gets a checkpoint
    /// nearby. True if nothing is left. The shown stock doesn't change.
    pub fn explore(&mut self, most_cells: u64) -> bool {
        if self.place.at_s > self.furthest.0.at_s {
            self.furthest = (self.place, self.stock.clone(), self.since_cells);
        }
        self.swap();
        let end = self.carve_to(self.playback.total_s(), most_cells);
        self.swap();
        end
    }

    fn swap(&mut self) {
        std::mem::swap(&mut self.place, &mut self.furthest.0);
        std::mem::swap(&mut self.stock, &mut self.furthest.1);
        std::mem::swap(&mut self.since_cells, &mut self.furthest.2);
    }

    fn carve_to(&mut self, t_s: f64, most_cells: u64) -> bool {
        let playback = self.playback.clone();
        let timeline = playback.timeline();
        let mut spent = 0;
        while let Some(planned) = timeline.moves.get(self.place.moved) {
            let bit = playback.bit_of_leg(planned.leg).and_then(|bit| self.bits.get(bit as usize)).cloned();
            let ways = swept(planned, &timeline.mm_per_step);
            for found in ways.get(self.place.ways..).unwrap_or_default() {
                if found.from_s >= t_s {
                    break;
                }
                let to = found.share(planned, t_s);
                let cells =
                    bit.as_ref().map_or(0, |bit| self.stock.carve(&found.way, bit, self.place.share, to));
                // Paths without cells count as work, too.
                spent += cells + 1;
                self.since_cells += cells + 1;
                if to < 1.0 {
                    self.place = Place { share: to, at_s: t_s, ..self.place };
                    return true;
                }
                let ways = self.place.ways + 1;
                self.place = Place { ways, share: 0.0, at_s: found.to_s, ..self.place };
                self.keep();
                if spent >= most_cells {
                    return false;
                }
            }
            if self.place.ways < ways.len() {
                break;
            }
            let end_s = (planned.start_tick + planned.duration_ticks) as f64 / crate::units::TICK_HZ as f64;
            if end_s > t_s {
                break;
            }
            self.place = Place { moved: self.place.moved + 1, ways: 0, share: 0.0, at_s: end_s };
        }
        self.place.at_s = self.place.at_s.max(t_s);
        true
    }

    fn jump(&mut self, t_s: f64) {
        let before = self.checkpoints.partition_point(|(place, _)| place.at_s <= t_s).saturating_sub(1);
        let Some((place, stock)) = self.checkpoints.get(before) else { return };
        if self.place.at_s > t_s || place.at_s > self.place.at_s {
            (self.place, self.stock, self.since_cells) = (*place, stock.clone(), 0);
        }
    }

    /// Saves a checkpoint if there was enough work since the last one.
    fn keep(&mut self) {
        if self.since_cells < self.apart_cells {
            return;
        }
        self.since_cells = 0;
        if let Some((_, newest)) = self.checkpoints.last().filter(|(place, _)| self.place.at_s > place.at_s) {
            self.own_tiles += self.stock.changed(newest).count();
            self.checkpoints.push((self.place, self.stock.clone()));
        }
        if self.checkpoints.len() > MOST_CHECKPOINTS || self.own_tiles > MOST_TILES {
            self.apart_cells *= 2;
            let mut number = 0;
            self.checkpoints.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            let own = |two: &[(Place, Stock)]| two[1].1.changed(&two[0].1).count();
            self.own_tiles = self.checkpoints.windows(2).map(own).sum();
        }
    }
}
