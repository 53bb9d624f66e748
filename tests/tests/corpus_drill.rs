//! Every drill file, list and zip of the corpus, read with its neighbours and compared with its expectation;
//! all dialects of one board; hostile files within their limits.

use annulus_core::artwork::{
    Artwork, DrillFile, FileKind, FileRead, MOST_HITS, MOST_KEPT, Overrides, read_set,
};
use annulus_core::board::{Board, from_artwork};
use annulus_core::diagnostic::Severity;
use annulus_tests::{corpus, data, expectations, read_folder};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Expectations are rounded to 1 µm; inch values are often exactly halfway.
const TOLERANCE_MM: f64 = 0.0011;

fn read_alone(path: &Path) -> Artwork {
    read_set(&[(path.display().to_string(), fs::read(path).unwrap())], &Overrides::default())
}

/// All differences between a file and its expectation.
fn differences(file: &FileRead, expected: &Value) -> Vec<String> {
    let Some(drill) = &file.drill else { return vec!["no holes".into()] };
    let mut out = Vec::new();
    let mut compare = |what: &str, found: String, wanted: String| {
        if found != wanted {
            out.push(format!("{what}: {found} instead of {wanted}"));
        }
    };
    if let Some(units) = expected["units"].as_str() {
        compare("units", file.units.map_or("", |units| units.name()).into(), units.into());
    }
    let totals = drill.totals();
    let counts = |c: annulus_core::artwork::Counts| {
        format!("{} {} {} {}", c.hits, c.slots, c.routed_paths, c.routed_segments)
    };
    let wanted = |row: &Value| {
        ["hits", "slots_g85", "routed_paths", "routed_segments"].map(|key| row[key].to_string()).join(" ")
    };
    compare("totals", counts(totals), wanted(&expected["totals"]));
    for row in expected["tools"].as_array().unwrap() {
        let code = row["n"].as_u64().unwrap();
        let found = drill.tools.iter().zip(drill.counts()).find(|(tool, _)| u64::from(tool.code) == code);
        let Some((tool, count)) = found else {
            compare("tool", "none".into(), format!("T{code}"));
            continue;
        };
        compare(&format!("T{code}"), counts(count), wanted(row));
        let size = tool.diameter.map(|length| length.mm());
        let near = match (size, row["diameter_mm"].as_f64()) {
            (Some(found), Some(wanted)) => (found - wanted).abs() <= TOLERANCE_MM,
            (found, wanted) => found.is_none() && wanted.is_none(),
        };
        compare(&format!("T{code} size"), near.to_string(), "true".into());
        if !row["plated"].is_null() {
            compare(
                &format!("T{code} plated"),
                format!("{:?}", tool.plated),
                format!("{:?}", row["plated"].as_bool()),
            );
        }
    }
    for (what, bounds) in
        [("bbox_centres_mm", drill.centre_bounds()), ("bbox_outer_mm", drill.outer_bounds())]
    {
        let Some(wanted) = expected[what].as_array() else { continue };
        let found = bounds.map(|b| [b.min.x, b.min.y, b.max.x, b.max.y].map(|length| length.mm()));
        let near = found.is_some_and(|found| {
            found.iter().zip(wanted).all(|(f, w)| (f - w.as_f64().unwrap()).abs() <= TOLERANCE_MM)
        });
        if !near {
            compare(what, format!("{found:?}"), format!("{wanted:?}"));
        }
    }
    let rapid = expected["rapid_length_file_order_mm"].as_f64().unwrap_or_default();
    // The sum of thousands of moves, each rounded in the expectation.
    if (drill.rapid_length_mm() - rapid).abs() > 0.002 {
        compare("rapid length", drill.rapid_length_mm().to_string(), rapid.to_string());
    }
    out
}

