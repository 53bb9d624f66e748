//! The copper of a board's sides, painted, with the nets of its islands.
//!
//! Comes in: an [`Artwork`] and the board so far, for its outline. Goes out: one [`Copper`] a side, and diagnostics. Painting
//! takes its time: only who needs areas calls this.
//!
//! ```text
//!  positive: ▰ is copper        negative (%IPNEG): the outline less what is drawn is copper
//! ```

use super::{Board, Copper, Face, rivals};
use crate::artwork::{Artwork, FileRead, Gerber, Role, Side, named_pads, nets, painted};
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::{CombineRule, Point, Region, combine};

/// What is said of a second layer for one side: of one that is the same, and of another one, which a person has to see.
const TWO: [(Severity, &str); 2] =
    [(Severity::Note, "board.same_copper"), (Severity::Error, "board.two_coppers")];

/// Paints the copper layers of the set into the board: of each side the one among `used`, else the first beside the
/// board's drill file, else the first. `progress` is told how many sides are painted.
pub(super) fn add(
    board: &mut Board,
    (artwork, used): (&Artwork, &[usize]),
    diagnostics: &mut Vec<Diagnostic>,
    progress: &mut dyn FnMut(u64, u64),
) {
    let sides = [(Face::Top, Side::Top), (Face::Bottom, Side::Bottom)];
    for (done, (face, side)) in (0..).zip(sides) {
        progress(done, sides.len() as u64);
        let mut layers = layers(artwork, used, (Role::Copper, side), board.sources.first()).into_iter();
        let Some((file, layer)) = layers.next() else { continue };
        let rivals = rivals::layers(file, layers.map(|(file, _)| file), TWO);
        diagnostics.extend(rivals.into_iter().map(|diagnostic| diagnostic.with("side", side.name())));
        let drawn = match painted(layer) {
            Ok(drawn) => drawn,
            Err(much) => {
                diagnostics.push(much.diagnostic(&file.name));
                continue;
            }
        };
        let region = if layer.negative_image { inverted(board, file, &drawn, diagnostics) } else { drawn };
        let found = nets(layer, &region);
        for (island, names) in found.meeting {
            let at = region.islands.get(island).map_or(Point::default(), |island| island.outer.start);
            diagnostics.push(
                Diagnostic::warning("board.nets_meet")
                    .at(&file.name, 0, 0)
                    .with("nets", names.join(", "))
                    .with("x", format!("{:.3}", at.x.mm()))
                    .with("y", format!("{:.3}", at.y.mm())),
            );
        }
        diagnostics.extend(file.diagnostics.iter().cloned());
        let source = board.sources.len() as u32;
        board.sources.push(file.name.clone());
        let named = named_pads(layer);
        board.copper.push(Copper { face, region, nets: found.names, pads: found.pads, named, source });
    }
    diagnostics.extend(inner(artwork, !board.copper.is_empty()));
    let better = artwork.files.iter().flat_map(|file| &file.diagnostics);
    diagnostics.extend(better.filter(|diagnostic| diagnostic.code == "set.better_layer").cloned());
}

/// Tells that inner copper is no side that can be milled; beside a side's copper that is what one expects.
fn inner(artwork: &Artwork, has_side: bool) -> Option<Diagnostic> {
    let inner = |file: &&FileRead| file.role == Role::Copper && file.side == Some(Side::Inner);
    let mut layers = artwork.files.iter().filter(inner);
    let first = layers.next()?;
    let severity = if has_side { Severity::Note } else { Severity::Warning };
    let told = Diagnostic::new(severity, "board.inner_copper").at(&first.name, 0, 0);
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
fn inverted(board: &Board, file: &FileRead, drawn: &Region, diagnostics: &mut Vec<Diagnostic>) -> Region {
    if board.outline.is_empty() {
        diagnostics.push(Diagnostic::error("board.negative_without_outline").at(&file.name, 0, 0));
    }
    combine(&board.outline, drawn, CombineRule::Difference)
}
