//! Groups in the board editor, of drawn and of imported objects.

use super::draw_rows::DrawnBoard;
use super::drawn_files_rows::{over_files, places};
use crate::drawing::fields::FieldValue;
use crate::model::DrawEvent;
use annulus_core::board::drawing::Catch;
use annulus_core::units::Length;

#[test]
fn file_objects_are_grouped_with_drawn_ones() {
    let mut sheet = over_files();
    for word in ["key:p", "at:20,20", "key:v", "at:20.7,20", "at+shift:1,1.4", "at+shift:5,1.4"] {
        sheet.word(word);
    }
    assert_eq!(sheet.model.draw.editor.chosen.len(), 4, "a drawn pad with its hole and two of the files");
    sheet.word("key:Ctrl+g");
    assert_eq!((sheet.of("group").len(), sheet.of("imported").len()), (1, 2), "{:?}", sheet.drawing());
    let (group, before) = (sheet.of("group")[0], places(&sheet));
    assert_eq!(before[..2], [(1.0, 1.0), (5.0, 1.0)], "nothing moves by being grouped");
    // A press on a member selects the group; with Ctrl, the member.
    for (word, chosen) in [("at:1,1.4", Catch::Drawn(group)), ("at+ctrl:1,1.4", Catch::Imported(0))] {
        sheet.word("at:40,40");
        sheet.word(word);
        assert_eq!(sheet.model.draw.editor.chosen.iter().copied().collect::<Vec<_>>(), [chosen], "{word}");
    }
    sheet.event(DrawEvent::Choose { id: group, adding: false });
    let low_mm = sheet.model.draw.shown.chosen.mesh.bounds_mm().unwrap()[0];
    assert!(low_mm[0] < 1.0 && low_mm[1] < 1.0, "all of it is shown as chosen: {low_mm:?}");
    sheet.event(DrawEvent::ChooseImported { of: 0 });
    let fields = crate::drawing::fields::rows(&sheet.model.draw.editor);
    let of_group = FieldValue::Group(Some(Some(group)), vec![(group, "Group 1".to_owned())]);
    assert_eq!(fields.last().map(|row| &row.value), Some(&of_group));
    // The keys move an object without a row in the tree into the nearest group and out again.
    for (word, count) in [("into", 3), ("out", 2)] {
        sheet.event(DrawEvent::ChooseImported { of: 2 });
        sheet.word(word);
        let members = sheet.drawing().hanging(group).filter(|id| sheet.of("imported").contains(id)).count();
        assert_eq!(members, count, "{word}");
    }
    // The group and its members are selected as one object.
    sheet.word("key:Ctrl+a");
    let all = &sheet.model.draw.editor.chosen;
    assert!(all.contains(&Catch::Drawn(group)) && !all.contains(&Catch::Imported(0)), "{all:?}");
    sheet.word("at:40,40");
    sheet.word("drag:5,1.4>5,11.4");
    assert_eq!(places(&sheet)[..2], [(1.0, 11.0), (5.0, 11.0)]);
    for word in ["at:1,11.4", "key:Ctrl+Shift+g"] {
        sheet.word(word);
    }
    assert_eq!(sheet.of("group"), []);
    let chosen = &sheet.model.draw.editor.chosen;
    assert!(chosen.contains(&Catch::Imported(0)) && chosen.contains(&Catch::Imported(1)), "{chosen:?}");
}

#[test]
fn typed_group_position_preserves_hidden_digits() {
    let mut sheet = DrawnBoard::tell("key:p at:5,5 at:9,9 key:v key:Ctrl+a key:Ctrl+g");
    let low = |sheet: &DrawnBoard| sheet.model.draw.editor.selection().bounds().unwrap().min.x;
    let rows = [
        ("12.345678", "12.345678"),
        ("12.346", "12.345678"),
        ("12.347", "12.347"),
        ("-3.00004", "-3.00004"),
        ("-3", "-3.00004"),
    ];
    for (typed, stays) in rows {
        sheet.word(&format!("set:x={typed}"));
        let mm: f64 = stays.parse().unwrap();
        assert_eq!(low(&sheet), Length::from_mm(mm), "{typed}");
    }
}
