//! The board editor: user actions in short words, and the resulting drawing.

use crate::drawing::fields::Field;
use crate::drawing::marks::MarkMeaning;
use crate::drawing::{DrawKey, keys};
use crate::keys::Tab;
use crate::model::drawing::Least;
use crate::model::{DrawEvent, Effect, Event, FrameEvent, Model, update};
use crate::said::Text;
use crate::view::{Camera, Touch};
use annulus_core::board::drawing::{Drawing, Id, Thing};
use annulus_core::geometry::Point;
use annulus_core::units::Length;

/// A model on the Draw screen, with the effects of the last event.
pub(super) struct DrawnBoard {
    pub(super) model: Model,
    pub(super) out: Vec<Effect>,
    pub(super) all: Vec<Effect>,
}

impl Default for DrawnBoard {
    fn default() -> Self {
        let mut sheet = Self { model: Model::default(), out: Vec::new(), all: Vec::new() };
        sheet.event(FrameEvent::Moved { camera: Camera { px_per_mm: 20.0, ..Camera::default() } });
        sheet.event(FrameEvent::Show { tab: Tab::Draw });
        sheet.event(DrawEvent::Found { own: None, earlier: Vec::new() });
        sheet
    }
}

/// Many objects are dragged as a box: one edit at the end, none if the drag is cancelled.
#[test]
fn large_selection_is_dragged_as_a_box() {
    let placed = |sheet: &DrawnBoard| {
        let drawing = sheet.model.draw.editor.drawing().clone();
        let mut at: Vec<Point> = drawing.top().filter_map(|id| drawing.at(id)).collect();
        at.sort_unstable();
        (at.len(), at.first().copied(), at.last().copied())
    };
    let mut sheet = DrawnBoard::default();
    sheet.word("key:p");
    for number in 0..400 {
        sheet.word(&format!("at:{},{}", 5 * (number % 20), 5 * (number / 20)));
    }
    sheet.word("key:v");
    sheet.word("key:Ctrl+a");
    let (before, changes) = (placed(&sheet), sheet.model.draw.editor.changes());
    assert_eq!(before, (400, Some(Point::default()), Some(Point::from_mm(95.0, 95.0))));
    sheet.word("begin:5,5>15,25");
    assert_eq!((placed(&sheet), sheet.model.draw.editor.changes()), (before, changes), "broken off");
    sheet.word("drag:5,5>15,25");
    let moved = (400, Some(Point::from_mm(10.0, 20.0)), Some(Point::from_mm(105.0, 115.0)));
    assert_eq!((placed(&sheet), sheet.model.draw.editor.changes()), (moved, changes + 1), "one edit");
    sheet.word("key:Ctrl+z");
    assert_eq!(placed(&sheet), before, "and one step back");
}

/// A node has no size, so a mark shows that it is selected, even among many.
#[test]
fn selected_node_is_marked() {
    let marked = |sheet: &DrawnBoard| {
        let rims = sheet.model.draw.shown.chosen.rims.iter();
        let nodes = rims.filter(|mark| mark.kind == MarkMeaning::ChosenNode);
        nodes.map(|mark| (mark.a_mm, mark.b_mm, mark.width_mm)).collect::<Vec<_>>()
    };
    let mut sheet = DrawnBoard::tell("key:n at:5,5 at:9,5 escape escape");
    assert_eq!(marked(&sheet), []);
    sheet.word("at:5,5");
    assert_eq!(marked(&sheet), [([5.0, 5.0], [5.0, 5.0], None)]);
    sheet.word("key:n");
    for number in 0..400 {
        sheet.word(&format!("at:{},{}", 5 * (number % 20), 10 + 5 * (number / 20)));
    }
    sheet.word("key:Ctrl+a");
    assert_eq!(marked(&sheet).len(), 402);
}

