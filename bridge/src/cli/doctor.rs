//! Checks this computer: folders, port, journal, timing, USB adapter, browser.
//!
//! Comes in: the surroundings. Goes out: one row a check, `good`, `note` or `bad`. Changes nothing.

use super::browser;
use super::{Answer, Exit, Refusal, serve};
use crate::executor::{clock, realtime};
use crate::own;
use crate::server::runtime;
use crate::{adapter, drill, journal, machine_file, serial};
use annulus_core::control::Lateness;
use annulus_core::control::lateness::{EDGES_US, safe_rate};
use annulus_core::diagnostic::{Diagnostic, Severity};
use serde_json::{Value, json};
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::thread;

/// Longest bar of the histogram, in characters.
const WIDEST: u32 = 40;

/// Arguments of `annulus doctor`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct DoctorArgs {
    /// Show how late this computer is with pulses, bar by bar.
    #[arg(long)]
    timing: bool,
}

/// What one check found.
struct Check {
    name: &'static str,
    finding: Diagnostic,
    numbers: Value,
}

/// Runs the command.
pub(crate) fn run(args: &DoctorArgs) -> Result<Answer, Refusal> {
    let note = runtime::running(&runtime::folder());
    let running = note.as_ref().map(|note| note.port);
    let (lateness, no_realtime) = measured();
    let mut checks = vec![
        folder("data_folder", &machine_file::data_folder()),
        folder("runtime_folder", &runtime::folder()),
        port(running),
        check_journal(running.is_some()),
        timing(&lateness, no_realtime),
        usb_adapter(),
    ];
    checks.push(match browser::opener() {
        Some(path) => good("browser", "doctor.browser").with("path", path.display()),
        None => Check::new("browser", Severity::Note, "doctor.no_browser"),
    });
    let bad = checks.iter().find(|check| check.finding.severity == Severity::Error);
    let mut text: String = checks.iter().map(Check::line).collect();
    if args.timing {
        text += &histogram(&lateness);
    }
    let rows: Vec<Value> = checks.iter().map(Check::object).collect();
    let object = json!({ "checks": rows });
    Ok(match bad {
        Some(check) => Answer::refused(object, &text, check.finding.clone()),
        None => Answer { object, text, exit: Exit::Done },
    })
}

impl Check {
    fn new(name: &'static str, severity: Severity, code: &str) -> Self {
        Self { name, finding: Diagnostic::new(severity, code), numbers: Value::Null }
    }

    fn with(mut self, name: &str, value: impl ToString) -> Self {
        self.finding = self.finding.with(name, value);
        self
    }

    fn mark(&self) -> &'static str {
        match self.finding.severity {
            Severity::Note if self.finding.advice("en").is_empty() => "good",
            Severity::Note | Severity::Warning => "note",
            Severity::Error => "bad",
        }
    }

    fn line(&self) -> String {
        let (message, advice) = (self.finding.message("en"), self.finding.advice("en"));
        format!("{:<5} {:<15} {message} {advice}", self.mark(), self.name).trim_end().to_owned() + "\n"
    }

    fn object(&self) -> Value {
        json!({
            "name": self.name,
            "verdict": self.mark(),
            "code": self.finding.code,
            "message": self.finding.message("en"),
            "advice": self.finding.advice("en"),
            "numbers": self.numbers,
        })
    }
}

fn good(name: &'static str, code: &str) -> Check {
    Check::new(name, Severity::Note, code)
}

/// Whether a file can be written in `folder`.
fn folder(name: &'static str, folder: &Path) -> Check {
    let probe = folder.join(format!("doctor-{}", std::process::id()));
    let mut options = OpenOptions::new();
    let tried = own::root(folder)
        .and_then(|()| own::open(&probe, options.write(true).create_new(true)))
        .and_then(|mut file| file.write_all(b"annulus"));
    let _ = fs::remove_file(&probe);
    match tried {
        Ok(()) => good(name, "doctor.folder").with("folder", folder.display()),
        Err(error) => Check::new(name, Severity::Error, "doctor.folder_closed")
            .with("folder", folder.display())
            .with("reason", error),
    }
}

fn port(running: Option<u16>) -> Check {
    let port = serve::DEFAULT_PORT;
    match running {
        Some(port) => good("port", "doctor.running").with("port", port),
        None if serve::is_free(port) => good("port", "doctor.port").with("port", port),
        None => Check::new("port", Severity::Warning, "doctor.port_taken").with("port", port),
    }
}

/// Whether the journal opens. A running bridge has it open already.
fn check_journal(running: bool) -> Check {
    if running {
        return good("journal", "doctor.journal_in_use");
    }
    match journal::examine(&machine_file::data_folder().join(drill::JOURNAL)) {
        Ok(()) => good("journal", "doctor.journal"),
        Err(finding) => Check { name: "journal", finding, numbers: Value::Null },
    }
}

/// Whether a USB step adapter is plugged in. Nobody is spoken to: a running bridge may have it.
fn usb_adapter() -> Check {
    let there: Vec<String> =
        serial::list().into_iter().filter(adapter::is_adapter).map(|listed| listed.name).collect();
    if there.is_empty() {
        return Check::new("adapter", Severity::Note, "doctor.no_adapter");
    }
    good("adapter", "doctor.adapter").with("port", there.join(", "))
}

/// How late this computer is with a pulse, measured as the executor does it, and why it is not in the real-time class.
fn measured() -> (Lateness, Option<String>) {
    let measure = || {
        let refused = realtime::ask_for_class();
        (clock::measure(&mut clock::StepClock::new(), clock::MEASURED), refused)
    };
    // In a thread of its own: the class is the thread's.
    thread::spawn(measure).join().unwrap_or_default()
}

fn timing(late: &Lateness, no_realtime: Option<String>) -> Check {
    let (half, most, worst) = (late.p50_us.round(), late.p99_us.round(), late.worst_us.round());
    let safe_hz = safe_rate(late, 0.0);
    let code = if no_realtime.is_none() { "doctor.timing" } else { "doctor.timing_unfavoured" };
    let mut check = Check::new("timing", Severity::Note, code)
        .with("p50", half)
        .with("p99", most)
        .with("max", worst)
        .with("safe", safe_hz.floor());
    if let Some(why) = &no_realtime {
        check = check.with("reason", why);
    }
    check.numbers = json!({ "beats": late.beats, "p50_us": half, "p99_us": most, "max_us": worst,
        "p9999_us": late.p9999_us, "safe_hz": safe_hz, "no_realtime": no_realtime,
        "edges_us": EDGES_US, "bars": late.bars });
    check
}

/// The histogram, a line a bar.
fn histogram(late: &Lateness) -> String {
    let tallest = late.bars.iter().max().copied().unwrap_or(0).max(1);
    let last = late.bars.iter().rposition(|count| *count > 0).unwrap_or(0);
    let line = |(index, count): (usize, &u32)| {
        let edge = EDGES_US.get(index).map_or_else(|| "later".to_owned(), |edge| format!("{edge} µs"));
        // Even one beat has a mark: it is the rare ones that count.
        let width = (u64::from(*count) * u64::from(WIDEST)).div_ceil(u64::from(tallest)) as usize;
        format!("{edge:>10} {count:>6} {}", "#".repeat(width)).trim_end().to_owned() + "\n"
    };
    late.bars.iter().take(last + 1).enumerate().map(line).collect()
}
