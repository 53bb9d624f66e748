//! A real machine that Annulus drives itself: what may move it, its work zero, and the user at the terminal.
//!
//! ```text
//! ask ─ Enter or --yes ─▶ home ─▶ work zero ─▶ arm ─ warnings? ask ─▶ job ─▶ tool change ─ typed line ─▶ job
//! ```

use super::{Driver, Operator, RunArgs, other_of_controller};
use crate::cli::grbl::how::Place;
use crate::cli::{Exit, Refusal, say};
use annulus_core::control::State;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Bit;
use annulus_core::machine::{Machine, axis_name};
use annulus_core::units::Length;
use annulus_core::wire::{Ask, InterruptedJob, LengthKnown, PreflightRow, RowVerdict};
use annulus_core::{code, error, note, warning};
use std::future::pending;
use std::io::{IsTerminal, stdin};
use std::time::Instant;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

/// Depth of a probe without a number, mm.
const PROBE_MM: f64 = 10.0;
/// Longest typed distance, mm.
const MOST_MM: f64 = 500.0;
/// How often to jog to the work zero: a busy computer ends a jog early.
const TRIES: u32 = 5;

/// Flags of a controller that also apply to a machine that Annulus drives itself.
const OF_BOTH: [&str; 3] = ["--zero-here", "--zero-at", "--equal-tool-lengths"];

/// Refuses arguments that do not fit a real machine, and a run without a terminal or `--yes`.
pub(super) fn may_run(args: &RunArgs, machine: &Machine) -> Result<(), Refusal> {
    let how = &args.at.board.how;
    let name = args.job().on.name();
    let refuse = |why: Diagnostic| Err(Refusal::usage(why.with("machine", name)));
    let flag = how.of_controller().find(|flag| !OF_BOTH.contains(flag)).or(other_of_controller(args));
    if let Some(flag) = flag {
        return refuse(error!("run.flag_of_controller", flag = flag, ..));
    }
    if how.zero_here {
        return refuse(error!("run.zero_here_homes", ..));
    }
    may_move_real(name, how.yes || how.dry_run, &args.fault)?;
    Zero::of(how.zero_at, machine).map(drop)
}

/// Refuses faults on the real machine `name`, and to move it without a terminal or `--yes`.
pub(in crate::cli) fn may_move_real(name: &str, yes: bool, faults: &[String]) -> Result<(), Refusal> {
    if !faults.is_empty() {
        return Err(Refusal::usage(error!("run.fault_is_virtual", machine = name)));
    }
    if !yes && !stdin().is_terminal() {
        return Err(Refusal::usage(error!("run.needs_yes", machine = name)));
    }
    Ok(())
}

/// The work zero of a real machine.
#[derive(Clone, Copy, Debug)]
pub(super) struct Zero {
    /// X and Y in machine coordinates, mm; `None` for the saved zero.
    at_mm: Option<[f64; 2]>,
}

impl Zero {
    /// The given or the saved zero; an error if it has a height, or is outside the travel.
    pub(super) fn of(zero_at: Option<Place>, machine: &Machine) -> Result<Self, Refusal> {
        let Some(place) = zero_at else { return Ok(Self { at_mm: None }) };
        if place.z.is_some() {
            return Err(Refusal::usage(error!("run.zero_at_plane")));
        }
        for axis in [0, 1] {
            let (low, high) = (machine.axis(axis).min.mm(), machine.axis(axis).max.mm());
            if !(low..=high).contains(&place.plane[axis]) {
                let why = error!("run.zero_outside", axis = axis_name(axis), ..);
                return Err(Refusal::usage(why.with("min", low).with("max", high)));
            }
        }
        Ok(Self { at_mm: Some(place.plane) })
    }
}

/// Lines typed at the terminal, from now on; `None` without a terminal.
pub(in crate::cli) fn typed_lines() -> Option<UnboundedReceiver<String>> {
    let (sends, lines) = unbounded_channel();
    let reads = move || {
        for line in stdin().lines().map_while(Result::ok) {
            if sends.send(line).is_err() {
                return;
            }
        }
    };
    let reader = std::thread::Builder::new().name("typed".to_owned());
    (stdin().is_terminal() && reader.spawn(reads).is_ok()).then_some(lines)
}

/// The next typed line; never, if there is no terminal. `None` if the terminal was closed.
pub(in crate::cli) async fn typed_line(lines: &mut Option<UnboundedReceiver<String>>) -> Option<String> {
    let Some(all) = lines else { return pending().await };
    let line = all.recv().await;
    if line.is_none() {
        *lines = None;
    }
    line
}

