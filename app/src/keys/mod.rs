//! Which key means what, and where. No key starts or resumes motion.
//!
//! ```text
//! press ─▶ letter of its place (latin) ─▶ key of one's own (own) ─▶ a dialog open? what has the focus? which screen? ─▶ action
//! ```
//!
//! Comes in: a key press as plain data. Goes out: an [`KeyAction`]. Knows no browser.

mod address;
mod by_hand;
mod latin;
mod own;
mod table;

pub use address::{AddressPart, named};
pub use by_hand::{HAND_KEYS, HandKey, HandKeyRow, by_hand};
pub use latin::latin;
pub use own::{OwnKeys, is_of_ones_own};
pub use table::{COMMANDS, SHORTCUTS, Shortcut};

use crate::drawing::DrawKey;
use crate::drawing::keys as draw;

/// The screens, in the order of their numbers from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tab {
    /// The board editor.
    Draw,
    /// The board and its holes.
    #[default]
    Board,
    /// What is milled and drilled, with what, in which order.
    Cam,
    /// The playback.
    Simulate,
    /// The drill.
    Machine,
    /// Tables, profiles and commands tried out one by one.
    Lab,
    /// What is set once.
    Settings,
}

impl Tab {
    /// All of them, in order.
    pub const ALL: [Self; 7] =
        [Self::Draw, Self::Board, Self::Cam, Self::Simulate, Self::Machine, Self::Lab, Self::Settings];

    /// Its word in the address: `#/board`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Draw => "draw",
            Self::Board => "board",
            Self::Cam => "cam",
            Self::Simulate => "simulate",
            Self::Machine => "machine",
            Self::Lab => "lab",
            Self::Settings => "settings",
        }
    }

    /// The screen of an address.
    pub fn of_address(hash: &str) -> Option<Self> {
        let word = hash.strip_prefix("#/")?.split(['/', '?']).next()?;
        Self::ALL.into_iter().find(|tab| tab.word() == word)
    }
}

/// A key press.
#[derive(Clone, Debug, Default)]
pub struct Press {
    /// `KeyboardEvent.key`.
    pub key: String,
    /// `KeyboardEvent.code`.
    pub code: String,
    /// Control, or Command on a Mac.
    pub ctrl: bool,
    /// Shift.
    pub shift: bool,
    /// Alt.
    pub alt: bool,
    /// The key is held and repeats.
    pub repeat: bool,
    /// An input method is composing a word.
    pub composing: bool,
    /// Where the focus is.
    pub focus: KeyFocus,
    /// A dialog lies over the page.
    pub in_dialog: bool,
}

/// Where the focus is, as far as keys go by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeyFocus {
    /// On nothing that has keys of its own.
    #[default]
    Elsewhere,
    /// In a field of one line.
    Text,
    /// In a field of many lines, which has an undo of its own.
    Lines,
    /// On a menu: what is typed chooses in it.
    Menu,
    /// On a slider, which the arrows, Home and End move.
    Slider,
    /// On a button or a tick, which Space and Enter press.
    Button,
    /// On a list, a tab or a choice of several, which the arrows move as well.
    Control,
    /// On the picture.
    Picture,
}

impl KeyFocus {
    fn is_text(self) -> bool {
        matches!(self, Self::Text | Self::Lines)
    }

    fn is_control(self) -> bool {
        matches!(self, Self::Menu | Self::Slider | Self::Button | Self::Control)
    }

    /// Whether what has the focus may do something by `key` itself, pressed without Ctrl and Alt.
    fn keeps(self, key: &str) -> bool {
        let moves = key.starts_with("Arrow") || matches!(key, "Home" | "End");
        self.is_control() && (matches!(key, " " | "Enter") || (moves && self != Self::Button))
    }
}

