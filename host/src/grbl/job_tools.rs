//! Counts tool wear during a job on a controller, section by section, and decides before which section a
//! new tool is needed. Used by the bridge and by the page.
//!
//! ```text
//! section 17 running │ life ends with it ─▶ before section 18 the user inserts a new tool
//!            done    │ wear counted with the progress record of that section
//! ```

use super::order::legs;
use crate::prepare::worn_tool;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::{Routine, Section, SectionKind};
use annulus_core::job::worn::{self, Wear};
use annulus_core::job::{Bit, Program};
use annulus_core::machine::{RackTool, ToolWear, tool_of};
use serde::{Deserialize, Serialize};

/// Tool and wear of each section of a job.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SectionWear {
    bits: Vec<Bit>,
    /// Of each section: tool index, holes, µm milled.
    sections: Vec<(u32, u64, u64)>,
}

impl SectionWear {
    /// The wear of `program`, divided into the sections of `routine`.
    pub fn of(program: &Program, routine: &Routine) -> Self {
        Self::by_legs(program, legs(program, routine))
    }

    pub(super) fn by_legs(program: &Program, mut legs: Vec<usize>) -> Self {
        let by_leg = worn::by_leg(program);
        legs.push(program.legs.len());
        let sections = legs.windows(2).map(|ends| {
            // If two sections share a leg, its wear counts for the second.
            let own = by_leg.get(ends[0]..ends[1].max(ends[0])).unwrap_or_default();
            let bit = by_leg.get(ends[0]).map_or(0, |(bit, _)| *bit);
            let sum = own.iter().fold(Wear::default(), |sum, (_, wear)| sum.plus(*wear));
            (bit, sum.hits, sum.milled_um)
        });
        Self { bits: program.bits.clone(), sections: sections.collect() }
    }

    fn wear(&self, section: usize) -> Wear {
        let found = self.sections.get(section).copied().unwrap_or_default();
        Wear { hits: found.1, milled_um: found.2 }
    }

    fn bit(&self, section: usize) -> Option<&Bit> {
        let (bit, ..) = self.sections.get(section)?;
        self.bits.get(*bit as usize)
    }
}

#[derive(Clone, Debug)]
pub struct JobTools {
    sections: SectionWear,
    rack: Vec<RackTool>,
    machine: String,
    known: Vec<ToolWear>,
    in_spindle: Option<u32>,
    wanted: Option<u32>,
    /// The machine fetched the tool: exactly that one, even if worn.
    is_fetched: bool,
    counted: usize,
}

impl JobTools {
    /// The tools of a job on the machine of this name, with its tool list and the `known` wear.
    pub fn new(sections: SectionWear, (machine, rack): (&str, &[RackTool]), known: Vec<ToolWear>) -> Self {
        let (rack, machine) = (rack.to_vec(), machine.to_owned());
        Self { sections, rack, machine, known, in_spindle: None, wanted: None, is_fetched: false, counted: 0 }
    }

    pub fn wear(&self) -> &[ToolWear] {
        &self.known
    }

    /// Number of the tool that the user is asked for.
    pub fn wanted(&self) -> Option<u32> {
        self.wanted
    }

    /// Sets the wear of a tool, as the user states it.
    pub fn set(&mut self, wear: ToolWear) {
        wear.keep(&mut self.known);
    }

    /// Starts counting at section `from`, whose tool is in the spindle.
    pub(super) fn begins(&mut self, from: usize) {
        (self.counted, self.wanted) = (from, None);
        self.in_spindle = self.number_for(from);
    }

    pub(super) fn done(&mut self, done: usize) {
        for section in self.counted..done {
            let after =
                self.tool(self.in_spindle).map(|tool| self.of(tool).plus(self.sections.wear(section)));
            if let Some(wear) = after.filter(|_| !self.sections.wear(section).is_nothing()) {
                wear.keep(&mut self.known);
            }
        }
        self.counted = self.counted.max(done);
    }

    /// The section before which a new tool is needed, if that is the current or the next one. The current
    /// tool is worn, or will be.
    pub(super) fn new_before(&self) -> Option<usize> {
        let tool = self.tool(self.in_spindle).filter(|_| self.wanted.is_none())?;
        let (now, next) = (self.counted, self.counted + 1);
        let wears = |section: usize| {
            let is_its = self.sections.bit(section).is_some_and(|bit| tool.is(bit));
            is_its && !self.sections.wear(section).is_nothing()
        };
        let of = self.of(tool);
        if wears(now) && of.is_over(tool.life) {
            return Some(now);
        }
        (wears(next) && of.plus(self.sections.wear(now)).is_over(tool.life)).then_some(next)
    }

