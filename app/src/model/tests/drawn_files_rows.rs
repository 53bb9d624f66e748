//! The board editor and files: drawing over them, making a board from the drawing, saving.

use super::draw_rows::DrawnBoard;
use crate::drawing::fields::FieldValue;
use crate::drawing::scene::scene;
use crate::engine::messages::{Answer, Request};
use crate::engine::{Cache, Stopped, perform};
use crate::keys::Tab;
use crate::layers::LayerKind;
use crate::model::drawing::DrawingExport;
use crate::model::{Document, DrawEvent, Effect, Event, FilesEvent, FrameEvent, ToastAct};
use crate::said::Text;
use crate::view::Palette;
use annulus_core::board::drawing::{self, Catch, Layer};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::units::Length;
use std::sync::Arc;

fn alone(request: Request) -> Result<Answer, Vec<Diagnostic>> {
    perform(request, &mut Cache::default(), &mut |_, _| {})
}

fn asked(effects: &[Effect]) -> Option<(u32, Request)> {
    effects.iter().find_map(|effect| match effect {
        Effect::Ask { number, request, .. } => Some((*number, (**request).clone())),
        _ => None,
    })
}

#[test]
fn drawn_board_is_read_like_uploaded_files() {
    let mut sheet = DrawnBoard::tell("key:p at:5,5 at:15,5 key:x at:5,5 at:15,5 key:End");
    sheet.event(DrawEvent::Use { tab: Tab::Cam });
    let Some((number, Request::Read(wanted))) = asked(&sheet.out) else { panic!("{:?}", sheet.out) };
    assert_eq!(wanted.files.len(), 1);
    let kept = drawing::read("d", std::str::from_utf8(&wanted.files[0].1).unwrap()).unwrap();
    assert_eq!(kept.now(), sheet.drawing());
    let Ok(Answer::Read(reading)) = alone(Request::Read(wanted)) else { panic!() };
    assert_eq!((reading.board.holes.len(), reading.layers.len()), (2, 1), "{:?}", reading.files);
    sheet.event(Event::Answered { number, answer: Ok(Answer::Read(reading)) });
    assert_eq!(sheet.model.frame.tab, Tab::Cam);
    assert!(!sheet.model.draw.is_ahead());
    // Back in the editor, one more object is drawn: the CAM screen makes the board again and keeps the job.
    sheet.event(FrameEvent::Show { tab: Tab::Draw });
    sheet.word("key:o");
    sheet.word("at:20,20");
    assert!(sheet.model.draw.is_ahead());
    sheet.event(FrameEvent::Show { tab: Tab::Cam });
    let read = sheet
        .out
        .iter()
        .any(|effect| matches!(effect, Effect::Ask { request, .. } if matches!(**request, Request::Read(_))));
    assert!(read, "{:?}", sheet.out);
}

const COPPER: &[u8] = b"%TF.FileFunction,Copper,L1,Top*%%FSLAX33Y33*%%MOMM*%%ADD10C,1*%D10*\
X1000Y1000D03*X5000Y1000D03*X1000Y5000D02*X5000Y5000D01*M02*";
const DRILL: &[u8] = b"M48\nMETRIC\nT1C0.5\n%\nT1\nX1.0Y1.0\nX5.0Y1.0\nM30\n";

pub(super) fn over_files() -> DrawnBoard {
    let sheet = over(DRILL);
    assert_eq!(sheet.model.draw.editor.finder().imported().len(), 5);
    sheet
}