fn mm(text: &str) -> [f64; 2] {
    let (x, y) = text.split_once(',').unwrap_or_else(|| panic!("{text} is no place"));
    [x.parse().unwrap(), y.parse().unwrap()]
}

impl DrawnBoard {
    pub(super) fn event(&mut self, event: impl Into<Event>) {
        self.out = update(&mut self.model, event.into());
        self.all.extend(self.out.iter().cloned());
    }

    fn point(&mut self, touch: Touch, at: &str, held: &str) {
        let (shift, ctrl) = (held.contains("shift"), held.contains("ctrl"));
        self.event(DrawEvent::Point { touch, at_mm: mm(at), shift, ctrl });
    }

    /// Sends one word: `key:Ctrl+z`, `at:5,5`, `drag:1,1>5,5`, `type:@5,0`, `set:width=0.8`, and others.
    pub(super) fn word(&mut self, word: &str) {
        let (name, rest) = word.split_once(':').unwrap_or((word, ""));
        let (name, held) = name.split_once('+').unwrap_or((name, ""));
        match name {
            "key" => {
                let (ctrl, shift) = (rest.contains("Ctrl+"), rest.contains("Shift+"));
                let letter = rest.rsplit('+').next().unwrap();
                let key: DrawKey = keys::of(letter, ctrl, shift).unwrap_or_else(|| panic!("{word}"));
                self.event(DrawEvent::Key { key });
            }
            "hover" => self.point(Touch::Hover, rest, held),
            "at" => {
                self.point(Touch::Hover, rest, held);
                self.point(Touch::Down, rest, held);
                self.point(Touch::Up, rest, held);
            }
            "drag" | "begin" => {
                let (from, to) = rest.split_once('>').unwrap();
                let (a, b) = (mm(from), mm(to));
                self.point(Touch::Down, from, held);
                for step in 1..=5 {
                    let share = f64::from(step) / 5.0;
                    let at = [0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis]));
                    self.point(Touch::Move, &format!("{},{}", at[0], at[1]), held);
                }
                self.point(if name == "drag" { Touch::Up } else { Touch::Cancel }, to, held);
            }
            "type" => self.event(DrawEvent::Typed { text: rest.replace('_', " ") }),
            "set" => {
                let (field, text) = rest.split_once('=').unwrap();
                let all = [
                    Field::X,
                    Field::Y,
                    Field::FromX,
                    Field::ToY,
                    Field::Width,
                    Field::Shape,
                    Field::Size,
                    Field::Turn,
                    Field::Diameter,
                    Field::Plated,
                    Field::Layer,
                    Field::Name,
                    Field::Group,
                ];
                let field = all.into_iter().find(|one| one.word() == field).unwrap();
                self.event(DrawEvent::Set { field, text: text.to_owned() });
            }
            "group" => self.event(DrawEvent::Group),
            "into" => self.event(DrawEvent::Beside { into: true }),
            "out" => self.event(DrawEvent::Beside { into: false }),
            "escape" => self.event(DrawEvent::Escape),
            "new" => self.event(DrawEvent::New),
            "gap" => self.event(DrawEvent::Find { least: Least::Gap }),
            other => panic!("{other} is no word"),
        }
    }

    pub(super) fn tell(words: &str) -> Self {
        let mut sheet = Self::default();
        words.split_whitespace().for_each(|word| sheet.word(word));
        sheet
    }

    pub(super) fn drawing(&self) -> &Drawing {
        self.model.draw.editor.drawing()
    }

    pub(super) fn of(&self, word: &str) -> Vec<Id> {
        self.drawing().things().filter(|(_, entry)| entry.thing.word() == word).map(|(id, _)| id).collect()
    }

    /// `tracks/pads/holes/nodes/groups  undo/redo steps  selected`.
    pub(super) fn counts(&self) -> String {
        let count = |word| self.of(word).len();
        let (back, on) = self.model.draw.editor.history().depth();
        let kinds = ["track", "pad", "hole", "node", "group"].map(|word| count(word).to_string()).join("/");
        format!("{kinds} {back}/{on} {}", self.model.draw.editor.chosen.len())
    }

    fn tracks(&self) -> Vec<[Point; 2]> {
        let ends = |id: &Id| match self.drawing().thing(*id) {
            Some(Thing::Track { from, to, .. }) => {
                [self.drawing().at(*from).unwrap(), self.drawing().at(*to).unwrap()]
            }
            _ => panic!("no track"),
        };
        self.of("track").iter().map(ends).collect()
    }
}

