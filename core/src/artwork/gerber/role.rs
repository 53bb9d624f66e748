//! What a Gerber layer is for: X2 attribute, then names inside it, then the name of the file.
//!
//! Comes in: a layer and its file name. Goes out: role, side and the reason. Does not look at shapes.

use super::Gerber;
use crate::artwork::companion::base;
use crate::artwork::text::starts;
use crate::artwork::{Role, Side};
use crate::remark::{Remark, Weight};

/// A role with its side and the reason.
pub(in crate::artwork) struct Found {
    pub(in crate::artwork) role: Role,
    pub(in crate::artwork) side: Option<Side>,
    pub(in crate::artwork) plated: Option<bool>,
    pub(in crate::artwork) reason: Remark,
}

/// Finds the role of a layer.
pub(in crate::artwork) fn find(name: &str, gerber: &Gerber) -> Found {
    let reason = |code: &str, word: &str| Remark::new(Weight::Note, code).with("found", word);
    if let Some(function) = &gerber.file_function {
        let (role, side) = by_function(function);
        let plated = starts(function.as_bytes(), "NonPlated").then_some(false);
        let plated = plated.or(starts(function.as_bytes(), "Plated").then_some(true));
        return Found { role, side, plated, reason: reason("kind.gerber_x2", function) };
    }
    if let Some((role, side)) = gerber.layer_name.as_deref().and_then(by_words) {
        let shown = gerber.layer_name.as_deref().unwrap_or_default();
        return Found { role, side, plated: None, reason: reason("kind.gerber_layer_name", shown) };
    }
    let base = base(name);
    if let Some((role, side)) = by_ending(base).or_else(|| by_words(base)) {
        return Found { role, side, plated: None, reason: reason("kind.gerber_file_name", base) };
    }
    Found { role: Role::Other, side: None, plated: None, reason: reason("kind.gerber", "") }
}

fn by_function(function: &str) -> (Role, Option<Side>) {
    let fields: Vec<&str> = function.split(',').map(|field| field.trim().trim_end_matches('*')).collect();
    let side = fields.iter().find_map(|field| match *field {
        "Top" => Some(Side::Top),
        "Bot" => Some(Side::Bottom),
        "Inr" => Some(Side::Inner),
        _ => None,
    });
    let role = match fields.first().copied().unwrap_or_default() {
        "Copper" => Role::Copper,
        "Soldermask" => Role::Mask,
        "Legend" => Role::Silk,
        "Paste" => Role::Paste,
        "Profile" => Role::Outline,
        "Plated" | "NonPlated" => Role::Drill,
        _ => Role::Other,
    };
    (role, side)
}

/// Endings that mean one layer.
const ENDINGS: [(&str, Role, Option<Side>); 36] = {
    use Role::{Copper, Drill, Mask, Outline, Paste, Silk};
    const TOP: Option<Side> = Some(Side::Top);
    const BOTTOM: Option<Side> = Some(Side::Bottom);
    const INNER: Option<Side> = Some(Side::Inner);
    [
        ("gtl", Copper, TOP),
        ("gbl", Copper, BOTTOM),
        ("gts", Mask, TOP),
        ("gbs", Mask, BOTTOM),
        ("gto", Silk, TOP),
        ("gbo", Silk, BOTTOM),
        ("gtp", Paste, TOP),
        ("gbp", Paste, BOTTOM),
        ("gko", Outline, None),
        ("gm1", Outline, None),
        ("gm", Outline, None),
        ("outline", Outline, None),
        ("cmp", Copper, TOP),
        ("sol", Copper, BOTTOM),
        ("stc", Mask, TOP),
        ("sts", Mask, BOTTOM),
        ("plc", Silk, TOP),
        ("pls", Silk, BOTTOM),
        ("crc", Paste, TOP),
        ("crs", Paste, BOTTOM),
        ("top", Copper, TOP),
        ("bot", Copper, BOTTOM),
        ("g1", Copper, INNER),
        ("g2l", Copper, INNER),
        ("g3l", Copper, INNER),
        ("g4l", Copper, INNER),
        ("gp1", Copper, INNER),
        ("gp2", Copper, INNER),
        ("in1", Copper, INNER),
        ("in2", Copper, INNER),
        ("mil", Outline, None),
        ("dri", Drill, None),
        ("drl", Drill, None),
        ("xln", Drill, None),
        ("smt", Mask, TOP),
        ("smb", Mask, BOTTOM),
    ]
};

fn by_ending(base: &str) -> Option<(Role, Option<Side>)> {
    let ending = base.rsplit('.').next()?.to_ascii_lowercase();
    ENDINGS.iter().find(|(name, ..)| *name == ending).map(|&(_, role, side)| (role, side))
}

/// Words that mean copper.
const COPPER_WORDS: [&str; 10] = [
    "copper",
    "_cu",
    ".cu",
    "etch",
    "signal",
    "lyr",
    "component side",
    "solder side",
    "toplayer",
    "bottomlayer",
];
/// A side alone means its copper.
const SIDE_WORDS: [&str; 3] = ["top", "bottom", "bot"];

/// Roles and sides from words such as `F_Cu`, `Board Outline`, `EtchLayerTop`, `Top Solder Mask`.
fn by_words(text: &str) -> Option<(Role, Option<Side>)> {
    let text = text.to_ascii_lowercase();
    let any = |words: &[&str]| words.iter().any(|word| text.contains(word));
    let side = if any(&["top", "f_", "f.cu", "front"]) {
        Some(Side::Top)
    } else if any(&["bot", "b_", "b.cu", "back"]) {
        Some(Side::Bottom)
    } else {
        any(&["inner", "in1", "in2", "lyr2", "lyr3"]).then_some(Side::Inner)
    };
    let role = if any(&["outline", "edge", "profile", "boundary", "contour"]) {
        return Some((Role::Outline, None));
    } else if any(&["mask", "resist"]) {
        Role::Mask
    } else if any(&["silk", "legend", "overlay"]) {
        Role::Silk
    } else if any(&["paste", "stencil"]) {
        Role::Paste
    } else if any(&["drl", "drill"]) {
        return Some((Role::Drill, None));
    } else if any(&COPPER_WORDS)
        || text.split(|c: char| !c.is_ascii_alphabetic()).any(|part| SIDE_WORDS.contains(&part))
    {
        Role::Copper
    } else {
        return None;
    };
    Some((role, side))
}