/// What a press asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeyAction {
    /// STOP.
    Stop,
    /// Close what is open and pause; twice stops.
    Escape,
    /// Show this screen.
    Show(Tab),
    /// Choose files.
    Open,
    /// Millimetres or inches.
    Units,
    /// Next region of the page; backwards with Shift.
    Region {
        /// To the next, else to the one before.
        onwards: bool,
    },
    /// Whole board.
    Fit,
    /// The hole beside the chosen one in the picture, by so many to the right and up.
    Walk {
        /// To the right, 0 or to the left.
        x: i8,
        /// Up, 0 or down.
        y: i8,
    },
    /// What is chosen.
    FitChosen,
    /// As large as the board is.
    ActualSize,
    /// The grid is drawn, or not.
    Grid,
    /// The other side of the board.
    Flip,
    /// Straight from above.
    FromAbove,
    /// As the board in space is seen first.
    HomeView,
    /// Flat or in space; from a screen that is always flat, to the board in space.
    Space,
    /// Closer.
    ZoomIn,
    /// Further.
    ZoomOut,
    /// Play or hold the playback.
    Play,
    /// Back or on: by a step.
    Step(Stride),
    /// To the beginning of the playback.
    Beginning,
    /// To its end.
    End,
    /// Slower or faster.
    Faster {
        /// Faster, else slower.
        more: bool,
    },
    /// Pause the job.
    Pause,
    /// Let keys move the machine by hand, or no longer.
    ArmKeys,
    /// Read the position out.
    Speak,
    /// Nothing, and the browser does nothing of its own by it either.
    Nothing,
    /// Something that has no key.
    Keyless(Keyless),
    /// Back by an edit of the Lab, or on again.
    Undo {
        /// Back, else on again.
        back: bool,
    },
    /// Something of the Lab's queue.
    Queue(QueueKey),
    /// Something of the job.
    Cam(CamKey),
    /// Something of the drawing.
    Draw(DrawKey),
    /// Keys, first steps and words.
    Help,
    /// All that can be done, to be searched.
    Palette,
    /// Save the project.
    Save,
}

/// What has no key, and is found by its words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keyless {
    /// New exports of the open board.
    NewExports,
    /// The board is closed.
    CloseBoard,
    /// The job in a controller's words, as files.
    Export,
    /// The sheet for whoever runs them.
    RunSheet,
    /// What is chosen of the drawing is repeated.
    Array,
    /// Tracks are drawn that are the edge of the board.
    Edge,
    /// The drawing becomes the board.
    UseBoard,
    /// An empty drawing.
    NewDrawing,
    /// The drawing as Gerber and Excellon.
    SaveBoard,
    /// The drawing as a picture.
    SaveSvg,
    /// The drawing itself.
    SaveDrawing,
    /// The height map of the board.
    HeightMap,
    /// The machine alone, large, or all of it.
    LargeView {
        /// The machine alone.
        on: bool,
    },
}

/// What a key asks of the job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CamKey {
    /// Add an operation.
    Add,
    /// The chosen operation up or down.
    Move {
        /// Up, else down.
        up: bool,
    },
    /// Back by an edit, or on again.
    Undo {
        /// Back, else on again.
        back: bool,
    },
    /// Take the chosen operation out.
    Remove,
    /// Show the next finding, or the one before.
    Problem {
        /// The next, else the one before.
        next: bool,
    },
}

/// What a key asks of the queue. It runs in this page's own drill, unless the person chose the machine and it is still.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QueueKey {
    /// Breakpoint on or off.
    Break,
    /// One row.
    Step,
    /// To the next breakpoint.
    Run,
}

/// How far a step of the playback goes; `true` is onwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stride {
    /// To the next segment.
    Segment {
        /// Onwards, else back.
        onwards: bool,
    },
    /// To the next hole.
    Hole {
        /// Onwards, else back.
        onwards: bool,
    },
    /// A hundredth of the whole.
    Percent {
        /// Onwards, else back.
        onwards: bool,
    },
}

/// Whether a key is the one that is held for more.
pub fn is_shift(key: &str) -> bool {
    key == "Shift"
}

/// Whether a key is the one that leaves a field.
pub fn is_escape(key: &str) -> bool {
    key == "Escape"
}

/// A key that types something, pressed alone or with Shift. Who speaks to the computer types them by mistake: they can be turned off.
fn is_sign(press: &Press) -> bool {
    let mut letters = press.key.chars();
    !press.ctrl && !press.alt && letters.next().is_some_and(|sign| sign != ' ') && letters.next().is_none()
}

