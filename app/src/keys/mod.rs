//! Keyboard shortcuts by screen and focus. Safety: no key starts or resumes motion.
//!
//! ```text
//! press ─▶ letter at its position (latin) ─▶ custom key (own) ─▶ dialog open? focus? screen? ─▶ action
//! ```

mod address;
mod latin;
mod own;
mod table;

pub use address::{AddressPart, named};
pub use latin::latin;
pub use own::{OwnKeys, is_of_ones_own};
pub use table::{COMMANDS, HAND_KEYS, HandKey, HandKeyRow, SHORTCUTS, Shortcut, Tab, by_hand};

use crate::drawing::DrawKey;
use crate::drawing::keys as draw;

#[derive(Clone, Debug, Default)]
pub struct Press {
    pub key: String,
    pub code: String,
    /// Control, or Command on a Mac.
    pub ctrl: bool,
    pub shift: bool,
    pub alt: bool,
    pub repeat: bool,
    pub composing: bool,
    pub focus: KeyFocus,
    pub in_dialog: bool,
}

/// The focus, as far as it affects keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeyFocus {
    /// On nothing that uses keys.
    #[default]
    Elsewhere,
    Text,
    /// In a multi-line field, which has its own undo.
    Lines,
    /// On a menu: typing selects an option.
    Menu,
    /// On a slider: arrows, Home and End move it.
    Slider,
    /// On a button or checkbox: Space and Enter press it.
    Button,
    /// On a list, a tab or a radio group: arrows move the choice.
    Control,
    Picture,
}

impl KeyFocus {
    fn is_text(self) -> bool {
        matches!(self, Self::Text | Self::Lines)
    }

    fn is_control(self) -> bool {
        matches!(self, Self::Menu | Self::Slider | Self::Button | Self::Control)
    }

