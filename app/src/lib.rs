//! The page of Annulus. One wasm serves twice: in a window it is the page, in a worker it is the engine that reads
//! and plans, so that the page never waits.
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
pub mod toolpaths;
pub mod view;
pub mod workbench;

#[cfg(target_arch = "wasm32")]
pub mod browser;
#[cfg(target_arch = "wasm32")]
pub mod effects;
#[cfg(target_arch = "wasm32")]
pub mod fallen;
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

/// Where the browser begins: the page in a window, the engine in a worker.
#[cfg(all(target_arch = "wasm32", not(test)))]
#[wasm_bindgen::prelude::wasm_bindgen(start)]
pub fn start() {
    if web_sys::window().is_some() {
        fallen::watch();
        leptos::mount::mount_to_body(|| {
            page::begin(effects::surroundings());
            effects::begin();
            screens::app()
        });
    } else if engine::drill::is_here() {
        engine::drill::serve();
    } else {
        engine::worker::serve();
    }
}