#[test]
fn file_outline_is_faint_under_the_drawing() {
    let mut sheet = DrawnBoard::default();
    let edge = "%TF.FileFunction,Profile,NP*%%FSLAX33Y33*%%MOMM*%%ADD10C,0.1*%D10*\
                X-1000Y-1000D02*X9000Y-1000D01*X9000Y7000D01*X-1000Y7000D01*X-1000Y-1000D01*M02*";
    let files = [("a.gbr", COPPER), ("a.drl", DRILL), ("a-edge.gbr", edge.as_bytes())];
    open_files(&mut sheet, files.map(|(name, bytes)| (name.to_owned(), bytes.to_vec())).to_vec());
    let palette = Palette::DARK;
    let seen = |sheet: &DrawnBoard| {
        let shown = &sheet.model.draw.shown;
        scene((&shown.sheet, &shown.under), &shown.chosen, (Layer::Top, None), &palette)
    };
    let lines = seen(&sheet).lines;
    let mut corners: Vec<[i32; 2]> = lines.iter().map(|line| line.a_mm.map(|mm| mm as i32)).collect();
    corners.sort_unstable();
    assert_eq!(corners, [[-1, -1], [-1, 7], [9, -1], [9, 7]]);
    assert!(lines.iter().all(|line| line.a_mm != line.b_mm && line.colour != palette.outline));
    assert_eq!(seen(&sheet).wanted_mm, Some([[-7.0, -8.0], [15.0, 14.0]]), "all of it is looked at");
    sheet.event(DrawEvent::Over { on: false });
    assert_eq!(seen(&sheet).lines, []);
}

fn over(drill: &[u8]) -> DrawnBoard {
    let mut sheet = DrawnBoard::default();
    open_over(&mut sheet, drill);
    sheet
}

fn open_over(sheet: &mut DrawnBoard, drill: &[u8]) {
    open_files(sheet, vec![("a.gbr".to_owned(), COPPER.to_vec()), ("a.drl".to_owned(), drill.to_vec())]);
}

fn open_files(sheet: &mut DrawnBoard, files: Vec<(String, Vec<u8>)>) {
    sheet.event(FilesEvent::Chosen { files });
    let (number, request) = asked(&sheet.out).unwrap();
    let answer = alone(request);
    sheet.event(Event::Answered { number, answer: answer.map_err(Stopped::Refused) });
    sheet.event(FrameEvent::Show { tab: Tab::Draw });
    let (number, request) = asked(&sheet.out).unwrap();
    assert!(matches!(request, Request::Trace(_)), "{request:?}");
    let answer = alone(request);
    sheet.event(Event::Answered { number, answer: answer.map_err(Stopped::Refused) });
}

/// After a reload the drawing of this tab is open before the files that it refers to; without them it is no
/// board.
#[test]
fn drawing_over_files_waits_for_them_after_a_reload() {
    let mut before = over_files();
    before.word("at:1,1.4");
    before.word("key:Delete");
    let text = drawing::write(before.model.draw.editor.history());
    let mut sheet = DrawnBoard::default();
    sheet.event(DrawEvent::Found { own: Some((Some(0), text)), earlier: Vec::new() });
    assert!(sheet.model.draw.is_of_files_elsewhere());
    sheet.event(FrameEvent::Show { tab: Tab::Board });
    assert_eq!(asked(&sheet.out).map(|(number, _)| number), None, "no board is made of it");
    open_over(&mut sheet, DRILL);
    assert_eq!(sheet.drawing(), before.drawing());
    assert_eq!((sheet.model.draw.over(), sheet.model.draw.is_of_files_elsewhere()), ((true, true), false));
    assert_eq!(places(&sheet), places(&before));
    sheet.event(FrameEvent::Show { tab: Tab::Board });
    let Some((_, Request::Read(wanted))) = asked(&sheet.out) else { panic!("{:?}", sheet.out) };
    assert_eq!(wanted.files.len(), 3, "the files with what is drawn over them");
}

#[test]
fn slot_of_a_file_can_be_selected_and_removed() {
    let mut sheet =
        over(b"M48\nMETRIC\nT1C0.5\nT2C1.2\n%\nG90\nG05\nT1\nX1.0Y1.0\nT2\nX8.0Y4.0G85X8.0Y7.0\nM30\n");
    let slots = |sheet: &DrawnBoard| {
        let slots = sheet.model.draw.shown.sheet.slots.iter();
        slots.map(|slot| (slot.path_mm.clone(), slot.width)).collect::<Vec<_>>()
    };
    assert_eq!(slots(&sheet), [(vec![[8.0, 4.0], [8.0, 7.0]], Length::from_um(1_200))]);
    for word in ["at:8.4,5.5", "key:Delete"] {
        sheet.word(word);
    }
    assert_eq!((slots(&sheet), sheet.of("imported").len()), (Vec::new(), 1));
    sheet.event(DrawEvent::Use { tab: Tab::Cam });
    let Some((_, Request::Read(wanted))) = asked(&sheet.out) else { panic!("{:?}", sheet.out) };
    let Ok(Answer::Read(reading)) = alone(Request::Read(wanted)) else { panic!() };
    assert_eq!((reading.board.holes.len(), reading.board.slots.len()), (1, 0));
}

