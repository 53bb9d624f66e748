//! Classifies the closed loops of an outline layer: boards, cut-outs, and loops that are neither.
//!
//! ```text
//!   ┌───────────────┐
//!   │ ▪  ┌──┐    ▪  │     a loop that holds pads or holes is a board; a loop inside it is cut out
//!   │    └──┘    ▪  │     (a loop around a whole board, without other copper, is a frame, however near)
//!   └───────────────┘
//!   ├─── ┌────┐ ────┤     a loop that holds nothing is no board: the box of a dimension, a title block
//!        └────┘
//! ```

use super::faces::Piece;
use super::outline::{CHORD_ERROR_MM, Stroke, holds, near};
use super::split::meetings;
use crate::geometry::{
    Bounds, Index, Island, Path, Point, Region, grow, path_area_mm2, path_bounds, segment_bounds,
};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};

/// Two loops at most this far apart, in mm, are one line drawn twice.
const SAME_MM: f64 = 0.15;
/// Of two loops at most this far apart, in mm, only one is an edge: no board has so narrow a rim.
const DOUBLE_MM: f64 = 0.5;
/// An empty loop around a board, at most this far from its edge, in mm, may be the real edge.
const NEAR_MM: f64 = 5.0;
/// This number of pads in a loop inside a board makes the loop a board as well.
const OWN_PADS: usize = 3;
/// If a hole covers at least this share of a loop, the loop only marks the hole.
const SHOWN_SHARE: f64 = 0.8;
const MOST_PIECES: usize = 2_000;

#[derive(Debug, Default)]
pub(super) struct Content {
    pub(super) pads: Vec<Point>,
    pub(super) tracks: Vec<Stroke>,
    pub(super) holes: Vec<(Point, Length)>,
}

impl Content {
    /// True if a track crosses the stroke: then the stroke can't be a board edge.
    pub(super) fn crosses(&self, stroke: Stroke) -> bool {
        let around = segment_bounds(stroke.0, stroke.1);
        let ends = |(from, segment): Stroke| [from, segment.to()];
        self.tracks.iter().any(|&track| {
            let free =
                |point: &Point| ends(stroke).into_iter().chain(ends(track)).all(|end| !near(end, *point));
            segment_bounds(track.0, track.1).meets(around) && meetings(stroke, track).iter().any(free)
        })
    }
}

/// A loop that is no board.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeftOut {
    pub(super) bounds: Bounds,
    /// True if it shares an edge with a board.
    pub(super) adjoins: bool,
    /// Holes in it that are in no board. More than 0 for a frame around a board.
    pub(super) holes: usize,
    /// The only board in it and its mean distance from it, in mm, if it may be the board's edge.
    pub(super) near: Option<(Bounds, f64)>,
}

#[derive(Debug, Default)]
pub(super) struct Boards {
    pub(super) region: Region,
    /// Loops that hold nothing.
    pub(super) left_out: Vec<LeftOut>,
    /// Number of segments of loops in a board that its tracks cross, or that leave out its content.
    pub(super) crossed: usize,
}

struct Cell {
    outer: Path,
    piece: usize,
    area_mm2: f64,
    kids: Vec<usize>,
    anchors: usize,
    pads: usize,
    ends: usize,
}

/// Classifies the loops. If no loop holds anything, every outer loop is a board and every loop inside one a
/// cut-out.
pub(super) fn boards(mut pieces: Vec<Piece>, content: &Content) -> Boards {
    // The rim runs clockwise, so its area is negative: the largest piece is first.
    pieces.sort_by(|a, b| path_area_mm2(&a.rim).total_cmp(&path_area_mm2(&b.rim)));
    pieces.truncate(MOST_PIECES);
    let mut sorter = Sorter::of(&pieces, content);
    let inner: BTreeSet<usize> = sorter.cells.iter().flat_map(|cell| cell.kids.iter().copied()).collect();
    let roots: Vec<usize> = (0..pieces.len()).filter(|piece| !inner.contains(piece)).collect();
    if sorter.cells.len() > 1 {
        sorter.count();
    }
    for piece in roots {
        sorter.outside(piece);
    }
    let mut out = sorter.out;
    let area = |island: &Island| path_area_mm2(&island.outer);
    out.region.islands.sort_by(|a, b| area(b).total_cmp(&area(a)));
    out
}

struct Sorter<'a> {
    pieces: &'a [Piece],
    content: &'a Content,
    cells: Vec<Cell>,
    rows: Vec<Vec<usize>>,
    /// True for a piece that is, or holds, a board.
    has_board: Vec<bool>,
    /// Whether any cell has pads or holes; whether any has tracks.
    any: (bool, bool),
    out: Boards,
}

