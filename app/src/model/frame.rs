//! Everything around the work: screen, units, colours, language, selection, layers and toasts.

use super::{Effect, Event, Model};
use crate::engine::messages::LayerRow;
use crate::format::Unit;
use crate::keys::{AddressPart, KeyAction, OwnKeys, Shortcut, Tab};
use crate::layers::{self, LayerKind, LayerLook, LayerSide, Preset};
use crate::model::{Document, Network, Panels, Theme};
use crate::said::{Text, key};
use crate::view::{Camera, Colour};
use annulus_core::artwork::Side;
use annulus_core::locale;
use annulus_core::machine::Group;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToastAct {
    Review,
    Update,
    /// Put the settings before the last Apply back.
    UndoSettings,
    DrawnBefore,
    BoardBefore,
    /// The machine that was chosen before.
    MachineBefore,
    /// Read files again that changed on disk.
    TakeAnew,
    TakeBackBoard {
        place: u32,
    },
    TakeBackDrawing {
        place: u32,
    },
}

#[derive(Clone, Debug, PartialEq)]
pub struct Toast {
    pub number: u32,
    pub text: Text,
    pub act: Option<ToastAct>,
}

pub(super) const TOAST_MS: u32 = 8_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlay {
    Help,
    Palette,
    Array,
    /// The choice of the machine.
    Machines,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    pub tab: Tab,
    pub unit: Unit,
    pub theme: Theme,
    pub language: String,
    pub selected: Option<u32>,
    /// Show the paths in file order instead of the planned ones.
    pub show_before: bool,
    /// Show the rapids between cuts.
    pub show_travel: bool,
    /// Shortcuts of a single character are on; else only those with Ctrl or Alt and keys that type nothing.
    pub signs: bool,
    pub own_keys: OwnKeys,
    /// The character that was refused as a shortcut, and the shortcut that uses it; `None` if the page
    /// reserves it.
    pub own_key_refused: Option<(String, Option<&'static Shortcut>)>,
    pub grid: bool,
    /// The browser keeps the screen on; `None` if it was not asked to.
    pub awake: Option<bool>,
    /// Operator view: only the machine, large.
    pub operator: bool,
    /// What the settings show: a group, or a section of one.
    pub section: &'static str,
    /// A part named by the address that does not exist yet.
    pub named: Option<AddressPart>,
    pub panels: Panels,
    pub layers: Vec<LayerLook>,
    pub overlay: Option<Overlay>,
    pub flipped: bool,
    /// Position of the pointer, work coordinates in mm.
    pub cursor_mm: Option<[f64; 2]>,
    pub camera: Option<Camera>,
    /// Key of the renderer's name.
    pub backend: Option<&'static str>,
    pub asked: (u32, Option<KeyAction>),
    pub toasts: Vec<Toast>,
    /// The site has no bridge.
    pub alone: bool,
    pub network: Network,
    /// A new version of the site is ready, and the user has not dismissed it.
    pub update_ready: bool,
    /// Number of the last toast.
    toast: u32,
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
            section: Group::Machine.word(),
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

#[derive(Clone, Debug, PartialEq)]
pub enum FrameEvent {
    Show {
        tab: Tab,
    },
    Go {
        address: String,
    },
    Section {
        section: &'static str,
    },
    Units {
        /// `None` toggles.
        unit: Option<Unit>,
    },
    Colours {
        theme: Theme,
    },
    Language {
        language: String,
    },
    /// The language's table was loaded, or could not be.
    Spoken {
        language: String,
        there: bool,
    },
    Select {
        hole: Option<u32>,
    },
    /// Show the paths in file order, or as planned.
    Before {
        on: bool,
    },
    Travel {
        on: bool,
    },
    Overlay {
        overlay: Option<Overlay>,
    },
    Operator {
        on: bool,
    },
    /// Turn shortcuts of a single character on or off.
    Signs {
        on: bool,
    },
    /// The user's shortcuts from the last visit.
    OwnKeysKept {
        text: String,
    },
    OwnKey {
        shortcut: &'static Shortcut,
        sign: String,
    },
    OwnKeysForgotten,
    Grid,
    Awake {
        held: bool,
    },
    Flip {
        /// From below; `None` toggles.
        below: Option<bool>,
    },
    Panel {
        right: bool,
        /// CSS pixels; 0 for the default width.
        px: u16,
    },
    PanelsKept {
        text: String,
    },
    LayerEye {
        index: usize,
    },
    LayerFront {
        index: usize,
    },
    /// Toggle a layer's lock: a locked layer can't be selected or changed.
    LayerLock {
        index: usize,
    },
    LayerOpacity {
        index: usize,
        /// From 0 to 100.
        percent: u8,
    },
    LayerColour {
        index: usize,
        /// `None` for its default colour.
        colour: Option<Colour>,
    },
    LayerPreset {
        preset: Preset,
    },
    Cursor {
        /// Work coordinates in mm.
        at_mm: Option<[f64; 2]>,
    },
    Moved {
        camera: Camera,
    },
    Look {
        action: KeyAction,
    },
    Backend {
        word: &'static str,
    },
    Alone,
    Online {
        on: bool,
    },
    /// The site is cached: the page opens offline.
    SiteKept,
    UpdateReady,
    Say {
        text: Text,
    },
    Tell {
        text: Text,
    },
    /// A toast timed out or was closed.
    Said {
        number: u32,
    },
    /// The user accepts a toast's action.
    Taken {
        number: u32,
    },
}

pub(super) fn toast(model: &mut Model, text: Text, act: Option<ToastAct>) -> Effect {
    let number = put(&mut model.frame, text, act);
    let event = Event::Frame(FrameEvent::Said { number });
    Effect::Wake { after_ms: TOAST_MS, event: Box::new(event) }
}

pub(super) fn say(model: &mut Model, text: Text) {
    put(&mut model.frame, text, None);
}

pub(super) fn offer(model: &mut Model, text: Text, act: ToastAct) {
    put(&mut model.frame, text, Some(act));
}

/// Adds a toast; replaces an identical one.
fn put(frame: &mut Frame, text: Text, act: Option<ToastAct>) -> u32 {
    frame.toast += 1;
    let number = frame.toast;
    frame.toasts.retain(|toast| (&toast.text, &toast.act) != (&text, &act));
    frame.toasts.push(Toast { number, text, act });
    number
}

pub(super) fn withdraw(frame: &mut Frame, text: &Text) {
    frame.toasts.retain(|toast| toast.text != *text);
}

/// True if the Board screen is open and nothing moves.
pub(super) fn looks_at_board(model: &Model) -> bool {
    model.frame.tab == Tab::Board && !model.link.busy()
}

/// Removes the review toast when the user leaves the board. Offers a new version of the site only while
/// nothing moves. Keeps the screen on from the preflight to the end of the job.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
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
    Vec::from_iter(changed.then_some(Effect::StayAwake { on }))
}

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
        // Handled in `model::update`, because they concern other parts of the model.
        FrameEvent::Taken { .. } | FrameEvent::Go { .. } => {}
        of_layers => change_layers(frame, &of_layers),
    }
    Vec::new()
}

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

