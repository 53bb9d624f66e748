//! Entry point of the engine, in a worker. A separate WebAssembly file without screens and pictures.

fn main() {
    #[cfg(target_arch = "wasm32")]
    annulus_app::begin_engine();
}
