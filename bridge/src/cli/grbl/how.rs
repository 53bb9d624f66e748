//! Options that decide how a controller runs a job, and how a resumed job reuses them.

use super::keys::Typing;
use super::{MayReset, PortArgs};
use crate::cli::Refusal;
use annulus_core::align::FoundHole;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::grbl::{Changer, ResetOnOpen, Routine, SectionKind, ToolMacro, ToolSetter};
use annulus_core::locale;
use annulus_core::machine::{MillProfile, mill, preset_name};
use annulus_core::{error, note, warning};
use annulus_host::grbl::{AttendedJob, JobGiven, JobTools};
use clap::ValueEnum;
use std::time::Duration;

/// Default time for the spindle to reach its speed, s.
const SPIN_UP_S: f64 = 3.0;

/// Options of a job at a controller.
#[derive(Debug, Clone, Default, clap::Args)]
pub(in crate::cli) struct How {
    #[command(flatten)]
    pub(in crate::cli) port: PortArgs,
    /// Use the current position as the work zero: X, Y and the tool on the board. Only for machines that
    /// don't home.
    #[arg(long, conflicts_with = "zero_at")]
    pub(in crate::cli) zero_here: bool,
    /// Set the work zero in machine coordinates, in mm, for machines that home. A controller needs Z too.
    #[arg(long, value_name = "X,Y[,Z]", value_parser = place, allow_hyphen_values = true)]
    pub(in crate::cli) zero_at: Option<Place>,
    /// Wait SECONDS for the spindle to reach its speed [default: 3].
    #[arg(long, value_name = "SECONDS")]
    spin_up: Option<f64>,
    /// Run the virtual drill or a simulated controller this many times faster than real time.
    #[arg(long = "time-scale", alias = "speed", default_value_t = 1.0, value_parser = crate::cli::numbers::speed)]
    pub(in crate::cli) speed: f64,
    /// Continue automatically SECONDS after each tool change. The spindle restarts without a question.
    #[arg(
        long = "unattended-tool-change",
        alias = "confirm-tools",
        value_name = "SECONDS",
        value_parser = crate::cli::numbers::seconds,
        allow_hyphen_values = true
    )]
    pub(in crate::cli) confirm_tools: Option<Duration>,
    /// Answer yes to every question that a flag raises, such as --unattended-tool-change.
    #[arg(long)]
    pub(in crate::cli) yes: bool,
    /// Probe the board after each tool change, at most this far down.
    #[arg(long = "probe-depth", alias = "probe", value_name = "MM")]
    probe: Option<f64>,
    /// Declare that all tools have the same length, for example with depth rings: none is touched off after a
    /// change.
    #[arg(long = "equal-tool-lengths", alias = "same-length", conflicts_with = "probe")]
    pub(crate) same_length: bool,
    /// Measure each new tool on a tool setter: its X, Y and the Z where probing starts, in machine
    /// coordinates.
    #[arg(
        long = "tool-setter",
        alias = "setter",
        value_name = "X,Y,Z",
        value_parser = tool_setter,
        allow_hyphen_values = true,
        conflicts_with = "same_length"
    )]
    pub(super) setter: Option<ToolSetter>,
    /// Probe at most this far down on the tool setter, in mm [default: 40].
    #[arg(long, value_name = "MM", value_parser = setter_depth, requires = "setter")]
    setter_depth: Option<f64>,
    /// Set the first and the second feed on the tool setter, in mm/min [default: 150,25].
    #[arg(long, value_name = "FIRST,SECOND", value_parser = setter_feeds, requires = "setter")]
    setter_feeds: Option<[f64; 2]>,
    /// Change tools with the G-code lines in FILE, at most 32; {tool} is replaced by the tool number.
    #[arg(long = "toolchange-macro", alias = "changer", value_name = "FILE", value_parser = tool_macro)]
    pub(super) changer: Option<ToolMacro>,
    /// Align the job with the board: the planned and the measured X,Y of an alignment hole, in mm from the
    /// work zero. Give it at least twice.
    #[arg(
        long = "align-hole",
        alias = "found",
        value_name = "PLANNED=MEASURED",
        value_parser = found_hole,
        allow_hyphen_values = true
    )]
    pub(super) found: Vec<FoundHole>,
    /// Set the thickness of the touch plate on the board, in mm; 0 for bare copper [default: 0].
    #[arg(long = "plate-thickness", alias = "plate", value_name = "MM")]
    plate: Option<f64>,
    /// Print what would move, then end. Opens no port and moves nothing.
    #[arg(long)]
    pub(in crate::cli) dry_run: bool,
    /// Model of the machine, if named.
    #[arg(skip)]
    pub(super) mill: Option<&'static MillProfile>,
}

