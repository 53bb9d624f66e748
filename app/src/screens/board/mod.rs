//! The Board screen: a summary, holes by tool next to the picture, and their order.

mod anew;
mod holes;
mod inspector;
mod rows;
mod summary;

pub(crate) use inspector::{PROBLEMS, inspector, show_problems};

use super::{layers, welcome};
use leptos::html::div;
use leptos::prelude::*;

pub(crate) fn board() -> impl IntoView {
    (
        div().class("panel left holes").child((anew::block(), layers::panel(), holes::holes())),
        div().class("panel right inspector").child((summary::summary(), inspector(), welcome::others())),
    )
}
