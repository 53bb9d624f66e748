//! The page of Annulus, its GPU renderer, and the engine that reads and plans in workers so that the page
//! never blocks. Each is a separate WebAssembly file (`bin/`), so that the window shows something before the
//! others are loaded.
//!
//! ```text
//! screens ─ Event ─▶ page ─▶ model ─▶ Effect ─▶ effects ═ worker, store, files ═▶ annulus-core
//!    ▲                │ ▲                         │
//!    └──── signals ───┘ └──────── Event ──────────┘        screens ─▶ view    only pictures, no boards
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

/// Starts the page in a window. The message for a crash of this program is in `www/index.html`, because no
/// code here runs then.
#[cfg(target_arch = "wasm32")]
pub fn begin_page() {
    console_error_panic_hook::set_once();
    leptos::mount::mount_to_body(|| {
        page::begin(effects::surroundings());
        effects::begin();
        screens::app()
    });
}

/// Starts the engine in a worker: the drill's engine if the worker has its name, else one that reads and
/// plans.
#[cfg(target_arch = "wasm32")]
pub fn begin_engine() {
    if engine::drill::is_here() {
        engine::drill::serve();
    } else {
        engine::worker::serve();
    }
}

// Core's test of equal steps on every platform; it shares the build of the page here.
#[cfg(all(test, target_arch = "wasm32"))]
#[path = "../../core/tests/programs/mod.rs"]
#[allow(dead_code)]
mod programs;
#[cfg(all(test, target_arch = "wasm32"))]
#[path = "../../core/tests/same_everywhere.rs"]
mod same_everywhere;
