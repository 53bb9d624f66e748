//! The compiler for the page: rustup's target, or Debian's packages if rustup cannot download.

use crate::sh::{Done, command, install_packages, output, run, say, target, which};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

pub(crate) const TRIPLE: &str = "wasm32-unknown-unknown";

/// A rustup toolchain that can compile for [`TRIPLE`]; `None` for the current one.
#[derive(Clone, Debug)]
pub(crate) struct Toolchain(Option<&'static str>);

impl Toolchain {
    pub(crate) fn apply<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        if let Some(name) = self.0 {
            command.env("RUSTUP_TOOLCHAIN", name).env_remove("CARGO").env_remove("RUSTC");
        }
        command
    }
}

const DEBIAN: &[&str] = &["rustc-web", "cargo-web", "rust-web-src", "rust-web-llvm", "lld-22"];
const DEBIAN_LIBRARIES: &str = "/usr/lib/rustlib/wasm32-unknown-unknown/lib";

/// Ensures a toolchain. `ANNULUS_WASM=debian` forces Debian's packages.
pub(crate) fn ensure() -> Done<Toolchain> {
    if std::env::var("ANNULUS_WASM").as_deref() != Ok("debian") {
        if present() {
            return Ok(Toolchain(None));
        }
        let added =
            which("rustup").is_some() && run(&mut command("rustup", &["target", "add", TRIPLE])).is_ok();
        if added && present() {
            return Ok(Toolchain(None));
        }
    }
    debian()
}

pub(crate) fn present() -> bool {
    let sysroot = output(&mut command("rustc", &["--print", "sysroot"])).map(PathBuf::from);
    sysroot.is_some_and(|sysroot| has_std(&sysroot.join("lib/rustlib").join(TRIPLE).join("lib")))
}

fn has_std(folder: &Path) -> bool {
    let Ok(entries) = fs::read_dir(folder) else { return false };
    entries.flatten().any(|entry| entry.file_name().to_string_lossy().starts_with("libstd-"))
}

/// Debian's compiler, with a standard library built once for the page.
fn debian() -> Done<Toolchain> {
    if output(command("dpkg-query", &["-W"]).args(DEBIAN)).is_none() {
        install_packages("A compiler for WebAssembly", DEBIAN)?;
    }
    if !has_std(Path::new(DEBIAN_LIBRARIES)) {
        build_std()?;
    }
    run(&mut command("rustup", &["toolchain", "link", "web", "/usr"]))?;
    Ok(Toolchain(Some("web")))
}

/// Builds the standard library by building an empty crate with it, and installs it for the compiler.
fn build_std() -> Done {
    say("Building the standard library for WebAssembly, once (about a minute)");
    let folder = target().join("wasm-std");
    let failed = |error: std::io::Error| format!("{} could not be written: {error}.", folder.display());
    fs::create_dir_all(folder.join("src")).map_err(failed)?;
    let manifest = "[package]\nname = \"empty\"\nversion = \"0.0.0\"\nedition = \"2021\"\n[workspace]\n";
    fs::write(folder.join("Cargo.toml"), manifest).map_err(failed)?;
    fs::write(folder.join("src/lib.rs"), "#![no_std]\n").map_err(failed)?;
    let mut build = command("/usr/bin/cargo", &["build", "--release", "--target", TRIPLE]);
    build.arg("-Zbuild-std=std,panic_abort,panic_unwind,test,proc_macro").current_dir(&folder);
    build.env("RUSTC", "/usr/bin/rustc").env("RUSTC_BOOTSTRAP", "1").env("RUSTFLAGS", "-Cembed-bitcode=yes");
    run(build.env("CARGO_TARGET_DIR", folder.join("target")).env_remove("RUSTUP_TOOLCHAIN"))?;
    let made = folder.join("target").join(TRIPLE).join("release/deps");
    fs::create_dir_all(DEBIAN_LIBRARIES).map_err(failed)?;
    for entry in fs::read_dir(&made).map_err(failed)?.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with("lib") && name.ends_with(".rlib") && !name.starts_with("libempty") {
            fs::copy(entry.path(), Path::new(DEBIAN_LIBRARIES).join(&name)).map_err(|error| {
                format!("{DEBIAN_LIBRARIES}/{name} could not be written: {error}. Run this once as root.")
            })?;
        }
    }
    // Objects compiled against another standard library cannot be linked with this one.
    let _ = fs::remove_dir_all(target().join(TRIPLE));
    Ok(())
}