impl<'a> Sorter<'a> {
    fn of(pieces: &'a [Piece], content: &'a Content) -> Self {
        let of_piece = |(piece, own): (usize, &Piece)| {
            let cell = move |outer: &Path| Cell {
                outer: outer.clone(),
                piece,
                area_mm2: path_area_mm2(outer),
                kids: Vec::new(),
                anchors: 0,
                pads: 0,
                ends: 0,
            };
            own.cells.iter().map(cell).collect::<Vec<_>>()
        };
        let mut cells: Vec<Cell> = pieces.iter().enumerate().flat_map(of_piece).collect();
        cells.sort_by(|a, b| a.area_mm2.total_cmp(&b.area_mm2));
        let rings: Vec<(Bounds, Vec<Point>)> = cells
            .iter()
            .map(|cell| (path_bounds(&cell.outer), cell.outer.flattened(CHORD_ERROR_MM)))
            .collect();
        for (piece, own) in pieces.iter().enumerate() {
            let at = own.rim.start;
            let around = cells
                .iter_mut()
                .zip(&rings)
                .find(|(cell, (bounds, ring))| cell.piece != piece && bounds.contains(at) && holds(ring, at));
            if let Some((cell, _)) = around {
                cell.kids.push(piece);
            }
        }
        let mut rows = vec![Vec::new(); pieces.len()];
        for (at, cell) in cells.iter().enumerate().rev() {
            if let Some(row) = rows.get_mut(cell.piece) {
                row.push(at);
            }
        }
        let has_board = vec![true; pieces.len()];
        Self { pieces, content, cells, rows, has_board, any: (false, false), out: Boards::default() }
    }

    fn count(&mut self) {
        let rim = |kid: &usize| self.pieces.get(*kid).map(|piece| piece.rim.clone());
        let island = |cell: &Cell| Island {
            outer: cell.outer.clone(),
            holes: cell.kids.iter().filter_map(rim).collect(),
        };
        let index = Index::of(&Region { islands: self.cells.iter().map(island).collect() });
        let least: Vec<f64> = self.cells.iter().map(|cell| across_mm(path_bounds(&cell.outer))).collect();
        let shown =
            |cell: usize, size: Length| least.get(cell).is_some_and(|least| size.mm() >= SHOWN_SHARE * least);
        let sizes: BTreeMap<Point, Length> = self.content.holes.iter().copied().collect();
        let pads = self.content.pads.iter().map(|&pad| (pad, sizes.get(&pad).copied(), true));
        let holes = self.content.holes.iter().map(|&(at, size)| (at, Some(size), false));
        for (at, size, is_pad) in pads.chain(holes) {
            let Some(found) = index.island_at(at) else { continue };
            if let Some(cell) =
                self.cells.get_mut(found).filter(|_| !size.is_some_and(|size| shown(found, size)))
            {
                cell.anchors += 1;
                cell.pads += usize::from(is_pad);
            }
        }
        let ends = self.content.tracks.iter().flat_map(|(from, segment)| [*from, segment.to()]);
        for found in ends.filter_map(|end| index.island_at(end)) {
            if let Some(cell) = self.cells.get_mut(found) {
                cell.ends += 1;
            }
        }
        let any = |count: fn(&Cell) -> usize| self.cells.iter().any(|cell| count(cell) > 0);
        self.any = (any(|cell| cell.anchors), any(|cell| cell.ends));
        self.has_board = vec![false; self.pieces.len()];
        // A cell is larger than the cells inside it.
        for (at, cell) in self.cells.iter().enumerate() {
            let below = cell.kids.iter().any(|&kid| self.has_board.get(kid) == Some(&true));
            if (below || self.is_board(at))
                && let Some(has) = self.has_board.get_mut(cell.piece)
            {
                *has = true;
            }
        }
    }

    fn is_board(&self, cell: usize) -> bool {
        self.cells.get(cell).is_some_and(|cell| match self.any {
            (true, _) => cell.anchors > 0,
            (false, true) => cell.ends > 0,
            (false, false) => true,
        })
    }

    /// True if a cell is a frame around a board: it has holes, no copper, and holds a whole board.
    fn is_frame(&self, cell: usize, kids: &[usize]) -> bool {
        let is_bare =
            self.cells.get(cell).is_some_and(|cell| cell.anchors > 0 && cell.pads == 0 && cell.ends == 0);
        let is_own = |kid: &usize| self.cells_of(*kid).into_iter().any(|cell| self.is_own_board(cell));
        is_bare && kids.iter().any(is_own) && self.width_mm(cell, kids) > SAME_MM
    }

    /// True if a cell is only a loop around boards. Content between two loops that are near each other shows
    /// that the outer one is the edge.
    fn is_empty_loop(&self, cell: usize, kids: &[usize]) -> bool {
        let width_mm = self.width_mm(cell, kids);
        let is_empty = if width_mm <= DOUBLE_MM {
            self.cells.get(cell).is_some_and(|cell| cell.anchors + cell.ends == 0)
        } else {
            !self.is_board(cell)
        };
        is_empty && width_mm > SAME_MM && kids.iter().any(|&kid| self.has_board(kid))
    }

    fn cells_of(&self, piece: usize) -> Vec<usize> {
        self.rows.get(piece).cloned().unwrap_or_default()
    }

    fn kids(&self, cell: usize) -> Vec<usize> {
        self.cells.get(cell).map(|cell| cell.kids.clone()).unwrap_or_default()
    }

