//! `cargo xtask bench --adapter`: measurements of the USB step adapter, next to known values of other
//! controllers.
//!
//! ```text
//! firmware ─ built ─▶ flash, memory            tests of firmware and host ─ lines "measured KEY: VALUE" ─▶ table
//! ```
//!
//! Judges nothing: the tests do.

use crate::firmware;
use crate::sh::{Done, command, say, shown};
use crate::suites::ALL;
use std::process::{Command, Stdio};

/// Host tests that print measurements; of the firmware's tests, all are run.
const TESTS: [&str; 2] = ["deaths::a_host_that_dies", "deaths::a_step_of_the_sample_board"];

/// Title of a row, start of its measurement's line, and known values of GRBL 1.1h on an ATmega328 and of
/// Klipper on an RP2040.
const ROWS: [[&str; 4]; 15] = [
    [
        "fastest steps",
        "rate",
        "30,000 a second in all ¹",
        "2,570,000 a second in all on three axes, 4,000,000 on one ²",
    ],
    [
        "error of an edge",
        "edges",
        "1.8 µs; 7 … 10 µs while it is asked how it is ³",
        "up to 25 µs early, as its steps are compressed ¹",
    ],
    ["who asks how it is", "polling", "see above", "not known"],
    ["speed while it accelerates", "", "a new one every 10 ms ¹", "a new one every step ¹"],
    ["drilling, over the cable", "bytes drilling", "lines of text, no steps", "not known"],
    ["milling, over the cable", "bytes milling", "lines of text, no steps", "not known"],
    [
        "the host dies, small job",
        "deaths at every packet of a small job",
        "what is buffered is played, up to 16 lines ¹",
        "steps end with the queue, no braking; outputs off after 2 … 3 s ¹",
    ],
    [
        "the host dies, by chance",
        "deaths at packets of chance of two jobs",
        "as above",
        "as above; taken up late, everything is shut down ¹",
    ],
    ["the same, the real firmware", "deaths of the firmware", "not known", "not known"],
    ["emergency stop", "emergency", "not known", "not known"],
    ["an input with a filter", "filter", "off, or by a timer as it is compiled ¹", "not known"],
    ["core 0, making the words of pulses", "processor", "not known", "not known"],
    ["the same, ordinary paths", "path of chance", "not known", "not known"],
    ["flash and memory", "size", "not known", "not known"],
    ["all tests in the emulator", "seconds", "–", "–"],
];

const SOURCES: &str = "\
¹ their sources: gnea/grbl of January 2021, Klipper3d/klipper of August 2026. ² Klipper's manual, Features. ³ GRBL 1.1h measured in simavr.
This adapter: its firmware in rp2040js, its host natively; no hardware.";

pub(crate) fn bench() -> Done {
    let elf = firmware::emulated()?;
    let (flash, memory) = firmware::sizes(&elf)?;
    let mut host = command("cargo", &["test"]);
    host.args(ALL).args(["--lib", "--", "--show-output"]).args(TESTS);
    let (said, emulated) = (told(&mut host)?, told(&mut firmware::tests()?)?);
    let seconds = format!("measured seconds: {} s, one test binary after the other", seconds(&emulated));
    let text = said + &emulated;
    let stack = text.lines().find_map(|line| line.strip_prefix("measured stack: "));
    let stack = stack.ok_or("No test measured `stack`.")?;
    let size = format!(
        "measured size: {flash} bytes of flash, {memory} bytes of memory, and {stack} of stack at most"
    );
    print!("{}", table(text.lines().chain([size.as_str(), seconds.as_str()]))?);
    Ok(())
}

fn told(tests: &mut Command) -> Done<String> {
    tests.stderr(Stdio::inherit());
    say(&shown(tests));
    let ran = tests.output().map_err(|error| format!("`{}` could not be started: {error}.", shown(tests)))?;
    let text = String::from_utf8_lossy(&ran.stdout).into_owned();
    if ran.status.success() { Ok(text) } else { Err(format!("{text}\n`{}` failed.", shown(tests))) }
}

/// Time of all tests in `text`, in s: each binary prints it at its end.
fn seconds(text: &str) -> u64 {
    let of = |line: &str| line.rsplit_once("finished in ")?.1.strip_suffix('s')?.parse::<f64>().ok();
    text.lines().filter_map(of).sum::<f64>().round() as u64
}

fn table<'a>(lines: impl Iterator<Item = &'a str>) -> Done<String> {
    let measured: Vec<(&str, &str)> =
        lines.filter_map(|line| line.strip_prefix("measured ")?.split_once(": ")).collect();
    let mut out =
        "| what | this adapter | GRBL 1.1h, ATmega328 | Klipper, RP2040 |\n|---|---|---|---|\n".to_owned();
    for [title, key, grbl, klipper] in ROWS {
        let own = match key {
            "" => "a new one every step, as their edges are compared above",
            _ => measured.iter().find(|row| row.0 == key).ok_or(format!("No test measured `{key}`."))?.1,
        };
        out += &format!("| {title} | {own} | {grbl} | {klipper} |\n");
    }
    Ok(out + "\n" + SOURCES + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_of_all_binaries_are_summed() {
        let said = |seconds: &str| format!("test result: ok. 3 passed; 0 failed; finished in {seconds}s\n");
        assert_eq!(seconds(&(said("41.06") + "test a ... ok\n" + &said("0.55"))), 42);
    }

    #[test]
    fn incomplete_measurements_give_no_table() {
        let all: Vec<String> =
            ROWS.iter().map(|row| format!("measured {}: {} of it", row[1], row[0])).collect();
        let text = table(all.iter().map(String::as_str).chain(["seed 1", "test x ... ok"])).unwrap();
        assert!(text.contains("| emergency stop | emergency stop of it | not known | not known |"), "{text}");
        let some = all.iter().filter(|line| !line.starts_with("measured filter"));
        assert_eq!(table(some.map(String::as_str)), Err("No test measured `filter`.".to_owned()));
    }
}
