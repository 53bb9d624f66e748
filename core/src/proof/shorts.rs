//! Pieces of copper with two or more nets: where the gaps between these are narrowest.
//!
//! ```text
//!    ███ A ███┐                copper left between nets (░) is a bridge if it touches A and B. From every
//!      ░░░░░░░│░░              contact with one net, the search finds the nearest visible contact with
//!    ███ B ███████             another: through the bridge, between sides that face each other
//! ```

use super::cures;
use super::edges::{Edge, Edges, Spot, around, between, spots};
use super::finding::{Finding, FindingKind};
use super::scene::Scene;
use crate::geometry::{CombineRule, Island, Region, combine, island_area_mm2};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};

/// Copper within this of a net touches it, in mm: tolerance of chords and whole nanometres.
const TOUCH_MM: f64 = 0.004;
const STEP_MM: f64 = 0.05;
const MOST_PLACES: f64 = 20_000.0;
/// Gaps within this, in mm, are equally narrow: the middle one is reported.
const EQUAL_MM: f64 = 0.001;
const REACH_MM: f64 = 3.0;
/// Larger than the rounding of the cross product of an edge and a direction, in mm².
const ROUNDED_MM2: f64 = 1e-9;
/// Number of nearest points tried from one contact.
const LOOKS: usize = 6;

#[derive(Clone, Copy, Debug)]
struct Gap {
    width: f64,
    from: Spot,
    to: Spot,
    /// The sides can see each other.
    seen: bool,
}

/// By nets; the narrowest, and equally narrow ones.
type Gaps = BTreeMap<(u32, u32), Vec<Gap>>;

struct Bridge<'a> {
    scene: &'a Scene<'a>,
    all: &'a Edges,
    number: u32,
    nets: BTreeSet<u32>,
    /// Parts of its edges that touch a net; `island` is that net. The bridge is on their left.
    contacts: Edges,
    /// The net of each of their cells, if it is the only one.
    owners: Vec<Option<u32>>,
    /// Mean width in mm: that of a strip with its area and perimeter.
    thickness: f64,
    /// The narrowest milled cut, in mm.
    tool: f64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Sight {
    /// Through the bridge; in a gap narrower than every tool, between the nets.
    Copper,
    Gap,
    Blind,
}

/// Every pair of nets in one piece of copper that nothing separates. Calls `progress` with the bridges done
/// and their number.
pub(super) fn shorts(scene: &Scene<'_>, progress: &mut dyn FnMut(u64, u64)) -> Vec<Finding> {
    let shorted = |piece: u32| scene.nets_in(piece).is_some_and(|nets| nets.len() > 1);
    let pieces = (0..).zip(&scene.left.islands).filter(|(piece, _)| shorted(*piece));
    let bad = Region { islands: pieces.map(|(_, island)| island.clone()).collect() };
    if bad.is_empty() {
        return Vec::new();
    }
    let between_nets = combine(&bad, &scene.copper, CombineRule::Difference);
    let all = Edges::of(&between_nets);
    let mut findings = Vec::new();
    let mut told: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for (number, island) in (0..).zip(&between_nets.islands) {
        progress(u64::from(number), between_nets.islands.len() as u64);
        let Some(bridge) = bridge(scene, &all, number, island) else { continue };
        let Some(piece) = super::scene::inner_spot(island).and_then(|spot| scene.left_edges.island_at(spot))
        else {
            continue;
        };
        let gaps = gaps(&bridge);
        let joined = groups(&bridge.nets, &narrow(&bridge, &gaps));
        for ((one, other), mut equal) in gaps {
            told.entry(piece).or_default().extend([one, other]);
            equal.sort_by_key(|gap| micrometres(gap.from.towards(gap.to, 0.5)));
            let Some(&gap) = equal.get(equal.len() / 2) else { continue };
            let finding = finding(&bridge, one, other, gap);
            // Nets that narrow gaps connect are not reported again where they are far apart.
            if finding.kind == FindingKind::Gap || joined.get(&one) != joined.get(&other) {
                findings.push(finding);
            }
        }
    }
    findings.extend(untold(scene, &told));
    findings
}