impl How {
    /// No options but the port and the time scale.
    pub(super) fn at(port: &PortArgs, speed: f64) -> Self {
        Self { port: port.clone(), speed, ..Self::default() }
    }

    /// What to read while a job runs.
    pub(super) fn typing(&self) -> Typing {
        if self.confirm_tools.is_none() { Typing::Lines } else { Typing::Keys }
    }

    /// These options with the machine model `mill`, and the whole tool setter in `setter`.
    pub(super) fn on(&self, mill: Option<&'static MillProfile>) -> Self {
        let setter = self.setter.map(|setter| {
            let depth_mm = self.setter_depth.unwrap_or(setter.depth_mm);
            let feeds = self.setter_feeds.unwrap_or([setter.fast_mm_per_min, setter.slow_mm_per_min]);
            let [fast_mm_per_min, slow_mm_per_min] = feeds;
            ToolSetter { depth_mm, fast_mm_per_min, slow_mm_per_min, ..setter }
        });
        Self { mill, setter, ..self.clone() }
    }

    /// The given flags that only apply to a controller, and on a machine that Annulus drives itself also
    /// `--zero-here`, `--zero-at` and `--equal-tool-lengths`.
    pub(in crate::cli) fn of_controller(&self) -> impl Iterator<Item = &'static str> {
        let zero = [("--zero-here", self.zero_here), ("--zero-at", self.zero_at.is_some())];
        let baud = ("--baud", self.port.baud.is_some());
        let words = self.words().map(|(flag, value)| (flag, flag != "--machine" && value.is_some()));
        zero.into_iter().chain([baud]).chain(words).filter(|(_, given)| *given).map(|(flag, _)| flag)
    }

    /// Warning that tool changes continue without a question, if that was requested.
    pub(in crate::cli) fn unattended(&self) -> Option<Diagnostic> {
        let wait = self.confirm_tools?;
        Some(warning!("grbl.unattended", seconds = wait.as_secs_f64()))
    }

    /// Time for the spindle to reach its speed, s.
    pub(super) fn spin_up_s(&self) -> f64 {
        self.spin_up.unwrap_or(SPIN_UP_S)
    }

    /// Maximum depth of the probe after a tool change, mm; `None` if tools are not probed.
    pub(super) fn probe_mm(&self) -> Option<f64> {
        self.probe
    }

    /// Thickness of the touch plate while probing, mm.
    pub(super) fn plate_mm(&self) -> f64 {
        self.plate.unwrap_or(0.0)
    }

    /// Options that change the sent lines. They are saved with the job.
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

    /// Fills options that are not given from those of the interrupted job. Returns a note for each reused and
    /// a warning for each changed option.
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
            // Equal tool lengths drop the saved probe and tool setter: no tool is measured.
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
                Some(note!("grbl.given_again", flag = flag, value = value))
            }
            (now, before) => {
                let word = |value: Option<String>| value.unwrap_or_else(|| "–".to_owned());
                let why = warning!("grbl.given_otherwise", flag = flag, ..);
                Some(why.with("value", word(now)).with("before", word(before)))
            }
        });
        let told = told.collect();
        (how, told)
    }

    /// The tool change macro with the tool numbers of these programs, from the tool list or from T words.
    pub(super) fn changer_for(&self, routine: &Routine, tools: Option<&JobTools>) -> Option<Changer> {
        let lines = self.changer.clone()?;
        let numbers = tools.map_or_else(|| routine.numbers.clone(), |tools| tools.numbers(routine));
        Some(Changer { lines, numbers })
    }

    /// Port options with this reset behavior.
    fn port_for(&self, reset: Option<ResetOnOpen>) -> PortArgs {
        let reset_on_open = reset.map(|reset| match reset {
            ResetOnOpen::Usual => MayReset::Usual,
            ResetOnOpen::Never => MayReset::Never,
        });
        PortArgs { reset_on_open, ..self.port.clone() }
    }

    /// Saved options as flags and values.
    fn words(&self) -> [(&'static str, Option<String>); 11] {
        let number = |value: Option<f64>| value.map(|value| value.to_string());
        let holes = self.found.iter().map(|hole| {
            let [planned, found] =
                [hole.planned, hole.found].map(|at| format!("{},{}", at.x.mm(), at.y.mm()));
            format!("{planned}={found}")
        });
        let holes: Vec<String> = holes.collect();
        let reset = self.port.reset_on_open.and_then(|reset| reset.to_possible_value());
        let setter = |from: usize, to: usize| {
            let numbers = self.setter?.numbers()[from..to].iter().map(f64::to_string).collect::<Vec<_>>();
            Some(numbers.join(","))
        };
        [
            ("--spin-up", number(self.spin_up)),
            ("--probe-depth", number(self.probe)),
            ("--plate-thickness", number(self.plate)),
            ("--equal-tool-lengths", self.same_length.then(String::new)),
            ("--tool-setter", setter(0, 3)),
            ("--setter-depth", setter(3, 4)),
            ("--setter-feeds", setter(4, 6)),
            ("--align-hole", (!holes.is_empty()).then(|| holes.join(" "))),
            ("--toolchange-macro", self.changer.as_ref().map(|lines| lines.lines().join(" / "))),
            ("--reset-on-open", reset.map(|reset| reset.get_name().to_owned())),
            ("--machine", self.mill.map(|mill| mill.name.to_owned())),
        ]
    }

    /// Returns `true` if `routine`, from section `from` on, requests a tool that would not be touched off.
    /// The first tool of a new job is the one that zero was set with.
    pub(super) fn leaves_unmeasured(&self, routine: &Routine, from: usize) -> bool {
        let later = routine.sections.iter().skip(from.max(1));
        let mut changes = later.filter(|section| matches!(section.kind, SectionKind::Change(_)));
        let goes_on = from > 0 && !self.zero_here && self.zero_at.is_none();
        // Lengths are known if all are equal, or if a changer without a tool setter leaves each in its
        // offset.
        let alike = self.same_length || (self.changer.is_some() && self.setter.is_none());
        let nobody = self.confirm_tools.is_some() && self.probe.is_none() && !alike;
        // A tool setter needs a reference: a tool that was touched off since the port was opened.
        let measured = self.setter.is_some() && !goes_on;
        nobody && !measured && (goes_on || changes.next().is_some())
    }
}

