//! Fixes for a gap that is not cut: a narrower tool, the V-bit less deep, or one centred pass.
//!
//! ```text
//!    net A ███│  gap  │███ net B
//!              ╲     ╱               narrower tool, or V-bit less deep: fits
//!          ██╲    ┆    ╱██           centred pass: removes equal widths on both sides
//! ```

use super::finding::Cure;
use super::scene::Scene;
use crate::job::{Bit, Cutter};
use crate::units::Length;

fn mills(bit: &Bit) -> bool {
    bit.cutter != Cutter::Drill
}

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
    // The widest that fits.
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

/// The fix for a cut that does not go through.
pub(super) fn for_shallow(scene: &Scene<'_>, bit: &Bit) -> Cure {
    let depth = scene.options.copper_thickness + scene.options.depth_margin;
    Cure::Deeper { bit: bit.name.clone(), depth, width: bit.width_at(depth) }
}
