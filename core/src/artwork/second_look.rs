//! A second look at holes of which not all lie on the copper: are they shifted, or is one of both mirrored?
//!
//! ```text
//!   holes  ● ●   ●      on pads by chance    ─▶ moved by one vector clearly more of them are: shifted
//!   pads  ◎ ◎   ◎
//!
//!   holes  ●   ● ●                           ─▶ turned over clearly more of them are: one of both is mirrored
//!   pads   ◎ ◎   ◎
//! ```
//!
//! Comes in: holes under the reading that was chosen, with the tools that drill them, and the copper. Goes out: how they fit,
//! and what to say, in shares from 0 to 1. Moves nothing and turns nothing over.

use super::registration::{Copper, FITS_SHARE, Fit, Layer, fit_shifted, share};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use std::collections::BTreeMap;

/// Holes of which fewer lie on copper are looked at again.
const SURE_SHARE: f64 = 0.95;
/// A shift that puts so many more of the holes on copper is meant.
const CLEARLY_SHARE: f64 = 0.15;
/// And any that puts so many there, where fewer were.
const NEARLY_ALL_SHARE: f64 = 0.98;
/// Turned over so many of the holes lie on copper, or it is chance.
const MIRRORED_SHARE: f64 = 0.9;
/// And so many more than as they are.
const MUCH_SHARE: f64 = 0.3;
/// Holes of tools for pads of which fewer lie on copper are doubted: vias may lie in areas, which are not looked at.
const WELL_SHARE: f64 = 0.9;
/// Fewer holes prove nothing.
const FEWEST: usize = 10;

/// What was seen.
pub(super) struct Look {
    /// How the holes fit.
    pub(super) fit: Fit,
    /// What to say of it, without a place.
    pub(super) warnings: Vec<Diagnostic>,
}

/// Looks again at `holes` that fit `copper` as `fit` says. `tools` are those of single holes: ends of slots and corners of
/// routes need not lie on copper.
pub(super) fn look(copper: &Copper, holes: &[Point], tools: &[Option<u16>], fit: Fit) -> Look {
    let mut look = Look { fit, warnings: Vec::new() };
    if holes.len() < FEWEST {
        return look;
    }
    let still = fit.shift_mm == (0.0, 0.0);
    if still && fit.share < SURE_SHARE {
        let shifted = copper.fit_shifted(holes);
        if shifted.share >= (fit.share + CLEARLY_SHARE).clamp(FITS_SHARE, NEARLY_ALL_SHARE) {
            look.fit = shifted;
        }
    }
    if look.fit.share < SURE_SHARE
        && let Some((word, share)) = mirrored(|holes| copper.fit_shifted(holes), holes, look.fit.share)
    {
        look.fit = copper.fit(holes);
        look.warnings.push(told("drill.mirrored", look.fit.share, share).with("axis", word));
        return look;
    }
    look.warnings.extend(copper.apart().iter().filter_map(|layer| alone(layer, holes, look.fit)));
    let common = common(copper, holes, tools, look.fit);
    if look.fit.share < SURE_SHARE && common < WELL_SHARE {
        look.warnings.push(told("drill.beside_copper", common, look.fit.share));
    }
    look
}

/// Says of one layer of several that only turned over the holes fit it that fit the others.
fn alone(layer: &Layer, holes: &[Point], fit: Fit) -> Option<Diagnostic> {
    let layers = std::slice::from_ref(layer);
    let own = share(layers, holes, fit.shift_mm);
    if own >= FITS_SHARE || fit.share < MIRRORED_SHARE {
        return None;
    }
    let (word, share) = mirrored(|holes| fit_shifted(layers, holes), holes, own)?;
    Some(told("drill.layer_mirrored", own, share).with("axis", word).with("layer", &layer.name))
}

