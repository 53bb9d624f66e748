//! The 3D view: sends the carved board to the picture tile by tile, and the tool at its position.
//!
//! ```text
//! carved ─ same blank? ─┬─ no ──▶ the relief and all cut tiles, above and below
//!                       └─ yes ─▶ changed tiles only
//! ```

use crate::engine::messages::UnderTile;
use crate::keys::Tab;
use crate::page::{board, read, shared};
use crate::picture;
use crate::screens::canvas::{Picture, with_view};
use crate::screens::shown::Shown;
use crate::view::{Cutting, PATCH, Patch, Relief};
use annulus_core::artwork::{Role, Side};
use annulus_core::board::COPPER_THICKNESS;
use annulus_core::job::Bit;
use annulus_core::sim::{Stock, TILE, Tile};
use leptos::prelude::*;
use std::sync::Arc;

const _: () = assert!(TILE == PATCH, "tiles of the stock are tiles of the picture");

pub(crate) fn in_space(picture: Picture, ready: RwSignal<bool>, shown: Memo<Option<Arc<Shown>>>) {
    let low = Memo::new(move |_| {
        let low_mm = read(|m| m.play.carved.as_ref().map(|stock| stock.low_mm()))?;
        shown.with(|shown| Some(shown.as_ref()?.picture_of_work(low_mm)))
    });
    Effect::new(move |before: Option<Option<Seen>>| {
        let (stock, under) = (shared(|m| &m.play.carved).get(), shared(|m| &m.underside.tiles).get());
        let (ready, low) = (ready.get(), low.get());
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
        let on = ready.get() && read(|m| m.play.in_space() && m.frame.tab == Tab::Simulate);
        with_view(picture, |view| view.show_solid(on));
    });
    Effect::new(move |_| {
        let tool = if read(|m| m.play.in_space()) { cutting(shown) } else { None };
        if ready.get() {
            with_view(picture, |view| view.set_cutting(tool));
        }
    });
}

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
    let faces = shared(|m| &m.board.laid).with_untracked(|laid| {
        let layers = laid.iter().flat_map(|laid| &laid.laid.layers);
        layers.filter(|layer| layer.role == Role::Copper && layer.side != Some(Side::Inner)).count()
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

fn cutting(shown: Memo<Option<Arc<Shown>>>) -> Option<Cutting> {
    let now = board::moment()?;
    let [x, y, z] = now.position_mm;
    let at = shown.with(|shown| Some(shown.as_ref()?.picture_of_work([x, y])))?;
    let shape = |bit: &Bit| {
        let tip_mm = [at[0], at[1], z as f32];
        shared(|m| &m.job.work).with(|work| picture::cutting(bit, work.as_deref(), tip_mm))
    };
    shared(|m| &m.board.program).with(|program| Some(shape(program.as_ref()?.bits.get(now.bit? as usize)?)))
}
