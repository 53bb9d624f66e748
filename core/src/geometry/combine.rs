//! Areas united, cut and painted.
//!
//! ```text
//!   union        everything any of the paths encloses
//!   even_odd     what an odd number of them encloses
//!   combine      two regions by a rule
//!   paint        dark and clear exposures, one over the other, as a photoplotter lays them down:
//!
//!     exposures    d d c d c c d d         neighbours of one colour are one exposure; halves are painted apart and laid
//!              └─┬─┘ └┬┘└─┬─┘          over each other, so thousands of changes cost a few passes over everything
//!                └──┬─┘   │
//!                   └──┬──┘
//! ```
//!
//! Comes in: closed paths (open ones are closed by a straight line). Goes out: regions in canonical order, see `rebuild`.
//! Tolerance: lines within 3 nm, arcs on their circles; where two outlines cross at a flat angle on an arc the place
//! of the crossing is that of chords 0.4 µm off, mended to the true one where there is one. Pieces shorter than 0.1 µm
//! are drawn together, islands and holes thinner than 20 nm dropped. Knows no boards.

use super::afford::{Fuel, afford, is_simple};
use super::compose::{Role, laid};
use super::measure::path_area_mm2;
use super::overlay::{Circle, Fill, Overlay, Pile, Shape, trace, trace_two};
use super::rebuild;
use super::simplify::simplify;
use super::{Path, PathSegment, Region};
use i_overlay::core::overlay_rule::OverlayRule;

/// Pieces of united outlines shorter than this, in nm, are drawn together.
pub(super) const FRAGMENT_NM: f64 = 100.0;

/// How two regions are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CombineRule {
    /// In either.
    Union,
    /// In the first and not in the second.
    Difference,
    /// In both.
    Intersection,
    /// In one of them alone.
    Xor,
}

/// What a path that crosses itself encloses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Enclosing {
    /// What it goes round at all.
    Once,
    /// What it goes round an odd number of times.
    Odd,
}

/// One exposure of paint: outlines with their inside on the left, as [`settled`], [`super::circle`],
/// [`super::rectangle`], [`super::stroke()`] and the paths of a [`Region`] are. A clockwise outline is a hole in its
/// own exposure and hides nothing beneath.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Exposure {
    /// Whether it takes away what is beneath it.
    pub clear: bool,
    /// Its outlines.
    pub outlines: Vec<Path>,
}

/// Whether a closed path turns left all the way and once round: then it crosses itself nowhere.
fn is_convex(path: &Path) -> bool {
    if path.segments.iter().any(|segment| matches!(segment, PathSegment::Arc { clockwise: true, .. })) {
        return false;
    }
    let corners: Vec<_> = path.flattened(0.05).into_iter().map(super::overlay::spot).collect();
    let sides: Vec<_> = corners
        .iter()
        .zip(corners.iter().cycle().skip(1))
        .map(|(a, b)| (b.0 - a.0, b.1 - a.1))
        .filter(|&side| side != (0.0, 0.0))
        .collect();
    let ahead = sides.iter().cycle().skip(1);
    let left = sides.iter().zip(ahead.clone()).all(|(a, b)| {
        let turn = a.0 * b.1 - a.1 * b.0;
        turn > 0.0 || turn == 0.0 && a.0 * b.0 + a.1 * b.1 > 0.0
    });
    // Once round: the direction passes that of +x a single time.
    let upper = |side: &(f64, f64)| side.1 > 0.0 || side.1 == 0.0 && side.0 > 0.0;
    left && sides.iter().zip(ahead).filter(|(a, b)| !upper(a) && upper(b)).count() == 1
}

/// The outlines of what one path encloses (winding not zero), with their inside on the left: the path itself or
/// the path reversed where it is convex, and resolved into outer outlines and holes where it may cross itself.
pub fn settled(path: &Path) -> Vec<Path> {
    if path.is_closed() && is_convex(path) {
        return vec![path.clone()];
    }
    let back = path.reversed();
    if path.is_closed() && is_convex(&back) {
        return vec![back];
    }
    let mut overlay = Overlay::default();
    overlay.path(path);
    rebuild::traced(&mut overlay, Fill::NonZero, FRAGMENT_NM).paths().cloned().collect()
}

/// The outlines of what one path encloses, by `rule`, with their inside on the left; none where that costs more than there is
/// fuel. A path that goes round once is its own outline.
pub fn enclosed(path: &Path, rule: Enclosing, fuel: &mut Fuel) -> Option<Vec<Path>> {
    let back = path.reversed();
    let convex = [path, &back].into_iter().find(|path| path.is_closed() && is_convex(path));
    if let Some(convex) = convex {
        return Some(vec![convex.clone()]);
    }
    let simple = is_simple(path, fuel)? && path.is_closed();
    let area = path_area_mm2(path);
    Some(match (simple, rule) {
        (true, _) if area > 0.0 => vec![path.clone()],
        (true, _) if area < 0.0 => vec![back],
        (_, Enclosing::Once) => settled(path),
        (_, Enclosing::Odd) => even_odd(std::slice::from_ref(path)).paths().cloned().collect(),
    })
}

/// Everything that any of the paths encloses, whichever way each of them turns.
pub fn union(paths: &[Path]) -> Region {
    let mut overlay = Overlay::default();
    for path in paths.iter().flat_map(settled) {
        overlay.path(&path);
    }
    rebuild::traced(&mut overlay, Fill::NonZero, FRAGMENT_NM)
}

