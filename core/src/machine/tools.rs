//! The tools that a machine has at hand, the rack, and what each of them has done since it was new (C3).
//!
//! ```text
//! T1 drill 0.8 down 12 up 40 rpm 30000 life 2000          a line each: number, form, diameter in mm,
//! T7 vee 3.175 tip 0.1 angle 30 life 50                   and what of it is not left to the machine and the job
//! ```
//!
//! Comes in: lines. Goes out: [`RackTool`]s or diagnostics naming line and word; how worn they are. What wears is counted in holes
//! (drills) or in metres milled (all others). Does not know who counts, nor where that is kept.

use super::settings::Value;
use crate::diagnostic::Diagnostic;
use crate::job::worn::Wear;
use crate::job::{Bit, Cutter, Handling};
use crate::locale;
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;

/// The setting that they are.
const KEY: &str = "rack.tools";
/// Most tools of a rack.
const MOST_TOOLS: usize = 64;
/// The longest line, in bytes.
const LONGEST_LINE: usize = 200;
/// Diameters from … to …, mm.
const DIAMETERS_MM: (f64, f64) = (0.05, 20.0);
/// µm in a metre.
const UM_PER_M: u64 = 1_000_000;

/// A tool of the rack.
#[derive(Clone, Debug, PartialEq)]
pub struct RackTool {
    /// What it is called by: T1, T2 …
    pub number: u32,
    /// Its form.
    pub cutter: Cutter,
    /// Its greatest diameter.
    pub diameter: Length,
    /// Speed at which it goes down into the board, mm/s; 0 where the job says. Of drills.
    pub down_mm_per_s: f64,
    /// Speed at which it is lifted, mm/s; 0 for as fast as the machine goes.
    pub up_mm_per_s: f64,
    /// Spindle speed, rpm; 0 where the job says. Of drills.
    pub spindle_rpm: u32,
    /// How far its edge may run off its axis: a hole is wider by twice that.
    pub run_out: Length,
    /// How many holes it drills, or metres it mills, until it is worn; 0 where nobody said.
    pub life: u32,
    /// Its place in the magazine; 0 where it has none.
    pub place: u32,
}

/// What a line may say of a tool besides number, form and diameter.
pub struct ToolField {
    /// The word of it.
    pub word: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// From …
    low: f64,
    /// … to.
    high: f64,
    /// Whole numbers alone.
    whole: bool,
    get: fn(&RackTool) -> f64,
    set: fn(&mut RackTool, f64),
}

/// All of them, in the order in which a line has them. A value of 0 is not said.
pub const TOOL_FIELDS: [ToolField; 8] = [
    ToolField { word: "tip", unit: "mm", low: 0.0, high: 10.0, whole: false, get: tip_mm, set: set_tip_mm },
    ToolField {
        word: "angle",
        unit: "°",
        low: 0.0,
        high: 179.0,
        whole: false,
        get: angle_deg,
        set: set_angle_deg,
    },
    ToolField {
        word: "down",
        unit: "mm/s",
        low: 0.0,
        high: 500.0,
        whole: false,
        get: |tool| tool.down_mm_per_s,
        set: |tool, value| tool.down_mm_per_s = value,
    },
    ToolField {
        word: "up",
        unit: "mm/s",
        low: 0.0,
        high: 500.0,
        whole: false,
        get: |tool| tool.up_mm_per_s,
        set: |tool, value| tool.up_mm_per_s = value,
    },
    ToolField {
        word: "rpm",
        unit: "rpm",
        low: 0.0,
        high: super::MOST_RPM as f64,
        whole: true,
        get: |tool| f64::from(tool.spindle_rpm),
        set: |tool, value| tool.spindle_rpm = value as u32,
    },
    ToolField {
        word: "run-out",
        unit: "mm",
        low: 0.0,
        high: 0.5,
        whole: false,
        get: |tool| tool.run_out.mm(),
        set: |tool, value| tool.run_out = Length::from_mm(value),
    },
    ToolField {
        word: "life",
        unit: "",
        low: 0.0,
        high: 1e6,
        whole: true,
        get: |tool| f64::from(tool.life),
        set: |tool, value| tool.life = value as u32,
    },
    ToolField {
        word: "place",
        unit: "",
        low: 0.0,
        high: 999.0,
        whole: true,
        get: |tool| f64::from(tool.place),
        set: |tool, value| tool.place = value as u32,
    },
];

