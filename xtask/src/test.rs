//! `cargo xtask test [--long] [NAME]`: runs the suites whose name contains NAME, or all, two at a time, and
//! counts. `--long` runs every random test at its full size.

use crate::recap::Recap;
use crate::sh::{Done, command, output, root, say, shown};
use crate::suites::{SUITES, Suite};
use std::collections::{BTreeSet, VecDeque};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Condvar, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Last lines to print of a suite that fails without a failed test.
const LAST_LINES: usize = 40;

/// A suite without output for this long hangs. It is killed, and its last lines are printed.
const SILENCE: Duration = Duration::from_mins(20);

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

/// Suites at a time: compiling suites use every core, and suites that wait for a machine use none.
const WORKERS: usize = 2;

#[derive(Default)]
struct Total {
    begun: BTreeSet<&'static str>,
    count: Count,
    told: Vec<String>,
    times: Vec<String>,
    ended: BTreeSet<&'static str>,
    /// Builds that failed: what needs them is not run.
    broken: BTreeSet<&'static str>,
}

pub(crate) fn run(arguments: &[String]) -> Done {
    let long = arguments.iter().any(|argument| argument == "--long");
    if let Some(unknown) =
        arguments.iter().find(|argument| argument.starts_with('-') && *argument != "--long")
    {
        return Err(format!("cargo xtask test takes --long and the name of a suite, not {unknown}."));
    }
    let name = arguments.iter().find(|argument| !argument.starts_with('-')).map_or("", String::as_str);
    let chosen = chosen(name);
    if chosen.is_empty() {
        return Err(format!("No suite is called {name}."));
    }
    let (total, turn) = (Mutex::new(Total::default()), Condvar::new());
    let began = Instant::now();
    thread::scope(|scope| {
        for _ in 0..WORKERS {
            scope.spawn(|| {
                while let Some(suite) = next(&chosen, &total, &turn) {
                    one(suite, long, &total);
                    turn.notify_all();
                }
            });
        }
    });
    let total = total.into_inner().unwrap_or_else(PoisonError::into_inner);
    println!("{}; in all {} s", total.times.join(", "), began.elapsed().as_secs());
    for line in &total.told {
        println!("{line}");
    }
    let count = total.count;
    let skipped = if count.skipped > 0 { format!(", {} skipped", count.skipped) } else { String::new() };
    println!("{} passed, {} failed{skipped}", count.passed, count.failed);
    std::io::stdout().flush().map_err(|error| error.to_string())?;
    if count.failed > 0 { Err("Something failed; the names are above.".to_owned()) } else { Ok(()) }
}

/// The suites whose name contains `name`, and those that they need.
fn chosen(name: &str) -> BTreeSet<&'static str> {
    let mut chosen: BTreeSet<_> =
        SUITES.iter().map(|suite| suite.name).filter(|suite| suite.contains(name)).collect();
    let needed: Vec<_> =
        SUITES.iter().filter(|suite| chosen.contains(suite.name)).flat_map(|suite| suite.after).collect();
    chosen.extend(needed);
    chosen
}

/// Waits for the next suite that may start; `None` when all have started.
fn next(chosen: &BTreeSet<&str>, total: &Mutex<Total>, turn: &Condvar) -> Option<&'static Suite> {
    let mut total = total.lock().unwrap_or_else(PoisonError::into_inner);
    loop {
        let mut left = SUITES
            .iter()
            .filter(|suite| chosen.contains(suite.name) && !total.begun.contains(suite.name))
            .peekable();
        left.peek()?;
        if let Some(suite) = left.find(|suite| suite.after.iter().all(|name| total.ended.contains(name))) {
            total.begun.insert(suite.name);
            return Some(suite);
        }
        total = turn.wait(total).unwrap_or_else(PoisonError::into_inner);
    }
}

fn one(suite: &'static Suite, long: bool, total: &Mutex<Total>) {
    let began = Instant::now();
    let ended = possible(suite, total)
        .and_then(|()| (suite.command)())
        .and_then(|command| run_suite(suite, command, long));
    let (count, recap) = ended.unwrap_or_else(|sentence| {
        let mut recap = Recap::default();
        recap.without_a_test(vec![sentence]);
        (Count { failed: 1, ..Count::default() }, recap)
    });
    let mut total = total.lock().unwrap_or_else(PoisonError::into_inner);
    total.told.extend(recap.told(suite.name));
    total.times.push(format!("{} {} s", suite.name, began.elapsed().as_secs()));
    total.count.add(count);
    total.ended.insert(suite.name);
    if !suite.counts && count.failed > 0 {
        total.broken.insert(suite.name);
    }
}

/// An error if a build that `suite` needs has failed: each of its tests would wait for what is not there.
fn possible(suite: &Suite, total: &Mutex<Total>) -> Done {
    let total = total.lock().unwrap_or_else(PoisonError::into_inner);
    suite
        .after
        .iter()
        .find(|needed| total.broken.contains(*needed))
        .map_or(Ok(()), |needed| Err(format!("{} was not run, because {needed} failed.", suite.name)))
}

