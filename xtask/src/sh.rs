//! Runs other programs, and shows their command lines.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};

/// Result of a task; the error is a sentence for the user.
pub(crate) type Done<T = ()> = Result<T, String>;

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_owned).unwrap_or_default()
}

pub(crate) fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), |folder| root().join(folder))
}

pub(crate) fn command(program: impl AsRef<std::ffi::OsStr>, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(root());
    command
}

pub(crate) fn say(text: &str) {
    eprintln!("\x1b[1m▸ {text}\x1b[0m");
}

pub(crate) fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}

/// Runs the command with its output shown; an error names the command.
pub(crate) fn run(command: &mut Command) -> Done {
    say(&shown(command));
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{}` failed ({status}).", shown(command))),
        Err(error) => Err(format!("`{}` could not be started: {error}.", shown(command))),
    }
}

/// The command's standard output, if it succeeds.
pub(crate) fn output(command: &mut Command) -> Option<String> {
    let output = command.stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

pub(crate) fn which(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(program)).find(|file| file.is_file())
}

/// One installation at a time: parallel suites may need system packages.
static INSTALLING: Mutex<()> = Mutex::new(());

/// Installs Debian packages; without the right to do so, the error gives the command line.
pub(crate) fn install_packages(why: &str, packages: &[&str]) -> Done {
    let line = format!("apt-get install --no-install-recommends {}", packages.join(" "));
    if which("apt-get").is_none() {
        return Err(format!(
            "{why} is missing. On Debian or Ubuntu: `sudo {line}`; elsewhere install the same."
        ));
    }
    if output(&mut command("id", &["-u"])).as_deref() != Some("0") {
        return Err(format!(
            "{why} is missing, and only root may install it. Type:\n\n  sudo {line}\n\nthen start again."
        ));
    }
    let _turn = INSTALLING.lock().unwrap_or_else(PoisonError::into_inner);
    say(&format!("{why} is missing; installing the system packages {}", packages.join(" ")));
    run(&mut command("apt-get", &["update", "-q"]))?;
    // Another installation may hold the lock.
    let mut install = command(
        "apt-get",
        &["-o", "DPkg::Lock::Timeout=600", "install", "-y", "-q", "--no-install-recommends"],
    );
    run(install.args(packages).env("DEBIAN_FRONTEND", "noninteractive"))
}
