//! Motion: the table of dynamics takt by takt, the profiles beside each other, table and spindles in time.
//!
//! Comes in: the machine and what was typed. Goes out: plots and tables; the dynamics can be applied.

mod cycle;
mod dynamics;
mod profiles;
mod takts;

use crate::i18n::{say, t};
use crate::widgets::choice;
use leptos::html::div;
use leptos::prelude::*;

/// A part of the sheet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Part {
    /// The integer table.
    #[default]
    Dynamics,
    /// Profiles in closed form.
    Profiles,
    /// Table and spindles together.
    Cycle,
}

impl Part {
    const ALL: [Self; 3] = [Self::Dynamics, Self::Profiles, Self::Cycle];

    fn name(self) -> String {
        match self {
            Self::Dynamics => say!("page.lab.motion.dynamics"),
            Self::Profiles => say!("page.lab.motion.profiles"),
            Self::Cycle => say!("page.lab.motion.cycle"),
        }
    }
}

/// The sheet.
pub(super) fn motion() -> impl IntoView {
    let part = super::desk().part;
    let choices = Part::ALL.map(|this| {
        choice(move || part.get() == this, move || this.name(), move |_| part.set(this)).into_any()
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
            Part::Dynamics => dynamics::dynamics().into_any(),
            Part::Profiles => profiles::profiles().into_any(),
            Part::Cycle => cycle::cycle().into_any(),
        },
    ))
}
