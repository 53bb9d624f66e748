//! What must hold for any bytes at all: the readers end, within their limits, and break no promise.
//!
//! Comes in: bytes. Goes out: nothing, or a panic that names the broken promise. The seeded mutation test and the
//! fuzzer run the same functions.

use annulus_core::artwork::{
    Artwork, Kind, MOST_HITS, MOST_KEPT, Overrides, nets, painted, painted_measures, read_drill, read_set,
};
use annulus_core::board::from_artwork;
use annulus_core::locale;
use annulus_core::units::Length;

/// The bytes as a drill file alone.
pub fn drill(bytes: &[u8]) {
    let file = read_drill("mutated.drl", bytes);
    promises(&Artwork { files: vec![file] });
}

/// The bytes as any file.
pub fn any(bytes: &[u8]) {
    promises(&read_set(&[("mutated".to_owned(), bytes.to_vec())], &Overrides::default()));
}

/// The first half as a drill file, the second as the copper layer or report beside it.
pub fn beside(bytes: &[u8]) {
    let (front, back) = bytes.split_at(bytes.len() / 2);
    let files = [("a.drl".to_owned(), front.to_vec()), ("a.gtl".to_owned(), back.to_vec())];
    promises(&read_set(&files, &Overrides::default()));
}

/// The bytes as a layer, painted where it is small, with its nets.
pub fn gerber(bytes: &[u8]) {
    let artwork = read_set(&[("mutated.gbr".to_owned(), bytes.to_vec())], &Overrides::default());
    for gerber in artwork.files.iter().filter_map(|file| file.gerber.as_ref()) {
        let drawn = gerber.pads().len() + gerber.strokes().len() + gerber.contours().len();
        assert!(drawn <= 1_500_000, "{drawn} objects");
        if drawn < 500 {
            let region = painted(gerber);
            assert_eq!(nets(gerber, &region).names.len(), region.islands.len());
            assert!(painted_measures(&region).area_mm2 >= 0.0);
        }
    }
    promises(&artwork);
}

fn promises(artwork: &Artwork) {
    for file in &artwork.files {
        assert!(file.remarks.len() <= MOST_KEPT + 2_000, "{} remarks", file.remarks.len());
        for remark in file.remarks.iter().chain([&file.reason]) {
            for part in ["message", "advice"] {
                let key = format!("{}.{part}", remark.code);
                assert!(locale::lookup("en", &key).is_some(), "no sentence {key}");
            }
        }
        if matches!(file.kind, Kind::Refused | Kind::Unknown) {
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
    let (board, _) = from_artwork(artwork, &artwork.default_use());
    let hits: usize = artwork
        .default_use()
        .iter()
        .filter_map(|&i| artwork.files[i].drill.as_ref())
        .map(|d| d.hits.len())
        .sum();
    assert_eq!(board.holes.len(), hits);
}
