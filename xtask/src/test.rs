//! `cargo xtask test [--long] [NAME]`: runs the suites whose name contains NAME, or all, two at a time, and counts. The few tests of a suite
//! that failed beside others have a second look behind everything, with nothing beside them. `--long` runs every test of chance to its full
//! size.
//!
//! Goes out: what every suite says as it runs, each line under its name; at the end how long each took, what failed once
//! more, and one last line, `N passed, N failed` with `, N skipped` if any; an error when anything failed. Does not know
//! what the tests prove.

use crate::recap::Recap;
use crate::sh::{Done, root, say, shown};
use crate::suites::{SUITES, Suite};
use std::collections::{BTreeSet, VecDeque};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Command, Stdio};
use std::sync::{Condvar, Mutex, PoisonError};
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

/// So many failed tests of a suite have a second look; with more of them it is not the computer that was busy.
const LOOKED_AT_AGAIN: i64 = 6;

/// How many suites run at a time: what compiles takes every core, what waits for a machine's own seconds takes none.
const WORKERS: usize = 2;

/// What the workers have come to together.
#[derive(Default)]
struct Total {
    begun: BTreeSet<&'static str>,
    count: Count,
    told: Vec<String>,
    times: Vec<String>,
    ended: BTreeSet<&'static str>,
    /// What has a second look: the suite, and what failed in it.
    again: Vec<(&'static Suite, Recap)>,
}

/// Runs what was asked for.
pub(crate) fn run(arguments: &[String]) -> Done {
    let long = arguments.iter().any(|argument| argument == "--long");
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
    let mut total = total.into_inner().unwrap_or_else(PoisonError::into_inner);
    for (suite, recap) in std::mem::take(&mut total.again) {
        looked_at_again(suite, long, &recap, &mut total);
    }
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

/// The names of the suites that have `name` in theirs, and of those that these come after.
fn chosen(name: &str) -> BTreeSet<&'static str> {
    let mut chosen: BTreeSet<_> =
        SUITES.iter().map(|suite| suite.name).filter(|suite| suite.contains(name)).collect();
    let needed: Vec<_> =
        SUITES.iter().filter(|suite| chosen.contains(suite.name)).flat_map(|suite| suite.after).collect();
    chosen.extend(needed);
    chosen
}

/// Waits for the first suite whose turn it is, and takes it; none when all have begun.
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

/// Runs `suite` and adds what it came to.
fn one(suite: &'static Suite, long: bool, total: &Mutex<Total>) {
    let began = Instant::now();
    let ended = (suite.command)().and_then(|command| run_suite(suite, command, long));
    let (count, recap) = ended.unwrap_or_else(|sentence| {
        let mut recap = Recap::default();
        recap.without_a_test(vec![sentence]);
        (Count { failed: 1, ..Count::default() }, recap)
    });
    let mut total = total.lock().unwrap_or_else(PoisonError::into_inner);
    total.told.extend(recap.told(suite.name));
    let all_named = usize::try_from(count.failed).is_ok_and(|failed| failed == recap.names().len());
    if suite.alone.is_some() && all_named && (1..=LOOKED_AT_AGAIN).contains(&count.failed) {
        total.again.push((suite, recap));
    }
    total.times.push(format!("{} {} s", suite.name, began.elapsed().as_secs()));
    total.count.add(count);
    total.ended.insert(suite.name);
}

/// Runs the tests of `suite` that failed beside others alone. Those that pass then are told all the same: it may be a fault that is seldom
/// seen, not the computer.
fn looked_at_again(suite: &Suite, long: bool, failed: &Recap, total: &mut Total) {
    let Some(alone) = suite.alone else { return };
    let (began, names) = (Instant::now(), failed.names());
    let ended = alone(&names).and_then(|command| run_suite(suite, command, long));
    total.times.push(format!("{} again {} s", suite.name, began.elapsed().as_secs()));
    match ended {
        Ok((count, recap))
            if recap.is_empty() && count.failed == 0 && usize::try_from(count.passed) == Ok(names.len()) =>
        {
            total.count.add(Count { passed: count.passed, failed: -count.passed, skipped: 0 });
            total.told.push(format!("~ {}: what failed beside other tests passed alone.", suite.name));
        }
        Ok((_, recap)) => total.told.extend(recap.told(&format!("{} again", suite.name))),
        Err(sentence) => total.told.push(sentence),
    }
}

/// Runs one suite with its output shown, counting as it goes. A suite that fails without a failed test counts as one.
fn run_suite(suite: &Suite, mut command: Command, long: bool) -> Done<(Count, Recap)> {
    if long {
        command.env("ANNULUS_LONG", "1");
    }
    say(&format!("{}: {}", suite.name, shown(&command)));
    let name = suite.name;
    let failed = |error: std::io::Error| format!("{name} could not be run: {error}.");
    let command =
        command.current_dir(root()).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(failed)?;
    let errors = child
        .stderr
        .take()
        .map(|stderr| thread::spawn(move || passed_on(stderr, |line| eprintln!("{name} | {line}"))));
    let (mut count, mut recap) = (Count::default(), Recap::default());
    let said = child.stdout.take().map(|stdout| {
        passed_on(stdout, |line| {
            println!("{name} | {line}");
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
    fn every_suite_begins_after_those_that_it_needs() {
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
