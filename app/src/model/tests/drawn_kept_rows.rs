//! Saved drawings: saving during edits, reopening after a reload, offers, discarding.

use super::draw_rows::DrawnBoard;
use super::drawn_files_rows::{answer, as_file, board_of};
use crate::keys::Tab;
use crate::model::drawing::Earlier;
use crate::model::{DrawEvent, Effect, FilesEvent, FrameEvent, KeepEvent, Model};
use annulus_core::board::drawing;

fn kept(effects: &[Effect]) -> Option<(u32, Option<u32>, String)> {
    effects.iter().find_map(|effect| match effect {
        Effect::KeepDrawing { of, place, text, .. } => Some((*of, *place, text.clone())),
        _ => None,
    })
}

#[test]
fn reload_restores_the_drawing_with_its_history() {
    let mut sheet = DrawnBoard::tell("key:p at:5,5 at:9,9 key:Ctrl+z");
    sheet.event(DrawEvent::Rested);
    let (of, place, text) = kept(&sheet.out).unwrap();
    assert_eq!(place, None);
    sheet.event(DrawEvent::Kept { of, place: Some(3) });
    assert_eq!(sheet.out, [Effect::OwnDrawing { place: Some(3) }]);
    let mut again = DrawnBoard { model: Model::default(), out: Vec::new(), all: Vec::new() };
    again.event(FrameEvent::Show { tab: Tab::Draw });
    assert_eq!(again.out, [Effect::LookForDrawings { own: true }]);
    again.event(DrawEvent::Found { own: Some((Some(3), text)), earlier: Vec::new() });
    assert_eq!(again.model.draw.editor.history(), sheet.model.draw.editor.history());
    again.word("key:Ctrl+y");
    assert_eq!(again.counts(), "0/2/2/2/0 2/0 0");
    // The next save uses the same slot.
    again.event(DrawEvent::Rested);
    assert_eq!(kept(&again.out).map(|(_, place, _)| place), Some(Some(3)));
}

/// After a crash another tab restores the project: the saved drawing that continues the project's drawing is
/// opened.
#[test]
fn later_edits_are_restored_with_their_project() {
    let words = "key:p at:5,5";
    let project = board_of(words);
    let later = DrawnBoard::tell(&format!("{words} at:9,9"));
    let other = DrawnBoard::tell("key:o at:1,1");
    for (kept, comes) in [(&later, true), (&other, false)] {
        let mut sheet = DrawnBoard { model: Model::default(), out: Vec::new(), all: Vec::new() };
        sheet.event(FilesEvent::Chosen { files: as_file(&project) });
        answer(&mut sheet);
        sheet.event(FrameEvent::Show { tab: Tab::Draw });
        let earlier = Earlier { place: 2, name: String::new(), at_ms: 1.0, elsewhere: false };
        sheet.event(DrawEvent::Found { own: None, earlier: vec![earlier.clone()] });
        assert_eq!(sheet.out, [Effect::TakeDrawing { place: 2 }]);
        let (text, said) = (drawing::write(kept.model.draw.editor.history()), sheet.model.frame.toasts.len());
        sheet.event(DrawEvent::Opened { place: Some(2), is_copy: false, text: Some(text) });
        let wanted = if comes { kept } else { &project };
        assert_eq!((sheet.drawing(), sheet.model.draw.is_ahead()), (wanted.drawing(), comes));
        assert_eq!(sheet.model.frame.toasts.len() - said, usize::from(comes), "it is said");
        sheet.event(DrawEvent::Found { own: None, earlier: vec![earlier] });
        assert!(!sheet.out.iter().any(|effect| matches!(effect, Effect::TakeDrawing { .. })), "once");
    }
}

#[test]
fn drawing_is_saved_while_editing_and_on_leaving() {
    let mut sheet = DrawnBoard::tell("key:p at:5,5");
    let waits = |out: &[Effect]| out.iter().any(|effect| matches!(effect, Effect::Wake { .. }));
    sheet.word("at:9,9");
    assert!(!waits(&sheet.out), "the first edit becomes half a second old, whatever follows");
    sheet.event(DrawEvent::Rested);
    let (of, _, text) = kept(&sheet.out).unwrap();
    assert_eq!(drawing::read("d", &text).unwrap().now(), sheet.drawing());
    // One more edit while the store is busy, then the page closes: with a slot, nothing is lost.
    sheet.word("at:2,2");
    sheet.event(DrawEvent::Kept { of, place: Some(3) });
    sheet.word("at:3,3");
    sheet.event(KeepEvent::Leaving);
    let left = sheet.out.iter().find_map(|effect| match effect {
        Effect::LeaveDrawing { place: 3, text, .. } => Some(text.clone()),
        _ => None,
    });
    assert_eq!(drawing::read("d", &left.unwrap()).unwrap().now(), sheet.drawing());
    // Everything is saved: nothing is left to write.
    loop {
        sheet.event(DrawEvent::Kept { of, place: Some(3) });
        if kept(&sheet.out).is_none() {
            break;
        }
    }
    sheet.event(KeepEvent::Leaving);
    assert!(!sheet.out.iter().any(|effect| matches!(effect, Effect::LeaveDrawing { .. })), "{:?}", sheet.out);
}