#[test]
fn each_tool_draws_its_objects() {
    let rows = [
        ("by mouse", "key:x at:5,5 at:10,5 at:10,10 key:End", "2/0/0/3/0 2/0 0"),
        ("a drag is a track too", "key:x drag:5,5>10,5 key:End", "1/0/0/2/0 1/0 0"),
        ("the same place ends it", "key:x at:5,5 at:10,5 at:10,5 at:20,5", "1/0/0/2/0 1/0 0"),
        ("by typed places", "key:x type:x_5_y_5 type:@5,0 type:@0,5 key:End", "2/0/0/3/0 2/0 0"),
        (
            "by keys alone",
            "key:x key:Shift+ArrowRight key:Enter key:Shift+ArrowRight key:Shift+ArrowUp key:Enter key:End",
            "1/0/0/2/0 1/0 0",
        ),
        ("a pad with its hole", "key:p at:5,5", "0/1/1/1/0 1/0 0"),
        ("a double click places one pad", "key:p at:5,5 at:5,5", "0/1/1/1/0 1/0 0"),
        (
            "and one hole, none in a pad that has one",
            "key:p at:5,5 key:o at:5,5 at:9,9 at:9,9",
            "0/1/2/2/0 2/0 0",
        ),
        ("a pad about a hole has that", "key:o at:5,5 key:p at:5,5", "0/1/1/1/0 2/0 0"),
        ("a hole and a node", "key:o at:5,5 key:n at:9,9 at:9,9", "0/0/1/2/0 2/0 0"),
        (
            "pads on the end of a track share its node",
            "key:x at:5,5 at:10,5 key:End key:p at:5.1,5.1",
            "1/1/1/2/0 2/0 0",
        ),
        ("the last piece goes back", "key:x at:5,5 at:9,5 at:9,9 key:Backspace at:12,5", "2/0/0/3/0 2/0 0"),
        (
            "the last piece goes back, and not what was edited since",
            "key:x at:5,5 at:9,5 at:9,9 set:name=Robot key:Backspace at:12,5",
            "2/0/0/3/0 5/0 0",
        ),
        (
            "every piece goes back, and nothing else",
            "key:x at:5,5 at:9,5 set:name=Robot at:9,9 key:Backspace key:Backspace key:Backspace key:Backspace",
            "0/0/0/0/0 3/0 0",
        ),
        ("left half-way", "key:x at:5,5 escape", "0/0/0/0/0 0/0 0"),
        ("undo and redo", "key:p at:5,5 at:9,9 key:Ctrl+z", "0/1/1/1/0 1/1 0"),
        (
            "undo all",
            "key:p at:5,5 at:9,9 key:Ctrl+z key:Ctrl+z key:Ctrl+z key:Ctrl+y key:Ctrl+y",
            "0/2/2/2/0 2/0 0",
        ),
    ];
    for (name, words, expected) in rows {
        assert_eq!(DrawnBoard::tell(words).counts(), expected, "{name}: {words}");
    }
}

