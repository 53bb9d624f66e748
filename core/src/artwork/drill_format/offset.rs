//! Diagnoses holes that are not all on copper: are they shifted, or is one of both mirrored? Only reports;
//! changes no coordinates.
//!
//! ```text
//!   holes  ● ●   ●      few on pads    ─▶ clearly more on pads when shifted by one vector: shifted
//!   pads  ◎ ◎   ◎
//!
//!   holes  ●   ● ●                     ─▶ clearly more on pads when flipped: one of both is mirrored
//!   pads   ◎ ◎   ◎
//! ```

use crate::artwork::registration::{Copper, FITS_SHARE, Fit, Layer, fit_shifted, pad_share, share};
use crate::code;
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::Point;
use std::collections::BTreeMap;

/// At or above this share on copper, holes need no second look.
const SURE_SHARE: f64 = 0.95;
/// A shift is accepted if it puts this share more of the holes on copper.
const CLEARLY_SHARE: f64 = 0.15;
/// A shift to this share is always accepted.
const NEARLY_ALL_SHARE: f64 = 0.98;
/// Minimum share on copper when flipped; less can be chance.
const MIRRORED_SHARE: f64 = 0.9;
/// Flipping must also improve the share by this much.
const MUCH_SHARE: f64 = 0.3;
/// Below this share on copper, the holes of pad tools get a warning. Lower than 1, because vias can be in
/// areas, which are not checked.
const WELL_SHARE: f64 = 0.9;
/// Fewer holes prove nothing, unless all of them agree.
const FEWEST: usize = 10;
/// Fewer holes never prove anything.
const LEAST: usize = 4;
/// With few holes: if more than this share are on pads, they fit as they are.
const HALF_SHARE: f64 = 0.5;
/// With few holes: if at most this share are on copper, they don't fit.
const HARDLY_SHARE: f64 = 0.25;
/// From this number of holes on, up to [`NEARLY_SHARE`] may be on pads by symmetry, and the copper still
/// counts as mirrored.
const SOME: usize = 6;
const NEARLY_SHARE: f64 = 0.8;

pub(super) struct Look {
    pub(super) fit: Fit,
    /// Diagnostics, still without position.
    pub(super) warnings: Vec<Diagnostic>,
}

/// Examines `holes` with this `fit` on `copper`. `tools` are those of single holes, because slot ends and
/// route vertices needn't be on copper.
pub(super) fn look(copper: &Copper, holes: &[Point], tools: &[Option<u16>], fit: Fit) -> Look {
    let mut look = Look { fit, warnings: Vec::new() };
    if holes.len() < FEWEST {
        look.warnings = look_at_few(copper, holes, fit);
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
        look.warnings.push(told(code!("drill.mirrored"), look.fit.share, share).with("axis", word));
        return look;
    }
    look.warnings.extend(copper.apart().iter().filter_map(|layer| alone(layer, holes, look.fit)));
    let common = common(copper, holes, tools, look.fit);
    if look.fit.share < SURE_SHARE && common < WELL_SHARE {
        look.warnings.push(told(code!("drill.beside_copper"), common, look.fit.share));
    }
    look
}

/// Examines 4 to 9 holes. Reports mirrored copper only if all of them are on its pads when flipped, and
/// missing copper only if hardly any is on copper.
fn look_at_few(copper: &Copper, holes: &[Point], fit: Fit) -> Vec<Diagnostic> {
    if holes.len() < LEAST {
        return Vec::new();
    }
    let by = fit.shift_mm;
    let own = pad_share(copper.layers(), holes, by);
    if let Some(word) = few_mirrored(copper.layers(), holes, own) {
        return vec![told(code!("drill.mirrored"), own, 1.0).with("axis", word)];
    }
    let whole = own >= MIRRORED_SHARE;
    let alone = |layer: &Layer| {
        let layers = std::slice::from_ref(layer);
        let own = pad_share(layers, holes, by);
        let word = few_mirrored(layers, holes, own).filter(|_| whole)?;
        Some(told(code!("drill.layer_mirrored"), own, 1.0).with("axis", word).with("layer", &layer.name))
    };
    let mut said: Vec<Diagnostic> = copper.apart().iter().filter_map(alone).collect();
    let shifted = copper.fit_shifted(holes).share;
    if fit.share <= HARDLY_SHARE && shifted <= HALF_SHARE && copper.has_pads() {
        said.push(told(code!("drill.beside_copper"), fit.share, fit.share));
    }
    said
}