    /// The user is asked for the tool of the next section. Returns that tool if it is worn: a new one must
    /// go in.
    pub(super) fn is_asked(&mut self) -> Option<(&RackTool, ToolWear)> {
        let wanted = self.number_for(self.counted);
        // A tool that the machine fetched only needs touching off.
        if self.is_fetched && self.wanted == wanted {
            return None;
        }
        (self.wanted, self.is_fetched) = (wanted, false);
        let tool = self.tool(self.wanted)?;
        let wear = self.of(tool);
        wear.is_over(tool.life).then_some((tool, wear))
    }

    /// The machine fetched the tool of the next section itself.
    pub(super) fn is_fetched(&mut self) {
        (self.wanted, self.is_fetched) = (self.number_for(self.counted), true);
    }

    /// The number of each tool of `routine`, if the machine's list has it.
    pub fn numbers(&self, routine: &Routine) -> Vec<Option<u32>> {
        let of = |tool: u32| {
            let is = |section: &Section| section.kind == SectionKind::Change(tool);
            self.number_for(routine.sections.iter().position(is)?)
        };
        let said = |tool: u32| routine.numbers.get(tool as usize).copied().flatten();
        (0..routine.tools.len() as u32).map(|tool| of(tool).or_else(|| said(tool))).collect()
    }

    /// The requested tool is in. If that number was worn and the user inserted it, its wear starts at zero.
    pub(super) fn is_in(&mut self) {
        self.in_spindle = self.wanted.take();
        if std::mem::take(&mut self.is_fetched) {
            return;
        }
        let worn = self.tool(self.in_spindle).filter(|tool| self.of(tool).is_over(tool.life));
        if let Some(new) = worn.map(|tool| ToolWear::new(&self.machine, tool)) {
            self.set(new);
        }
    }

    /// Warns of tools that are worn, or will be before the job ends, counted from section `from`; in order
    /// of use.
    pub fn worn_ahead(&self, from: usize) -> Vec<Diagnostic> {
        let mut needs: Vec<(u32, Wear)> = Vec::new();
        for section in from..self.sections.sections.len() {
            let (bit, wear) = (self.sections.sections[section].0, self.sections.wear(section));
            match needs.iter_mut().find(|(known, _)| *known == bit) {
                Some((_, sum)) => *sum = sum.plus(wear),
                None => needs.push((bit, wear)),
            }
        }
        let found = needs.into_iter().filter(|(_, wear)| !wear.is_nothing()).filter_map(|(bit, wear)| {
            let bit = self.sections.bits.get(bit as usize)?;
            let tool = tool_of(&self.rack, bit, &self.machine, &self.known)?;
            worn_tool(tool, bit, (&self.of(tool), wear))
        });
        found.collect()
    }

    fn tool(&self, number: Option<u32>) -> Option<&RackTool> {
        self.rack.iter().find(|tool| Some(tool.number) == number)
    }

    fn of(&self, tool: &RackTool) -> ToolWear {
        ToolWear::of(&self.known, &self.machine, tool)
    }

    fn number_for(&self, section: usize) -> Option<u32> {
        let tool = tool_of(&self.rack, self.sections.bit(section)?, &self.machine, &self.known)?;
        Some(tool.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worn_tools_are_reported_for_the_rest_of_the_job() {
        let rack = ["T1 drill 0.8 life 6", "T2 drill 1 life 9", "T3 mill 2 life 3"];
        let rack = rack.map(|line| RackTool::read(line).unwrap());
        let bits = [1, 0, 2].map(|tool: usize| rack[tool].bit()).to_vec();
        // Tool, holes, µm milled: first 1 mm, then 0.8 mm in two parts, then the end mill.
        let sections = vec![(0, 4, 0), (1, 0, 0), (1, 3, 0), (2, 0, 2_900_000), (1, 3, 0)];
        let sections = SectionWear { bits, sections };
        let told = |done: [u64; 3], from| -> Vec<String> {
            let wear = rack.iter().zip(done).map(|(tool, done)| {
                let more = if tool.wears_by_way() {
                    Wear { hits: 0, milled_um: done * 1_000_000 }
                } else {
                    Wear { hits: done, milled_um: 0 }
                };
                ToolWear::new("mine", tool).plus(more)
            });
            let tools = JobTools::new(sections.clone(), ("mine", &rack), wear.collect());
            tools.worn_ahead(from).iter().map(|why| why.message("en")).collect()
        };
        assert_eq!(
            told([0, 0, 0], 0),
            ["T1 (drill 0.8) has drilled 0 holes of 6. It wears out before this job ends."]
        );
        assert_eq!(told([0, 0, 0], 3), Vec::<String>::new(), "three of its holes are left");
        let all = told([6, 9, 3], 0);
        let begin =
            ["T2 (drill 1) has drilled 9", "T1 (drill 0.8) has drilled 6", "T3 (end mill 2) has milled 3 m"];
        assert_eq!(all.len(), 3, "{all:?}");
        for (sentence, begin) in all.iter().zip(begin) {
            assert!(sentence.starts_with(begin) && sentence.ends_with("it is worn."), "{all:?}");
        }
        assert_eq!(told([6, 9, 3], 5), Vec::<String>::new());
    }
}
