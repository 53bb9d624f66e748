//! Property tests of drawings.

mod apart;
mod near;
mod over;

use super::*;
use crate::artwork::{self, Form, ObjectShape, Overrides};
use crate::board::{Board, BoardWanted, Face, from_artwork_with};
use crate::chance::Chance;
use crate::geometry::{Bounds, Placement, area_mm2, contains};
use std::sync::Arc;

fn mm(x: f64, y: f64) -> Point {
    Point::from_mm(x, y)
}

fn um(um: i64) -> Length {
    Length::from_um(um)
}

fn set(ids: &[Id]) -> BTreeSet<Id> {
    ids.iter().copied().collect()
}

fn catches(ids: &[Id]) -> BTreeSet<Catch> {
    ids.iter().copied().map(Catch::Drawn).collect()
}

fn all(drawing: &Drawing, word: &str) -> Vec<Id> {
    drawing.things().filter(|(_, entry)| entry.thing.word() == word).map(|(id, _)| id).collect()
}

/// Two pads with holes, a track between them, and an edge around.
fn small() -> Drawing {
    let mut drawing = Drawing::named("small");
    for x in [5.0, 15.0] {
        let at = TrackEnd::At(mm(x, 5.0));
        let edit = pad(&drawing, at, (PadShape::Octagon, um(2_000)), Some(um(800)), Layer::Both);
        drawing.apply(&edit).unwrap();
    }
    let ends = (TrackEnd::At(mm(5.0, 5.0)), TrackEnd::At(mm(15.0, 5.0)));
    drawing.apply(&track(&drawing, ends, um(500), Layer::Top).0).unwrap();
    let corners = [(0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (0.0, 10.0), (0.0, 0.0)];
    for pair in corners.windows(2) {
        let ends = (TrackEnd::At(mm(pair[0].0, pair[0].1)), TrackEnd::At(mm(pair[1].0, pair[1].1)));
        drawing.apply(&track(&drawing, ends, um(100), Layer::Edge).0).unwrap();
    }
    drawing
}

fn board_of(drawing: &Drawing) -> (Board, Vec<crate::diagnostic::Diagnostic>) {
    let (mut artwork, mut used) = (artwork::Artwork::default(), Vec::new());
    let mut diagnostics = lay_over(drawing, &mut artwork, &mut used);
    let (board, more) = from_artwork_with(&artwork, &used, BoardWanted { copper: true, aligned: false });
    diagnostics.extend(more);
    (board, diagnostics)
}

fn some_edit(drawing: &Drawing, imported: &Arc<Vec<Imported>>, chance: &mut Chance) -> Edit {
    let ids: Vec<Id> = drawing.things().map(|(id, _)| id).collect();
    let some = |chance: &mut Chance| -> BTreeSet<Id> {
        (0..chance.below(4)).filter_map(|_| ids.get(chance.below(ids.len().max(1))).copied()).collect()
    };
    let finder = Finder::new(drawing, imported.clone());
    let chosen = |chance: &mut Chance| {
        let drawn = some(chance).into_iter().map(Catch::Drawn).collect::<BTreeSet<_>>();
        let objects = (0..chance.below(4)).map(|_| Catch::Imported(chance.below(imported.len()) as u32));
        let all = drawn.into_iter().chain(objects.filter(|_| !imported.is_empty())).collect();
        Selection::new(drawing, &finder, &all)
    };
    let place = |chance: &mut Chance| mm(chance.below(40) as f64 / 2.0, chance.below(40) as f64 / 2.0);
    let shape = PadShape::ALL[chance.below(3)];
    let layer = Layer::ALL[chance.below(4)];
    match chance.below(16) {
        0 => node(drawing, place(chance)),
        1 | 2 => track(drawing, (TrackEnd::At(place(chance)), TrackEnd::At(place(chance))), um(300), layer).0,
        3 => pad(drawing, TrackEnd::At(place(chance)), (shape, um(1_500)), Some(um(700)), layer),
        4 => hole(drawing, TrackEnd::At(place(chance)), um(900), chance.below(2) == 0),
        5 => chosen(chance).moved(place(chance)),
        6 => chosen(chance).turned(chance.below(360) as i32 * 1_000, chance.below(2) == 0),
        7 => chosen(chance).removed(),
        8 => grouped(drawing, &some(chance), "group").0,
        9 => ungrouped(drawing, &some(chance)),
        10 => chosen(chance).aligned(Align { x: chance.below(2) == 0, sides: Sides::Middle }),
        11 => chosen(chance).array(2, 2, place(chance)),
        12 => pasted(drawing, &chosen(chance).copied(), place(chance)).0,
        13 => regrouped(drawing, &some(chance), ids.get(chance.below(ids.len().max(1))).copied()),
        14 => renamed(drawing, None, &format!("name {}", chance.below(9))),
        _ => Edit::one(Id(chance.below(60) as u32), None),
    }
}

fn undone(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let mut chance = Chance::new(seed);
        let mut history = History::new(if chance.below(2) == 0 { small() } else { Drawing::named("") });
        let objects = if chance.below(2) == 0 { imported(&given(), &[1]) } else { Vec::new() };
        let objects = Arc::new(objects);
        let (first, mut refused) = (history.now().clone(), 0);
        for _ in 0..chance.below(30) {
            let (edit, before) = (some_edit(history.now(), &objects, &mut chance), history.now().clone());
            if history.make(&edit).is_err() {
                assert_eq!(*history.now(), before, "seed {seed}: what is refused changes nothing");
                refused += 1;
            }
        }
        history.rest();
        let kept = read("d", &write(&history)).unwrap_or_else(|why| panic!("seed {seed}: {why:?}"));
        assert_eq!(kept, history, "seed {seed}: kept with its edits");
        let (last, depth) = (history.now().clone(), history.depth().0);
        assert!(depth + refused <= 30, "seed {seed}");
        while history.step(true).is_some() {}
        assert_eq!(*history.now(), first, "seed {seed}: all taken back");
        while history.step(false).is_some() {}
        assert_eq!((history.now(), history.depth()), (&last, (depth, 0)), "seed {seed}: all made again");
    }
}

