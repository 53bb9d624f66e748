//! Checks this computer: folders, port, journal, timing, USB adapter, browser. Changes nothing.

use super::{Answer, Refusal, serve};
use super::{browser, judged};
use crate::executor::clock;
use crate::own;
use crate::server::runtime;
use crate::{adapter, drill, journal, machine_file, serial, spindle};
use annulus_core::code;
use annulus_core::control::Lateness;
use annulus_core::control::lateness::{EDGES_US, safe_rate};
use annulus_core::diagnostic::{Diagnostic, Severity};
use serde_json::{Value, json};
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;
use std::time::Duration;

/// Arguments of `annulus doctor`.
#[derive(Debug, clap::Args)]
pub(crate) struct DoctorArgs {
    /// Show a histogram of how late this computer is with pulses.
    #[arg(long)]
    timing: bool,
    /// Check that this computer, under load, is in time for this machine, a name or a file.
    #[arg(short, long, value_name = "NAME")]
    machine: Option<String>,
    /// Measure for this many seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=3_600),
        requires = "machine")]
    seconds: u32,
}

/// Result of one check.
struct Check {
    name: &'static str,
    finding: Diagnostic,
    numbers: Value,
}

pub(crate) fn run(args: &DoctorArgs) -> Result<Answer, Refusal> {
    if let Some(machine) = &args.machine {
        return judged::run(machine, Duration::from_secs(u64::from(args.seconds)));
    }
    let note = runtime::running(&runtime::folder());
    let running = note.as_ref().map(|note| note.port);
    let (lateness, no_realtime) = judged::measured(clock::MEASURED);
    let mut checks = vec![
        folder("data_folder", &machine_file::data_folder()),
        folder("runtime_folder", &runtime::folder()),
        port(running),
        check_journal(running.is_some()),
        timing(&lateness, no_realtime),
        usb_adapter(),
        converter(),
    ];
    checks.push(match browser::opener() {
        Some(path) => good("browser", code!("doctor.browser")).with("path", path.display()),
        None => Check::new("browser", Severity::Note, code!("doctor.no_browser")),
    });
    let bad = checks.iter().find(|check| check.finding.severity == Severity::Error);
    let mut text: String = checks.iter().map(Check::line).collect();
    if args.timing {
        text += &judged::histogram(&lateness);
    }
    let rows: Vec<Value> = checks.iter().map(Check::object).collect();
    let answer = Answer::new(&json!({ "checks": rows }), text);
    Ok(answer.with_error(bad.map(|check| check.finding.clone())))
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
        let (message, advice) = (self.finding.message("en"), self.finding.advice("en"));
        json!({ "name": self.name, "verdict": self.mark(), "code": self.finding.code, "message": message,
            "advice": advice, "numbers": self.numbers })
    }
}

fn good(name: &'static str, code: &str) -> Check {
    Check::new(name, Severity::Note, code)
}

/// Checks that `folder` is writable.
fn folder(name: &'static str, folder: &Path) -> Check {
    let probe = folder.join(format!("doctor-{}", std::process::id()));
    let mut options = OpenOptions::new();
    let tried = own::root(folder)
        .and_then(|()| own::open(&probe, options.write(true).create_new(true)))
        .and_then(|mut file| file.write_all(b"annulus"));
    let _ = fs::remove_file(&probe);
    match tried {
        Ok(()) => good(name, code!("doctor.folder")).with("folder", folder.display()),
        Err(error) => Check::new(name, Severity::Error, code!("doctor.folder_closed"))
            .with("folder", folder.display())
            .with("reason", error),
    }
}

fn port(running: Option<u16>) -> Check {
    let port = serve::DEFAULT_PORT;
    match running {
        Some(port) => good("port", code!("doctor.running")).with("port", port),
        None if serve::is_free(port) => good("port", code!("doctor.port")).with("port", port),
        None => Check::new("port", Severity::Warning, code!("doctor.port_taken")).with("port", port),
    }
}

/// Checks that the journal opens. A running bridge holds it open.
fn check_journal(running: bool) -> Check {
    if running {
        return good("journal", code!("doctor.journal_in_use"));
    }
    match journal::examine(&machine_file::data_folder().join(drill::JOURNAL)) {
        Ok(()) => good("journal", code!("doctor.journal")),
        Err(finding) => Check { name: "journal", finding, numbers: Value::Null },
    }
}

/// Checks for a USB step adapter without opening its port: a running bridge may use it.
fn usb_adapter() -> Check {
    let there: Vec<String> =
        serial::list().into_iter().filter(adapter::is_adapter).map(|listed| listed.name).collect();
    if there.is_empty() {
        return Check::new("adapter", Severity::Note, code!("doctor.no_adapter"));
    }
    good("adapter", code!("doctor.adapter")).with("port", there.join(", "))
}

/// Checks the frequency converters of the user's machines: profile and port must exist. The converter itself
/// is not queried.
fn converter() -> Check {
    let machines = machine_file::names().into_iter().filter_map(|name| machine_file::named(&name).ok());
    let mut said = Vec::new();
    for machine in machines.map(|known| known.machine).filter(|machine| machine.converter.is_there()) {
        let port = &machine.converter.port;
        match spindle::check(&machine) {
            Err(finding) => {
                let finding = Diagnostic { severity: Severity::Warning, ..finding };
                return Check { name: "converter", finding, numbers: Value::Null };
            }
            Ok(_) if !Path::new(port).exists() => {
                return Check::new("converter", Severity::Warning, code!("doctor.converter_no_port"))
                    .with("machine", &machine.name)
                    .with("port", port);
            }
            Ok(title) => said.push(format!("{}: {title}, {port}", machine.name)),
        }
    }
    if said.is_empty() {
        return Check::new("converter", Severity::Note, code!("doctor.no_converter"))
            .with("names", spindle::names().collect::<Vec<_>>().join(", "));
    }
    good("converter", code!("doctor.converter")).with("converters", said.join("; "))
}

fn timing(late: &Lateness, no_realtime: Option<String>) -> Check {
    let (half, most, worst) = (late.p50_us.round(), late.p99_us.round(), late.worst_us.round());
    let safe_hz = safe_rate(late, 0.0);
    let code = if no_realtime.is_none() { code!("doctor.timing") } else { code!("doctor.timing_unfavoured") };
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
