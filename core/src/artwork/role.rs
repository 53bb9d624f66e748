//! Determines the role of one layer from its content and its name, and what is known about each layer until
//! then. A source that gives only role or side leaves the rest to the next one.
//!
//! ```text
//!   X2 file function ─▶ names inside the layer ─▶ aperture functions ─▶ CAD name tables ─▶ words in name
//!     role ✓ side ·       role ✓ side ·            role ✓             role ✓ side ✓ ◀── side is from here
//! ```

use super::layer_shape::Shape;
use super::layer_words::{Said, said};
use super::names::{Meaning, meanings};
use super::{FileRead, Gerber, Role, Side};
use crate::diagnostic::Diagnostic;
use crate::units::Length;
use crate::{code, note};
use std::collections::BTreeMap;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Ground {
    Nothing,
    /// A side or a number in a name.
    Side,
    /// A word in the name.
    Words,
    /// A name that a CAD gives.
    Names,
    /// A name inside the layer, or its aperture functions.
    Content,
    /// The X2 file function.
    Attribute,
}

#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) role: Role,
    pub(super) side: Option<Side>,
    pub(super) number: Option<u32>,
    pub(super) unsure: bool,
    /// Two certain sources give different sides.
    pub(super) is_disputed: bool,
    /// A certain reason names another side than a layer number, counted from 1, does.
    pub(super) is_numbered_otherwise: bool,
    pub(super) ground: Ground,
    pub(super) reason: Diagnostic,
}

struct Reason {
    ground: Ground,
    said: Said,
    why: Diagnostic,
}

/// The role and side of the layer `name`. `own` is `name` without the prefix that all files of the folder
/// share. `inside` is the name of its folder, empty if all files are in it. `cads` counts the names of the
/// folder that each CAD would write.
pub(super) fn find(
    [name, own, inside]: [&str; 3],
    gerber: &Gerber,
    cads: &BTreeMap<&'static str, usize>,
) -> Found {
    let why = |code: &str, word: &str| Diagnostic::note(code).with("found", word);
    let mut reasons = Vec::new();
    if let Some((function, said)) =
        gerber.file_function.as_deref().and_then(|text| Some((text, by_function(text)?)))
    {
        reasons.push(Reason { ground: Ground::Attribute, said, why: why(code!("kind.gerber_x2"), function) });
    }
    if let Some(inside) = gerber.layer_name.as_deref() {
        let why = why(code!("kind.gerber_layer_name"), inside);
        reasons.push(Reason { ground: Ground::Content, said: by_layer_name(inside), why });
    }
    if let Some((role, word)) = by_content(gerber) {
        let said = Said { role: Some(role), explicit: true, ..Said::default() };
        reasons.push(Reason {
            ground: Ground::Content,
            said,
            why: why(code!("kind.gerber_functions"), word),
        });
    }
    let votes = |meaning: &Meaning| cads.get(meaning.cad).copied().unwrap_or(0);
    if let Some(Meaning { cad, role, side }) = meanings(name).into_iter().rev().max_by_key(votes) {
        let said = Said { role: Some(role), side, explicit: true, ..Said::default() };
        let why = why(code!("kind.gerber_cad_name"), name).with("cad", cad);
        reasons.push(Reason { ground: Ground::Names, said, why });
    }
    let why = why(code!("kind.gerber_file_name"), name);
    reasons.push(Reason { ground: Ground::Words, said: said(own), why: why.clone() });
    // Words that start all names are the board's name, but a side among them can be meant.
    let all = said(name);
    let said = Said { role: None, number: None, unsure: all.side.is_some(), explicit: false, ..all };
    reasons.push(Reason { ground: Ground::Side, said, why });
    let Said { side, unsure, .. } = super::layer_words::said(inside);
    let said = Said { side: side.filter(|_| !unsure), ..Said::default() };
    let why = note!("kind.gerber_file_name", found = inside);
    reasons.push(Reason { ground: Ground::Side, said, why });
    weighed(&reasons)
}

/// The role of the best source, and the side and number of the best source for that role.
fn weighed(reasons: &[Reason]) -> Found {
    let named = reasons.iter().find(|reason| reason.said.explicit && reason.said.role.is_some());
    let by_side = reasons.iter().find(|reason| reason.said.role.is_some());
    let Some(first) = named.or(by_side) else {
        let reason = note!("kind.gerber").with("found", "");
        let (role, side, number) = (Role::Other, None, None);
        return Found {
            role,
            side,
            number,
            unsure: false,
            is_disputed: false,
            is_numbered_otherwise: false,
            ground: Ground::Nothing,
            reason,
        };
    };
    let role = first.said.role.unwrap_or(Role::Other);
    let of_role = |reason: &&Reason| !reason.said.explicit || reason.said.role == Some(role);
    let sides = || reasons.iter().filter(of_role).filter(|reason| reason.said.side.is_some());
    let sure = sides().find(|reason| !reason.said.unsure);
    let side = sure.or_else(|| sides().next()).and_then(|reason| reason.said.side);
    let ground = if first.said.explicit { first.ground } else { first.ground.min(Ground::Side) };
    Found {
        role,
        side: side.filter(|_| !matches!(role, Role::Outline | Role::Drill)),
        number: reasons.iter().filter(of_role).find_map(|reason| reason.said.number),
        unsure: side.is_some() && sure.is_none(),
        is_disputed: role == Role::Copper && is_disputed(reasons.iter().filter(of_role), false),
        is_numbered_otherwise: role == Role::Copper && is_disputed(reasons.iter().filter(of_role), true),
        ground,
        reason: first.why.clone(),
    }
}