/// The words of the forms.
pub const TOOL_FORMS: [&str; 3] = ["drill", "mill", "vee"];

fn tip_mm(tool: &RackTool) -> f64 {
    if let Cutter::Vee { tip, .. } = tool.cutter { tip.mm() } else { 0.0 }
}

fn set_tip_mm(tool: &mut RackTool, value: f64) {
    if let Cutter::Vee { tip, .. } = &mut tool.cutter {
        *tip = Length::from_mm(value);
    }
}

fn angle_deg(tool: &RackTool) -> f64 {
    if let Cutter::Vee { angle_mdeg, .. } = tool.cutter { f64::from(angle_mdeg) / 1e3 } else { 0.0 }
}

fn set_angle_deg(tool: &mut RackTool, value: f64) {
    if let Cutter::Vee { angle_mdeg, .. } = &mut tool.cutter {
        *angle_mdeg = libm::round(value * 1e3) as u32;
    }
}

impl fmt::Display for RackTool {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "T{} {} {}", self.number, self.form(), self.diameter.mm())?;
        let said =
            TOOL_FIELDS.iter().map(|field| (field.word, (field.get)(self))).filter(|said| said.1 != 0.0);
        said.into_iter().try_for_each(|(word, value)| write!(out, " {word} {value}"))
    }
}

fn wrong(code: &str, line: &str) -> Diagnostic {
    let shown: String = line.chars().take(80).collect();
    Diagnostic::error(code).with("key", KEY).with("line", shown)
}

impl RackTool {
    /// The drill of this diameter, with nothing said of it.
    pub fn drill(number: u32, diameter: Length) -> Self {
        let (down_mm_per_s, up_mm_per_s, run_out, cutter) = (0.0, 0.0, Length::ZERO, Cutter::Drill);
        let (spindle_rpm, life, place) = (0, 0, 0);
        Self { number, cutter, diameter, down_mm_per_s, up_mm_per_s, spindle_rpm, run_out, life, place }
    }

