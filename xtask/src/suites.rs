//! The suites of `cargo xtask test`, run two at a time: each starts in order as soon as the suites that it
//! needs have ended. Source checks are last and run at low priority, so that they do not slow tests with
//! their own clocks. Tests that need precise timing wait until no browser runs.
//!
//! ```text
//! worker 1   fmt ─ build ──────────── native ─── grbl ─ adapter ─ clippy ─ …
//! worker 2   page ─────────── tools ─ own ─ … ─ browser ──────── clocks ─ …    time ─▶
//! ```

use crate::sh::{Done, command, target, which};
use crate::{browser, firmware, grbl, npm, page, tools, wasm};
use std::process::Command;

/// Every package except xtask: with it, cargo would build their common dependencies a second time.
pub(crate) const ALL: [&str; 3] = ["--workspace", "--exclude", "xtask"];

#[derive(Clone, Copy)]
pub(crate) struct Suite {
    pub(crate) name: &'static str,
    /// Suites that must end first.
    pub(crate) after: &'static [&'static str],
    /// `true` if its output counts tests; if not, it counts as one.
    pub(crate) counts: bool,
    /// Installs what it needs, and returns the command to run.
    pub(crate) command: fn() -> Done<Command>,
}

const fn tests(name: &'static str, after: &'static [&'static str], command: fn() -> Done<Command>) -> Suite {
    Suite { name, after, counts: true, command }
}

/// A suite that passes or fails as one.
const fn check(name: &'static str, after: &'static [&'static str], command: fn() -> Done<Command>) -> Suite {
    Suite { name, after, counts: false, command }
}

pub(crate) const SUITES: &[Suite] = &[
    check("fmt", &[], || Ok(command("cargo", &["fmt", "--all", "--check"]))),
    check("page", &[], || this("site")),
    check("build", &[], || Ok(cargo("test", &["--no-run"]))),
    check("tools", &[], || this("tools")),
    tests("native", &["build"], native),
    tests("browser", &["build", "page"], pages),
    tests("clocks", &["native", "browser"], clocks),
    tests("grbl", &["build"], controllers),
    tests("adapter", &["build"], firmware::tests),
    tests("wasm", &["tools", "page"], in_browser),
    tests("own", &[], || Ok(command("cargo", &["test", "-p", "xtask", "--", "--show-output"]))),
    check("clippy", &["build"], || Ok(patient(cargo("clippy", &["--all-targets", "--", "-Dwarnings"])))),
    // `--all-targets` leaves out test targets that a plain `cargo test` does not run.
    check("clippy-boards", &["build"], || {
        Ok(patient(cargo(
            "clippy",
            &["--test", "grbl", "--test", "usb", "--test", "adapter", "--", "-Dwarnings"],
        )))
    }),
    check("clippy-page", &["page"], clippy_page),
    check("docs", &["build"], docs),
    check("clippy-own", &[], || {
        Ok(patient(command("cargo", &["clippy", "-p", "xtask", "--all-targets", "--", "-Dwarnings"])))
    }),
    check("deny", &["tools"], deny),
];

/// A cargo command for every package that ships or tests.
fn cargo(word: &str, arguments: &[&str]) -> Command {
    command("cargo", &[&[word][..], &ALL, arguments].concat())
}

fn patient(eager: Command) -> Command {
    if which("nice").is_none() {
        return eager;
    }
    let mut patient = command("nice", &["-n", "10"]);
    patient.arg(eager.get_program()).args(eager.get_args());
    for (name, value) in eager.get_envs() {
        match value {
            Some(value) => patient.env(name, value),
            None => patient.env_remove(name),
        };
    }
    patient
}

/// This program with another argument.
fn this(word: &str) -> Done<Command> {
    Ok(command(std::env::current_exe().map_err(|error| error.to_string())?, &[word]))
}

/// Tests of the bridge that fail if the computer is late: pulses of a card, and a line to a spindle, in
/// real time.
const CLOCKS: [&str; 3] = ["server::card::", "server::spindle::", "twin::"];

/// Three tests at a time per core: the bridge's tests mostly wait.
fn native() -> Done<Command> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let threads = format!("--test-threads={}", 3 * cores);
    let mut native = cargo("test", &["--no-fail-fast", "--", "--show-output", &threads]);
    native.args(CLOCKS.iter().flat_map(|name| ["--skip", *name]));
    Ok(native)
}

fn clocks() -> Done<Command> {
    let mut clocks = cargo("test", &["--test", "bridge", "--", "--show-output", "--test-threads=1"]);
    clocks.args(CLOCKS);
    Ok(clocks)
}

/// Jobs on the GRBL firmware, three at a time: they mostly wait in real time.
fn controllers() -> Done<Command> {
    grbl::ensure()?;
    Ok(cargo("test", &["--test", "grbl", "--", "--test-threads=3", "--show-output"]))
}

fn clippy_page() -> Done<Command> {
    let mut clippy = command(
        "cargo",
        &["clippy", "-p", "annulus-app", "--profile", "page", "--target", wasm::TRIPLE, "--", "-Dwarnings"],
    );
    wasm::ensure()?.apply(&mut clippy);
    Ok(patient(clippy))
}

fn docs() -> Done<Command> {
    let mut docs = cargo("doc", &["--no-deps", "--document-private-items"]);
    docs.env("RUSTDOCFLAGS", "-Dwarnings");
    Ok(patient(docs))
}

fn deny() -> Done<Command> {
    let arguments = ["check", "--hide-inclusion-graph", "licenses", "bans", "sources"];
    Ok(command(tools::ensure()?.join("cargo-deny"), &arguments))
}

/// The page's tests in a headless browser, with the page's own compiler options, to reuse its build.
fn in_browser() -> Done<Command> {
    let (toolchain, browser, tools) = (wasm::ensure()?, browser::ensure()?, tools::ensure()?);
    let mut pack = command(
        tools.join("wasm-pack"),
        &["test", "--headless", "--chrome", "--mode", "no-install", "app", "--profile", "page", "--lib"],
    );
    pack.args(["--config", &page::anonymous()]);
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
    let firmware = firmware::emulated()?;
    // Two files at a time: each has its own bridge, home folder and browser. A test that takes a quarter of
    // an hour hangs.
    let mut pages = command("node", &["--test", "--test-concurrency=2", "--test-timeout=900000"]);
    for reporter in ["tap", "./tests/browser/seconds.mjs"] {
        pages.arg(format!("--test-reporter={reporter}")).arg("--test-reporter-destination=stdout");
    }
    pages.args(npm::tests());
    pages.env("ANNULUS_BIN", target().join("debug/annulus")).env("ANNULUS_CHROMIUM", &browser.chromium);
    pages.env("ANNULUS_FIRMWARE", firmware);
    Ok(pages)
}
