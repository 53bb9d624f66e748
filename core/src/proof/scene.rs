//! Common data of a proof: the islands with their nets, the cuts, the copper left, and the islands in each
//! piece of it.
//!
//! ```text
//!   blank − strokes of the cuts = left        island ∩ left = `kept`: each piece is in one piece of `left`
//! ```

use super::ProofOptions;
use super::edges::{self, Edge, Edges, Spot, spots};
use super::finding::{Finding, FindingKind};
use super::replay::{PathCut, Still, replay};
use super::strokes::outlines;
use crate::board::{Board, Copper};
use crate::geometry::{
    Bounds, CombineRule, Island, Outlines, Path, Point, Region, combine, island_area_mm2, left_of,
    path_bounds, rectangle,
};
use crate::job::{Bit, Program};
use crate::units::Length;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// Margin of the blank beyond copper and cuts if there is no outline.
const RIM: Length = Length::from_um(2_000);
/// Limit of a toolpath's segments swept at once, because a long toolpath crosses many bands.
const SWEPT: usize = 512;
/// Edges nearer than this, in mm, may cross: chords of both.
const TOUCH_MM: f64 = 0.003;
const DUST_MM2: f64 = 1e-6;

const CUT: u64 = 3;
const PAINTED: u64 = 50;
pub(super) const MADE: u64 = 58;

#[derive(Clone, Copy, Debug)]
pub(super) struct Kept {
    pub(super) island: u32,
    pub(super) piece: u32,
    pub(super) area_mm2: f64,
    pub(super) spot: Spot,
}

pub(super) struct Scene<'a> {
    pub(super) board: &'a Board,
    pub(super) programs: &'a [Program],
    pub(super) options: &'a ProofOptions,
    /// The islands that shall stay, as far as they are on the blank.
    pub(super) copper: Cow<'a, Region>,
    pub(super) design: Edges,
    /// The net of every island: index into `labels`.
    pub(super) net_of: Vec<u32>,
    pub(super) labels: Vec<String>,
    pub(super) cuts: Vec<PathCut>,
    pub(super) bits_used: Vec<&'a Bit>,
    /// The narrowest milled cut through the copper: its width at the surface and at the underside.
    pub(super) narrowest_cut: Option<(Length, Length)>,
    without_bit: Option<Point>,
    /// With the index of the program.
    still: Vec<(u32, Still)>,
    pub(super) left: Region,
    pub(super) left_edges: Edges,
    /// The remaining pieces of islands, in the order of `kept_region`.
    pub(super) kept: Vec<Option<Kept>>,
    pub(super) kept_region: Region,
    pub(super) nets_in: Vec<BTreeSet<u32>>,
}

impl<'a> Scene<'a> {
    /// `None` if that side has no copper. The callback gets the percentage done.
    pub(super) fn new(
        board: &'a Board,
        programs: &'a [Program],
        options: &'a ProofOptions,
        tell: &mut dyn FnMut(u64),
    ) -> Option<Self> {
        let copper = board.copper.iter().find(|copper| copper.face == options.face)?;
        let mut cuts = Vec::new();
        let (mut without_bit, mut still) = (None, Vec::new());
        for (index, program) in (0..).zip(programs) {
            let played = replay(program, index, options.copper_thickness);
            cuts.extend(played.cuts);
            without_bit = without_bit.or(played.without_bit);
            still.extend(played.still.into_iter().map(|still| (index, still)));
        }
        let outline = Some(&board.outline).filter(|outline| !outline.is_empty());
        let blank = outline.cloned().unwrap_or_else(|| around(copper, &cuts));
        let (copper, design, net_of, labels) = islands(copper, outline);
        tell(CUT);
        let left = left(&blank, &cuts);
        tell(PAINTED);
        let left_edges = Edges::of(&left);
        let kept_region = kept_region((&copper, &design), (&left, &left_edges));
        let kept: Vec<Option<Kept>> =
            kept_region.islands.iter().map(|island| kept(island, &design, &left_edges)).collect();

        let mut nets_in = vec![BTreeSet::new(); left.islands.len()];
        for kept in kept.iter().flatten() {
            if let (Some(nets), Some(&net)) =
                (nets_in.get_mut(kept.piece as usize), net_of.get(kept.island as usize))
            {
                nets.insert(net);
            }
        }
        Some(Self {
            board,
            programs,
            options,
            copper,
            design,
            net_of,
            labels,
            bits_used: bits_used(&cuts, programs),
            narrowest_cut: narrowest_cut(&cuts, programs),
            cuts,
            without_bit,
            still,
            left,
            left_edges,
            kept,
            kept_region,
            nets_in,
        })
    }

    pub(super) fn net(&self, island: u32) -> u32 {
        self.net_of.get(island as usize).copied().unwrap_or_default()
    }

    pub(super) fn label(&self, net: u32) -> String {
        self.labels.get(net as usize).cloned().unwrap_or_default()
    }

    /// The nets in a piece of the copper left.
    pub(super) fn nets_in(&self, piece: u32) -> Option<&BTreeSet<u32>> {
        self.nets_in.get(piece as usize)
    }