    fn has_board(&self, piece: usize) -> bool {
        self.has_board.get(piece) == Some(&true)
    }

    /// A piece outside every board.
    fn outside(&mut self, piece: usize) {
        let cells = self.cells_of(piece);
        let adjoins = cells.iter().any(|&cell| self.is_board(cell));
        for at in cells {
            let kids = self.kids(at);
            if self.is_frame(at, &kids) || self.is_empty_loop(at, &kids) {
                self.leave_out(at, adjoins && !self.is_board(at));
                kids.into_iter().for_each(|kid| self.outside(kid));
            } else if self.is_board(at) || kids.iter().any(|&kid| self.has_board(kid)) {
                self.board(at, &kids);
            } else if !adjoins || !self.is_sliver(at) {
                self.leave_out(at, adjoins);
            }
        }
    }

    fn leave_out(&mut self, cell: usize, adjoins: bool) {
        let Some(own) = self.cells.get(cell) else { return };
        let mut boards = own.kids.iter().copied().filter(|&kid| self.has_board(kid));
        // A loop around several boards is the frame of a panel.
        let (only, other) = (boards.next(), boards.next());
        let width_mm = self.width_mm(cell, &own.kids);
        let inner = only.filter(|_| other.is_none() && width_mm <= NEAR_MM);
        let inner = inner.and_then(|kid| self.pieces.get(kid)).map(|piece| path_bounds(&piece.rim));
        let near = inner.map(|inner| (inner, width_mm));
        let left = LeftOut { bounds: path_bounds(&own.outer), adjoins, holes: own.anchors, near };
        self.out.left_out.push(left);
    }

    /// A cell that is a board. In a narrow one, the loops that hold boards repeat its own edge.
    fn board(&mut self, cell: usize, kids: &[usize]) {
        let width_mm = self.width_mm(cell, kids);
        let mut holes = Vec::new();
        let mut next = Vec::new();
        let mut kids = kids.to_vec();
        while let Some(kid) = kids.pop() {
            let cells = self.cells_of(kid);
            let own = cells.iter().any(|&cell| self.is_own_board(cell));
            let segments = self.pieces.get(kid).map_or(0, |piece| piece.rim.segments.len());
            if width_mm <= DOUBLE_MM && self.has_board(kid) || own && self.is_crossed(kid) {
                self.out.crossed += if width_mm <= SAME_MM { 0 } else { segments };
                kids.extend(cells.into_iter().flat_map(|cell| self.kids(cell)));
                continue;
            }
            holes.extend(self.pieces.get(kid).map(|piece| piece.rim.clone()));
            next.extend(cells);
        }
        holes.sort_by(|a, b| path_area_mm2(a).total_cmp(&path_area_mm2(b)));
        let Some(outer) = self.cells.get(cell).map(|cell| cell.outer.clone()) else { return };
        self.out.region.islands.push(Island { outer, holes });
        for cell in next {
            let kids = self.kids(cell);
            if self.is_own_board(cell) {
                self.board(cell, &kids);
                continue;
            }
            for kid in kids {
                let before = self.out.left_out.len();
                self.outside(kid);
                self.out.left_out.truncate(before);
            }
        }
    }

    /// True if a cell inside a board holds enough pads to be a board itself.
    fn is_own_board(&self, cell: usize) -> bool {
        self.cells.get(cell).is_some_and(|cell| cell.pads >= OWN_PADS)
    }

    fn is_crossed(&self, piece: usize) -> bool {
        let rim = self.pieces.get(piece).map(|piece| &piece.rim);
        rim.is_some_and(|rim| rim.pieces().any(|stroke| self.content.crosses(stroke)))
    }

    /// True if a cell is nowhere wider than the distance of an edge drawn twice.
    fn is_sliver(&self, cell: usize) -> bool {
        let Some(cell) = self.cells.get(cell) else { return true };
        let whole = Region { islands: vec![Island { outer: cell.outer.clone(), holes: Vec::new() }] };
        grow(&whole, Length::from_mm(-DOUBLE_MM / 2.0)).is_empty()
    }

    /// Mean width of a cell without the area of its `kids`.
    fn width_mm(&self, cell: usize, kids: &[usize]) -> f64 {
        let rims = kids.iter().filter_map(|&kid| self.pieces.get(kid)).map(|piece| &piece.rim);
        let outer = self.cells.get(cell).map(|cell| &cell.outer);
        let (area, length) = outer
            .into_iter()
            .chain(rims)
            .fold((0.0, 0.0), |(area, length), path| (area + path_area_mm2(path), length + path.length_mm()));
        2.0 * area / f64::max(length, 1e-9)
    }
}

fn across_mm(bounds: Bounds) -> f64 {
    f64::min((bounds.max.x - bounds.min.x).mm(), (bounds.max.y - bounds.min.y).mm())
}

pub(super) fn alone(path: Path) -> Option<Piece> {
    let area = path_area_mm2(&path);
    let back = path.reversed();
    let (outer, rim) = if area > 0.0 { (path, back) } else { (back, path) };
    (area != 0.0).then(|| Piece { cells: vec![outer], rim })
}