#[test]
fn random_edit_sequences_are_undone() {
    let all = 10_000;
    undone(0..if std::env::var_os("ANNULUS_LONG").is_some() { all } else { all / 10 });
}

#[test]
fn history_continues_from_its_earlier_states() {
    let mut history = History::new(small());
    let mut states = vec![history.clone()];
    for step in 1..=3 {
        let ids = set(&history.now().things().map(|(id, _)| id).collect::<Vec<_>>());
        let edit = moved(history.now(), &ids, mm(f64::from(step), 0.0));
        history.make(&edit).unwrap();
        states.push(history.clone());
    }
    history.step(true);
    for (at, earlier) in states.iter().enumerate() {
        assert!(history.goes_on_from(earlier), "state {at}: done, or made again");
        assert_eq!(earlier.goes_on_from(&history), at >= 2, "state {at} knows nothing of what came after it");
    }
    let mut other = History::new(small());
    let ids = set(&other.now().things().map(|(id, _)| id).collect::<Vec<_>>());
    let edit = moved(other.now(), &ids, mm(9.0, 9.0));
    other.make(&edit).unwrap();
    assert!(!other.goes_on_from(&history) && !history.goes_on_from(&other), "as many edits, but others");
}

#[test]
fn moved_node_moves_everything_attached() {
    let mut drawing = small();
    let node = drawing.node_at(mm(5.0, 5.0)).unwrap();
    assert_eq!(drawing.hanging(node).count(), 3, "pad, hole and track");
    let inverse = drawing.apply(&moved(&drawing, &set(&[node]), mm(1.0, 2.0))).unwrap();
    let ends = |drawing: &Drawing| {
        let track = all(drawing, "track")[0];
        let entry = drawing.get(track).unwrap();
        Body::of(drawing, entry).unwrap().points
    };
    assert_eq!(ends(&drawing), [mm(6.0, 7.0), mm(15.0, 5.0)]);
    drawing.apply(&inverse).unwrap();
    assert_eq!(drawing, small());
}

