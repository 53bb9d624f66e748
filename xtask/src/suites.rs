//! What `cargo xtask test` runs: two lanes of suites, each lane one after the other, so that what compiles for the page
//! goes on beside what compiles for this machine.
//!
//! ```text
//! here   fmt ─ build ─ native ─ grbl ─ adapter ─ clippy ─ docs ─ deny (after tools)
//! page   page ─ tools ─ wasm ─ clippy-page ─ browser (after build)
//! ```
//!
//! Goes out: the suites in order, each able to say its command when its turn comes. Does not know how they are run.

use crate::sh::{Done, command, target};
use crate::{browser, firmware, grbl, npm, tools, wasm};
use std::process::Command;

/// One thing to run.
#[derive(Clone, Copy)]
pub(crate) struct Suite {
    /// What people call it.
    pub(crate) name: &'static str,
    /// Suites that must have ended before.
    pub(crate) after: &'static [&'static str],
    /// Whether its output counts tests; else it counts as one itself.
    pub(crate) counts: bool,
    /// Installs what it needs, and says what to run.
    pub(crate) command: fn() -> Done<Command>,
}

/// The two lanes, each in order.
pub(crate) const LANES: [&[Suite]; 2] = [
    &[
        Suite { name: "fmt", after: &[], counts: false, command: || cargo(&["fmt", "--all", "--check"]) },
        Suite {
            name: "build",
            after: &[],
            counts: false,
            command: || cargo(&["test", "--workspace", "--no-run"]),
        },
        Suite { name: "native", after: &["build"], counts: true, command: native },
        Suite { name: "grbl", after: &["build"], counts: true, command: controllers },
        Suite { name: "adapter", after: &[], counts: true, command: firmware::tests },
        Suite { name: "clippy", after: &[], counts: false, command: clippy },
        Suite { name: "docs", after: &[], counts: false, command: docs },
        Suite { name: "deny", after: &["tools"], counts: false, command: deny },
    ],
    &[
        Suite { name: "page", after: &[], counts: false, command: || this("site") },
        Suite { name: "tools", after: &[], counts: false, command: || this("tools") },
        Suite { name: "wasm", after: &["tools"], counts: true, command: in_browser },
        Suite { name: "clippy-page", after: &[], counts: false, command: clippy_page },
        Suite { name: "browser", after: &["build", "page"], counts: true, command: pages },
    ],
];

fn cargo(arguments: &[&str]) -> Done<Command> {
    Ok(command("cargo", arguments))
}

/// This program again, with another word.
fn this(word: &str) -> Done<Command> {
    Ok(command(std::env::current_exe().map_err(|error| error.to_string())?, &[word]))
}

fn native() -> Done<Command> {
    cargo(&["test", "--workspace", "--no-fail-fast", "--", "--show-output"])
}

/// Jobs on the GRBL firmware: three boards at a time, which mostly wait for their own seconds.
fn controllers() -> Done<Command> {
    grbl::ensure()?;
    cargo(&["test", "--workspace", "--test", "grbl", "--", "--test-threads=3", "--show-output"])
}

fn clippy() -> Done<Command> {
    cargo(&["clippy", "--workspace", "--all-targets", "--", "-Dwarnings"])
}

fn clippy_page() -> Done<Command> {
    let mut clippy = command(
        "cargo",
        &["clippy", "-p", "annulus-app", "--profile", "page", "--target", wasm::TRIPLE, "--", "-Dwarnings"],
    );
    wasm::ensure()?.apply(&mut clippy);
    Ok(clippy)
}

fn docs() -> Done<Command> {
    let mut docs = command("cargo", &["doc", "--workspace", "--no-deps", "--document-private-items"]);
    docs.env("RUSTDOCFLAGS", "-Dwarnings");
    Ok(docs)
}

fn deny() -> Done<Command> {
    let arguments = ["check", "--hide-inclusion-graph", "licenses", "bans", "sources"];
    Ok(command(tools::ensure()?.join("cargo-deny"), &arguments))
}

/// The tests of `core` and `app` in a headless browser, sharing what the page was built of.
fn in_browser() -> Done<Command> {
    let (toolchain, browser, tools) = (wasm::ensure()?, browser::ensure()?, tools::ensure()?);
    let arguments = ["test", "--headless", "--chrome", "--mode", "no-install", "app", "--profile", "page"];
    let mut pack = command(tools.join("wasm-pack"), &arguments);
    pack.args(["-p", "annulus-app", "-p", "annulus-core"]);
    let old = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::iter::once(tools).chain(std::env::split_paths(&old)));
    pack.env("PATH", path.map_err(|error| error.to_string())?).env("CHROMEDRIVER", &browser.driver);
    pack.env("WASM_BINDGEN_TEST_TIMEOUT", "300").env("WASM_BINDGEN_TEST_DRIVER_TIMEOUT", "60");
    toolchain.apply(&mut pack);
    Ok(pack)
}

fn pages() -> Done<Command> {
    let browser = browser::ensure()?;
    npm::ensure()?;
    grbl::ensure()?;
    // Two files at a time: each has a bridge, a home and a browser of its own.
    let mut pages = command("node", &["--test", "--test-concurrency=2"]);
    for reporter in ["tap", "./tests/browser/seconds.mjs"] {
        pages.arg(format!("--test-reporter={reporter}")).arg("--test-reporter-destination=stdout");
    }
    pages.args(npm::tests());
    pages.env("ANNULUS_BIN", target().join("debug/annulus")).env("ANNULUS_CHROMIUM", &browser.chromium);
    Ok(pages)
}
