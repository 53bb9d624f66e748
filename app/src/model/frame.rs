//! What frames the work: the screen, units, colours, language; what is chosen and how it is looked at; short words in the corner.
//!
//! Comes in: choices of the person, what the picture tells. Goes out: state; a short word goes away by itself. Knows no board.

use super::{Effect, Event, Model};
use crate::engine::messages::LayerRow;
use crate::format::Unit;
use crate::keys::{AddressPart, KeyAction, OwnKeys, Shortcut, Tab};
use crate::layers::{self, LayerKind, LayerLook, LayerSide, Preset};
use crate::model::{Document, Network, Panels, Theme};
use crate::said::{Text, key};
use crate::view::{Camera, Colour};
use annulus_core::locale;
use annulus_core::machine::SECTIONS;

/// What a short word offers to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToastAct {
    /// Show the import review.
    Review,
    /// Take over the new version of the site.
    Update,
    /// Go back to the drawing that was under work before.
    DrawnBefore,
    /// Go back to the board that was open before.
    BoardBefore,
    /// Take in files that changed on the disk.
    TakeAnew,
    /// Keep a board that was to be forgotten.
    TakeBackBoard {
        /// Where it is kept.
        place: u32,
    },
    /// Keep a drawing that was to be forgotten.
    TakeBackDrawing {
        /// Where it is kept.
        place: u32,
    },
}

/// A short word in the corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Toast {
    /// Tells it from others.
    pub number: u32,
    /// What it says.
    pub text: Text,
    /// What can be done about it.
    pub act: Option<ToastAct>,
}

/// So long a short word stays, in ms.
pub(super) const TOAST_MS: u32 = 8_000;

/// What lies over the screen when the person asks for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlay {
    /// Keys, first steps, words.
    Help,
    /// All that can be done.
    Palette,
    /// How what is drawn is repeated.
    Array,
}

/// Screen, units, colours; what is chosen and how it is looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The screen.
    pub tab: Tab,
    /// Unit of lengths on show.
    pub unit: Unit,
    /// Colours.
    pub theme: Theme,
    /// The language, by its word in the locale tables.
    pub language: String,
    /// The hole chosen in picture or table.
    pub selected: Option<u32>,
    /// Show the paths as in the file instead of the planned ones.
    pub show_before: bool,
    /// Show the rapids from cut to cut.
    pub show_travel: bool,
    /// Keys that type something do what they are for on the page; else only those with Ctrl or Alt, and those that type nothing.
    pub signs: bool,
    /// Those that a person moved to others.
    pub own_keys: OwnKeys,
    /// The sign that could not be had, and whose it is; none where the page keeps it.
    pub own_key_refused: Option<(String, Option<&'static Shortcut>)>,
    /// The picture has a grid.
    pub grid: bool,
    /// The browser keeps the screen lit; none where nobody asked it to.
    pub awake: Option<bool>,
    /// The machine alone, large: for whoever stands at it.
    pub operator: bool,
    /// The section of the settings on show.
    pub section: &'static str,
    /// What the address named and is not there yet.
    pub named: Option<AddressPart>,
    /// How wide the panels are.
    pub panels: Panels,
    /// How each layer is seen.
    pub layers: Vec<LayerLook>,
    /// What lies over the screen.
    pub overlay: Option<Overlay>,
    /// The board is looked at from below.
    pub flipped: bool,
    /// Where the pointer is, work coordinates in mm.
    pub cursor_mm: Option<[f64; 2]>,
    /// From where the picture is looked at, once there is one.
    pub camera: Option<Camera>,
    /// Key of the word for what draws.
    pub backend: Option<&'static str>,
    /// What was asked of the picture last, and how often anything was.
    pub asked: (u32, Option<KeyAction>),
    /// Short words on show.
    pub toasts: Vec<Toast>,
    /// The page came from a site without a bridge.
    pub alone: bool,
    /// What is known of the network.
    pub network: Network,
    /// A new version of the site is there, and the person has not waved it away.
    pub update_ready: bool,
    /// The number of the last of them.
    toast: u32,
    /// The browser was asked to keep the screen lit.
    awake_wanted: bool,
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            tab: Tab::default(),
            unit: Unit::default(),
            theme: Theme::default(),
            language: locale::FALLBACK.to_owned(),
            selected: None,
            show_before: false,
            show_travel: false,
            signs: true,
            own_keys: OwnKeys::default(),
            own_key_refused: None,
            grid: true,
            awake: None,
            operator: false,
            section: SECTIONS[0].0,
            named: None,
            overlay: None,
            panels: Panels::default(),
            layers: Vec::new(),
            flipped: false,
            cursor_mm: None,
            camera: None,
            backend: None,
            asked: (0, None),
            toasts: Vec::new(),
            alone: false,
            network: Network::default(),
            update_ready: false,
            toast: 0,
            awake_wanted: false,
        }
    }
}

