//! The picture: discs, lines and a plate, drawn by the GPU.
//!
//! ```text
//! Scene ─ marks, numbers ─▶ gpu ══ bytes ══▶ device ─▶ canvas      pointer ─ gestures ─▶ Camera
//!    └────────────────────────────────────── flat ─▶ canvas                      └─ pick ─▶ index of a disc
//! ```
//!
//! The 3D view draws a [`Relief`] in tiles instead, seen from an [`Orbit`].
//!
//! Uses WebGPU if available, else WebGL2, else a 2D canvas. Paints on demand only. The GPU code (`device/`)
//! is a separate WebAssembly file, so that the page loads first.

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
mod life;
#[cfg(all(target_arch = "wasm32", not(test)))]
mod remote;
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

#[cfg(target_arch = "wasm32")]
pub use backend::{Backend, PainterChoice};
#[cfg(target_arch = "wasm32")]
pub use device::Device;
#[cfg(target_arch = "wasm32")]
pub use handle::View;
#[cfg(target_arch = "wasm32")]
pub use stage::{Frames, PointerStroke, Pressed};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Touch {
    /// Moves while up.
    Hover,
    Down,
    /// Moves while down.
    Move,
    Up,
    /// Cancelled: a second finger moves the picture, or the browser takes the pointer.
    Cancel,
}

#[cfg(all(test, target_arch = "wasm32"))]
mod browser_tests;
#[cfg(all(test, target_arch = "wasm32"))]
mod space_tests;
