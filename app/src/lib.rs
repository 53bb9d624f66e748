//! The page of Annulus, what draws in it on the GPU, and the engine that reads and plans in its workers, so that the page never
//! waits. Each is a file of WebAssembly of its own (`bin/`): the window shows something before the others are there.
//!
//! ```text
//! screens ─ Event ─▶ page ─▶ model ─▶ Effect ─▶ effects ═ worker, store, files ═▶ annulus-core
//!    ▲                │ ▲                         │
//!    └──── signals ───┘ └──────── Event ──────────┘        screens ─▶ view    the picture, knows no boards
//! ```

pub mod drawing;
pub mod engine;
pub mod format;
pub mod health;
pub mod keys;
pub mod lab;
pub mod layers;
pub mod model;
pub mod parts;
pub mod picture;
pub mod readout;
pub mod said;
pub mod spindles;
pub mod toolpaths;
pub mod view;
pub mod workbench;

#[cfg(target_arch = "wasm32")]
pub mod browser;
#[cfg(target_arch = "wasm32")]
pub mod effects;
#[cfg(target_arch = "wasm32")]
pub mod i18n;
#[cfg(target_arch = "wasm32")]
pub mod page;
#[cfg(target_arch = "wasm32")]
pub mod screens;
#[cfg(target_arch = "wasm32")]
pub mod trusted;
#[cfg(target_arch = "wasm32")]
pub mod widgets;

/// The page begins, in a window. What is said where its program breaks is in `www/index.html`, since nothing here answers then.
#[cfg(target_arch = "wasm32")]
pub fn begin_page() {
    console_error_panic_hook::set_once();
    leptos::mount::mount_to_body(|| {
        page::begin(effects::surroundings());
        effects::begin();
        screens::app()
    });
}

/// The engine begins, in a worker: that of the drill by its name, or one that reads and plans.
#[cfg(target_arch = "wasm32")]
pub fn begin_engine() {
    if engine::drill::is_here() {
        engine::drill::serve();
    } else {
        engine::worker::serve();
    }
}