    pub(super) fn bit(&self, cut: &PathCut) -> Option<&'a Bit> {
        self.programs.get(cut.program as usize)?.bits.get(cut.bit as usize)
    }

    /// The narrowest cut through the copper, at the surface, that is milled.
    pub(super) fn narrowest(&self) -> Option<Length> {
        self.narrowest_cut.map(|(surface, _)| surface)
    }

    pub(super) fn without_bit(&self) -> Vec<Finding> {
        let finding = |at| Finding::new(FindingKind::NoBit, at, Length::ZERO, Vec::new());
        self.without_bit.map(finding).into_iter().collect()
    }

    pub(super) fn still(&self) -> Vec<Finding> {
        let finding = |&(program, still): &(u32, Still)| Finding {
            leg: Some((program, still.leg)),
            mark: Some(still.mark),
            ..Finding::new(FindingKind::Still, still.at, still.depth, Vec::new())
        };
        self.still.iter().map(finding).collect()
    }
}

fn bits_used<'a>(cuts: &[PathCut], programs: &'a [Program]) -> Vec<&'a Bit> {
    let used: BTreeSet<(u32, u32)> = cuts.iter().map(|cut| (cut.program, cut.bit)).collect();
    let bit = |(program, bit): (u32, u32)| programs.get(program as usize)?.bits.get(bit as usize);
    used.into_iter().filter_map(bit).collect()
}

fn narrowest_cut(cuts: &[PathCut], programs: &[Program]) -> Option<(Length, Length)> {
    let milled = cuts.iter().filter(|cut| !cut.is_drilled(programs));
    milled.filter_map(|cut| Some((cut.surface, cut.through?))).min()
}

fn left(blank: &Region, cuts: &[PathCut]) -> Region {
    let through = cuts.iter().filter_map(|cut| Some((&cut.path, cut.through?)));
    let pieces: Vec<(&Path, usize, Length)> = through
        .flat_map(|(path, width)| {
            let count = path.segments.len().div_ceil(SWEPT).max(1);
            (0..count).map(move |piece| (path, piece, width))
        })
        .collect();
    // Two sides, each with a corner to every segment, and two caps.
    let size = |&(path, piece, width): &(&Path, usize, Length)| {
        let piece = swept(path, piece);
        (path_bounds(&piece).grown(width), 4 * piece.segments.len() + 4)
    };
    let sizes: Vec<(Bounds, usize)> = pieces.iter().map(size).collect();
    let make = |number: usize| {
        let piece = pieces.get(number);
        piece.map_or_else(Vec::new, |&(path, piece, width)| outlines(&swept(path, piece), width))
    };
    let ground: Vec<Path> = blank.paths().cloned().collect();
    left_of(&ground, &Outlines { sizes: &sizes, make: &make })
}

/// Piece number `piece` of a toolpath: at most [`SWEPT`] segments.
fn swept(path: &Path, piece: usize) -> Cow<'_, Path> {
    if path.segments.len() <= SWEPT {
        return Cow::Borrowed(path);
    }
    let first = piece * SWEPT;
    let before = first.checked_sub(1).and_then(|before| path.segments.get(before));
    let start = before.map_or(path.start, |before| before.to());
    Cow::Owned(Path { start, segments: path.segments.iter().skip(first).take(SWEPT).copied().collect() })
}

/// A blank slightly larger than copper and cuts.
fn around(copper: &Copper, cuts: &[PathCut]) -> Region {
    let widest = cuts.iter().map(|cut| cut.surface).max().unwrap_or_default();
    let toolpaths = Bounds::around(cuts.iter().flat_map(|cut| cut.path.flattened(0.01)));
    let toolpaths = toolpaths.map(|bounds| bounds.grown(widest));
    let both = copper.region.bounds().into_iter().chain(toolpaths).reduce(|a, b| a.with(b.min).with(b.max));
    both.map_or_else(Region::default, |bounds| {
        let outer = rectangle(bounds.grown(RIM));
        Region { islands: vec![Island { outer, holes: Vec::new() }] }
    })
}

/// The islands on the blank with their nets, and what people call these: by name, else by pads on them, else by a place.
/// Islands of one name are one net.
fn islands<'a>(
    copper: &'a Copper,
    outline: Option<&Region>,
) -> (Cow<'a, Region>, Edges, Vec<u32>, Vec<String>) {
    let whole = Edges::of(&copper.region);
    let region = match outline {
        Some(outline) if !within(&whole, outline) => {
            Cow::Owned(combine(&copper.region, outline, CombineRule::Intersection))
        }
        _ => Cow::Borrowed(&copper.region),
    };
    let same = *region == copper.region;
    let mut labels: Vec<String> = Vec::new();
    let mut known: BTreeMap<String, u32> = BTreeMap::new();
    let mut net_of = Vec::new();
    for (index, island) in (0..).zip(&region.islands) {
        let source =
            if same { Some(index) } else { inner_spot(island).and_then(|spot| whole.island_at(spot)) };
        let name = source.and_then(|source| copper.nets.get(source as usize)?.clone());
        let next = labels.len() as u32;
        let net = name.as_ref().map_or(next, |name| *known.entry(name.clone()).or_insert(next));
        if net == next {
            let pad = || source.and_then(|source| copper.pads.get(source as usize)?.clone());
            labels.push(name.or_else(pad).unwrap_or_else(|| place_name(island)));
        }
        net_of.push(net);
    }
    let design = if same { whole } else { Edges::of(&region) };
    (region, design, net_of, labels)
}