    /// The word of its form.
    pub fn form(&self) -> &'static str {
        match self.cutter {
            Cutter::Drill => TOOL_FORMS[0],
            Cutter::Mill => TOOL_FORMS[1],
            Cutter::Vee { .. } => TOOL_FORMS[2],
        }
    }

    /// The tool that a line says.
    pub fn read(line: &str) -> Result<Self, Diagnostic> {
        if line.len() > LONGEST_LINE {
            return Err(wrong("machine.tool_line", line));
        }
        let mut words = line.split_whitespace();
        let number = words.next().and_then(|word| word.strip_prefix(['T', 't'])?.parse().ok());
        let number = number.filter(|number| (1..=9_999).contains(number));
        let form = words.next().and_then(|word| TOOL_FORMS.iter().position(|form| *form == word));
        let (Some(number), Some(form), Some(size)) = (number, form, words.next()) else {
            return Err(wrong("machine.tool_line", line));
        };
        let mm = measure(line, ("diameter", size), DIAMETERS_MM, "mm", false)?;
        let vee = Cutter::Vee { tip: Length::ZERO, angle_mdeg: 0 };
        let cutter = [Cutter::Drill, Cutter::Mill, vee][form];
        let mut tool = Self { cutter, ..Self::drill(number, Length::from_mm(mm)) };
        while let Some(word) = words.next() {
            let known = TOOL_FIELDS.iter().find(|field| field.word == word);
            let shape = ["tip", "angle"].contains(&word);
            let Some(field) = known.filter(|_| !shape || tool.form() == "vee") else {
                return Err(wrong("machine.tool_word", line).with("word", word));
            };
            let value = words.next().unwrap_or_default();
            let value = measure(line, (word, value), (field.low, field.high), field.unit, field.whole)?;
            (field.set)(&mut tool, value);
        }
        if tool.form() == "vee" && (angle_deg(&tool) <= 0.0 || tip_mm(&tool) >= tool.diameter.mm()) {
            return Err(wrong("machine.tool_vee", line));
        }
        Ok(tool)
    }

    /// It as a bit of a program.
    pub fn bit(&self) -> Bit {
        let handling = self.handling();
        let unnamed = Bit { diameter: self.diameter, name: String::new(), cutter: self.cutter, handling };
        Bit { name: unnamed.title(locale::FALLBACK), ..unnamed }
    }

    /// How a bit of this kind is handled.
    pub fn handling(&self) -> Handling {
        let up_um_per_s = libm::round(self.up_mm_per_s * 1e3) as u32;
        Handling { up_um_per_s, run_out: self.run_out }
    }

    /// Whether `bit` of a program is one of these: of its form and size.
    pub fn is(&self, bit: &Bit) -> bool {
        self.cutter == bit.cutter && self.diameter == bit.diameter
    }

    /// Whether it wears by metres milled and not by holes.
    pub fn wears_by_way(&self) -> bool {
        self.cutter != Cutter::Drill
    }
}

/// The number that `text` is, in the bounds of `word`.
fn measure(
    line: &str,
    (word, text): (&str, &str),
    (low, high): (f64, f64),
    unit: &str,
    whole: bool,
) -> Result<f64, Diagnostic> {
    let value = text.parse::<f64>().ok().filter(|value| (low..=high).contains(value));
    value.filter(|value| !whole || libm::trunc(*value) == *value).ok_or_else(|| {
        let measure = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let why = wrong("machine.tool_range", line).with("word", word).with("value", text);
        why.with("low", low).with("high", high).with("measure", measure)
    })
}

/// The rack that a value of the setting says: a line a tool, or bare diameters of drills, in mm.
pub fn rack_of(value: &Value) -> Result<Vec<RackTool>, Diagnostic> {
    let tools = match value {
        Value::Texts(lines) if lines.len() <= MOST_TOOLS => {
            lines.iter().map(|line| RackTool::read(line)).collect::<Result<Vec<_>, _>>()?
        }
        Value::Numbers(sizes) if sizes.len() <= MOST_TOOLS => {
            let drill = |(number, mm): (u32, &f64)| RackTool::read(&format!("T{number} drill {mm}"));
            (1..).zip(sizes).map(drill).collect::<Result<Vec<_>, _>>()?
        }
        Value::Texts(_) | Value::Numbers(_) => {
            return Err(Diagnostic::error("machine.tools_too_many")
                .with("key", KEY)
                .with("most", MOST_TOOLS));
        }
        _ => return Err(wrong("machine.tool_line", &value.to_string())),
    };
    let mut numbers = BTreeSet::new();
    match tools.iter().find(|tool| !numbers.insert(tool.number)) {
        Some(twice) => Err(wrong("machine.tool_twice", &twice.to_string()).with("number", twice.number)),
        None => Ok(tools),
    }
}

/// The value of the setting that says `rack`.
pub(super) fn rack_value(rack: &[RackTool]) -> Value {
    Value::Texts(rack.iter().map(RackTool::to_string).collect())
}

/// What a tool of a machine has done since it was new.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToolWear {
    /// Name of the machine.
    pub machine: String,
    /// Number of the tool.
    pub number: u32,
    /// Its form: where the rack has another one under that number, this is not its.
    pub cutter: Cutter,
    /// Its diameter, likewise.
    pub diameter: Length,
    /// Holes drilled.
    pub hits: u64,
    /// Way milled, µm.
    pub milled_um: u64,
}

