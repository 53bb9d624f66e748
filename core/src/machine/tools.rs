//! The tool list of a machine, and the wear of each tool since it was new.
//!
//! ```text
//! T1 drill 0.8 down 12 up 40 rpm 30000 life 2000          one line each: number, type, diameter in mm,
//! T7 vee 3.175 tip 0.1 angle 30 life 50                   and optional fields
//! ```
//!
//! Wear is counted in holes (drills) or in milled metres (all others).

use super::field::{Field, NONE, fields, number};
use super::value::ValueKind::{Number, Whole};
use super::value::{Value, ValueKind};
use crate::diagnostic::Diagnostic;
use crate::job::worn::Wear;
use crate::job::{Bit, Cutter, Handling};
use crate::locale;
use crate::units::Length;
use crate::{code, error};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;

pub const MOST_RPM: u32 = 300_000;

const KEY: &str = "rack.tools";
const MOST_TOOLS: usize = 64;
const LONGEST_LINE: usize = 200;
/// Diameters, mm.
const DIAMETERS: ValueKind = Number(0.05, 20.0);
/// µm in a metre.
const UM_PER_M: u64 = 1_000_000;

#[derive(Clone, Debug, PartialEq)]
pub struct RackTool {
    /// Displayed as T1, T2, etc.
    pub number: u32,
    pub cutter: Cutter,
    pub diameter: Length,
    /// Plunge feed, mm/s; 0 if the job decides. Drills only.
    pub down_mm_per_s: f64,
    /// Retract speed, mm/s; 0 for the machine's fastest.
    pub up_mm_per_s: f64,
    /// Spindle speed, rpm; 0 if the job decides. Drills only.
    pub spindle_rpm: u32,
    /// Run-out of the edge: holes are wider by twice that.
    pub run_out: Length,
    /// Life in holes or milled metres; 0 if unknown.
    pub life: u32,
    /// Slot in the magazine; 0 if none.
    pub place: u32,
}

/// All optional fields of a line, in its order; the key is the keyword. A value of 0 is omitted.
pub const TOOL_FIELDS: &[Field<RackTool>] = fields! { RackTool;
    ("tip", "mm", Number(0.0, 10.0), NONE;
        |tool| tip_and_angle(&tool.cutter).map(|(tip, _)| Value::Number(tip.mm())),
        |tool, v| set_tip(&mut tool.cutter, v))
    ("angle", "°", Number(0.0, 179.0), NONE;
        |tool| tip_and_angle(&tool.cutter).map(|(_, mdeg)| Value::Number(f64::from(mdeg) / 1e3)),
        |tool, v| set_angle(&mut tool.cutter, v))
    ("down", "mm/s", Number(0.0, 500.0), NONE, down_mm_per_s)
    ("up", "mm/s", Number(0.0, 500.0), NONE, up_mm_per_s)
    ("rpm", "rpm", Whole(0.0, MOST_RPM as f64), NONE, spindle_rpm)
    ("run-out", "mm", Number(0.0, 0.5), NONE, run_out)
    ("life", "", Whole(0.0, 1e6), NONE, life)
    ("place", "", Whole(0.0, 999.0), NONE, place)
};

/// Keywords of the tool types.
pub const TOOL_FORMS: [&str; 3] = ["drill", "mill", "vee"];

/// Tip and angle of a V-bit, in thousandths of a degree.
pub(crate) fn tip_and_angle(cutter: &Cutter) -> Option<(Length, u32)> {
    if let Cutter::Vee { tip, angle_mdeg } = *cutter { Some((tip, angle_mdeg)) } else { None }
}

pub(crate) fn set_tip(cutter: &mut Cutter, mm: &Value) {
    if let Cutter::Vee { tip, .. } = cutter {
        *tip = Length::from_mm(number(mm));
    }
}

pub(crate) fn set_angle(cutter: &mut Cutter, degrees: &Value) {
    if let Cutter::Vee { angle_mdeg, .. } = cutter {
        *angle_mdeg = libm::round(number(degrees) * 1e3) as u32;
    }
}

impl fmt::Display for RackTool {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "T{} {} {}", self.number, self.form(), self.diameter.mm())?;
        let said = TOOL_FIELDS.iter().filter_map(|field| Some((field.key, field.get(self)?)));
        let mut said = said.filter(|(_, value)| *value != Value::Number(0.0));
        said.try_for_each(|(word, value)| write!(out, " {word} {value}"))
    }
}

