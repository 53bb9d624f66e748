//! Tabs that would hold nothing.
//!
//! ```text
//!   ════╡    ╞════   of the requested width          ════╡╞════   0 wide: the board falls out
//!   ──────────────   with mouse-bites, side view
//!    ○  ○  ○  ○      material between the holes     ◯◯◯◯◯◯      pitch ≤ hole: a slit
//! ```

use crate::cam::rack;
use crate::cam::toolpaths::PlanContext;
use crate::cam::work::CutOut;
use crate::units::Length;
use crate::{error, warning};

/// A narrower or lower tab holds nothing.
const LEAST_TAB: Length = Length::from_um(100);
/// Least material between mouse-bite holes.
const LEAST_BETWEEN: Length = Length::from_um(50);
/// Largest difference between a mouse-bite hole and its drill.
pub(in crate::cam::toolpaths) const BITE_TOLERANCE: Length = Length::from_um(200);

/// Reports a board that gets loose without tabs. Tabs that hold nothing are an error. Also reports tabs as
/// high as the board, which are not cut.
pub(in crate::cam::toolpaths) fn tabs(context: &mut PlanContext<'_>, cut_out: &CutOut) {
    if cut_out.tabs == 0 && cut_out.tab_at.is_empty() {
        if context.depth() >= context.machine.process.board_thickness {
            context.report(warning!("cam.no_tabs", ..));
        }
        return;
    }
    let mm = |length: Length| format!("{:.3}", length.mm());
    let low = !cut_out.bites && cut_out.tab_height < LEAST_TAB;
    if cut_out.tab_width < LEAST_TAB || low {
        let error = error!("cam.tabs_hold_nothing", ..);
        context.report(error.with("width", mm(cut_out.tab_width)).with("height", mm(cut_out.tab_height)));
    }
    let thickness = context.machine.process.board_thickness;
    if !cut_out.bites && cut_out.tab_height > thickness {
        let warning = warning!("cam.tabs_too_high", height = mm(cut_out.tab_height), ..);
        context.report(warning.with("thickness", mm(thickness)));
    }
    let drill = rack::nearest(&context.machine.drills(), cut_out.bite_hole, BITE_TOLERANCE);
    if let Some(drill) = drill.filter(|drill| cut_out.bites && cut_out.bite_pitch < *drill + LEAST_BETWEEN) {
        let error = error!("cam.bites_cut_through", size = rack::size_text(drill), ..);
        context.report(error.with("pitch", mm(cut_out.bite_pitch)));
    }
}