#[test]
fn every_drill_file_matches_its_expectation() {
    let mut folders: BTreeMap<PathBuf, Artwork> = BTreeMap::new();
    let (mut count, mut wrong) = (0, Vec::new());
    for (source, json) in expectations() {
        if !matches!(json["kind"].as_str(), Some("drill" | "synthetic"))
            || json["expected"]["totals"].is_null()
        {
            continue;
        }
        let folder = source.parent().unwrap().to_owned();
        let artwork = folders.entry(folder.clone()).or_insert_with(|| read_folder(&folder));
        let file = artwork.files.iter().find(|file| Path::new(&file.name) == source).unwrap();
        count += 1;
        wrong.extend(
            differences(file, &json["expected"])
                .into_iter()
                .map(|why| format!("{}: {why}", source.display())),
        );
    }
    let least = if corpus().is_some() { 60 } else { 30 };
    assert!(count >= least, "only {count} expectations");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

fn board_of(file: &FileRead) -> Board {
    let artwork = Artwork { files: vec![file.clone()] };
    from_artwork(&artwork, &[0]).0
}

/// Holes sorted by position and size, in nanometres.
fn holes(board: &Board) -> Vec<(i64, i64, i64)> {
    let row = |hole: &annulus_core::board::Hole| {
        (hole.at.x.nm(), hole.at.y.nm(), hole.diameter.map_or(0, |d| d.nm()))
    };
    let mut rows: Vec<_> = board.holes.iter().map(row).collect();
    rows.sort_unstable();
    rows
}

#[test]
fn dialects_of_one_board_give_the_same_board() {
    let artwork = read_folder(&data().join("synthetic"));
    let named = |start: &str| {
        let matching = |file: &&FileRead| {
            Path::new(&file.name).file_name().is_some_and(|name| name.to_string_lossy().starts_with(start))
        };
        artwork
            .files
            .iter()
            .find(|file| matching(file) && file.kind == FileKind::Drill)
            .unwrap_or_else(|| panic!("no {start}"))
    };
    let reference = holes(&board_of(named("d01-")));
    assert_eq!(reference.len(), 52);
    let dialects = (2..=28).filter(|&number| number != 26).map(|number| format!("d{number:02}-"));
    for start in dialects.chain(["a01-".into(), "a02-".into(), "a03-".into()]) {
        let file = named(&start);
        let found = holes(&board_of(file));
        assert_eq!(found.len(), reference.len(), "{start}");
        for (one, other) in reference.iter().zip(&found) {
            let off = (one.0 - other.0).abs().max((one.1 - other.1).abs()).max((one.2 - other.2).abs());
            assert!(off <= 1_000, "{start}: {one:?} and {other:?}");
        }
        let text = ["d27-"].contains(&start.as_str()); // its text is left out, and that is an error
        assert_eq!(file.has_error(), text, "{start}: {:?}", file.diagnostics);
    }
    let d12 = named("d12-");
    assert!(
        d12.diagnostics.iter().any(|diagnostic| diagnostic.code == "drill.units_by_sizes"
            && diagnostic.severity == Severity::Warning)
    );
}

/// Memory of a file in bytes, computed from its data to be independent of the allocator.
fn kept_bytes(drill: &DrillFile) -> usize {
    let segments: usize = drill.routes.iter().map(|route| route.segments.len()).sum();
    drill.hits.capacity() * size_of_val(&drill.hits.first().copied())
        + (drill.slots.len() + segments + drill.routes.len()) * 128
        + drill.tools.len() * 64
}

#[test]
fn hostile_files_are_reported_within_limits() {
    // File, kind, number of hits, a code that must be reported, its line.
    let rows: [(&str, FileKind, usize, &str, u32); 15] = [
        ("x01-repeat-bomb.drl", FileKind::Refused, 0, "drill.too_many_repeats", 7),
        ("x02-pattern-bomb.drl", FileKind::Refused, 0, "drill.too_many_repeats", 2507),
        ("x03-coordinate-overflow.drl", FileKind::Drill, 0, "drill.bad_number", 6),
        ("x04-tool-numbers.drl", FileKind::Drill, 2, "drill.tool_number", 3),
        ("x05-tool-diameters.drl", FileKind::Drill, 6, "drill.tool_diameter", 3),
        ("x06-truncated-header.drl", FileKind::Drill, 0, "drill.header_never_ends", 5),
        ("x07-truncated-number.drl", FileKind::Drill, 36, "drill.cut_short", 46),
        ("x08-binary-noise.drl", FileKind::Refused, 0, "refused.binary", 0),
        ("x09-one-long-line.drl", FileKind::Drill, 0, "drill.bad_number", 6),
        ("x10-html-error-page.drl", FileKind::Refused, 0, "refused.web_page", 0),
        ("x11-comment-injection.drl", FileKind::Drill, 1, "", 0),
        ("x12-empty.drl", FileKind::Refused, 0, "refused.empty", 0),
        ("x13-only-header.drl", FileKind::Drill, 0, "", 0),
        ("x30-zip-path-traversal.zip", FileKind::Archive, 0, "archive.path_leads_out", 0),
        ("x32-zip-nested.zip", FileKind::Archive, 0, "archive.name_clash", 0),
    ];
    let mut wrong = Vec::new();
    for (name, kind, hits, code, line) in rows {
        let artwork = read_alone(&data().join("synthetic").join(name));
        let file = &artwork.files[0];
        let found = file.drill.as_ref().map_or(0, |drill| drill.hits.len());
        let said: Vec<_> = file
            .diagnostics
            .iter()
            .map(|diagnostic| {
                (diagnostic.code.as_str(), diagnostic.place.as_ref().map_or(0, |place| place.line))
            })
            .collect();
        if file.kind != kind || found != hits || !(code.is_empty() || said.contains(&(code, line))) {
            wrong.push(format!("{name}: {:?} {found} hits, {:?}", file.kind, said.get(..8.min(said.len()))));
        }
        for file in &artwork.files {
            assert!(file.diagnostics.len() <= MOST_KEPT + 20, "{name}");
            let drill = file.drill.as_ref();
            assert!(
                drill.is_none_or(|drill| drill.hits.len() <= MOST_HITS && kept_bytes(drill) < 200 << 20),
                "{name}"
            );
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn corpus_messages_have_all_arguments() {
    let mut folders = vec![data().join("synthetic")];
    let theirs = corpus();
    if let Some(corpus) = &theirs {
        let apart = ["expected", "licenses", "tsplib", "synthetic"];
        let entries = fs::read_dir(corpus).unwrap().map(|entry| entry.unwrap().path());
        folders
            .extend(entries.filter(|path| path.is_dir() && !apart.iter().any(|name| path.ends_with(name))));
    }
    let mut count = 0;
    for folder in folders {
        let artwork = read_folder(&folder);
        let (_, of_board) = from_artwork(&artwork, &artwork.default_use());
        let of_files = artwork.files.iter().flat_map(|file| file.diagnostics.iter().chain([&file.reason]));
        for diagnostic in of_files.chain(&of_board) {
            annulus_tests::targets::has_sentences(diagnostic);
            count += 1;
        }
    }
    assert!(count > if theirs.is_some() { 500 } else { 100 }, "{count} diagnostics");
}

#[test]
fn zips_give_only_safe_files() {
    let listed = |name: &str| -> Vec<(String, FileKind)> {
        let artwork = read_alone(&data().join("synthetic").join(name));
        let inside = |file: &FileRead| file.name.split_once("!/").map(|(_, inside)| inside.to_owned());
        artwork.files.iter().filter_map(|file| Some((inside(file)?, file.kind))).collect()
    };
    let refused = |name: &str| (name.to_owned(), FileKind::Refused);
    let drill = |name: &str| (name.to_owned(), FileKind::Drill);
    let traversal =
        [refused("../../evil.drl"), refused("/abs/evil.gbr"), refused("C:\\evil.drl"), drill("ok/board.drl")];
    assert_eq!(listed("x30-zip-path-traversal.zip"), traversal);
    assert_eq!(listed("x31-zip-bomb.zip"), [refused("board.drl")]);
    let nested = listed("x32-zip-nested.zip");
    assert!(nested.contains(&drill("board.drl")) && nested.contains(&refused("BOARD.DRL")), "{nested:?}");
    assert!(nested.contains(&drill("inner.zip!/ok/board.drl")), "{nested:?}");
    assert!(!nested.iter().any(|(name, _)| name.contains("__MACOSX")), "{nested:?}");
}

#[test]
fn unsupported_files_are_refused_with_a_reason() {
    let Some(corpus) = corpus() else { return };
    for (name, kind, code) in [
        ("altium/protel-se-sg-if/SE_SG_IF_V2.DRL", FileKind::Refused, "refused.eia_tape"),
        ("cam350/ekf-rs274d/l1.off", FileKind::Refused, "refused.gerber_without_format"),
        ("broken/gerbonara/test_syntax_error.gbr", FileKind::Gerber, "gerber.aperture_undefined"),
        ("broken/gerbv-poc/parse_aperture_strtok.1.poc", FileKind::Gerber, "gerber.include"),
    ] {
        let artwork = read_alone(&corpus.join(name));
        let file = &artwork.files[0];
        let said: Vec<_> = file.diagnostics.iter().map(|diagnostic| diagnostic.code.as_str()).collect();
        assert!(
            file.kind == kind && said.contains(&code) && file.has_error(),
            "{name}: {:?} {said:?}",
            file.kind
        );
    }
}

#[test]
fn copper_decides_an_ambiguous_drill_format() {
    let Some(corpus) = corpus() else { return };
    for (name, source, least, shift) in [
        ("pads/osu-rover-2011/Drill.drl", "copper", 0.99, None),
        ("orcad/rs232/thruhole.tap", "copper", 0.99, None),
        ("ultiboard/pihpsdr/PiHPSDR_Controller_MK_II_rev2.d0", "companion", 0.97, Some((3.295, 140.124))),
    ] {
        let path = corpus.join(name);
        let artwork = read_folder(path.parent().unwrap());
        let file = artwork.files.iter().find(|file| Path::new(&file.name) == path).unwrap();
        let evidence = file.evidence.as_ref().unwrap();
        assert_eq!(evidence.source.name(), source, "{name}: {evidence:?}");
        assert!(
            evidence.score.unwrap() >= least && evidence.runner_up < evidence.score,
            "{name}: {evidence:?}"
        );
        let near = |(a, b): (f64, f64), (c, d): (f64, f64)| (a - c).abs() < 0.01 && (b - d).abs() < 0.01;
        assert!(
            shift.is_none_or(|shift| evidence.shift_mm.is_some_and(|found| near(found, shift))),
            "{name}: {evidence:?}"
        );
        assert!(!file.has_error(), "{name}: {:?}", file.diagnostics);
    }
}

#[test]
fn sample_board_is_complete() {
    let folder = annulus_tests::root().join("www/examples");
    let artwork = read_folder(&folder);
    let (board, diagnostics) = from_artwork(&artwork, &artwork.default_use());
    assert_eq!((board.holes.len(), board.slots.len(), board.outline.islands.len()), (77, 0, 1));
    assert_eq!(diagnostics, []);
    assert_eq!(board.name, "sensor");
    assert!(board.holes.iter().all(|hole| hole.diameter.is_some() && hole.plated.is_some()));
}