#[test]
fn file_objects_can_be_removed_moved_and_extended() {
    let mut sheet = over_files();
    for word in ["at:1,1.4", "key:Delete", "drag:3,5>3,7", "key:x", "at:5,1", "at:5,7", "key:End"] {
        sheet.word(word);
    }
    assert_eq!((sheet.of("imported").len(), sheet.of("track").len()), (2, 1), "{:?}", sheet.drawing());
    sheet.event(DrawEvent::Use { tab: Tab::Cam });
    let Some((_, Request::Read(wanted))) = asked(&sheet.out) else { panic!("{:?}", sheet.out) };
    assert_eq!(wanted.files.len(), 3);
    assert_eq!(
        (wanted.files[0].1.as_slice(), wanted.files[1].1.as_slice()),
        (COPPER, DRILL),
        "the files stay as they are"
    );
    let Ok(Answer::Read(reading)) = alone(Request::Read(wanted)) else { panic!() };
    assert_eq!((reading.layers[0].islands, reading.board.holes.len()), (1, 2));
    // Undone: the drawing no longer refers to the files.
    sheet.event(DrawEvent::Escape);
    sheet.event(DrawEvent::Act { act: crate::drawing::Act::PutBack });
    assert_eq!(sheet.of("imported"), []);
    assert_eq!(sheet.model.draw.editor.said, Some(Text::of("page.draw.all_put_back")));
    while sheet.model.draw.editor.can_undo().0 {
        sheet.word("key:Ctrl+z");
    }
    assert!(sheet.drawing().is_empty());
}

pub(super) fn places(sheet: &DrawnBoard) -> Vec<(f64, f64)> {
    let editor = &sheet.model.draw.editor;
    let objects = (0..editor.finder().imported().len() as u32).map(Catch::Imported);
    let copies = editor.drawing().things().map(|(id, _)| Catch::Drawn(id));
    let there = |catch: &Catch| editor.finder().body(*catch).is_some();
    let all = objects.chain(copies).filter(there).filter_map(|catch| editor.place_of(catch));
    all.map(|at| (at.x.mm(), at.y.mm())).collect()
}

#[test]
fn file_objects_are_cut_and_pasted_with_drawn_ones() {
    let mut sheet = over_files();
    for word in ["key:p", "at:20,20", "key:v", "key:Ctrl+a", "key:Ctrl+x"] {
        sheet.word(word);
    }
    assert_eq!((places(&sheet), sheet.of("pad").len()), (Vec::new(), 0));
    for word in ["hover:11,21", "key:Ctrl+v"] {
        sheet.word(word);
    }
    // Its lower left corner was at 1, 1.
    let moved = [(11.0, 21.0), (15.0, 21.0), (11.0, 25.0), (11.0, 21.0), (15.0, 21.0)];
    assert_eq!((places(&sheet).as_slice(), sheet.of("pad").len()), (moved.as_slice(), 1));
    assert_eq!(sheet.model.draw.editor.chosen.len(), 7, "pad, its hole, five copies");
    for word in ["key:Ctrl+z", "key:Ctrl+z"] {
        sheet.word(word);
    }
    assert_eq!((places(&sheet).len(), sheet.of("pad").len()), (5, 1), "an edit each");
}

