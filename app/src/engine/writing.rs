//! Checks postprocessors for the template editor.

use super::exporting::OWN;
use super::messages::{Checked, Settings, ToWrite};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Briefing;
use annulus_core::post::{self, Dialect, Manner};
use annulus_core::wire::program;

fn manner(wanted: &ToWrite) -> Result<Manner, Vec<Diagnostic>> {
    let machine = wanted.machine.as_ref().map(Settings::machine).transpose()?;
    Ok(machine.as_ref().map(Manner::on).unwrap_or_default())
}

pub(super) fn check(wanted: &ToWrite) -> Checked {
    let text = wanted.text.as_str();
    let mut faults = post::check(OWN, text);
    let mut checked = Checked::default();
    if faults.is_empty() {
        let parsed = Dialect::parse(OWN, text).map_err(|fault| vec![fault]);
        checked.warnings = parsed.as_ref().map(post::warnings).unwrap_or_default();
        let made = manner(wanted)
            .and_then(|manner| parsed.and_then(|dialect| made(&dialect.in_manner(&manner), wanted)));
        match made {
            Ok((output, of_program)) => (checked.output, checked.of_program) = (output, of_program),
            Err(why) => faults = why,
        }
    }
    Checked { faults, ..checked }
}

/// The program's output; without a program, a sample of every block.
fn made(dialect: &Dialect, wanted: &ToWrite) -> Result<(String, bool), Vec<Diagnostic>> {
    if wanted.program.is_empty() {
        let samples = post::preview(dialect).map_err(|why| vec![why])?;
        let block = |sample: post::Sample| {
            format!("; {} {}\n{}\n", sample.part.key(), sample.block.key(), sample.text)
        };
        return Ok((samples.into_iter().map(block).collect(), false));
    }
    let program = program::decode(&wanted.program).map_err(|why| vec![why])?;
    let files = post::write_side(dialect, &program, &Briefing::of(&program), 0).map_err(|why| vec![why])?;
    Ok((files.into_iter().map(|file| file.text).collect::<Vec<_>>().join("\n"), true))
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::geometry::Point;
    use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
    use annulus_core::machine::virtual_drill;
    use annulus_core::units::Length;

    fn grbl() -> String {
        post::shipped().find(|(name, _)| *name == "grbl").unwrap().1.to_owned()
    }

    fn wanted(text: String) -> ToWrite {
        ToWrite { text, ..ToWrite::default() }
    }

    #[test]
    fn postprocessor_without_a_program_shows_sample_blocks() {
        let checked = check(&wanted(grbl()));
        assert_eq!(checked.faults, []);
        assert!(!checked.of_program);
        assert!(checked.output.contains("; drill hole") && checked.output.contains("; engrave line"));
    }

    #[test]
    fn postprocessor_without_tool_lift_gives_a_warning() {
        assert_eq!(check(&wanted(grbl())).warnings, []);
        let checked = check(&wanted(grbl().replace("G0 Z@HC@\n", "")));
        assert_eq!((checked.faults.len(), checked.warnings.len()), (0, 4), "{:?}", checked.warnings);
        let warning = checked.warnings[0].message("en");
        assert!(warning.contains(": drill.change moves it without a height"), "{warning}");
        assert_ne!(checked.output, "");
    }

    #[test]
    fn misspelt_parameter_is_an_error_with_its_line() {
        let text = grbl().replacen("G0 X@X@ Y@Y@", "G0 X@XX@ Y@Y@", 1);
        let line = text.lines().position(|line| line.contains("@XX@")).unwrap() as u32 + 1;
        let checked = check(&wanted(text));
        assert_eq!(checked.faults[0].place.as_ref().map(|place| place.line), Some(line));
        assert_eq!(checked.output, "");
    }

    #[test]
    fn open_program_is_written_for_its_machine() {
        let commands = vec![
            Command::AwaitBit { bit: 0 },
            Command::Rapid { to: Point::from_mm(2.0, 0.0) },
            Command::Plunge { to: Length::from_um(-100), feed_um_per_s: 5_000, gate: None },
            Command::Retract { to: Length::from_um(2_000) },
        ];
        let program = Program {
            name: "one".to_owned(),
            machine: String::new(),
            origin: Point::default(),
            bits: vec![Bit {
                diameter: Length::from_um(800),
                name: String::new(),
                cutter: Cutter::Mill,
                handling: Default::default(),
            }],
            spindles: 1,
            safe_height: Length::from_um(2_000),
            legs: vec![Leg { mark: Mark::Toolpath(0), commands }],
            accepted: Vec::new(),
        };
        let machine = Some(Settings::of(&virtual_drill()));
        let checked = check(&ToWrite { program: program::encode(&program), text: grbl(), machine });
        assert!(checked.of_program && checked.faults.is_empty(), "{checked:?}");
        assert!(checked.output.contains("G0 Z0.3000\nG1 Z-0.1000"), "{}", checked.output);
    }
}