    /// True if the focused element may handle `key` itself, pressed without Ctrl and Alt.
    fn keeps(self, key: &str) -> bool {
        let moves = key.starts_with("Arrow") || matches!(key, "Home" | "End");
        self.is_control() && (matches!(key, " " | "Enter") || (moves && self != Self::Button))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyAction {
    Stop,
    /// Closes what is open, and pauses; pressed twice, stops.
    Escape,
    Show(Tab),
    Open,
    Units,
    /// The next region of the page; the previous one with Shift.
    Region {
        /// Forwards, else backwards.
        onwards: bool,
    },
    Fit,
    Walk {
        /// 1 for right, -1 for left.
        x: i8,
        /// 1 for up, -1 for down.
        y: i8,
    },
    FitChosen,
    ActualSize,
    Grid,
    /// Looks from the other side of the board.
    Flip,
    FromAbove,
    /// The initial 3D view.
    HomeView,
    /// Switches between 2D view and 3D view; on screens with only a 2D view, opens the 3D view.
    Space,
    ZoomIn,
    ZoomOut,
    Play,
    Step(Stride),
    Beginning,
    End,
    Faster {
        more: bool,
    },
    Pause,
    ArmKeys,
    Speak,
    /// Does nothing, and also suppresses the browser's shortcut.
    Nothing,
    /// A command without a key.
    Keyless(Keyless),
    /// Undo or redo in the Lab.
    Undo {
        /// Undo, else redo.
        back: bool,
    },
    /// A command of the Lab's queue.
    Queue(QueueKey),
    Cam(CamKey),
    Draw(DrawKey),
    /// Keys, first steps and glossary.
    Help,
    Palette,
    Save,
}

/// A command without a key; found in the palette.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keyless {
    NewExports,
    CloseBoard,
    Export,
    RunSheet,
    /// Repeats the selection of the drawing in columns and rows.
    Array,
    Edge,
    UseBoard,
    NewDrawing,
    /// As Gerber and Excellon.
    SaveBoard,
    SaveSvg,
    SaveDrawing,
    HeightMap,
    /// The large view, which shows only the machine.
    LargeView {
        on: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CamKey {
    Add,
    Move {
        up: bool,
    },
    Undo {
        /// Undo, else redo.
        back: bool,
    },
    Remove,
    Problem {
        /// The next, else the previous.
        next: bool,
    },
}

/// Runs the queue in the page only. If the machine is the target, these keys show a message instead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QueueKey {
    Break,
    Step,
    /// To the next breakpoint.
    Run,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stride {
    Segment {
        onwards: bool,
    },
    Hole {
        onwards: bool,
    },
    /// One percent of the total time.
    Percent {
        onwards: bool,
    },
}

/// True for Shift: releasing it ends a jog.
pub fn is_shift(key: &str) -> bool {
    key == "Shift"
}

pub fn is_escape(key: &str) -> bool {
    key == "Escape"
}

/// A character key, alone or with Shift. Speech input triggers such keys by mistake, so the user can turn
/// them off.
fn is_sign(press: &Press) -> bool {
    let mut letters = press.key.chars();
    !press.ctrl && !press.alt && letters.next().is_some_and(|sign| sign != ' ') && letters.next().is_none()
}

/// True if the focused menu or slider handles this key itself, or the user would expect so.
fn is_of_focus(press: &Press) -> bool {
    let moves = press.key.starts_with("Arrow")
        || matches!(press.key.as_str(), "Home" | "End" | "PageUp" | "PageDown" | "Delete" | "Backspace");
    match press.focus {
        _ if press.ctrl => false,
        KeyFocus::Menu => moves || is_sign(press) || matches!(press.key.as_str(), " " | "Enter"),
        KeyFocus::Slider => moves && !press.alt,
        _ => false,
    }
}

/// The action of `press` on `tab`. Character keys are ignored if `signs` is false. In a dialog, only stop,
/// close and help work.
pub fn action(press: &Press, tab: Tab, signs: bool) -> Option<KeyAction> {
    let asked = asked(press, tab, signs)?;
    match asked {
        _ if !press.in_dialog => Some(asked),
        KeyAction::Stop | KeyAction::Escape | KeyAction::Help => Some(asked),
        // Suppress the browser's own commands, which would save or leave the page.
        KeyAction::Open | KeyAction::Save | KeyAction::Palette => Some(KeyAction::Nothing),
        _ => None,
    }
}

/// The action, without regard to dialogs.
fn asked(press: &Press, tab: Tab, signs: bool) -> Option<KeyAction> {
    if press.composing || (!signs && is_sign(press)) {
        return None;
    }
    let key = press.key.as_str();
    if press.ctrl && press.shift && !press.alt && (key.eq_ignore_ascii_case("e") || press.code == "KeyE") {
        return Some(KeyAction::Stop);
    }
    if key == "Escape" {
        return (!press.repeat).then_some(KeyAction::Escape);
    }
    if key == "F6" {
        return Some(KeyAction::Region { onwards: !press.shift });
    }
    if press.repeat && matches!(key, "F1" | "?") {
        return None;
    }
    if key == "F1" {
        return Some(KeyAction::Help);
    }
    if is_of_focus(press) {
        return None;
    }
    let in_text = press.focus.is_text();
    if key == "?" && !in_text && !press.ctrl && !press.alt {
        return Some(KeyAction::Help);
    }
    if press.ctrl && !press.alt && !press.shift {
        match key {
            "k" | "K" | "/" => return Some(KeyAction::Palette),
            "s" | "S" => return Some(KeyAction::Save),
            "o" | "O" => return Some(KeyAction::Open),
            "0" if !in_text => return Some(KeyAction::ActualSize),
            "'" => return Some(KeyAction::Grid),
            _ => {}
        }
    }
    if press.ctrl && press.shift && !press.alt && key.eq_ignore_ascii_case("s") {
        // "Save as" is the same as "Save": each save of a project gets a new name.
        return Some(KeyAction::Save);
    }
    let own = match tab {
        Tab::Lab if !press.alt => in_lab(press, key),
        Tab::Cam => in_cam(press, key).map(KeyAction::Cam),
        Tab::Board | Tab::Simulate => undo_of_job(press, key).map(KeyAction::Cam),
        Tab::Draw => in_drawing(press, key).map(KeyAction::Draw),
        _ => None,
    };
    if own.is_some() {
        return own;
    }
    if tab.shows_board() && press.alt && !press.ctrl && press.code == "Digit3" {
        return Some(KeyAction::Space);
    }
    if in_text || press.alt {
        return None;
    }
    if press.ctrl {
        return match (tab, key) {
            (_, "u" | "U") => Some(KeyAction::Units),
            (_, ",") => Some(KeyAction::Show(Tab::Settings)),
            (Tab::Simulate, "ArrowLeft" | "ArrowRight") => {
                Some(KeyAction::Step(Stride::Percent { onwards: key == "ArrowRight" }))
            }
            _ => None,
        };
    }
    on_screen(press, key, tab).or_else(|| anywhere(press, key, tab))
}

/// True for undo, false for redo.
fn back(press: &Press, key: &str) -> Option<bool> {
    match key.to_ascii_lowercase().as_str() {
        _ if !press.ctrl || press.alt => None,
        "z" => Some(!press.shift),
        "y" if !press.shift => Some(false),
        _ => None,
    }
}

fn in_lab(press: &Press, key: &str) -> Option<KeyAction> {
    match key.to_ascii_lowercase().as_str() {
        "f8" | "f9" | "f10" if press.repeat || press.ctrl || press.shift => None,
        "f8" => Some(KeyAction::Queue(QueueKey::Run)),
        "f9" => Some(KeyAction::Queue(QueueKey::Break)),
        "f10" => Some(KeyAction::Queue(QueueKey::Step)),
        _ if press.focus == KeyFocus::Lines => None,
        _ => back(press, key).map(|back| KeyAction::Undo { back }),
    }
}

/// One undo for the job on all screens of the board; text fields have their own.
fn undo_of_job(press: &Press, key: &str) -> Option<CamKey> {
    back(press, key).filter(|_| !press.focus.is_text()).map(|back| CamKey::Undo { back })
}

fn in_cam(press: &Press, key: &str) -> Option<CamKey> {
    if press.alt {
        let up = key == "ArrowUp";
        return (!press.ctrl && (up || key == "ArrowDown")).then_some(CamKey::Move { up });
    }
    match key.to_ascii_lowercase().as_str() {
        "f8" if !press.ctrl => Some(CamKey::Problem { next: !press.shift }),
        _ if press.focus.is_text() => None,
        "a" if !press.ctrl && !press.shift => Some(CamKey::Add),
        "delete" if !press.ctrl => Some(CamKey::Remove),
        _ => undo_of_job(press, key),
    }
}

/// The keys of the Draw screen. Text fields have their own keys; Enter and arrows belong to a focused button.
fn in_drawing(press: &Press, key: &str) -> Option<DrawKey> {
    let on_button = press.focus.is_control() && (key == "Enter" || key.starts_with("Arrow"));
    // On many keyboards Shift+2 types `@`; Shift+2 fits the selection.
    let shows_chosen = press.shift && press.code == "Digit2";
    if press.focus.is_text() || press.alt || on_button || shows_chosen {
        return None;
    }
    draw::of(key, press.ctrl, press.shift)
}

fn on_screen(press: &Press, key: &str, tab: Tab) -> Option<KeyAction> {
    if press.focus.keeps(key) {
        return None;
    }
    let on_picture = press.focus == KeyFocus::Picture;
    match (tab, key) {
        (Tab::Board | Tab::Cam, "ArrowLeft" | "ArrowRight" | "ArrowUp" | "ArrowDown") if on_picture => {
            let along = |less: &str, more: &str| i8::from(key == more) - i8::from(key == less);
            let way =
                KeyAction::Walk { x: along("ArrowLeft", "ArrowRight"), y: along("ArrowDown", "ArrowUp") };
            (!press.shift).then_some(way)
        }
        (Tab::Cam, "s" | "S") if !press.shift => Some(KeyAction::Show(Tab::Simulate)),
        (Tab::Machine, " ") => (!press.repeat).then_some(KeyAction::Pause),
        (Tab::Simulate, " ") => (!press.repeat).then_some(KeyAction::Play),
        (Tab::Simulate, "ArrowLeft" | "ArrowRight") => {
            let on = key == "ArrowRight";
            Some(KeyAction::Step(if press.shift {
                Stride::Hole { onwards: on }
            } else {
                Stride::Segment { onwards: on }
            }))
        }
        (Tab::Simulate, "Home") => Some(KeyAction::Beginning),
        (Tab::Simulate, "End") => Some(KeyAction::End),
        (Tab::Simulate, "t" | "T") if !press.shift => Some(KeyAction::FromAbove),
        (Tab::Simulate, "h" | "H") if !press.shift => Some(KeyAction::HomeView),
        (Tab::Simulate, "," | ".") => Some(KeyAction::Faster { more: key == "." }),
        (Tab::Draw | Tab::Board | Tab::Cam | Tab::Machine, "Home") => Some(KeyAction::Fit),
        _ => None,
    }
}

fn anywhere(press: &Press, key: &str, tab: Tab) -> Option<KeyAction> {
    if press.shift {
        return match (key, press.code.as_str()) {
            (_, "Digit1") => Some(KeyAction::Fit),
            (_, "Digit2") => Some(KeyAction::FitChosen),
            ("+" | "=", _) | (_, "Equal") => Some(KeyAction::ZoomIn),
            ("_" | "-", _) | (_, "Minus") => Some(KeyAction::ZoomOut),
            ("W" | "w", _) => Some(KeyAction::Speak),
            _ => None,
        };
    }
    if tab == Tab::Machine && matches!(key, "j" | "J") {
        return (!press.repeat).then_some(KeyAction::ArmKeys);
    }
    if matches!(key, "f" | "F") {
        return Some(KeyAction::Flip);
    }
    let number = key.parse::<usize>().ok().filter(|_| key.len() == 1)?;
    Tab::ALL.get(number).map(|tab| KeyAction::Show(*tab))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::keys::StepSize;
    use crate::drawing::{Act, Tool};

    fn press(text: &str) -> Press {
        let mut press = Press::default();
        for word in text.split('+') {
            match word {
                "Ctrl" => press.ctrl = true,
                "Shift" => press.shift = true,
                "Alt" => press.alt = true,
                "text" => press.focus = KeyFocus::Text,
                "lines" => press.focus = KeyFocus::Lines,
                "button" => press.focus = KeyFocus::Button,
                "control" => press.focus = KeyFocus::Control,
                "menu" => press.focus = KeyFocus::Menu,
                "slider" => press.focus = KeyFocus::Slider,
                "picture" => press.focus = KeyFocus::Picture,
                "dialog" => press.in_dialog = true,
                "composing" => press.composing = true,
                "repeat" => press.repeat = true,
                "Space" => press.key = " ".to_owned(),
                key => press.key = key.to_owned(),
            }
        }
        press
    }

    #[test]
    fn shortcuts_act_only_on_their_screens() {
        let far_down = KeyAction::Draw(DrawKey::Step { x: 0, y: -1, size: StepSize::Far });
        let rows = [
            ("Ctrl+Shift+E", Tab::Board, Some(KeyAction::Stop)),
            ("text+Ctrl+Shift+E", Tab::Settings, Some(KeyAction::Stop)),
            ("text+Escape", Tab::Settings, Some(KeyAction::Escape)),
            ("repeat+Escape", Tab::Machine, None),
            ("composing+Escape", Tab::Machine, None),
            ("Space", Tab::Machine, Some(KeyAction::Pause)),
            ("Space", Tab::Simulate, Some(KeyAction::Play)),
            ("Space", Tab::Board, None),
            ("control+Space", Tab::Machine, None),
            ("text+Space", Tab::Machine, None),
            ("Shift+ArrowRight", Tab::Simulate, Some(KeyAction::Step(Stride::Hole { onwards: true }))),
            ("Ctrl+ArrowLeft", Tab::Simulate, Some(KeyAction::Step(Stride::Percent { onwards: false }))),
            ("2", Tab::Board, Some(KeyAction::Show(Tab::Cam))),
            ("4", Tab::Board, Some(KeyAction::Show(Tab::Machine))),
            ("5", Tab::Board, Some(KeyAction::Show(Tab::Lab))),
            ("f", Tab::Board, Some(KeyAction::Flip)),
            ("t", Tab::Simulate, Some(KeyAction::FromAbove)),
            ("h", Tab::Simulate, Some(KeyAction::HomeView)),
            ("t", Tab::Board, None),
            ("text+f", Tab::Board, None),
            ("J", Tab::Machine, Some(KeyAction::ArmKeys)),
            ("Ctrl+z", Tab::Cam, Some(KeyAction::Cam(CamKey::Undo { back: true }))),
            ("text+Ctrl+z", Tab::Cam, None),
            ("Alt+ArrowUp", Tab::Cam, Some(KeyAction::Cam(CamKey::Move { up: true }))),
            ("Alt+ArrowDown", Tab::Board, None),
            ("Shift+F8", Tab::Cam, Some(KeyAction::Cam(CamKey::Problem { next: false }))),
            ("a", Tab::Cam, Some(KeyAction::Cam(CamKey::Add))),
            ("text+a", Tab::Cam, None),
            ("Delete", Tab::Cam, Some(KeyAction::Cam(CamKey::Remove))),
            ("lines+F10", Tab::Lab, Some(KeyAction::Queue(QueueKey::Step))),
            ("repeat+F10", Tab::Lab, None),
            ("F8", Tab::Machine, None),
            ("9", Tab::Board, None),
            ("Ctrl+Alt+u", Tab::Board, None),
            ("text+?", Tab::Board, None),
            ("Shift+?", Tab::Lab, Some(KeyAction::Help)),
            ("text+F1", Tab::Settings, Some(KeyAction::Help)),
            ("text+Ctrl+k", Tab::Cam, Some(KeyAction::Palette)),
            ("Ctrl+Alt+s", Tab::Cam, None),
            ("Enter", Tab::Machine, None),
            ("j", Tab::Machine, Some(KeyAction::ArmKeys)),
            ("text+j", Tab::Machine, None),
            ("j", Tab::Board, None),
            ("0", Tab::Board, Some(KeyAction::Show(Tab::Draw))),
            ("7", Tab::Board, None),
            ("x", Tab::Draw, Some(KeyAction::Draw(DrawKey::Tool(Tool::Track)))),
            ("text+x", Tab::Draw, None),
            ("x", Tab::Board, None),
            ("Ctrl+Alt+z", Tab::Draw, None),
            ("Ctrl+Shift+z", Tab::Draw, Some(KeyAction::Draw(DrawKey::Act(Act::Undo { back: false })))),
            ("control+Enter", Tab::Draw, None),
            ("control+ArrowUp", Tab::Draw, None),
            ("control+Delete", Tab::Draw, Some(KeyAction::Draw(DrawKey::Act(Act::Delete)))),
            ("f", Tab::Draw, Some(KeyAction::Flip)),
            ("picture+ArrowUp", Tab::Cam, Some(KeyAction::Walk { x: 0, y: 1 })),
            ("ArrowUp", Tab::Board, None),
            ("Shift+ArrowDown", Tab::Draw, Some(far_down)),
        ];
        for (text, tab, expected) in rows {
            assert_eq!(action(&press(text), tab, true), expected, "{text} on {tab:?}");
        }
    }

    #[test]
    fn focused_button_takes_only_the_keys_that_press_it() {
        let onwards = Some(KeyAction::Step(Stride::Segment { onwards: true }));
        let rows = [
            ("button+t", Tab::Simulate, Some(KeyAction::FromAbove)),
            ("button+h", Tab::Simulate, Some(KeyAction::HomeView)),
            ("button+.", Tab::Simulate, Some(KeyAction::Faster { more: true })),
            ("button+ArrowRight", Tab::Simulate, onwards),
            ("button+Home", Tab::Simulate, Some(KeyAction::Beginning)),
            ("button+Home", Tab::Board, Some(KeyAction::Fit)),
            ("button+s", Tab::Cam, Some(KeyAction::Show(Tab::Simulate))),
            ("button+Space", Tab::Simulate, None),
            ("button+Space", Tab::Machine, None),
            ("button+Enter", Tab::Draw, None),
            ("button+ArrowUp", Tab::Draw, None),
            ("control+t", Tab::Simulate, Some(KeyAction::FromAbove)),
            ("control+ArrowRight", Tab::Simulate, None),
            ("control+Home", Tab::Simulate, None),
            ("control+Space", Tab::Simulate, None),
            ("slider+t", Tab::Simulate, Some(KeyAction::FromAbove)),
        ];
        for (text, tab, expected) in rows {
            assert_eq!(action(&press(text), tab, true), expected, "{text} on {tab:?}");
        }
    }

    #[test]
    fn undo_keys_work_only_on_screens_with_edits() {
        let rows = [
            ("Ctrl+z", Tab::Lab, Some(KeyAction::Undo { back: true })),
            ("text+Ctrl+z", Tab::Lab, Some(KeyAction::Undo { back: true })),
            ("lines+Ctrl+z", Tab::Lab, None),
            ("Ctrl+Shift+Z", Tab::Lab, Some(KeyAction::Undo { back: false })),
            ("Ctrl+y", Tab::Lab, Some(KeyAction::Undo { back: false })),
            ("Ctrl+z", Tab::Board, Some(KeyAction::Cam(CamKey::Undo { back: true }))),
            ("Ctrl+Shift+z", Tab::Simulate, Some(KeyAction::Cam(CamKey::Undo { back: false }))),
            ("text+Ctrl+z", Tab::Board, None),
            ("Ctrl+Alt+z", Tab::Board, None),
            ("Ctrl+z", Tab::Machine, None),
            ("Ctrl+'", Tab::Cam, Some(KeyAction::Grid)),
        ];
        for (text, tab, expected) in rows {
            assert_eq!(action(&press(text), tab, true), expected, "{text} on {tab:?}");
        }
    }

    #[test]
    fn dialog_blocks_shortcuts_except_stop_escape_and_help() {
        for shortcut in SHORTCUTS {
            let press = Press { in_dialog: true, ..pressed(shortcut) };
            let expected = match shortcut.action {
                action @ (KeyAction::Stop | KeyAction::Escape | KeyAction::Help) => Some(action),
                KeyAction::Open | KeyAction::Save | KeyAction::Palette => Some(KeyAction::Nothing),
                _ => None,
            };
            let tab = shortcut.tab.unwrap_or(Tab::Machine);
            assert_eq!(action(&press, tab, true), expected, "{} on {tab:?}", shortcut.keys);
        }
    }

    #[test]
    fn menu_and_slider_take_their_own_keys() {
        let stop = Some(KeyAction::Stop);
        let up = Some(KeyAction::Cam(CamKey::Move { up: true }));
        let rows = [
            ("menu+0", Tab::Cam, None),
            ("menu+.", Tab::Simulate, None),
            ("menu+a", Tab::Cam, None),
            ("menu+p", Tab::Draw, None),
            ("menu+Shift+P", Tab::Draw, None),
            ("menu+?", Tab::Draw, None),
            ("menu+Space", Tab::Machine, None),
            ("menu+Enter", Tab::Draw, None),
            ("menu+PageDown", Tab::Draw, None),
            ("menu+Alt+ArrowDown", Tab::Cam, None),
            ("menu+Delete", Tab::Cam, None),
            ("menu+F8", Tab::Cam, Some(KeyAction::Cam(CamKey::Problem { next: true }))),
            ("menu+Ctrl+z", Tab::Cam, Some(KeyAction::Cam(CamKey::Undo { back: true }))),
            ("menu+Escape", Tab::Machine, Some(KeyAction::Escape)),
            ("menu+Ctrl+Shift+E", Tab::Machine, stop),
            ("slider+Delete", Tab::Cam, None),
            ("slider+Backspace", Tab::Draw, None),
            ("slider+Home", Tab::Simulate, None),
            ("slider+Shift+ArrowRight", Tab::Simulate, None),
            ("slider+Alt+ArrowUp", Tab::Cam, up),
            ("slider+2", Tab::Simulate, Some(KeyAction::Show(Tab::Cam))),
            ("slider+Ctrl+Shift+E", Tab::Machine, stop),
            ("control+Delete", Tab::Cam, Some(KeyAction::Cam(CamKey::Remove))),
        ];
        for (text, tab, expected) in rows {
            assert_eq!(action(&press(text), tab, true), expected, "{text} on {tab:?}");
        }
    }

    fn pressed(shortcut: &Shortcut) -> Press {
        let mut press = press(&shortcut.keys.replace("++", "+Plus"));
        if press.key == "Plus" {
            "+".clone_into(&mut press.key);
        }
        if (press.shift || press.alt) && press.key.parse::<u8>().is_ok() {
            press.code = format!("Digit{}", press.key);
        }
        // As on most keyboards.
        let signs = [("1", "!"), ("2", "@")];
        let sign = signs.into_iter().find(|(digit, _)| press.shift && press.key == *digit);
        if let Some((_, sign)) = sign {
            sign.clone_into(&mut press.key);
        }
        if matches!(shortcut.action, KeyAction::Walk { .. }) {
            press.focus = KeyFocus::Picture;
        }
        press
    }

    #[test]
    fn every_listed_shortcut_does_its_action() {
        for shortcut in SHORTCUTS {
            let press = pressed(shortcut);
            let tabs = shortcut.tab.map_or_else(|| Tab::ALL.to_vec(), |tab| vec![tab]);
            for tab in tabs {
                assert_eq!(action(&press, tab, true), Some(shortcut.action), "{} on {tab:?}", shortcut.keys);
            }
        }
    }

    #[test]
    fn character_keys_can_be_turned_off() {
        for shortcut in SHORTCUTS {
            let press = pressed(shortcut);
            let typed = press.key.chars().count() == 1 && press.key != " " && !press.ctrl && !press.alt;
            let expected = (!typed).then_some(shortcut.action);
            assert_eq!(
                action(&press, shortcut.tab.unwrap_or_default(), false),
                expected,
                "{}",
                shortcut.keys
            );
        }
        assert_eq!(action(&press("?"), Tab::Board, false), None, "F1 opens the help");
    }

    /// The documented keys, by screen; each must do something there. Jog and Lab tables have separate keys.
    #[test]
    fn every_documented_key_has_an_action() {
        let everywhere = "0 1 2 3 4 5 6 Ctrl+o Ctrl+s Ctrl+Shift+s Ctrl+u Ctrl+k Ctrl+/ F1 ? F6 Shift+F6 Ctrl+, Escape Ctrl+Shift+e \
                          Shift+w Shift+1 Shift+2 Ctrl+0 Ctrl+' Shift+= Shift+- f";
        let rows = [
            (Tab::Board, "Home Alt+3 Ctrl+z Ctrl+y Ctrl+Shift+z"),
            (Tab::Draw, "Ctrl+z Ctrl+y Ctrl+Shift+z Ctrl+x Ctrl+c Ctrl+v Ctrl+a Ctrl+d Delete F2 Home"),
            (
                Tab::Draw,
                "v x l p o n d Ctrl+Shift+m m r Shift+r e Ctrl+g Ctrl+Shift+g ArrowUp Shift+ArrowUp Ctrl+ArrowUp",
            ),
            (Tab::Draw, "PageUp PageDown h g Shift+g Enter End Backspace"),
            (Tab::Cam, "a Alt+ArrowUp Alt+ArrowDown Alt+3 s F8 Shift+F8 Ctrl+z Ctrl+y Ctrl+Shift+z Delete"),
            (
                Tab::Simulate,
                "Space ArrowLeft ArrowRight Shift+ArrowLeft Shift+ArrowRight Ctrl+ArrowLeft Ctrl+ArrowRight",
            ),
            (Tab::Simulate, "Home End , . t h Alt+3 Ctrl+z Ctrl+y Ctrl+Shift+z"),
            (Tab::Machine, "Space j"),
            (Tab::Lab, "F8 F9 F10 Ctrl+z Ctrl+y"),
        ];
        let pressed = |keys: &str, tab: Tab| {
            let mut press = press(keys);
            if press.shift || press.alt {
                press.code = format!("Digit{}", press.key);
            }
            action(&press, tab, true)
        };
        for keys in everywhere.split_whitespace() {
            let silent = Tab::ALL.iter().find(|tab| pressed(keys, **tab).is_none());
            assert_eq!(silent, None, "{keys}");
        }
        for (tab, keys) in rows {
            let silent: Vec<_> =
                keys.split_whitespace().filter(|keys| pressed(keys, tab).is_none()).collect();
            assert_eq!(silent, Vec::<&str>::new(), "on {tab:?}");
        }
    }

    #[test]
    fn addresses_select_their_screen() {
        for tab in Tab::ALL {
            assert_eq!(Tab::of_address(&format!("#/{}", tab.word())), Some(tab));
        }
        assert_eq!(Tab::of_address("#/machine?view=operator"), Some(Tab::Machine));
        assert_eq!(Tab::of_address("#t=abc"), None);
    }
}