/// Whether certain reasons name both sides of the board. If numbers count too, layer 1 is the top and any other is not.
fn is_disputed<'r>(reasons: impl Iterator<Item = &'r Reason>, with_numbers: bool) -> bool {
    let [mut top, mut bottom] = [false; 2];
    for reason in reasons.filter(|reason| reason.ground >= Ground::Words && !reason.said.unsure) {
        let number = reason.said.number.filter(|_| with_numbers && reason.said.side.is_none());
        let first = number.map(|number| number == 1);
        top |= reason.said.side == Some(Side::Top) || first == Some(true);
        bottom |= reason.said.side == Some(Side::Bottom) || first == Some(false);
    }
    top && bottom
}

/// From the X2 file function; none if the word isn't from X2.
fn by_function(function: &str) -> Option<Said> {
    /// X2 functions that are not a layer of the board here.
    const OTHERS: [&str; 21] = [
        "Component",
        "Glue",
        "Carbonmask",
        "Goldmask",
        "Heatsinkmask",
        "Peelablemask",
        "Silvermask",
        "Tinmask",
        "Depthrout",
        "Vcut",
        "Viafill",
        "Pads",
        "Other",
        "AssemblyDrawing",
        "ArrayDrawing",
        "Drillmap",
        "FabricationDrawing",
        "Vcutmap",
        "OtherDrawing",
        "Drawing",
        "JobInfo",
    ];
    let fields: Vec<&str> = function.split(',').map(|field| field.trim().trim_end_matches('*')).collect();
    let is = |field: &str, word: &str| field.eq_ignore_ascii_case(word);
    let side = fields.iter().find_map(|field| match *field {
        field if is(field, "Top") => Some(Side::Top),
        field if is(field, "Bot") || is(field, "Bottom") => Some(Side::Bottom),
        field if is(field, "Inr") => Some(Side::Inner),
        _ => None,
    });
    let number = fields.iter().find_map(|field| field.strip_prefix(['L', 'l'])?.parse().ok());
    let first = fields.first().copied().unwrap_or_default();
    let roles = [
        ("Copper", Role::Copper),
        ("Soldermask", Role::Mask),
        ("Legend", Role::Silk),
        ("Paste", Role::Paste),
        ("Profile", Role::Outline),
        ("Plated", Role::Drill),
        ("NonPlated", Role::Drill),
    ];
    let role = roles.iter().find(|(word, _)| is(first, word)).map(|(_, role)| *role);
    let role = role.or_else(|| OTHERS.iter().any(|word| is(first, word)).then_some(Role::Other));
    let number = number.filter(|_| role == Some(Role::Copper));
    role.map(|role| Said { role: Some(role), side, number, explicit: true, unsure: false })
}

/// From the layer's name inside the file. In a title, only the end is about the layer.
fn by_layer_name(name: &str) -> Said {
    // Fritzing counts from the bottom. The file name gives the side more reliably, so this is marked as
    // unsure.
    let copper = |side| Said {
        role: Some(Role::Copper),
        side: Some(side),
        explicit: true,
        unsure: true,
        number: None,
    };
    if name.eq_ignore_ascii_case("COPPER0") {
        return copper(Side::Bottom);
    } else if name.eq_ignore_ascii_case("COPPER1") {
        return copper(Side::Top);
    }
    let is_title = name.get(..5).is_some_and(|word| word.eq_ignore_ascii_case("title"));
    said(name.rsplit(',').next().filter(|_| is_title).unwrap_or(name))
}

/// From the functions of apertures and contours, if there is no file function. Also returns the word.
fn by_content(gerber: &Gerber) -> Option<(Role, &'static str)> {
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

/// The layers of a set, in the order of its files; `None` for other files.
pub(super) type Layers = [Option<FileRead>];

/// Tolerance for copper outside its board's outline.
pub(super) const OVERHANG: Length = Length::from_um(1_000);

/// How a layer's drawing contradicts a name that means copper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Contradiction {
    /// It has no tracks. Its role stays copper.
    PadsAlone,
    /// Its strokes and contours miss all holes. Its role stays copper.
    MissesHoles,
    /// It is a mask or paste. The name gives this side.
    Opening(Option<Side>),
    /// No hole is on it, and only its layer number means copper. The role becomes other.
    Nothing,
}

pub(super) struct Row {
    pub(super) index: usize,
    pub(super) ground: Ground,
    pub(super) unsure: bool,
    /// Two certain sources give different sides.
    pub(super) is_disputed: bool,
    /// A certain reason names another side than its number, counted from 1.
    pub(super) is_numbered_otherwise: bool,
    pub(super) number: Option<u32>,
    /// Words of its board's name.
    pub(super) stem: Vec<String>,
    /// By their names, the drill files of its folder belong to one board.
    pub(super) one_board: bool,
    /// Measured only if needed.
    pub(super) shape: Option<Shape>,
    /// How its drawing contradicts a name that means copper.
    pub(super) contradiction: Option<Contradiction>,
    /// Lost the role of copper because of its drawing.
    pub(super) is_drawn_otherwise: bool,
}

impl Row {
    /// True if both can belong to one board: by their names, or because only words give their roles and the
    /// folder has the drill files of one board.
    pub(super) fn is_kin(&self, other: &Self) -> bool {
        let weak = self.ground.min(other.ground) <= Ground::Words;
        self.stem.iter().zip(&other.stem).all(|(a, b)| a == b) || self.one_board && weak
    }
}
