//! The board as placed on the machine: panels, pin holes, flipped. Each function makes a board from a board,
//! so planning and proof need no special cases.
//!
//! ```text
//!   panel        ┌──┐┌──┐      pins    ┌────┐         flipped     ┌────┐ X (or Y) mirrored about the
//!                │ F││ F│            o │ F  │ o                   │  ꟻ │ middle of the outline's box,
//!                └──┘└──┘              └────┘                     └────┘ so the box stays where it is
//! ```

use super::{Board, Copper, Hole, Legend, Slot};
use crate::artwork::NamedPad;
use crate::geometry::{Bounds, Island, Placement, Point, QUARTER_MDEG, Region};
use crate::units::Length;

impl Board {
    /// Bounds of the outline; without an outline of holes, slots and copper; `None` for an empty board.
    pub fn extent(&self) -> Option<Bounds> {
        let all = || {
            let copper = self.copper.iter().filter_map(|copper| copper.region.bounds());
            let boxes = copper.chain(self.outer_bounds());
            boxes.reduce(|all, bounds| all.with(bounds.min).with(bounds.max))
        };
        self.outline.bounds().or_else(all)
    }

    #[must_use]
    pub fn placed(&self, placement: &Placement) -> Self {
        let hole = |hole: &Hole| Hole { at: placement.point(hole.at), ..hole.clone() };
        let slot = |slot: &Slot| {
            let path = slot.path.iter().map(|&point| placement.point(point)).collect();
            Slot { path, ..slot.clone() }
        };
        Self {
            holes: self.holes.iter().map(hole).collect(),
            slots: self.slots.iter().map(slot).collect(),
            outline: placement.region(&self.outline),
            copper: self.copper.iter().map(|copper| placed_copper(copper, placement)).collect(),
            legend: self.legend.iter().map(|legend| placed_legend(legend, placement)).collect(),
            name: self.name.clone(),
            sources: self.sources.clone(),
        }
    }

    /// A panel: the first copy keeps its position, the others follow in +X and +Y, with `gap` between the
    /// bounds of neighbours. Each copy has its own nets.
    #[must_use]
    pub fn panelled(&self, columns: u32, rows: u32, gap: Length) -> Self {
        let Some(bounds) = self.extent().filter(|_| columns > 1 || rows > 1) else { return self.clone() };
        let pitch = Point::new(bounds.max.x - bounds.min.x + gap, bounds.max.y - bounds.min.y + gap);
        let mut panel = self.clone();
        for copy in 1..columns.max(1) * rows.max(1) {
            let (column, row) = (copy % columns.max(1), copy / columns.max(1));
            let shift = Point::new(pitch.x * i64::from(column), pitch.y * i64::from(row));
            let mut next = self.placed(&Placement { mirror: false, rotation_mdeg: 0, shift });
            for copper in &mut next.copper {
                let renamed = |net: &String| format!("{net}#{}", copy + 1);
                copper.nets = copper.nets.iter().map(|net| net.as_ref().map(renamed)).collect();
                copper.pads = copper.pads.iter().map(|pad| pad.as_ref().map(renamed)).collect();
            }
            panel.holes.append(&mut next.holes);
            panel.slots.append(&mut next.slots);
            panel.outline.islands.append(&mut next.outline.islands);
            for (all, mut more) in panel.copper.iter_mut().zip(next.copper) {
                all.nets.append(&mut more.nets);
                all.pads.append(&mut more.pads);
                all.named.append(&mut more.named);
                all.region.islands.append(&mut more.region.islands);
            }
            for (all, mut more) in panel.legend.iter_mut().zip(next.legend) {
                all.strokes.append(&mut more.strokes);
                all.flashes += more.flashes;
            }
        }
        panel
    }

    /// Adds `pairs` of pin holes of `diameter` on both sides of the flip axis, `margin` beyond the outline.
    /// They are left and right if X is mirrored (`mirror_x`), else in front and at the back. Their spacing is
    /// uneven, so that a board flipped the wrong way doesn't fit. They are the last holes.
    #[must_use]
    pub fn pinned(&self, pairs: u32, diameter: Length, margin: Length, mirror_x: bool) -> Self {
        let mut board = self.clone();
        let Some(bounds) = self.extent().filter(|_| pairs > 0) else { return board };
        let source = board.sources.len() as u32;
        board.sources.push("pins".to_owned());
        let share = |low: Length, high: Length, pair: u32| {
            let (part, whole) = (i64::from(3 * pair + 1), i64::from(3 * pairs));
            low + Length::from_nm((high - low).nm() * part / whole)
        };
        for pair in 0..pairs {
            let places = if mirror_x {
                let y = share(bounds.min.y, bounds.max.y, pair);
                [Point::new(bounds.min.x - margin, y), Point::new(bounds.max.x + margin, y)]
            } else {
                let x = share(bounds.min.x, bounds.max.x, pair);
                [Point::new(x, bounds.min.y - margin), Point::new(x, bounds.max.y + margin)]
            };
            let hole = |at| Hole {
                at,
                diameter: Some(diameter),
                plated: Some(false),
                source,
                tool_code: 0,
                line: 0,
            };
            board.holes.extend(places.map(hole));
        }
        board
    }

    /// Flips the board: X or Y mirrored about the centre of its bounds. The names of the sides stay.
    #[must_use]
    pub fn turned(&self, mirror_x: bool) -> Self {
        self.turning(mirror_x).map_or_else(|| self.clone(), |placement| self.placed(&placement))
    }