#[test]
fn edit_actions_apply_to_the_selection() {
    let rows = [
        (
            "choose and delete a pad with its hole",
            "key:p at:5,5 at:9,9 key:v at:9.3,9 key:Delete",
            "0/1/1/1/0 3/0 0",
        ),
        ("at its rim too", "key:p at:5,5 at:9,9 key:v at:9.7,9 key:Delete", "0/1/1/1/0 3/0 0"),
        ("the hole alone", "key:p at:5,5 at:9,9 key:v at+ctrl:9.3,9 key:Delete", "0/2/1/2/0 3/0 0"),
        ("the pad alone", "key:p at:5,5 at:9,9 key:v at+ctrl:9.7,9 key:Delete", "0/1/2/2/0 3/0 0"),
        (
            "shift takes both away again",
            "key:p at:5,5 at:9,9 key:v at:5,5 at+shift:9,9 at+shift:5.7,5",
            "0/2/2/2/0 2/0 2",
        ),
        ("a box", "key:p at:5,5 at:9,9 key:v drag:2,2>12,12 key:Delete", "0/0/0/0/0 3/0 0"),
        ("a box that does not hold all", "key:p at:5,5 at:9,9 key:v drag:2,2>7,7", "0/2/2/2/0 2/0 2"),
        (
            "a box from right to left takes what it meets",
            "key:p at:5,5 at:9,9 key:v drag:12,8.7>5.5,4",
            "0/2/2/2/0 2/0 3",
        ),
        ("shift adds", "key:o at:5,5 at:9,9 key:v at:5,5 at+shift:9,9", "0/0/2/2/0 2/0 2"),
        ("a group is one", "key:p at:5,5 at:9,9 key:Ctrl+a group at:30,30 at:5,5", "0/2/2/2/1 3/0 1"),
        (
            "one thing out of a group",
            "key:o at:5,5 at:9,9 key:Ctrl+a group at:30,30 at+ctrl:5,5 key:Delete",
            "0/0/1/1/1 4/0 0",
        ),
        (
            "groups in groups and apart again",
            "key:o at:5,5 at:9,9 key:Ctrl+a group group key:Ctrl+Shift+g",
            "0/0/2/2/1 5/0 1",
        ),
        (
            "copy and paste",
            "key:p at:5,5 key:v key:Ctrl+a key:Ctrl+c hover:20,20 key:Ctrl+v",
            "0/2/2/2/0 2/0 2",
        ),
        ("cut", "key:p at:5,5 key:v key:Ctrl+a key:Ctrl+x hover:20,20 key:Ctrl+v", "0/1/1/1/0 3/0 2"),
        ("duplicate", "key:p at:5,5 key:v key:Ctrl+a key:Ctrl+d", "0/2/2/2/0 2/0 2"),
        ("a drag that is called off changes nothing", "key:p at:5,5 key:v begin:5,5>9,9", "0/1/1/1/0 1/0 2"),
        (
            "nor does it lose what was taken back",
            "key:p at:5,5 at:9,9 key:Ctrl+z key:v begin:5,5>9,9",
            "0/1/1/1/0 1/1 2",
        ),
        ("escape: choice, then tool", "key:p at:5,5 key:v key:Ctrl+a escape", "0/1/1/1/0 1/0 0"),
    ];
    for (name, words, expected) in rows {
        assert_eq!(DrawnBoard::tell(words).counts(), expected, "{name}: {words}");
    }
}

#[test]
fn ambiguous_number_is_refused_with_a_hint() {
    let rows = [("1,234.5", "page.draw.two_marks"), ("wide", "page.draw.no_number")];
    for (text, said) in rows {
        let mut sheet = DrawnBoard::tell("key:x at:5,5 at:9,5 key:End key:v key:Ctrl+a");
        let before = sheet.drawing().clone();
        let events = [
            DrawEvent::Set { field: Field::Width, text: text.to_owned() },
            DrawEvent::PenSize { field: Field::Width, text: text.to_owned() },
            DrawEvent::Grid { text: text.to_owned() },
        ];
        for event in events {
            sheet.event(event.clone());
            assert_eq!(sheet.model.draw.editor.said, Some(Text::of(said)), "{event:?}");
        }
        assert_eq!(*sheet.drawing(), before);
    }
}

