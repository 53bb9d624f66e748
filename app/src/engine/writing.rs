//! Programs in a controller's words, and dialects looked through for the template editor.
//!
//! Comes in: a program's bytes, the name of a dialect or its text. Goes out: files, faults, a preview. Does not know
//! workers.

use super::messages::{Checked, Settings, ToWrite};
use annulus_core::job::{Briefing, Program};
use annulus_core::post::{self, Dialect, Manner};
use annulus_core::remark::{Remark, Weight};
use annulus_core::wire::program;
use annulus_core::{locale, motion, sim};

/// The name of the person's own dialect in remarks.
const OWN: &str = "template.toml";

/// The name of the run sheet.
const RUN_SHEET: &str = "run-sheet.html";

/// The files of the program; with the briefing of its job, the run sheet behind them.
pub(super) fn write(wanted: &ToWrite) -> Result<Vec<(String, String)>, Vec<Remark>> {
    let one = |remark| vec![remark];
    let program = program::decode(&wanted.program).map_err(one)?;
    let manner = manner(wanted)?;
    let briefing = briefed(wanted, &program)?;
    let written = match &wanted.text {
        Some(text) => Dialect::parse(OWN, text)
            .and_then(|dialect| post::write_side(&dialect.in_manner(&manner), &program, &briefing, 0)),
        None => post::write_for(&wanted.target, &program, &manner, &briefing, 0).unwrap_or_else(|| {
            let nearest = post::nearest_target(&wanted.target);
            let unknown = Remark::new(Weight::Loss, "post.unknown_target").with("name", &wanted.target);
            Err(unknown.with("nearest", nearest).with("known", post::targets().join(", ")))
        }),
    };
    let files = written.map_err(one)?;
    let sheet = wanted.briefing.is_some();
    let sheet = sheet.then(|| {
        let text = post::run_sheet(locale::FALLBACK, &briefing, std::slice::from_ref(&files));
        (RUN_SHEET.to_owned(), text)
    });
    Ok(files.into_iter().map(|file| (file.name, file.text)).chain(sheet).collect())
}

/// How the machine wants it written.
fn manner(wanted: &ToWrite) -> Result<Manner, Vec<Remark>> {
    let machine = wanted.machine.as_ref().map(Settings::machine).transpose()?;
    let manner = machine.as_ref().map(Manner::on).unwrap_or_default();
    Ok(Manner { lines_only: wanted.lines_only, ..manner })
}

/// What the files say of the job, with the times of its bits.
fn briefed(wanted: &ToWrite, program: &Program) -> Result<Briefing, Vec<Remark>> {
    let mut briefing = wanted.briefing.clone().unwrap_or_else(|| Briefing::of(program));
    let machine = wanted.machine.as_ref().map(Settings::machine).transpose()?;
    let timed = machine.filter(|_| wanted.briefing.is_some());
    if let Some(timeline) = timed.and_then(|machine| motion::timeline(program, &machine).ok()) {
        let tools = briefing.sides.iter_mut().flat_map(|side| &mut side.tools);
        for (tool, time_s) in tools.zip(sim::time_by_bit_s(&timeline)) {
            tool.time_s = Some(time_s);
        }
    }
    Ok(briefing)
}

/// What is wrong with a dialect, and what it makes.
pub(super) fn check(wanted: &ToWrite) -> Checked {
    let text = wanted.text.as_deref().unwrap_or_default();
    let mut faults = post::check(OWN, text);
    let mut checked = Checked::default();
    if faults.is_empty() {
        let parsed = Dialect::parse(OWN, text).map_err(|fault| vec![fault]);
        checked.doubts = parsed.as_ref().map(post::doubts).unwrap_or_default();
        let made = manner(wanted)
            .and_then(|manner| parsed.and_then(|dialect| made(&dialect.in_manner(&manner), wanted)));
        match made {
            Ok((output, of_program)) => (checked.output, checked.of_program) = (output, of_program),
            Err(why) => faults = why,
        }
    }
    Checked { faults, ..checked }
}