#[test]
fn invalid_edits_are_refused_with_a_message() {
    let drawing = small();
    let (node, track) = (all(&drawing, "node")[0], all(&drawing, "track")[0]);
    let group = grouped(&drawing, &set(&[track]), "a");
    let mut with_group = drawing;
    with_group.apply(&group.0).unwrap();
    let group = group.1.unwrap();
    let entry = |thing: Thing| Some(Entry { thing, group: None });
    let of_track = |from, to, width| entry(Thing::Track { from, to, width, layer: Layer::Top });
    let a_pad =
        |size, turn_mdeg, layer| entry(Thing::Pad { node, shape: PadShape::Square, size, turn_mdeg, layer });
    let rows = [
        ("drawing.still_needed", Edit::one(node, None)),
        ("drawing.no_length", Edit::one(Id(99), of_track(node, node, um(500)))),
        ("drawing.no_node", Edit::one(Id(99), of_track(node, Id(98), um(500)))),
        ("drawing.no_node", Edit::one(Id(99), of_track(node, track, um(500)))),
        ("drawing.no_node", Edit::one(node, entry(Thing::Group { name: String::new() }))),
        ("drawing.size", Edit::one(Id(99), a_pad(um(1), 0, Layer::Top))),
        ("drawing.size", Edit::one(Id(99), a_pad(Length::from_nm(i64::MIN), 0, Layer::Top))),
        ("drawing.turn", Edit::one(Id(99), a_pad(um(900), 90_000, Layer::Top))),
        ("drawing.pad_on_edge", Edit::one(Id(99), a_pad(um(900), 0, Layer::Edge))),
        ("drawing.too_far", Edit::one(Id(99), entry(Thing::Node { at: mm(1_000.1, 0.0) }))),
        ("drawing.long_name", Edit { name: Some("x".repeat(201)), changes: Vec::new() }),
        (
            "drawing.no_group",
            Edit::one(Id(99), Some(Entry { thing: Thing::Node { at: mm(1.0, 1.0) }, group: Some(node) })),
        ),
        (
            "drawing.group_in_itself",
            regrouped(&with_group, &set(&[group]), Some(group)).then(Edit::one(
                group,
                Some(Entry { thing: Thing::Group { name: String::new() }, group: Some(group) }),
            )),
        ),
    ];
    for (code, edit) in rows {
        let mut tried = with_group.clone();
        let why = tried.apply(&edit).unwrap_err();
        assert_eq!(why.code, code, "{edit:?}");
        assert!(!why.message("en").contains(".message"), "{code} has no sentence");
        assert_eq!(tried, with_group, "{code}");
    }
}

#[test]
fn nested_groups_are_removed_as_one() {
    let mut drawing = small();
    let mut inner = set(&[all(&drawing, "pad")[0]]);
    for depth in 0..500 {
        let (edit, group) = grouped(&drawing, &inner, &format!("depth {depth}"));
        drawing.apply(&edit).unwrap();
        inner = set(&[group.unwrap()]);
    }
    assert_eq!(drawing.leaves(&inner), set(&[all(&drawing, "pad")[0]]));
    let edit = removed(&drawing, &inner);
    drawing.apply(&edit).unwrap();
    assert!(all(&drawing, "group").is_empty());
    assert_eq!(all(&drawing, "pad").len(), 1);
    assert!(drawing.node_at(mm(5.0, 5.0)).is_some(), "hole and track still hang on it");
}

