//! Checks this computer: folders, port, journal, timing, browser.
//!
//! Comes in: the surroundings. Goes out: one row a check, `good`, `note` or `bad`. Changes nothing.

use super::{Answer, Exit, Refusal, serve};
use crate::server::runtime;
use crate::{browser, drill, journal, machine_file};
use annulus_core::remark::{Remark, Weight};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

/// How long timing is measured.
const MEASURED: Duration = Duration::from_secs(1);
/// Time between two wake-ups that are asked for.
const BEAT: Duration = Duration::from_millis(1);

/// Arguments of `annulus doctor`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct DoctorArgs {}

/// What one check found.
struct Check {
    name: &'static str,
    finding: Remark,
    numbers: Value,
}

/// Runs the command.
pub(crate) fn run(_: &DoctorArgs) -> Result<Answer, Refusal> {
    let note = runtime::running(&runtime::folder());
    let running = note.as_ref().map(|note| note.port);
    let mut checks = vec![
        folder("data_folder", &machine_file::data_folder()),
        folder("runtime_folder", &runtime::folder()),
        port(running),
        check_journal(running.is_some()),
        timing(),
    ];
    checks.push(match browser::opener() {
        Some(path) => good("browser", "doctor.browser").with("path", path.display()),
        None => Check::new("browser", Weight::Note, "doctor.no_browser"),
    });
    let bad = checks.iter().any(|check| check.finding.weight == Weight::Loss);
    let text = checks.iter().map(Check::line).collect();
    let rows: Vec<Value> = checks.iter().map(Check::object).collect();
    let exit = if bad { Exit::Content } else { Exit::Done };
    Ok(Answer { object: json!({ "checks": rows }), text, exit })
}

impl Check {
    fn new(name: &'static str, weight: Weight, code: &str) -> Self {
        Self { name, finding: Remark::new(weight, code), numbers: Value::Null }
    }

    fn with(mut self, name: &str, value: impl ToString) -> Self {
        self.finding = self.finding.with(name, value);
        self
    }

    fn mark(&self) -> &'static str {
        match self.finding.weight {
            Weight::Note if self.finding.advice("en").is_empty() => "good",
            Weight::Note | Weight::Doubt => "note",
            Weight::Loss => "bad",
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
    Check::new(name, Weight::Note, code)
}

/// Whether a file can be written in `folder`.
fn folder(name: &'static str, folder: &Path) -> Check {
    let probe = folder.join(format!("doctor-{}", std::process::id()));
    let tried = fs::create_dir_all(folder).and_then(|()| fs::write(&probe, b"annulus"));
    let _ = fs::remove_file(&probe);
    match tried {
        Ok(()) => good(name, "doctor.folder").with("folder", folder.display()),
        Err(error) => Check::new(name, Weight::Loss, "doctor.folder_closed")
            .with("folder", folder.display())
            .with("reason", error),
    }
}

fn port(running: Option<u16>) -> Check {
    let port = serve::DEFAULT_PORT;
    match running {
        Some(port) => good("port", "doctor.running").with("port", port),
        None if serve::is_free(port) => good("port", "doctor.port").with("port", port),
        None => Check::new("port", Weight::Doubt, "doctor.port_taken").with("port", port),
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

/// How late this computer wakes a program that asked for a time.
fn timing() -> Check {
    let begin = Instant::now();
    let mut late_us = Vec::new();
    let mut due = begin + BEAT;
    while due < begin + MEASURED {
        thread::sleep(due.saturating_duration_since(Instant::now()));
        late_us.push(due.elapsed().as_secs_f64() * 1e6);
        due += BEAT;
    }
    late_us.sort_by(f64::total_cmp);
    let at =
        |part: f64| late_us.get(((late_us.len() as f64 - 1.0) * part) as usize).copied().unwrap_or_default();
    let (half, most, worst) = (at(0.5).round(), at(0.99).round(), at(1.0).round());
    let mut check = good("timing", "doctor.timing").with("p50", half).with("p99", most).with("max", worst);
    check.numbers = json!({ "beats": late_us.len(), "p50_us": half, "p99_us": most, "max_us": worst });
    check
}
