//! The copper of a board's sides, painted, with the nets of its islands.
//!
//! Comes in: an [`Artwork`] and the board so far, for its outline. Goes out: one [`Copper`] a side, and remarks. Painting
//! takes its time: only who needs areas calls this.
//!
//! ```text
//!  positive: ▰ is copper        negative (%IPNEG): the outline less what is drawn is copper
//! ```

use super::{Board, Copper, Face, rivals};
use crate::artwork::{Artwork, FileRead, Gerber, Role, Side, nets, painted};
use crate::geometry::{Point, Region, Rule, combine};
use crate::remark::{Remark, Weight};

/// What is said of a second layer for one side: of one that is the same, and of another one, which a person has to see.
const TWO: [(Weight, &str); 2] = [(Weight::Note, "board.same_copper"), (Weight::Loss, "board.two_coppers")];

/// Paints the copper layers of the set into the board: of each side the one among `used`, else the first beside the
/// board's drill file, else the first.
pub(super) fn add(board: &mut Board, artwork: &Artwork, used: &[usize], remarks: &mut Vec<Remark>) {
    for (face, side) in [(Face::Top, Side::Top), (Face::Bottom, Side::Bottom)] {
        let mut layers = layers(artwork, used, (Role::Copper, side), board.sources.first()).into_iter();
        let Some((file, layer)) = layers.next() else { continue };
        let rivals = rivals::layers(file, layers.map(|(file, _)| file), TWO);
        remarks.extend(rivals.into_iter().map(|remark| remark.with("side", side.name())));
        let drawn = match painted(layer) {
            Ok(drawn) => drawn,
            Err(much) => {
                remarks.push(much.remark(&file.name));
                continue;
            }
        };
        let region = if layer.negative_image { inverted(board, file, &drawn, remarks) } else { drawn };
        let found = nets(layer, &region);
        for (island, names) in found.meeting {
            let at = region.islands.get(island).map_or(Point::default(), |island| island.outer.start);
            remarks.push(
                Remark::new(Weight::Doubt, "board.nets_meet")
                    .at(&file.name, 0, 0)
                    .with("nets", names.join(", "))
                    .with("x", format!("{:.3}", at.x.mm()))
                    .with("y", format!("{:.3}", at.y.mm())),
            );
        }
        remarks.extend(file.remarks.iter().cloned());
        let source = board.sources.len() as u32;
        board.sources.push(file.name.clone());
        board.copper.push(Copper { face, region, nets: found.names, pads: found.pads, source });
    }
    remarks.extend(inner(artwork, !board.copper.is_empty()));
    let better = artwork.files.iter().flat_map(|file| &file.remarks);
    remarks.extend(better.filter(|remark| remark.code == "set.better_layer").cloned());
}

/// Tells that inner copper is no side that can be milled; beside a side's copper that is what one expects.
fn inner(artwork: &Artwork, has_side: bool) -> Option<Remark> {
    let inner = |file: &&FileRead| file.role == Role::Copper && file.side == Some(Side::Inner);
    let mut layers = artwork.files.iter().filter(inner);
    let first = layers.next()?;
    let weight = if has_side { Weight::Note } else { Weight::Doubt };
    let told = Remark::new(weight, "board.inner_copper").at(&first.name, 0, 0);
    Some(told.with("count", 1 + layers.count()))
}

/// The layers of this role on a side, the one that is taken first.
pub(super) fn layers<'a>(
    artwork: &'a Artwork,
    used: &[usize],
    (role, side): (Role, Side),
    drill: Option<&String>,
) -> Vec<(&'a FileRead, &'a Gerber)> {
    let folder = |name: &str| name.rfind(['/', '\\']).map_or(0, |at| at + 1);
    let beside = |file: &FileRead| {
        drill.is_some_and(|drill| file.name.get(..folder(&file.name)) == drill.get(..folder(drill)))
    };
    let layers = artwork.files.iter().enumerate().filter_map(|(index, file)| {
        let fits = file.role == role && file.side == Some(side);
        Some((index, file, file.gerber.as_ref().filter(|_| fits)?))
    });
    let mut layers: Vec<(usize, &FileRead, &Gerber)> = layers.collect();
    layers.sort_by_key(|&(index, file, _)| (!used.contains(&index), !beside(file), index));
    layers.into_iter().map(|(_, file, gerber)| (file, gerber)).collect()
}

/// The outline less what is drawn.
fn inverted(board: &Board, file: &FileRead, drawn: &Region, remarks: &mut Vec<Remark>) -> Region {
    if board.outline.is_empty() {
        remarks.push(Remark::new(Weight::Loss, "board.negative_without_outline").at(&file.name, 0, 0));
    }
    combine(&board.outline, drawn, Rule::Difference)
}
