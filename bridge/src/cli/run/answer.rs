//! The result of a run, and the command that resumes an interrupted job.

use super::attended::resume_line;
use super::{Driver, Operator, interrupted};
use crate::cli::{Answer, Exit, Refusal, counted};
use crate::hosted::Hosted;
use annulus_core::control::{Ending, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::locale;
use annulus_core::machine::axis_name;
use annulus_core::wire::{DrilledReport, SlipReport, Status};
use annulus_core::{code, error, note};
use serde_json::json;

impl Operator {
    pub(super) fn answer(
        &self,
        ending: Ending,
        (holes, toolpaths): (u32, u32),
        digest: &str,
        rested: &Status,
    ) -> Answer {
        let drilled = rested.drilled.unwrap_or_default();
        let exit = match ending {
            Ending::Done if drilled == DrilledReport::default() => Exit::Done,
            _ if self.interrupted => Exit::Interrupted,
            _ => Exit::Content,
        };
        let [id, driver] = self.driver.names();
        let rehearsal = self.driver == (Driver::Virtual { rehearsal: true });
        let mut object = json!({
            "driven_by": id,
            "rehearsal": rehearsal,
            "holes_done": holes,
            "stopped_because": ending,
            "position_trust": rested.trust,
            "stream_digest": digest,
            "toolpaths_done": toolpaths,
            "slips": rested.slips,
            "drilled": drilled,
            "drilled_twice": rested.drilled_twice,
        });
        let why = rested.alarm.clone().or(self.unchanged.clone()).unwrap_or_else(|| error!("run.stopped"));
        let milled = format!(" {} milled.", counted(toolpaths, "toolpath"));
        let milled = if toolpaths > 0 { milled.as_str() } else { "" };
        let still = if rehearsal { " The machine did not move." } else { "" };
        let mut text = format!("{driver}: {} drilled.{milled}{still}\n", counted(holes, "hole"));
        rested.slips.iter().for_each(|slip| text += &lost(slip));
        for hole in &rested.drilled_twice {
            let note = note!("run.drilled_twice", hole = hole);
            text += &format!("{} {}\n", note.message("en"), note.advice("en"));
        }
        if exit != Exit::Done {
            let refusal = Refusal::content(why);
            object["error"] = refusal.object()["error"].clone();
            text += &format!("{refusal}\n");
        }
        if interrupted(self.drill.greeting()).is_some_and(|job| job.job == self.key) {
            let line = resume_line();
            let is_lost = self.driver.is_real() && rested.trust != Trust::Trusted;
            let code = if is_lost { code!("run.resume_homes") } else { code!("run.resume_with") };
            text += &format!("{}\n", Diagnostic::error(code).with("line", &line).message("en"));
            object["resume_with"] = line.into();
        }
        Answer { object, text, exit }
    }
}

/// Text: where a motor of the virtual drill lost steps, and why.
pub(in crate::cli) fn lost(slip: &SlipReport) -> String {
    let arguments = [
        ("axis", axis_name(usize::from(slip.axis))),
        ("place", format!("{:.2}", slip.place_mm)),
        ("lost", slip.lost.to_string()),
    ];
    let say = |key: &str, arguments: &[(String, String)]| {
        locale::text("en", &format!("page.slip.{key}"), arguments)
    };
    let line = say("line", &arguments.map(|(name, value)| (name.to_owned(), value)));
    format!("{}: {line} {}\n", say("title", &[]), say(&slip.cause, &[]))
}