#[test]
fn copies_rotate_align_and_repeat() {
    let mut drawing = small();
    let pads = all(&drawing, "pad");
    let finder = Finder::new(&drawing, Arc::default());
    let copy = Selection::new(&drawing, &finder, &catches(&pads[..1])).copied();
    let (edit, top) = pasted(&drawing, &copy, mm(0.0, 20.0));
    drawing.apply(&edit).unwrap();
    assert_eq!(top.len(), 1, "{top:?}");
    assert!(drawing.node_at(mm(5.0, 25.0)).is_some());
    let copy = *top.first().unwrap();
    let chosen = |drawing: &mut Drawing, ids: &[Id], edit: &dyn Fn(&Selection<'_>) -> Edit| {
        let finder = Finder::new(drawing, Arc::default());
        let edit = edit(&Selection::new(drawing, &finder, &catches(ids)));
        drawing.apply(&edit).unwrap();
        let finder = Finder::new(drawing, Arc::default());
        Selection::new(drawing, &finder, &catches(ids)).bounds().unwrap()
    };
    let line = Align { x: true, sides: Sides::Low };
    chosen(&mut drawing, &[pads[1], copy], &|both| both.aligned(line));
    assert!(drawing.node_at(mm(5.0, 5.0)).is_some(), "left edges in one line");
    chosen(&mut drawing, &[copy], &|one| one.array(3, 2, mm(2.54, 7.62)));
    let pads = all(&drawing, "pad");
    assert_eq!(pads.len(), 3 + 5);
    let before = chosen(&mut drawing, &pads, &|all| all.moved(mm(1.0, 0.0)));
    let after = chosen(&mut drawing, &pads, &|all| all.turned(90_000, false));
    assert_eq!(before.max.x - before.min.x, after.max.y - after.min.y);
}

#[test]
fn written_files_read_back_to_the_nanometre() {
    let odd = |nm: i64| Length::from_nm(nm);
    let at = Point::new(odd(12_345_679), odd(-7_654_321));
    for (shape, turn_mdeg, layer) in [
        (PadShape::Circle, 0, Layer::Top),
        (PadShape::Square, 0, Layer::Top),
        (PadShape::Square, 33_000, Layer::Bottom),
        (PadShape::Octagon, 0, Layer::Both),
        (PadShape::Octagon, 11_000, Layer::Bottom),
    ] {
        let mut drawing = Drawing::named("odd");
        let size = odd(1_234_568);
        drawing.apply(&pad(&drawing, TrackEnd::At(at), (shape, size), Some(odd(800_001)), layer)).unwrap();
        let id = all(&drawing, "pad")[0];
        let Some(Thing::Pad { node, .. }) = drawing.thing(id).cloned() else { panic!() };
        drawing.apply(&put(&drawing, id, Thing::Pad { node, shape, size, turn_mdeg, layer })).unwrap();
        let ends = (TrackEnd::At(at), TrackEnd::At(Point::new(odd(1), odd(3))));
        let line = if layer == Layer::Both { Layer::Top } else { layer };
        drawing.apply(&track(&drawing, ends, odd(300_003), line).0).unwrap();
        let texts: Vec<_> =
            files(&drawing).into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
        let read = artwork::read_set(&texts, &Overrides::default());
        for file in &read.files {
            assert!(file.diagnostics.is_empty(), "{}: {:?}", file.name, file.diagnostics);
        }
        let layers: Vec<_> = read.files.iter().filter_map(|file| file.gerber.as_ref()).collect();
        assert_eq!(layers.len(), if layer == Layer::Both { 2 } else { 1 });
        let body = Body::of(&drawing, drawing.get(id).unwrap()).unwrap();
        for gerber in layers {
            let flash = gerber
                .objects
                .iter()
                .find(|object| matches!(object.shape, ObjectShape::Flash { .. }))
                .unwrap();
            assert_eq!(flash.shape, ObjectShape::Flash { at });
            match &gerber.aperture(flash).unwrap().form {
                Form::Circle { diameter } => assert_eq!((shape, *diameter), (PadShape::Circle, size)),
                Form::Rectangle { width, height } => assert_eq!((*width, *height), (size, size)),
                Form::Macro { primitives, .. } => {
                    let path = Placement::shifted(at).path(&primitives[0].1[0]);
                    assert_eq!(path.corners().take(body.points.len()).collect::<Vec<_>>(), body.points);
                }
                other => panic!("{other:?}"),
            }
        }
        let drill = read.files.iter().find_map(|file| file.drill.as_ref()).unwrap();
        assert_eq!((drill.hits[0].at, drill.tools[0].diameter), (at, Some(odd(800_001))));
        let strokes =
            read.files.iter().filter_map(|file| file.gerber.as_ref()).flat_map(|gerber| gerber.tracks());
        let strokes: Vec<_> = strokes.collect();
        assert_eq!((strokes[0].from, strokes[0].to), (at, Point::new(odd(1), odd(3))));
    }
}

