//! How a job is run at a controller: flags of the command line, and what of them a job that is resumed was given before.
//!
//! Comes in: words. Goes out: [`How`]. Does not know who is there.

use super::{MayReset, PortArgs};
use annulus_core::align::FoundHole;
use annulus_core::controller::{Changer, ResetOnOpen, Routine, SectionKind, ToolMacro, ToolSetter};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::locale;
use annulus_core::machine::{MillProfile, mill, preset_name};
use annulus_drill::controller::{AttendedJob, JobGiven, JobTools};
use std::time::Duration;

/// Seconds that a spindle takes to come up to speed where nobody says.
const SPIN_UP_S: f64 = 3.0;

/// How a job is run.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct How {
    #[command(flatten)]
    pub(super) port: PortArgs,
    /// Where the head stands now is the work zero: X, Y and the tip on the board.
    #[arg(long)]
    pub(super) zero_here: bool,
    /// The work zero in machine coordinates, in mm, for machines that home.
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true)]
    pub(super) zero_at: Option<Place>,
    /// Seconds that the spindle takes to come up to speed [default: 3].
    #[arg(long, value_name = "SECONDS")]
    spin_up: Option<f64>,
    /// How many times faster than life the controller runs, for simulated ones.
    #[arg(long, hide = true, default_value_t = 1.0)]
    pub(super) speed: f64,
    /// Answer each tool change after so many seconds, as a changer would; without it a person is asked.
    #[arg(long, value_name = "SECONDS", value_parser = crate::cli::run::seconds)]
    pub(super) confirm_tools: Option<Duration>,
    /// After each tool change find the board with the probe, at most so many mm down.
    #[arg(long, value_name = "MM")]
    probe: Option<f64>,
    /// All tools stand out equally far, as those with a ring do: none is touched off after it was put in.
    #[arg(long, conflicts_with = "probe")]
    pub(super) same_length: bool,
    /// Where a tool setter stands, X and Y, and the Z from which it is looked for, in machine coordinates; then how far down at most, and
    /// the feed of the first and of the second time (40, 150, 25). Each tool is measured there after it was put in.
    #[arg(long, value_name = "X,Y,Z", value_parser = tool_setter, allow_hyphen_values = true, conflicts_with = "same_length")]
    pub(super) setter: Option<ToolSetter>,
    /// A file of lines by which the machine changes tools itself, at most 32; {tool} stands for the number of the tool.
    #[arg(long, value_name = "FILE", value_parser = tool_macro)]
    pub(super) changer: Option<ToolMacro>,
    /// Where an alignment hole is planned and where it was found, in mm from the work zero: twice or more, and the job goes along
    /// with the board.
    #[arg(long = "found", value_name = "X,Y=X,Y", value_parser = found_hole, allow_hyphen_values = true)]
    pub(super) found: Vec<FoundHole>,
    /// Thickness of the plate on the board while probing, in mm; 0, as without it, for bare copper.
    #[arg(long, value_name = "MM")]
    plate: Option<f64>,
    /// The mill as it is sold that the controller was said to be.
    #[arg(skip)]
    pub(super) mill: Option<&'static MillProfile>,
}

impl How {
    /// The same, on this mill.
    pub(super) fn on(&self, mill: Option<&'static MillProfile>) -> Self {
        Self { mill, ..self.clone() }
    }

    /// Seconds that the spindle takes to come up to speed.
    pub(super) fn spin_up_s(&self) -> f64 {
        self.spin_up.unwrap_or(SPIN_UP_S)
    }

    /// How far down the probe looks for the board after a tool change, mm; none where it does not.
    pub(super) fn probe_mm(&self) -> Option<f64> {
        self.probe
    }

    /// Thickness of the plate on the board while probing, mm.
    pub(super) fn plate_mm(&self) -> f64 {
        self.plate.unwrap_or(0.0)
    }

    /// What of it changes what is sent, and is kept with the job.
    pub(super) fn given(&self) -> JobGiven {
        JobGiven {
            spin_up_s: self.spin_up,
            probe_mm: self.probe,
            plate_mm: self.plate,
            same_length: self.same_length,
            found: self.found.clone(),
            changer: self.changer.clone(),
            reset_on_open: self.port.reset_on_open.map(ResetOnOpen::from),
            mill: self.mill.map(|mill| mill.name.to_owned()),
        }
    }

