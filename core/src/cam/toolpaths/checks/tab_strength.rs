//! Tabs that would be made as asked and hold nothing.
//!
//! ```text
//!   ════╡    ╞════   as wide as asked              ════╡╞════   0 wide: the bit meets itself, the board falls out
//!   ──────────────   with mouse-bites, side view
//!    ○  ○  ○  ○      material between the holes     ◯◯◯◯◯◯      pitch ≤ hole: a slit
//! ```
//!
//! Comes in: the settings of a cut-out, the rack, how thick the board is. Goes out: diagnostics. Does not know contours.

use crate::cam::rack;
use crate::cam::toolpaths::PlanContext;
use crate::cam::work::CutOut;
use crate::diagnostic::Diagnostic;
use crate::units::Length;

/// A tab that is narrower or lower holds nothing.
const LEAST_TAB: Length = Length::from_um(100);
/// Mouse-bite holes leave at least so much between them.
const LEAST_BETWEEN: Length = Length::from_um(50);
/// How far a mouse-bite hole may be from its drill.
pub(in crate::cam::toolpaths) const BITE_TOLERANCE: Length = Length::from_um(200);

/// Tells of a board that comes loose for want of tabs, of tabs that hold nothing, which is an error, and of those that are as high as the board, which are not cut at all.
pub(in crate::cam::toolpaths) fn tabs(context: &mut PlanContext<'_>, cut_out: &CutOut) {
    if cut_out.tabs == 0 && cut_out.tab_at.is_empty() {
        if context.depth() >= context.machine.process.board_thickness {
            context.report(Diagnostic::warning("cam.no_tabs"));
        }
        return;
    }
    let mm = |length: Length| format!("{:.3}", length.mm());
    let low = !cut_out.bites && cut_out.tab_height < LEAST_TAB;
    if cut_out.tab_width < LEAST_TAB || low {
        let error = Diagnostic::error("cam.tabs_hold_nothing");
        context.report(error.with("width", mm(cut_out.tab_width)).with("height", mm(cut_out.tab_height)));
    }
    let thickness = context.machine.process.board_thickness;
    if !cut_out.bites && cut_out.tab_height > thickness {
        let warning = Diagnostic::warning("cam.tabs_too_high").with("height", mm(cut_out.tab_height));
        context.report(warning.with("thickness", mm(thickness)));
    }
    let drill = rack::nearest(&context.machine.drills(), cut_out.bite_hole, BITE_TOLERANCE);
    if let Some(drill) = drill.filter(|drill| cut_out.bites && cut_out.bite_pitch < *drill + LEAST_BETWEEN) {
        let error = Diagnostic::error("cam.bites_cut_through").with("size", rack::size_text(drill));
        context.report(error.with("pitch", mm(cut_out.bite_pitch)));
    }
}
