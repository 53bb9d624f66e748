//! Lists the known machines. A file that can't be read becomes a row with the reason.

use super::{Answer, Exit, Refusal};
use crate::machine_file;
use crate::outputs::rehearsal;
use annulus_core::machine::{self, Machine};
use annulus_core::{error, note};
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Arguments of `annulus machines`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct MachinesArgs {
    /// Create a simulated port, for card.device or parallel.device in a machine file.
    #[arg(long, value_name = "FILE")]
    rehearsal: Option<PathBuf>,
}

pub(crate) fn run(args: &MachinesArgs) -> Result<Answer, Refusal> {
    if let Some(path) = &args.rehearsal {
        return make_rehearsal(path);
    }
    let mut rows = Vec::new();
    let mut text = String::new();
    for name in machine_file::words() {
        match machine_file::named(&name) {
            Ok(known) => {
                let file = known.path.is_file().then(|| known.path.display().to_string());
                let _ = writeln!(text, "{name:<16} {}", describe(&known.machine));
                rows.push(row(&name, file.as_deref(), &known.machine));
            }
            Err(refusal) => {
                let _ = writeln!(text, "{name:<16} {refusal}");
                let error = refusal.object().get("error").cloned();
                rows.push(json!({ "name": name, "ok": false, "error": error }));
            }
        }
    }
    Ok(Answer { object: json!({ "machines": rows }), text, exit: Exit::Done })
}

/// Creates a simulated port, unless the file exists.
fn make_rehearsal(path: &Path) -> Result<Answer, Refusal> {
    rehearsal::make(path).map_err(|error| {
        let why = error!("output.rehearsal_not_made", file = path.display(), ..);
        Refusal::surroundings(why.with("reason", error))
    })?;
    let file = path.display().to_string();
    let made = note!("output.rehearsal_made", file = &file);
    let text = format!("{} {}\n", made.message("en"), made.advice("en"));
    Ok(Answer { object: json!({ "rehearsal": file }), text, exit: Exit::Done })
}

fn row(name: &str, file: Option<&str>, machine: &Machine) -> Value {
    let range = |axis: &machine::Axis| json!([axis.min.mm(), axis.max.mm()]);
    let output = machine::setting("machine.output").map(|setting| setting.value(machine));
    json!({
        "name": name,
        "ok": true,
        "title": machine.name,
        "description": machine.description,
        "file": file,
        "output": output,
        "range_mm": { "x": range(&machine.x), "y": range(&machine.y), "z": range(&machine.z) },
        "fingerprint": machine.fingerprint(),
    })
}

fn describe(machine: &Machine) -> String {
    let travel = |axis: &machine::Axis| (axis.max - axis.min).mm();
    let (x, y) = (travel(&machine.x), travel(&machine.y));
    format!("{}, {x:.0} × {y:.0} mm. {}", machine.name, machine.description)
}