impl ToolWear {
    /// That of a new `tool` of `machine`.
    pub fn new(machine: &str, tool: &RackTool) -> Self {
        let (number, cutter, diameter) = (tool.number, tool.cutter, tool.diameter);
        Self { machine: machine.to_owned(), number, cutter, diameter, hits: 0, milled_um: 0 }
    }

    /// That of `tool` of `machine`, as far as it is in `known`.
    pub fn of(known: &[Self], machine: &str, tool: &RackTool) -> Self {
        let new = Self::new(machine, tool);
        let own = known.iter().find(|wear| wear.is_like(&new));
        own.cloned().unwrap_or(new)
    }

    /// Whether both are of one tool of one machine.
    fn is_like(&self, other: &Self) -> bool {
        let of = |wear: &Self| (wear.number, wear.cutter, wear.diameter);
        of(self) == of(other) && self.machine == other.machine
    }

    /// Puts it into `known`, in place of what stood there of that number.
    pub fn keep(self, known: &mut Vec<Self>) {
        known.retain(|wear| (wear.number, &wear.machine) != (self.number, &self.machine));
        known.push(self);
    }

    /// That of the same tool once it did `more`.
    #[must_use]
    pub fn plus(&self, more: Wear) -> Self {
        let Wear { hits, milled_um } = Wear { hits: self.hits, milled_um: self.milled_um }.plus(more);
        Self { hits, milled_um, ..self.clone() }
    }

    /// How much of its life is done, in holes or in metres.
    pub fn done(&self) -> u64 {
        if self.cutter == Cutter::Drill { self.hits } else { self.milled_um / UM_PER_M }
    }

    /// The share of `life` that is done; none where nobody said how long it lives.
    pub fn share(&self, life: u32) -> Option<f64> {
        let done = if self.cutter == Cutter::Drill { self.hits as f64 } else { self.milled_um as f64 / 1e6 };
        (life > 0).then(|| done / f64::from(life))
    }

    /// Whether a life of `life` is over.
    pub fn is_over(&self, life: u32) -> bool {
        life > 0 && self.done() >= u64::from(life)
    }
}