    /// The same, where nothing else is said as the interrupted job was given it; and what there is to tell of that.
    pub(super) fn as_before(&self, before: &AttendedJob) -> (Self, Vec<Diagnostic>) {
        let given = &before.given;
        let as_before = Self {
            spin_up: given.spin_up_s,
            probe: given.probe_mm,
            plate: given.plate_mm,
            same_length: given.same_length,
            setter: before.setter,
            found: given.found.clone(),
            changer: given.changer.clone(),
            port: self.port_for(given.reset_on_open),
            mill: given.mill.as_deref().and_then(mill),
            ..self.clone()
        };
        let alike = self.same_length || (given.same_length && self.probe.is_none() && self.setter.is_none());
        let how = Self {
            spin_up: self.spin_up.or(as_before.spin_up),
            plate: self.plate.or(as_before.plate),
            // Tools that are all alike are neither touched off nor measured, whichever was said last.
            probe: self.probe.or(as_before.probe.filter(|_| !alike)),
            setter: self.setter.or(as_before.setter.filter(|_| !alike)),
            same_length: alike,
            changer: self.changer.clone().or_else(|| given.changer.clone()),
            found: if self.found.is_empty() { as_before.found.clone() } else { self.found.clone() },
            port: self.port_for(self.port.reset_on_open.map(ResetOnOpen::from).or(given.reset_on_open)),
            mill: self.mill.or(as_before.mill),
            ..self.clone()
        };
        let rows = how.words().into_iter().zip(as_before.words());
        let told = rows.filter_map(|((flag, now), (_, before))| match (now, before) {
            (None, None) => None,
            (now, before) if now == before => {
                let value = now.unwrap_or_default();
                Some(Diagnostic::note("grbl.given_again").with("flag", flag).with("value", value))
            }
            (now, before) => {
                let word = |value: Option<String>| value.unwrap_or_else(|| "–".to_owned());
                let why = Diagnostic::warning("grbl.given_otherwise").with("flag", flag);
                Some(why.with("value", word(now)).with("before", word(before)))
            }
        });
        let told = told.collect();
        (how, told)
    }

    /// How the machine changes the tools of these programs itself, by their numbers in the rack or by T words.
    pub(super) fn changer_for(&self, routine: &Routine, tools: Option<&JobTools>) -> Option<Changer> {
        let lines = self.changer.clone()?;
        let numbers = tools.map_or_else(|| routine.numbers.clone(), |tools| tools.numbers(routine));
        Some(Changer { lines, numbers })
    }

    /// The port, opened in this way.
    fn port_for(&self, reset: Option<ResetOnOpen>) -> PortArgs {
        let reset_on_open = reset.map(|reset| match reset {
            ResetOnOpen::Usual => MayReset::Usual,
            ResetOnOpen::Never => MayReset::Never,
        });
        PortArgs { reset_on_open, ..self.port.clone() }
    }

    /// What is kept, by its flags.
    fn words(&self) -> [(&'static str, Option<String>); 9] {
        let number = |value: Option<f64>| value.map(|value| value.to_string());
        let holes = self.found.iter().map(|hole| {
            let [planned, found] =
                [hole.planned, hole.found].map(|at| format!("{},{}", at.x.mm(), at.y.mm()));
            format!("{planned}={found}")
        });
        let holes: Vec<String> = holes.collect();
        let reset = self.port.reset_on_open.map(ResetOnOpen::from);
        let numbers = |setter: ToolSetter| setter.numbers().map(|number| number.to_string()).join(",");
        [
            ("--spin-up", number(self.spin_up)),
            ("--probe", number(self.probe)),
            ("--plate", number(self.plate)),
            ("--same-length", self.same_length.then(String::new)),
            ("--setter", self.setter.map(numbers)),
            ("--found", (!holes.is_empty()).then(|| holes.join(" "))),
            ("--changer", self.changer.as_ref().map(|lines| lines.lines().join(" / "))),
            ("--reset-on-open", reset.map(|reset| reset.word().to_owned())),
            ("--machine", self.mill.map(|mill| mill.name.to_owned())),
        ]
    }

    /// Whether nobody would touch off a tool that `routine` asks for from section `from` on: the first of a job that begins is the one
    /// that was in when zero was set.
    pub(super) fn leaves_unmeasured(&self, routine: &Routine, from: usize) -> bool {
        let later = routine.sections.iter().skip(from.max(1));
        let mut changes = later.filter(|section| matches!(section.kind, SectionKind::Change(_)));
        let goes_on = from > 0 && !self.zero_here && self.zero_at.is_none();
        // A changer without a tool setter leaves each length in its offset, or all are alike.
        let alike = self.same_length || (self.changer.is_some() && self.setter.is_none());
        let nobody = self.confirm_tools.is_some() && self.probe.is_none() && !alike;
        // A tool setter goes by a tool that was touched off since the port was opened.
        let measured = self.setter.is_some() && !goes_on;
        nobody && !measured && (goes_on || changes.next().is_some())
    }
}

/// A place of the machine, mm.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place(pub(super) [f64; 3]);

/// Three numbers with commas between them.
fn place(text: &str) -> Result<Place, String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|word| word.trim().parse().ok().filter(|mm: &f64| mm.abs() <= 5_000.0)).collect();
    let place = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
    place.map(Place).ok_or_else(|| locale::text("en", "grbl.bad_place", &[]))
}

/// A mill as it is sold, of the command line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sold(pub(super) &'static MillProfile);

/// The mill of this name.
pub(super) fn sold_mill(name: &str) -> Result<Sold, String> {
    let unknown = || Diagnostic::error("grbl.no_such_mill").with("name", name);
    let found = mill(preset_name(name)).map(Sold);
    found.ok_or_else(|| format!("{} {}", unknown().message("en"), unknown().advice("en")))
}

