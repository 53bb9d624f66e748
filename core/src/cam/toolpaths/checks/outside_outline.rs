//! Holes and slots outside the board.
//!
//! ```text
//!   ┌────────────╮
//!   │  o   o     │      o     outside: does not touch the area inside the outer edges of the outline
//!   │      ╭─╮   o            on the edge (castellated), or in an inner contour: not outside
//!   └──────┴─┴───┘
//! ```

use crate::cam::toolpaths::PlacedBoard;
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::Point;
use crate::units::Length;

/// Count, and position of the first.
#[derive(Default)]
pub(in crate::cam::toolpaths) struct Beside(Option<(usize, Point)>);

impl Beside {
    /// Counts a shape of `width` around `middle` if part of its centre line is outside the board of `scene`.
    pub(in crate::cam::toolpaths) fn look(&mut self, scene: &PlacedBoard, middle: &[Point], width: Length) {
        let half = Length::from_nm(width.nm() / 2);
        let Some(at) = middle.iter().find(|at| scene.is_beside(**at, half)) else { return };
        self.0.get_or_insert((0, *at)).0 += 1;
    }

    /// The error `cam.holes_outside` with `count`, `x` and `y` in mm, if there are any.
    pub(in crate::cam::toolpaths) fn error(self) -> Option<Diagnostic> {
        let (count, at) = self.0?;
        let mm = |length: Length| format!("{:.3}", length.mm());
        let error = error!("cam.holes_outside", count = count, ..);
        Some(error.with("x", mm(at.x)).with("y", mm(at.y)))
    }
}