/// In whole micrometres, so that rounding does not decide an order.
fn micrometres(spot: Spot) -> (i64, i64) {
    (libm::round(spot.x * 1e3) as i64, libm::round(spot.y * 1e3) as i64)
}

/// The bridge of this island, if it touches two nets.
fn bridge<'a>(scene: &'a Scene<'a>, all: &'a Edges, number: u32, island: &Island) -> Option<Bridge<'a>> {
    let rings: Vec<Vec<Spot>> = island.paths().map(spots).collect();
    let pairs = || rings.iter().flat_map(|ring| ring.iter().zip(ring.iter().skip(1)));
    let length: f64 = pairs().map(|(a, b)| a.distance(*b)).sum();
    let step = STEP_MM.max(length / MOST_PLACES);
    let (mut nets, mut contacts) = (BTreeSet::new(), Vec::new());
    for (&a, &b) in pairs() {
        let count = libm::ceil(a.distance(b) / step).max(1.0) as usize;
        for index in 0..count {
            let at = |part: f64| a.towards(b, (index as f64 + part) / count as f64);
            if let Some((_, _, edge)) = scene.design.nearest(at(0.5), TOUCH_MM, &|_| true) {
                let net = scene.net(edge.island);
                nets.insert(net);
                contacts.push(Edge { from: at(0.0), to: at(1.0), island: net, ring: 0 });
            }
        }
    }
    (nets.len() > 1).then(|| {
        let contacts = Edges::loose(contacts);
        Bridge {
            scene,
            all,
            number,
            nets,
            owners: contacts.owners(),
            contacts,
            thickness: 2.0 * island_area_mm2(island) / length.max(TOUCH_MM),
            tool: scene.narrowest().map_or(0.0, Length::mm),
        }
    })
}

/// The narrowest gap of every pair of neighbours; then of every group of nets not yet connected with the
/// others.
fn gaps(bridge: &Bridge<'_>) -> Gaps {
    let mut gaps = Gaps::new();
    look(bridge, Sight::Copper, &|_| true, &|one, other| one != other, &mut gaps);
    // Each blind round at least halves the number of groups.
    for sight in std::iter::once(Sight::Gap).chain([Sight::Blind; 32]) {
        let group = groups(&bridge.nets, &gaps);
        let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
        for (_, contact) in bridge.contacts.iter() {
            *sizes.entry(group.get(&contact.island).copied().unwrap_or_default()).or_default() += 1;
        }
        if sizes.len() < 2 {
            break;
        }
        // All but the largest group search for the others.
        let largest = sizes.iter().max_by_key(|(_, size)| **size).map(|(group, _)| *group);
        let last = bridge.nets.last().copied().unwrap_or_default();
        let group: Vec<Option<u32>> = (0..=last).map(|net| group.get(&net).copied()).collect();
        let of = |net: u32| group.get(net as usize).copied().flatten();
        let looks = |net: u32| of(net) != largest;
        let apart = |one: u32, other: u32| of(one) != of(other);
        look(bridge, sight, &looks, &apart, &mut gaps);
    }
    gaps
}

fn narrow(bridge: &Bridge<'_>, gaps: &Gaps) -> Gaps {
    let fits_not = |gap: &Gap| bridge.width(*gap) < bridge.tool;
    let narrow = gaps.iter().filter(|(_, equal)| equal.first().is_some_and(fits_not));
    narrow.map(|(pair, equal)| (*pair, equal.clone())).collect()
}

/// Groups of nets connected by gaps: each net with the lowest net of its group.
fn groups(nets: &BTreeSet<u32>, gaps: &Gaps) -> BTreeMap<u32, u32> {
    let mut group: BTreeMap<u32, u32> = nets.iter().map(|&net| (net, net)).collect();
    for (one, other) in gaps.keys() {
        let (Some(&a), Some(&b)) = (group.get(one), group.get(other)) else { continue };
        let (least, most) = (a.min(b), a.max(b));
        group.values_mut().filter(|net| **net == most).for_each(|net| *net = least);
    }
    group
}

