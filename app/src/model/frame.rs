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
use annulus_core::machine::SECTIONS;

/// The action that a toast offers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToastAct {
    /// Show the import review.
    Review,
    /// Activate the new version of the site.
    Update,
    /// Go back to the drawing that was open before.
    DrawnBefore,
    /// Go back to the board that was open before.
    BoardBefore,
    /// Read files again that changed on disk.
    TakeAnew,
    /// Undo the discard of a saved board.
    TakeBackBoard {
        /// Storage slot.
        place: u32,
    },
    /// Undo the discard of a saved drawing.
    TakeBackDrawing {
        /// Storage slot.
        place: u32,
    },
}

/// A notification in the corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Toast {
    pub number: u32,
    pub text: Text,
    pub act: Option<ToastAct>,
}

/// How long a toast stays, in ms.
pub(super) const TOAST_MS: u32 = 8_000;

/// Overlays that the user opens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overlay {
    /// Shortcuts, first steps, glossary.
    Help,
    /// The command palette.
    Palette,
    /// The form for repeating the selection of the drawing.
    Array,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    pub tab: Tab,
    /// Displayed unit of length.
    pub unit: Unit,
    pub theme: Theme,
    /// Code of the language in the locale tables.
    pub language: String,
    /// The hole selected in the view or the table.
    pub selected: Option<u32>,
    /// Show the paths in file order instead of the planned ones.
    pub show_before: bool,
    /// Show the rapids between cuts.
    pub show_travel: bool,
    /// Shortcuts of a single character are on; else only those with Ctrl or Alt and keys that type nothing.
    pub signs: bool,
    /// Shortcuts that the user changed.
    pub own_keys: OwnKeys,
    /// The character that was refused as a shortcut, and the shortcut that uses it; `None` if the page
    /// reserves it.
    pub own_key_refused: Option<(String, Option<&'static Shortcut>)>,
    /// The view shows a grid.
    pub grid: bool,
    /// The browser keeps the screen on; `None` if it was not asked to.
    pub awake: Option<bool>,
    /// Operator view: only the machine, large.
    pub operator: bool,
    /// The displayed section of the settings.
    pub section: &'static str,
    /// A part named by the address that does not exist yet.
    pub named: Option<AddressPart>,
    pub panels: Panels,
    /// How each layer is displayed.
    pub layers: Vec<LayerLook>,
    pub overlay: Option<Overlay>,
    /// The board is viewed from below.
    pub flipped: bool,
    /// Position of the pointer, work coordinates in mm.
    pub cursor_mm: Option<[f64; 2]>,
    /// Camera of the view, once there is one.
    pub camera: Option<Camera>,
    /// Key of the renderer's name.
    pub backend: Option<&'static str>,
    /// The last action requested of the view, and the count of requests.
    pub asked: (u32, Option<KeyAction>),
    /// Toasts on screen.
    pub toasts: Vec<Toast>,
    /// The site has no bridge.
    pub alone: bool,
    pub network: Network,
    /// A new version of the site is ready, and the user has not dismissed it.
    pub update_ready: bool,
    /// Number of the last toast.
    toast: u32,
    /// The browser was asked to keep the screen on.
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

#[derive(Clone, Debug, PartialEq)]
pub enum FrameEvent {
    Show {
        tab: Tab,
    },
    /// The user went to an address.
    Go {
        address: String,
    },
    /// Show a section of the settings.
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
    /// Switch to another language.
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
        /// In file order.
        on: bool,
    },
    Travel {
        on: bool,
    },
    Overlay {
        overlay: Option<Overlay>,
    },
    /// Enter or leave the operator view.
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
    /// Change a shortcut.
    OwnKey {
        shortcut: &'static Shortcut,
        /// The new character.
        sign: String,
    },
    /// Reset all shortcuts.
    OwnKeysForgotten,
    /// Toggle the grid.
    Grid,
    /// Whether the browser keeps the screen on.
    Awake {
        held: bool,
    },
    /// View the board from below or above.
    Flip {
        /// From below; `None` toggles.
        below: Option<bool>,
    },
    /// The user resizes a panel of the current screen.
    Panel {
        right: bool,
        /// CSS pixels; 0 for the default width.
        px: u16,
    },
    /// The panel widths from the last visit.
    PanelsKept {
        text: String,
    },
    /// Toggle a layer's visibility.
    LayerEye {
        /// Row in the layers panel.
        index: usize,
    },
    /// Bring a layer to the front and dim the others, or undo that.
    LayerFront {
        /// Row in the layers panel.
        index: usize,
    },
    /// Toggle a layer's lock: a locked layer can't be selected or changed.
    LayerLock {
        /// Row in the layers panel.
        index: usize,
    },
    /// Set a layer's opacity.
    LayerOpacity {
        /// Row in the layers panel.
        index: usize,
        /// From 0 to 100.
        percent: u8,
    },
    /// Set a layer's colour.
    LayerColour {
        /// Row in the layers panel.
        index: usize,
        /// `None` for its default colour.
        colour: Option<Colour>,
    },
    /// Show a group of layers and hide the others.
    LayerPreset {
        preset: Preset,
    },
    /// The pointer moved over the view, or left it.
    Cursor {
        /// Work coordinates in mm.
        at_mm: Option<[f64; 2]>,
    },
    /// The camera moved.
    Moved {
        camera: Camera,
    },
    /// Fit or zoom the view.
    Look {
        action: KeyAction,
    },
    /// The renderer is known.
    Backend {
        /// Key of its name.
        word: &'static str,
    },
    /// The site has no bridge.
    Alone,
    /// The browser went online or offline.
    Online {
        on: bool,
    },
    /// The site is cached: the page opens offline.
    SiteKept,
    /// A new version of the site is cached and can be activated.
    UpdateReady,
    /// Show a toast for a while.
    Say {
        text: Text,
    },
    /// Show a toast until it is closed.
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

/// Shows a toast for [`TOAST_MS`].
pub(super) fn toast(model: &mut Model, text: Text, act: Option<ToastAct>) -> Effect {
    let number = put(&mut model.frame, text, act);
    let event = Event::Frame(FrameEvent::Said { number });
    Effect::Wake { after_ms: TOAST_MS, event: Box::new(event) }
}

/// Shows a toast until it is closed.
pub(super) fn say(model: &mut Model, text: Text) {
    put(&mut model.frame, text, None);
}

/// Shows a toast with an action until it is closed.
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

/// Removes the toast with this text.
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

/// Changes how layers are displayed.
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

/// Removes a toast and returns its action.
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
