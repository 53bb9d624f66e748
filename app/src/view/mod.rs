//! The picture: discs, lines and a plate, drawn by the GPU as sharp as the screen allows.
//!
//! ```text
//! Scene ─ marks, numbers ─▶ gpu ══ bytes ══▶ device ─▶ canvas      pointer ─ gestures ─▶ Camera
//!    └────────────────────────────────────── flat ─▶ canvas                      └─ pick ─▶ index of a disc
//! ```
//!
//! A board that is carved is drawn in space instead: a [`Relief`] by its tiles, seen from an [`Orbit`].
//!
//! Comes in: a [`Scene`] in millimetres of the board, a [`Palette`], what is done. Goes out: pixels, and which disc lies
//! under the pointer. Knows no boards, no screens and no leptos.
//!
//! WebGPU is taken where there is one, else WebGL2, else a plain 2D canvas. Frames are painted on demand. What knows the GPU
//! (`device/`) is a WebAssembly of its own, so that the page is there before it.

mod camera;
#[cfg(any(target_arch = "wasm32", test))]
mod marks;
#[cfg(any(target_arch = "wasm32", test))]
mod numbers;
mod orbit;
mod palette;
mod pick;
mod relief;
mod scene;
#[cfg(any(target_arch = "wasm32", test))]
mod thinned;
mod touch;

#[cfg(target_arch = "wasm32")]
mod backend;
#[cfg(target_arch = "wasm32")]
mod device;
#[cfg(target_arch = "wasm32")]
mod flat;
#[cfg(target_arch = "wasm32")]
mod gestures;
#[cfg(target_arch = "wasm32")]
mod gpu;
#[cfg(target_arch = "wasm32")]
mod handle;
#[cfg(target_arch = "wasm32")]
mod held;
#[cfg(target_arch = "wasm32")]
mod life;
#[cfg(all(target_arch = "wasm32", not(test)))]
mod remote;
#[cfg(target_arch = "wasm32")]
mod solid;
#[cfg(target_arch = "wasm32")]
mod space;
#[cfg(target_arch = "wasm32")]
mod stage;

pub use camera::Camera;
#[cfg(any(target_arch = "wasm32", test))]
pub use numbers::Painted;
pub use orbit::Orbit;
pub use palette::{Colour, Palette};
pub use pick::Picker;
pub use relief::{Cutting, PATCH, Patch, Relief, ReliefField};
pub use scene::{
    Disc, FilledLayer, HoleState, Line, Mesh, OrderProgress, Plate, Scene, SceneSlot, UNORDERED, Width,
};
pub use touch::Touch;

#[cfg(target_arch = "wasm32")]
pub use backend::{Backend, PainterChoice};
#[cfg(target_arch = "wasm32")]
pub use device::Device;
#[cfg(target_arch = "wasm32")]
pub use handle::View;
#[cfg(target_arch = "wasm32")]
pub use held::{PointerStroke, Pressed};
#[cfg(target_arch = "wasm32")]
pub use stage::Frames;

#[cfg(all(test, target_arch = "wasm32"))]
mod browser_tests;
#[cfg(all(test, target_arch = "wasm32"))]
mod space_tests;