#[test]
fn each_transform_of_file_objects_is_one_edit() {
    use crate::drawing::Act;
    use annulus_core::board::drawing::{Align, Sides};
    use annulus_core::geometry::Point;
    let mut sheet = over_files();
    let first = places(&sheet);
    let line = Act::Align(Align { x: false, sides: Sides::Low });
    let array = Act::Array { columns: 2, rows: 1, step: Point::from_mm(30.0, 0.0) };
    let rows: [(Act, &[(f64, f64)]); 5] = [
        // Everything together extends from 0.5 to 5.5 in X and Y.
        (Act::Turn { mdeg: 90_000 }, &[(5.0, 1.0), (5.0, 5.0), (1.0, 1.0), (5.0, 1.0), (5.0, 5.0)]),
        (Act::Mirror { x: true }, &[(5.0, 1.0), (1.0, 1.0), (5.0, 5.0), (5.0, 1.0), (1.0, 1.0)]),
        (line, &[(1.0, 1.0), (5.0, 1.0), (1.0, 1.0), (1.0, 0.75), (5.0, 0.75)]),
        (array, &[]),
        (Act::Duplicate, &[]),
    ];
    for (act, wanted) in rows {
        sheet.word("key:Ctrl+a");
        sheet.event(DrawEvent::Act { act });
        let now = places(&sheet);
        if wanted.is_empty() {
            assert_eq!((now.len(), &now[..5]), (10, first.as_slice()), "{act:?}");
        } else {
            assert_eq!(now, wanted, "{act:?}");
        }
        sheet.word("key:Ctrl+z");
        assert_eq!((places(&sheet), sheet.model.draw.editor.can_undo().0), (first.clone(), false), "{act:?}");
    }
}

#[test]
fn properties_of_file_objects_are_shown_and_typed() {
    let mut sheet = over_files();
    let rows = |sheet: &DrawnBoard| {
        let word = |row: &crate::drawing::fields::FieldRow| (row.field.word(), row.value.clone());
        crate::drawing::fields::rows(&sheet.model.draw.editor).iter().map(word).collect::<Vec<_>>()
    };
    let length = |mm: f64| FieldValue::Length(Some(Length::from_mm(mm)));
    sheet.event(DrawEvent::ChooseImported { of: 2 });
    let angle = |mdeg| FieldValue::Turn(Some(mdeg));
    let shown = [
        ("x", length(1.0)),
        ("y", length(5.0)),
        ("by_x", length(0.0)),
        ("by_y", length(0.0)),
        ("turn", angle(0)),
    ];
    assert_eq!(rows(&sheet), shown);
    for word in ["set:turn=30", "set:x=4"] {
        sheet.word(word);
    }
    let now = rows(&sheet);
    assert_eq!((&now[0], &now[4]), (&("x", length(4.0)), &("turn", angle(30_000))));
    sheet.event(DrawEvent::ChooseImported { of: 0 });
    assert_eq!(rows(&sheet).len(), 4, "what is round has no angle");
    // A drawn pad and an imported object: one box, one move.
    for word in ["key:p", "at:20,20", "key:v", "key:Ctrl+a", "set:x=10"] {
        sheet.word(word);
    }
    let low = sheet.model.draw.editor.selection().bounds().unwrap().min.x;
    assert_eq!(low, Length::from_mm(10.0));
}

#[test]
fn pasted_objects_of_closed_files_are_dropped_with_a_message() {
    let mut sheet = over_files();
    for word in ["key:p", "at:20,20", "key:v", "key:Ctrl+a", "key:Ctrl+c"] {
        sheet.word(word);
    }
    sheet.event(DrawEvent::New);
    sheet.event(DrawEvent::Over { on: false });
    sheet.word("key:Ctrl+v");
    assert_eq!(sheet.model.draw.editor.said, Some(Text::of("page.draw.not_here")));
    assert_eq!([sheet.of("pad").len(), sheet.of("imported").len()], [1, 0]);
}

