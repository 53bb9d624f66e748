//! What the command line prints about a job at a controller: its tools, its result, and how to resume it.

use super::{Ended, Operator};
use crate::cli::grbl::controller_object;
use crate::cli::grbl::program::Programs;
use crate::cli::{Answer, Exit, Refusal, counted, diagnostic_objects, rounded, say};
use annulus_core::control::{Ending, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::Pause;
use annulus_core::machine::{RackTool, ToolWear};
use annulus_core::{code, error};
use serde_json::json;

impl Operator {
    pub(super) fn answer(&self, programs: &Programs, ended: &Ended, seconds: Option<f64>) -> Answer {
        let done = ended.ending == Some(Ending::Done);
        let (holes, toolpaths) =
            if done { programs.routine.cuts() } else { (ended.entry.holes, ended.entry.toolpaths) };
        let exit = match ended.ending {
            Some(Ending::Done) => Exit::Done,
            _ if self.interrupted => Exit::Interrupted,
            None if self.gone => Exit::Surroundings,
            _ => Exit::Content,
        };
        let now = self.now.as_ref();
        let resume_from = (!done).then_some(ended.entry.done);
        let line = resume_from.and_then(|at| programs.routine.sections.get(at)).map(|section| section.line);
        let mut object = json!({
            "controller": self.info.as_ref().map(controller_object),
            "bits_per_s": self.station.bits_per_s,
            "lines_sent": now.map_or(0, |now| now.sent),
            "lines_done": now.map_or(0, |now| now.answered),
            "holes_done": holes,
            "toolpaths_done": toolpaths,
            "driven_by": "controller",
            "sections": programs.routine.sections.len(),
            "stopped_because": ended.ending.unwrap_or(Ending::Alarm),
            "position_trust": now.map_or(Trust::Lost, |now| now.trust),
            "resume_from": resume_from.map(|section| json!({ "section": section, "line": line })),
            "largest_correction_um": self.corrected.map(|all| all.largest().nm() as f64 / 1e3),
            "estimated_s": seconds.map(rounded),
            "worn_tools": diagnostic_objects(&self.worn),
            "diagnostics": diagnostic_objects(&self.said),
        });
        let mut text =
            format!("{} drilled, {} milled.\n", counted(holes, "hole"), counted(toolpaths, "toolpath"));
        if exit != Exit::Done {
            let stopped = error!("grbl.stopped", holes = holes, toolpaths = toolpaths);
            let why = self.worst.clone().unwrap_or(stopped);
            // The reason why the job did not start is already printed.
            let is_said = !self.begun && self.said.contains(&why);
            let refusal = Refusal::content(why);
            object["error"] = refusal.object()["error"].clone();
            text += &if is_said { "Not started.\n".to_owned() } else { format!("{refusal}\n") };
            if resume_from.is_some() {
                object["resume_with"] = self.resume_line().into();
            }
            let is_saved = self.begun && ended.entry.key == programs.routine.key;
            if let Some(how) = is_saved.then(|| self.how_to_resume(&text)).flatten() {
                text += &format!("{}\n{}\n", how.message("en"), how.advice("en"));
            }
        }
        Answer { object, text, exit }
    }

    /// What to do first, and the command that resumes the job. `None` if the position is trusted and `said`
    /// has the command. Without homing, opening the port again loses the position.
    fn how_to_resume(&self, said: &str) -> Option<Diagnostic> {
        let line = self.resume_line();
        let code = match (self.homes(), self.trusted()) {
            (true, true) if said.contains(&line) => return None,
            (true, true) => code!("run.resume_with"),
            (true, false) => code!("run.resume_homes"),
            (false, _) => code!("grbl.resume_zero"),
        };
        Some(Diagnostic::note(code).with("line", line))
    }
}

/// Reports that a tool is worn.
pub(super) fn say_worn(tool: &RackTool, wear: &ToolWear) {
    let code =
        if tool.wears_by_way() { code!("preflight.tool_worn_way") } else { code!("preflight.tool_worn") };
    let why = Diagnostic::warning(code).with("number", tool.number).with("life", tool.life);
    let why = why.with("tool", tool.bit().titled()).with("done", wear.done());
    say(format_args!("{} {}", why.message("en"), why.advice("en")));
}

/// Text of a tool request at a pause of the program.
pub(super) fn pause_text(programs: &Programs, tool: u32) -> String {
    match programs.routine.pause(tool) {
        Pause::Stop { said: "" } => "The program stops here (M0).".to_owned(),
        Pause::Stop { said } => format!("The program stops here: {said}."),
        Pause::Tool { number, said: "" } => format!("Tool {number}"),
        Pause::Tool { number, said } if said.to_ascii_lowercase().contains(&format!("tool {number}")) => {
            let mut letters = said.chars();
            let first = letters.next().map(|letter| letter.to_ascii_uppercase());
            first.into_iter().chain(letters).collect()
        }
        Pause::Tool { number, said } => format!("Tool {number}: {said}"),
    }
}
