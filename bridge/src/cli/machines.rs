//! Lists the known machines, and saves which one the commands use. A file that can't be read becomes a row with
//! the reason.

use super::{Answer, MachineArgs, Refusal, machine_table, sentence};
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
    #[command(subcommand)]
    command: Option<MachinesCommand>,
}

#[derive(Debug, clap::Subcommand)]
enum MachinesCommand {
    /// Use this machine in every command that names none with --machine.
    Use(UseArgs),
}

/// Arguments of `annulus machines use`.
#[derive(Debug, clap::Args)]
struct UseArgs {
    /// Choose this machine: a name in the list, or a machine file.
    #[arg(value_name = "NAME|FILE")]
    name: String,
}

pub(crate) fn run(args: &MachinesArgs) -> Result<Answer, Refusal> {
    if let Some(MachinesCommand::Use(args)) = &args.command {
        return choose(&args.name);
    }
    if let Some(path) = &args.rehearsal {
        return make_rehearsal(path);
    }
    let used = MachineArgs::default();
    let mut rows = Vec::new();
    let (mut table, mut unread) = (Vec::new(), String::new());
    for name in machine_file::words() {
        let is_used = name == used.name();
        let known = match machine_file::named(&name) {
            Ok(known) => known,
            Err(refusal) => {
                let _ = writeln!(unread, "{name:<16} {refusal}");
                let error = &refusal.object()["error"];
                rows.push(json!({ "name": name, "ok": false, "error": error, "used": is_used }));
                continue;
            }
        };
        let machine = &known.machine;
        let alias_of = machine_table::alias_of(&name);
        if alias_of.is_none() {
            let mut row = machine_table::row(&name, machine);
            row[0].insert_str(0, if is_used { "* " } else { "  " });
            table.push(row);
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
            "used": is_used,
        }));
    }
    let chosen = sentence(&format!("cli.report.used_{}", used.origin()), &[("name", &used.name())]);
    let text = machine_table::text(&table) + &unread + &chosen + "\n";
    let report = json!({ "machines": rows, "machine": used.name(), "machine_from": used.origin() });
    Ok(Answer::new(&report, text))
}

/// Saves the machine for all commands.
fn choose(name: &str) -> Result<Answer, Refusal> {
    let known = machine_file::named(name)?;
    let preset = machine::preset_name(name);
    let is_name = known.path == machine_file::path_of(preset);
    // A file keeps its meaning in another folder.
    let saved = if is_name { preset.to_owned() } else { whole(&known.path) };
    machine_file::choose(&saved).map_err(|error| {
        let file = machine_file::data_folder().display().to_string();
        Refusal::surroundings(error!("machine.file_not_saved", file = file, reason = error))
    })?;
    let text = sentence("cli.report.machine_used", &[("machine", &known.machine.name)]) + "\n";
    Ok(Answer::new(&json!({ "machine": saved, "machine_from": "chosen", "title": known.machine.name }), text))
}

fn whole(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
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
