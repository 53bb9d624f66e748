//! What one layer says it is for: its X2 attribute, the names inside it, what its apertures are for; and words in names.
//!
//! Comes in: a layer, or a text. Goes out: a role and a side. Does not look at shapes, nor at other layers.

use super::{Gerber, Role, Side};

/// By the X2 file function.
pub(super) fn by_function(function: &str) -> (Role, Option<Side>) {
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

/// By the functions of apertures and contours, where the layer has no file function: the word that told.
pub(super) fn by_content(gerber: &Gerber) -> Option<(Role, &'static str)> {
    const WORDS: [(&str, Role); 6] = [
        ("Profile", Role::Outline),
        ("Conductor", Role::Copper),
        ("ComponentPad", Role::Copper),
        ("SMDPad", Role::Copper),
        ("ViaPad", Role::Copper),
        ("ComponentDrill", Role::Drill),
    ];
    let apertures = gerber.apertures.iter().filter_map(|aperture| aperture.function.as_deref());
    let tags = gerber.tags.iter().filter_map(|tag| tag.function.as_deref());
    let functions: Vec<&str> = apertures.chain(tags).collect();
    let told = |(word, _): &&(&str, Role)| functions.iter().any(|function| function.starts_with(word));
    WORDS.iter().find(told).map(|&(word, role)| (role, word))
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

/// By words such as `F_Cu`, `Board Outline`, `EtchLayerTop`, `Top Solder Mask`.
pub(super) fn by_words(text: &str) -> Option<(Role, Option<Side>)> {
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