/// The tool of `rack` that `bit` is: of several that are alike the first whose life is not over, else the first.
pub fn tool_of<'a>(
    rack: &'a [RackTool],
    bit: &Bit,
    machine: &str,
    known: &[ToolWear],
) -> Option<&'a RackTool> {
    let alike = || rack.iter().filter(|tool| tool.is(bit));
    let fresh = alike().find(|tool| !ToolWear::of(known, machine, tool).is_over(tool.life));
    fresh.or_else(|| alike().next())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_a_tool_and_the_tool_that_line() {
        let rows = [
            ("T1 drill 0.8", "T1 drill 0.8"),
            ("t2  drill 0.80 life 2000 rpm 30000 down 12.5", "T2 drill 0.8 down 12.5 rpm 30000 life 2000"),
            ("T7 vee 3.175 angle 30 tip 0.1 life 50", "T7 vee 3.175 tip 0.1 angle 30 life 50"),
            ("T12 mill 1.5 place 3 run-out 0.02 up 40 life 0", "T12 mill 1.5 up 40 run-out 0.02 place 3"),
        ];
        for (line, written) in rows {
            let tool = RackTool::read(line).unwrap();
            assert_eq!(tool.to_string(), written);
            assert_eq!(RackTool::read(written), Ok(tool));
        }
    }

    #[test]
    fn what_is_no_tool_is_refused_by_its_word() {
        let long = format!("T1 drill 0.8{}", " life 1".repeat(40));
        let rows: [(&[&str], &str, &str); 14] = [
            (&[""], "machine.tool_line", ""),
            (&["drill 0.8"], "machine.tool_line", "drill 0.8"),
            (&["T0 drill 0.8"], "machine.tool_line", "T0"),
            (&["T1 reamer 0.8"], "machine.tool_line", "reamer"),
            (&["T1 drill"], "machine.tool_line", "T1 drill"),
            (&["T1 drill thin"], "machine.tool_range", "thin"),
            (&["T1 drill 0.8 life"], "machine.tool_range", "life"),
            (&["T1 drill 0.8 life 2.5"], "machine.tool_range", "2.5"),
            (&["T1 drill 0.8 rpm 1e9"], "machine.tool_range", "1e9"),
            (&["T1 drill 0.8 colour 3"], "machine.tool_word", "colour"),
            (&["T1 drill 0.8 tip 0.1"], "machine.tool_word", "tip"),
            (&["T1 vee 3 tip 0.1"], "machine.tool_vee", "T1 vee"),
            (&["T1 drill 0.8", "T1 mill 1"], "machine.tool_twice", "T1"),
            (&[&long], "machine.tool_line", "T1"),
        ];
        for (lines, code, word) in rows {
            let lines = lines.iter().map(|line| (*line).to_owned()).collect();
            let why = rack_of(&Value::Texts(lines)).unwrap_err();
            assert_eq!(why.code, code, "{word}");
            assert!(
                why.message("en").contains(word) && !why.advice("en").is_empty(),
                "{}",
                why.message("en")
            );
        }
        let many = Value::Numbers(vec![0.8; MOST_TOOLS + 1]);
        assert_eq!(rack_of(&many).unwrap_err().code, "machine.tools_too_many");
    }

    #[test]
    fn bare_diameters_are_drills() {
        let rack = rack_of(&Value::Numbers(vec![0.8, 1.0])).unwrap();
        let lines: Vec<_> = rack.iter().map(RackTool::to_string).collect();
        assert_eq!(lines, ["T1 drill 0.8", "T2 drill 1"]);
    }

    #[test]
    fn drills_wear_by_holes_and_mills_by_metres_and_another_tool_under_a_number_is_new() {
        let rack: Vec<_> = ["T1 drill 0.8 life 3", "T2 mill 1.5 life 2", "T3 drill 0.8 life 3"]
            .iter()
            .map(|line| RackTool::read(line).unwrap())
            .collect();
        let mut known = Vec::new();
        // Which tool, holes and µm more, done afterwards, and whether it is over.
        let rows = [
            (0, 2, 9_000_000, 2, false),
            (0, 1, 0, 3, true),
            (1, 50, 1_999_999, 1, false),
            (1, 0, 1, 2, true),
        ];
        for (at, hits, um, done, over) in rows {
            let tool = &rack[at];
            let wear = ToolWear::of(&known, "mine", tool).plus(Wear { hits, milled_um: um });
            assert_eq!((wear.done(), wear.is_over(tool.life)), (done, over), "{tool}");
            wear.keep(&mut known);
        }
        assert_eq!(known.len(), 2);
        assert_eq!(ToolWear::of(&known, "mine", &rack[0]).share(3), Some(1.0));
        assert_eq!(ToolWear::of(&known, "yours", &rack[0]).hits, 0, "of another machine");
        let other = RackTool::read("T1 drill 0.9 life 3").unwrap();
        assert_eq!(ToolWear::of(&known, "mine", &other).hits, 0, "another tool");
        assert_eq!(ToolWear::of(&known, "mine", &other).share(0), None);
        // T1 is worn, so it is T3's turn; and T1's again where all are.
        let bit = rack[0].bit();
        let turn = |known: &[ToolWear]| tool_of(&rack, &bit, "mine", known).map(|tool| tool.number);
        assert_eq!(turn(&known), Some(3));
        let mut third = ToolWear::new("mine", &rack[2]);
        third.hits = 7;
        third.keep(&mut known);
        assert_eq!(turn(&known), Some(1));
        assert_eq!(tool_of(&rack, &RackTool::read("T9 drill 2").unwrap().bit(), "mine", &known), None);
    }
}
