//! The board in space: what is carved goes to the picture, tile by tile, with the tool at its place.
//!
//! ```text
//! carved ─ the same blank? ─┬─ no ──▶ relief, all tiles that are cut, above and below
//!                           └─ yes ─▶ tiles that are others than before
//! ```
//!
//! Comes in: the stock on show, the playback. Goes out: tiles and a tool for the view. Knows no GPU.

use crate::engine::messages::UnderTile;
use crate::keys::Tab;
use crate::page::{frame, open_board, open_job, play};
use crate::picture;
use crate::screens::canvas::{Picture, with_view};
use crate::screens::shown::Shown;
use crate::view::{Cutting, PATCH, Patch, Relief};
use annulus_core::board::COPPER_THICKNESS;
use annulus_core::job::Bit;
use annulus_core::sim::{Stock, TILE, Tile};
use leptos::prelude::*;
use std::sync::Arc;

const _: () = assert!(TILE == PATCH, "tiles of the stock are tiles of the picture");

/// Whatever is carved goes to the picture.
pub(crate) fn in_space(picture: Picture, ready: RwSignal<bool>, shown: Memo<Option<Arc<Shown>>>) {
    let play = play();
    let low = Memo::new(move |_| {
        let low_mm = play.carved.with(|stock| stock.as_ref().map(|stock| stock.low_mm()))?;
        shown.with(|shown| Some(shown.as_ref()?.picture_of_work(low_mm)))
    });
    Effect::new(move |before: Option<Option<Seen>>| {
        let (ready, stock, low, under) = (ready.get(), play.carved.get(), low.get(), play.under.get());
        let (Some(stock), Some(low), true) = (stock, low, ready) else {
            with_view(picture, |view| view.set_relief(None));
            return None;
        };
        let kept = before.flatten().filter(|old| old.low_mm == low && is_same_blank(&old.stock, &stock));
        with_view(picture, |view| {
            match &kept {
                Some(old) => view.patch(&stock.changed(&old.stock).map(patch).collect::<Vec<_>>()),
                None => {
                    view.set_relief(Some(relief(&stock, low)));
                    let cut = stock.tiles().filter(|tile| tile.depths_um.is_some());
                    view.patch(&cut.map(patch).collect::<Vec<_>>());
                }
            }
            if kept.as_ref().map_or(!under.is_empty(), |old| !Arc::ptr_eq(&old.under, &under)) {
                view.set_under(under.iter().map(below).collect());
            }
        });
        Some(Seen { low_mm: low, stock, under })
    });
    Effect::new(move |_| {
        let on = ready.get() && play.in_space.get() && frame().tab.get() == Tab::Simulate;
        with_view(picture, |view| view.show_solid(on));
    });
    Effect::new(move |_| {
        let tool = if play.in_space.get() { cutting(shown) } else { None };
        if ready.get() {
            with_view(picture, |view| view.set_cutting(tool));
        }
    });
}

/// What the picture shows.
#[derive(Clone)]
struct Seen {
    low_mm: [f32; 2],
    stock: Arc<Stock>,
    under: Arc<Vec<UnderTile>>,
}

fn below(tile: &UnderTile) -> Patch {
    Patch { first: tile.first.map(|cell| cell as usize), depths_um: Some(tile.depths_um.as_slice().into()) }
}

fn is_same_blank(old: &Stock, new: &Stock) -> bool {
    let shape = |stock: &Stock| (stock.low_mm(), stock.cells(), stock.cell_mm(), stock.thickness_mm());
    shape(old) == shape(new)
}

fn patch(tile: Tile<'_>) -> Patch {
    Patch { first: tile.first, depths_um: tile.depths_um.cloned() }
}

fn relief(stock: &Stock, low_mm: [f32; 2]) -> Relief {
    let faces = open_board().laid.with_untracked(|laid| {
        let layers = laid.iter().flat_map(|laid| &laid.laid.layers);
        layers.filter(|layer| layer.role == "copper" && layer.side.as_deref() != Some("inner")).count()
    });
    Relief {
        low_mm,
        cell_mm: stock.cell_mm() as f32,
        cells: stock.cells(),
        thickness_mm: stock.thickness_mm() as f32,
        copper_mm: COPPER_THICKNESS.mm() as f32,
        both_sides: faces > 1,
    }
}

/// The tool at its place.
fn cutting(shown: Memo<Option<Arc<Shown>>>) -> Option<Cutting> {
    let now = play().now()?;
    let [x, y, z] = now.position_mm;
    let at = shown.with(|shown| Some(shown.as_ref()?.picture_of_work([x, y])))?;
    let shape = |bit: &Bit| {
        let tip_mm = [at[0], at[1], z as f32];
        open_job().work.with(|work| picture::cutting(bit, work.as_deref(), tip_mm))
    };
    open_board().program.with(|program| Some(shape(program.as_ref()?.bits.get(now.bit? as usize)?)))
}
