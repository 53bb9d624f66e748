//! A carved board as plain data: a depth field in tiles, and the tool above it.

use std::sync::Arc;

pub const PATCH: usize = 64;

/// The blank.
#[derive(Clone, Debug, PartialEq)]
pub struct Relief {
    pub low_mm: [f32; 2],
    pub cell_mm: f32,
    pub cells: [usize; 2],
    pub thickness_mm: f32,
    pub copper_mm: f32,
    /// There is copper on the lower side too.
    pub both_sides: bool,
}

/// The current state of a tile: depths in µm, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    pub first: [usize; 2],
    /// None if nothing is cut.
    pub depths_um: Option<Arc<[u16]>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cutting {
    pub tip_mm: [f32; 3],
    /// Radius of its flat end.
    pub end_mm: f32,
    pub radius_mm: f32,
    /// Rise of the edge per mm of radius; 0 for a cylinder.
    pub slope: f32,
}

/// All tiles of a board, to upload them again to a new device.
#[derive(Clone, Debug, PartialEq)]
pub struct ReliefField {
    pub relief: Relief,
    tiles: Vec<Option<Arc<[u16]>>>,
    /// Cuts from below; empty if there are none.
    under: Vec<Patch>,
}

impl Relief {
    pub fn tiles(&self) -> [usize; 2] {
        self.cells.map(|cells| cells.div_ceil(PATCH))
    }

    /// Lower left and upper right corner.
    pub fn bounds_mm(&self) -> [[f64; 2]; 2] {
        let low = self.low_mm.map(f64::from);
        let size = self.cells.map(|cells| cells as f64 * f64::from(self.cell_mm));
        [low, [low[0] + size[0], low[1] + size[1]]]
    }
}

impl ReliefField {
    /// Without cuts.
    pub fn new(relief: Relief) -> Self {
        let [across, up] = relief.tiles();
        Self { relief, tiles: vec![None; across * up], under: Vec::new() }
    }

    pub fn set(&mut self, patch: &Patch) {
        let [x, y] = patch.first.map(|cell| cell / PATCH);
        let across = self.relief.tiles()[0];
        if let Some(tile) = self.tiles.get_mut(y * across + x).filter(|_| x < across) {
            tile.clone_from(&patch.depths_um);
        }
    }

    pub fn set_under(&mut self, under: Vec<Patch>) {
        self.under = under;
    }

    pub fn under(&self) -> &[Patch] {
        &self.under
    }

    /// The tiles with cuts.
    pub fn cut(&self) -> impl Iterator<Item = Patch> + '_ {
        let across = self.relief.tiles()[0];
        self.tiles.iter().enumerate().filter_map(move |(index, tile)| {
            let depths_um = Some(tile.clone()?);
            Some(Patch { first: [index % across * PATCH, index / across * PATCH], depths_um })
        })
    }

    /// Depth at a position, µm; 0 outside the board.
    pub fn depth_um(&self, at_mm: [f64; 2]) -> u16 {
        let [low, high] = self.relief.bounds_mm();
        if (0..2).any(|axis| at_mm[axis] < low[axis] || at_mm[axis] >= high[axis]) {
            return 0;
        }
        let [x, y] = [0, 1].map(|axis| ((at_mm[axis] - low[axis]) / f64::from(self.relief.cell_mm)) as usize);
        let tile = self.tiles.get(y / PATCH * self.relief.tiles()[0] + x / PATCH).and_then(Option::as_ref);
        tile.and_then(|tile| tile.get(y % PATCH * PATCH + x % PATCH)).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tile_depth_is_returned_at_its_position() {
        let relief = Relief {
            low_mm: [-1.0, -2.0],
            cell_mm: 0.1,
            cells: [100, 70],
            thickness_mm: 1.6,
            copper_mm: 0.035,
            both_sides: false,
        };
        let mut field = ReliefField::new(relief);
        assert_eq!(field.cut().count(), 0);
        let depths = |depth: u16| Some(Arc::from(vec![depth; PATCH * PATCH]));
        field.set(&Patch { first: [64, 64], depths_um: depths(300) });
        field.set(&Patch { first: [128, 0], depths_um: depths(7) });
        let places = [([5.5, 4.5], 300), ([5.3, 4.5], 0), ([5.5, 4.3], 0), ([9.5, 4.5], 0), ([-9.0, 0.0], 0)];
        for (at, depth) in places {
            assert_eq!(field.depth_um(at), depth, "{at:?}");
        }
        let cut: Vec<_> = field.cut().map(|patch| patch.first).collect();
        assert_eq!(cut, [[64, 64]], "a tile beside the board is not there");
        field.set(&Patch { first: [64, 64], depths_um: None });
        assert_eq!(field.cut().count(), 0);
    }
}
