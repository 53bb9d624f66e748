//! Parses the roles of layers from the command line (`--role FILE=ROLE`).

use crate::refusal::Refusal;
use annulus_core::artwork::{Artwork, FileRead, Role, Side, is_end_of_path};
use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;

/// The name of a file, its role and its side, as in `SaidOfFiles`.
type LayerRole = (String, String, Option<String>);

/// The roles that `texts` give to layers of `artwork`.
pub(super) fn of(texts: &[String], artwork: &Artwork) -> Result<Vec<LayerRole>, Refusal> {
    texts.iter().map(|text| one(text, artwork)).collect()
}

fn one(text: &str, artwork: &Artwork) -> Result<LayerRole, Refusal> {
    let usage = |code: &str| Diagnostic::error(code).with("found", text);
    let parts = text.rsplit_once('=');
    let known = parts.and_then(|(file, words)| Some((file, role(words)?)));
    let Some((file, (role, side))) = known else { return Err(Refusal::usage(usage(code!("cli.bad_role")))) };
    let layers = || artwork.files.iter().filter(|layer| layer.gerber.is_some());
    let exact = |layer: &&FileRead| layer.name == file;
    let path = file.replace('\\', "/");
    let called =
        |layer: &&FileRead| is_end_of_path(&layer.name.replace('\\', "/"), path.trim_start_matches("./"));
    let mut found: Vec<&FileRead> = layers().filter(exact).collect();
    if found.is_empty() {
        found = layers().filter(called).collect();
    }
    let names = |layers: Vec<&FileRead>| -> String {
        layers.iter().map(|layer| layer.name.as_str()).collect::<Vec<_>>().join(", ")
    };
    match found.as_slice() {
        [layer] => Ok((layer.name.clone(), role.name().to_owned(), side.map(|side| side.name().to_owned()))),
        [] => {
            Err(Refusal::usage(usage(code!("cli.role_of_no_layer")).with("names", names(layers().collect()))))
        }
        _ => Err(Refusal::usage(usage(code!("cli.role_of_several")).with("names", names(found)))),
    }
}

/// Parses a role and its side: `top-copper`, `copper-top`, `outline`. Copper needs a side. `drill` is refused, because holes come from
/// drill files.
fn role(words: &str) -> Option<(Role, Option<Side>)> {
    let words = words.trim().to_ascii_lowercase();
    let (role, side) = match words.split_once('-') {
        None => (Role::named(&words)?, None),
        Some((one, other)) => match (Side::named(one), Side::named(other)) {
            (Some(side), None) => (Role::named(other)?, Some(side)),
            (None, Some(side)) => (Role::named(one)?, Some(side)),
            _ => return None,
        },
    };
    let fits = match role {
        Role::Copper => side.is_some(),
        Role::Mask | Role::Silk | Role::Paste => true,
        Role::Outline | Role::Other => side.is_none(),
        Role::Drill => false,
    };
    fits.then_some((role, side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_parts_at_the_end_of_a_path_match() {
        for (end, fits) in [
            ("copper.gbr", true),
            ("top/copper.gbr", true),
            ("in/board.zip!/top/copper.gbr", true),
            ("op/copper.gbr", false),
            ("bottom/copper.gbr", false),
            ("", false),
        ] {
            assert_eq!(is_end_of_path("in/board.zip!/top/copper.gbr", end), fits, "{end}");
        }
    }

    #[test]
    fn copper_needs_a_side_and_outlines_have_none() {
        for (words, wanted) in [
            ("top-copper", Some((Role::Copper, Some(Side::Top)))),
            ("copper-bottom", Some((Role::Copper, Some(Side::Bottom)))),
            ("Inner-Copper", Some((Role::Copper, Some(Side::Inner)))),
            ("outline", Some((Role::Outline, None))),
            ("mask", Some((Role::Mask, None))),
            ("copper", None),
            ("drill", None),
            ("top", None),
            ("top-outline", None),
            ("top-bottom", None),
            ("top-copper-2", None),
        ] {
            assert_eq!(role(words), wanted, "{words}");
        }
    }
}
