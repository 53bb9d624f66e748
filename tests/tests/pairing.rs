//! Drill files next to copper and outlines of other boards: foreign layers never change a scale silently.
//!
//! Pairs every corpus drill file without decimal points with every copper or outline layer of every other
//! board, under their original names and under neutral names. A reading is wrong if its bounds are not the
//! expected ones, and silent without a warning or error.

use annulus_core::artwork::{FileKind, FileRead, Overrides, Role, read_set};
use annulus_core::diagnostic::Severity;
use annulus_tests::{corpus, files_below};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// One pair of this many is tested on a push; all with `ANNULUS_LONG`.
const ONE_OF: u64 = 32;
/// Expectations are rounded to 1 µm.
const TOLERANCE_MM: f64 = 0.0011;

/// A drill file of the corpus, and the bounds of its holes.
struct Drill {
    path: PathBuf,
    bytes: Vec<u8>,
    bounds: Vec<f64>,
}

/// The expectations of the corpus for one kind of file.
fn expected(corpus: &Path, kind: &str) -> Vec<(PathBuf, Value)> {
    let paths = files_below(&corpus.join("expected"));
    let json = paths.iter().filter(|path| path.extension().is_some_and(|ending| ending == "json"));
    let rows = json.map(|path| serde_json::from_slice::<Value>(&fs::read(path).unwrap()).unwrap());
    let rows = rows.filter(|json| json["kind"].as_str() == Some(kind));
    rows.map(|json| (corpus.join(json["file"].as_str().unwrap()), json["expected"].clone())).collect()
}

fn drills(corpus: &Path) -> Vec<Drill> {
    let number = |value: &Value| value.as_f64().unwrap();
    let rows = expected(corpus, "drill").into_iter().filter_map(|(path, expected)| {
        let bounds: Vec<f64> = expected["bbox_centres_mm"].as_array()?.iter().map(number).collect();
        let decimal = expected["zeros_suppressed"].as_str() == Some("decimal");
        (!decimal).then(|| Drill { bytes: fs::read(&path).unwrap(), path, bounds })
    });
    rows.collect()
}

/// The copper and outline layers of the corpus.
fn layers(corpus: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let all = expected(corpus, "gerber").into_iter().map(|(path, _)| (fs::read(&path).unwrap(), path));
    let rows = all.filter_map(|(bytes, path)| {
        let artwork = read_set(&[(path.display().to_string(), bytes.clone())], &Overrides::default());
        let role = artwork.files[0].role;
        matches!(role, Role::Copper | Role::Outline).then_some((path, bytes))
    });
    rows.collect()
}

/// True if the pair is tested in this run.
fn chosen(at: u64) -> bool {
    std::env::var_os("ANNULUS_LONG").is_some()
        || (at.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32).is_multiple_of(ONE_OF)
}

fn is_right(file: &FileRead, bounds: &[f64]) -> bool {
    let found = file.drill.as_ref().and_then(|drill| drill.centre_bounds());
    found.is_some_and(|found| {
        let found = [found.min.x, found.min.y, found.max.x, found.max.y].map(|length| length.mm());
        found.iter().zip(bounds).all(|(found, wanted)| (found - wanted).abs() <= TOLERANCE_MM)
    })
}

#[test]
fn foreign_copper_changes_no_scale_silently() {
    let Some(corpus) = corpus() else { return };
    let (drills, layers) = (drills(&corpus), layers(&corpus));
    assert!(drills.len() >= 25 && layers.len() >= 30, "{} and {}", drills.len(), layers.len());
    let (mut pairs, mut silent, mut doubted, mut at) = (0, Vec::new(), Vec::new(), 0);
    for drill in &drills {
        for (path, layer) in layers.iter().filter(|(path, _)| path.parent() != drill.path.parent()) {
            for plain in [false, true] {
                at += 1;
                if !chosen(at) {
                    continue;
                }
                pairs += 1;
                let name = |path: &Path| path.file_name().unwrap().display().to_string();
                let ending =
                    |path: &Path| path.extension().map_or("gbr".to_owned(), |e| e.display().to_string());
                let names = if plain {
                    ["drill.drl".to_owned(), format!("top.{}", ending(path))]
                } else {
                    [name(&drill.path), name(path)]
                };
                let files = [(names[0].clone(), drill.bytes.clone()), (names[1].clone(), layer.clone())];
                let artwork = read_set(&files, &Overrides::default());
                let file = &artwork.files[0];
                if is_right(file, &drill.bounds) {
                    continue;
                }
                let codes: Vec<_> =
                    file.diagnostics.iter().map(|r| format!("{:?} {}", r.severity, r.code)).collect();
                let row = format!(
                    "{} with {} ({plain}): {codes:?} {:?}",
                    drill.path.display(),
                    name(path),
                    file.evidence
                );
                let told = file.kind != FileKind::Drill
                    || file.diagnostics.iter().any(|r| r.severity >= Severity::Warning);
                if told { doubted.push(row) } else { silent.push(row) }
            }
        }
    }
    println!("{pairs} pairs, {} wrong and silent, {} wrong with a warning", silent.len(), doubted.len());
    println!("{}\n\n{}", silent.join("\n"), doubted.join("\n"));
    assert!(pairs > 60, "{pairs} pairs");
    assert!(silent.is_empty(), "wrong and silent:\n{}", silent.join("\n"));
}
