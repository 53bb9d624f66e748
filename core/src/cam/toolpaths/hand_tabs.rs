//! Tabs placed by the user: each on the nearest contour, and in a panel on every copy.
//!
//! ```text
//!   ╭────────╮ ╭────────╮
//!   │        │ │        │      ● a tab as given, in one copy of the panel
//!   ╰───●────╯ ╰───○────╯      ○ repeated on every other copy
//! ```

use super::super::work::{CutOut, Panel};
use super::cut::nearest;
use super::narrow::half;
use super::{PlanContext, with_position};
use crate::error;
use crate::geometry::{Bounds, Path, Point, path_bounds};
use crate::job::Bit;
use crate::units::Length;

/// A tab farther from all contours than this many tool widths belongs to none.
const REACH: i64 = 4;

/// Middles of user-placed tabs on each of `paths`: lengths along it. Reports a tab out of reach of every
/// contour, on any copy, with its original position.
pub(super) fn middles(
    context: &mut PlanContext<'_>,
    cut_out: &CutOut,
    paths: &[Path],
    bit: &Bit,
) -> Vec<Vec<f64>> {
    let mut middles = vec![Vec::new(); paths.len()];
    let Some(bounds) = context.scene.board.outline.bounds() else { return middles };
    let reach = bit.diameter * REACH;
    let boxes: Vec<Bounds> = paths.iter().map(|path| path_bounds(path).grown(reach)).collect();
    let mut done = std::collections::BTreeSet::new();
    for &tab in &cut_out.tab_at {
        let mut missed = false;
        for place in copies(&context.work.setup.panel, bounds, tab) {
            if !done.insert(place) {
                continue;
            }
            let near = (0..).zip(paths.iter().zip(&boxes)).filter(|(_, (_, around))| around.contains(place));
            let near = near.filter_map(|(index, (path, _))| Some((nearest(path, place, reach.mm())?, index)));
            let best = near.min_by(|((a, _), _), ((b, _), _)| a.total_cmp(b));
            match best.and_then(|((_, length), index): (_, usize)| Some((length, middles.get_mut(index)?))) {
                Some((length, of_path)) => of_path.push(length),
                None => missed = true,
            }
        }
        if missed {
            context.report(with_position(error!("cam.tab_out_of_reach", ..), tab));
        }
    }
    middles
}

fn copies(panel: &Panel, bounds: Bounds, place: Point) -> Vec<Point> {
    let all = |low: Length, high: Length, count: u32, at: Length| -> Vec<Length> {
        let count = i64::from(count.max(1));
        let pitch = Length::from_nm(((high - low + panel.gap).nm() / count).max(1));
        let own = ((at - low + half(panel.gap)).nm().div_euclid(pitch.nm())).clamp(0, count - 1);
        (0..count).map(|copy| at + pitch * (copy - own)).collect()
    };
    let columns = all(bounds.min.x, bounds.max.x, panel.columns, place.x);
    let rows = all(bounds.min.y, bounds.max.y, panel.rows, place.y);
    rows.iter().flat_map(|y| columns.iter().map(|x| Point::new(*x, *y))).collect()
}
