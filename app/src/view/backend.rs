//! Which painter a canvas gets: WebGPU where there is one, else WebGL2, else none of the GPU.
//!
//! Comes in: the host element, a wish. Goes out: a canvas in it and its painter. Does not know what is painted.

use super::flat::Flat;
use super::gpu::Gpu;
use wasm_bindgen::JsCast;
use web_sys::{HtmlCanvasElement, HtmlElement};

/// Which painter to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PainterChoice {
    /// The best there is.
    #[default]
    Auto,
    /// WebGPU or nothing better than 2D.
    WebGpu,
    /// WebGL2 or nothing better than 2D.
    WebGl2,
    /// The 2D canvas.
    Flat,
}

impl PainterChoice {
    /// From a word in the page's address: `webgpu`, `webgl2`, `2d`.
    pub fn from_word(word: &str) -> Self {
        match word {
            "webgpu" => Self::WebGpu,
            "webgl2" => Self::WebGl2,
            "2d" => Self::Flat,
            _ => Self::Auto,
        }
    }
}

/// Which painter is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backend {
    /// The GPU by WebGPU.
    WebGpu,
    /// The GPU by WebGL2.
    WebGl2,
    /// No GPU.
    Flat,
}

impl Backend {
    /// Its name for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::WebGpu => "WebGPU",
            Self::WebGl2 => "WebGL2",
            Self::Flat => "2D",
        }
    }

    /// What is tried where this one is lost again and again.
    pub(super) const fn below(self) -> PainterChoice {
        match self {
            Self::WebGpu => PainterChoice::WebGl2,
            Self::WebGl2 | Self::Flat => PainterChoice::Flat,
        }
    }
}

/// What paints.
pub(super) enum Painter {
    /// On the GPU.
    Gpu(Box<Gpu>),
    /// On the processor.
    Flat(Flat),
    /// A new one is being made.
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

/// A painter of the wanted kind, or the next worse that works, each on a canvas of its own: a canvas that was asked for
/// one kind gives no other. `when_lost` is called when its device goes.
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
    // It is reached by the keyboard and has arrows of its own.
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
