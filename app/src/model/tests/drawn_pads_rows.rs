//! The board editor: pads and their holes, repeated placing and pasting, the view from below, sizes out of
//! range.

use super::draw_rows::DrawnBoard;
use crate::drawing::fields::{Field, FieldValue, may_be};
use crate::format::Unit;
use crate::model::{DrawEvent, FrameEvent};
use crate::said::Text;
use annulus_core::board::drawing::{Id, Layer};
use annulus_core::geometry::Point;
use annulus_core::units::Length;
use std::collections::BTreeSet;

#[test]
fn duplicate_placement_shows_a_message() {
    for words in ["key:p at:5,5 at:5,5", "key:o at:5,5 at:5,5"] {
        let sheet = DrawnBoard::tell(words);
        assert_eq!(sheet.model.draw.editor.said, Some(Text::of("page.draw.there")), "{words}");
    }
}

#[test]
fn new_pads_are_on_copper_after_an_edge_was_drawn() {
    let mut sheet = DrawnBoard::tell("key:PageDown");
    let mut pen = sheet.model.draw.editor.pen;
    pen.draw_on(Layer::Edge);
    sheet.event(DrawEvent::Pen { pen });
    for word in ["key:x", "at:1,1", "at:9,1", "key:End", "key:p", "at:5,5", "key:x", "at:9,1", "at:9,9"] {
        sheet.word(word);
    }
    let layers =
        |word| sheet.of(word).into_iter().map(|id| sheet.drawing().thing(id).unwrap().layer().unwrap());
    assert_eq!(layers("pad").collect::<Vec<_>>(), [Layer::Bottom]);
    assert_eq!(layers("track").collect::<Vec<_>>(), [Layer::Edge, Layer::Edge]);
}

#[test]
fn arrow_key_moves_the_selection_as_seen_on_screen() {
    for (below, x_mm) in [(false, 5.5), (true, 4.5)] {
        let mut sheet = DrawnBoard::tell("key:o at:5,5 key:v at:5,5");
        sheet.event(FrameEvent::Flip { below: Some(below) });
        sheet.word("key:ArrowRight");
        let at = sheet.drawing().at(sheet.of("node")[0]);
        assert_eq!(at, Some(Point::from_mm(x_mm, 5.0)), "from below: {below}");
    }
}

#[test]
fn repeated_paste_is_offset_from_the_first() {
    let sheet = DrawnBoard::tell(
        "key:p at:5,5 key:v key:Ctrl+a key:Ctrl+c hover:20,20 key:Ctrl+v key:Ctrl+v key:Ctrl+v",
    );
    let places: BTreeSet<Point> = sheet.of("node").iter().filter_map(|id| sheet.drawing().at(*id)).collect();
    assert_eq!((sheet.of("pad").len(), places.len()), (4, 4), "{places:?}");
    assert!(places.contains(&Point::from_mm(20.0, 20.0)));
    // A pad may be placed on the end of a track.
    let onto = DrawnBoard::tell(
        "key:x at:20,20 at:25,20 key:End key:p at:5,5 key:v at:5,5 key:Ctrl+c hover:20,20 key:Ctrl+v",
    );
    let at = |id: &Id| onto.drawing().thing(*id).and_then(|pad| onto.drawing().at(pad.nodes().next()?));
    assert_eq!(onto.of("pad").iter().filter_map(at).next_back(), Some(Point::from_mm(20.0, 20.0)));
}

#[test]
fn pad_lists_hole_fields_and_a_round_pad_no_angle() {
    let fields = |words: &str| {
        let sheet = DrawnBoard::tell(words);
        let rows = crate::drawing::fields::rows(&sheet.model.draw.editor);
        rows.into_iter().map(|row| (row.field, row.value)).collect::<Vec<_>>()
    };
    let round = fields("key:p at:5,7 key:v at:5,7");
    let length = |um| FieldValue::Length(Some(Length::from_um(um)));
    for row in [(Field::X, length(5_000)), (Field::Y, length(7_000)), (Field::Diameter, length(800))] {
        assert!(round.contains(&row), "{round:?}");
    }
    assert!(round.iter().all(|(field, _)| *field != Field::Turn), "{round:?}");
    let square = fields("key:p key:p at:5,7 key:v at:5,7");
    assert!(square.contains(&(Field::Turn, FieldValue::Turn(Some(0)))), "{square:?}");
}

#[test]
fn out_of_range_size_is_refused() {
    for text in ["99999", "0", "0.005"] {
        let mut sheet = DrawnBoard::default();
        let before = sheet.model.draw.editor.pen;
        sheet.event(DrawEvent::PenSize { field: Field::Size, text: text.to_owned() });
        let said = sheet.model.draw.editor.said.clone();
        assert!(matches!(&said, Some(Text::Found(why)) if why.code == "drawing.size"), "{text}: {said:?}");
        assert_eq!(sheet.model.draw.editor.pen, before);
        let length = crate::drawing::typed::length(text, Unit::default());
        assert!(length.is_none_or(|length| !may_be(Field::Size, length)), "the field is red");
    }
    assert!(may_be(Field::X, Length::ZERO) && may_be(Field::Diameter, Length::from_um(10)));
}