#[test]
fn drawing_over_files_is_saved_with_the_changed_files() {
    let mut sheet = over_files();
    for word in ["key:p", "at:20,20", "key:v", "at:1,1.4", "key:Ctrl+d"] {
        sheet.word(word);
    }
    let save = |sheet: &mut DrawnBoard, what| {
        sheet.event(DrawEvent::Export { what });
        let (number, request) = asked(&sheet.out).expect("the worker reads the files");
        let answer = alone(request).map_err(Stopped::Refused);
        sheet.event(Event::Answered { number, answer });
        let saved = sheet.out.iter().find_map(|effect| match effect {
            Effect::Save { name, bytes, .. } => Some((name.clone(), bytes.clone())),
            _ => None,
        });
        saved.expect("a file")
    };
    let (name, zip) = save(&mut sheet, DrawingExport::Board);
    assert_eq!(name, "board.zip");
    let read = annulus_core::artwork::read_set(&[(name, zip)], &annulus_core::artwork::Overrides::default());
    let own = |file: &annulus_core::artwork::FileRead| file.name.rsplit('/').next().unwrap().to_owned();
    let mut names: Vec<String> = read.files.iter().map(own).filter(|own| own != "board.zip").collect();
    names.sort();
    assert_eq!(
        names,
        ["a.gbr", "board-plated.drl", "board-top.gbr"],
        "the holes of the files are as they were"
    );
    let copper = read.files.iter().find(|file| own(file) == "a.gbr").unwrap().gerber.as_ref().unwrap();
    assert_eq!(copper.pads().len(), 3);
    let (name, picture) = save(&mut sheet, DrawingExport::Svg);
    let picture = String::from_utf8(picture).unwrap();
    assert_eq!((name.as_str(), picture.matches("<circle").count()), ("board.svg", 3), "all holes");
}

#[test]
fn locked_layers_refuse_selection_and_drawing() {
    let mut sheet = over_files();
    let line = |sheet: &DrawnBoard, kind| {
        sheet.model.frame.layers.iter().position(|look| look.kind == kind).expect("its line in the panel")
    };
    let (copper, holes) = (line(&sheet, LayerKind::CopperTop), line(&sheet, LayerKind::Holes));
    let chosen = |sheet: &DrawnBoard| sheet.model.draw.editor.chosen.len();
    sheet.word("at:1,1.4");
    assert_eq!(chosen(&sheet), 1, "a pad");
    sheet.event(FrameEvent::LayerLock { index: copper });
    sheet.word("key:Delete");
    assert_eq!(sheet.of("imported"), [], "it is not taken out");
    assert_eq!(sheet.model.draw.editor.said, Some(Text::of("page.draw.locked")));
    sheet.event(DrawEvent::Escape);
    sheet.word("at:3,5");
    assert_eq!(chosen(&sheet), 0, "a track of it is not caught");
    sheet.word("drag:8,8>0,0");
    assert_eq!(chosen(&sheet), 2, "a box takes the holes");
    sheet.event(FrameEvent::LayerLock { index: holes });
    sheet.word("key:Ctrl+a");
    assert_eq!(chosen(&sheet), 0, "nothing is left to be chosen");
    for word in ["key:p", "at:20,20", "key:o", "at:25,25"] {
        sheet.word(word);
        assert!(sheet.drawing().is_empty(), "nothing comes onto it: {word}");
    }
    assert_eq!(sheet.model.draw.editor.said, Some(Text::of("page.draw.locked")), "and that is said");
    for index in [copper, holes] {
        sheet.event(FrameEvent::LayerLock { index });
    }
    sheet.word("at:25,25");
    assert!(!sheet.drawing().is_empty());
}

#[test]
fn locked_layer_blocks_moves_of_attached_nodes() {
    let mut sheet = DrawnBoard::tell("key:p at:5,5 key:v at:5,5");
    sheet.model.draw.editor.locked.holes = true;
    let before = sheet.drawing().clone();
    let ids = sheet.drawing().things().map(|(id, _)| Catch::Drawn(id)).collect();
    sheet.model.draw.editor.chosen = ids;
    sheet.model.draw.editor.nudge((1, 0), Length::from_um(500));
    assert_eq!(*sheet.drawing(), before, "the pad would take its hole with it");
    sheet.model.draw.editor.locked.holes = false;
    sheet.model.draw.editor.nudge((1, 0), Length::from_um(500));
    assert_ne!(*sheet.drawing(), before);
}