#[test]
fn mouse_keys_and_typed_numbers_draw_the_same() {
    let mouse = DrawnBoard::tell("key:x at:5,5 at:10,5 key:End key:p at:5,5");
    let typed = DrawnBoard::tell("key:x type:5,5 type:@5,0 key:End key:p type:x5_y5");
    let keys = DrawnBoard::tell(
        "key:x key:Shift+ArrowRight key:Shift+ArrowUp key:Enter key:Shift+ArrowRight key:Enter key:End \
         key:p key:Shift+ArrowLeft key:Enter",
    );
    assert_eq!(mouse.drawing(), typed.drawing());
    assert_eq!(mouse.drawing(), keys.drawing());
}

#[test]
fn moved_objects_snap_to_the_grid_with_attached_tracks() {
    let rows = [
        (
            "a node with its track",
            "key:x at:5,5 at:10,5 key:End key:v drag:10,5>10.1,9.2",
            [(5.0, 5.0), (10.0, 9.0)],
        ),
        (
            "beside a node, over its track",
            "key:x at:5,5 at:10,5 key:End key:v drag:9.9,5.1>9.9,9.2",
            [(5.0, 5.0), (10.0, 9.0)],
        ),
        (
            "the end of a track that is chosen",
            "key:x at:5,5 at:10,5 key:End key:v at:7.6,5 drag:10,5>10,9",
            [(5.0, 5.0), (10.0, 9.0)],
        ),
        (
            "at an end, all that is chosen",
            "key:x at:5,5 at:10,5 key:End key:n at:20,20 key:v key:Ctrl+a drag:10,5>10,9",
            [(5.0, 9.0), (10.0, 9.0)],
        ),
        (
            "a track with both ends",
            "key:x at:5,5 at:10,5 key:End key:v drag:7.6,5>7.6,9.1",
            [(5.0, 9.0), (10.0, 9.0)],
        ),
        (
            "without the grid",
            "key:x at:5,5 at:10,5 key:End key:v drag+ctrl:7.6,5>7.6,9.1",
            [(5.0, 9.1), (10.0, 9.1)],
        ),
        (
            "onto a node",
            "key:n at+ctrl:20.25,20 key:x at:5,5 at:10,5 key:End key:v drag:10,5>20.1,20.1",
            [(5.0, 5.0), (20.25, 20.0)],
        ),
        (
            "by keys",
            "key:x at:5,5 at:10,5 key:End key:v at:7.6,5 key:ArrowUp key:Shift+ArrowUp",
            [(5.0, 10.5), (10.0, 10.5)],
        ),
        (
            "a tenth",
            "key:x at:5,5 at:10,5 key:End key:v at:7.6,5 key:Ctrl+ArrowRight",
            [(5.05, 5.0), (10.05, 5.0)],
        ),
        ("turned", "key:x at:5,5 at:10,5 key:End key:v at:7.6,5 key:r", [(7.5, 2.5), (7.5, 7.5)]),
        ("mirrored", "key:x at:5,5 at:10,6 key:End key:v at:7.5,5.5 key:b", [(10.0, 5.0), (5.0, 6.0)]),
        (
            "upside down",
            "key:x at:5,5 at:10,6 key:End key:v at:7.5,5.5 key:Shift+b",
            [(5.0, 6.0), (10.0, 5.0)],
        ),
        ("shift keeps to eighths", "key:x at:5,5 at+shift:10.4,5.4 key:End", [(5.0, 5.0), (10.5, 5.0)]),
        (
            "its numbers",
            "key:x at:5,5 at:10,5 key:End key:v at:7.6,5 set:to_y=8,5 set:from_x=1in",
            [(25.4, 5.0), (10.0, 8.5)],
        ),
    ];
    for (name, words, [a, b]) in rows {
        let found = DrawnBoard::tell(words).tracks();
        assert_eq!(found, [[Point::from_mm(a.0, a.1), Point::from_mm(b.0, b.1)]], "{name}: {words}");
    }
}

