//! Built-in machines by name: own ones, mills with common boards of STEP/DIR drivers, and mills with a
//! controller.

mod boards;
mod mills;
mod own;

use super::Machine;
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