#[test]
fn file_object_is_selected_by_its_list_index() {
    let mut sheet = over_files();
    sheet.event(DrawEvent::ChooseImported { of: 1 });
    let editor = &sheet.model.draw.editor;
    assert_eq!(editor.chosen, [Catch::Imported(1)].into());
    assert_eq!(Some(editor.aim.at()), editor.place_of(Catch::Imported(1)), "the cross-hair stands on it");
    sheet.word("key:Delete");
    assert_eq!(sheet.of("imported").len(), 1);
    sheet.event(DrawEvent::ChooseImported { of: 1 });
    assert!(sheet.model.draw.editor.chosen.is_empty(), "what was taken out is not chosen");
}

pub(super) fn board_of(words: &str) -> DrawnBoard {
    let mut sheet = DrawnBoard::tell(words);
    sheet.event(DrawEvent::Use { tab: Tab::Cam });
    answer(&mut sheet);
    assert!(!sheet.model.draw.is_ahead());
    sheet
}

pub(super) fn answer(sheet: &mut DrawnBoard) {
    let (number, request) = asked(&sheet.out).unwrap();
    let answer = alone(request);
    sheet.event(Event::Answered { number, answer: answer.map_err(Stopped::Refused) });
}

/// The drawing as a file of a project, with the name of an unnamed drawing.
pub(super) fn as_file(sheet: &DrawnBoard) -> Vec<(String, Vec<u8>)> {
    vec![("board.drawing.json".to_owned(), drawing::write(sheet.model.draw.editor.history()).into_bytes())]
}

#[test]
fn project_replaces_the_drawing_and_offers_the_previous_one() {
    let other = DrawnBoard::tell("key:o at:1,1 at:20,20");
    let mut sheet = board_of("key:p at:5,5 at:9,9");
    let before = sheet.model.draw.editor.history().clone();
    sheet.event(FilesEvent::Chosen { files: as_file(&other) });
    answer(&mut sheet);
    assert_eq!(sheet.drawing(), other.drawing());
    assert!(!sheet.model.draw.is_ahead());
    let number = sheet.model.frame.toasts.last().expect("the one before is offered").number;
    sheet.event(FrameEvent::Taken { number });
    assert_eq!(*sheet.model.draw.editor.history(), before);
}

#[test]
fn drawing_that_continues_the_project_stays_open() {
    let project = DrawnBoard::tell("key:p at:5,5");
    let mut sheet = DrawnBoard::tell("key:p at:5,5 at:9,9");
    sheet.event(FilesEvent::Chosen { files: as_file(&project) });
    answer(&mut sheet);
    assert_ne!(sheet.drawing(), project.drawing());
    assert!(sheet.model.draw.is_ahead(), "the board is not made of it yet");
}

/// A board is open, and another one is made from a drawing that is not over its files.
fn in_place_of_files() -> (DrawnBoard, Arc<Document>) {
    let mut sheet = over_files();
    sheet.event(DrawEvent::Over { on: false });
    for word in ["key:p", "at:5,5"] {
        sheet.word(word);
    }
    let open = sheet.model.board.document.clone().unwrap();
    sheet.event(DrawEvent::Use { tab: Tab::Cam });
    answer(&mut sheet);
    (sheet, open)
}

#[test]
fn replaced_board_is_named_and_can_be_restored() {
    let (mut sheet, open) = in_place_of_files();
    let is_open = |sheet: &DrawnBoard| Arc::ptr_eq(sheet.model.board.document.as_ref().unwrap(), &open);
    let drawing = sheet.model.draw.editor.history().clone();
    assert!(!is_open(&sheet) && !sheet.model.draw.is_ahead());
    let toast = sheet.model.frame.toasts.last().expect("the one before is offered").clone();
    let name = open.reading.board.name.clone();
    let text = Text::Key { key: "page.draw.in_place_of", args: vec![("name", name)] };
    assert_eq!((toast.act, toast.text), (Some(ToastAct::BoardBefore), text));
    sheet.event(FrameEvent::Taken { number: toast.number });
    assert!(is_open(&sheet));
    assert_eq!((sheet.model.draw.editor.history(), sheet.model.draw.over()), (&drawing, (false, true)));
    // The drawing does not belong to the open board: visiting the CAM screen makes no board from it.
    for tab in [Tab::Draw, Tab::Cam] {
        sheet.event(FrameEvent::Show { tab });
    }
    assert!(is_open(&sheet) && sheet.model.draw.is_ahead());
    assert!(!sheet.out.iter().any(
        |effect| matches!(effect, Effect::Ask { request, .. } if matches!(**request, Request::Read(_)))
    ));
}