/// Changes a shortcut, or reports which one already uses the character.
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

pub(super) fn taken(frame: &mut Frame, number: u32) -> Option<ToastAct> {
    let found = frame.toasts.iter().position(|toast| toast.number == number)?;
    frame.toasts.remove(found).act
}

fn look(frame: &mut Frame, index: usize, act: impl FnOnce(&mut LayerLook)) {
    if let Some(look) = frame.layers.get_mut(index) {
        act(look);
    }
}

/// The rows of the layers panel for `document`; layers that exist in `before` keep the user's choices.
pub(super) fn layers_of(document: Option<&Document>, before: &[LayerLook]) -> Vec<LayerLook> {
    let Some(document) = document else { return Vec::new() };
    let reading = &document.reading;
    let row = |(index, layer): (usize, &LayerRow)| {
        let (role, side) = (layer.role, layer.side);
        let name = format!("{} {} {index}", role.name(), side.map_or("", Side::name));
        LayerLook::new(name, LayerKind::of(role, side), LayerSide::of(side), Some(index))
    };
    let mut looks: Vec<LayerLook> = reading.layers.iter().enumerate().map(row).collect();
    looks.reverse();
    if !reading.board.outline.is_empty() {
        looks.push(LayerLook::new("outline".to_owned(), LayerKind::Outline, LayerSide::Both, None));
    }
    looks.push(LayerLook::new("holes".to_owned(), LayerKind::Holes, LayerSide::Both, None));
    layers::kept(looks, before)
}
