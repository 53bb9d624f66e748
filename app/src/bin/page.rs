//! Where the page begins, in a window. A WebAssembly of its own: what the engine alone needs is not in it.

fn main() {
    #[cfg(target_arch = "wasm32")]
    annulus_app::begin_page();
}
