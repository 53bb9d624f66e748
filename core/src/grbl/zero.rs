//! The work zero: written and read back. And for which tool the height of the board is known: Annulus cuts with
//! no other tool, on the page and on the command line.
//!
//! ```text
//!  Unknown ──── Z zero is set, by jogging or probing, and read back ───▶ OfThisBit
//!     ▲                                                                    │ another tool is requested
//!     │ Z zero is requested, not yet confirmed                             ▼ or reported, a job ends
//!     └ position lost, without limit switches ◀──────────────────── OfAnotherBit
//!
//!  first tool of a job        the tool that was in when the Z zero was set: the height stays known
//!  every other tool, and      the job requests it: the head rises to the tool change height
//!  tool of a resumed job      and stays up until the tip was touched off
//!  with a tool setter         the tool used for the Z zero is measured first, then each tool before it cuts
//! ```

use super::asks::EngineStart;
use super::context::Context;
use super::known::Known;
use super::line::{Meaning, ZeroWanted};
use super::lines::number;
use crate::code;
use crate::control::BoardHeight;

const AXES: [char; 3] = ['X', 'Y', 'Z'];

impl Context {
    /// Another program may have left another zero, or the last job an offset. Clear them, because a new zero
    /// must count alone.
    pub(super) fn drop_offsets(&mut self) {
        if self.known.zero_off_mm().is_some() {
            self.send("G54", Meaning::Jog);
        }
        if self.known.offset_in_force().is_some() {
            self.send("G92.1", Meaning::Written);
            self.send("G49", Meaning::Written);
        }
    }

    /// Sets zero at the current position. The controller computes the position (L20), so a damaged report
    /// can't become a zero.
    pub(super) fn set_zero(&mut self, axes: [bool; 3], height_mm: f64, in_job: bool) {
        let Some(machine) = self.known.machine_mm() else { return self.error(code!("grbl.no_report")) };
        let heights = [0.0, 0.0, height_mm];
        let words = AXES.into_iter().zip(heights).zip(axes).filter(|(_, wanted)| *wanted);
        let words = words.map(|((letter, height_mm), _)| format!("{letter}{}", number(height_mm)));
        self.drop_offsets();
        self.send(&format!("G21G10L20P1{}", words.collect::<String>()), Meaning::Written);
        let place_mm = core::array::from_fn(|axis| axes[axis].then_some(machine[axis] - heights[axis]));
        // Without limit switches the user's word is the only position reference; trusted once the controller
        // has stored the zero.
        let trusts = axes[0] && axes[1] && !self.known.homes() && !in_job;
        self.read_zero(place_mm, ZeroWanted { trusts, ..ZeroWanted::default() });
    }

    /// Makes this machine position the zero of its axes. The position is absolute (L2): after a probing the
    /// head may have moved on while it stopped.
    pub(super) fn write_zero(&mut self, place_mm: [Option<f64>; 3], wanted: ZeroWanted) {
        let words = AXES.into_iter().zip(place_mm);
        let words = words.filter_map(|(letter, mm)| Some(format!("{letter}{}", number(mm?))));
        self.send(&format!("G21G10L2P1{}", words.collect::<String>()), Meaning::Written);
        self.read_zero(place_mm, wanted);
    }

    /// Queries the stored offsets to verify the zero, including the axes that must not change: a flipped
    /// letter would write another axis. Until a Z zero is confirmed, the height is unknown. Unless the setter
    /// made it, the setter reference ends.
    fn read_zero(&mut self, place_mm: [Option<f64>; 3], wanted: ZeroWanted) {
        let of_plane = place_mm[0].is_some() && place_mm[1].is_some();
        let of_height = place_mm[2].is_some();
        if of_height && !wanted.of_setter {
            (self.known.height, self.known.reference_mm) = (BoardHeight::Unknown, None);
        }
        let before = self.known.info.offsets.remove("G54").unwrap_or_default();
        let place_mm = core::array::from_fn(|axis| place_mm[axis].or(before.get(axis).copied()));
        self.send("$#", Meaning::Echo(ZeroWanted { place_mm, of_plane, of_height, ..wanted }));
    }
}

impl Known {
    /// A job starts. If all tools are equally long, a Z zero set with any of them, or by the job earlier, is
    /// good for all. A job from the start is on a new board, so the setter reference no longer applies.
    pub(super) fn start_job(&mut self, start: &EngineStart) {
        if start.from == 0 {
            self.reference_mm = None;
        }
        let known = self.height == BoardHeight::OfAnotherBit || self.height_as_left(start.zero_mm);
        if start.same_length && known {
            self.height = BoardHeight::OfThisBit;
        }
    }
}