/// Whether the menu or slider that has the focus does something by this key itself, or would seem to.
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

/// What `press` asks for on `tab`; keys that type something mean nothing where `signs` are off. A dialog has the keys to itself, but
/// for those that stop, close and explain.
pub fn action(press: &Press, tab: Tab, signs: bool) -> Option<KeyAction> {
    let asked = asked(press, tab, signs)?;
    match asked {
        _ if !press.in_dialog => Some(asked),
        KeyAction::Stop | KeyAction::Escape | KeyAction::Help => Some(asked),
        // By these the browser would save the page, or leave it for a file.
        KeyAction::Open | KeyAction::Save | KeyAction::Palette => Some(KeyAction::Nothing),
        _ => None,
    }
}

/// The same where no dialog is open.
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
        // A project is saved under a name of its own each time.
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
    let has_board = matches!(tab, Tab::Board | Tab::Cam | Tab::Simulate);
    if has_board && press.alt && !press.ctrl && press.code == "Digit3" {
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

/// Whether an edit is taken back by this key, or made again; none where it is no such key.
fn back(press: &Press, key: &str) -> Option<bool> {
    match key.to_ascii_lowercase().as_str() {
        _ if !press.ctrl || press.alt => None,
        "z" => Some(!press.shift),
        "y" if !press.shift => Some(false),
        _ => None,
    }
}

/// The Lab has one undo for all its fields.
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

/// The job has one undo for the screens of the board; in a field its text has one.
fn undo_of_job(press: &Press, key: &str) -> Option<CamKey> {
    back(press, key).filter(|_| !press.focus.is_text()).map(|back| CamKey::Undo { back })
}

/// What keys ask of the job where it is made.
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

/// The drawing has keys for everything; in a field its text has its own, on a button Enter presses it.
fn in_drawing(press: &Press, key: &str) -> Option<DrawKey> {
    let on_button = press.focus.is_control() && (key == "Enter" || key.starts_with("Arrow"));
    // On many keyboards Shift makes an @ of the 2 that shows what is chosen.
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
    fn every_key_where_it_means_something() {
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
    fn a_button_keeps_only_the_keys_that_press_it() {
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
    fn edits_are_taken_back_where_there_are_some() {
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
    fn a_dialog_has_the_keys_to_itself_but_for_what_stops_closes_and_explains() {
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
    fn a_menu_and_a_slider_keep_their_own_keys() {
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

    /// The press of a shortcut, as a browser tells it.
    fn pressed(shortcut: &Shortcut) -> Press {
        let mut press = press(&shortcut.keys.replace("++", "+Plus"));
        if press.key == "Plus" {
            "+".clone_into(&mut press.key);
        }
        if (press.shift || press.alt) && press.key.parse::<u8>().is_ok() {
            press.code = format!("Digit{}", press.key);
        }
        // As most keyboards have it.
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
    fn what_the_help_says_of_a_key_is_what_the_key_does() {
        for shortcut in SHORTCUTS {
            let press = pressed(shortcut);
            let tabs = shortcut.tab.map_or_else(|| Tab::ALL.to_vec(), |tab| vec![tab]);
            for tab in tabs {
                assert_eq!(action(&press, tab, true), Some(shortcut.action), "{} on {tab:?}", shortcut.keys);
            }
        }
    }

    #[test]
    fn keys_that_type_something_can_be_turned_off_and_the_others_stay() {
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

    /// The keys that were promised, screen by screen; each does something there. Armed jog and the tables of the Lab have their own,
    /// beside them.
    #[test]
    fn every_key_that_was_promised_is_there() {
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
    fn addresses_find_their_screen() {
        for tab in Tab::ALL {
            assert_eq!(Tab::of_address(&format!("#/{}", tab.word())), Some(tab));
        }
        assert_eq!(Tab::of_address("#/machine?view=operator"), Some(Tab::Machine));
        assert_eq!(Tab::of_address("#t=abc"), None);
    }
}
