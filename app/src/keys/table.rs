//! The tables of the screens; of shortcuts and commands without a key, as shown in help and palette; and of
//! the jog keys, which move the machine while they are armed.

use super::{CamKey, KeyAction, Keyless, QueueKey, Stride};
use crate::drawing::keys::{QUARTER_MDEG, StepSize};
use crate::drawing::{Act, DrawKey, Tool};
use crate::said::key;
use annulus_core::board::drawing::{Align, Sides};

/// The screens. Their shortcut digits follow this order, from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tab {
    Draw,
    #[default]
    Board,
    /// The operations of the job.
    Cam,
    Simulate,
    Machine,
    /// Experiments with tables, profiles and commands.
    Lab,
    Settings,
}

impl Tab {
    pub const ALL: [Self; 7] =
        [Self::Draw, Self::Board, Self::Cam, Self::Simulate, Self::Machine, Self::Lab, Self::Settings];

    /// The word in the URL (`#/board`), the key of its name, and whether it shows the open board.
    const fn row(self) -> (&'static str, &'static str, bool) {
        match self {
            Self::Draw => ("draw", key!("page.tab.draw"), false),
            Self::Board => ("board", key!("page.tab.board"), true),
            Self::Cam => ("cam", key!("page.tab.cam"), true),
            Self::Simulate => ("simulate", key!("page.tab.simulate"), true),
            Self::Machine => ("machine", key!("page.tab.machine"), false),
            Self::Lab => ("lab", key!("page.tab.lab"), false),
            Self::Settings => ("settings", key!("page.tab.settings"), false),
        }
    }

    /// The word in the URL: `#/board`.
    pub fn word(self) -> &'static str {
        self.row().0
    }

    /// Key of its name in the locale tables.
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// True for a screen of the open board: without a board it shows how to open one.
    pub fn shows_board(self) -> bool {
        self.row().2
    }

    /// The screen in a URL.
    pub fn of_address(hash: &str) -> Option<Self> {
        let word = hash.strip_prefix("#/")?.split(['/', '?']).next()?;
        Self::ALL.into_iter().find(|tab| tab.word() == word)
    }
}

/// A shortcut for help and palette, or a command without a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shortcut {
    /// The screen; none for all screens.
    pub tab: Option<Tab>,
    /// How the key is written; empty if there is none.
    pub keys: &'static str,
    pub name: &'static str,
    pub action: KeyAction,
}

impl Shortcut {
    pub fn written(&self) -> String {
        let signs = [
            ("ArrowUp", "↑"),
            ("ArrowDown", "↓"),
            ("ArrowRight", "→"),
            ("Escape", "Esc"),
            ("_", "-"),
            ("ArrowLeft", "←"),
        ];
        let text = signs.into_iter().fold(self.keys.to_owned(), |text, (from, to)| text.replace(from, to));
        let (before, last) = match text.strip_suffix("++") {
            Some(before) => (before, "+"),
            None => text.rsplit_once('+').unwrap_or(("", &text)),
        };
        let last = if last.chars().count() == 1 { last.to_uppercase() } else { last.to_owned() };
        if before.is_empty() { last } else { format!("{before} + {last}") }
    }
}

const fn shortcut(tab: Option<Tab>, keys: &'static str, name: &'static str, action: KeyAction) -> Shortcut {
    Shortcut { tab, keys, name, action }
}

const fn undo(tab: Tab, keys: &'static str) -> Shortcut {
    shortcut(Some(tab), keys, key!("page.key.undo"), undone(tab, true))
}

const fn redo(tab: Tab, keys: &'static str) -> Shortcut {
    shortcut(Some(tab), keys, key!("page.key.redo"), undone(tab, false))
}

/// The Lab has its own undo; the screens of the board share that of the job.
const fn undone(tab: Tab, back: bool) -> KeyAction {
    match tab {
        Tab::Lab => KeyAction::Undo { back },
        _ => KeyAction::Cam(CamKey::Undo { back }),
    }
}

const fn fit(tab: Tab) -> Shortcut {
    shortcut(Some(tab), "Home", key!("page.key.fit"), KeyAction::Fit)
}

const fn in_space(tab: Tab) -> Shortcut {
    shortcut(Some(tab), "Alt+3", key!("page.key.in_space"), KeyAction::Space)
}

