//! Entry point of the page, in a window. A separate WebAssembly file without what only the engine needs.

fn main() {
    #[cfg(target_arch = "wasm32")]
    annulus_app::begin_page();
}