    /// The placement of a flip; `None` for an empty board.
    pub fn turning(&self, mirror_x: bool) -> Option<Placement> {
        let bounds = self.extent()?;
        // Mirroring X and rotating by 180° mirrors Y.
        let turn = if mirror_x { 0 } else { 2 * QUARTER_MDEG };
        let plain = Placement { mirror: true, rotation_mdeg: turn, shift: Point::default() };
        let corner = plain.point(if mirror_x {
            Point::new(bounds.max.x, bounds.min.y)
        } else {
            Point::new(bounds.min.x, bounds.max.y)
        });
        let shift = Point::new(bounds.min.x - corner.x, bounds.min.y - corner.y);
        Some(Placement { shift, ..plain })
    }
}

fn placed_legend(legend: &Legend, placement: &Placement) -> Legend {
    let strokes = legend.strokes.iter().map(|stroke| placement.path(stroke)).collect();
    Legend { strokes, ..legend.clone() }
}

/// Places copper; the order of its islands may change, with their nets and pads.
fn placed_copper(copper: &Copper, placement: &Placement) -> Copper {
    let mut islands: Vec<_> = copper
        .region
        .islands
        .iter()
        .zip(copper.nets.iter().map(Some).chain(std::iter::repeat(None)))
        .zip(copper.pads.iter().map(Some).chain(std::iter::repeat(None)))
        .map(|((island, net), pad)| {
            let outer = placement.outline(&island.outer).from_its_left();
            let mut holes: Vec<_> =
                island.holes.iter().map(|hole| placement.outline(hole).from_its_left()).collect();
            holes.sort_unstable();
            (Island { outer, holes }, (net.cloned().flatten(), pad.cloned().flatten()))
        })
        .collect();
    islands.sort_unstable();
    let (islands, names): (Vec<_>, Vec<_>) = islands.into_iter().unzip();
    let (nets, pads): (Vec<_>, Vec<_>) = names.into_iter().unzip();
    let nets = if copper.nets.is_empty() { Vec::new() } else { nets };
    let pads = if copper.pads.is_empty() { Vec::new() } else { pads };
    let named = copper.named.iter().map(|pad| NamedPad { at: placement.point(pad.at), ..pad.clone() });
    Copper { region: Region { islands }, nets, pads, named: named.collect(), ..copper.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::Face;
    use crate::geometry::{area_mm2, circle, rectangle, union};

    fn at(x: f64, y: f64) -> Point {
        Point::from_mm(x, y)
    }

    fn board() -> Board {
        let outline = union(&[rectangle(Bounds::of(at(1.0, 2.0)).with(at(11.0, 8.0)))]);
        let pads = [circle(at(2.0, 3.0), Length::from_mm(1.0)), circle(at(7.0, 6.0), Length::from_mm(2.0))];
        let region = union(&pads);
        let small_first = region.islands[0].outer.length_mm() < 4.0;
        let nets = if small_first { ["A", "B"] } else { ["B", "A"] };
        let nets = nets.map(|net| Some(net.to_owned())).to_vec();
        let hole = Hole {
            at: at(2.0, 3.0),
            diameter: Some(Length::from_mm(0.8)),
            plated: None,
            source: 0,
            tool_code: 1,
            line: 1,
        };
        let copper = vec![Copper { face: Face::Bottom, region, nets, ..Copper::default() }];
        Board { holes: vec![hole], outline, copper, ..Board::default() }
    }

    #[test]
    fn board_flipped_twice_is_unchanged() {
        for mirror_x in [true, false] {
            let turned = board().turned(mirror_x);
            assert_eq!(turned.extent(), board().extent());
            let wanted = if mirror_x { at(10.0, 3.0) } else { at(2.0, 7.0) };
            assert_eq!(turned.holes[0].at, wanted);
            let small =
                turned.copper[0].region.islands.iter().position(|i| i.outer.length_mm() < 4.0).unwrap();
            assert_eq!(turned.copper[0].nets[small].as_deref(), Some("A"));
            assert!((area_mm2(&turned.outline) - 60.0).abs() < 1e-6);
            let again = turned.turned(mirror_x);
            assert_eq!(again.holes, board().holes);
            assert!((area_mm2(&again.copper[0].region) - area_mm2(&board().copper[0].region)).abs() < 1e-9);
        }
    }

    #[test]
    fn alignment_pins_coincide_after_the_flip() {
        for mirror_x in [true, false] {
            let pinned = board().pinned(2, Length::from_mm(3.0), Length::from_mm(4.0), mirror_x);
            let pins = |board: &Board| {
                let mut places: Vec<Point> = board.holes[1..].iter().map(|hole| hole.at).collect();
                places.sort_unstable();
                places
            };
            assert_eq!(pins(&pinned).len(), 4);
            assert_eq!(pins(&pinned.turned(mirror_x)), pins(&pinned));
            assert_ne!(pins(&pinned.turned(!mirror_x)), pins(&pinned), "the wrong way round must not fit");
        }
    }

    #[test]
    fn panel_copies_keep_spacing_and_separate_nets() {
        let panel = board().panelled(3, 2, Length::from_mm(2.0));
        assert_eq!((panel.holes.len(), panel.outline.islands.len()), (6, 6));
        assert_eq!(panel.holes[5].at, at(2.0 + 2.0 * 12.0, 3.0 + 8.0));
        let mut nets: Vec<_> = panel.copper[0].nets.iter().flatten().collect();
        nets.sort_unstable();
        nets.dedup();
        assert_eq!(nets.len(), 12);
    }
}
