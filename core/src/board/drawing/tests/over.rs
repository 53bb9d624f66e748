//! File objects, edited like drawn elements: rotated, mirrored, aligned, copied, alone and together with
//! drawn ones.

use super::*;
use crate::artwork::{FileRead, painted};
use crate::board::drawing::written::gerber_text;
use crate::diagnostic::Severity;
use crate::geometry::{CombineRule, Region, combine};

/// The element of a file object that is only moved or removed.
pub(super) fn spoken((file, object, at): (&str, u32, Point), by: Option<Point>) -> Thing {
    let file = file.to_owned();
    Thing::Imported { file, object, at, by, turn_mdeg: 0, mirror: false, copy: false }
}

/// Apertures of every kind with every transform; strokes and a contour with arcs; holes.
const MANY: &[u8] = b"%TF.FileFunction,Copper,L1,Top*%%FSLAX46Y46*%%MOMM*%\
%AMTURNED*21,1,1.7,0.9,0,0,37*%%AMRING*1,1,1.9,0.1,0*1,0,0.7,0.1,0*%%AMKEYS*4,1,4,-1,-.5,1,-.5,1.2,.5,-.7,.5,-1,-.5,0*1,1,.6,1,.2*%\
%ADD10C,1*%%ADD11R,1.5X0.7*%%ADD12O,2X0.9*%%ADD13P,1.4X5X10*%%ADD14TURNED*%%ADD15RING*%%ADD16KEYS*%%ADD17C,1.6X0.6*%\
G75*D10*X1000000Y1000000D03*D11*X5000000Y1000000D03*D12*X9000000Y1000000D03*D13*X13000000Y1000000D03*\
D14*X1000000Y6000000D03*D15*X5000000Y6000000D03*D16*X9000000Y6000000D03*D17*X13000000Y6000000D03*\
%LR25*%%LMX*%D12*X17000000Y1000000D03*%LMN*%%LR0*%\
D10*X1000000Y11000000D02*X4000000Y12500000D01*G02*X7000000Y12500000I1500000J-1000000D01*G01*\
D11*X9000000Y11000000D02*X12000000Y12000000D01*\
G36*X14000000Y10000000D02*X17000000D01*G03*X17000000Y13000000I0J1500000D01*G01*X14000000Y12000000D01*Y10000000D01*G37*M02*";
const HOLES: &[u8] = b"M48\nMETRIC\nT1C0.5\nT2C0.9\n%\nT1\nX1.0Y1.0\nX5.0Y1.0\nT2\nX9.0Y1.0\nX1.0Y6.0\nM30\n";

fn many() -> artwork::Artwork {
    let files = [("many.gbr", MANY), ("many.drl", HOLES)];
    artwork::read_set(&files.map(|(name, bytes)| (name.to_owned(), bytes.to_vec())), &Overrides::default())
}

fn objects() -> Arc<Vec<Imported>> {
    Arc::new(imported(&many(), &[1]))
}

