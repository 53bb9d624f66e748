//! The page's address: the screen and the displayed part of it.
//!
//! ```text
//! #/board   #/cam/op/2   #/simulate?t=12.5   #/lab/phases   #/settings/tools   #/machine?view=operator
//! ```
//!
//! A named part may not exist yet, for example while the board is being read. The page shows it once it
//! exists, unless the user went elsewhere meanwhile.

use super::{Effect, LabEvent, Model, lab, play};
use crate::keys::{AddressPart, Tab, named};
use crate::lab::LabPanel;
use crate::workbench::edit;
use annulus_core::machine::{Group, SECTIONS};

/// The group of the page's own settings.
pub const PAGE_GROUP: &str = "page";
/// Its sections, which the machine's table does not have: page settings, data in the browser, version.
pub const OWN_SECTIONS: [&str; 3] = ["general", "data", "about"];

fn section(address: &str) -> Option<&'static str> {
    let word = address.strip_prefix("#/settings/")?;
    let of_machine = Group::ALL.map(Group::word).into_iter().chain(SECTIONS.iter().map(|one| one.name));
    of_machine.chain([PAGE_GROUP]).chain(OWN_SECTIONS).find(|section| *section == word)
}

/// The group of settings that an address names, by its word or by one of its sections; `None` for those of the
/// page.
pub fn group_of(section: &str) -> Option<Group> {
    let by_section = || SECTIONS.iter().find(|one| one.name == section).map(|one| one.group);
    Group::ALL.into_iter().find(|group| group.word() == section).or_else(by_section)
}

/// Opens an address; an unknown one changes nothing.
pub(super) fn go(model: &mut Model, address: &str) -> Vec<Effect> {
    let Some(tab) = Tab::of_address(address) else { return Vec::new() };
    let frame = &mut model.frame;
    frame.tab = tab;
    frame.operator = tab == Tab::Machine && address.contains("view=operator");
    frame.named = named(address);
    frame.section = section(address).unwrap_or(frame.section);
    let sheet = LabPanel::of_address(address);
    sheet.map_or_else(Vec::new, |sheet| lab::update(model, LabEvent::Show { sheet }))
}

pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    match model.frame.named {
        Some(AddressPart::Operation { number }) => {
            let Some(work) = &model.job.work else { return Vec::new() };
            let places = edit::of_face(work, work.setup.face);
            if let Some(at) = number.checked_sub(1).and_then(|index| places.get(index)) {
                model.job.chosen = *at;
            }
        }
        Some(AddressPart::Second { at_s }) if model.play.playback.is_some() => {
            play::hold(&mut model.play, at_s);
            model.frame.named = None;
            return play::follow(model);
        }
        _ => return Vec::new(),
    }
    model.frame.named = None;
    Vec::new()
}

/// Number of the selected operation in the list, from 1.
fn chosen(model: &Model) -> Option<usize> {
    let work = model.job.work.as_ref()?;
    let places = edit::of_face(work, work.setup.face);
    places.iter().position(|at| *at == model.job.chosen).map(|index| index + 1)
}

/// The address of the current view. During playback it has no second, which would change all the time.
pub fn of(model: &Model) -> String {
    let frame = &model.frame;
    let operation = |number: usize| format!("/op/{number}");
    let second = |at_s: f64| format!("?t={}", (at_s * 100.0).round() / 100.0);
    let rest = match (frame.tab, frame.named) {
        (Tab::Cam, Some(AddressPart::Operation { number })) => operation(number),
        (Tab::Cam, _) => chosen(model).map_or_else(String::new, operation),
        (Tab::Simulate, Some(AddressPart::Second { at_s })) => second(at_s),
        (Tab::Simulate, _) if model.play.at_s > 0.0 && !model.play.running => second(model.play.at_s),
        (Tab::Lab, _) => format!("/{}", model.lab.sheet.word()),
        (Tab::Settings, _) => format!("/{}", frame.section),
        (Tab::Machine, _) if frame.operator => "?view=operator".to_owned(),
        _ => String::new(),
    };
    format!("#/{}{rest}", frame.tab.word())
}