/// Three numbers of a tool setter, four of them, or all six.
fn tool_setter(text: &str) -> Result<ToolSetter, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
    let setter = numbers.and_then(|numbers| {
        let (&[x, y, from_mm], rest) = numbers.split_first_chunk::<3>()?;
        let mut all = ToolSetter::usual([x, y], from_mm).numbers();
        all[3..].get_mut(..rest.len())?.copy_from_slice(rest);
        [0, 1, 3].contains(&rest.len()).then(|| ToolSetter::of_numbers(&all)).flatten()
    });
    setter.ok_or_else(|| locale::text("en", "grbl.bad_setter", &[]))
}

/// A file with the lines of a tool changer.
fn tool_macro(path: &str) -> Result<ToolMacro, String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{path}: {error}"))?;
    let lines = ToolMacro::of_lines(text.lines()).map_err(|why| why.message("en"))?;
    if lines.is_empty() { Err(locale::text("en", "grbl.empty_changer", &[])) } else { Ok(lines) }
}

/// Two places with `=` between them.
fn found_hole(text: &str) -> Result<FoundHole, String> {
    let place = |text: &str| {
        let (x, y) = text.split_once(',')?;
        let mm = |word: &str| word.trim().parse::<f64>().ok().filter(|mm| mm.abs() <= 1_000.0);
        Some(Point::from_mm(mm(x)?, mm(y)?))
    };
    let pair = text.split_once('=').and_then(|(planned, found)| Some((place(planned)?, place(found)?)));
    let hole = pair.map(|(planned, found)| FoundHole { planned, found });
    hole.ok_or_else(|| locale::text("en", "align.bad_hole", &[]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Words {
        #[arg(long, value_parser = sold_mill)]
        machine: Option<Sold>,
        #[command(flatten)]
        how: How,
    }

    fn how(words: &str) -> How {
        let words = ["resume", "--port", "P"].into_iter().chain(words.split_whitespace());
        let words = Words::try_parse_from(words).unwrap();
        words.how.on(words.machine.map(|sold| sold.0))
    }

    /// What a run of `before` is resumed with by `now`, and the codes and flags that are told.
    fn resumed(before: &str, now: &str) -> (String, Vec<String>) {
        let before = how(before);
        let entry = AttendedJob { given: before.given(), setter: before.setter, ..AttendedJob::default() };
        // As it is kept.
        let entry: AttendedJob = serde_json::from_str(&serde_json::to_string(&entry).unwrap()).unwrap();
        let (how, told) = how(now).as_before(&entry);
        let words = how.words().into_iter().filter_map(|(flag, value)| Some(format!("{flag} {}", value?)));
        let words: Vec<String> = words.map(|word| word.trim_end().to_owned()).collect();
        let told =
            told.iter().map(|why| format!("{} {}", why.code, why.argument(&["flag"]).unwrap_or_default()));
        (words.join(" "), told.collect())
    }

    #[test]
    fn a_resumed_job_has_what_it_was_given_and_a_flag_wins() {
        let (again, other) = ("grbl.given_again", "grbl.given_otherwise");
        let setter = "--setter -150,-10,-5,40,150,25";
        let rows = [
            ("", "", "", vec![]),
            (
                "--spin-up 7 --plate 1.5 --probe 12",
                "",
                "--spin-up 7 --probe 12 --plate 1.5",
                vec![format!("{again} --spin-up"), format!("{again} --probe"), format!("{again} --plate")],
            ),
            ("--spin-up 7", "--spin-up 2", "--spin-up 2", vec![format!("{other} --spin-up")]),
            ("--same-length", "", "--same-length", vec![format!("{again} --same-length")]),
            (
                "--same-length",
                "--probe 10",
                "--probe 10",
                vec![format!("{other} --probe"), format!("{other} --same-length")],
            ),
            (
                "--probe 10",
                "--same-length",
                "--same-length",
                vec![format!("{other} --probe"), format!("{other} --same-length")],
            ),
            (setter, "", setter, vec![format!("{again} --setter")]),
            (
                setter,
                "--probe 10",
                "--probe 10 --setter -150,-10,-5,40,150,25",
                vec![format!("{other} --probe"), format!("{again} --setter")],
            ),
            ("--reset-on-open never", "", "--reset-on-open never", vec![format!("{again} --reset-on-open")]),
            (
                "--reset-on-open never",
                "--reset-on-open usual",
                "--reset-on-open usual",
                vec![format!("{other} --reset-on-open")],
            ),
            ("--found 5,5=5.3,4.8", "", "--found 5,5=5.3,4.8", vec![format!("{again} --found")]),
            ("--machine shapeoko-3", "", "--machine shapeoko-3", vec![format!("{again} --machine")]),
            ("--machine shapeoko-3", "--machine 3018", "--machine 3018", vec![format!("{other} --machine")]),
        ];
        for (before, now, wanted, told) in rows {
            assert_eq!(resumed(before, now), (wanted.to_owned(), told), "{before} then {now}");
        }
    }
}
