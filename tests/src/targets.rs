//! Properties that hold for any bytes: the readers terminate within their limits and keep their invariants.
//! Used by the seeded mutation test and by the fuzzer.

use annulus_core::artwork::{
    Artwork, FileKind, MOST_HITS, MOST_KEPT, Overrides, nets, painted, painted_measures, read_drill, read_set,
};
use annulus_core::board::from_artwork;
use annulus_core::cam::work::Work;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::locale;
use annulus_core::project;
use annulus_core::project::saved;
use annulus_core::units::Length;

/// The bytes as a single drill file.
pub fn drill(bytes: &[u8]) {
    let file = read_drill("mutated.drl", bytes);
    promises(&Artwork { files: vec![file] });
}

/// The bytes as any file.
pub fn any(bytes: &[u8]) {
    promises(&read_set(&[("mutated".to_owned(), bytes.to_vec())], &Overrides::default()));
}

/// The first half as a drill file, the second as the copper layer or report next to it.
pub fn beside(bytes: &[u8]) {
    let (front, back) = bytes.split_at(bytes.len() / 2);
    let files = [("a.drl".to_owned(), front.to_vec()), ("a.gtl".to_owned(), back.to_vec())];
    promises(&read_set(&files, &Overrides::default()));
}

/// The bytes as a layer, painted within its budget, with its nets.
pub fn gerber(bytes: &[u8]) {
    let artwork = read_set(&[("mutated.gbr".to_owned(), bytes.to_vec())], &Overrides::default());
    for gerber in artwork.files.iter().filter_map(|file| file.gerber.as_ref()) {
        let drawn = gerber.pads().len() + gerber.strokes().len() + gerber.contours().len();
        assert!(drawn <= 1_500_000, "{drawn} objects");
        match painted(gerber) {
            Ok(region) => {
                assert_eq!(nets(gerber, &region).names.len(), region.islands.len());
                assert!(painted_measures(&region).area_mm2 >= 0.0);
            }
            Err(much) => has_sentences(&much.diagnostic("mutated.gbr")),
        }
    }
    promises(&artwork);
}

/// Maximum total size of a project's unpacked members, bytes: the limit of the zip reader.
const MOST_UNPACKED: usize = 128 << 20;

/// The bytes as a saved project, with its job and its files.
pub fn project(bytes: &[u8]) {
    let open = match saved::read("mutated.annulus", bytes) {
        Ok(open) => open,
        Err(why) => return has_sentences(&why),
    };
    assert!(saved::looks_like_one(bytes), "what was read looks like one");
    let size: usize = open.files.iter().map(|(_, bytes)| bytes.len()).sum();
    assert!(size <= MOST_UNPACKED, "{size} bytes unpacked");
    open.job.iter().for_each(|text| job(text.as_bytes()));
    // A readable project survives writing and reading, except for names that lead out of the zip.
    match saved::write(&open) {
        Ok(written) => {
            let again = saved::read("again", &written).expect("what was written is read");
            let whole = |project: &saved::Project| -> Vec<usize> {
                project.files.iter().map(|(_, bytes)| bytes.len()).collect()
            };
            assert_eq!((&again.job, again.said.numbers.clone()), (&open.job, open.said.numbers.clone()));
            assert_eq!(whole(&again), whole(&open));
            assert_eq!(saved::write(&again).expect("twice"), written, "written twice, it is the same");
        }
        Err(why) => has_sentences(&why),
    }
    let mut artwork = read_set(&open.files, &open.said.numbers.overrides());
    open.said.say_roles(&mut artwork);
    let used = open.said.used_of(&artwork).unwrap_or_else(|| artwork.default_use());
    assert!(used.iter().all(|&file| file < artwork.files.len()));
    promises(&artwork);
}

/// The bytes as a job file: rejected with a position, or unchanged after writing and reading.
pub fn job(bytes: &[u8]) {
    let (text, base) = (String::from_utf8_lossy(bytes), Work::default());
    match project::read("mutated.toml", &text, &base) {
        Err(why) => {
            has_sentences(&why);
            assert!(why.place.is_some(), "{why:?} has no place");
        }
        Ok(work) => {
            assert!(work.bits.len() <= 64 && work.operations.len() <= 64);
            let written = project::write(&work);
            let again = project::read("again.toml", &written, &base);
            let again = again.unwrap_or_else(|why| panic!("{}\n{written}", why.message("en")));
            assert_eq!(project::write(&again), written, "written twice, it is the same");
        }
    }
}

/// Checks that a diagnostic has its texts (message and advice; a reason has only one), and that all
/// placeholders are filled.
pub fn has_sentences(diagnostic: &Diagnostic) {
    for part in ["message", "advice"] {
        let key = format!("{}.{part}", diagnostic.code);
        let raw = locale::lookup("en", &key).unwrap_or_else(|| panic!("no sentence {key}"));
        for name in locale::names(raw) {
            assert!(
                diagnostic.args.iter().any(|(argument, _)| argument == name),
                "{key} does not get {name}"
            );
        }
    }
}

fn promises(artwork: &Artwork) {
    for file in &artwork.files {
        assert!(file.diagnostics.len() <= MOST_KEPT + 2_000, "{} diagnostics", file.diagnostics.len());
        file.diagnostics.iter().chain([&file.reason]).for_each(has_sentences);
        if matches!(file.kind, FileKind::Refused | FileKind::Unknown) {
            assert!(file.drill.is_none() && file.gerber.is_none(), "{} is half loaded", file.name);
        }
        let Some(drill) = &file.drill else { continue };
        assert!(drill.hits.len() <= MOST_HITS);
        for (at, tool) in drill.centres() {
            assert!(usize::from(tool) < drill.tools.len(), "a hole without a tool entry");
            assert!(
                at.x.abs() <= Length::LIMIT + Length::LIMIT && at.y.abs() <= Length::LIMIT + Length::LIMIT
            );
        }
        assert!(drill.rapid_length_mm().is_finite());
    }
    board_promises(artwork);
}

/// Checks that the board has every hole and slot of its files; slots without length and lists of vias are
/// reported.
fn board_promises(artwork: &Artwork) {
    let used = artwork.default_use();
    let (board, diagnostics) = from_artwork(artwork, &used);
    let drills = || used.iter().filter_map(|&index| artwork.files[index].drill.as_ref());
    let hits: usize = drills().map(|drill| drill.hits.len()).sum();
    let slots: usize = drills().map(|drill| drill.slots.len() + drill.routes.len()).sum();
    let reported = |code: &str| -> usize {
        let counts = diagnostics.iter().filter(|found| found.code == code).flat_map(|found| &found.args);
        counts.filter(|(name, _)| name == "count").map(|(_, count)| count.parse::<usize>().unwrap()).sum()
    };
    let (round, twice) = (reported("board.slots_round"), reported("board.holes_in_both"));
    assert_eq!(board.holes.len() + twice, hits + round, "{round} round slots, {twice} holes listed twice");
    assert_eq!(board.slots.len() + round, slots, "{round} round slots");
}