fn wrong(code: &str, line: &str) -> Diagnostic {
    let shown: String = line.chars().take(80).collect();
    Diagnostic::error(code).with("key", KEY).with("line", shown)
}

impl RackTool {
    /// A drill of this diameter, without optional fields.
    pub fn drill(number: u32, diameter: Length) -> Self {
        let (down_mm_per_s, up_mm_per_s, run_out, cutter) = (0.0, 0.0, Length::ZERO, Cutter::Drill);
        let (spindle_rpm, life, place) = (0, 0, 0);
        Self { number, cutter, diameter, down_mm_per_s, up_mm_per_s, spindle_rpm, run_out, life, place }
    }

    /// Keyword of its type.
    pub fn form(&self) -> &'static str {
        match self.cutter {
            Cutter::Drill => TOOL_FORMS[0],
            Cutter::Mill => TOOL_FORMS[1],
            Cutter::Vee { .. } => TOOL_FORMS[2],
        }
    }

    pub fn read(line: &str) -> Result<Self, Diagnostic> {
        if line.len() > LONGEST_LINE {
            return Err(wrong(code!("machine.tool_line"), line));
        }
        let mut words = line.split_whitespace();
        let number = words.next().and_then(|word| word.strip_prefix(['T', 't'])?.parse().ok());
        let number = number.filter(|number| (1..=9_999).contains(number));
        let form = words.next().and_then(|word| TOOL_FORMS.iter().position(|form| *form == word));
        let (Some(number), Some(form), Some(size)) = (number, form, words.next()) else {
            return Err(wrong(code!("machine.tool_line"), line));
        };
        let mm = measure(line, ("diameter", size), DIAMETERS, "mm")?;
        let vee = Cutter::Vee { tip: Length::ZERO, angle_mdeg: 0 };
        let cutter = [Cutter::Drill, Cutter::Mill, vee][form];
        let mut tool = Self { cutter, ..Self::drill(number, Length::from_mm(mm)) };
        while let Some(word) = words.next() {
            let known = TOOL_FIELDS.iter().find(|field| field.key == word);
            let Some(field) = known.filter(|field| field.belongs_to(&tool)) else {
                return Err(wrong(code!("machine.tool_word"), line).with("word", word));
            };
            let value = words.next().unwrap_or_default();
            let value = measure(line, (word, value), field.kind, field.unit)?;
            (field.write)(&mut tool, &Value::Number(value));
        }
        if tip_and_angle(&tool.cutter).is_some_and(|(tip, mdeg)| mdeg == 0 || tip >= tool.diameter) {
            return Err(wrong(code!("machine.tool_vee"), line));
        }
        Ok(tool)
    }

    pub fn bit(&self) -> Bit {
        let handling = self.handling();
        let unnamed = Bit { diameter: self.diameter, name: String::new(), cutter: self.cutter, handling };
        Bit { name: unnamed.title(locale::FALLBACK), ..unnamed }
    }

    pub fn handling(&self) -> Handling {
        let up_um_per_s = libm::round(self.up_mm_per_s * 1e3) as u32;
        Handling { up_um_per_s, run_out: self.run_out }
    }

    /// True if `bit` has this tool's type and size.
    pub fn is(&self, bit: &Bit) -> bool {
        self.cutter == bit.cutter && self.diameter == bit.diameter
    }

    /// True if wear is counted in milled metres, not in holes.
    pub fn wears_by_way(&self) -> bool {
        self.cutter != Cutter::Drill
    }
}

/// Parses a number in the range of `word`.
fn measure(line: &str, (word, text): (&str, &str), kind: ValueKind, unit: &str) -> Result<f64, Diagnostic> {
    let fits = |number: &f64| kind.refusal(word, unit, &Value::Number(*number)).is_none();
    text.parse::<f64>().ok().filter(fits).ok_or_else(|| {
        let (low, high) = kind.range().unwrap_or_default();
        let measure = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let why = wrong(code!("machine.tool_range"), line).with("word", word).with("value", text);
        why.with("low", low).with("high", high).with("measure", measure)
    })
}

