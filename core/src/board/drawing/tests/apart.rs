//! Slots, routes, expanded repeats, and groups with file objects.

use super::*;
use crate::artwork::{ObjectShape, painted};
use crate::geometry::{Bounds, Region};

/// A single pad, two pads and a stroke repeated 3 × 2, and another stroke.
const PANEL: &[u8] = b"%TF.FileFunction,Copper,L1,Top*%%FSLAX46Y46*%%MOMM*%%ADD10C,1*%%ADD11C,0.4*%\
D10*X50000000Y50000000D03*%SRX3Y2I10J20*%D10*X1000000Y1000000D03*X4000000Y1000000D03*\
D11*X1000000Y1000000D02*X4000000Y1000000D01*%SR*%D11*X50000000Y50000000D02*X55000000Y50000000D01*M02*";
/// Two holes, a slot between them in the file, a routed path with an arc.
const MILLED: &[u8] =
    b"M48\nMETRIC\nT1C0.8\nT2C1.2\n%\nG90\nG05\nT1\nX1.0Y101.0\nT2\nX8.0Y104.0G85X8.0Y107.0\nT1\nX4.0Y101.0\nT2\n\
G00X20.0Y105.0\nM15\nG01X24.0Y105.0\nG03X24.0Y109.0I0J2.0\nM16\nG05\nM30\n";

fn files() -> artwork::Artwork {
    let files = [("panel.gbr", PANEL), ("milled.drl", MILLED)];
    artwork::read_set(&files.map(|(name, bytes)| (name.to_owned(), bytes.to_vec())), &Overrides::default())
}

fn objects() -> Arc<Vec<Imported>> {
    Arc::new(imported(&files(), &[1]))
}

fn caught(drawing: &Drawing, at: Point) -> Option<(Catch, u32)> {
    let finder = Finder::new(drawing, objects());
    let catch = finder.at(drawing, at, um(10)).into_iter().next()?;
    Some((catch, finder.imported()[finder.object_of(catch)? as usize].object))
}