#[test]
fn drawing_gives_a_complete_board() {
    let (board, diagnostics) = board_of(&small());
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    assert_eq!(board.holes.len(), 2);
    assert_eq!(board.holes[0].plated, Some(true));
    assert_eq!(board.outline.bounds(), Some(Bounds { min: mm(0.0, 0.0), max: mm(20.0, 10.0) }));
    let faces: Vec<_> =
        board.copper.iter().map(|copper| (copper.face, copper.region.islands.len())).collect();
    assert_eq!(faces, [(Face::Top, 1), (Face::Bottom, 2)]);
    // Two octagons of 2 mm have 8 (√2 − 1) mm² together; the track between them is 8 mm long.
    let top = area_mm2(&board.copper[0].region);
    assert!((top - (2.0 * 3.3137 + 8.0 * 0.5)).abs() < 0.001, "{top}");
}

const COPPER: &[u8] = b"%TF.FileFunction,Copper,L1,Top*%%FSLAX33Y33*%%MOMM*%%ADD10C,1*%D10*\
X1000Y1000D03*X5000Y1000D03*X1000Y5000D02*X5000Y5000D01*M02*";
const DRILL: &[u8] = b"M48\nMETRIC\nT1C0.5\n%\nT1\nX1.0Y1.0\nX5.0Y1.0\nM30\n";

fn given() -> artwork::Artwork {
    let files = [("a.gbr", COPPER), ("a.drl", DRILL)];
    artwork::read_set(&files.map(|(name, bytes)| (name.to_owned(), bytes.to_vec())), &Overrides::default())
}

#[test]
fn imported_objects_are_removed_moved_and_extended() {
    let artwork = given();
    let found = imported(&artwork, &[1]);
    assert_eq!(found.len(), 5, "two pads, a track, two holes");
    let mut drawing = Drawing::default();
    let about = |one: &Imported, by| over::spoken((&one.file, one.object, one.at), by);
    let things =
        [about(&found[0], None), about(&found[2], Some(mm(0.0, 2.0))), about(&found[4], Some(mm(0.0, 4.0)))];
    for thing in things {
        let id = drawing.next_id();
        drawing.apply(&Edit::one(id, Some(Entry { thing, group: None }))).unwrap();
    }
    let ends = (TrackEnd::At(mm(5.0, 1.0)), TrackEnd::At(mm(5.0, 7.0)));
    drawing.apply(&track(&drawing, ends, um(600), Layer::Top).0).unwrap();
    let (mut changed, mut used) = (given(), vec![1]);
    assert_eq!(lay_over(&drawing, &mut changed, &mut used), []);
    let (board, _) = from_artwork_with(&changed, &used, BoardWanted { copper: true, aligned: false });
    let places: Vec<_> = board.holes.iter().map(|hole| hole.at).collect();
    assert_eq!(places, [mm(1.0, 1.0), mm(5.0, 5.0)]);
    let copper = &board.copper[0].region;
    let rows = [
        ((1.0, 1.0), false),
        ((5.0, 1.0), true),
        ((3.0, 5.0), false),
        ((3.0, 7.0), true),
        ((5.0, 4.0), true),
    ];
    for ((x, y), is_copper) in rows {
        assert_eq!(contains(copper, mm(x, y)), is_copper, "{x} {y}");
    }
    assert_eq!(copper.islands.len(), 1);
    assert_eq!(given(), artwork, "the files are as they were");
    let lost = over::spoken(("a.gbr", 0, mm(2.0, 2.0)), None);
    let mut other = Drawing::default();
    other.apply(&Edit::one(Id(1), Some(Entry { thing: lost, group: None }))).unwrap();
    let said = lay_over(&other, &mut given(), &mut vec![1]);
    assert_eq!(said[0].code, "drawing.file_is_another");
}

