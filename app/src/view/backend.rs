//! Chooses the renderer of a canvas: WebGPU if there is one, else WebGL2, else the 2D canvas.

use super::flat::Flat;
use super::gpu::Gpu;
use wasm_bindgen::JsCast;
use web_sys::{HtmlCanvasElement, HtmlElement};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PainterChoice {
    #[default]
    Auto,
    /// WebGPU, else 2D.
    WebGpu,
    /// WebGL2, else 2D.
    WebGl2,
    /// The 2D canvas.
    Flat,
}

impl PainterChoice {
    /// Parses the word of the URL: `webgpu`, `webgl2`, `2d`; anything else is [`Self::Auto`].
    pub fn from_word(word: &str) -> Self {
        match word {
            "webgpu" => Self::WebGpu,
            "webgl2" => Self::WebGl2,
            "2d" => Self::Flat,
            _ => Self::Auto,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    WebGpu,
    WebGl2,
    Flat,
}

impl Backend {
    pub const fn name(self) -> &'static str {
        match self {
            Self::WebGpu => "WebGPU",
            Self::WebGl2 => "WebGL2",
            Self::Flat => "2D",
        }
    }

    /// The next worse choice, for when this one was lost too often.
    pub(super) const fn below(self) -> PainterChoice {
        match self {
            Self::WebGpu => PainterChoice::WebGl2,
            Self::WebGl2 | Self::Flat => PainterChoice::Flat,
        }
    }
}

pub(super) enum Painter {
    Gpu(Box<Gpu>),
    Flat(Flat),
    /// A new renderer is being created.
    None,
}

async fn make_painter(
    canvas: &HtmlCanvasElement,
    wanted: PainterChoice,
    when_lost: fn(),
) -> Result<Painter, String> {
    let kind = match wanted {
        PainterChoice::Flat => return Flat::new(canvas).map(Painter::Flat),
        PainterChoice::WebGl2 => "webgl2",
        PainterChoice::WebGpu => "webgpu",
        PainterChoice::Auto => "best",
    };
    Gpu::new(canvas, kind, when_lost).await.map(|gpu| Painter::Gpu(Box::new(gpu)))
}

/// Creates a renderer of the wanted kind, or the next worse that works. Each attempt needs a new canvas,
/// because a canvas supports only the first kind of context requested. `when_lost` is called when the device
/// is lost.
pub(super) async fn set_up(
    host: &HtmlElement,
    wanted: PainterChoice,
    when_lost: fn(),
) -> Result<(HtmlCanvasElement, Painter), String> {
    let ladder: &[PainterChoice] = match wanted {
        PainterChoice::Auto => &[PainterChoice::Auto, PainterChoice::WebGl2, PainterChoice::Flat],
        PainterChoice::WebGpu => &[PainterChoice::WebGpu, PainterChoice::Flat],
        PainterChoice::WebGl2 => &[PainterChoice::WebGl2, PainterChoice::Flat],
        PainterChoice::Flat => &[PainterChoice::Flat],
    };
    let mut why = String::new();
    for rung in ladder {
        let canvas = new_canvas(host).ok_or("the page has no document")?;
        match make_painter(&canvas, *rung, when_lost).await {
            Ok(painter) => return Ok((canvas, painter)),
            Err(reason) => why = reason,
        }
        canvas.remove();
    }
    Err(why)
}

fn new_canvas(host: &HtmlElement) -> Option<HtmlCanvasElement> {
    let canvas: HtmlCanvasElement = host.owner_document()?.create_element("canvas").ok()?.dyn_into().ok()?;
    let style = canvas.style();
    for (name, value) in
        [("display", "block"), ("width", "100%"), ("height", "100%"), ("touch-action", "none")]
    {
        let _ = style.set_property(name, value);
    }
    // Focusable, with its own arrow keys, so screen readers must pass keys through.
    let _ = canvas.set_attribute("role", "application");
    let _ = canvas.set_attribute("tabindex", "0");
    host.append_child(&canvas).ok()?;
    Some(canvas)
}

impl Painter {
    pub(super) fn backend(&self) -> Backend {
        match self {
            Self::Gpu(gpu) if gpu.is_webgpu() => Backend::WebGpu,
            Self::Gpu(_) => Backend::WebGl2,
            Self::Flat(_) | Self::None => Backend::Flat,
        }
    }
}