/// What changes the frame.
#[derive(Clone, Debug, PartialEq)]
pub enum FrameEvent {
    /// Another screen.
    Show {
        /// Which.
        tab: Tab,
    },
    /// The person went to an address.
    Go {
        /// Which.
        address: String,
    },
    /// Another section of the settings.
    Section {
        /// Its word.
        section: &'static str,
    },
    /// Another unit.
    Units {
        /// Which; none for the other one.
        unit: Option<Unit>,
    },
    /// Other colours.
    Colours {
        /// Which.
        theme: Theme,
    },
    /// Another language is wanted.
    Language {
        /// Its word.
        language: String,
    },
    /// Its table is there, or could not be had.
    Spoken {
        /// Its word.
        language: String,
        /// It is there.
        there: bool,
    },
    /// A hole was chosen, or none.
    Select {
        /// Which.
        hole: Option<u32>,
    },
    /// Show the paths as in the file, or as planned.
    Before {
        /// As in the file.
        on: bool,
    },
    /// Show the rapids or not.
    Travel {
        /// Shown.
        on: bool,
    },
    /// Something is to lie over the screen, or nothing.
    Overlay {
        /// What.
        overlay: Option<Overlay>,
    },
    /// The machine alone, large, or everything.
    Operator {
        /// The machine alone.
        on: bool,
    },
    /// Keys that type something do what they are for on the page, or nothing.
    Signs {
        /// What they are for.
        on: bool,
    },
    /// Keys of one's own were kept from last time.
    OwnKeysKept {
        /// They, as text.
        text: String,
    },
    /// A key is moved.
    OwnKey {
        /// What it does.
        shortcut: &'static Shortcut,
        /// The letter or sign that shall do it.
        sign: String,
    },
    /// All keys are where they were.
    OwnKeysForgotten,
    /// The picture has a grid, or none: the other of the two.
    Grid,
    /// The browser keeps the screen lit, or does not.
    Awake {
        /// It does.
        held: bool,
    },
    /// Look at the board from below, or from above.
    Flip {
        /// From below; none for the other side.
        below: Option<bool>,
    },
    /// A panel of the screen on show is drawn wider or narrower.
    Panel {
        /// The right one.
        right: bool,
        /// CSS pixels; 0 for its own width.
        px: u16,
    },
    /// The widths of last time.
    PanelsKept {
        /// They, as text.
        text: String,
    },
    /// One layer is seen or not seen: the other of the two.
    LayerEye {
        /// Its line in the panel.
        index: usize,
    },
    /// One layer is in front and the others are dimmed, or all are seen alike again.
    LayerFront {
        /// Its line in the panel.
        index: usize,
    },
    /// Nothing of one layer is caught or changed, or it is: the other of the two.
    LayerLock {
        /// Its line in the panel.
        index: usize,
    },
    /// One layer is seen more or less.
    LayerOpacity {
        /// Its line in the panel.
        index: usize,
        /// From 0 to 100.
        percent: u8,
    },
    /// One layer has another colour.
    LayerColour {
        /// Its line in the panel.
        index: usize,
        /// Which; none for its own.
        colour: Option<Colour>,
    },
    /// A group of layers is seen, the others are not.
    LayerPreset {
        /// Which.
        preset: Preset,
    },
    /// The pointer is somewhere over the picture, or not over it.
    Cursor {
        /// Work coordinates in mm.
        at_mm: Option<[f64; 2]>,
    },
    /// The picture is looked at from somewhere else.
    Moved {
        /// From where.
        camera: Camera,
    },
    /// The picture is to be fitted, nearer or further.
    Look {
        /// Which of these.
        action: KeyAction,
    },
    /// It is known what draws.
    Backend {
        /// Key of its word.
        word: &'static str,
    },
    /// The page came from a site without a bridge.
    Alone,
    /// The browser has a network, or none.
    Online {
        /// It has.
        on: bool,
    },
    /// The site is kept: the page opens without a network.
    SiteKept,
    /// A new version of the site is kept and waits to take over.
    UpdateReady,
    /// A short word is to be said.
    Say {
        /// What.
        text: Text,
    },
    /// A short word is to be said, and stays until it is closed.
    Tell {
        /// What.
        text: Text,
    },
    /// A short word was there long enough, or was closed.
    Said {
        /// Its number.
        number: u32,
    },
    /// What a short word offers is wanted.
    Taken {
        /// Its number.
        number: u32,
    },
}

