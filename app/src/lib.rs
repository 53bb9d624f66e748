//! The page of Annulus. One wasm serves twice: in a window it is the page, in a worker it is the engine that reads
//! and plans, so that the page never waits.
//!
//! ```text
//! screens ─ widgets ─▶ view     the picture, knows no boards
//!    │                  ▲
//!    │               picture   a board and its plan as a scene
//!    └─▶ engine ═ worker ═▶ annulus-core
//! ```

pub mod engine;
pub mod picture;
pub mod view;

#[cfg(target_arch = "wasm32")]
pub mod screens;
#[cfg(target_arch = "wasm32")]
pub mod trusted;

/// Where the browser begins: the page in a window, the engine in a worker.
#[cfg(all(target_arch = "wasm32", not(test)))]
#[wasm_bindgen::prelude::wasm_bindgen(start)]
pub fn start() {
    if web_sys::window().is_some() {
        console_error_panic_hook::set_once();
        leptos::mount::mount_to_body(screens::App);
    } else {
        engine::worker::serve();
    }
}
