//! `cargo xtask test`: prepare, then run everything, and count.
//!
//! Goes out: what every suite says as it runs; at the end how long each took, what failed once more, and one last line,
//! `N passed, N failed` with `, N skipped` if any; an error when anything failed. Does not know what the tests prove.

use crate::recap::Recap;
use crate::sh::{Done, command, root, say, shown, target};
use crate::{browser, npm, page, tools, wasm};
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Instant;

/// Lines kept of what a suite wrote last, for the case that it fails and no test of it did.
const LAST_LINES: usize = 40;

/// How many tests did what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Count {
    passed: i64,
    failed: i64,
    skipped: i64,
}

impl Count {
    fn add(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.skipped += other.skipped;
    }
}

/// One thing to run: its name, how, and whether its output counts tests.
struct Suite {
    name: &'static str,
    command: Command,
    counts: bool,
}

fn check(name: &'static str, command: Command) -> Suite {
    Suite { name, command, counts: false }
}

fn tests(name: &'static str, command: Command) -> Suite {
    Suite { name, command, counts: true }
}

/// Runs everything whose name contains the first argument, or all.
pub(crate) fn run(arguments: &[String]) -> Done {
    let chosen = arguments.first().map_or("", String::as_str);
    let mut total = Count::default();
    let (mut told, mut times) = (Vec::new(), Vec::new());
    let began = Instant::now();
    let suites = suites()?;
    times.push(format!("preparation {} s", began.elapsed().as_secs()));
    for mut suite in suites.into_iter().filter(|suite| suite.name.contains(chosen)) {
        say(&format!("{}: {}", suite.name, shown(&suite.command)));
        let began = Instant::now();
        let (count, recap) = run_suite(&mut suite)?;
        told.extend(recap.told(suite.name));
        times.push(format!("{} {} s", suite.name, began.elapsed().as_secs()));
        total.add(count);
    }
    println!("{}", times.join(", "));
    for line in told {
        println!("{line}");
    }
    let skipped = if total.skipped > 0 { format!(", {} skipped", total.skipped) } else { String::new() };
    println!("{} passed, {} failed{skipped}", total.passed, total.failed);
    std::io::stdout().flush().map_err(|error| error.to_string())?;
    if total.failed > 0 { Err("Something failed; the names are above.".to_owned()) } else { Ok(()) }
}

fn suites() -> Done<Vec<Suite>> {
    let toolchain = wasm::ensure()?;
    let browser = browser::ensure()?;
    let tools = tools::ensure()?;
    npm::ensure()?;
    page::build()?;
    let mut suites = checks(&toolchain, &tools);
    suites.insert(1, tests("native", native()));
    for (name, package) in [("wasm-core", "core"), ("wasm-app", "app")] {
        let mut pack = command(
            tools.join("wasm-pack"),
            &["test", "--headless", "--chrome", "--mode", "no-install", package],
        );
        let old = std::env::var_os("PATH").unwrap_or_default();
        let path = std::env::join_paths(std::iter::once(tools.clone()).chain(std::env::split_paths(&old)));
        pack.env("PATH", path.map_err(|error| error.to_string())?).env("CHROMEDRIVER", &browser.driver);
        pack.env("WASM_BINDGEN_TEST_TIMEOUT", "300").env("WASM_BINDGEN_TEST_DRIVER_TIMEOUT", "60");
        toolchain.apply(&mut pack);
        suites.push(tests(name, pack));
    }
    let mut pages = command("node", &["--test", "--test-concurrency=1", "--test-reporter=tap"]);
    pages.args(npm::tests());
    pages.env("ANNULUS_BIN", target().join("debug/annulus")).env("ANNULUS_CHROMIUM", &browser.chromium);
    suites.push(tests("browser", pages));
    Ok(suites)
}

/// Native tests of everything; the bridge is built on the way.
fn native() -> Command {
    command("cargo", &["test", "--workspace", "--no-fail-fast", "--", "--show-output"])
}