/// Says a short word.
pub(super) fn toast(model: &mut Model, text: Text, act: Option<ToastAct>) -> Effect {
    let number = put(&mut model.frame, text, act);
    let event = Event::Frame(FrameEvent::Said { number });
    Effect::Wake { after_ms: TOAST_MS, event: Box::new(event) }
}

/// A short word that stays until it is closed.
pub(super) fn say(model: &mut Model, text: Text) {
    put(&mut model.frame, text, None);
}

/// A short word with something to do, which stays until it is closed.
pub(super) fn offer(model: &mut Model, text: Text, act: ToastAct) {
    put(&mut model.frame, text, Some(act));
}

/// A short word that stays until it is closed. The same one from before goes.
fn put(frame: &mut Frame, text: Text, act: Option<ToastAct>) -> u32 {
    frame.toast += 1;
    let number = frame.toast;
    frame.toasts.retain(|toast| (&toast.text, &toast.act) != (&text, &act));
    frame.toasts.push(Toast { number, text, act });
    number
}

/// Whether the board is what is looked at, and nothing moves.
pub(super) fn looks_at_board(model: &Model) -> bool {
    model.frame.tab == Tab::Board && !model.link.busy()
}

/// What is said of a board that was opened goes away with the look at it. A new version of the site is offered while nothing moves,
/// and only then. The screen stays lit from the pre-flight to the end.
pub(super) fn follow(model: &mut Model) -> Option<Effect> {
    if !looks_at_board(model) {
        model.frame.toasts.retain(|toast| toast.act != Some(ToastAct::Review));
    }
    let offered = model.frame.toasts.iter().any(|toast| toast.act == Some(ToastAct::Update));
    let wanted = model.frame.update_ready && !model.link.busy();
    match (offered, wanted) {
        (false, true) => {
            let text = Text::of(key!("page.update.ready"));
            put(&mut model.frame, text, Some(ToastAct::Update));
        }
        (true, false) => model.frame.toasts.retain(|toast| toast.act != Some(ToastAct::Update)),
        _ => {}
    }
    let on = model.link.busy() || model.start.preflight.is_some();
    let changed = std::mem::replace(&mut model.frame.awake_wanted, on) != on;
    if changed {
        model.frame.awake = None;
    }
    changed.then_some(Effect::StayAwake { on })
}

/// Takes one event in.
pub(super) fn update(model: &mut Model, event: FrameEvent) -> Vec<Effect> {
    let frame = &mut model.frame;
    match event {
        FrameEvent::Show { tab } => {
            frame.operator &= tab == Tab::Machine;
            (frame.tab, frame.named) = (tab, None);
        }
        FrameEvent::Units { unit } => {
            let other = if frame.unit == Unit::Millimetre { Unit::Inch } else { Unit::Millimetre };
            frame.unit = unit.unwrap_or(other);
        }
        FrameEvent::Colours { theme } => {
            frame.theme = theme;
            return vec![Effect::Colours { word: theme.word() }];
        }
        FrameEvent::Language { language } => return vec![Effect::Speak { language }],
        FrameEvent::Spoken { language, there: true } => frame.language = language,
        FrameEvent::Spoken { there: false, .. } => {
            return vec![toast(model, Text::of(key!("page.language_missing")), None)];
        }
        FrameEvent::Section { section } => frame.section = section,
        FrameEvent::Select { hole } => frame.selected = hole,
        FrameEvent::Before { on } => frame.show_before = on,
        FrameEvent::Travel { on } => frame.show_travel = on,
        FrameEvent::Overlay { overlay } => frame.overlay = overlay,
        FrameEvent::Operator { on } => {
            frame.operator = on;
            if on {
                (frame.tab, frame.named) = (Tab::Machine, None);
            }
        }
        FrameEvent::Signs { on } => {
            frame.signs = on;
            return vec![Effect::KeepSigns { on }];
        }
        FrameEvent::OwnKeysKept { text } => frame.own_keys = OwnKeys::of_kept(&text),
        FrameEvent::OwnKey { shortcut, sign } => return own_key(frame, shortcut, sign),
        FrameEvent::OwnKeysForgotten => {
            (frame.own_keys, frame.own_key_refused) = (OwnKeys::default(), None);
            return vec![Effect::KeepOwnKeys { text: String::new() }];
        }
        FrameEvent::Grid => frame.grid = !frame.grid,
        FrameEvent::Awake { held } => frame.awake = frame.awake_wanted.then_some(held),
        FrameEvent::Flip { below } => frame.flipped = below.unwrap_or(!frame.flipped),
        FrameEvent::Panel { right, px } => {
            frame.panels.set(frame.tab, right, px);
            return vec![Effect::KeepPanels { text: frame.panels.kept() }];
        }
        FrameEvent::PanelsKept { text } => frame.panels = Panels::of_kept(&text),
        FrameEvent::Cursor { at_mm } => frame.cursor_mm = at_mm,
        FrameEvent::Moved { camera } => frame.camera = Some(camera),
        FrameEvent::Look { action } => frame.asked = (frame.asked.0 + 1, Some(action)),
        FrameEvent::Backend { word } => frame.backend = Some(word),
        FrameEvent::Say { text } => return vec![toast(model, text, None)],
        FrameEvent::Tell { text } => say(model, text),
        FrameEvent::Alone => frame.alone = true,
        FrameEvent::Online { on } => frame.network.offline = !on,
        FrameEvent::SiteKept => frame.network.kept = true,
        FrameEvent::UpdateReady => frame.update_ready = true,
        FrameEvent::Said { number } => {
            if taken(frame, number) == Some(ToastAct::Update) {
                frame.update_ready = false;
            }
        }
        // What a short word offers, and what an address names, is done where all of the page is known.
        FrameEvent::Taken { .. } | FrameEvent::Go { .. } => {}
        of_layers => change_layers(frame, &of_layers),
    }
    Vec::new()
}

