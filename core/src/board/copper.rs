//! Paints the copper of a board's sides, with the nets of its islands.
//!
//! Painting is slow: call this only if areas are needed.
//!
//! ```text
//!  positive: ▰ is copper        negative (%IPNEG): the outline less what is drawn is copper
//! ```

use super::{Board, Copper, Face, rivals};
use crate::artwork::{Artwork, FileRead, Gerber, Role, Side, named_pads, nets, painted};
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::{CombineRule, Point, Region, combine};
use crate::{code, error, warning};

/// Report for a second layer of one side: an identical one is a note, a different one an error.
const TWO: [(Severity, &str); 2] =
    [(Severity::Note, code!("board.same_copper")), (Severity::Error, code!("board.two_coppers"))];

/// Diagnostic of a guessed layer, if the user chose another one for the side.
const GUESSED: (Severity, &str) = (Severity::Note, code!("set.better_layer"));

/// Diagnostics of possible copper layers that are not used.
pub(super) const LEFT: [&str; 5] = [
    code!("set.better_layer"),
    code!("set.copper_left_out"),
    code!("set.drawn_as_opening"),
    code!("set.side_guessed"),
    code!("set.side_unknown"),
];

/// Paints the copper layers of the set into the board. Takes for each side, in this order: the layer that the
/// user chose, one among `used`, the first in the drill file's folder, the first. Calls `progress` with the
/// number of painted sides.
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
        let is_guess = |other: &FileRead| file.is_said() && !other.is_said();
        let (guessed, others): (Vec<&FileRead>, Vec<&FileRead>) =
            layers.map(|(file, _)| file).partition(|other| is_guess(other));
        let mut rivals = rivals::layers(file, others.into_iter(), TWO);
        rivals.extend(rivals::layers(file, guessed.into_iter(), [TWO[0], GUESSED]));
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
                warning!(
                    "board.nets_meet",
                    nets = names.join(", "),
                    x = format!("{:.3}", at.x.mm()),
                    y = format!("{:.3}", at.y.mm())
                )
                .at(&file.name, 0, 0),
            );
        }
        diagnostics.extend(file.diagnostics.iter().cloned());
        let source = board.sources.len() as u32;
        board.sources.push(file.name.clone());
        let named = named_pads(layer);
        board.copper.push(Copper { face, region, nets: found.names, pads: found.pads, named, source });
    }
    diagnostics.extend(inner(artwork, board.copper.len()));
    let here = artwork.files.iter().filter(|file| file.reason.code != code!("kind.other_board"));
    let here = here.filter(|file| !board.sources.contains(&file.name));
    let is_answered = |file: &FileRead| {
        let mut said = artwork.files.iter().filter(|other| other.is_said() && other.role == Role::Copper);
        file.side.is_some() && said.any(|other| other.side == file.side)
    };
    let here = here.filter(|file| !is_answered(file));
    let left = here.flat_map(|file| &file.diagnostics);
    diagnostics.extend(left.filter(|diagnostic| LEFT.contains(&diagnostic.code.as_str())).cloned());
}

/// Reports that inner copper cannot be milled: a note next to the copper of both sides. Without one of them
/// it's an error, because the layer may be that side, unless the user said that it is inner.
fn inner(artwork: &Artwork, sides: usize) -> Option<Diagnostic> {
    let inner = |file: &&FileRead| file.role == Role::Copper && file.side == Some(Side::Inner);
    let layers = || artwork.files.iter().filter(inner);
    let first = layers().next()?;
    let is_answered = sides > 0 && layers().all(FileRead::is_said);
    let severity = if sides == 2 || is_answered { Severity::Note } else { Severity::Error };
    let told = Diagnostic::new(severity, code!("board.inner_copper")).at(&first.name, 0, 0);
    Some(told.with("count", layers().count()))
}

/// The layers of this role on a side, the preferred one first.
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
    layers.sort_by_key(|&(index, file, _)| (!file.is_said(), !used.contains(&index), !beside(file), index));
    layers.into_iter().map(|(_, file, gerber)| (file, gerber)).collect()
}

fn inverted(board: &Board, file: &FileRead, drawn: &Region, diagnostics: &mut Vec<Diagnostic>) -> Region {
    if board.outline.is_empty() {
        diagnostics.push(error!("board.negative_without_outline").at(&file.name, 0, 0));
    }
    combine(&board.outline, drawn, CombineRule::Difference)
}