/// Form, lints, documents, licences.
fn checks(toolchain: &wasm::Toolchain, tools: &Path) -> Vec<Suite> {
    let cargo = |arguments: &[&str]| command("cargo", arguments);
    let mut page = cargo(&["clippy", "-p", "annulus-app", "--target", wasm::TRIPLE, "--", "-Dwarnings"]);
    toolchain.apply(&mut page);
    let mut docs = cargo(&["doc", "--workspace", "--no-deps", "--document-private-items"]);
    docs.env("RUSTDOCFLAGS", "-Dwarnings");
    let deny = ["check", "--hide-inclusion-graph", "licenses", "bans", "sources"];
    vec![
        check("fmt", cargo(&["fmt", "--all", "--check"])),
        check("clippy", cargo(&["clippy", "--workspace", "--all-targets", "--", "-Dwarnings"])),
        check("clippy-page", page),
        check("docs", docs),
        check("deny", command(tools.join("cargo-deny"), &deny)),
    ]
}

/// Runs one suite with its output shown, counting as it goes. A suite that fails without a failed test counts as one.
fn run_suite(suite: &mut Suite) -> Done<(Count, Recap)> {
    let name = suite.name;
    let failed = |error: std::io::Error| format!("{name} could not be run: {error}.");
    let command = suite.command.current_dir(root()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(failed)?;
    let errors =
        child.stderr.take().map(|stderr| thread::spawn(|| passed_on(stderr, |line| eprintln!("{line}"))));
    let (mut count, mut recap) = (Count::default(), Recap::default());
    let said = child.stdout.take().map(|stdout| {
        passed_on(stdout, |line| {
            println!("{line}");
            if suite.counts {
                count.add(counted(line));
                recap.hear(line);
            }
        })
    });
    let good = child.wait().map_err(failed)?.success();
    let errors = errors.and_then(|thread| thread.join().ok());
    if !suite.counts {
        count.passed = i64::from(good);
    }
    if !good && count.failed == 0 {
        count.failed = 1;
    }
    if !good && recap.is_empty() {
        recap.without_a_test(said.into_iter().chain(errors).flatten().collect());
    }
    Ok((count, recap))
}

/// Hands on what is read, line by line, and gives the last lines.
fn passed_on(from: impl Read, mut to: impl FnMut(&str)) -> VecDeque<String> {
    let mut last = VecDeque::new();
    for line in BufReader::new(from).split(b'\n').map_while(Result::ok) {
        let line = String::from_utf8_lossy(&line).into_owned();
        to(&line);
        last.push_back(line);
        if last.len() > LAST_LINES {
            last.pop_front();
        }
    }
    last
}

/// What a line of a runner's output counts.
fn counted(line: &str) -> Count {
    let number = |text: &str| text.split_whitespace().next().and_then(|word| word.parse().ok()).unwrap_or(0);
    if let Some((_, rest)) = line.split_once("test result: ").and_then(|(_, rest)| rest.split_once(". ")) {
        let field = |name: &str| {
            rest.split(';').find(|part| part.contains(name)).map_or(0, |part| number(part.trim()))
        };
        return Count { passed: field(" passed"), failed: field(" failed"), skipped: field(" ignored") };
    }
    if let Some(rest) = line.strip_prefix("# pass ") {
        return Count { passed: number(rest), ..Count::default() };
    }
    if let Some(rest) = line.strip_prefix("# fail ") {
        return Count { failed: number(rest), ..Count::default() };
    }
    // A test that could not look says so and passes: it is counted as skipped instead.
    let skipped = i64::from(line.starts_with("skipped:"));
    Count { passed: -skipped, failed: 0, skipped }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closing_lines_of_every_runner_are_understood() {
        let rows = [
            ("test result: ok. 9 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out", (9, 0, 1)),
            ("test result: FAILED. 7 passed; 2 failed; 0 ignored; 0 filtered out", (7, 2, 0)),
            ("# pass 12", (12, 0, 0)),
            ("# fail 3", (0, 3, 0)),
            ("skipped: no corpus", (-1, 0, 1)),
            ("running 3 tests", (0, 0, 0)),
        ];
        for (line, (passed, failed, skipped)) in rows {
            assert_eq!(counted(line), Count { passed, failed, skipped }, "{line}");
        }
    }
}