/// Searches from every contact of a net for which `looks` is true for the nearest other net.
fn look(
    bridge: &Bridge<'_>,
    sight: Sight,
    looks: &impl Fn(u32) -> bool,
    other: &impl Fn(u32, u32) -> bool,
    gaps: &mut Gaps,
) {
    for (_, contact) in bridge.contacts.iter().filter(|(_, contact)| looks(contact.island)) {
        let net = contact.island;
        let spot = contact.middle();
        let Some((at, theirs)) = bridge.nearest(&contact, sight, &|theirs| other(net, theirs)) else {
            continue;
        };
        let width = spot.distance(at);
        // From the net with the lower number to the other.
        let (from, to) = if net < theirs { (spot, at) } else { (at, spot) };
        let gap = Gap { width, from, to, seen: sight != Sight::Blind };
        let known = gaps.entry((net.min(theirs), net.max(theirs))).or_default();
        let narrowest = known.first().map_or(f64::MAX, |gap| gap.width);
        if width < narrowest - EQUAL_MM {
            known.clear();
        }
        if width <= narrowest + EQUAL_MM {
            known.push(gap);
        }
    }
}

/// True if `to` is on the left of `edge`, seen from `from` on it.
fn faces(edge: &Edge, from: Spot, to: Spot) -> bool {
    let (along, way) = (edge.to.minus(edge.from), to.minus(from));
    along.x * way.y - along.y * way.x >= 0.0
}

/// True if a point is certainly on the right of `edge`, so that neither it nor anything beyond [`faces`] the
/// edge.
fn is_behind(edge: &Edge, at: Spot) -> bool {
    let (along, way) = (edge.to.minus(edge.from), at.minus(edge.from));
    along.x * way.y - along.y * way.x < -ROUNDED_MM2
}

impl Bridge<'_> {
    /// The nearest visible contact of another net from `contact`, and its net.
    fn nearest(&self, contact: &Edge, sight: Sight, other: &impl Fn(u32) -> bool) -> Option<(Spot, u32)> {
        let spot = contact.middle();
        if sight == Sight::Blind {
            let found = self.contacts.nearest(spot, f64::MAX, &|edge| other(edge.island));
            return found.map(|(_, at, edge)| (at, edge.island));
        }
        let (mut looks, mut done, mut radius) = (0, -1.0, self.contacts.cell().min(REACH_MM));
        let mut near: Vec<(f64, u32, Spot, u32)> = Vec::new();
        let wanted = |cell: usize| self.owners.get(cell).copied().flatten().is_none_or(other);
        loop {
            near.clear();
            self.contacts.ahead(contact, (done, radius), &wanted, &mut |index, edge| {
                let away = is_behind(contact, edge.from) && is_behind(contact, edge.to);
                if away || is_behind(edge, spot) || !other(edge.island) {
                    return;
                }
                let at = edge.near(spot);
                let distance = at.distance(spot);
                let new = distance > done && distance <= radius;
                if new && faces(contact, spot, at) && faces(edge, at, spot) {
                    near.push((distance, index, at, edge.island));
                }
            });
            near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            near.dedup_by_key(|(_, index, _, _)| *index);
            for (_, _, at, net) in near.iter().copied() {
                if self.sees(spot, at, sight) {
                    return Some((at, net));
                }
                looks += 1;
                if looks == LOOKS {
                    return None;
                }
            }
            if radius >= REACH_MM {
                return None;
            }
            (done, radius) = (radius, (radius * 2.0).min(REACH_MM));
        }
    }

    fn sees(&self, from: Spot, to: Spot, sight: Sight) -> bool {
        let (middle, width) = (from.towards(to, 0.5), from.distance(to));
        // Across a gap that is already cut, sides see each other, but nothing connects them.
        let here = || self.all.island_at(middle) == Some(self.number);
        if sight == Sight::Copper && width >= self.tool {
            return here() && !self.all.cross(from, to, TOUCH_MM);
        }
        (sight != Sight::Copper || width <= 2.0 * TOUCH_MM || here()) && free(self.scene, from, to)
    }

    /// Largest tool width for this gap, in mm: at most the bridge's width if the sides don't see each other.
    fn width(&self, gap: Gap) -> f64 {
        if gap.seen { gap.width } else { gap.width.min(self.thickness) }
    }
}

