//! Lists the known machines. A file that can't be read becomes a row with the reason.

use super::{Answer, Refusal, machine_table};
use crate::machine_file;
use crate::outputs::rehearsal;
use annulus_core::machine::{self, Axis};
use annulus_core::{error, note};
use serde_json::json;
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
    let (mut table, mut unread) = (Vec::new(), String::new());
    for name in machine_file::words() {
        let known = match machine_file::named(&name) {
            Ok(known) => known,
            Err(refusal) => {
                let _ = writeln!(unread, "{name:<16} {refusal}");
                rows.push(json!({ "name": name, "ok": false, "error": refusal.object()["error"] }));
                continue;
            }
        };
        let machine = &known.machine;
        let alias_of = machine_table::alias_of(&name);
        if alias_of.is_none() {
            table.push(machine_table::row(&name, machine));
        }
        let range = |axis: &Axis| [axis.min.mm(), axis.max.mm()];
        rows.push(json!({
            "name": name,
            "ok": true,
            "title": machine.name,
            "description": machine.description,
            "file": known.path.is_file().then(|| known.path.display().to_string()),
            "output": machine::setting("machine.output").map(|setting| setting.value(machine)),
            "range_mm": { "x": range(&machine.x), "y": range(&machine.y), "z": range(&machine.z) },
            "fingerprint": machine.fingerprint(),
            "driven_by": machine_table::driver(&name, machine),
            "alias_of": alias_of,
        }));
    }
    Ok(Answer::new(&json!({ "machines": rows }), machine_table::text(&table) + &unread))
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
    Ok(Answer::new(&json!({ "rehearsal": file }), text))
}
