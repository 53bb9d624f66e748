//! The net of every island of a painted layer, from the X2 attributes of the objects on it.
//!
//! ```text
//!   island 0 ── flash "GND", stroke "GND", contour "GND"  ⇒ GND
//!   island 1 ── flash "A", flash "B"                      ⇒ A, and a diagnostic: a short, or a net tie
//!   island 2 ── no attributes                             ⇒ none
//! ```

use super::flatten::each;
use super::object::{Gerber, ObjectShape, Tag};
use crate::geometry::{Index, PathSegment, Point, Region};
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The result, by island.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Nets {
    /// The net of every island.
    pub names: Vec<Option<String>>,
    /// The first pads of every island, like `R1.2`, or a part, like `R1`; empty if the layer names none.
    pub pads: Vec<Option<String>>,
    /// Islands with several nets, and their nets.
    pub meeting: Vec<(usize, Vec<String>)>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NamedPad {
    pub at: Point,
    /// Part and pin, like `R1.2`, or only the part.
    pub name: String,
    /// Its net, if named.
    pub net: Option<String>,
    /// The smaller side; zero if the shape is a macro.
    pub across: Length,
}

const MOST_NAMED: usize = 20_000;

/// The named pads of `layer`, in its order.
pub fn named_pads(layer: &Gerber) -> Vec<NamedPad> {
    let mut pads = Vec::new();
    each(layer, &mut |seen| {
        let ObjectShape::Flash { at } = seen.object.shape else { return };
        let tag = layer.tags.get(seen.tag as usize).filter(|_| !seen.clear && pads.len() < MOST_NAMED);
        if let Some((tag, name)) = tag.and_then(|tag| Some((tag, pad_name(tag)?))) {
            let net = tag.net.clone().filter(|net| !net.is_empty());
            pads.push(NamedPad { at: seen.place.point(at), name, net, across: seen.across(layer) });
        }
    });
    pads
}

pub fn nets(layer: &Gerber, region: &Region) -> Nets {
    let mut votes: Vec<BTreeMap<&str, usize>> = vec![BTreeMap::new(); region.islands.len()];
    let mut pads: Vec<BTreeSet<(usize, String)>> = Vec::new();
    let says = |tag: &Tag| tag.net.is_some() || tag.component.is_some();
    if layer.tags.iter().any(says) {
        let index = Index::of(region);
        pads.resize(region.islands.len(), BTreeSet::new());
        each(layer, &mut |seen| {
            let tag = layer.tags.get(seen.tag as usize).filter(|tag| !seen.clear && says(tag));
            let Some(tag) = tag else { return };
            let inner = |point: Point| index.island_at(seen.place.point(point));
            let island = match &seen.object.shape {
                ObjectShape::Flash { at } => inner(*at),
                ObjectShape::Stroke { from, segment } => inner(*from).or_else(|| inner(segment.to())),
                ObjectShape::Contour(path) => path
                    .pieces()
                    .zip(path.pieces().skip(1))
                    .take(CORNERS_LOOKED_AT)
                    .find_map(|((from, first), (_, second))| inner(inside(from, first, second))),
                ObjectShape::Repeat { .. } => None,
            };
            let Some(island) = island else { return };
            let net = tag.net.as_deref().filter(|net| !net.is_empty());
            if let (Some(net), Some(votes)) = (net, votes.get_mut(island)) {
                *votes.entry(net).or_default() += 1;
            }
            if let (Some(pad), Some(pads)) = (pad_name(tag), pads.get_mut(island)) {
                // Shortest names first: R2 before R10.
                pads.insert((pad.len(), pad));
                if pads.len() > PADS_NAMED {
                    pads.pop_last();
                }
            }
        });
    }
    let most = |votes: &BTreeMap<&str, usize>| {
        votes
            .iter()
            .max_by_key(|(name, count)| (**count, std::cmp::Reverse(**name)))
            .map(|(name, _)| (*name).to_owned())
    };
    let names = votes.iter().map(most).collect();
    let several = votes.iter().enumerate().filter(|(_, votes)| votes.len() > 1);
    let meeting =
        several.map(|(island, votes)| (island, votes.keys().map(|&name| name.to_owned()).collect()));
    let named = |pads: &BTreeSet<(usize, String)>| {
        let names: Vec<&str> = pads.iter().map(|(_, name)| name.as_str()).collect();
        (!names.is_empty()).then(|| names.join("+"))
    };
    let mut pads: Vec<Option<String>> = pads.iter().map(named).collect();
    if pads.iter().all(Option::is_none) {
        pads.clear();
    }
    Nets { names, pads, meeting: meeting.collect() }
}

const PADS_NAMED: usize = 2;

/// The name of a pad: part and pin, or only the part.
fn pad_name(tag: &Tag) -> Option<String> {
    let part = tag.component.as_deref().filter(|part| !part.is_empty())?;
    let pin = tag.pin.as_deref().filter(|pin| !pin.is_empty());
    Some(pin.map_or_else(|| part.to_owned(), |pin| format!("{part}.{pin}")))
}

const CORNERS_LOOKED_AT: usize = 16;

/// A point near the corner between two segments, on the inner side.
fn inside(from: Point, first: PathSegment, second: PathSegment) -> Point {
    let (corner, to) = (first.to(), second.to());
    let near = |a: f64, b: f64, c: f64| b + ((a + c) / 2.0 - b) * 0.01;
    Point::from_mm(near(from.x.mm(), corner.x.mm(), to.x.mm()), near(from.y.mm(), corner.y.mm(), to.y.mm()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artwork::Overrides;

    #[test]
    fn islands_have_the_nets_of_their_objects() {
        let text = "%FSLAX33Y33*%%MOMM*%%ADD10C,1*%D10*%TO.N,GND*%X0Y0D03*X0Y0D02*X5000D01*\
            %TO.N,A*%X0Y5000D03*%TO.N,B*%X500Y5000D03*%TD*%X0Y9000D03*\
            %TO.N,C*%G36*X0Y20000D02*X5000D01*Y22000D01*X0D01*Y20000D01*G37*M02*";
        let (gerber, _) = super::super::read("t", text.as_bytes(), &Overrides::default());
        let found = nets(&gerber, &super::super::painted(&gerber).unwrap());
        let mut names: Vec<_> = found.names.iter().map(|name| name.as_deref().unwrap_or("-")).collect();
        names.sort_unstable();
        assert_eq!(names, ["-", "A", "C", "GND"]);
        assert_eq!(found.meeting.len(), 1);
        assert_eq!(found.meeting[0].1, ["A", "B"]);
    }

    #[test]
    fn pads_are_named_by_part_and_pin() {
        let text = "%FSLAX33Y33*%%MOMM*%%ADD10C,1.5*%%ADD11R,2X0.8*%D10*%TO.N,GND*%%TO.P,J1,1*%X1000Y2000D03*\
            D11*%TO.P,J1,2,VBUS*%%TO.N,*%X4000Y2000D03*%TD*%X9000Y0D03*M02*";
        let (gerber, _) = super::super::read("t", text.as_bytes(), &Overrides::default());
        let pads = named_pads(&gerber);
        let rows: Vec<_> =
            pads.iter().map(|pad| (pad.name.as_str(), pad.net.as_deref(), pad.across.mm())).collect();
        assert_eq!(rows, [("J1.1", Some("GND"), 1.5), ("J1.2", None, 0.8)]);
        assert_eq!(pads[1].at, Point::from_mm(4.0, 2.0));
    }
}
