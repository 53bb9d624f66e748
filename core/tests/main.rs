//! All tests of `core` through its public interface, in one program so that linking happens once. In a
//! browser only the tests run that promise the same results on every platform.

#[cfg(not(target_arch = "wasm32"))]
mod automaton;
#[cfg(not(target_arch = "wasm32"))]
mod carve;
#[cfg(not(target_arch = "wasm32"))]
mod carving;
#[cfg(not(target_arch = "wasm32"))]
mod controller;
#[cfg(not(target_arch = "wasm32"))]
mod feed_override;
#[cfg(not(target_arch = "wasm32"))]
mod foot;
#[cfg(not(target_arch = "wasm32"))]
mod magazine;
#[cfg(not(target_arch = "wasm32"))]
mod motion;
#[cfg(not(target_arch = "wasm32"))]
mod operator;
#[cfg(not(target_arch = "wasm32"))]
mod parameters;
#[cfg(not(target_arch = "wasm32"))]
mod phases;
#[cfg(not(target_arch = "wasm32"))]
mod planning;
#[cfg(not(target_arch = "wasm32"))]
mod post;
#[cfg_attr(target_arch = "wasm32", allow(dead_code))]
mod programs;
#[cfg(not(target_arch = "wasm32"))]
mod queue;
#[cfg(not(target_arch = "wasm32"))]
mod reference;
mod same_everywhere;
#[cfg(not(target_arch = "wasm32"))]
mod servo;
#[cfg(not(target_arch = "wasm32"))]
mod settings;
#[cfg(not(target_arch = "wasm32"))]
mod sweep;
#[cfg(not(target_arch = "wasm32"))]
mod virtual_drill;
