//! Motion: the table of dynamics step by step, the profiles beside each other, table and spindles in time.
//!
//! Comes in: the machine and what was typed. Goes out: plots and tables; the dynamics can be applied.

mod cycle;
mod dynamics;
mod profiles;
mod steps;
mod table;

use crate::i18n::{say, t};
use crate::lab::panel::PanelPart;
use crate::model::LabEvent;
use crate::page::{open_lab, send};
use crate::widgets::choice;
use leptos::html::div;
use leptos::prelude::*;

fn name_of(part: PanelPart) -> String {
    match part {
        PanelPart::Dynamics => say!("page.lab.motion.dynamics"),
        PanelPart::Profiles => say!("page.lab.motion.profiles"),
        PanelPart::Cycle => say!("page.lab.motion.cycle"),
    }
}

/// The sheet.
pub(super) fn motion() -> impl IntoView {
    let part = open_lab().part;
    let choices = PanelPart::ALL.map(|this| {
        choice(
            move || part.get() == this,
            move || name_of(this),
            move |_| send(LabEvent::Part { part: this }),
        )
        .into_any()
    });
    div().class("lab-sheet").child((
        div().class("lab-tools").child(
            div()
                .class("segmented")
                .attr("role", "group")
                .attr("aria-label", t!("page.lab.motion.parts"))
                .child(Vec::from(choices)),
        ),
        move || match part.get() {
            PanelPart::Dynamics => dynamics::dynamics().into_any(),
            PanelPart::Profiles => profiles::profiles().into_any(),
            PanelPart::Cycle => cycle::cycle().into_any(),
        },
    ))
}