/// Flags of a new board, without a value. The command that resumes a job leaves them out.
const START_FLAGS: [&str; 4] = ["--restart", "--from-start", "--assume-magazine-loaded", "--load-magazine"];
/// Flags of a new board, and faults to inject, with a value. The command that resumes a job leaves them out.
const START_FLAGS_WITH_VALUE: [&str; 2] = ["--zero-at", "--fault"];

/// The command line that resumes the job: this process's own, without those flags.
pub(super) fn resume_line() -> String {
    resumed(std::env::args().skip(1))
}

fn resumed(words: impl Iterator<Item = String>) -> String {
    let (mut line, mut is_value) = ("annulus".to_owned(), false);
    for word in words {
        let flag = word.split('=').next().unwrap_or_default();
        let has_value = !is_value && START_FLAGS_WITH_VALUE.contains(&flag);
        let is_dropped = is_value || has_value || START_FLAGS.contains(&flag);
        is_value = has_value && flag == word;
        if !is_dropped {
            let is_plain = word.chars().all(|c| c.is_alphanumeric() || "-_./=,:+@%".contains(c));
            let quoted = if is_plain { word } else { format!("'{}'", word.replace('\'', r"'\''")) };
            line += &format!(" {quoted}");
        }
    }
    line
}

impl Operator {
    /// Prints a message with its advice. A progress bar makes room for it.
    pub(super) fn tell(&self, why: &Diagnostic) {
        self.bar.suspend(|| say(format_args!("{} {}", why.message("en"), why.advice("en"))));
    }

    /// Checks the work zero and that no other job would be forgotten, and asks before the first move.
    pub(super) async fn may_move(
        &mut self,
        zero: &Zero,
        (interrupted, offer): (Option<&InterruptedJob>, Option<&InterruptedJob>),
        question: &Diagnostic,
    ) -> Result<(), Refusal> {
        let refuse = |code| Err(Refusal::content(Diagnostic::error(code)));
        if let Some(job) =
            interrupted.filter(|job| offer.is_none() && job.holes_done + job.toolpaths_done > 0)
        {
            let why = error!("run.forgets", name = &job.name, holes = job.holes_done, ..);
            return Err(Refusal::content(why.with("toolpaths", job.toolpaths_done)));
        }
        match (offer, zero.at_mm) {
            (Some(_), Some(_)) => return refuse(code!("run.zero_of_interrupted")),
            (None, None) if self.status().is_none_or(|status| status.zero_mm.is_none()) => {
                return refuse(code!("run.no_zero"));
            }
            _ => {}
        }
        self.confirm(question).await
    }

    /// Waits for Enter, unless the user answered in advance. Fails if the user ends the command.
    async fn confirm(&mut self, question: &Diagnostic) -> Result<(), Refusal> {
        self.forget_typed();
        self.tell(question);
        while !self.says_yes && self.typed.take().is_none() {
            if self.interrupted || self.lines.is_none() {
                return Err(Refusal {
                    exit: Exit::Interrupted,
                    ..Refusal::content(error!("run.not_started"))
                });
            }
            self.next().await;
        }
        Ok(())
    }

    /// Shows the warnings of the pre-flight, if any, and asks whether to start.
    pub(super) async fn confirm_warnings(&mut self, checks: &[PreflightRow]) -> Result<(), Refusal> {
        let warned = || checks.iter().filter(|row| row.verdict == RowVerdict::Warn);
        if warned().count() == 0 || checks.iter().any(|row| row.verdict == RowVerdict::Fail) {
            return Ok(());
        }
        warned().for_each(|row| self.tell(&row.finding));
        self.confirm(&warning!("run.starts")).await
    }

    /// Jogs to the work zero and sets it, or uses the saved one.
    pub(super) async fn set_zero(&mut self, zero: Zero) -> Result<(), Refusal> {
        let Some(at_mm) = zero.at_mm else { return Ok(()) };
        for axis in [0, 1] {
            for left in (0..TRIES).rev() {
                let now_mm = self.status().map_or(0.0, |status| status.machine_mm[axis]);
                let distance = Length::from_mm(at_mm[axis] - now_mm);
                if self.interrupted || self.machine.axis(axis).scale.steps(distance) == 0 {
                    break;
                }
                if left == 0 {
                    return Err(Refusal::content(error!("run.zero_not_reached")));
                }
                let distance_um = i32::try_from(distance.nm() / 1_000).unwrap_or_default();
                self.ask(Ask::Jog { axis: axis as u8, distance_um, anyway: false })?;
                self.settle().await;
            }
        }
        if self.interrupted {
            return Err(Refusal { exit: Exit::Interrupted, ..Refusal::content(error!("run.not_started")) });
        }
        self.ask(Ask::SetZero).map(drop)
    }