#[test]
fn drag_is_one_undo_step() {
    let mut history = History::new(small());
    let node = history.now().node_at(mm(5.0, 5.0)).unwrap();
    for step in 1..=10 {
        let by = mm(f64::from(step) / 10.0, 0.0);
        history.make_instead(|drawing| moved(drawing, &set(&[node]), by)).unwrap();
    }
    history.rest();
    assert_eq!((history.now().at(node), history.depth()), (Some(mm(6.0, 5.0)), (1, 0)));
    history.step(true);
    assert_eq!(*history.now(), small());
}

#[test]
fn cancelled_drag_preserves_redo() {
    let mut history = History::new(small());
    let node = history.now().node_at(mm(5.0, 5.0)).unwrap();
    let edit = moved(history.now(), &set(&[node]), mm(2.0, 0.0));
    history.make(&edit).unwrap();
    history.step(true);
    let (before, by) = (history.clone(), mm(0.0, 3.0));
    history.make_instead(|drawing| moved(drawing, &set(&[node]), by)).unwrap();
    assert_eq!(history.depth(), (1, 0), "while it is dragged there is nothing to be made again");
    history.make_instead(|_| Edit::default()).unwrap();
    history.rest();
    assert_eq!(history, before);
    history.make_instead(|drawing| moved(drawing, &set(&[node]), by)).unwrap();
    history.rest();
    assert_eq!(history.depth(), (1, 0), "a drag that was let go is an edit like others");
    history.make_instead(|_| Edit::default()).unwrap();
    assert_eq!(history.depth(), (1, 0));
}

#[test]
fn drawing_files_are_validated() {
    let history = History::new(small());
    let text = write(&history);
    assert_eq!(read("d", &text).unwrap(), history);
    assert!(
        is_one(text.as_bytes()) && is_one(b" {\n\"annulus_drawing\": 1") && !is_one(DRILL) && !is_one(b"")
    );
    let rows = [
        (text.replace("\"annulus_drawing\":1", "\"annulus_drawing\":2"), "drawing.schema"),
        (text.replace("\"from\":1", "\"from\":77"), "drawing.no_node"),
        (text.replace("500000", "5"), "drawing.size"),
        (text[..text.len() / 2].to_owned(), "drawing.damaged"),
        (String::new(), "drawing.damaged"),
    ];
    for (text, code) in rows {
        assert_eq!(read("d", &text).unwrap_err().code, code);
    }
    let picture = svg(history.now());
    assert!(picture.contains("<polygon") && picture.contains("<circle") && picture.ends_with("</svg>\n"));
}

#[test]
fn robot_example_gives_the_board_of_the_manual() {
    let text = include_str!("../../../../../www/drawings/robot.json");
    assert!(is_one(text.as_bytes()));
    let history = read("robot.json", text).unwrap();
    let (board, diagnostics) = board_of(history.now());
    assert_eq!(diagnostics, []);
    assert_eq!((board.holes.len(), board.copper.len(), board.copper[0].face), (15, 1, Face::Bottom));
    assert_eq!(board.copper[0].region.islands.len(), 15 - 7, "islands");
    assert_eq!(board.outline.bounds().unwrap().max, mm(43.18, 25.4));
    let figures = DrawingFigures::new(history.now(), &Finder::new(history.now(), Arc::default()));
    let smallest = figures.smallest();
    assert_eq!(smallest.ring.unwrap().0, um(550));
    assert!(smallest.gap.unwrap().0 > um(300), "{smallest:?}");
    let picture = include_str!("../../../../../docs/pictures/robot-board.svg");
    assert_eq!(svg(history.now()), picture, "the manual's picture is the one that is written");
}
