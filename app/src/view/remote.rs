//! The canvas's device, in a separate WebAssembly file that is loaded for the first picture.

use super::numbers::Painted;
use std::ops::Deref;
use wasm_bindgen::prelude::*;
use web_sys::HtmlCanvasElement;

#[wasm_bindgen]
extern "C" {
    /// Fails if there is no such device, or if the other WebAssembly can't be loaded.
    #[wasm_bindgen(catch, js_name = annulusPainter)]
    async fn opened(canvas: &HtmlCanvasElement, kind: &str, when_lost: &JsValue) -> Result<JsValue, JsValue>;

    /// A device of the other WebAssembly, with the methods of [`device::Device`](super::device::Device).
    pub(super) type Handle;
    #[wasm_bindgen(method)]
    fn free(this: &Handle);
    #[wasm_bindgen(method)]
    pub(super) fn is_webgpu(this: &Handle) -> bool;
    #[wasm_bindgen(method)]
    pub(super) fn hardware(this: &Handle) -> bool;
    #[wasm_bindgen(method)]
    pub(super) fn most_px(this: &Handle) -> u32;
    #[wasm_bindgen(method)]
    pub(super) fn resize(this: &Handle, width: u32, height: u32);
    #[wasm_bindgen(method)]
    pub(super) fn set_marks(this: &Handle, marks: &[u8]);
    #[wasm_bindgen(method)]
    pub(super) fn set_over(this: &Handle, marks: &[u8]);
    #[wasm_bindgen(method)]
    pub(super) fn write_marks(this: &Handle, first: u32, marks: &[u8]);
    #[wasm_bindgen(method)]
    pub(super) fn set_body(this: &Handle, corners_mm: &[f32], body: u32);
    #[wasm_bindgen(method)]
    pub(super) fn add_mesh(this: &Handle, corners_mm: &[f32], triangles: &[u32], edges: &[u32]) -> u32;
    #[wasm_bindgen(method)]
    pub(super) fn set_layers(this: &Handle, rows: &[u32]);
    #[wasm_bindgen(method)]
    pub(super) fn set_depths(this: &Handle, width: u32, height: u32, under: bool);
    #[wasm_bindgen(method)]
    pub(super) fn write_depths(this: &Handle, below: bool, x: u32, y: u32, depths_um: &[u16]);
    #[wasm_bindgen(method, catch, js_name = paint_flat)]
    fn flat(this: &Handle, numbers: &[u8], ranges: &[u32], head: &[u8], edged: bool) -> Result<u8, JsValue>;
    #[wasm_bindgen(method, catch, js_name = paint_space)]
    fn space(this: &Handle, numbers: &[u8]) -> Result<u8, JsValue>;
    #[wasm_bindgen(method)]
    pub(super) fn lose(this: &Handle);
}

/// A device, freed on drop.
pub(super) struct Device(Handle);

impl Device {
    /// See [`device::Device::open`](super::device::Device::open).
    pub(super) async fn open(
        canvas: &HtmlCanvasElement,
        kind: &str,
        when_lost: fn(),
    ) -> Result<Self, String> {
        let when_lost = Closure::<dyn Fn()>::new(when_lost).into_js_value();
        let handle = opened(canvas, kind, &when_lost).await.map_err(|error| format!("{error:?}"))?;
        Ok(Self(handle.unchecked_into()))
    }

    /// See [`device::Device::paint_flat`](super::device::Device::paint_flat).
    pub(super) fn paint_flat(&self, numbers: &[u8], ranges: &[u32], head: &[u8], edged: bool) -> Painted {
        painted(self.flat(numbers, ranges, head, edged))
    }

    /// See [`device::Device::paint_space`](super::device::Device::paint_space).
    pub(super) fn paint_space(&self, numbers: &[u8]) -> Painted {
        painted(self.space(numbers))
    }
}

/// A device that failed while painting is unusable: the page creates a new one.
fn painted(code: Result<u8, JsValue>) -> Painted {
    code.map_or_else(
        |error| {
            web_sys::console::error_1(&error);
            Painted::Lost
        },
        Painted::of_code,
    )
}

impl Deref for Device {
    type Target = Handle;

    fn deref(&self) -> &Handle {
        &self.0
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.0.free();
    }
}
