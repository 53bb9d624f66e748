//! The CAM screen: what is made of the board, in which order, with what.
//!
//! Comes in: the open board and its plan. Goes out: choices of the person.

use crate::screens::board;
use leptos::html::div;
use leptos::prelude::*;

/// The panels beside the picture.
pub(crate) fn cam() -> impl IntoView {
    div().class("panel left inspector").child(board::inspector())
}
