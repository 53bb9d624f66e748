//! Programs that the tests need and that cargo can build: built once for every checkout of a person, kept in the cache
//! of that person (`~/.cache/annulus/tools`) or where `ANNULUS_TOOLS` says.
//!
//! Goes out: the folder with the programs. Does not know what they do.

use crate::sh::{Done, command, output, root, run, say, target};
use std::path::PathBuf;

/// One such program.
struct Tool {
    program: &'static str,
    package: &'static str,
    version: &'static str,
    /// Whether it builds with the lock file it ships.
    locked: bool,
    /// How much it is optimised: the runner works through many megabytes, the others do little.
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

/// The folder that holds their `bin`.
fn home() -> PathBuf {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    if let Some(folder) = set("ANNULUS_TOOLS") {
        return root().join(folder);
    }
    let cache = set("XDG_CACHE_HOME").or_else(|| set("HOME").map(|home| home.join(".cache")));
    cache.map_or_else(|| target().join("tools"), |cache| cache.join("annulus/tools"))
}

fn is_there(tool: &Tool) -> bool {
    let said = output(&mut command(home().join("bin").join(tool.program), &["--version"]));
    said.is_some_and(|said| said.split_whitespace().any(|word| word == tool.version))
}

/// Those that are missing or of another version.
pub(crate) fn missing() -> Vec<&'static str> {
    TOOLS.iter().filter(|tool| !is_there(tool)).map(|tool| tool.program).collect()
}

/// Builds what is missing, and gives the folder with the programs. Quick to build rather than quick to run: they
/// are used for seconds.
pub(crate) fn ensure() -> Done<PathBuf> {
    for tool in TOOLS.iter().filter(|tool| !is_there(tool)) {
        say(&format!(
            "{} {} is missing; building it once (one to three minutes)",
            tool.program, tool.version
        ));
        let home = home();
        let mut install =
            command("cargo", &["install", tool.package, "--version", tool.version, "--force", "--root"]);
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
