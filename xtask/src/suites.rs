//! What `cargo xtask test` runs: one list of suites, two of them at a time, each begun in its turn as soon as those before it
//! that it needs have ended. What only looks at the sources stands last and gives way, so that tests with clocks of their
//! own are not slowed by it. Tests that need a computer on time have their turn when no browser runs any more.
//!
//! ```text
//! worker 1   fmt ─ build ──────────── native ─── grbl ─ adapter ─ clippy ─ …
//! worker 2   page ─────────── tools ─ own ─ … ─ browser ──────── clocks ─ …    time ─▶
//! ```
//!
//! Goes out: the suites in order, each able to say its command when its turn comes. Does not know how they are run.

use crate::sh::{Done, command, target, which};
use crate::{browser, firmware, grbl, npm, tools, wasm};
use std::process::Command;

/// Every package but the one that runs the tests: with it, what both depend on would be built a second time.
pub(crate) const ALL: [&str; 3] = ["--workspace", "--exclude", "xtask"];

/// The command of a suite for tests of these names; for all where there are none.
type OfTests = fn(&[String]) -> Done<Command>;

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
    /// The same for these tests alone: of a suite that keeps the time of life on a computer that is busy beside it.
    pub(crate) alone: Option<OfTests>,
}

impl Suite {
    /// One whose failed tests have a second look, alone.
    const fn looked_at_again(self, alone: OfTests) -> Self {
        Self { alone: Some(alone), ..self }
    }
}