/// One layer, or several, are seen otherwise.
fn change_layers(frame: &mut Frame, event: &FrameEvent) {
    match *event {
        FrameEvent::LayerEye { index } => look(frame, index, |look| look.eye = !look.eye),
        FrameEvent::LayerFront { index } => layers::bring_to_front(&mut frame.layers, index),
        FrameEvent::LayerLock { index } => look(frame, index, |look| look.locked = !look.locked),
        FrameEvent::LayerOpacity { index, percent } => look(frame, index, |look| look.opacity = percent),
        FrameEvent::LayerColour { index, colour } => look(frame, index, |look| look.colour = colour),
        FrameEvent::LayerPreset { preset } => {
            frame.layers.iter_mut().for_each(|look| look.choose(preset));
        }
        _ => {}
    }
}

/// A key is moved, or it stays and whose the sign is is told.
fn own_key(frame: &mut Frame, shortcut: &'static Shortcut, sign: String) -> Vec<Effect> {
    match frame.own_keys.set(shortcut, &sign) {
        Ok(()) => {
            frame.own_key_refused = None;
            vec![Effect::KeepOwnKeys { text: frame.own_keys.kept() }]
        }
        Err(by) => {
            frame.own_key_refused = Some((sign, by));
            Vec::new()
        }
    }
}

/// Takes a short word away; gives what it offered.
pub(super) fn taken(frame: &mut Frame, number: u32) -> Option<ToastAct> {
    let found = frame.toasts.iter().position(|toast| toast.number == number)?;
    frame.toasts.remove(found).act
}

fn look(frame: &mut Frame, index: usize, act: impl FnOnce(&mut LayerLook)) {
    if let Some(look) = frame.layers.get_mut(index) {
        act(look);
    }
}

/// The lines of the layers panel of what was read; what the person chose for those before stays.
pub(super) fn layers_of(document: Option<&Document>, before: &[LayerLook]) -> Vec<LayerLook> {
    let Some(document) = document else { return Vec::new() };
    let reading = &document.reading;
    let row = |(index, layer): (usize, &LayerRow)| {
        let side = layer.side.as_deref();
        let name = format!("{} {} {index}", layer.role, side.unwrap_or_default());
        LayerLook::new(name, LayerKind::of(&layer.role, side), LayerSide::of(side), Some(index))
    };
    let mut looks: Vec<LayerLook> = reading.layers.iter().enumerate().map(row).collect();
    looks.reverse();
    if !reading.board.outline.is_empty() {
        looks.push(LayerLook::new("outline".to_owned(), LayerKind::Outline, LayerSide::Both, None));
    }
    looks.push(LayerLook::new("holes".to_owned(), LayerKind::Holes, LayerSide::Both, None));
    layers::kept(looks, before)
}