const fn drawn(keys: &'static str, name: &'static str, key: DrawKey) -> Shortcut {
    shortcut(Some(Tab::Draw), keys, name, KeyAction::Draw(key))
}

/// All shortcuts except the jog keys.
pub const SHORTCUTS: &[Shortcut] = &[
    shortcut(None, "Ctrl+Shift+E", key!("page.key.stop"), KeyAction::Stop),
    shortcut(None, "Escape", key!("page.key.escape"), KeyAction::Escape),
    shortcut(None, "0", key!("page.key.draw"), KeyAction::Show(Tab::Draw)),
    shortcut(None, "1", key!("page.key.board"), KeyAction::Show(Tab::Board)),
    shortcut(None, "2", key!("page.key.cam"), KeyAction::Show(Tab::Cam)),
    shortcut(None, "3", key!("page.key.simulate"), KeyAction::Show(Tab::Simulate)),
    shortcut(None, "4", key!("page.key.machine"), KeyAction::Show(Tab::Machine)),
    shortcut(None, "5", key!("page.key.lab"), KeyAction::Show(Tab::Lab)),
    shortcut(None, "6", key!("page.key.settings"), KeyAction::Show(Tab::Settings)),
    shortcut(None, "Ctrl+o", key!("page.key.open"), KeyAction::Open),
    shortcut(None, "Ctrl+s", key!("page.key.save"), KeyAction::Save),
    shortcut(None, "Ctrl+Shift+s", key!("page.key.save"), KeyAction::Save),
    shortcut(None, "Ctrl+u", key!("page.key.units"), KeyAction::Units),
    shortcut(None, "Ctrl+,", key!("page.key.settings"), KeyAction::Show(Tab::Settings)),
    shortcut(None, "Ctrl+k", key!("page.key.palette"), KeyAction::Palette),
    shortcut(None, "Ctrl+/", key!("page.key.palette"), KeyAction::Palette),
    shortcut(None, "F1", key!("page.key.help"), KeyAction::Help),
    shortcut(None, "?", key!("page.key.help"), KeyAction::Help),
    shortcut(None, "F6", key!("page.key.region"), KeyAction::Region { onwards: true }),
    shortcut(None, "Shift+F6", key!("page.key.region_back"), KeyAction::Region { onwards: false }),
    shortcut(None, "Shift+w", key!("page.key.speak"), KeyAction::Speak),
    shortcut(None, "Shift+1", key!("page.key.fit"), KeyAction::Fit),
    shortcut(None, "Shift+2", key!("page.key.fit_chosen"), KeyAction::FitChosen),
    shortcut(None, "Ctrl+0", key!("page.key.actual_size"), KeyAction::ActualSize),
    shortcut(None, "Shift++", key!("page.key.closer"), KeyAction::ZoomIn),
    shortcut(None, "Shift+_", key!("page.key.further"), KeyAction::ZoomOut),
    shortcut(None, "f", key!("page.key.flip"), KeyAction::Flip),
    shortcut(None, "Ctrl+'", key!("page.key.draw_grid"), KeyAction::Grid),
    fit(Tab::Board),
    undo(Tab::Board, "Ctrl+z"),
    redo(Tab::Board, "Ctrl+y"),
    redo(Tab::Board, "Ctrl+Shift+z"),
    in_space(Tab::Board),
    shortcut(Some(Tab::Board), "ArrowRight", key!("page.key.walk"), KeyAction::Walk { x: 1, y: 0 }),
    fit(Tab::Draw),
    drawn("v", key!("page.key.draw_select"), DrawKey::Tool(Tool::Select)),
    drawn("x", key!("page.key.draw_track"), DrawKey::Tool(Tool::Track)),
    drawn("l", key!("page.key.draw_track"), DrawKey::Tool(Tool::Track)),
    drawn("p", key!("page.key.draw_pad"), DrawKey::Tool(Tool::Pad)),
    drawn("o", key!("page.key.draw_hole"), DrawKey::Tool(Tool::Hole)),
    drawn("n", key!("page.key.draw_node"), DrawKey::Tool(Tool::Node)),
    drawn("d", key!("page.key.draw_measure"), DrawKey::Tool(Tool::Measure)),
    drawn("Ctrl+Shift+m", key!("page.key.draw_measure"), DrawKey::Tool(Tool::Measure)),
    drawn("m", key!("page.key.draw_move"), DrawKey::Move),
    drawn("ArrowRight", key!("page.key.draw_step"), DrawKey::Step { x: 1, y: 0, size: StepSize::Grid }),
    drawn(
        "Shift+ArrowRight",
        key!("page.key.draw_step_far"),
        DrawKey::Step { x: 1, y: 0, size: StepSize::Far },
    ),
    drawn(
        "Ctrl+ArrowRight",
        key!("page.key.draw_step_fine"),
        DrawKey::Step { x: 1, y: 0, size: StepSize::Fine },
    ),
    drawn("Enter", key!("page.key.draw_place"), DrawKey::Place),
    drawn("End", key!("page.key.draw_end_track"), DrawKey::End),
    drawn("Backspace", key!("page.key.draw_back_piece"), DrawKey::Back),
    drawn("c", key!("page.key.draw_type"), DrawKey::Type { from_last: false }),
    drawn("Shift+c", key!("page.key.draw_type_by"), DrawKey::Type { from_last: true }),
    drawn("e", key!("page.key.draw_numbers"), DrawKey::Numbers),
    drawn("F2", key!("page.key.draw_rename"), DrawKey::Rename),
    drawn("h", key!("page.key.draw_dim"), DrawKey::Act(Act::Dim)),
    drawn("r", key!("page.key.draw_turn"), DrawKey::Act(Act::Turn { mdeg: QUARTER_MDEG })),
    drawn("Shift+r", key!("page.key.draw_turn_back"), DrawKey::Act(Act::Turn { mdeg: -QUARTER_MDEG })),
    drawn("b", key!("page.key.draw_mirror"), DrawKey::Act(Act::Mirror { x: true })),
    drawn("Shift+b", key!("page.key.draw_mirror_y"), DrawKey::Act(Act::Mirror { x: false })),
    drawn("Ctrl+a", key!("page.key.draw_all"), DrawKey::Act(Act::All)),
    drawn("Ctrl+c", key!("page.key.draw_copy"), DrawKey::Act(Act::Copy)),
    drawn("Ctrl+x", key!("page.key.draw_cut"), DrawKey::Act(Act::Cut)),
    drawn("Ctrl+v", key!("page.key.draw_paste"), DrawKey::Act(Act::Paste)),
    drawn("Ctrl+d", key!("page.key.draw_duplicate"), DrawKey::Act(Act::Duplicate)),
    drawn("Delete", key!("page.key.draw_delete"), DrawKey::Act(Act::Delete)),
    drawn("Ctrl+g", key!("page.key.draw_group"), DrawKey::Group),
    drawn("Ctrl+Shift+g", key!("page.key.draw_ungroup"), DrawKey::Act(Act::Ungroup)),
    drawn("Ctrl+z", key!("page.key.draw_undo_edit"), DrawKey::Act(Act::Undo { back: true })),
    drawn("Ctrl+y", key!("page.key.draw_redo_edit"), DrawKey::Act(Act::Undo { back: false })),
    drawn("Ctrl+Shift+z", key!("page.key.draw_redo_edit"), DrawKey::Act(Act::Undo { back: false })),
    drawn("g", key!("page.key.draw_snap"), DrawKey::Act(Act::Snap)),
    drawn("Shift+g", key!("page.key.draw_next_grid"), DrawKey::Act(Act::NextGrid)),
    drawn("PageUp", key!("page.key.draw_upper"), DrawKey::Side { upper: true }),
    drawn("PageDown", key!("page.key.draw_lower"), DrawKey::Side { upper: false }),
    fit(Tab::Cam),
    in_space(Tab::Cam),
    shortcut(Some(Tab::Cam), "a", key!("page.key.add"), KeyAction::Cam(CamKey::Add)),
    shortcut(Some(Tab::Cam), "Alt+ArrowUp", key!("page.key.up"), KeyAction::Cam(CamKey::Move { up: true })),
    shortcut(
        Some(Tab::Cam),
        "Alt+ArrowDown",
        key!("page.key.down"),
        KeyAction::Cam(CamKey::Move { up: false }),
    ),
    shortcut(Some(Tab::Cam), "Delete", key!("page.key.remove"), KeyAction::Cam(CamKey::Remove)),
    undo(Tab::Cam, "Ctrl+z"),
    redo(Tab::Cam, "Ctrl+y"),
    redo(Tab::Cam, "Ctrl+Shift+z"),
    shortcut(Some(Tab::Cam), "F8", key!("page.key.problem"), KeyAction::Cam(CamKey::Problem { next: true })),
    shortcut(
        Some(Tab::Cam),
        "Shift+F8",
        key!("page.key.problem_before"),
        KeyAction::Cam(CamKey::Problem { next: false }),
    ),
    shortcut(Some(Tab::Cam), "s", key!("page.key.simulate"), KeyAction::Show(Tab::Simulate)),
    shortcut(Some(Tab::Simulate), "Space", key!("page.key.play"), KeyAction::Play),
    shortcut(
        Some(Tab::Simulate),
        "ArrowRight",
        key!("page.key.segment"),
        KeyAction::Step(Stride::Segment { onwards: true }),
    ),
    shortcut(
        Some(Tab::Simulate),
        "Shift+ArrowRight",
        key!("page.key.hole"),
        KeyAction::Step(Stride::Hole { onwards: true }),
    ),
    shortcut(
        Some(Tab::Simulate),
        "Ctrl+ArrowRight",
        key!("page.key.hundredth"),
        KeyAction::Step(Stride::Percent { onwards: true }),
    ),
    shortcut(
        Some(Tab::Simulate),
        "ArrowLeft",
        key!("page.key.segment_back"),
        KeyAction::Step(Stride::Segment { onwards: false }),
    ),
    shortcut(
        Some(Tab::Simulate),
        "Shift+ArrowLeft",
        key!("page.key.hole_back"),
        KeyAction::Step(Stride::Hole { onwards: false }),
    ),
    shortcut(
        Some(Tab::Simulate),
        "Ctrl+ArrowLeft",
        key!("page.key.hundredth_back"),
        KeyAction::Step(Stride::Percent { onwards: false }),
    ),
    shortcut(Some(Tab::Simulate), ".", key!("page.key.faster"), KeyAction::Faster { more: true }),
    shortcut(Some(Tab::Simulate), ",", key!("page.key.slower"), KeyAction::Faster { more: false }),
    shortcut(Some(Tab::Simulate), "t", key!("page.key.from_above"), KeyAction::FromAbove),
    shortcut(Some(Tab::Simulate), "h", key!("page.key.home_view"), KeyAction::HomeView),
    shortcut(Some(Tab::Simulate), "Alt+3", key!("page.key.space"), KeyAction::Space),
    shortcut(Some(Tab::Simulate), "Home", key!("page.key.beginning"), KeyAction::Beginning),
    shortcut(Some(Tab::Simulate), "End", key!("page.key.end"), KeyAction::End),
    undo(Tab::Simulate, "Ctrl+z"),
    redo(Tab::Simulate, "Ctrl+y"),
    redo(Tab::Simulate, "Ctrl+Shift+z"),
    fit(Tab::Machine),
    shortcut(Some(Tab::Machine), "Space", key!("page.key.pause"), KeyAction::Pause),
    shortcut(Some(Tab::Machine), "j", key!("page.key.arm"), KeyAction::ArmKeys),
    shortcut(Some(Tab::Lab), "F8", key!("page.key.run"), KeyAction::Queue(QueueKey::Run)),
    shortcut(Some(Tab::Lab), "F9", key!("page.key.break"), KeyAction::Queue(QueueKey::Break)),
    shortcut(Some(Tab::Lab), "F10", key!("page.key.step"), KeyAction::Queue(QueueKey::Step)),
    undo(Tab::Lab, "Ctrl+z"),
    redo(Tab::Lab, "Ctrl+y"),
    redo(Tab::Lab, "Ctrl+Shift+z"),
];