/// What an odd number of the paths encloses: contours in contours are holes, whichever way they turn.
pub fn even_odd(paths: &[Path]) -> Region {
    let mut overlay = Overlay::default();
    for path in paths {
        overlay.path(path);
    }
    rebuild::traced(&mut overlay, Fill::EvenOdd, FRAGMENT_NM)
}

/// What is inside of `outlines`, whose inside is on their left and which may overlap.
pub(super) fn together<'a>(outlines: impl IntoIterator<Item = &'a Path>) -> Region {
    let mut overlay = Overlay::default();
    for outline in outlines {
        overlay.path(outline);
    }
    rebuild::traced(&mut overlay, Fill::NonZero, FRAGMENT_NM)
}

/// Two regions combined by `rule`.
pub fn combine(first: &Region, second: &Region, rule: CombineRule) -> Region {
    let mut overlay = Overlay::default();
    first.paths().for_each(|path| overlay.path(path));
    let subject = overlay.take();
    second.paths().for_each(|path| overlay.path(path));
    let [subject, clip] = simplify([&subject, &overlay.take()]);
    let rule = match rule {
        CombineRule::Union => OverlayRule::Union,
        CombineRule::Difference => OverlayRule::Difference,
        CombineRule::Intersection => OverlayRule::Intersect,
        CombineRule::Xor => OverlayRule::Xor,
    };
    rebuild::region(&trace_two(&subject, &clip, rule), &overlay.circles, FRAGMENT_NM)
}

/// What a row of exposures does to whatever lies beneath: takes `clear` away, then adds `dark`. The shapes of either do not
/// overlap.
#[derive(Default)]
struct Layer {
    clear: Vec<Shape>,
    dark: Vec<Shape>,
}

/// Two layers as one, the second over the first.
fn over(first: Layer, second: Layer, keep_clear: bool) -> Layer {
    let clear = match keep_clear {
        false => Vec::new(),
        true => laid([(Role::Ground, first.clear), (Role::Over, second.clear.clone())]),
    };
    let dark = laid([(Role::Ground, first.dark), (Role::Away, second.clear), (Role::Over, second.dark)]);
    Layer { clear, dark }
}

impl Layer {
    fn edges(&self) -> usize {
        self.clear.iter().chain(&self.dark).flatten().map(Vec::len).sum()
    }
}

/// The layer that a row of exposures makes. Parted where either side has half of the edges, so that nothing is laid down more
/// often than there are doublings in their number.
fn layer(exposures: &mut [Layer], keep_clear: bool) -> Layer {
    match exposures {
        [] => Layer::default(),
        [one] => std::mem::take(one),
        _ => {
            let sizes: Vec<usize> = exposures.iter().map(Layer::edges).collect();
            let half = sizes.iter().sum::<usize>() / 2;
            let sums = sizes.iter().scan(0, |sum, size| {
                *sum += size;
                Some(*sum)
            });
            let middle = sums.take_while(|&sum| sum <= half).count().clamp(1, exposures.len() - 1);
            let (first, second) = exposures.split_at_mut(middle);
            let first = layer(first, keep_clear);
            over(first, layer(second, true), keep_clear)
        }
    }
}

/// What is dark after all exposures, laid down one over the other on a clear ground.
pub fn paint(exposures: &[Exposure]) -> Region {
    let mut overlay = Overlay::default();
    exposures.iter().flat_map(|exposure| &exposure.outlines).for_each(|outline| overlay.path(outline));
    painted(exposures, &overlay.take(), &overlay.circles)
}

/// The same, if there is fuel for it; else the number of an outline at which it ran out, counted through all exposures.
pub fn paint_within(exposures: &[Exposure], fuel: &mut Fuel) -> Result<Region, usize> {
    let mut overlay = Overlay::with_room(usize::try_from(fuel.left()).unwrap_or(usize::MAX));
    for (number, outline) in exposures.iter().flat_map(|exposure| &exposure.outlines).enumerate() {
        overlay.path(outline);
        if overlay.is_full() {
            return Err(number);
        }
    }
    let [pile] = simplify([&overlay.take()]);
    afford(&pile, exposures.len().next_power_of_two().trailing_zeros(), fuel)?;
    Ok(painted(exposures, &pile, &overlay.circles))
}

/// What is dark after all exposures, whose outlines are the pile's, in order.
fn painted(exposures: &[Exposure], pile: &Pile, circles: &[Circle]) -> Region {
    let mut outlines = pile.outlines();
    let mut layers: Vec<Layer> = Vec::new();
    for same in exposures.chunk_by(|one, two| one.clear == two.clear) {
        let mut part = Pile::default();
        for outline in outlines.by_ref().take(same.iter().map(|exposure| exposure.outlines.len()).sum()) {
            part.edges.extend_from_slice(outline);
            part.ends.push(part.edges.len());
        }
        match same.first() {
            Some(Exposure { clear: true, .. }) if layers.is_empty() => {}
            Some(Exposure { clear: true, .. }) => {
                layers.push(Layer { clear: trace(&part, Fill::NonZero), dark: Vec::new() });
            }
            _ => layers.push(Layer { clear: Vec::new(), dark: trace(&part, Fill::NonZero) }),
        }
    }
    let dark = layer(&mut layers, false).dark;
    rebuild::region(&dark, circles, FRAGMENT_NM)
}