/// The way in which the holes turned over fit much better than `own`, and how well.
fn mirrored(fit: impl Fn(&[Point]) -> Fit, holes: &[Point], own: f64) -> Option<(&'static str, f64)> {
    let in_x = |at: &Point| Point::new(-at.x, at.y);
    let in_y = |at: &Point| Point::new(at.x, -at.y);
    let ways: [(_, Vec<Point>); 2] =
        [("X", holes.iter().map(in_x).collect()), ("Y", holes.iter().map(in_y).collect())];
    ways.into_iter().find_map(|(word, turned)| {
        let share = fit(&turned).share;
        (share >= (own + MUCH_SHARE).clamp(MIRRORED_SHARE, NEARLY_ALL_SHARE)).then_some((word, share))
    })
}

/// The share on copper of the holes whose tools put most of theirs there, for tools for mounting holes hit none; where no
/// tool does, that of all. All where there are too few.
fn common(copper: &Copper, holes: &[Point], tools: &[Option<u16>], fit: Fit) -> f64 {
    let mut of_tool: BTreeMap<u16, (usize, usize)> = BTreeMap::new();
    for (hole, tool) in holes.iter().zip(tools).filter_map(|(hole, tool)| Some((hole, (*tool)?))) {
        let (on, all) = of_tool.entry(tool).or_default();
        *on += usize::from(copper.has(*hole, fit.shift_mm));
        *all += 1;
    }
    let most: Vec<_> = of_tool.values().filter(|(on, all)| 2 * on > *all).collect();
    let counted: Vec<&(usize, usize)> = if most.is_empty() { of_tool.values().collect() } else { most };
    let (on, all) = counted.into_iter().fold((0, 0), |sum, (on, all)| (sum.0 + on, sum.1 + all));
    if all < FEWEST { 1.0 } else { on as f64 / all as f64 }
}

fn told(code: &str, own: f64, other: f64) -> Diagnostic {
    let percent = |share: f64| format!("{:.0}", share * 100.0);
    Diagnostic::warning(code).with("own", percent(own)).with("other", percent(other))
}

#[cfg(test)]
mod tests {
    use crate::artwork::{FileRead, Overrides, read_set};
    use crate::diagnostic::Severity;

    type Places = Vec<(f64, f64)>;

    /// A layer with a pad at every place.
    fn layer(function: &str, places: &[(f64, f64)]) -> Vec<u8> {
        let flash = |(x, y): &(f64, f64)| format!("X{:.0}Y{:.0}D03*", x * 1e6, y * 1e6);
        let flashes: String = places.iter().map(flash).collect();
        format!("%FSLAX46Y46*%%MOMM*%%TF.FileFunction,{function}*%%ADD10C,1*%D10*{flashes}M02*").into_bytes()
    }

    /// A program of holes by two tools, the second for mounting.
    fn program(places: &[(f64, f64)], mounting: &[(f64, f64)]) -> Vec<u8> {
        let hits =
            |all: &[(f64, f64)]| -> String { all.iter().map(|(x, y)| format!("X{x:.3}Y{y:.3}\n")).collect() };
        let (pads, beside) = (hits(places), hits(mounting));
        format!("M48\nMETRIC,TZ\nT1C0.800\nT2C3.2\n%\nT1\n{pads}T2\n{beside}M30\n").into_bytes()
    }

    fn read(layers: &[(&str, &Places)], holes: &[(f64, f64)], mounting: &[(f64, f64)]) -> FileRead {
        let copper = layers.iter().map(|(function, places)| {
            (format!("{}.gbr", function.replace(',', "-")), layer(function, places))
        });
        let files: Vec<_> = copper.chain([("b.drl".to_owned(), program(holes, mounting))]).collect();
        read_set(&files, &Overrides::default()).files.pop().unwrap()
    }

    fn warnings(file: &FileRead) -> Vec<&str> {
        let warnings = file.diagnostics.iter().filter(|diagnostic| diagnostic.severity == Severity::Warning);
        warnings.map(|diagnostic| diagnostic.code.as_str()).collect()
    }

    /// Rows of pins, and some pads in no row.
    fn pins() -> Places {
        let rows =
            (0..4).flat_map(|row| (0..12).map(move |pin| (f64::from(pin) * 2.54, f64::from(row) * 7.62)));
        let odd =
            (0..9).map(|at| (f64::from(at * 7 % 31) * 0.91 + 0.4, f64::from(at * at % 53) * 0.37 + 0.9));
        rows.chain(odd).collect()
    }

