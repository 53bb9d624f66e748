//! Boolean operations and painting.
//!
//! ```text
//!   union        everything inside any of the paths
//!   even_odd     areas inside an odd number of paths
//!   combine      two regions by a rule
//!   paint        dark and clear exposures, one over the other, like a photoplotter:
//!
//!     exposures    d d c d c c d d         neighbours of one colour are one exposure; halves are painted
//!              └─┬─┘ └┬┘└─┬─┘          separately, so thousands of changes cost a few passes
//!                └──┬─┘   │
//!                   └──┬──┘
//! ```
//!
//! Tolerance: lines within 3 nm, arcs on their circles. If two outlines cross at a flat angle on an arc, the
//! crossing is found on chords with 0.4 µm error. If a true crossing exists, the corner is moved there.
//! Pieces shorter than 0.1 µm are merged; islands and holes thinner than 20 nm are dropped.

use super::afford::{Fuel, afford, is_simple};
use super::compose::{Role, laid};
use super::measure::path_area_mm2;
use super::overlay::{Circle, Fill, Overlay, Pile, Shape, edges_of, trace, trace_two};
use super::rebuild;
use super::simplify::simplify;
use super::unite::united;
use super::{Path, PathSegment, Region};
use i_overlay::core::overlay_rule::OverlayRule;

/// Pieces of united outlines shorter than this, in nm, are merged.
pub(super) const FRAGMENT_NM: f64 = 100.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CombineRule {
    Union,
    /// In the first and not in the second.
    Difference,
    Intersection,
    /// In exactly one of them.
    Xor,
}

/// Inside of a path that crosses itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Enclosing {
    /// Winding number not zero.
    Once,
    Odd,
}

/// One exposure of paint: outlines with their inside on the left. Sources: [`settled`], [`super::circle`],
/// [`super::rectangle`], [`super::stroke()`] and the paths of a [`Region`]. A clockwise outline is a hole in
/// its own exposure and erases nothing beneath.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Exposure {
    /// True if it erases the exposures before it.
    pub clear: bool,
    pub outlines: Vec<Path>,
}

/// True if a closed path turns left everywhere and exactly once in total: then it does not cross itself.
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
    // One turn in total: the direction passes +x exactly once.
    let upper = |side: &(f64, f64)| side.1 > 0.0 || side.1 == 0.0 && side.0 > 0.0;
    left && sides.iter().zip(ahead).filter(|(a, b)| !upper(a) && upper(b)).count() == 1
}

/// The outlines of the area inside a path (winding not zero), with their inside on the left. A convex path
/// stays, reversed if needed; others are resolved into outer outlines and holes.
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

/// The outlines of the area inside a path, by `rule`, with their inside on the left; `None` if the fuel isn't
/// enough. A simple path is its own outline.
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

pub fn union(paths: &[Path]) -> Region {
    let mut overlay = Overlay::default();
    for path in paths.iter().flat_map(settled) {
        overlay.path(&path);
    }
    rebuild::traced(&mut overlay, Fill::NonZero, FRAGMENT_NM)
}

/// Everything inside an odd number of paths: contours in contours are holes, in either direction.
pub fn even_odd(paths: &[Path]) -> Region {
    let mut overlay = Overlay::default();
    for path in paths {
        overlay.path(path);
    }
    rebuild::traced(&mut overlay, Fill::EvenOdd, FRAGMENT_NM)
}

/// The union of `outlines` with their inside on the left; they may overlap.
pub(super) fn together<'a>(outlines: impl IntoIterator<Item = &'a Path>) -> Region {
    let mut overlay = Overlay::default();
    for outline in outlines {
        overlay.path(outline);
    }
    rebuild::traced(&mut overlay, Fill::NonZero, FRAGMENT_NM)
}

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

/// Combined effect of consecutive exposures: erases `clear`, then adds `dark`. The shapes of each do not
/// overlap.
#[derive(Default)]
struct Layer {
    clear: Vec<Shape>,
    dark: Vec<Shape>,
}

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

/// The layer of consecutive exposures. Splits them at half of the edges, so that nothing is processed more
/// often than the logarithm of their number.
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

