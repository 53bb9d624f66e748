//! The Board screen: the holes by tool beside the picture, and how they are put in order.
//!
//! Comes in: the open board and its plan. Goes out: choices of order, accepted errors, the hole chosen.

mod anew;
mod holes;
mod inspector;
mod rows;

pub(crate) use inspector::{inspector, show_problems};

use super::{layers, welcome};
use leptos::html::div;
use leptos::prelude::*;

/// The panels beside the picture.
pub(crate) fn board() -> impl IntoView {
    (
        div().class("panel left holes").child((anew::block(), layers::panel(), holes::holes())),
        div().class("panel right inspector").child((inspector(), welcome::others())),
    )
}