    #[test]
    fn a_shift_is_found_though_most_holes_are_on_copper_by_chance() {
        let (pads, beside) = (pins(), [(-3.0, -3.0), (31.0, -3.0), (31.0, 26.0)]);
        for (x, y) in [(0.0, 0.0), (2.54, 0.0), (-2.54, 0.0), (0.0, 7.62), (5.08, 0.0), (2.0, 0.3)] {
            for mounting in [&beside[..], &[]] {
                let moved =
                    |all: &[(f64, f64)]| all.iter().map(|at| (at.0 + x, at.1 + y)).collect::<Places>();
                let file = read(&[("Copper,L1,Top", &pads)], &moved(&pads), &moved(mounting));
                let by = file.evidence.as_ref().unwrap().shift_mm;
                assert_eq!(by.is_some(), (x, y) != (0.0, 0.0), "{x} {y} {:?}", file.evidence);
                let near = |by: (f64, f64)| (by.0 + x).abs() < 1e-3 && (by.1 + y).abs() < 1e-3;
                assert!(by.is_none_or(near), "{x} {y} {by:?}");
                assert_eq!(warnings(&file), Vec::<&str>::new(), "{x} {y}");
            }
        }
    }

    #[test]
    fn what_is_mirrored_is_said_and_which_layer() {
        let pads = pins();
        let turned = |all: &Places, x: f64, y: f64| -> Places {
            all.iter().map(|at| (x + at.0 * x.signum(), y + at.1 * y.signum())).collect()
        };
        let (in_x, in_y) = (turned(&pads, -40.0, 3.0), turned(&pads, 3.0, -40.0));
        for (holes, axis) in [(&in_x, "mirrored in X"), (&in_y, "mirrored in Y")] {
            let file = read(&[("Copper,L1,Top", &pads)], holes, &[]);
            assert_eq!(warnings(&file), ["drill.mirrored"], "{:?}", file.diagnostics);
            assert_eq!(file.evidence.as_ref().unwrap().shift_mm, None);
            let warning =
                file.diagnostics.iter().find(|diagnostic| diagnostic.code == "drill.mirrored").unwrap();
            let sentence = warning.message("en");
            assert!(sentence.contains(axis) && !sentence.contains('{'), "{sentence}");
        }
        let two = read(&[("Copper,L1,Top", &pads), ("Copper,L2,Bot", &in_x)], &pads, &[]);
        assert_eq!(warnings(&two), ["drill.layer_mirrored"], "{:?}", two.diagnostics);
        let sentence = two.diagnostics.iter().map(|diagnostic| diagnostic.message("en")).collect::<String>();
        assert!(sentence.contains("Copper-L2-Bot.gbr") && !sentence.contains('{'), "{sentence}");
        let right = read(&[("Copper,L1,Top", &pads), ("Copper,L2,Bot", &pads)], &pads, &[]);
        assert_eq!(warnings(&right), Vec::<&str>::new());
    }

    #[test]
    fn holes_of_another_state_of_the_board_are_doubted_and_mounting_holes_are_not() {
        let pads = pins();
        let beside = [(-3.0, -3.0), (31.0, -3.0), (31.0, 26.0), (-3.0, 26.0), (14.2, 26.0)];
        let right = read(&[("Copper,L1,Top", &pads)], &pads, &beside);
        assert_eq!(warnings(&right), Vec::<&str>::new(), "{:?}", right.evidence);
        let mut other = pads.clone();
        other.iter_mut().step_by(3).for_each(|at| *at = (at.0 + at.1 * 0.13 + 0.9, at.1 + at.0 * 0.07 + 1.1));
        let file = read(&[("Copper,L1,Top", &pads)], &other, &beside);
        assert_eq!(warnings(&file), ["drill.beside_copper"], "{:?}", file.evidence);
        assert!(file.diagnostics.iter().all(|diagnostic| !diagnostic.message("en").contains('{')));
    }
}