fn done(drawing: &mut Drawing, at: Point, edit: impl Fn(&Selection<'_>) -> Edit) {
    let (catch, _) = caught(drawing, at).unwrap_or_else(|| panic!("nothing at {at:?}"));
    let finder = Finder::new(drawing, objects());
    let edit = edit(&Selection::new(drawing, &finder, &BTreeSet::from([catch])));
    drawing.apply(&edit).unwrap();
}

fn made(drawing: &Drawing) -> artwork::Artwork {
    let (mut artwork, mut used) = (files(), vec![1]);
    assert_eq!(lay_over(drawing, &mut artwork, &mut used), []);
    artwork
}

fn copper(artwork: &artwork::Artwork) -> Region {
    painted(artwork.files[0].gerber.as_ref().unwrap()).unwrap()
}

/// The changed files, written and read again; unchanged files are not included.
fn written(drawing: &Drawing) -> Vec<artwork::FileRead> {
    let (texts, lost) = files_over(drawing, files());
    assert_eq!(lost, []);
    let texts: Vec<_> = texts.into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
    artwork::read_set(&texts, &Overrides::default()).files
}

#[test]
fn copies_of_a_repeat_are_edited_individually() {
    let mut drawing = Drawing::default();
    // Objects 0 to 2 are in the file: a pad, the repeat, a stroke. The repeat's objects follow, copy by copy.
    assert_eq!(caught(&drawing, mm(50.0, 50.3)).map(|(_, number)| number), Some(0));
    assert_eq!(caught(&drawing, mm(53.0, 50.0)).map(|(_, number)| number), Some(2));
    assert_eq!(caught(&drawing, mm(1.0, 1.3)).map(|(_, number)| number), Some(3));
    assert_eq!(caught(&drawing, mm(4.0, 21.3)).map(|(_, number)| number), Some(7), "rows before columns");
    assert_eq!(caught(&drawing, mm(22.5, 21.1)).map(|(_, number)| number), Some(20));
    done(&mut drawing, mm(11.0, 1.3), |one| one.removed());
    done(&mut drawing, mm(24.0, 21.3), |one| one.moved(mm(0.0, 5.0)));
    let copper = copper(&made(&drawing));
    assert!(!contains(&copper, mm(11.0, 1.3)) && contains(&copper, mm(1.0, 1.3)), "in one copy alone");
    assert!(!contains(&copper, mm(24.0, 21.3)) && contains(&copper, mm(24.0, 26.3)));
    for file in written(&drawing) {
        let again = painted(file.gerber.as_ref().unwrap()).unwrap();
        assert!((area_mm2(&again) - area_mm2(&copper)).abs() < 1e-9, "{}", file.name);
    }
}

#[test]
fn unchanged_repeats_stay_whole() {
    let repeats = |drawing: &Drawing| {
        let objects = made(drawing).files.remove(0).gerber.unwrap().objects;
        objects.iter().filter(|object| matches!(object.shape, ObjectShape::Repeat { .. })).count()
    };
    let mut drawing = Drawing::default();
    done(&mut drawing, mm(50.0, 50.3), |one| one.moved(mm(0.0, 5.0)));
    assert_eq!(repeats(&drawing), 1);
    done(&mut drawing, mm(1.0, 1.3), |one| one.moved(mm(0.0, 5.0)));
    assert_eq!(repeats(&drawing), 0);
}

#[test]
fn repeats_with_too_many_copies_are_not_selectable() {
    let text = String::from_utf8(PANEL.to_vec()).unwrap().replace("X3Y2I10J20", "X200Y200I10J20");
    let files = [("panel.gbr".to_owned(), text.into_bytes())];
    let artwork = artwork::read_set(&files, &Overrides::default());
    let numbers: Vec<u32> = imported(&artwork, &[]).iter().map(|one| one.object).collect();
    assert_eq!(numbers, [0, 2]);
}

/// A block of two pads with a track between them, flashed twice, the second time rotated; and another pad.
const BLOCKS: &[u8] = b"%TF.FileFunction,Copper,L1,Top*%%FSLAX46Y46*%%MOMM*%%ADD10C,1*%%ADD11C,0.4*%\
%ABD12*%D10*X0Y0D03*X4000000Y0D03*D11*X0Y0D02*X4000000Y0D01*%AB*%\
D12*X10000000Y10000000D03*%LR90*%X30000000Y10000000D03*%LR0*%D10*X50000000Y50000000D03*M02*";

#[test]
fn block_apertures_are_edited_as_one_object() {
    let artwork = || artwork::read_set(&[("blocks.gbr".to_owned(), BLOCKS.to_vec())], &Overrides::default());
    let objects = Arc::new(imported(&artwork(), &[0]));
    let boxes: Vec<_> = objects.iter().map(|one| Bounds::around(one.body.points.iter().copied())).collect();
    let around = |low: Point, high: Point| Some(Bounds { min: low, max: high });
    assert_eq!(boxes[..2], [around(mm(9.5, 9.5), mm(14.5, 10.5)), around(mm(29.5, 9.5), mm(30.5, 14.5))]);
    assert_eq!(objects.iter().map(|one| one.is_area).collect::<Vec<_>>(), [true, true, false]);
    let mut drawing = Drawing::default();
    let mut done = |at: Point, edit: fn(&Selection<'_>) -> Edit| {
        let finder = Finder::new(&drawing, Arc::clone(&objects));
        let catch = finder.at(&drawing, at, um(10)).into_iter().next().expect("something is caught");
        let edit = edit(&Selection::new(&drawing, &finder, &BTreeSet::from([catch])));
        drawing.apply(&edit).unwrap();
    };
    done(mm(14.0, 10.3), |one| one.moved(mm(0.0, 5.0)));
    done(mm(30.0, 12.0), |one| one.removed());
    let (mut laid, mut used) = (artwork(), vec![0]);
    assert_eq!(lay_over(&drawing, &mut laid, &mut used), []);
    let copper = painted(laid.files[0].gerber.as_ref().unwrap()).unwrap();
    for (at, is_copper) in [
        (mm(10.0, 15.0), true),
        (mm(12.0, 15.1), true),
        (mm(14.0, 15.0), true),
        (mm(12.0, 10.0), false),
        (mm(30.0, 12.0), false),
        (mm(50.0, 50.0), true),
    ] {
        assert_eq!(contains(&copper, at), is_copper, "{at:?}");
    }
    let (texts, lost) = files_over(&drawing, artwork());
    assert_eq!((texts.len(), lost), (1, Vec::new()));
    let texts: Vec<_> = texts.into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
    let again = artwork::read_set(&texts, &Overrides::default());
    let again = painted(again.files[0].gerber.as_ref().unwrap()).unwrap();
    assert!((area_mm2(&again) - area_mm2(&copper)).abs() < 1e-9);
}

#[test]
fn slots_and_routes_are_selected_edited_and_removed() {
    let mut drawing = Drawing::default();
    let number = |drawing: &Drawing, at| caught(drawing, at).map(|(_, number)| number);
    assert_eq!(
        [number(&drawing, mm(1.0, 101.0)), number(&drawing, mm(4.2, 101.0))],
        [Some(0), Some(1)],
        "holes"
    );
    assert_eq!(number(&drawing, mm(8.3, 105.5)), Some(2), "the slot");
    assert_eq!(number(&drawing, mm(26.3, 107.0)), Some(3), "the arc of the routed path");
    // The slot rotates about its centre, 8, 105.5.
    done(&mut drawing, mm(8.0, 105.5), |one| one.turned(90_000, false));
    done(&mut drawing, mm(22.0, 105.0), |one| one.array(1, 2, mm(0.0, 10.0)));
    done(&mut drawing, mm(22.0, 105.0), |one| one.removed());
    let own = made(&drawing).files.remove(1).drill.unwrap();
    let read = written(&drawing).into_iter().find_map(|file| file.drill).unwrap();
    for (drill, whose) in [(own, "as it is laid over"), (read, "as it is written and read")] {
        let ends: Vec<_> = drill.slots.iter().map(|slot| (slot.from, slot.to)).collect();
        assert_eq!(ends, [(mm(9.5, 105.5), mm(6.5, 105.5))], "{whose}");
        assert_eq!((drill.hits.len(), drill.slots[0].after_hits), (2, 1), "{whose}");
        let routes: Vec<_> = drill.routes.iter().map(|route| (route.from, route.segments.len())).collect();
        assert_eq!(routes, [(mm(20.0, 115.0), 2)], "{whose}");
    }
}

#[test]
fn pointer_snaps_to_slot_ends() {
    let finder = Finder::new(&Drawing::default(), objects());
    let snap = finder.snap(&Drawing::default(), mm(8.1, 106.9), um(300), None, &BTreeSet::new());
    assert_eq!(snap.at(), mm(8.0, 107.0));
    let slot = finder.imported().iter().find(|one| one.layer.is_none() && one.has_angle()).unwrap();
    let (low, high) = (mm(7.4, 103.4), mm(8.6, 107.6));
    assert_eq!(slot.body.bounds(), Bounds::around([low, high]).unwrap());
}

/// Grouping leaves a file object as it is. Only moving the group changes the object and rewrites its file.
#[test]
fn file_objects_are_members_of_groups() {
    let mut drawing = Drawing::default();
    let ends = (TrackEnd::At(mm(30.0, 1.0)), TrackEnd::At(mm(34.0, 1.0)));
    drawing.apply(&track(&drawing, ends, um(400), Layer::Top).0).unwrap();
    let (pad, _) = caught(&drawing, mm(50.0, 50.3)).unwrap();
    let (slot, _) = caught(&drawing, mm(8.0, 105.5)).unwrap();
    let chosen = BTreeSet::from([Catch::Drawn(all(&drawing, "track")[0]), pad, slot]);
    let finder = Finder::new(&drawing, objects());
    let (edit, group) = Selection::new(&drawing, &finder, &chosen).grouped("a");
    drawing.apply(&edit).unwrap();
    let group = group.unwrap();
    assert_eq!(drawing.hanging(group).count(), 3);
    let as_it_is = drawing.things().filter(|(_, entry)| entry.thing.is_as_in_its_file()).count();
    assert_eq!((as_it_is, written(&drawing).len()), (2, 1), "the track alone is new");
    assert_eq!(written(&drawing)[0].drill, None);
    let finder = Finder::new(&drawing, objects());
    let whole = BTreeSet::from([Catch::Drawn(group)]);
    drawing.apply(&Selection::new(&drawing, &finder, &whole).moved(mm(0.0, 3.0))).unwrap();
    let now = made(&drawing);
    assert!(contains(&copper(&now), mm(50.0, 53.3)) && !contains(&copper(&now), mm(50.0, 50.3)));
    assert_eq!(now.files[1].drill.as_ref().unwrap().slots[0].from, mm(8.0, 107.0));
    // After a reset to its original it is still a member.
    let finder = Finder::new(&drawing, objects());
    drawing.apply(&put_back(&drawing, &finder, &BTreeSet::new())).unwrap();
    assert_eq!(drawing.hanging(group).count(), 3);
    assert!(contains(&copper(&made(&drawing)), mm(50.0, 50.3)));
    // Writing and reading keeps it.
    let kept = write(&History::new(drawing.clone()));
    assert_eq!(read("a", &kept).unwrap().now(), &drawing);
}

#[test]
fn file_objects_can_join_and_leave_a_group() {
    let mut drawing = Drawing::default();
    let chosen = |of| BTreeSet::from([Catch::Imported(of)]);
    let finder = Finder::new(&drawing, objects());
    let (edit, group) = Selection::new(&drawing, &finder, &chosen(0)).grouped("a");
    drawing.apply(&edit).unwrap();
    let finder = Finder::new(&drawing, objects());
    drawing.apply(&Selection::new(&drawing, &finder, &chosen(1)).regrouped(group)).unwrap();
    assert_eq!(drawing.hanging(group.unwrap()).count(), 2);
    let finder = Finder::new(&drawing, objects());
    drawing.apply(&Selection::new(&drawing, &finder, &chosen(1)).regrouped(None)).unwrap();
    assert_eq!((drawing.hanging(group.unwrap()).count(), all(&drawing, "imported").len()), (1, 2));
}
