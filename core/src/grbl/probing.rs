//! One touch with the probe: down on the board, or sideways on its edge. Then the zero is written, and the tip
//! retreats.

use super::activity::Activity;
use super::context::Context;
use super::job::Job;
use super::jogging::Jogging;
use super::line::{Meaning, ZeroWanted};
use super::lines::number;
use crate::control::BoardHeight;
use crate::error;

/// Lift speed after probing, mm/min; a controller with a slower Z limits it.
pub(super) const LIFT_MM_PER_MIN: f64 = 500.0;
const AXES: [char; 3] = ['X', 'Y', 'Z'];

#[derive(Debug)]
pub(super) struct Probing {
    pub(super) job: Option<Box<Job>>,
}

impl Probing {
    pub(super) fn down(cx: &mut Context, job: Option<Box<Job>>, down: &str, meaning: Meaning) -> Activity {
        // Until the new zero is confirmed, no height may be used.
        cx.known.height = BoardHeight::Unknown;
        Self::start(cx, job, down, meaning)
    }

    pub(super) fn edge(
        cx: &mut Context,
        axis: usize,
        reach_mm: f64,
        mm_per_min: f64,
        [radius_mm, back_mm]: [f64; 2],
    ) -> Activity {
        // Sign of the retreat: opposite to the probing direction.
        let side = if reach_mm < 0.0 { 1.0 } else { -1.0 };
        let text = format!("G91G38.2{}{}F{}", AXES[axis], number(reach_mm), number(mm_per_min));
        let (radius_mm, back_mm) = (side * radius_mm, side * back_mm);
        Self::start(cx, None, &text, Meaning::Edge { axis, radius_mm, back_mm })
    }

    fn start(cx: &mut Context, job: Option<Box<Job>>, text: &str, meaning: Meaning) -> Activity {
        cx.known.probed = None;
        cx.drop_offsets();
        cx.send("G21G94", Meaning::Jog);
        cx.send(text, meaning);
        Activity::Probing(Self { job })
    }

    pub(super) fn on_answer(self, cx: &mut Context, meaning: &Meaning) -> Activity {
        let met = cx.known.probed == Some(true);
        let touched_mm = cx.known.probed_at_mm;
        let wanted = ZeroWanted { touched_mm, ..ZeroWanted::default() };
        match (meaning, touched_mm) {
            (Meaning::Probe { plate_mm, up_mm }, _) if met => {
                let height_mm = touched_mm.map(|place| place[2] - plate_mm);
                cx.write_zero([None, None, height_mm], wanted);
                cx.lift(up_mm.abs());
            }
            // The tool's axis is `radius_mm` from the edge, signed, and then retreats.
            (&Meaning::Edge { axis, radius_mm, back_mm }, Some(place)) if met => {
                let edge_mm = place[axis] - radius_mm;
                cx.write_zero(core::array::from_fn(|own| (own == axis).then_some(edge_mm)), wanted);
                cx.retreat(AXES[axis], back_mm);
            }
            _ => {
                cx.found(error!("grbl.alarm_5", number = 5));
                return Activity::Probing(self).rest(cx);
            }
        }
        Jogging::sent(self.job)
    }
}

impl Context {
    /// Lifts by a jog, because STOP ends a jog.
    pub(super) fn lift(&mut self, up_mm: f64) {
        self.retreat('Z', up_mm);
    }

    fn retreat(&mut self, axis: char, mm: f64) {
        let text = format!("$J=G91G21{axis}{}F{}", number(mm), number(LIFT_MM_PER_MIN));
        // Probing may have left G91 active, and `$J=` doesn't change modes.
        self.send("G90", Meaning::Jog);
        self.send(&text, Meaning::Jog);
    }
}