/// Position in machine coordinates, mm.
#[derive(Debug, Clone, Copy)]
pub(in crate::cli) struct Place {
    pub(in crate::cli) plane: [f64; 2],
    pub(in crate::cli) z: Option<f64>,
}

impl Place {
    /// X, Y and Z, which a controller needs.
    pub(super) fn whole(self) -> Result<[f64; 3], Refusal> {
        let [x, y] = self.plane;
        let none = || Refusal::usage(error!("run.zero_at_needs_z"));
        self.z.map(|z| [x, y, z]).ok_or_else(none)
    }
}

/// Parses two or three numbers separated by commas.
pub(in crate::cli) fn place(text: &str) -> Result<Place, String> {
    let numbers: Option<Vec<f64>> =
        text.split(',').map(|word| word.trim().parse().ok().filter(|mm: &f64| mm.abs() <= 5_000.0)).collect();
    match numbers.as_deref() {
        Some(&[x, y]) => Ok(Place { plane: [x, y], z: None }),
        Some(&[x, y, z]) => Ok(Place { plane: [x, y], z: Some(z) }),
        _ => Err(locale::text("en", "run.zero_at.bad", &[])),
    }
}

/// A machine model named on the command line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sold(pub(super) &'static MillProfile);

/// Looks up a machine model by name.
pub(super) fn sold_mill(name: &str) -> Result<Sold, String> {
    let unknown = || error!("grbl.no_such_mill", name = name);
    let found = mill(preset_name(name)).map(Sold);
    found.ok_or_else(|| format!("{} {}", unknown().message("en"), unknown().advice("en")))
}

/// Parses the position of a tool setter, and as `--setter` did its depth and its feeds.
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

/// Parses the longest travel down on a tool setter.
fn setter_depth(text: &str) -> Result<f64, String> {
    let depth_mm = text.trim().parse().ok().filter(|depth_mm: &f64| {
        let usual = ToolSetter::usual([0.0; 2], 0.0);
        ToolSetter { depth_mm: *depth_mm, ..usual }.is_sound()
    });
    depth_mm.ok_or_else(|| locale::text("en", "grbl.bad_setter_depth", &[]))
}

/// Parses the two feeds of a tool setter.
fn setter_feeds(text: &str) -> Result<[f64; 2], String> {
    let feeds = text.split_once(',').and_then(|(first, second)| {
        let feeds: [f64; 2] = [first.trim().parse().ok()?, second.trim().parse().ok()?];
        let [fast_mm_per_min, slow_mm_per_min] = feeds;
        let usual = ToolSetter::usual([0.0; 2], 0.0);
        ToolSetter { fast_mm_per_min, slow_mm_per_min, ..usual }.is_sound().then_some(feeds)
    });
    feeds.ok_or_else(|| locale::text("en", "grbl.bad_setter_feeds", &[]))
}

