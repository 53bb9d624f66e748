//! Names of groups and sections.

use crate::i18n;
use crate::model::address::PAGE_GROUP;
use annulus_core::machine::Group;

pub(super) fn group_name(group: Option<Group>) -> String {
    let word = group.map_or(PAGE_GROUP, Group::word);
    i18n::text(&format!("page.group.{word}"), &[])
}

pub(super) fn section_name(section: &str) -> String {
    i18n::text(&format!("page.section.{section}"), &[])
}