#[test]
fn every_property_can_be_typed() {
    let pad = "key:p at:5,5 key:v drag:2,2>8,8 ";
    let rows = [
        ("set:size=3", "size: Length(3000000)"),
        ("set:size=0.1in", "size: Length(2540000)"),
        ("set:shape=octagon", "shape: Octagon"),
        ("set:shape=square set:turn=95", "turn_mdeg: 5000"),
        ("set:layer=bottom", "layer: Bottom"),
        ("set:diameter=1.1", "diameter: Length(1100000)"),
        ("set:plated=false", "plated: false"),
    ];
    for (words, expected) in rows {
        let sheet = DrawnBoard::tell(&format!("{pad}{words}"));
        let text = format!("{:?}", sheet.drawing().things().collect::<Vec<_>>());
        assert!(text.contains(expected), "{words}: {text}");
        assert_eq!(sheet.model.draw.editor.said, None, "{words}");
    }
    for words in ["set:size=wide", "set:size=0", "set:size=5000", "set:turn=a", "type:nowhere", "type:9999,0"]
    {
        let sheet = DrawnBoard::tell(&format!("{pad}{words}"));
        let before = DrawnBoard::tell(pad);
        assert_eq!(sheet.drawing(), before.drawing(), "{words}");
        assert!(
            sheet.model.draw.editor.said.is_some() || words.starts_with("type:9999"),
            "{words} is refused with a sentence"
        );
    }
    let named = DrawnBoard::tell("key:p at:5,5 key:Ctrl+a group set:name=U1");
    let groups = named.of("group");
    assert_eq!(named.drawing().thing(groups[0]), Some(&Thing::Group { name: "U1".to_owned() }));
    let bare = DrawnBoard::tell("key:p at:5,5 escape escape set:name=Robot");
    assert_eq!(bare.drawing().name(), "Robot");
}

#[test]
fn smallest_gap_is_live_and_can_be_located() {
    let sheet = DrawnBoard::tell("key:p at:5,5 at:8,5");
    assert_eq!(sheet.model.draw.editor.smallest.gap.unwrap().0, Length::from_um(1_000));
    let sheet = DrawnBoard::tell("key:p at:5,5 at:8,5 key:v drag:8.7,5>8.2,5 gap");
    assert_eq!(sheet.model.draw.editor.smallest.gap.unwrap().0, Length::from_um(500));
    assert_eq!(sheet.model.draw.editor.chosen.len(), 2);
    assert_eq!(sheet.model.draw.look, (1, Some([6.25, 5.0])));
}

#[test]
fn edit_rebuilds_only_the_touched_layers() {
    let mut sheet = DrawnBoard::tell("key:o");
    for at in 0..600 {
        sheet.word(&format!("at:{},{}", f64::from(at % 30), f64::from(at / 30)));
    }
    sheet.word("key:x");
    for at in 0..300 {
        sheet.word(&format!("at:{},{}", f64::from(at % 30), 40.0 + f64::from(at / 30)));
    }
    let before = sheet.model.draw.shown.sheet.clone();
    assert_eq!((before.holes.len(), sheet.of("track").len()), (600, 299));
    for word in ["key:End", "key:v", "at:28.5,49", "key:ArrowUp"] {
        sheet.word(word);
    }
    let now = sheet.model.draw.shown.sheet.clone();
    let same = |layer: &(_, std::sync::Arc<crate::view::Mesh>)| {
        before.areas.iter().any(|old| std::sync::Arc::ptr_eq(&old.1, &layer.1))
    };
    let kept = now.areas.iter().filter(|layer| same(layer)).count();
    assert!(
        now.areas.len() > 2 && kept + 2 >= now.areas.len() && kept < now.areas.len(),
        "{kept} of {}",
        now.areas.len()
    );
}