fn within(copper: &Edges, outline: &Region) -> bool {
    let body = Edges::of(outline);
    copper.iter().all(|(_, edge)| body.island_at(edge.from).is_some())
}

/// Name of an unnamed island: its leftmost, then lowest corner.
fn place_name(island: &Island) -> String {
    let corner = island.outer.corners().min().unwrap_or_default();
    format!("@{:.2},{:.2}", corner.x.mm(), corner.y.mm())
}

/// The remaining parts of the islands of `copper`. An island without an edge of the copper left nearby is
/// entirely there or gone, so only the others are intersected with their surroundings.
fn kept_region((copper, design): (&Region, &Edges), (left, left_edges): (&Region, &Edges)) -> Region {
    let mut touched = BTreeSet::new();
    for (_, edge) in design.iter() {
        if !touched.contains(&edge.island) {
            let (low, high) = edges::around(edge.from, edge.to, TOUCH_MM);
            let near = &mut |_, other: &Edge| {
                if edges::between(&edge, other).0 <= TOUCH_MM {
                    touched.insert(edge.island);
                }
            };
            left_edges.in_box(low, high, near);
        }
    }
    // Rings entirely inside an island.
    let firsts = left_edges.rings.iter().filter_map(|ring| left_edges.edge(ring.first));
    touched.extend(firsts.filter_map(|edge| design.island_at(edge.from)));
    let (mut cut, mut whole) = (Vec::new(), Vec::new());
    for (number, island) in (0..).zip(&copper.islands) {
        if touched.contains(&number) {
            cut.push(island.clone());
        } else if inner_spot(island).is_some_and(|spot| left_edges.island_at(spot).is_some()) {
            whole.push(island.clone());
        }
    }
    if !cut.is_empty() {
        let cut = Region { islands: cut };
        whole.extend(combine(&cut, &about(left, &cut), CombineRule::Intersection).islands);
        whole.sort();
    }
    Region { islands: whole }
}

/// `region` without the islands and holes that are near no island of `places`.
pub(super) fn about(region: &Region, places: &Region) -> Region {
    let mut boxes: Vec<Bounds> = places.islands.iter().map(|island| path_bounds(&island.outer)).collect();
    boxes.sort_by_key(|place| place.min.x);
    let widest = boxes.iter().map(|place| place.max.x - place.min.x).max().unwrap_or_default();
    let meets = |path: &Path| {
        let bounds = path_bounds(path);
        let first = boxes.partition_point(|place| place.min.x < bounds.min.x - widest);
        let near = boxes.iter().skip(first).take_while(|place| place.min.x <= bounds.max.x);
        near.into_iter().any(|place| place.meets(bounds))
    };
    let islands = region.islands.iter().filter(|island| meets(&island.outer)).map(|island| Island {
        outer: island.outer.clone(),
        holes: island.holes.iter().filter(|hole| meets(hole)).cloned().collect(),
    });
    Region { islands: islands.collect() }
}

fn kept(island: &Island, design: &Edges, left: &Edges) -> Option<Kept> {
    let area = island_area_mm2(island);
    if area < DUST_MM2 {
        return None;
    }
    let spot = inner_spot(island)?;
    Some(Kept { island: design.island_at(spot)?, piece: left.island_at(spot)?, area_mm2: area, spot })
}

/// A point well inside an island: the middle of the widest section of a horizontal line.
pub(super) fn inner_spot(island: &Island) -> Option<Spot> {
    let rings: Vec<Vec<Spot>> = island.paths().map(spots).collect();
    let outer = rings.first()?;
    let low = outer.iter().fold(f64::MAX, |low, spot| low.min(spot.y));
    let high = outer.iter().fold(f64::MIN, |high, spot| high.max(spot.y));
    let mut best: Option<(f64, Spot)> = None;
    // Levels that are not likely to run along an edge.
    for share in [0.503, 0.297, 0.709, 0.113, 0.891] {
        let y = low + (high - low) * share;
        let mut crossings: Vec<f64> = Vec::new();
        for ring in &rings {
            for (a, b) in ring.iter().zip(ring.iter().skip(1)) {
                if (a.y <= y) != (b.y <= y) {
                    crossings.push(a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y));
                }
            }
        }
        crossings.sort_by(f64::total_cmp);
        for pair in crossings.chunks_exact(2) {
            let [from, to] = *pair else { continue };
            if best.is_none_or(|(width, _)| to - from > width) {
                best = Some((to - from, Spot { x: (from + to) / 2.0, y }));
            }
        }
    }
    best.map(|(_, spot)| spot)
}
