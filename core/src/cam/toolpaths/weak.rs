//! Tabs that would be made as asked and hold nothing.
//!
//! ```text
//!   ════╡    ╞════   as wide as asked              ════╡╞════   0 wide: the bit meets itself, the board falls out
//!   ──────────────   with mouse-bites, side view
//!    ○  ○  ○  ○      material between the holes     ◯◯◯◯◯◯      pitch ≤ hole: a slit
//! ```
//!
//! Comes in: the settings of a cut-out, the rack, how thick the board is. Goes out: diagnostics. Does not know contours.

use super::super::rack;
use super::super::work::CutOut;
use super::Desk;
use crate::diagnostic::Diagnostic;
use crate::units::Length;

/// A tab that is narrower or lower holds nothing.
const LEAST_TAB: Length = Length::from_um(100);
/// Mouse-bite holes leave at least so much between them.
const LEAST_BETWEEN: Length = Length::from_um(50);
/// How far a mouse-bite hole may be from its drill.
pub(super) const BITE_TOLERANCE: Length = Length::from_um(200);

/// Tells of a board that comes loose for want of tabs, of tabs that hold nothing, which is an error, and of those that are as high as the board, which are not cut at all.
pub(super) fn tabs(desk: &mut Desk<'_>, cut_out: &CutOut) {
    if cut_out.tabs == 0 && cut_out.tab_at.is_empty() {
        if desk.depth() >= desk.machine.process.board_thickness {
            desk.say(Diagnostic::warning("cam.no_tabs"));
        }
        return;
    }
    let mm = |length: Length| format!("{:.3}", length.mm());
    let low = !cut_out.bites && cut_out.tab_height < LEAST_TAB;
    if cut_out.tab_width < LEAST_TAB || low {
        let error = Diagnostic::error("cam.tabs_hold_nothing");
        desk.say(error.with("width", mm(cut_out.tab_width)).with("height", mm(cut_out.tab_height)));
    }
    let thickness = desk.machine.process.board_thickness;
    if !cut_out.bites && cut_out.tab_height > thickness {
        let warning = Diagnostic::warning("cam.tabs_too_high").with("height", mm(cut_out.tab_height));
        desk.say(warning.with("thickness", mm(thickness)));
    }
    let drill = rack::nearest(&desk.machine.rack, cut_out.bite_hole, BITE_TOLERANCE);
    if let Some(drill) = drill.filter(|drill| cut_out.bites && cut_out.bite_pitch < *drill + LEAST_BETWEEN) {
        let error = Diagnostic::error("cam.bites_cut_through").with("size", rack::size_text(drill));
        desk.say(error.with("pitch", mm(cut_out.bite_pitch)));
    }
}