fn done(drawing: &mut Drawing, chosen: &[Catch], edit: impl Fn(&Selection<'_>) -> Edit) -> Edit {
    let finder = Finder::new(drawing, objects());
    let edit = edit(&Selection::new(drawing, &finder, &chosen.iter().copied().collect()));
    drawing.apply(&edit).unwrap()
}

fn of_files() -> Vec<Catch> {
    (0..objects().len() as u32).map(Catch::Imported).collect()
}

fn made(drawing: &Drawing) -> (Region, Vec<Point>) {
    let (mut artwork, mut used) = (many(), vec![1]);
    assert_eq!(lay_over(drawing, &mut artwork, &mut used), []);
    let hits = artwork.files[1].drill.as_ref().unwrap().hits.iter().map(|hit| hit.at).collect();
    (painted(artwork.files[0].gerber.as_ref().unwrap()).unwrap(), hits)
}

fn apart(a: &Region, b: &Region) -> f64 {
    area_mm2(&combine(a, b, CombineRule::Xor))
}

/// All copper rotated and mirrored about a position: quarter turns exact to the nanometre, others within the
/// rounding of points.
#[test]
fn file_objects_rotate_and_mirror_exactly() {
    let (whole, hits) = made(&Drawing::default());
    let about = mm(3.123_457, -2.5);
    for rotation_mdeg in [0, 90_000, 180_000, 270_000, 12_345, 45_000, 301_001] {
        for mirror in [false, true] {
            let placement = Placement { mirror, rotation_mdeg, shift: Point::default() };
            let mut drawing = Drawing::default();
            done(&mut drawing, &of_files(), |all| all.placed(placement, about));
            let (copper, holes) = made(&drawing);
            let home = Placement::shifted(Point::new(-about.x, -about.y));
            let wanted = Placement::shifted(about).region(&placement.region(&home.region(&whole)));
            // 150 mm of edge; each point may be off by a nanometre.
            let most_mm2 = if rotation_mdeg % 90_000 == 0 { 1e-5 } else { 3e-4 };
            let off_mm2 = apart(&copper, &wanted);
            assert!(off_mm2 <= most_mm2, "{placement:?}: {off_mm2} mm²");
            let place = |at: &Point| Placement::shifted(about).point(placement.point(home.point(*at)));
            assert_eq!(holes, hits.iter().map(place).collect::<Vec<_>>(), "{placement:?}");
        }
    }
}

#[test]
fn twelve_rotations_by_30_degrees_are_a_full_turn() {
    let (whole, _) = made(&Drawing::default());
    let mut drawing = Drawing::default();
    for _ in 0..12 {
        done(&mut drawing, &of_files(), |all| {
            let placement = Placement { rotation_mdeg: 30_000, ..Placement::default() };
            all.placed(placement, mm(7.0, 6.0))
        });
    }
    for (_, entry) in drawing.things() {
        let Thing::Imported { by: Some(by), turn_mdeg: 0, .. } = entry.thing else { panic!("{entry:?}") };
        assert!(by.x.nm().abs().max(by.y.nm().abs()) <= 8, "only places are rounded: {by:?}");
    }
    assert!(apart(&made(&drawing).0, &whole) < 2e-3);
}

#[test]
fn rotation_centre_is_the_pad_or_the_middle_of_the_track_box() {
    let finder = Finder::new(&Drawing::default(), objects());
    let middle = |of| {
        let drawing = Drawing::default();
        Selection::new(&drawing, &finder, &BTreeSet::from([Catch::Imported(of)])).middle()
    };
    let track = objects().iter().position(|one| !one.is_pad && !one.is_area).unwrap();
    assert_eq!(middle(4), Some(mm(1.0, 6.0)));
    assert_eq!(middle(track as u32), Some(mm(2.5, 11.75)));
    let mut drawing = Drawing::default();
    done(&mut drawing, &[Catch::Imported(4)], |one| one.turned(90_000, false));
    done(&mut drawing, &[Catch::Imported(4)], |one| one.turned_to(30_000));
    let entry = drawing.things().next().unwrap().1;
    assert_eq!(
        entry.thing.placement(),
        Some(Placement { rotation_mdeg: 30_000, ..Placement::default() }),
        "typed, it counts from how the file draws it"
    );
}

/// A drawn track and a file object in one edit: one undo restores both.
#[test]
fn drawn_and_file_objects_are_edited_together() {
    let mut drawing = Drawing::default();
    let ends = (TrackEnd::At(mm(20.0, 20.0)), TrackEnd::At(mm(24.0, 20.0)));
    drawing.apply(&track(&drawing, ends, um(400), Layer::Top).0).unwrap();
    let both = [Catch::Drawn(all(&drawing, "track")[0]), Catch::Imported(0)];
    let before = drawing.clone();
    let finder = |drawing: &Drawing| Finder::new(drawing, objects());
    let bounds = |drawing: &Drawing, chosen: &[Catch]| {
        let chosen = chosen.iter().copied().collect();
        Selection::new(drawing, &finder(drawing), &chosen).bounds().unwrap()
    };
    let at = |drawing: &Drawing| finder(drawing).place_of(drawing, Catch::Imported(0)).unwrap();
    let back = done(&mut drawing, &both, |all| all.aligned(Align { x: true, sides: Sides::Low }));
    assert_eq!(bounds(&drawing, &both[..1]).min.x, bounds(&drawing, &both[1..]).min.x);
    assert_eq!((drawing.apply(&back).unwrap().changes.len(), &drawing), (2, &before));
    let back = done(&mut drawing, &both, |all| all.turned(90_000, false));
    // The bounds of both are 0.5 to 24.2 and 0.5 to 20.2: the centre is 12.35, 10.35.
    assert_eq!(at(&drawing), mm(12.35 - (1.0 - 10.35), 10.35 + (1.0 - 12.35)));
    drawing.apply(&back).unwrap();
    assert_eq!(drawing, before);
    let back = done(&mut drawing, &both, |all| all.array(3, 2, mm(30.0, 30.0)));
    assert_eq!(
        (all(&drawing, "track").len(), all(&drawing, "imported").len()),
        (6, 5),
        "the first is in the file"
    );
    let rows = [(1.0, 31.0), (31.0, 1.0), (31.0, 31.0), (61.0, 1.0), (61.0, 31.0)];
    let (copper, _) = made(&drawing);
    for (x, y) in rows.into_iter().chain([(1.0, 1.0)]) {
        assert!(contains(&copper, mm(x, y)), "{x} {y}");
    }
    drawing.apply(&back).unwrap();
    assert_eq!(drawing, before);
}

#[test]
fn pasted_copy_is_edited_separately() {
    let mut drawing = Drawing::default();
    let copy = {
        let finder = Finder::new(&drawing, objects());
        let chosen = BTreeSet::from([Catch::Imported(4), Catch::Imported(14)]);
        Selection::new(&drawing, &finder, &chosen).copied()
    };
    assert_eq!(copy.len(), 2, "a pad and a hole");
    let (edit, top) = pasted(&drawing, &copy, mm(30.0, 0.0));
    drawing.apply(&edit).unwrap();
    assert_eq!(made(&drawing).1.len(), 5);
    let finder = Finder::new(&drawing, objects());
    let hit = finder.at(&drawing, mm(31.5, 6.2), um(10));
    assert_eq!(hit, [Catch::Drawn(*top.first().unwrap())]);
    assert_eq!(finder.layer(&drawing, hit[0]), Some(Layer::Top));
    let snap = finder.snap(&drawing, mm(31.1, 6.0), um(200), None, &BTreeSet::new());
    assert_eq!(snap.at(), mm(31.0, 6.0));
    let whole = made(&drawing).0;
    done(&mut drawing, &hit, |one| one.turned(53_000, false));
    let turned = made(&drawing).0;
    // The rectangle is at 37°; rotated by 53° it is upright.
    assert!(contains(&turned, mm(31.3, 6.84)) && !contains(&whole, mm(31.3, 6.84)));
    assert!((area_mm2(&turned) - area_mm2(&whole)).abs() < 1e-6);
    done(&mut drawing, &hit, |all| all.removed());
    assert_eq!(drawing.len(), 1, "no more is said of it");
    assert!(contains(&made(&drawing).0, mm(1.0, 6.0)), "what it was copied from is there");
}

#[test]
fn removed_group_removes_its_file_objects() {
    let mut drawing = Drawing::default();
    done(&mut drawing, &[Catch::Imported(0)], |one| one.moved(mm(0.0, -3.0)));
    let (edit, group) = grouped(&drawing, &set(&[all(&drawing, "imported")[0]]), "a");
    drawing.apply(&edit).unwrap();
    done(&mut drawing, &[Catch::Drawn(group.unwrap())], |all| all.removed());
    assert!(!contains(&made(&drawing).0, mm(1.0, 1.0)) && !contains(&made(&drawing).0, mm(1.0, -2.0)));
    let finder = Finder::new(&drawing, objects());
    drawing.apply(&put_back(&drawing, &finder, &BTreeSet::from([Catch::Imported(0)]))).unwrap();
    assert!(drawing.is_empty() && contains(&made(&drawing).0, mm(1.0, 1.0)));
}

#[test]
fn rotated_pad_is_selected_at_its_true_shape() {
    // An obround of 2 by 0.9 mm, mirrored and rotated by 25°, at 17, 1.
    let finder = Finder::new(&Drawing::default(), objects());
    let hit = |x, y| !finder.at(&Drawing::default(), mm(x, y), um(1)).is_empty();
    assert!(hit(17.8, 1.4), "along it");
    assert!(!hit(17.9, 1.0), "where it would lie if it were not turned");
}

fn written(drawing: &Drawing) -> Vec<FileRead> {
    let (texts, lost) = files_over(drawing, many());
    assert_eq!(lost, []);
    let texts: Vec<_> = texts.into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
    let files = artwork::read_set(&texts, &Overrides::default()).files;
    for file in &files {
        // A warning about holes far from copper changes no position.
        let told = file.diagnostics.iter().filter(|one| one.severity > Severity::Note);
        let mut told = told.filter(|one| one.code != "drill.beside_copper");
        assert_eq!(told.next(), None, "{}", file.name);
    }
    files
}

#[test]
fn changed_file_objects_read_back_to_the_nanometre() {
    for seed in 0..40 {
        let mut chance = Chance::new(seed);
        let mut drawing = Drawing::named("more");
        for _ in 0..6 {
            let chosen: Vec<Catch> =
                (0..3).map(|_| Catch::Imported(chance.below(objects().len()) as u32)).collect();
            let turn_mdeg = [90_000, 1_000 * chance.below(360) as i32][chance.below(2)];
            let (mirror, step) = (chance.below(2) == 0, mm(chance.between(20.0, 30.0), 0.0));
            match chance.below(4) {
                0 => done(&mut drawing, &chosen, |all| all.array(2, 1, step)),
                1 => done(&mut drawing, &chosen, |all| all.removed()),
                _ => done(&mut drawing, &chosen, |all| all.turned(turn_mdeg, mirror)),
            };
        }
        let (copper, holes) = made(&drawing);
        let files = written(&drawing);
        for file in &files {
            match (&file.gerber, &file.drill) {
                (Some(gerber), None) => {
                    let off_mm2 = apart(&painted(gerber).unwrap(), &copper);
                    assert!(off_mm2 < 1e-9, "seed {seed}: {off_mm2} mm²");
                }
                (_, Some(drill)) => {
                    let places: Vec<Point> = drill.hits.iter().map(|hit| hit.at).collect();
                    assert_eq!(places, holes, "seed {seed}");
                }
                _ => panic!("seed {seed}: {}", file.name),
            }
        }
    }
}

/// Blocks, repeats, polarity, attributes and a macro with arcs: written and read again, the layer draws the
/// same.
#[test]
fn written_layers_draw_the_same_as_before() {
    let text = b"%TF.FileFunction,Copper,L1,Top*%%TF.Part,a\\u002Ab*%%FSLAX46Y46*%%MOMM*%%AMTHERM*7,0,0,2,1.4,.3,20*%\
%ADD10C,1*%%TA.AperFunction,SMDPad,CuDef*%%ADD11R,10X10*%%TD*%%ADD12THERM*%%ABD20*%%TO.N,IN*%D11*X0Y0D03*%LPC*%%LR30*%D10*X0Y0D03*\
%LPD*%%LR0*%%TD*%%AB*%%TO.P,R1,2*%%TO.N,V\\u00B2*%D20*X0Y0D03*%TD*%%LMY*%%LS0.5*%D20*X20000000Y0D03*%LMN*%%LS1*%\
%SRX2Y2I5J5*%D10*X40000000Y0D03*%SR*%D12*X60000000Y0D03*%LR12.5*%X65000000Y0D03*M02*";
    let read = |text: &[u8]| {
        let files = [("a.gbr".to_owned(), text.to_vec())];
        let file = artwork::read_set(&files, &Overrides::default()).files.remove(0);
        assert_eq!(file.diagnostics, []);
        file.gerber.unwrap()
    };
    let (first, again) = (read(text), read(gerber_text(&read(text)).as_bytes()));
    let (a, b) = (painted(&first).unwrap(), painted(&again).unwrap());
    // Arcs in the macro are written as chords with a tolerance of 0.1 µm.
    assert!(apart(&a, &b) < 2e-3 && a.islands.len() == b.islands.len(), "{}", apart(&a, &b));
    assert_eq!(again.attributes, first.attributes);
    assert_eq!(again.apertures[1].function, first.apertures[1].function);
    let tags = |gerber: &artwork::Gerber| -> Vec<artwork::Tag> {
        gerber.objects.iter().map(|object| gerber.tags[object.tag as usize].clone()).collect()
    };
    assert_eq!(tags(&again), tags(&first));
}

#[test]
fn picture_of_an_edited_board_has_arcs_and_holes() {
    let (mut artwork, mut used) = (many(), vec![1]);
    let mut drawing = Drawing::named("over");
    done(&mut drawing, &[Catch::Imported(0)], |one| one.moved(mm(0.0, -5.0)));
    lay_over(&drawing, &mut artwork, &mut used);
    let (board, _) = from_artwork_with(&artwork, &used, BoardWanted { copper: true, aligned: false });
    let picture = board_svg(&board, "over");
    // The disc of 1 mm at 1, -4 as two halves; Y is negated.
    assert!(picture.contains("M0.5,4.0A0.5,0.5 0 0 0 1.5,4.0A0.5,0.5 0 0 0 0.5,4.0Z"), "{picture}");
    assert_eq!(picture.matches("<circle").count(), 4, "holes");
    assert!(picture.ends_with("</svg>\n") && !picture.contains("NaN"));
}

/// A newer export with an additional hole before the others: the editor finds the same object as the board.
#[test]
fn edited_objects_are_found_in_a_renumbered_file() {
    let mut drawing = Drawing::default();
    done(&mut drawing, &[Catch::Imported(15)], |hole| hole.removed());
    let thing = drawing.things().next().unwrap().1.thing.clone();
    assert!(matches!(thing, Thing::Imported { object: 2, at, .. } if at == mm(9.0, 1.0)), "{thing:?}");
    let holes = String::from_utf8(HOLES.to_vec()).unwrap().replace("T1\nX1.0Y1.0", "T1\nX2.0Y9.0\nX1.0Y1.0");
    for name in ["many.drl", "anew/many.drl"] {
        let files = [("many.gbr", MANY.to_vec()), (name, holes.clone().into_bytes())];
        let files = files.map(|(name, bytes)| (name.to_owned(), bytes));
        let (mut artwork, mut used) = (artwork::read_set(&files, &Overrides::default()), vec![1]);
        let finder = Finder::new(&drawing, Arc::new(imported(&artwork, &used)));
        assert_eq!(lay_over(&drawing, &mut artwork, &mut used), []);
        let drilled: Vec<Point> =
            artwork.files[1].drill.as_ref().unwrap().hits.iter().map(|hit| hit.at).collect();
        let caught = |at: Point| {
            !finder.at(&drawing, at, um(1)).iter().all(|catch| {
                finder.object_of(*catch).is_none_or(|of| finder.imported()[of as usize].layer.is_some())
            })
        };
        let all = [(2.0, 9.0), (1.0, 1.0), (5.0, 1.0), (9.0, 1.0), (1.0, 6.0)].map(|(x, y)| mm(x, y));
        for at in all {
            assert_eq!(caught(at), drilled.contains(&at), "{name} {at:?}");
        }
        assert!(!drilled.contains(&mm(9.0, 1.0)) && drilled.len() == 4);
        // Restoring and moving refer to one object.
        let of = finder.imported_of(&thing).unwrap();
        assert_eq!((finder.said_of(of), finder.imported()[of as usize].at), (Some(Id(1)), mm(9.0, 1.0)));
    }
}
