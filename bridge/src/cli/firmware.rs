//! Reads and writes the firmware of the USB step adapter. Flashing needs a typed word at a terminal of this
//! computer, and no running bridge, because the bridge may use the adapter.

use super::{Answer, Exit, Refusal, say};
use crate::adapter::adapters;
use crate::adapter::flash::{boot_disk_of, came_back, copy, report};
use crate::adapter::image::{LONGEST, boot_disks, firmware_of, is_boot_disk};
use crate::executor::clock;
use crate::server::runtime;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::OtherFirmware;
use annulus_core::{error, note};
use annulus_host::adapter::own_firmware;
use serde_json::json;
use std::fs;
use std::io::{self, BufRead, IsTerminal};
use std::path::{Path, PathBuf};

/// The word to type.
const WORD: &str = "FLASH";

/// Positions of the firmware file relative to this program: next to it, or in the build folder.
const PLACES: [&str; 2] = ["annulus-adapter.uf2", "../firmware/annulus-adapter.uf2"];

/// Arguments of `annulus firmware`.
#[derive(Debug, clap::Args)]
pub(crate) struct FirmwareArgs {
    #[command(subcommand)]
    command: FirmwareCommand,
}

#[derive(Debug, clap::Subcommand)]
enum FirmwareCommand {
    /// Show the firmware of the USB step adapter, and the one that belongs to this program.
    Info(PortArgs),
    /// Flash the firmware of this program to a USB step adapter or a new board.
    Flash(FlashArgs),
}

/// The port.
#[derive(Debug, clap::Args)]
struct PortArgs {
    /// Use this serial port [default: the only adapter that is plugged in].
    #[arg(long, default_value = "", value_name = "PORT")]
    port: String,
}

/// Arguments of `annulus firmware flash`.
#[derive(Debug, clap::Args)]
struct FlashArgs {
    /// Flash this UF2 file [default: the firmware next to this program].
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    port: PortArgs,
    /// Use the disk of a board in boot mode [default: search for it, or ask the adapter to show it].
    #[arg(long, value_name = "FOLDER")]
    disk: Option<PathBuf>,
    /// Exit without waiting for the adapter to respond.
    #[arg(long)]
    no_wait: bool,
}

pub(crate) fn run(args: &FirmwareArgs) -> Result<Answer, Refusal> {
    // A running bridge may use the adapter for a job.
    if let Some(note) = runtime::running(&runtime::folder()) {
        let why = error!("firmware.bridge_runs", port = note.port);
        return Err(Refusal::surroundings(why));
    }
    match &args.command {
        FirmwareCommand::Info(port) => info(&port.port),
        FirmwareCommand::Flash(args) => flash(args),
    }
}

fn number(firmware: u32) -> String {
    format!("{firmware:08x}")
}

fn info(port: &str) -> Result<Answer, Refusal> {
    let (port, welcome, touches) = report(port, clock::time).map_err(Refusal::surroundings)?;
    let mut answer = found(&port, welcome.firmware);
    let touches = touches.unwrap_or_default();
    let mut rows = Vec::new();
    for (input, (count, longest_us)) in touches.short.into_iter().zip(touches.longest_us).enumerate() {
        if count == 0 {
            continue;
        }
        let pin = usize::from(welcome.input_pin) + input;
        let note = note!("firmware.touched", input = input, pin = pin, ..);
        let note = note.with("count", count).with("longest", longest_us);
        answer.text += &format!("{}\n", note.message("en"));
        rows.push(json!({ "input": input, "pin": pin, "count": count, "longest_us": longest_us }));
    }
    answer.object["short_touches"] = rows.into();
    Ok(answer)
}

/// The firmware of the adapter at a port, and the one that belongs to this program.
fn found(port: &str, firmware: u32) -> Answer {
    let own = own_firmware();
    let is_own = firmware == own;
    let note = if is_own {
        note!("firmware.own", port = port, found = number(firmware))
    } else {
        OtherFirmware { found: firmware, wanted: own }.warning()
    };
    let object = json!({ "port": port, "firmware": number(firmware), "own": number(own), "is_own": is_own });
    let text = format!("{} {}", note.message("en"), note.advice("en"));
    Answer::new(&object, text.trim_end().to_owned() + "\n")
}

fn flash(args: &FlashArgs) -> Result<Answer, Refusal> {
    let (path, bytes) = file(args.file.as_deref())?;
    let firmware = firmware_of(&bytes).map_err(|why| Refusal::content(why.with("file", path.display())))?;
    confirmed(&path, firmware)?;
    let named = &args.port.port;
    let mut others = adapters();
    let disk = disk(args).map_err(Refusal::surroundings)?;
    // The adapter that shows its disk now no longer has a port.
    let left = adapters();
    others.retain(|other| left.contains(other) && other != named);
    copy(&bytes, &disk).map_err(Refusal::surroundings)?;
    if args.no_wait {
        let done = note!("firmware.copied", disk = disk.display());
        let object =
            json!({ "file": path.display().to_string(), "firmware": number(firmware), "port": null });
        return Ok(Answer::new(&object, done.message("en") + "\n"));
    }
    let came = came_back(named, &others, clock::time);
    let came = came.map(|(port, welcome)| (port, welcome.firmware));
    taken(came, firmware).map_err(Refusal::surroundings)
}

