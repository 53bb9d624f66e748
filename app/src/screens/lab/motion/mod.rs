//! Motion: the dynamics table step by step, a comparison of profiles, table and spindles over time.

mod cycle;
mod dynamics;
mod profiles;
mod steps;
mod table;

use crate::i18n::{say, t};
use crate::lab::panel::PanelPart;
use crate::model::LabEvent;
use crate::page::{read, send};
use crate::widgets::{choice, segmented};
use leptos::html::div;
use leptos::prelude::*;

fn name_of(part: PanelPart) -> String {
    match part {
        PanelPart::Dynamics => say!("page.lab.motion.dynamics"),
        PanelPart::Profiles => say!("page.lab.motion.profiles"),
        PanelPart::Cycle => say!("page.lab.motion.cycle"),
    }
}

pub(super) fn motion() -> impl IntoView {
    let part = || read(|m| m.lab.part);
    let choices = PanelPart::ALL.map(|this| {
        choice(move || part() == this, move || name_of(this), move |_| send(LabEvent::Part { part: this }))
            .into_any()
    });
    div().class("lab-sheet").child((
        div().class("lab-tools").child(segmented(t!("page.lab.motion.parts"), Vec::from(choices))),
        move || match part() {
            PanelPart::Dynamics => dynamics::dynamics().into_any(),
            PanelPart::Profiles => profiles::profiles().into_any(),
            PanelPart::Cycle => cycle::cycle().into_any(),
        },
    ))
}
