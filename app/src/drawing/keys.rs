//! Which key draws what. The letters are those of other board editors.
//!
//! Comes in: a key as plain data. Goes out: a [`DrawKey`]. Does not know where the focus is: who asks has looked.

use super::{Act, Tool};

/// What a key asks of the drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawKey {
    /// Take a tool; pads once more: the next form.
    Tool(Tool),
    /// Take what is under the cross-hair, to be moved.
    Move,
    /// Cross-hair, or what is chosen, by so many steps in X and Y.
    Step {
        /// So many steps to the right.
        x: i8,
        /// So many steps up.
        y: i8,
        /// How far a step goes.
        size: StepSize,
    },
    /// Place, or choose, where the tool aims.
    Place,
    /// The track ends.
    End,
    /// The last piece of the track is taken back.
    Back,
    /// Something is done with what is chosen.
    Act(Act),
    /// Into a group.
    Group,
    /// Draw on the upper side, or on the lower one.
    Side {
        /// On the upper side, else on the lower one.
        upper: bool,
    },
    /// Go to the numbers of what is chosen.
    Numbers,
    /// Go to the name of what is chosen.
    Rename,
    /// Go to where places are typed; with the sign for places that count from the last one.
    Type {
        /// Places count from the last one.
        from_last: bool,
    },
}

/// A quarter turn counter-clockwise, in thousandths of a degree.
pub const QUARTER_MDEG: i32 = 90_000;

/// How far a step goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepSize {
    /// A tenth of the grid.
    Fine,
    /// The grid.
    Grid,
    /// Ten times the grid.
    Far,
}

/// What a key asks for; `ctrl` and `shift` are held.
pub fn of(key: &str, ctrl: bool, shift: bool) -> Option<DrawKey> {
    let size = match (ctrl, shift) {
        (true, false) => StepSize::Fine,
        (false, true) => StepSize::Far,
        _ => StepSize::Grid,
    };
    let step = |x, y| (!(ctrl && shift)).then_some(DrawKey::Step { x, y, size });
    match key {
        "ArrowLeft" => return step(-1, 0),
        "ArrowRight" => return step(1, 0),
        "ArrowUp" => return step(0, 1),
        "ArrowDown" => return step(0, -1),
        "@" => return (!ctrl).then_some(DrawKey::Type { from_last: true }),
        _ => {}
    }
    let letter = key.to_ascii_lowercase();
    match (letter.as_str(), ctrl, shift) {
        ("z", true, _) => Some(DrawKey::Act(Act::Undo { back: !shift })),
        ("y", true, false) => Some(DrawKey::Act(Act::Undo { back: false })),
        ("c", true, false) => Some(DrawKey::Act(Act::Copy)),
        ("x", true, false) => Some(DrawKey::Act(Act::Cut)),
        ("v", true, false) => Some(DrawKey::Act(Act::Paste)),
        ("d", true, false) => Some(DrawKey::Act(Act::Duplicate)),
        ("a", true, false) => Some(DrawKey::Act(Act::All)),
        ("m", true, true) => Some(DrawKey::Tool(Tool::Measure)),
        ("g", true, _) => Some(if shift { DrawKey::Act(Act::Ungroup) } else { DrawKey::Group }),
        (_, true, _) => None,
        ("r", _, _) => {
            Some(DrawKey::Act(Act::Turn { mdeg: if shift { -QUARTER_MDEG } else { QUARTER_MDEG } }))
        }
        ("b", _, _) => Some(DrawKey::Act(Act::Mirror { x: !shift })),
        ("g", _, true) => Some(DrawKey::Act(Act::NextGrid)),
        ("c", _, true) => Some(DrawKey::Type { from_last: true }),
        (_, _, true) => None,
        ("v", ..) => Some(DrawKey::Tool(Tool::Select)),
        ("x" | "l", ..) => Some(DrawKey::Tool(Tool::Track)),
        ("p", ..) => Some(DrawKey::Tool(Tool::Pad)),
        ("o", ..) => Some(DrawKey::Tool(Tool::Hole)),
        ("n", ..) => Some(DrawKey::Tool(Tool::Node)),
        ("d", ..) => Some(DrawKey::Tool(Tool::Measure)),
        ("m", ..) => Some(DrawKey::Move),
        ("g", ..) => Some(DrawKey::Act(Act::Snap)),
        ("h", ..) => Some(DrawKey::Act(Act::Dim)),
        ("e", ..) => Some(DrawKey::Numbers),
        ("f2", ..) => Some(DrawKey::Rename),
        ("c", ..) => Some(DrawKey::Type { from_last: false }),
        ("enter", ..) => Some(DrawKey::Place),
        ("end", ..) => Some(DrawKey::End),
        ("backspace", ..) => Some(DrawKey::Back),
        ("delete", ..) => Some(DrawKey::Act(Act::Delete)),
        ("pageup", ..) => Some(DrawKey::Side { upper: true }),
        ("pagedown", ..) => Some(DrawKey::Side { upper: false }),
        _ => None,
    }
}