/// Runs one suite with its output shown, and counts its tests. A suite that fails without a failed test
/// counts as one failure.
fn run_suite(suite: &Suite, mut run: Command, long: bool) -> Done<(Count, Recap)> {
    if long {
        run.env("ANNULUS_LONG", "1");
    }
    say(&format!("{}: {}", suite.name, shown(&run)));
    let name = suite.name;
    let failed = |error: std::io::Error| format!("{name} could not be run: {error}.");
    run.current_dir(root()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = run.spawn().map_err(failed)?;
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    let heard = Mutex::new(Instant::now());
    let (mut count, mut recap) = (Count::default(), Recap::default());
    let (ended, said, errors) = thread::scope(|scope| {
        let errors = scope.spawn(|| passed_on(stderr, &heard, |line| eprintln!("{name} | {line}")));
        let ended = scope.spawn(|| wait(&mut child, name, &heard, SILENCE));
        let said = passed_on(stdout, &heard, |line| {
            println!("{name} | {line}");
            if suite.counts {
                count.add(counted(line));
                recap.hear(line);
            }
        });
        (ended.join(), said, errors.join().unwrap_or_default())
    });
    let good = ended.map_err(|_| format!("{name} could not be waited for."))?.map_err(failed)?.success();
    if !suite.counts {
        count.passed = i64::from(good);
    }
    if !good && count.failed == 0 {
        count.failed = 1;
    }
    if !good && recap.is_empty() {
        recap.without_a_test(said.into_iter().chain(errors).collect());
    }
    Ok((count, recap))
}

/// Waits for the end of `child`, and kills it with all that it started once it is silent for `limit`.
fn wait(
    child: &mut Child,
    name: &str,
    heard: &Mutex<Instant>,
    limit: Duration,
) -> std::io::Result<ExitStatus> {
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if heard.lock().unwrap_or_else(PoisonError::into_inner).elapsed() > limit {
            eprintln!("{name} | printed nothing for {} s: killed", limit.as_secs());
            kill_tree(child.id());
            return child.wait();
        }
        thread::sleep(Duration::from_millis(200));
    }
}

/// Kills a process, then its descendants. A shell whose child dies first would continue.
fn kill_tree(process: u32) {
    let process = process.to_string();
    let children = output(&mut command("pgrep", &["-P", &process])).unwrap_or_default();
    output(&mut command("kill", &["-9", &process]));
    children.lines().filter_map(|child| child.parse().ok()).for_each(kill_tree);
}

/// Passes on lines as they arrive, and notes when. Returns the last ones.
fn passed_on(from: Option<impl Read>, heard: &Mutex<Instant>, mut to: impl FnMut(&str)) -> VecDeque<String> {
    let mut last = VecDeque::new();
    for line in from.into_iter().flat_map(|from| BufReader::new(from).split(b'\n').map_while(Result::ok)) {
        *heard.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
        let line = String::from_utf8_lossy(&line).into_owned();
        to(&line);
        last.push_back(line);
        if last.len() > LAST_LINES {
            last.pop_front();
        }
    }
    last
}

/// The counts in a line of a runner's output.
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
    // A test that cannot run prints `skipped:` and passes: count it as skipped instead.
    let skipped = i64::from(line.starts_with("skipped:"));
    Count { passed: -skipped, failed: 0, skipped }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_suite_starts_after_its_prerequisites() {
        let place = |name: &str| SUITES.iter().position(|suite| suite.name == name);
        for (at, suite) in SUITES.iter().enumerate() {
            assert_eq!(place(suite.name), Some(at), "{} stands in the list twice", suite.name);
            for needed in suite.after {
                assert!(place(needed).is_some_and(|before| before < at), "{} after {needed}", suite.name);
            }
        }
        let (total, turn) = (Mutex::new(Total::default()), Condvar::new());
        let chosen = chosen("");
        let mut begun = Vec::new();
        while let Some(suite) = next(&chosen, &total, &turn) {
            total.lock().unwrap().ended.insert(suite.name);
            begun.push(suite.name);
        }
        assert_eq!(begun, SUITES.iter().map(|suite| suite.name).collect::<Vec<_>>());
    }

    #[test]
    fn nothing_runs_after_a_failed_build() {
        let suite = |name: &str| SUITES.iter().find(|suite| suite.name == name).unwrap();
        let total = Mutex::new(Total { broken: BTreeSet::from(["page"]), ..Total::default() });
        assert_eq!(
            possible(suite("browser"), &total).unwrap_err(),
            "browser was not run, because page failed."
        );
        assert!(possible(suite("native"), &total).is_ok());
    }

    #[test]
    fn a_silent_suite_is_killed_with_what_it_started() {
        let mut shell = command("sh", &["-c", "sleep 1000 & wait"]);
        let mut child = shell.stdout(Stdio::piped()).spawn().unwrap();
        let (stdout, heard) = (child.stdout.take(), Mutex::new(Instant::now()));
        assert!(!wait(&mut child, "shell", &heard, Duration::from_secs(1)).unwrap().success());
        // The pipe ends when the last process that holds it has ended.
        assert!(passed_on(stdout, &heard, |_| ()).is_empty());
    }

    #[test]
    fn summary_lines_of_every_runner_are_parsed() {
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