#[test]
fn previous_board_is_released_with_its_notification() {
    let (mut sheet, _) = in_place_of_files();
    let number = sheet.model.frame.toasts.last().unwrap().number;
    assert!(sheet.model.before.is_some());
    sheet.event(FrameEvent::Said { number });
    assert!(sheet.model.before.is_none());
    // The toast disappears if a review offers the way back, or if there is none.
    for event in [FilesEvent::Review, FilesEvent::Discarded] {
        let (mut sheet, _) = in_place_of_files();
        sheet.event(event);
        assert_eq!(sheet.model.frame.toasts, []);
    }
}

#[test]
fn project_is_saved_with_the_current_drawing() {
    let mut sheet = board_of("key:p at:5,5 at:9,9");
    sheet.event(FrameEvent::Show { tab: Tab::Draw });
    sheet.word("key:o");
    sheet.word("at:20,20");
    sheet.event(DrawEvent::Save);
    let Some((_, Request::Save(project))) = asked(&sheet.out) else { panic!("{:?}", sheet.out) };
    let saved = drawing::read("d", std::str::from_utf8(&project.files[0].1).unwrap()).unwrap();
    assert_eq!((project.files.len(), saved.now()), (1, sheet.drawing()));
    assert!(project.job.is_some());
    // If the open board was not made from it, the drawing is saved alone.
    let mut apart = over_files();
    apart.event(DrawEvent::Over { on: false });
    apart.word("key:p");
    apart.word("at:5,5");
    apart.event(DrawEvent::Save);
    assert!(matches!(apart.out.first(), Some(Effect::Save { .. })), "{:?}", apart.out);
}

#[test]
fn example_drawing_is_not_placed_over_open_files() {
    let mut sheet = over_files();
    assert_eq!(sheet.model.draw.over(), (true, true));
    let example = include_str!("../../../../www/drawings/robot.json");
    let look = sheet.model.draw.look;
    sheet.event(DrawEvent::Opened { place: None, is_copy: false, text: Some(example.to_owned()) });
    assert_eq!(sheet.model.draw.over(), (false, true));
    assert!(sheet.model.draw.editor.finder().imported().is_empty());
    assert!(sheet.model.draw.look.0 > look.0 && sheet.model.draw.look.1.is_none(), "all of it is looked at");
    let open = sheet.model.board.document.clone().map(|open| open.files.len());
    sheet.event(FrameEvent::Show { tab: Tab::Cam });
    assert_eq!(asked(&sheet.out).map(|(number, _)| number), None, "the open board stays as it is");
    assert_eq!(sheet.model.board.document.as_ref().map(|open| open.files.len()), open);
}

#[test]
fn drawing_is_exported_as_board_svg_and_json() {
    let mut sheet = DrawnBoard::tell("key:p at:5,5 escape escape set:name=my_board");
    let mut name = |what| {
        sheet.event(DrawEvent::Export { what });
        match sheet.out.first() {
            Some(Effect::Save { name, bytes, .. }) if !bytes.is_empty() => name.clone(),
            other => panic!("{other:?}"),
        }
    };
    let names = [DrawingExport::Board, DrawingExport::Svg, DrawingExport::Drawing].map(&mut name);
    assert_eq!(names, ["my_board.zip", "my_board.svg", "my_board.drawing.json"]);
    let mut empty = DrawnBoard::default();
    empty.event(DrawEvent::Export { what: DrawingExport::Board });
    assert!(empty.out.is_empty() && empty.model.draw.editor.said.is_some());
}