/// True if the straight line between two points crosses no copper of the design.
fn free(scene: &Scene<'_>, from: Spot, to: Spot) -> bool {
    let middle = from.towards(to, 0.5);
    from.distance(to) <= 2.0 * TOUCH_MM
        || (scene.design.island_at(middle).is_none() && !scene.design.cross(from, to, TOUCH_MM))
}

/// Improves a gap to the nearby minimum: contacts were only sampled.
fn refined(scene: &Scene<'_>, one: u32, other: u32, gap: Gap) -> Gap {
    let mut best = gap;
    let (low, high) = around(gap.from, gap.to, STEP_MM * 2.0);
    let mut near: [Vec<Edge>; 2] = [Vec::new(), Vec::new()];
    scene.design.in_box(low, high, &mut |_, edge| {
        let net = scene.net(edge.island);
        match near.each_mut() {
            [ours, _] if net == one => ours.push(*edge),
            [_, theirs] if net == other => theirs.push(*edge),
            _ => {}
        }
    });
    let [ours, theirs] = near;
    if ours.len() * theirs.len() > 40_000 {
        return best;
    }
    for a in &ours {
        for b in &theirs {
            let (width, from, to) = between(a, b);
            let middle = from.towards(to, 0.5);
            let near = middle.distance(gap.from.towards(gap.to, 0.5)) <= STEP_MM * 2.0;
            if width < best.width - EQUAL_MM && near && free(scene, from, to) {
                best = Gap { width, from, to, ..gap };
            }
        }
    }
    best
}

fn finding(bridge: &Bridge<'_>, one: u32, other: u32, gap: Gap) -> Finding {
    let scene = bridge.scene;
    let gap = if gap.seen { refined(scene, one, other, gap) } else { gap };
    let middle = gap.from.towards(gap.to, 0.5).point();
    let tool = scene.narrowest();
    let fits = |width: Length| tool.is_none_or(|tool| width >= tool);
    let kind = if fits(Length::from_mm(bridge.width(gap))) { FindingKind::Short } else { FindingKind::Gap };
    let width = Length::from_mm(if kind == FindingKind::Gap { bridge.width(gap) } else { gap.width });
    let mut finding = Finding::new(kind, middle, width, vec![scene.label(one), scene.label(other)]);
    finding.tool = tool;
    finding.ends = Some((gap.from.point(), gap.to.point()));
    // A tool that fits elsewhere may be used at other gaps only: offer it here too.
    if width > Length::ZERO {
        finding.cures = cures::for_gap(scene, width);
    }
    finding
}

/// Nets that share a piece with others although no gap was found: reported at a position on them.
fn untold(scene: &Scene<'_>, told: &BTreeMap<u32, BTreeSet<u32>>) -> Vec<Finding> {
    let mut findings = Vec::new();
    for kept in scene.kept.iter().flatten() {
        let net = scene.net(kept.island);
        let Some(nets) = scene.nets_in(kept.piece).filter(|nets| nets.len() > 1) else { continue };
        let known = told.get(&kept.piece);
        if known.is_some_and(|known| known.contains(&net)) {
            continue;
        }
        // Paired with a reported net, if there is one, else with the lowest other net.
        let partner = known
            .and_then(|known| known.iter().next())
            .or_else(|| nets.iter().find(|&&other| other != net))
            .copied()
            .unwrap_or(net);
        let names = vec![scene.label(net), scene.label(partner)];
        let mut finding = Finding::new(FindingKind::Short, kept.spot.point(), Length::ZERO, names);
        finding.tool = scene.narrowest();
        findings.push(finding);
    }
    findings
}
