//! Tries every plausible reading of a drill program: where its holes are, whether they are possible, and how
//! they fit copper and outline of the board. The choice is in [`super::resolve`].

use super::plausible::{impossible_bit, oddity};
use crate::artwork::excellon::{self, Sensed, Survey, Task, ToolTable, customary};
use crate::artwork::number::Reading;
use crate::artwork::registration::{Copper, FITS_SHARE, Fit, SAMPLE, every, same_place, same_size};
use crate::artwork::text::front;
use crate::artwork::{Digits, Source, Units, Zeros};
use crate::code;
use crate::geometry::{Bounds, Point};

/// Maximum number of bytes read for each reading.
const SAMPLED_BYTES: usize = 192 * 1024;
/// From this number of holes on, their extent can prove a scale.
const FEWEST: usize = 8;

pub(super) struct Grounds<'a> {
    pub(super) name: &'a str,
    pub(super) text: &'a [u8],
    pub(super) survey: &'a Survey,
    pub(super) table: &'a ToolTable,
    pub(super) sensed: &'a Sensed,
    /// The file declares all its holes unplated, so they needn't be on copper.
    pub(super) unplated: bool,
    pub(super) copper: Option<&'a Copper>,
    /// Bounding box of the board's outline.
    pub(super) outline: Option<Bounds>,
}

/// A reading and how its holes fit.
pub(super) struct Ranked {
    pub(super) reading: Reading,
    pub(super) fit: Fit,
    pub(super) holes: Vec<Point>,
    /// The tools of single holes; none for slot ends and route vertices.
    pub(super) tools: Vec<Option<u16>>,
    /// Agrees with everything that statements settle.
    pub(super) allowed: bool,
    /// Agrees with everything that the user or the file itself settles.
    pub(super) own_words: bool,
    /// Sizes of board, holes and tools are possible.
    pub(super) possible: bool,
    pub(super) bounds: Bounds,
    /// The bounding box is as large as that of the copper, or there is no copper.
    pub(super) as_large: bool,
}

impl Grounds<'_> {
    /// True if the copper supports this reading: it is a possible board, of the copper's size and position,
    /// with enough holes on pads.
    pub(super) fn copper_votes(&self, ranked: &Ranked) -> bool {
        let Some((copper, board)) = self.copper.and_then(|copper| Some((copper, copper.bounds()?))) else {
            return false;
        };
        // Copper that can't be inside the outline belongs to another board.
        if self.outline.is_some_and(|outline| !same_size(board, outline)) {
            return false;
        }
        let board = self.outline.filter(|outline| same_place(board, *outline)).unwrap_or(board);
        let moved = ranked.fit.shift_mm != (0.0, 0.0);
        let agrees = if moved { same_size(ranked.bounds, board) } else { same_place(ranked.bounds, board) };
        !self.unplated && ranked.possible && agrees && copper.votes(&ranked.holes, ranked.fit)
    }

    /// The outline, if there are enough holes to compare with it.
    pub(super) fn outline_of(&self, ranked: &Ranked) -> Option<Bounds> {
        self.outline.filter(|_| ranked.holes.len() >= FEWEST)
    }
}

pub(super) fn sample(text: &[u8]) -> Option<&[u8]> {
    let text = front(text, SAMPLED_BYTES);
    let end = text.iter().rposition(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(text.len());
    text.get(..end)
}

/// All readings, best fit first; of readings with the same holes only the first. None if there are too few
/// holes.
pub(super) fn rank(grounds: &Grounds<'_>) -> Option<Vec<Ranked>> {
    let &Grounds { name, survey, table, sensed, unplated, copper, .. } = grounds;
    let text = sample(grounds.text)?;
    let mut all: Vec<Ranked> = Vec::new();
    for reading in readings(sensed) {
        let Ok((drill, diagnostics)) = excellon::read(&Task { name, text, reading, survey, table }) else {
            continue;
        };
        // `centres` lists single holes first.
        let single = drill.hits.len();
        let centres: Vec<(Point, Option<u16>)> = (0..)
            .zip(drill.centres())
            .map(|(at, (point, tool))| (point, (at < single).then_some(tool)))
            .collect();
        let (holes, tools): (Vec<Point>, Vec<Option<u16>>) =
            every(centres.iter().copied(), centres.len(), SAMPLE).unzip();
        let Some(bounds) = drill.centre_bounds().filter(|_| holes.len() >= 3) else { continue };
        if all.iter().any(|other| other.holes == holes) {
            continue;
        }
        let far = diagnostics.iter().any(|diagnostic| diagnostic.code == code!("drill.out_of_range"));
        let possible = !far && oddity(&drill).is_none() && impossible_bit(&drill).is_none();
        let fit = copper.map_or(Fit::default(), |copper| copper.fit(&holes));
        let board = copper.and_then(Copper::bounds);
        let as_large = board.is_none_or(|board| same_size(bounds, board));
        let allowed = agrees(&reading, sensed, Sensed::stated);
        let own_words = agrees(&reading, sensed, |source| source < Source::Companion);
        all.push(Ranked { reading, fit, holes, tools, allowed, own_words, possible, bounds, as_large });
    }
    // Unplated holes need no copper, so any shift would fit only by chance.
    if !unplated && all.iter().all(|ranked| ranked.fit.share < FITS_SHARE) {
        for ranked in all.iter_mut().filter(|ranked| ranked.possible && ranked.as_large) {
            let shifted = copper.map_or(Fit::default(), |copper| copper.fit_shifted(&ranked.holes));
            if shifted.share >= FITS_SHARE {
                ranked.fit = shifted;
            }
        }
    }
    // `readings` returns the usual ones first, and a stable sort keeps that order among equals.
    all.sort_by(|a, b| b.fit.share.total_cmp(&a.fit.share));
    (!all.is_empty()).then_some(all)
}

/// True if the reading equals the sensed one in every part whose source is `settled`.
pub(super) fn agrees(reading: &Reading, sensed: &Sensed, settled: impl Fn(Source) -> bool) -> bool {
    let (own, decimal) = (&sensed.reading, sensed.reading.zeros == Zeros::Decimal);
    let units = !settled(sensed.units) || reading.units == own.units;
    let digits = decimal || !settled(sensed.digits) || reading.digits == own.digits;
    let zeros = decimal || !settled(sensed.zeros) || reading.zeros == own.zeros;
    units && digits && zeros
}

pub(super) fn readings(sensed: &Sensed) -> Vec<Reading> {
    const MM: [(u8, u8); 7] = [(3, 3), (4, 2), (3, 2), (4, 4), (4, 3), (5, 5), (3, 5)];
    const INCH: [(u8, u8); 7] = [(2, 4), (2, 3), (3, 5), (2, 5), (3, 3), (5, 5), (2, 6)];
    let mut all = vec![sensed.reading];
    let zeros = match sensed.reading.zeros {
        Zeros::Decimal => vec![Zeros::Decimal],
        Zeros::Trailing => vec![Zeros::Trailing, Zeros::Leading],
        own => vec![own, Zeros::Trailing],
    };
    for (units, formats) in [(Units::Inch, INCH), (Units::Mm, MM)] {
        let formats = formats.map(|(integer, decimal)| Digits { integer, decimal });
        for digits in [sensed.reading.digits, customary(units)].into_iter().chain(formats) {
            all.extend(zeros.iter().map(|&zeros| Reading { units, digits, zeros }));
        }
    }
    all
}
