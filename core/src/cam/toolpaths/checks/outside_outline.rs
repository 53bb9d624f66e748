//! Holes and slots that lie beside the board: nobody expects a bit there.
//!
//! ```text
//!   ┌────────────╮
//!   │  o   o     │      o     beside: nothing of it touches what the outer edges of the outline enclose
//!   │      ╭─╮   o            on the edge (castellated), or in an inner contour: not beside
//!   └──────┴─┴───┘
//! ```
//!
//! Comes in: middles and widths of what an operation makes. Goes out: one error with their number and the first place. Does not
//! know which bit makes them.

use crate::cam::toolpaths::PlacedBoard;
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::units::Length;

/// How many there are, and where the first of them is.
#[derive(Default)]
pub(in crate::cam::toolpaths) struct Beside(Option<(usize, Point)>);

impl Beside {
    /// Counts what is `width` wide around `middle` if some of that middle lies beside the board of `scene`.
    pub(in crate::cam::toolpaths) fn look(&mut self, scene: &PlacedBoard, middle: &[Point], width: Length) {
        let half = Length::from_nm(width.nm() / 2);
        let Some(at) = middle.iter().find(|at| scene.is_beside(**at, half)) else { return };
        self.0.get_or_insert((0, *at)).0 += 1;
    }

    /// The error `cam.holes_outside` with `count`, `x` and `y` in mm, if there are any.
    pub(in crate::cam::toolpaths) fn error(self) -> Option<Diagnostic> {
        let (count, at) = self.0?;
        let mm = |length: Length| format!("{:.3}", length.mm());
        let error = Diagnostic::error("cam.holes_outside").with("count", count);
        Some(error.with("x", mm(at.x)).with("y", mm(at.y)))
    }
}
