//! Programs that the tests need and cargo can build: built once per user, in `~/.cache/annulus/tools` or
//! `ANNULUS_TOOLS`.

use crate::sh::{Done, command, output, root, run, say, target};
use std::path::PathBuf;

struct Tool {
    program: &'static str,
    package: &'static str,
    version: &'static str,
    /// Builds with its own lock file.
    locked: bool,
    /// Optimisation level: the runner processes many megabytes, the others little.
    optimised: &'static str,
}

const TOOLS: &[Tool] = &[
    Tool {
        program: "wasm-bindgen-test-runner",
        package: "wasm-bindgen-cli",
        version: "0.2.130",
        locked: false,
        optimised: "1",
    },
    Tool { program: "wasm-pack", package: "wasm-pack", version: "0.15.1", locked: true, optimised: "0" },
    Tool { program: "cargo-deny", package: "cargo-deny", version: "0.20.2", locked: true, optimised: "0" },
];

/// Builds the manual; the tests don't need it.
const BOOK: Tool =
    Tool { program: "mdbook", package: "mdbook", version: "v0.5.4", locked: true, optimised: "0" };

/// The folder that contains `bin`.
fn home() -> PathBuf {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    if let Some(folder) = set("ANNULUS_TOOLS") {
        return root().join(folder);
    }
    let cache = set("XDG_CACHE_HOME").or_else(|| set("HOME").map(|home| home.join(".cache")));
    cache.map_or_else(|| target().join("tools"), |cache| cache.join("annulus/tools"))
}

/// The version without the `v` that some programs print.
fn number(tool: &Tool) -> &'static str {
    tool.version.trim_start_matches('v')
}

fn is_there(tool: &Tool) -> bool {
    let said = output(&mut command(home().join("bin").join(tool.program), &["--version"]));
    said.is_some_and(|said| said.split_whitespace().any(|word| word == tool.version))
}

pub(crate) fn missing() -> Vec<&'static str> {
    TOOLS.iter().filter(|tool| !is_there(tool)).map(|tool| tool.program).collect()
}

/// Builds what the tests miss. Returns the folder of the programs.
pub(crate) fn ensure() -> Done<PathBuf> {
    install(TOOLS)
}

/// The program that builds the manual.
pub(crate) fn book() -> Done<PathBuf> {
    Ok(install(&[BOOK])?.join(BOOK.program))
}

/// Builds what is missing, quickly rather than well optimised.
fn install(tools: &[Tool]) -> Done<PathBuf> {
    for tool in tools.iter().filter(|tool| !is_there(tool)) {
        say(&format!(
            "{} {} is missing; building it once (one to three minutes)",
            tool.program, tool.version
        ));
        let home = home();
        let mut install =
            command("cargo", &["install", tool.package, "--version", number(tool), "--force", "--root"]);
        install.arg(home).env("CARGO_TARGET_DIR", target().join("tools-build"));
        if tool.locked {
            install.arg("--locked");
        }
        install
            .env("CARGO_PROFILE_RELEASE_OPT_LEVEL", tool.optimised)
            .env("CARGO_PROFILE_RELEASE_LTO", "off");
        run(install
            .env("CARGO_PROFILE_RELEASE_CODEGEN_UNITS", "16")
            .env("CARGO_PROFILE_RELEASE_DEBUG", "0"))?;
    }
    Ok(home().join("bin"))
}