/// Parses the setting: one tool per line, or only diameters of drills, in mm.
pub fn rack_of(value: &Value) -> Result<Vec<RackTool>, Diagnostic> {
    let tools = match value {
        Value::Texts(lines) if lines.len() <= MOST_TOOLS => {
            lines.iter().map(|line| RackTool::read(line)).collect::<Result<Vec<_>, _>>()?
        }
        // Older files list only the diameters of drills.
        Value::Numbers(sizes) if sizes.len() <= MOST_TOOLS => {
            let drill = |(number, mm): (u32, &f64)| RackTool::read(&format!("T{number} drill {mm}"));
            (1..).zip(sizes).map(drill).collect::<Result<Vec<_>, _>>()?
        }
        Value::Texts(_) | Value::Numbers(_) => {
            return Err(error!("machine.tools_too_many", key = KEY, most = MOST_TOOLS));
        }
        _ => return Err(wrong(code!("machine.tool_line"), &value.to_string())),
    };
    let mut numbers = BTreeSet::new();
    match tools.iter().find(|tool| !numbers.insert(tool.number)) {
        Some(twice) => {
            Err(wrong(code!("machine.tool_twice"), &twice.to_string()).with("number", twice.number))
        }
        None => Ok(tools),
    }
}

pub(super) fn rack_value(rack: &[RackTool]) -> Value {
    Value::Texts(rack.iter().map(RackTool::to_string).collect())
}

/// Wear of a tool since it was new.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToolWear {
    pub machine: String,
    pub number: u32,
    /// Type and size: this record is invalid for a different tool with that number.
    pub cutter: Cutter,
    pub diameter: Length,
    pub hits: u64,
    /// Milled distance, µm.
    pub milled_um: u64,
}

impl ToolWear {
    /// No wear, for `tool` of `machine`.
    pub fn new(machine: &str, tool: &RackTool) -> Self {
        let (number, cutter, diameter) = (tool.number, tool.cutter, tool.diameter);
        Self { machine: machine.to_owned(), number, cutter, diameter, hits: 0, milled_um: 0 }
    }

    /// The wear of `tool` of `machine` in `known`; none recorded means new.
    pub fn of(known: &[Self], machine: &str, tool: &RackTool) -> Self {
        let new = Self::new(machine, tool);
        let own = known.iter().find(|wear| wear.is_like(&new));
        own.cloned().unwrap_or(new)
    }

    fn is_like(&self, other: &Self) -> bool {
        let of = |wear: &Self| (wear.number, wear.cutter, wear.diameter);
        of(self) == of(other) && self.machine == other.machine
    }

    /// Stores the record in `known`, and replaces any record with its number.
    pub fn keep(self, known: &mut Vec<Self>) {
        known.retain(|wear| (wear.number, &wear.machine) != (self.number, &self.machine));
        known.push(self);
    }

    /// The record after `more` wear.
    #[must_use]
    pub fn plus(&self, more: Wear) -> Self {
        let Wear { hits, milled_um } = Wear { hits: self.hits, milled_um: self.milled_um }.plus(more);
        Self { hits, milled_um, ..self.clone() }
    }

    pub fn done(&self) -> u64 {
        if self.cutter == Cutter::Drill { self.hits } else { self.milled_um / UM_PER_M }
    }

    /// Used share of `life`; none if the life is unknown.
    pub fn share(&self, life: u32) -> Option<f64> {
        let done = if self.cutter == Cutter::Drill { self.hits as f64 } else { self.milled_um as f64 / 1e6 };
        (life > 0).then(|| done / f64::from(life))
    }

    /// True if the tool has reached its `life`.
    pub fn is_over(&self, life: u32) -> bool {
        life > 0 && self.done() >= u64::from(life)
    }
}

/// The tool of `rack` for `bit`: the first of its kind with life left, else the first of its kind.
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
    fn tool_lines_survive_a_round_trip() {
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
    fn invalid_tool_lines_name_the_wrong_word() {
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
    fn wear_is_counted_per_tool_and_another_tool_starts_at_zero() {
        let rack: Vec<_> = ["T1 drill 0.8 life 3", "T2 mill 1.5 life 2", "T3 drill 0.8 life 3"]
            .iter()
            .map(|line| RackTool::read(line).unwrap())
            .collect();
        let mut known = Vec::new();
        // Tool, more holes and µm, used life afterwards, whether it is over.
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
        // T1 is worn, so T3 is next; and T1 again if all are worn.
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
