//! Keyboard shortcuts of the board editor. The letters follow other board editors.

use super::{Act, Tool};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawKey {
    /// Activates a tool; repeated for the pad tool, switches to the next pad shape.
    Tool(Tool),
    Move,
    Step {
        x: i8,
        y: i8,
        size: StepSize,
    },
    Place,
    End,
    Back,
    Act(Act),
    Group,
    Side {
        /// The upper side, else the lower one.
        upper: bool,
    },
    Numbers,
    Rename,
    Type {
        /// Coordinates are relative to the last position: the field starts with `@`.
        from_last: bool,
    },
}

/// A quarter turn counter-clockwise, in thousandths of a degree.
pub const QUARTER_MDEG: i32 = 90_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepSize {
    /// A tenth of the grid.
    Fine,
    Grid,
    /// Ten times the grid.
    Far,
}

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
