//! What would cure a gap that is not cut: a narrower bit, the same V-bit less deep, or one pass in the middle.
//!
//! ```text
//!    net A ███│  gap  │███ net B
//!              ╲     ╱               narrower bit, or a V-bit less deep: fits
//!          ██╲    ┆    ╱██           centred pass: takes the same off both sides
//! ```
//!
//! Comes in: the gap's width, the bits of the programs and the bits owned. Goes out: [`Cure`]s as data. Does not apply
//! them.

use super::scene::Scene;
use crate::job::{Bit, Cutter};
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// Something that would cure a finding.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(tag = "cure", rename_all = "snake_case")]
pub enum Cure {
    /// A V-bit of the program, less deep there.
    Shallower {
        /// Its name.
        bit: String,
        /// Depth of the tip.
        depth: Length,
        /// What it then cuts at the surface.
        width: Length,
    },
    /// A bit that is owned and fits.
    OtherBit {
        /// Its index in the list of owned bits.
        owned: u32,
        /// Its name.
        bit: String,
        /// Depth of the tip: for a V-bit the depth that gives the width, else the least that goes through.
        depth: Length,
        /// What it then cuts at the surface.
        width: Length,
    },
    /// One pass in the middle of the gap with the narrowest bit of the program.
    Centred {
        /// Its name.
        bit: String,
        /// Depth of the tip.
        depth: Length,
        /// What it then cuts at the surface.
        width: Length,
        /// Copper lost on each side.
        lost: Length,
    },
    /// The same cut, deeper.
    Deeper {
        /// Name of the bit.
        bit: String,
        /// Depth of the tip.
        depth: Length,
        /// What it then cuts at the surface.
        width: Length,
    },
}

/// Whether a bit may be dragged sideways.
fn mills(bit: &Bit) -> bool {
    bit.cutter != Cutter::Drill
}

/// What would cure a gap of this width that is not cut.
pub(super) fn for_gap(scene: &Scene<'_>, gap: Length) -> Vec<Cure> {
    let options = scene.options;
    let least = options.copper_thickness + options.depth_margin;
    let mut used: Vec<&Bit> = scene.bits_used.iter().copied().filter(|bit| mills(bit)).collect();
    used.sort_by_key(|bit| (bit.width_at(least), bit.name.clone()));
    let mut cures = Vec::new();
    let vee = |bit: &&&Bit| matches!(bit.cutter, Cutter::Vee { .. });
    if let Some((bit, (depth, width))) =
        used.iter().filter(vee).find_map(|bit| Some((bit, bit.fitting(gap, least)?)))
    {
        cures.push(Cure::Shallower { bit: bit.name.clone(), depth, width });
    }
    let owned = (0..).zip(&options.owned).filter(|(_, bit)| !used.contains(bit));
    let fits = owned.filter_map(|(index, bit): (u32, &Bit)| {
        let (depth, width) = bit.fitting(gap, least)?;
        Some((bit.width_at(least), Cure::OtherBit { owned: index, bit: bit.name.clone(), depth, width }))
    });
    // The stoutest that fits.
    cures.extend(fits.max_by(|a, b| a.0.cmp(&b.0).then_with(|| b.1.cmp(&a.1))).map(|(_, cure)| cure));
    if let Some(bit) = used.first() {
        let width = bit.width_at(least);
        if width > gap {
            let lost = Length::from_nm((width - gap).nm() / 2);
            cures.push(Cure::Centred { bit: bit.name.clone(), depth: least, width, lost });
        }
    }
    cures
}

/// What would cure a cut that does not go through.
pub(super) fn for_shallow(scene: &Scene<'_>, bit: &Bit) -> Cure {
    let depth = scene.options.copper_thickness + scene.options.depth_margin;
    Cure::Deeper { bit: bit.name.clone(), depth, width: bit.width_at(depth) }
}