/// Checks that the returned adapter reports `firmware`.
fn taken(came: Option<(String, u32)>, firmware: u32) -> Result<Answer, Diagnostic> {
    match came {
        Some((port, has)) if has == firmware => Ok(found(&port, firmware)),
        Some((port, has)) => {
            let why = error!("firmware.not_taken", port = port, ..);
            Err(why.with("found", number(has)).with("wanted", number(firmware)))
        }
        None => Err(error!("firmware.not_seen")),
    }
}

/// The named file, or the one next to this program.
fn file(named: Option<&Path>) -> Result<(PathBuf, Vec<u8>), Refusal> {
    let beside = || {
        let folder = std::env::current_exe().ok()?.parent()?.to_owned();
        PLACES.iter().map(|place| folder.join(place)).find(|path| path.is_file())
    };
    let path = named.map(Path::to_owned).or_else(beside);
    let path = path.ok_or_else(|| Refusal::surroundings(error!("firmware.no_file")))?;
    let refuse = |reason: String| {
        let why = error!("firmware.unreadable", file = path.display(), ..);
        Refusal::surroundings(why.with("reason", reason))
    };
    let length = fs::metadata(&path).map_err(|error| refuse(error.to_string()))?.len();
    if length > LONGEST {
        return Err(refuse(format!("{length} > {LONGEST} bytes")));
    }
    let bytes = fs::read(&path).map_err(|error| refuse(error.to_string()))?;
    Ok((path, bytes))
}

/// Asks the user at this terminal to confirm.
fn confirmed(path: &Path, firmware: u32) -> Result<(), Refusal> {
    let mut input = io::stdin().lock();
    if !input.is_terminal() {
        return Err(Refusal::content(error!("firmware.no_person")));
    }
    let asks = note!("firmware.confirm", file = path.display(), ..);
    let asks = asks.with("firmware", number(firmware)).with("word", WORD);
    say(format_args!("{} {}", asks.message("en"), asks.advice("en")));
    let mut typed = String::new();
    let _ = input.read_line(&mut typed);
    if typed.trim() == WORD {
        return Ok(());
    }
    Err(Refusal { exit: Exit::Interrupted, ..Refusal::content(error!("firmware.not_confirmed")) })
}

/// The named disk; otherwise the disk of a board in boot mode; otherwise the adapter is asked to show it.
fn disk(args: &FlashArgs) -> Result<PathBuf, Diagnostic> {
    if let Some(disk) = &args.disk {
        let refused = || error!("firmware.no_boot_disk", folder = disk.display());
        return is_boot_disk(disk).then(|| disk.clone()).ok_or_else(refused);
    }
    only(boot_disks())?.map_or_else(|| boot_disk_of(&args.port.port), Ok)
}

/// The only disk; `None` if there is none; an error if there are several.
fn only(mut disks: Vec<PathBuf>) -> Result<Option<PathBuf>, Diagnostic> {
    if disks.len() < 2 {
        return Ok(disks.pop());
    }
    let names: Vec<String> = disks.iter().map(|disk| disk.display().to_string()).collect();
    Err(error!("firmware.several_disks", disks = names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Code of an error, whose text must contain all `names` and no placeholder.
    fn code<T>(result: Result<T, Diagnostic>, names: &[&str]) -> String {
        let Err(why) = result else { return "none".to_owned() };
        let said = format!("{} {}", why.message("en"), why.advice("en"));
        assert!(names.iter().all(|name| said.contains(name)) && !said.contains('{'), "{said}");
        why.code
    }

    #[test]
    fn several_boot_disks_are_an_error() {
        let disks = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        assert_eq!(only(disks(&[])), Ok(None), "the adapter is asked for its own");
        assert_eq!(only(disks(&["/media/a"])), Ok(Some(PathBuf::from("/media/a"))));
        let several = only(disks(&["/media/a", "/media/b"]));
        assert_eq!(code(several, &["/media/a, /media/b", "--disk"]), "firmware.several_disks");
    }

    #[test]
    fn adapter_that_reports_other_firmware_is_an_error() {
        let came = |firmware| Some(("ttyACM3".to_owned(), firmware));
        let there = taken(came(0xABC), 0xABC).unwrap();
        assert_eq!(there.object["firmware"], "00000abc");
        let other = taken(came(0xABD), 0xABC);
        assert_eq!(code(other, &["ttyACM3", "00000abd", "00000abc"]), "firmware.not_taken");
        assert_eq!(code(taken(None, 0xABC), &["annulus firmware info"]), "firmware.not_seen");
    }
}