    /// Asks for the tool and carries out what the user types. Without a terminal, ends the job.
    pub(super) async fn change_asked(&mut self) {
        let Some(status) = self.status() else { return };
        if status.state != State::ToolChange {
            self.asked = None;
            return;
        }
        let Some(change) = status.change.filter(|_| status.spindle_rpm == 0) else { return };
        if self.asked.is_some() {
            if let Some(line) = self.typed.take() {
                self.do_typed(&line).await;
            }
            return;
        }
        self.asked = Some(Instant::now());
        let bit = self.bits.get(change.bit as usize).map(Bit::titled).unwrap_or_default();
        if self.lines.is_none() {
            let why = error!("run.tool_unattended", bit = bit, line = resume_line());
            return self.end_unchanged(why);
        }
        self.forget_typed();
        let is_known = change.length != LengthKnown::No;
        let code = if is_known { code!("run.tool") } else { code!("run.tool_length") };
        self.tell(&Diagnostic::note(code).with("bit", bit));
        if !is_known && self.machine.senses_contact() {
            self.tell(&note!("run.tool_probe"));
        }
    }

    /// Ends the job at its tool change.
    pub(super) fn end_unchanged(&mut self, why: Diagnostic) {
        self.unchanged = Some(why);
        let _ = self.drill.ask(Ask::Stop);
    }

    async fn do_typed(&mut self, line: &str) {
        let mut words = line.split_whitespace();
        let word = words.next().unwrap_or("go");
        let number = words.next().and_then(|word| word.parse::<f64>().ok()).filter(|mm| mm.abs() <= MOST_MM);
        let anyway = words.next() == Some("anyway");
        let um = |mm: f64| (mm * 1e3).round() as i32;
        let ask = match (word, number) {
            ("x", Some(mm)) => Ask::Jog { axis: 0, distance_um: um(mm), anyway },
            ("y", Some(mm)) => Ask::Jog { axis: 1, distance_um: um(mm), anyway },
            ("z", Some(mm)) => Ask::Jog { axis: 2, distance_um: um(mm), anyway },
            ("zero", None) => Ask::SetHeight,
            ("p" | "probe", depth) => {
                Ask::Probe { depth_um: um(depth.unwrap_or(PROBE_MM)).unsigned_abs(), plate_um: 0 }
            }
            ("same", None) => Ask::SameLength,
            ("go", None) => Ask::ToolChanged,
            _ => return self.tell(&note!("run.tool_commands")),
        };
        let goes_on = ask == Ask::ToolChanged;
        match self.drill.ask(ask) {
            Ok(_) if goes_on => {}
            Ok(_) => {
                self.settle().await;
                // Ask again: the length may be known now.
                self.asked = None;
            }
            Err(why) => {
                self.tell(&why);
                say(format_args!("({})", why.code));
                self.forget_typed();
            }
        }
    }

    /// Drops lines that were typed before a question: they do not answer it.
    fn forget_typed(&mut self) {
        self.typed = None;
        while self.lines.as_mut().is_some_and(|lines| lines.try_recv().is_ok()) {}
    }
}

impl Driver {
    /// Returns `true` if Annulus drives a real machine.
    pub(super) const fn is_real(self) -> bool {
        matches!(self, Self::Own(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resume_line_repeats_the_command_without_a_new_start() {
        let rows = [
            ("run a.drl --machine m --restart --yes", "annulus run a.drl --machine m --yes"),
            ("run a.drl --from-start", "annulus run a.drl"),
            ("run a.drl --zero-at -3,4 --json", "annulus run a.drl --json"),
            ("run --zero-at=3,4 it's", r"annulus run 'it'\''s'"),
            ("run a.drl --fault broken-bit@5 --fault=late", "annulus run a.drl"),
            ("run a.drl --assume-magazine-loaded --yes", "annulus run a.drl --yes"),
        ];
        for (words, wanted) in rows {
            assert_eq!(resumed(words.split(' ').map(str::to_owned)), wanted);
        }
    }
}
