//! Where the engine begins, in a worker. A WebAssembly of its own: no screen and no picture is in it.

fn main() {
    #[cfg(target_arch = "wasm32")]
    annulus_app::begin_engine();
}