/// A suite that counts tests.
const fn tests(name: &'static str, after: &'static [&'static str], command: fn() -> Done<Command>) -> Suite {
    Suite { name, after, counts: true, command, alone: None }
}

/// A suite that passes or fails as one.
const fn check(name: &'static str, after: &'static [&'static str], command: fn() -> Done<Command>) -> Suite {
    Suite { name, after, counts: false, command, alone: None }
}

/// All of them, in the order in which they begin.
pub(crate) const SUITES: &[Suite] = &[
    check("fmt", &[], || Ok(command("cargo", &["fmt", "--all", "--check"]))),
    check("page", &[], || this("site")),
    check("build", &[], || Ok(cargo("test", &["--no-run"]))),
    check("tools", &[], || this("tools")),
    tests("native", &["build"], native),
    tests("browser", &["build", "page"], || pages(&[])).looked_at_again(pages),
    tests("clocks", &["native", "browser"], clocks),
    tests("grbl", &["build"], || controllers(&[])).looked_at_again(controllers),
    tests("adapter", &["build"], || firmware::tests(&[])).looked_at_again(firmware::tests),
    tests("wasm-app", &["tools", "page"], || in_browser(&["-p", "annulus-app", "--lib"])),
    tests("wasm-core", &["tools", "page"], || in_browser(&["-p", "annulus-core", "--test", "core"])),
    tests("own", &[], || Ok(command("cargo", &["test", "-p", "xtask", "--", "--show-output"]))),
    check("clippy", &["build"], || Ok(patient(cargo("clippy", &["--all-targets", "--", "-Dwarnings"])))),
    // `--all-targets` leaves out what is no part of a plain `cargo test`.
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

/// A command of cargo for every package that ships or tests.
fn cargo(word: &str, arguments: &[&str]) -> Command {
    command("cargo", &[&[word][..], &ALL, arguments].concat())
}

/// The same command, which leaves the processor to others.
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

/// This program again, with another word.
fn this(word: &str) -> Done<Command> {
    Ok(command(std::env::current_exe().map_err(|error| error.to_string())?, &[word]))
}

/// Tests of the bridge whose machine is late where the computer is: pulses of a card and a line to a spindle, in the time of life.
const CLOCKS: [&str; 3] = ["server::card::", "server::spindle::", "twin::"];

/// Three tests at a time for every core: those of the bridge mostly wait, as a person at a drill does.
fn native() -> Done<Command> {
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let threads = format!("--test-threads={}", 3 * cores);
    let mut native = cargo("test", &["--no-fail-fast", "--", "--show-output", &threads]);
    native.args(CLOCKS.iter().flat_map(|name| ["--skip", *name]));
    Ok(native)
}

/// One at a time.
fn clocks() -> Done<Command> {
    let mut clocks = cargo("test", &["--test", "bridge", "--", "--show-output", "--test-threads=1"]);
    clocks.args(CLOCKS);
    Ok(clocks)
}

/// Jobs on the GRBL firmware: three boards at a time, which mostly wait for their own seconds; or those of these names, one at a time.
fn controllers(names: &[String]) -> Done<Command> {
    grbl::ensure()?;
    let threads = if names.is_empty() { "--test-threads=3" } else { "--test-threads=1" };
    let mut controllers = cargo("test", &["--test", "grbl", "--", threads, "--show-output"]);
    if !names.is_empty() {
        controllers.arg("--exact").args(names);
    }
    Ok(controllers)
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

/// The tests of `which` in a headless browser, sharing what the page was built of. Only what has such tests is named: all the
/// rest would be compiled to find none.
fn in_browser(which: &[&str]) -> Done<Command> {
    let (toolchain, browser, tools) = (wasm::ensure()?, browser::ensure()?, tools::ensure()?);
    let arguments = ["test", "--headless", "--chrome", "--mode", "no-install", "app", "--profile", "page"];
    let mut pack = command(tools.join("wasm-pack"), &arguments);
    pack.args(which);
    let old = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::iter::once(tools).chain(std::env::split_paths(&old)));
    pack.env("PATH", path.map_err(|error| error.to_string())?).env("CHROMEDRIVER", &browser.driver);
    pack.env("WASM_BINDGEN_TEST_TIMEOUT", "300").env("WASM_BINDGEN_TEST_DRIVER_TIMEOUT", "60");
    toolchain.apply(&mut pack);
    Ok(pack)
}

/// Tests of the page, or those of these names, one at a time.
fn pages(names: &[String]) -> Done<Command> {
    let browser = browser::ensure()?;
    npm::ensure()?;
    grbl::ensure()?;
    let firmware = firmware::emulated()?;
    // Two files at a time: each has a bridge, a home and a browser of its own.
    let at_a_time = if names.is_empty() { "--test-concurrency=2" } else { "--test-concurrency=1" };
    let mut pages = command("node", &["--test", at_a_time]);
    pages.args(names.iter().map(|name| format!("--test-name-pattern=^{}$", literally(name))));
    for reporter in ["tap", "./tests/browser/seconds.mjs"] {
        pages.arg(format!("--test-reporter={reporter}")).arg("--test-reporter-destination=stdout");
    }
    pages.args(npm::tests());
    pages.env("ANNULUS_BIN", target().join("debug/annulus")).env("ANNULUS_CHROMIUM", &browser.chromium);
    pages.env("ANNULUS_FIRMWARE", firmware);
    Ok(pages)
}

/// A pattern that only `name` fits. TAP writes a sign that means something to it behind a backslash.
fn literally(name: &str) -> String {
    let mut pattern = String::new();
    for sign in name.replace("\\#", "#").replace("\\\\", "\\").chars() {
        if sign.is_ascii_punctuation() {
            pattern.push('\\');
        }
        pattern.push(sign);
    }
    pattern
}

#[cfg(test)]
mod tests {
    use super::literally;

    #[test]
    fn a_name_is_a_pattern_for_itself_alone() {
        for (name, pattern) in [
            ("Shift+2 on Draw (twice)", "Shift\\+2 on Draw \\(twice\\)"),
            ("hole \\#3", "hole \\#3"),
            ("ein Bohrer, größer", "ein Bohrer\\, größer"),
        ] {
            assert_eq!(literally(name), pattern);
        }
    }
}
