//! Mill commands that follow each other as one path from rest to rest.
//!
//! ```text
//! Mill, Mill, MillArc, Mill   ─▶   one move:   /‾‾\__/‾‾‾‾‾‾‾‾\_/‾‾\
//! ```
//!
//! Comes in: commands, the place where they start, a machine. Goes out: a part of a move. Does not know steps in time.

use super::Limits;
use super::limits::mm_per_step;
use super::path::{self, Chain, Piece, Rules, To};
use super::timeline::{Motion, Part, Route};
use crate::geometry::Point;
use crate::job::{Command, Stage};
use crate::machine::{DriveKind, Machine, Steps};
use crate::remark::{Remark, Weight};

/// The piece that a mill command is; none for any other command.
pub(super) fn piece(command: &Command) -> Option<Piece> {
    let mm = |at: Point| [at.x.mm(), at.y.mm()];
    let (to, feed_um_per_s) = match *command {
        Command::Mill { to, height, feed_um_per_s } => {
            let [x, y] = mm(to);
            (To::Line([x, y, height.mm()]), feed_um_per_s)
        }
        Command::MillArc { to, center, ccw, feed_um_per_s, .. } => {
            (To::Arc { to: mm(to), center: mm(center), ccw }, feed_um_per_s)
        }
        _ => return None,
    };
    Some(Piece { to, feed_mm_per_s: f64::from(feed_um_per_s) * 1e-3 })
}

/// The part that mills `pieces` from rest at `at`, which is the step next to `start`, to rest at `to`.
///
/// Refused: axes with play, whose turns would have to stop; table-driven axes, which do not go together; feeds of 0; and
/// what cannot be planned, with the number of the piece.
pub(super) fn part(
    machine: &Machine,
    (at, to): (Steps, Steps),
    start: Point,
    pieces: Vec<Piece>,
    start_tick: u64,
) -> Result<Part, Remark> {
    let refuse = |code: &str| Err(Remark::new(Weight::Loss, code));
    if machine.drive == DriveKind::Table {
        return refuse("motion.path_on_table");
    }
    if [&machine.x, &machine.y].iter().any(|axis| axis.scale.steps(axis.backlash) != 0) {
        return refuse("motion.path_with_play");
    }
    if pieces.iter().any(|piece| piece.feed_mm_per_s <= 0.0) {
        return refuse("motion.no_feed");
    }
    let [x, y, z, ..] = mm_per_step(machine);
    let chain = Chain { start: [start.x.mm(), start.y.mm(), at[2] as f64 * z], pieces };
    let path = path::plan(&chain, &Limits::of_path(machine), &Rules::of(machine))?;
    let motion = Motion::Path(Box::new(Route { path, mm_per_step: [x, y, z] }));
    Ok(Part { stage: Stage::Mill, start_tick, from: at, to, motion })
}