#[test]
fn failed_save_of_a_drawing_is_retried_and_reported() {
    let mut sheet = DrawnBoard::tell("key:p at:5,5");
    for round in 0..2 {
        sheet.event(KeepEvent::Looked);
        if round == 0 {
            sheet.event(DrawEvent::Rested);
        }
        let (of, ..) = kept(&sheet.out).expect("it is tried again when the page is looked at");
        sheet.event(DrawEvent::Kept { of, place: None });
        assert!(sheet.model.draw.unkept());
        assert_eq!(sheet.model.frame.toasts.len(), 1, "it is said once");
    }
    let guards = |sheet: &DrawnBoard| {
        let guard = |effect: &Effect| if let Effect::Guard { on } = effect { Some(*on) } else { None };
        sheet.all.iter().filter_map(guard).collect::<Vec<_>>()
    };
    assert_eq!(guards(&sheet), [true], "the browser asks before the page is left");
    sheet.event(KeepEvent::Looked);
    let (of, ..) = kept(&sheet.out).unwrap();
    sheet.event(DrawEvent::Kept { of, place: Some(1) });
    assert!(!sheet.model.draw.unkept());
    assert_eq!(guards(&sheet), [true, false]);
    sheet.event(KeepEvent::Looked);
    assert_eq!(kept(&sheet.out), None);
}

#[test]
fn forgotten_drawing_is_deleted_unless_restored() {
    let earlier = || Earlier { place: 2, name: "one".to_owned(), at_ms: 1.0, elsewhere: false };
    let drops = |out: &[Effect]| out.iter().any(|effect| matches!(effect, Effect::DropDrawing { place: 2 }));
    for takes_back in [false, true] {
        let mut sheet = DrawnBoard::tell("key:p at:5,5");
        sheet.event(DrawEvent::Found { own: None, earlier: vec![earlier()] });
        sheet.event(DrawEvent::Forget { place: 2 });
        assert!(!drops(&sheet.out) && sheet.model.draw.earlier().is_empty());
        sheet.event(DrawEvent::Found { own: None, earlier: vec![earlier()] });
        assert!(sheet.model.draw.earlier().is_empty(), "it is not on offer meanwhile");
        if takes_back {
            let number = sheet.model.frame.toasts.last().expect("it can be taken back").number;
            sheet.event(FrameEvent::Taken { number });
            sheet.event(DrawEvent::Found { own: None, earlier: vec![earlier()] });
            assert_eq!(*sheet.model.draw.earlier(), [earlier()]);
        }
        sheet.event(DrawEvent::Drop { place: 2 });
        assert_eq!(drops(&sheet.out), !takes_back);
    }
}

#[test]
fn drawing_of_another_tab_is_copied_to_a_new_slot() {
    let sheet = DrawnBoard::tell("key:p at:5,5");
    let text = drawing::write(sheet.model.draw.editor.history());
    let mut own = DrawnBoard::default();
    own.event(DrawEvent::Found { own: Some((None, text.clone())), earlier: Vec::new() });
    let mut fetched = DrawnBoard::default();
    fetched.event(DrawEvent::Opened { place: None, is_copy: true, text: Some(text) });
    for mut copy in [own, fetched] {
        assert_eq!(copy.drawing(), sheet.drawing());
        assert_eq!(copy.model.frame.toasts.len(), 1, "it is said");
        copy.event(DrawEvent::Rested);
        assert_eq!(kept(&copy.out).map(|(_, place, _)| place), Some(None), "at a place of its own");
    }
}

#[test]
fn new_drawing_leaves_the_previous_one_saved() {
    let mut sheet = DrawnBoard::tell("key:p at:5,5 new");
    assert!(sheet.drawing().is_empty());
    let (of, place, text) = kept(&sheet.out).unwrap();
    assert_eq!((of, place), (0, None));
    assert!(drawing::read("d", &text).unwrap().now().len() > 1);
    sheet.event(DrawEvent::Kept { of, place: Some(0) });
    sheet.word("key:o");
    sheet.word("at:1,1");
    sheet.event(DrawEvent::Rested);
    let (of, place, _) = kept(&sheet.out).unwrap();
    assert_eq!((of, place), (1, None), "it does not take the place of the one before");
    let mut bad = DrawnBoard::tell("key:p at:5,5");
    let before = bad.counts();
    bad.event(DrawEvent::Opened { place: None, is_copy: false, text: Some("{}".to_owned()) });
    bad.event(DrawEvent::Opened { place: None, is_copy: false, text: None });
    assert_eq!((bad.counts(), bad.model.frame.toasts.len()), (before, 2));
}

#[test]
fn previous_drawing_is_restored_with_its_history() {
    let mut sheet = DrawnBoard::tell("key:p at:5,5 at:9,9");
    let before = sheet.model.draw.editor.history().clone();
    let example = include_str!("../../../../www/drawings/robot.json");
    sheet.event(DrawEvent::Opened { place: None, is_copy: false, text: Some(example.to_owned()) });
    assert_eq!(sheet.drawing().name(), drawing::read("d", example).unwrap().now().name());
    let number = sheet.model.frame.toasts.first().expect("it is offered").number;
    sheet.event(FrameEvent::Taken { number });
    assert_eq!(*sheet.model.draw.editor.history(), before);
    // And back again; an empty drawing is not offered.
    sheet.event(DrawEvent::Back);
    assert_eq!(sheet.of("hole").len(), 15);
    let mut empty = DrawnBoard::default();
    empty.event(DrawEvent::Opened { place: None, is_copy: false, text: Some(example.to_owned()) });
    assert!(empty.model.frame.toasts.is_empty());
}