/// The program in the words of `dialect`; without a program, a sample of every block.
fn made(dialect: &Dialect, wanted: &ToWrite) -> Result<(String, bool), Vec<Remark>> {
    if wanted.program.is_empty() {
        let samples = post::preview(dialect).map_err(|why| vec![why])?;
        let block = |sample: post::Sample| {
            format!("; {} {}\n{}\n", sample.part.key(), sample.block.key(), sample.text)
        };
        return Ok((samples.into_iter().map(block).collect(), false));
    }
    let program = program::decode(&wanted.program).map_err(|why| vec![why])?;
    let briefing = briefed(wanted, &program)?;
    let files = post::write_side(dialect, &program, &briefing, 0).map_err(|why| vec![why])?;
    Ok((files.into_iter().map(|file| file.text).collect::<Vec<_>>().join("\n"), true))
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::geometry::Point;
    use annulus_core::job::{Bit, Command, Cutter, Leg, Mark};
    use annulus_core::machine::virtual_drill;
    use annulus_core::units::Length;

    fn grbl() -> String {
        post::shipped().find(|(name, _)| *name == "grbl").unwrap().1.to_owned()
    }

    fn wanted(text: Option<String>) -> ToWrite {
        ToWrite { target: "grbl".to_owned(), text, ..ToWrite::default() }
    }

    #[test]
    fn a_dialect_without_a_program_shows_a_sample_of_its_blocks() {
        let checked = check(&wanted(Some(grbl())));
        assert_eq!(checked.faults, []);
        assert!(!checked.of_program);
        assert!(checked.output.contains("; drill hole") && checked.output.contains("; engrave line"));
    }

    #[test]
    fn a_dialect_that_lifts_no_tip_is_doubted_and_written_all_the_same() {
        assert_eq!(check(&wanted(Some(grbl()))).doubts, []);
        let checked = check(&wanted(Some(grbl().replace("G0 Z@HC@\n", ""))));
        assert_eq!((checked.faults.len(), checked.doubts.len()), (0, 4), "{:?}", checked.doubts);
        assert!(checked.doubts[0].message("en").starts_with("drill.change"));
        assert_ne!(checked.output, "");
    }

    #[test]
    fn a_misspelt_parameter_is_a_fault_with_its_line() {
        let text = grbl().replacen("G0 X@X@ Y@Y@", "G0 X@XX@ Y@Y@", 1);
        let line = text.lines().position(|line| line.contains("@XX@")).unwrap() as u32 + 1;
        let checked = check(&wanted(Some(text)));
        assert_eq!(checked.faults[0].place.as_ref().map(|place| place.line), Some(line));
        assert_eq!(checked.output, "");
    }

    #[test]
    fn arcs_are_lines_where_that_is_wanted() {
        let here = Point::from_mm(2.0, 0.0);
        let height = Length::from_um(-100);
        let around =
            Command::MillArc { to: here, height, center: Point::default(), ccw: true, feed_um_per_s: 5_000 };
        let commands = vec![
            Command::AwaitBit { bit: 0 },
            Command::Rapid { to: here },
            Command::Plunge { to: height, feed_um_per_s: 5_000, gate: None },
            around,
            Command::Retract { to: Length::from_um(2_000) },
        ];
        let program = Program {
            name: "ring".to_owned(),
            machine: String::new(),
            origin: Point::default(),
            bits: vec![Bit { diameter: Length::from_um(800), name: String::new(), cutter: Cutter::Mill }],
            spindles: 1,
            safe_height: Length::from_um(2_000),
            legs: vec![Leg { mark: Mark::Way(0), commands }],
            accepted: Vec::new(),
        };
        for (lines_only, arcs) in [(None, true), (Some(0.005), false)] {
            let program = program::encode(&program);
            let machine = Some(Settings::of(&virtual_drill()));
            let target = "grbl".to_owned();
            let wanted = ToWrite { program, target, lines_only, machine, ..ToWrite::default() };
            let files = write(&wanted).unwrap();
            assert_eq!(files.len(), 1, "no run sheet of a program alone");
            assert!(files[0].1.contains("G0 Z0.3000\nG1 Z-0.1000"), "{}", files[0].1);
            let has_arcs = files[0].1.lines().any(|line| line.starts_with("G3") || line.starts_with("G2 "));
            assert_eq!(has_arcs, arcs, "{}", files[0].1);
        }
    }

    #[test]
    fn a_job_has_a_run_sheet_behind_its_files() {
        let bit = Bit { diameter: Length::from_um(800), name: String::new(), cutter: Cutter::Mill };
        let program = Program {
            name: "a & b".to_owned(),
            machine: String::new(),
            origin: Point::default(),
            bits: vec![bit],
            spindles: 1,
            safe_height: Length::from_um(2_000),
            legs: vec![Leg { mark: Mark::ChangeBit(0), commands: vec![Command::AwaitBit { bit: 0 }] }],
            accepted: Vec::new(),
        };
        let wanted = ToWrite {
            briefing: Some(Briefing::of(&program)),
            machine: Some(Settings::of(&virtual_drill())),
            program: program::encode(&program),
            ..wanted(None)
        };
        let files = write(&wanted).unwrap();
        assert_eq!((files.len(), files[1].0.as_str()), (2, RUN_SHEET));
        assert!(files[1].1.contains("a &amp; b") && files[1].1.contains("end mill 0.8"), "{}", files[1].1);
    }

    #[test]
    fn what_cannot_be_written_is_refused() {
        assert!(write(&wanted(None)).is_err(), "no program");
    }
}
