//! Built-in machines by name: own ones, mills with common boards of STEP/DIR drivers, and mills with a
//! controller.

mod boards;
mod mills;
mod own;

use super::{Machine, settings};
pub use mills::{MILL_KEY, MILLS, MillProfile, mill};
pub use own::{VIRTUAL_NAME, hobby_3018, lab, six_spindles, virtual_drill};

pub fn presets() -> [(&'static str, Machine); 7] {
    [
        ("virtual", virtual_drill()),
        ("lab", lab()),
        ("3018", hobby_3018()),
        ("six", six_spindles()),
        ("breakout", boards::breakout()),
        ("tb6560", boards::tb6560()),
        ("g540", boards::g540()),
    ]
}

/// Aliases of presets: a hobby mill is a 3018.
const CALLED: [(&str, &str); 1] = [("hobby", "3018")];

/// Who plans the motion of a machine: Annulus, step by step, or the machine's own controller from G-code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionPlanner {
    Annulus,
    Controller,
}

impl MotionPlanner {
    /// Of the built-in machine `name`.
    pub fn of(name: &str) -> Self {
        if mill(preset_name(name)).is_some() { Self::Controller } else { Self::Annulus }
    }

    /// Name in JSON.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Annulus => "annulus",
            Self::Controller => "controller",
        }
    }
}

/// Name of the virtual drill among the presets.
pub const VIRTUAL: &str = "virtual";

/// Built-in machines, each once, in the order of the lists that people choose from: the virtual drill, mills
/// with a controller, then machines that Annulus plans for step by step.
pub fn catalogue() -> impl Iterator<Item = &'static str> {
    let rest = presets().into_iter().map(|(name, _)| name);
    let rest = rest.filter(|name| *name != VIRTUAL && mill(name).is_none());
    std::iter::once(VIRTUAL).chain(MILLS.iter().map(|mill| mill.name)).chain(rest)
}

/// `machine` without its hardware, as the virtual drill plays it; `None` if it cannot.
pub fn played(machine: &Machine) -> Option<Machine> {
    settings::apply(&virtual_drill(), &settings::without_hardware(machine)).ok()
}

/// The preset name for an alias.
pub fn preset_name(called: &str) -> &str {
    CALLED.iter().find(|(word, _)| *word == called).map_or(called, |(_, name)| name)
}

/// All names and aliases of presets and mills.
pub fn preset_words() -> impl Iterator<Item = &'static str> {
    let presets = presets().into_iter().map(|(name, _)| name).chain(CALLED.map(|(word, _)| word));
    presets.chain(MILLS.iter().map(|mill| mill.name))
}

pub fn preset(name: &str) -> Option<Machine> {
    let name = preset_name(name);
    let own = presets().into_iter().find(|(known, _)| *known == name).map(|(_, machine)| machine);
    own.or_else(|| mill(name).map(|mill| mill.machine()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn catalogue_lists_every_machine_once() {
        let all: Vec<_> = catalogue().collect();
        let once: BTreeSet<_> = all.iter().copied().collect();
        let words: BTreeSet<_> = preset_words().map(preset_name).collect();
        assert_eq!((all.len(), &once), (once.len(), &words));
        assert_eq!(all[..2], ["virtual", "3018"]);
        assert_eq!(MotionPlanner::of("hobby"), MotionPlanner::Controller);
        assert_eq!(MotionPlanner::of("six"), MotionPlanner::Annulus);
    }

    #[test]
    fn virtual_drill_plays_every_machine() {
        for name in catalogue() {
            let (machine, played) = (preset(name).unwrap(), played(&preset(name).unwrap()).unwrap());
            assert_eq!((&played.name, &played.x, &played.rack), (&machine.name, &machine.x, &machine.rack));
            assert_eq!(played.process.feed_mm_per_s, machine.process.feed_mm_per_s, "{name}");
        }
    }
}
