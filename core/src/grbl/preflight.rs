//! Whether a job can start: problems that prevent it, or deserve a warning.

use super::asks::EngineStart;
use super::fits::{self, MachineRange};
use super::known::{Known, SAME_ZERO_MM};
use super::routine::SectionKind;
use super::settings;
use crate::control::{BoardHeight, Trust};
use crate::diagnostic::Diagnostic;
use crate::{error, warning};

impl Known {
    /// Problems that prevent a job or deserve a warning.
    pub fn check(&self, start: &EngineStart) -> Vec<Diagnostic> {
        let mut found = Vec::new();
        found.extend(self.untrusted());
        let (Some(zero), Some(_)) = (self.zero_mm, self.place()) else {
            found.push(error!("grbl.no_report"));
            return found;
        };
        found.extend(self.check_listed());
        found.extend(self.zero_refused.then(|| error!("grbl.zero_not_taken")));
        found.extend(self.check_zero(start));
        found.extend(self.overrides_that_stand());
        found.extend(self.check_setter(start));
        found.extend(self.reference_told(start));
        found.extend(settings::motors_let_go(&self.info.values));
        let homed = self.is_homed();
        let ends_mm = core::array::from_fn(|axis| self.reach_mm(axis));
        let small = self.info.flavour() == "GRBL";
        let machine = MachineRange { values: &self.info.values, zero_mm: zero, homed, ends_mm, small };
        let (routine, lower) = self.fitted(&start.routine);
        found.extend(lower);
        found.extend(fits::compare(&routine, &machine));
        found.sort_by_key(|diagnostic| std::cmp::Reverse(diagnostic.severity));
        found
    }

    /// Problems of the work zero that prevent a job: Z was never set, or the zero has moved since the job was
    /// interrupted.
    fn check_zero(&self, start: &EngineStart) -> Option<Diagnostic> {
        let unknown = self.height == BoardHeight::Unknown;
        let Some((before, now)) = start.zero_mm.filter(|_| self.homes()).zip(self.job_zero_mm()) else {
            return unknown.then(|| error!("grbl.no_height"));
        };
        let off_mm: [f64; 3] = core::array::from_fn(|axis| now[axis] - before[axis]);
        let plane = off_mm[..2].iter().any(|off_mm| libm::fabs(*off_mm) > SAME_ZERO_MM);
        // A Z zero set since then belongs to the current tool or to the next one.
        let height = unknown && !self.height_as_left(start.zero_mm);
        let told = |axis: usize| format!("{:.3}", off_mm[axis]);
        (plane || height).then(|| {
            let why = error!("grbl.zero_moved", x = told(0), y = told(1), ..);
            why.with("z", told(2))
        })
    }

    /// Overrides active before a job starts; no program resets them.
    fn overrides_that_stand(&self) -> Option<Diagnostic> {
        let [feed, rapid, spindle] = self.overrides().filter(|all| *all != [100; 3])?;
        let why = warning!("grbl.overrides_stand", feed = feed, ..);
        Some(why.with("rapid", rapid).with("spindle", spindle))
    }

    /// Problems of tool setter and tool changer that prevent a job. An unknown position is reported
    /// elsewhere.
    fn check_setter(&self, start: &EngineStart) -> Vec<Diagnostic> {
        let setter = start.setter.filter(|_| !start.same_length);
        let why = setter.and_then(|setter| self.setter_refused(&setter));
        let why = why.filter(|_| self.trust == Trust::Trusted || !self.homes());
        why.into_iter().chain(check_changer(start)).collect()
    }

    /// Warning that the current tool will be measured before the job requests one.
    fn reference_told(&self, start: &EngineStart) -> Option<Diagnostic> {
        let setter = start.setter.filter(|_| !start.same_length && start.routine.changes_tools())?;
        let is_known = start.from > 0 && self.reference_mm.is_some();
        let [x, y] = setter.place_mm.map(|mm| format!("{mm:.3}"));
        let why = warning!("setter.reference", x = x, y = y);
        (self.height == BoardHeight::OfThisBit && !is_known).then_some(why)
    }
}

/// Problems of the tool changer that prevent a job or deserve a warning.
fn check_changer(start: &EngineStart) -> Vec<Diagnostic> {
    let Some(changer) = &start.changer else { return Vec::new() };
    let sections = start.routine.sections.iter().skip(start.from);
    let later = sections.filter_map(|section| match section.kind {
        SectionKind::Change(tool) if !start.routine.stops.contains(&tool) => Some(tool),
        _ => None,
    });
    let mut tools = start.routine.tool_at(start.from).into_iter().chain(later);
    let unknown = tools.find(|tool| changer.lines.asks_number() && changer.number(*tool).is_none());
    let name = |tool: u32| start.routine.tools.get(tool as usize).cloned().unwrap_or_default();
    let unknown = unknown.map(|tool| {
        let why = error!("changer.no_number", change = tool + 1, ..);
        why.with("tool", name(tool))
    });
    let measures = start.setter.is_some() || start.same_length;
    let trusts = (!measures).then(|| warning!("changer.lengths"));
    unknown.into_iter().chain(trusts).collect()
}