const fn command(tab: Tab, name: &'static str, command: Keyless) -> Shortcut {
    shortcut(Some(tab), "", name, KeyAction::Keyless(command))
}

const fn aligned(name: &'static str, x: bool, sides: Sides) -> Shortcut {
    drawn("", name, DrawKey::Act(Act::Align(Align { x, sides })))
}

/// Commands without a key.
pub const COMMANDS: &[Shortcut] = &[
    command(Tab::Board, key!("page.anew.choose"), Keyless::NewExports),
    command(Tab::Board, key!("page.review.discard"), Keyless::CloseBoard),
    command(Tab::Cam, key!("page.cam.save_files"), Keyless::Export),
    command(Tab::Cam, key!("page.cam.run_sheet"), Keyless::RunSheet),
    command(Tab::Draw, key!("page.draw.act.array"), Keyless::Array),
    command(Tab::Draw, key!("page.key.draw_edge"), Keyless::Edge),
    command(Tab::Draw, key!("page.draw.use"), Keyless::UseBoard),
    command(Tab::Draw, key!("page.draw.new"), Keyless::NewDrawing),
    command(Tab::Draw, key!("page.key.draw_save_board"), Keyless::SaveBoard),
    command(Tab::Draw, key!("page.key.draw_save_svg"), Keyless::SaveSvg),
    command(Tab::Draw, key!("page.key.draw_save_drawing"), Keyless::SaveDrawing),
    aligned(key!("page.key.align_left"), true, Sides::Low),
    aligned(key!("page.key.align_middle_x"), true, Sides::Middle),
    aligned(key!("page.key.align_right"), true, Sides::High),
    aligned(key!("page.key.align_low"), false, Sides::Low),
    aligned(key!("page.key.align_middle_y"), false, Sides::Middle),
    aligned(key!("page.key.align_high"), false, Sides::High),
    command(Tab::Machine, key!("page.level.open"), Keyless::HeightMap),
    command(Tab::Machine, key!("page.operator.enter"), Keyless::LargeView { on: true }),
    command(Tab::Machine, key!("page.key.all_of_machine"), Keyless::LargeView { on: false }),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandKey {
    Move {
        /// X, Y, Z from 0.
        axis: u8,
        /// Positive direction: right, back or up.
        up: bool,
    },
    Step {
        finer: bool,
    },
}

#[derive(Clone, Copy, Debug)]
pub struct HandKeyRow {
    pub written: &'static str,
    pub name: &'static str,
    pub key: &'static str,
    pub does: HandKey,
}

const fn row(written: &'static str, key: &'static str, name: &'static str, does: HandKey) -> HandKeyRow {
    HandKeyRow { written, name, key, does }
}

/// With Shift, a direction key moves ten steps.
pub const HAND_KEYS: [HandKeyRow; 8] = [
    row("→", "ArrowRight", key!("page.jog.x_plus"), HandKey::Move { axis: 0, up: true }),
    row("←", "ArrowLeft", key!("page.jog.x_minus"), HandKey::Move { axis: 0, up: false }),
    row("↑", "ArrowUp", key!("page.jog.y_plus"), HandKey::Move { axis: 1, up: true }),
    row("↓", "ArrowDown", key!("page.jog.y_minus"), HandKey::Move { axis: 1, up: false }),
    row("PageUp", "PageUp", key!("page.jog.z_plus"), HandKey::Move { axis: 2, up: true }),
    row("PageDown", "PageDown", key!("page.jog.z_minus"), HandKey::Move { axis: 2, up: false }),
    row("-", "-", key!("page.key.step_finer"), HandKey::Step { finer: true }),
    row("=", "=", key!("page.key.step_coarser"), HandKey::Step { finer: false }),
];

pub fn by_hand(key: &str) -> Option<HandKey> {
    // With Shift, the `=` key types a plus.
    let key = if key == "+" { "=" } else { key };
    HAND_KEYS.iter().find(|row| row.key == key).map(|row| row.does)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_jog_direction_and_step_size_has_one_armed_key() {
        let ways = (0..3).flat_map(|axis| [true, false].map(|up| HandKey::Move { axis, up }));
        let steps = [true, false].map(|finer| HandKey::Step { finer });
        for wanted in ways.chain(steps) {
            assert_eq!(HAND_KEYS.iter().filter(|row| row.does == wanted).count(), 1, "{wanted:?}");
        }
        assert_eq!(by_hand("PageUp"), Some(HandKey::Move { axis: 2, up: true }));
        assert_eq!(by_hand("+"), Some(HandKey::Step { finer: false }));
        assert_eq!(["Home", "a", ""].map(by_hand), [None; 3]);
    }
}