#[test]
fn objects_move_into_and_out_of_groups_in_the_tree() {
    // Two groups of one hole each, and a hole without a group.
    let mut sheet = DrawnBoard::tell("key:o at:1,1 at:9,1 at:17,1 key:v at:1,1 group at:9,1 group at:17,1");
    let (groups, holes) = (sheet.of("group"), sheet.of("hole"));
    let lies = |sheet: &DrawnBoard, id: Id| sheet.drawing().get(id).unwrap().group;
    sheet.word("into");
    assert_eq!(lies(&sheet, holes[2]), Some(groups[1]), "into the nearest one above");
    assert_eq!(sheet.counts(), "0/0/3/3/2 6/0 1");
    sheet.word("into");
    assert_eq!(lies(&sheet, holes[2]), Some(groups[0]));
    sheet.word("out");
    assert_eq!(lies(&sheet, holes[2]), None);
    sheet.event(DrawEvent::Regroup { id: groups[0], group: Some(groups[1]) });
    assert_eq!((lies(&sheet, groups[0]), lies(&sheet, holes[2])), (Some(groups[1]), None), "it alone");
    sheet.event(DrawEvent::Regroup { id: groups[1], group: Some(groups[0]) });
    assert_eq!(lies(&sheet, groups[1]), None, "a group does not go into itself");
    assert!(sheet.model.draw.editor.said.is_some());
    sheet.event(DrawEvent::Regroup { id: holes[2], group: Some(groups[0]) });
    let deepest = |sheet: &DrawnBoard| sheet.model.draw.shown.tree.iter().map(|row| row.depth).max().unwrap();
    assert_eq!((lies(&sheet, holes[2]), deepest(&sheet)), (Some(groups[0]), 2), "shown where it went");
    while sheet.model.draw.editor.can_undo().0 {
        sheet.word("key:Ctrl+z");
    }
    assert!(sheet.drawing().is_empty() && sheet.model.draw.shown.tree.is_empty());
}

#[test]
fn tree_after_edits_matches_the_drawing() {
    let mut sheet =
        DrawnBoard::tell("key:p at:5,5 at:15,5 key:x at:5,5 at:15,5 at:20,9 key:End key:Ctrl+a group");
    let words =
        "key:Ctrl+z key:Ctrl+y drag:5,5>7,7 key:Ctrl+d key:Delete key:Ctrl+Shift+g key:Ctrl+z key:Ctrl+z";
    for word in words.split_whitespace() {
        sheet.word(word);
        let editor = &sheet.model.draw.editor;
        let mut anew = editor.with(editor.history().clone(), editor.finder().imported().clone());
        anew.open.clone_from(&editor.open);
        assert_eq!(*sheet.model.draw.shown.tree, crate::drawing::tree::rows(&anew), "{word}");
        assert_eq!(sheet.model.draw.editor.smallest, anew.smallest, "{word}");
    }
}

#[test]
fn selection_moves_to_a_typed_position() {
    let at = |words: &str| {
        let sheet = DrawnBoard::tell(words);
        let [x, y] =
            sheet.of("node").first().and_then(|id| sheet.drawing().at(*id)).map(|at| [at.x, at.y]).unwrap();
        (x.mm(), y.mm())
    };
    assert_eq!(at("key:o at:5,5 key:v at:5,5 type:@2,1"), (7.0, 6.0), "by so much");
    assert_eq!(at("key:o at:5,5 key:v at:5,5 type:x9"), (9.0, 5.0), "with the cross-hair on it");
    assert_eq!(
        at("key:o at:5,5 key:v at:5,5 hover:20,20 type:x9"),
        (5.0, 5.0),
        "the cross-hair is elsewhere"
    );
    assert_eq!(at("key:o at:5,5 key:v at:5,5 type:@2,1 key:Ctrl+z"), (5.0, 5.0), "an edit like others");
}