/// The dark area after all exposures in order, on a clear ground.
pub fn paint(exposures: &[Exposure]) -> Region {
    let mut overlay = Overlay::default();
    exposures.iter().flat_map(|exposure| &exposure.outlines).for_each(|outline| overlay.path(outline));
    painted(exposures, &overlay.take(), &overlay.circles)
}

/// As [`paint`], within the fuel. The error is the number of the outline, counted over all exposures, at
/// which the fuel ran out. `is_picture` allows coarser arcs: 5 µm error at crossings, instead of 0.8.
pub fn paint_within(exposures: &[Exposure], is_picture: bool, fuel: &mut Fuel) -> Result<Region, usize> {
    let room = usize::try_from(fuel.left()).unwrap_or(usize::MAX);
    let mut overlay = if is_picture { Overlay::for_picture(room) } else { Overlay::with_room(room) };
    for (number, outline) in exposures.iter().flat_map(|exposure| &exposure.outlines).enumerate() {
        overlay.path(outline);
        if overlay.is_full() {
            return Err(number);
        }
    }
    let [pile] = simplify([&overlay.take()]);
    let mut layers = layers(exposures, &pile, &mut |part| united(part, fuel))?;
    if layers.len() > 1 {
        let (found, firsts) = edges_of_layers(&layers, exposures);
        let doublings = exposures.len().next_power_of_two().trailing_zeros();
        afford(&found, doublings, fuel).map_err(|at| firsts.get(at).copied().unwrap_or_default())?;
    }
    let dark = layer(&mut layers, false).dark;
    Ok(rebuild::region(&dark, &overlay.circles, FRAGMENT_NM))
}

/// The edges of all layers as one pile, and for each of its outlines the number of the first outline of its
/// exposures.
fn edges_of_layers(layers: &[Layer], exposures: &[Exposure]) -> (Pile, Vec<usize>) {
    let same = exposures.chunk_by(|one, two| one.clear == two.clear);
    let sizes = same.map(|same| same.iter().map(|exposure| exposure.outlines.len()).sum::<usize>());
    let sizes: Vec<usize> = sizes.collect();
    // A clear exposure before any dark one makes no layer.
    let skipped = sizes.len().saturating_sub(layers.len());
    let (mut pile, mut firsts) = (Pile::default(), Vec::new());
    let mut first = sizes.iter().take(skipped).sum();
    for (of_layer, size) in layers.iter().zip(sizes.iter().skip(skipped)) {
        for contour in of_layer.clear.iter().chain(&of_layer.dark) {
            pile.edges.extend(edges_of(contour));
            pile.ends.push(pile.edges.len());
            firsts.push(first);
        }
        first += size;
    }
    (pile, firsts)
}

/// The dark area after all exposures; their outlines are those of the pile, in order.
fn painted(exposures: &[Exposure], pile: &Pile, circles: &[Circle]) -> Region {
    let mut layers = layers(exposures, pile, &mut |part| Ok(trace(part, Fill::NonZero))).unwrap_or_default();
    rebuild::region(&layer(&mut layers, false).dark, circles, FRAGMENT_NM)
}

/// The layers of the exposures, each united by `unite`. The error is the number of the outline, counted over
/// all exposures, at which `unite` failed.
fn layers(
    exposures: &[Exposure],
    pile: &Pile,
    unite: &mut dyn FnMut(&Pile) -> Result<Vec<Shape>, usize>,
) -> Result<Vec<Layer>, usize> {
    let mut outlines = pile.outlines();
    let mut layers: Vec<Layer> = Vec::new();
    let mut before = 0;
    for same in exposures.chunk_by(|one, two| one.clear == two.clear) {
        let count: usize = same.iter().map(|exposure| exposure.outlines.len()).sum();
        let mut part = Pile::default();
        for outline in outlines.by_ref().take(count) {
            part.edges.extend_from_slice(outline);
            part.ends.push(part.edges.len());
        }
        let is_clear = same.first().is_some_and(|exposure| exposure.clear);
        if !is_clear || !layers.is_empty() {
            let shapes = unite(&part).map_err(|outline| before + outline)?;
            layers.push(match is_clear {
                true => Layer { clear: shapes, dark: Vec::new() },
                false => Layer { clear: Vec::new(), dark: shapes },
            });
        }
        before += count;
    }
    Ok(layers)
}
