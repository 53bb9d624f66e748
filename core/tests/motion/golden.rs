//! Golden files of one small program at every stage: moves in time, runs, digest. `ANNULUS_BLESS=1` accepts
//! a change.

use crate::programs::{Chance, random_program};
use annulus_core::machine::virtual_drill;
use annulus_core::motion::{Timeline, timeline};
use annulus_core::steps;
use std::fmt::Write;
use std::path::Path;

fn printed(plan: &Timeline) -> String {
    let mut text = String::new();
    for planned in &plan.moves {
        let seconds = |ticks: u64| ticks as f64 / steps::TICK_HZ as f64;
        let (leg, stage) = (planned.leg, format!("{:?}", planned.stage));
        let (start, duration) = (seconds(planned.start_tick), seconds(planned.duration_ticks));
        let to = &planned.to[..3];
        writeln!(text, "{start:11.7} s  leg {leg}  {stage:9} {duration:10.7} s  to {to:?}").unwrap();
        for part in &planned.parts {
            let (from_s, to_s) = (start + part.start_s(), start + part.end_s());
            let (stage, to) = (format!("{:?}", part.stage), &part.to[..3]);
            writeln!(text, "              {stage:9} {from_s:11.7} … {to_s:11.7} s  to {to:?}").unwrap();
        }
    }
    text
}

#[test]
fn small_program_matches_its_golden_timeline() {
    let machine = virtual_drill();
    let plan = timeline(&random_program(&mut Chance::new(4), &machine, 2), &machine).unwrap();
    let stream = steps::stream(&plan, &machine).unwrap();
    let text =
        format!("{}\n{}\ndigest {}\n", printed(&plan), steps::trace(&stream, 400), steps::digest(&stream));
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/two_holes.txt");
    if std::env::var_os("ANNULUS_BLESS").is_some() {
        std::fs::write(&file, &text).unwrap();
    }
    let expected = std::fs::read_to_string(&file).unwrap();
    let parts = text.lines().zip(expected.lines()).position(|(a, b)| a != b);
    assert!(text == expected, "{} differs from line {:?} on", file.display(), parts.map(|line| line + 1));
}