/// The axis in which all of a few holes are on pads when flipped; none if they fit as they are or shifted.
fn few_mirrored(layers: &[Layer], holes: &[Point], own: f64) -> Option<&'static str> {
    let on_pads = |holes: &[Point]| pad_share(layers, holes, fit_shifted(layers, holes).shift_mm);
    let most = if holes.len() < SOME { HALF_SHARE } else { NEARLY_SHARE };
    if own > most || on_pads(holes) > most {
        return None;
    }
    flipped(holes).into_iter().find_map(|(word, flipped)| (on_pads(&flipped) >= 1.0).then_some(word))
}

fn flipped(holes: &[Point]) -> [(&'static str, Vec<Point>); 2] {
    let in_x = |at: &Point| Point::new(-at.x, at.y);
    let in_y = |at: &Point| Point::new(at.x, -at.y);
    [("X", holes.iter().map(in_x).collect()), ("Y", holes.iter().map(in_y).collect())]
}

/// Reports a layer that the holes fit only when flipped, if they fit the other layers as they are.
fn alone(layer: &Layer, holes: &[Point], fit: Fit) -> Option<Diagnostic> {
    let layers = std::slice::from_ref(layer);
    let own = share(layers, holes, fit.shift_mm);
    if own >= FITS_SHARE || fit.share < MIRRORED_SHARE {
        return None;
    }
    let (word, share) = mirrored(|holes| fit_shifted(layers, holes), holes, own)?;
    Some(told(code!("drill.layer_mirrored"), own, share).with("axis", word).with("layer", &layer.name))
}

/// The axis in which the flipped holes fit much better than `own`, and the share.
fn mirrored(fit: impl Fn(&[Point]) -> Fit, holes: &[Point], own: f64) -> Option<(&'static str, f64)> {
    flipped(holes).into_iter().find_map(|(word, flipped)| {
        let share = fit(&flipped).share;
        (share >= (own + MUCH_SHARE).clamp(MIRRORED_SHARE, NEARLY_ALL_SHARE)).then_some((word, share))
    })
}

/// The share on copper, counting only tools with most of their holes on copper, because no mounting hole is.
/// Without such a tool, counts all; 1 if there are too few holes.
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
    let severity = if code == code!("drill.beside_copper") { Severity::Warning } else { Severity::Error };
    Diagnostic::new(severity, code).with("own", percent(own)).with("other", percent(other))
}

#[cfg(test)]
mod tests {
    use crate::artwork::{FileRead, Overrides, read_set};
    use crate::diagnostic::Severity;

    type Places = Vec<(f64, f64)>;

    fn layer(function: &str, places: &[(f64, f64)]) -> Vec<u8> {
        let flash = |(x, y): &(f64, f64)| format!("X{:.0}Y{:.0}D03*", x * 1e6, y * 1e6);
        let flashes: String = places.iter().map(flash).collect();
        format!("%FSLAX46Y46*%%MOMM*%%TF.FileFunction,{function}*%%ADD10C,1*%D10*{flashes}M02*").into_bytes()
    }

    /// A program with holes of two tools; the second is for mounting holes.
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
        let warnings = file.diagnostics.iter().filter(|diagnostic| diagnostic.severity >= Severity::Warning);
        warnings.map(|diagnostic| diagnostic.code.as_str()).collect()
    }

    fn pins() -> Places {
        let rows =
            (0..4).flat_map(|row| (0..12).map(move |pin| (f64::from(pin) * 2.54, f64::from(row) * 7.62)));
        let odd =
            (0..9).map(|at| (f64::from(at * 7 % 31) * 0.91 + 0.4, f64::from(at * at % 53) * 0.37 + 0.9));
        rows.chain(odd).collect()
    }

    #[test]
    fn shift_is_found_if_most_holes_hit_copper_by_chance() {
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
    fn mirrored_holes_or_layers_are_reported() {
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
    fn copper_mismatch_is_reported_but_ignores_mounting_holes() {
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
