//! Entry point of the GPU renderer, in a window. A separate WebAssembly file, loaded after the page.

fn main() {}

#[cfg(target_arch = "wasm32")]
#[expect(unreachable_pub, reason = "what is exported is called from JavaScript")]
mod exported {
    use annulus_app::view;
    use wasm_bindgen::prelude::*;
    use web_sys::HtmlCanvasElement;
    use web_sys::js_sys::Function;

    /// Opens a device on a canvas with `webgpu`, `webgl2` or the `best` of both; fails with the reason.
    #[wasm_bindgen]
    pub async fn open(
        canvas: HtmlCanvasElement,
        kind: String,
        when_lost: Function,
    ) -> Result<OpenDevice, JsError> {
        console_error_panic_hook::set_once();
        let told = move || drop(when_lost.call0(&JsValue::NULL));
        let opened = view::Device::open(&canvas, &kind, told).await;
        opened.map(OpenDevice).map_err(|reason| JsError::new(&reason))
    }

    /// [`view::Device`], callable from the page's WebAssembly.
    #[wasm_bindgen]
    pub struct OpenDevice(view::Device);

    #[wasm_bindgen]
    impl OpenDevice {
        pub fn is_webgpu(&self) -> bool {
            self.0.is_webgpu()
        }

        pub fn hardware(&self) -> bool {
            self.0.hardware()
        }

        pub fn most_px(&self) -> u32 {
            self.0.most_px()
        }

        pub fn resize(&mut self, width: u32, height: u32) {
            self.0.resize(width, height);
        }

        pub fn set_marks(&mut self, marks: &[u8]) {
            self.0.set_marks(marks);
        }

        pub fn set_over(&mut self, marks: &[u8]) {
            self.0.set_over(marks);
        }

        pub fn write_marks(&self, first: u32, marks: &[u8]) {
            self.0.write_marks(first, marks);
        }

        pub fn set_body(&mut self, corners_mm: &[f32], body: u32) {
            self.0.set_body(corners_mm, body);
        }

        pub fn add_mesh(&mut self, corners_mm: &[f32], triangles: &[u32], edges: &[u32]) -> u32 {
            self.0.add_mesh(corners_mm, triangles, edges)
        }

        pub fn set_layers(&mut self, rows: &[u32]) {
            self.0.set_layers(rows);
        }

        pub fn set_depths(&mut self, width: u32, height: u32, under: bool) {
            self.0.set_depths(width, height, under);
        }

        pub fn write_depths(&self, below: bool, x: u32, y: u32, depths_um: &[u16]) {
            self.0.write_depths(below, x, y, depths_um);
        }

        pub fn paint_flat(&mut self, numbers: &[u8], ranges: &[u32], head: &[u8], edged: bool) -> u8 {
            self.0.paint_flat(numbers, ranges, head, edged).code()
        }

        pub fn paint_space(&mut self, numbers: &[u8]) -> u8 {
            self.0.paint_space(numbers).code()
        }

        pub fn lose(&self) {
            self.0.lose();
        }
    }
}
