//! The side of a board that was made before, carved, as seen on the underside.
//!
//! ```text
//!   side before ─ plan ─▶ cuts ─▶ stock as it was then ─ flipped ─▶ tiles of depths from below
//! ```

use super::cache::Cache;
use super::messages::{ToPlan, ToUnderside, UnderTile};
use super::planning;
use annulus_core::cam::toolpaths::PlacedBoard;
use annulus_core::cam::work::Flip;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::sim::{self, Stock};

/// The cuts from below when the current side starts; empty for the first side.
pub(super) fn underside(wanted: &ToUnderside, cache: &mut Cache) -> Result<Vec<UnderTile>, Vec<Diagnostic>> {
    let work = &wanted.plan.work;
    let scene = PlacedBoard::of(cache.board(wanted.plan.board_key)?, work);
    let before = work.faces().into_iter().next().filter(|face| *face != work.setup.face);
    let (Some(before), Some(turning)) = (before, scene.turning()) else { return Ok(Vec::new()) };
    let mut plan: ToPlan = wanted.plan.clone();
    plan.work.setup.face = before;
    let side = planning::side(&plan, cache, &mut |_, _| {})?;
    let origin = side.program.origin;
    let as_it_lay = |at: Point| {
        let at = turning.point(Point::new(at.x + scene.origin.x, at.y + scene.origin.y));
        Point::new(at.x - origin.x, at.y - origin.y)
    };
    let bounds = Bounds::of(as_it_lay(wanted.bounds.min)).with(as_it_lay(wanted.bounds.max));
    let thickness = plan.machine.machine()?.process.board_thickness;
    let uncut = Stock::new(bounds, thickness).map_err(|why| vec![why])?;
    let mut stock = work.point_deg().into_iter().fold(uncut, Stock::with_points);
    for cut in sim::cuts(&side.program) {
        if let Some(bit) = side.program.bits.get(cut.bit as usize) {
            stock.carve(&cut.way, bit, 0.0, 1.0);
        }
    }
    let turned = stock.flipped(work.setup.flip == Flip::LeftRight, wanted.bounds.min);
    let tiles = turned.tiles().filter_map(|tile| {
        let first = tile.first.map(|cell| cell as u32);
        Some(UnderTile { first, depths_um: tile.depths_um?.to_vec() })
    });
    Ok(tiles.collect())
}