/// Reads the lines of a tool change macro.
fn tool_macro(path: &str) -> Result<ToolMacro, String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{path}: {error}"))?;
    let lines = ToolMacro::of_lines(text.lines()).map_err(|why| why.message("en"))?;
    if lines.is_empty() { Err(locale::text("en", "grbl.empty_changer", &[])) } else { Ok(lines) }
}

/// Parses two positions separated by `=`.
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

    /// Options with which a run of `before` is resumed by `now`, and the reported codes and flags.
    fn resumed(before: &str, now: &str) -> (String, Vec<String>) {
        let before = how(before);
        let entry = AttendedJob { given: before.given(), setter: before.setter, ..AttendedJob::default() };
        // As saved.
        let entry: AttendedJob = serde_json::from_str(&serde_json::to_string(&entry).unwrap()).unwrap();
        let (how, told) = how(now).as_before(&entry);
        let words = how.words().into_iter().filter_map(|(flag, value)| Some(format!("{flag} {}", value?)));
        let words: Vec<String> = words.map(|word| word.trim_end().to_owned()).collect();
        let told =
            told.iter().map(|why| format!("{} {}", why.code, why.argument(&["flag"]).unwrap_or_default()));
        (words.join(" "), told.collect())
    }

    #[test]
    fn setter_flags_replace_the_numbers_of_the_setter() {
        let setter = how("--tool-setter -150,-10,-5 --setter-depth 30 --setter-feeds 300,60").setter;
        assert_eq!(setter.unwrap().numbers(), [-150.0, -10.0, -5.0, 30.0, 300.0, 60.0]);
        for wrong in [
            "--setter-depth 30",
            "--tool-setter 1,2,3 --setter-depth 0",
            "--tool-setter 1,2,3 --setter-feeds 150",
        ] {
            let words = ["resume", "--port", "P"].into_iter().chain(wrong.split_whitespace());
            assert!(Words::try_parse_from(words).is_err(), "{wrong}");
        }
    }

    #[test]
    fn flags_override_the_saved_options_of_a_resumed_job() {
        let (again, other) = ("grbl.given_again", "grbl.given_otherwise");
        let setter = "--tool-setter -150,-10,-5 --setter-depth 40 --setter-feeds 150,25";
        let again_setter = ["--tool-setter", "--setter-depth", "--setter-feeds"];
        let again_setter = again_setter.map(|flag| format!("{again} {flag}"));
        let rows = [
            ("", "", "", vec![]),
            (
                "--spin-up 7 --plate-thickness 1.5 --probe-depth 12",
                "",
                "--spin-up 7 --probe-depth 12 --plate-thickness 1.5",
                vec![
                    format!("{again} --spin-up"),
                    format!("{again} --probe-depth"),
                    format!("{again} --plate-thickness"),
                ],
            ),
            ("--spin-up 7", "--spin-up 2", "--spin-up 2", vec![format!("{other} --spin-up")]),
            (
                "--equal-tool-lengths",
                "",
                "--equal-tool-lengths",
                vec![format!("{again} --equal-tool-lengths")],
            ),
            (
                "--equal-tool-lengths",
                "--probe-depth 10",
                "--probe-depth 10",
                vec![format!("{other} --probe-depth"), format!("{other} --equal-tool-lengths")],
            ),
            (
                "--probe-depth 10",
                "--equal-tool-lengths",
                "--equal-tool-lengths",
                vec![format!("{other} --probe-depth"), format!("{other} --equal-tool-lengths")],
            ),
            (setter, "", setter, again_setter.to_vec()),
            ("--setter -150,-10,-5", "", setter, again_setter.to_vec()),
            ("--setter -150,-10,-5,40,150,25", "", setter, again_setter.to_vec()),
            (
                setter,
                "--probe-depth 10",
                "--probe-depth 10 --tool-setter -150,-10,-5 --setter-depth 40 --setter-feeds 150,25",
                [vec![format!("{other} --probe-depth")], again_setter.to_vec()].concat(),
            ),
            ("--reset-on-open never", "", "--reset-on-open never", vec![format!("{again} --reset-on-open")]),
            (
                "--reset-on-open never",
                "--reset-on-open auto",
                "--reset-on-open auto",
                vec![format!("{other} --reset-on-open")],
            ),
            (
                "--align-hole 5,5=5.3,4.8",
                "",
                "--align-hole 5,5=5.3,4.8",
                vec![format!("{again} --align-hole")],
            ),
            ("--machine shapeoko-3", "", "--machine shapeoko-3", vec![format!("{again} --machine")]),
            ("--machine shapeoko-3", "--machine 3018", "--machine 3018", vec![format!("{other} --machine")]),
        ];
        for (before, now, wanted, told) in rows {
            assert_eq!(resumed(before, now), (wanted.to_owned(), told), "{before} then {now}");
        }
    }
}
