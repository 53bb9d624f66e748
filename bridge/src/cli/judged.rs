//! Measures how late this computer is with pulses, and compares that with the needs of one machine.
//!
//! Loads all processors meanwhile, as on a busy day. Moves nothing.

use super::{Answer, Refusal};
use crate::executor::{clock, realtime};
use crate::machine_file;
use annulus_core::control::Lateness;
use annulus_core::control::lateness::{EDGES_US, needed_rate, safe_rate};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Machine, Output};
use annulus_core::{code, note, warning};
use serde_json::json;
use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

/// Longest bar of the histogram, in characters.
const WIDEST: u32 = 40;

/// Memory that a loaded processor copies repeatedly: more than its caches hold.
const COPIED_BYTES: usize = 16 * 1024 * 1024;

pub(super) fn run(name: &str, how_long: Duration) -> Result<Answer, Refusal> {
    let machine = machine_file::named(name)?.machine;
    let title = &machine.name;
    if machine.output == Output::Adapter {
        let finding = note!("doctor.own_clock", machine = title);
        let object =
            json!({ "machine": title, "late_us": null, "needs_hz": needed_rate(&machine), "good": true });
        return Ok(Answer::new(&object, finding.message("en") + "\n"));
    }
    super::say(note!("doctor.measures", seconds = how_long.as_secs()).message("en"));
    let (late, no_realtime) = under_load(how_long);
    Ok(verdict(&machine, &late, no_realtime.as_deref(), how_long))
}

/// Compares `late` with the needs of `machine`.
fn verdict(machine: &Machine, late: &Lateness, no_realtime: Option<&str>, how_long: Duration) -> Answer {
    let needs_hz = needed_rate(machine);
    let safe_hz = safe_rate(late, f64::from(machine.wiring().start_stop_hz));
    let good = safe_hz >= needs_hz;
    let code = if good { code!("doctor.in_time") } else { code!("doctor.not_in_time") };
    let finding = if good { Diagnostic::note(code) } else { Diagnostic::error(code) };
    let finding = finding
        .with("machine", &machine.name)
        .with("needs", needs_hz.ceil())
        .with("safe", safe_hz.floor())
        .with("max", late.worst_us.round())
        .with("beats", late.beats);
    let object = json!({
        "machine": machine.name, "seconds": how_long.as_secs(),
        "late_us": { "p50": late.p50_us, "p99": late.p99_us, "p9999": late.p9999_us, "max": late.worst_us },
        "needs_hz": needs_hz, "safe_hz": safe_hz, "good": good, "beats": late.beats, "edges_us": EDGES_US,
        "bars": late.bars, "no_realtime": no_realtime,
    });
    let mut text = histogram(late);
    if good {
        text += &format!("{}\n", finding.message("en"));
    }
    if let Some(why) = no_realtime {
        let refused = warning!("output.no_realtime", reason = why);
        text += &format!("{} {}\n", refused.message("en"), refused.advice("en"));
    }
    Answer::new(&object, text).with_error((!good).then_some(finding))
}

/// Measures the lateness of pulses as the executor does. The second value is why the real-time class was not
/// available.
pub(super) fn measured(how_long: Duration) -> (Lateness, Option<String>) {
    let measure = move || {
        let refused = realtime::ask_for_class();
        (clock::measure(&mut clock::StepClock::new(), how_long), refused)
    };
    // In a new thread, because the real-time class belongs to a thread.
    thread::spawn(measure).join().unwrap_or_default()
}

/// The same while every processor copies memory.
fn under_load(how_long: Duration) -> (Lateness, Option<String>) {
    let ends = Arc::new(AtomicBool::new(false));
    let processors = thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let works: Vec<_> = (0..processors)
        .map(|_| {
            let ends = Arc::clone(&ends);
            thread::spawn(move || {
                let (from, mut to) = (vec![1_u8; COPIED_BYTES], vec![0; COPIED_BYTES]);
                while !ends.load(Ordering::Relaxed) {
                    to.copy_from_slice(black_box(&from));
                    black_box(&mut to);
                }
            })
        })
        .collect();
    let found = measured(how_long);
    ends.store(true, Ordering::Relaxed);
    for work in works {
        let _ = work.join();
    }
    found
}

/// The histogram, one line per bar.
pub(super) fn histogram(late: &Lateness) -> String {
    let tallest = late.bars.iter().max().copied().unwrap_or(0).max(1);
    let last = late.bars.iter().rposition(|count| *count > 0).unwrap_or(0);
    let line = |(index, count): (usize, &u32)| {
        let edge = EDGES_US.get(index).map_or_else(|| "later".to_owned(), |edge| format!("{edge} µs"));
        // Round up, so that even one beat has a mark: the rare ones matter.
        let width = (u64::from(*count) * u64::from(WIDEST)).div_ceil(u64::from(tallest)) as usize;
        format!("{edge:>10} {count:>6} {}", "#".repeat(width)).trim_end().to_owned() + "\n"
    };
    late.bars.iter().take(last + 1).enumerate().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::super::Exit;
    use super::*;
    use annulus_core::machine::preset;

    #[test]
    fn latency_limit_depends_on_the_machine() {
        let late = |us: f64| Lateness::of(&mut vec![us; 20_000]);
        // The laboratory drill needs 500 interrupts a second, so 500 µs at most. The G540 needs 8,000 steps a
        // second; its motors start without a ramp up to 1,000.
        let rows = [
            ("lab", 400.0, true),
            ("lab", 501.0, false),
            ("lab", f64::INFINITY, false),
            ("tb6560", 150.0, true),
            ("tb6560", 160.0, false),
            ("g540", 31.0, true),
            ("g540", 32.0, false),
        ];
        for (name, us, good) in rows {
            let machine = preset(name).unwrap();
            let answer = verdict(&machine, &late(us), None, Duration::from_secs(1));
            assert_eq!(
                (&answer.object["good"], answer.exit == Exit::Done),
                (&json!(good), good),
                "{name} {us}"
            );
            let needs = format!("{}", needed_rate(&machine));
            assert!(
                answer.text.contains(&needs) && answer.text.contains("not good") != good,
                "{}",
                answer.text
            );
        }
    }
}
