//! Groups the files of a set by board, before any drill file is read. Layers of another board are no evidence
//! for a drill file, and a job needs exactly one board.
//!
//! ```text
//!   left-F_Cu.gbr   left.drl   left-Edge_Cuts.gbr     stem "left"      ┐ both have a top copper: two boards
//!   right-F_Cu.gbr  right.drl                         stem "right"     ┘
//!   top.gbr  drill.drl                                no stem: grouped by folder, or with the only board
//! ```
//!
//! Of coordinates, uses only the bounding box of each layer.

use super::companion::{base, folder};
use super::registration::same_place;
use super::words::stem_words;
use super::{Role, Side};
use crate::geometry::Bounds;
use std::collections::{BTreeMap, BTreeSet};

/// Words that the names of many boards start with.
const COMMON: [&str; 8] = ["project", "job", "test", "main", "my", "new", "gyw", "panel"];

#[derive(Clone, Debug)]
pub(super) struct Item<'a> {
    pub(super) name: &'a str,
    /// None if it isn't part of a board.
    pub(super) role: Option<(Role, Option<Side>)>,
    /// The project id inside the file.
    pub(super) project: Option<String>,
    pub(super) fingerprint: u64,
    /// Bounding box of a layer.
    pub(super) bounds: Option<Bounds>,
}

#[derive(Clone, Debug, Default)]
struct Group {
    members: Vec<usize>,
    stem: Vec<String>,
    /// The shortest stem of its drill files and layers.
    label: Vec<String>,
    folder: String,
    projects: BTreeSet<String>,
    fingerprints: BTreeSet<u64>,
    /// The sides that have copper; none means an outline.
    layers: BTreeSet<Option<u8>>,
    drills: bool,
    bounds: Option<Bounds>,
}

impl Group {
    fn of(index: usize, item: &Item<'_>, root: &str) -> Self {
        let inside = folder(item.name).strip_prefix(root).unwrap_or_default();
        let mut stem = stem_words(base(item.name));
        if stem.is_empty() {
            let last = inside.trim_end_matches(['/', '\\', '!']);
            stem = stem_words(base(last));
        }
        let side = |side: Option<Side>| side.map_or(3, |side| side as u8);
        let layers = match item.role {
            Some((Role::Copper, Some(Side::Inner)) | (Role::Copper, None)) => Some(Some(9)),
            Some((Role::Copper, on)) => Some(Some(side(on))),
            Some((Role::Outline, _)) => Some(None),
            _ => None,
        };
        let is_board = matches!(item.role, Some((Role::Drill | Role::Copper | Role::Outline, _)));
        Self {
            members: vec![index],
            label: if is_board { stem.clone() } else { Vec::new() },
            stem,
            folder: folder(item.name).to_owned(),
            projects: item.project.iter().cloned().collect(),
            fingerprints: [item.fingerprint].into(),
            layers: layers.into_iter().collect(),
            drills: matches!(item.role, Some((Role::Drill, _))),
            bounds: item.bounds,
        }
    }

    fn take(&mut self, other: Self) {
        self.members.extend(other.members);
        if self.stem.is_empty() || !other.stem.is_empty() && other.stem.len() < self.stem.len() {
            self.stem = other.stem;
        }
        if self.label.is_empty() || !other.label.is_empty() && other.label.len() < self.label.len() {
            self.label = other.label;
        }
        self.projects.extend(other.projects);
        self.fingerprints.extend(other.fingerprints);
        self.layers.extend(other.layers);
        self.drills |= other.drills;
        self.bounds = match (self.bounds, other.bounds) {
            (Some(a), Some(b)) => Some(a.with(b.min).with(b.max)),
            (a, b) => a.or(b),
        };
    }

    fn is_named(&self) -> bool {
        !self.stem.is_empty()
    }

    /// True if one name starts with the other, or if either has no stem.
    fn is_related(&self, other: &Self) -> bool {
        self.stem.iter().zip(&other.stem).all(|(a, b)| a == b)
    }

    /// True if both names start with the same specific word.
    fn begins_as(&self, other: &Self) -> bool {
        let first = self.stem.first().filter(|word| !COMMON.contains(&word.as_str()));
        first.is_some() && first == other.stem.first()
    }

    /// True if bounding boxes and drill files allow one board: one box contains the other, and at most one
    /// group has drill files.
    fn agrees(&self, other: &Self) -> bool {
        let boxes = self.bounds.zip(other.bounds);
        boxes.is_none_or(|(a, b)| same_place(a, b) || same_place(b, a)) && !(self.drills && other.drills)
    }

    /// True if both have a layer for the same side. (9 is the mark of inner layers, of which a board has
    /// several.)
    fn is_rival(&self, other: &Self) -> bool {
        self.layers.iter().any(|layer| *layer != Some(9) && other.layers.contains(layer))
    }

    fn is_whole(&self) -> bool {
        self.drills && !self.layers.is_empty()
    }

    fn projects_differ(&self, other: &Self) -> bool {
        !self.projects.is_empty() && !other.projects.is_empty() && self.projects.is_disjoint(&other.projects)
    }
}

/// The board name of each item; empty for files of no board.
pub(super) fn boards(items: &[Item<'_>]) -> Vec<String> {
    let root = common_root(items.iter().filter(|item| item.role.is_some()).map(|item| folder(item.name)));
    let mut groups: Vec<Group> = Vec::new();
    let relevant = items.iter().enumerate().filter(|(_, item)| item.role.is_some());
    // Group files of one folder and stem first.
    let mut by_stem: BTreeMap<(String, Vec<String>), usize> = BTreeMap::new();
    for (index, item) in relevant {
        let group = Group::of(index, item, &root);
        let key = (group.folder.clone(), group.stem.clone());
        match by_stem.get(&key).and_then(|&at| groups.get_mut(at)) {
            Some(have) => have.take(group),
            None => {
                by_stem.insert(key, groups.len());
                groups.push(group);
            }
        }
    }
    join(&mut groups, |a, b| !a.fingerprints.is_disjoint(&b.fingerprints) && a.is_related(b));
    join(&mut groups, |a, b| !a.projects.is_disjoint(&b.projects));
    let mend =
        |a: &Group, b: &Group| a.folder == b.folder && a.is_named() && b.is_named() && !a.projects_differ(b);
    let two = |a: &Group, b: &Group| a.is_whole() && b.is_whole() && a.stem != b.stem;
    join(&mut groups, |a, b| mend(a, b) && a.is_related(b) && !two(a, b));
    join(&mut groups, |a, b| mend(a, b) && a.begins_as(b) && a.agrees(b) && !a.is_rival(b));
    within_folders(&mut groups);
    // Across folders: same name, unless both have layers and drill files.
    join(&mut groups, |a, b| {
        a.folder != b.folder && a.is_related(b) && !(a.is_whole() && b.is_whole()) && !a.projects_differ(b)
    });
    halves(&mut groups);
    named(items.len(), &groups)
}

/// The project id must be within the first bytes.
const HEAD: usize = 8 * 1024;

/// The project id (`TF.ProjectId`), or the id of files with a common origin (`TF.SameCoordinates`).
pub(super) fn project(bytes: &[u8]) -> Option<String> {
    let head = bytes.get(..HEAD).unwrap_or(bytes);
    ["TF.ProjectId,", "TF.SameCoordinates,"].iter().find_map(|word| {
        let at = head.windows(word.len()).position(|window| window == word.as_bytes())?;
        let rest = head.get(at + word.len()..)?;
        let end = rest.iter().position(|byte| b"*%\r\n".contains(byte))?;
        let id = String::from_utf8_lossy(rest.get(..end)?).into_owned();
        // Many CADs write `Original` or a position here; only a long id identifies a board.
        (id.len() >= 20).then_some(id)
    })
}

fn join(groups: &mut Vec<Group>, one: impl Fn(&Group, &Group) -> bool) {
    let mut at = 0;
    while at < groups.len() {
        let mut next = at + 1;
        while next < groups.len() {
            if groups.get(at).zip(groups.get(next)).is_some_and(|(a, b)| one(a, b)) {
                let other = groups.remove(next);
                if let Some(group) = groups.get_mut(at) {
                    group.take(other);
                }
                next = at + 1;
            } else {
                next += 1;
            }
        }
        at += 1;
    }
}

/// Joins layers of one folder that don't compete for a side. Drill files join the only group with layers, if
/// that has no name or no drill file.
fn within_folders(groups: &mut Vec<Group>) {
    let layered = |group: &Group| !group.layers.is_empty();
    let here = |a: &Group, b: &Group| a.folder == b.folder && !a.projects_differ(b);
    join(groups, |a, b| {
        here(a, b) && layered(a) && layered(b) && !a.is_rival(b) && !(a.is_whole() && b.is_whole())
    });
    let folders: BTreeSet<String> = groups.iter().map(|group| group.folder.clone()).collect();
    for folder in folders {
        let of_folder = |group: &&Group| group.folder == folder;
        let here_layered: Vec<Group> =
            groups.iter().filter(of_folder).filter(|g| layered(g)).cloned().collect();
        let place = |a: &Group, b: &Group| {
            a.bounds.zip(b.bounds).is_some_and(|(a, b)| same_place(a, b) || same_place(b, a))
        };
        let bare: Vec<&Group> = groups.iter().filter(of_folder).filter(|g| !layered(g) && g.drills).collect();
        let first = here_layered.first();
        let one_place = here_layered.iter().all(|group| {
            !group.drills && first.is_some_and(|first| place(first, group) && !first.projects_differ(group))
        });
        let strange = bare.len() == 1
            && bare.iter().all(|drill| {
                drill.is_named()
                    && !here_layered.iter().any(|group| group.is_named() && group.is_related(drill))
            });
        // Layers in one position and a drill file with another name: only the names differ, so they are one
        // board.
        if here_layered.len() > 1 && one_place && strange {
            join(groups, |a, b| a.folder == folder && here(a, b));
            continue;
        }
        let [only] = here_layered.as_slice() else {
            join(groups, |a, b| {
                a.folder == folder
                    && here(a, b)
                    && !layered(a)
                    && !layered(b)
                    && !(a.is_named() && b.is_named())
                    && !(a.drills && b.drills)
            });
            continue;
        };
        let first = only.members.first().copied();
        let open = !only.is_named() || !only.drills;
        join(groups, |a, b| {
            let is = |group: &Group| first.is_some_and(|first| group.members.contains(&first));
            let other = if is(a) { b } else { a };
            here(a, b)
                && a.folder == folder
                && (is(a) || is(b))
                && (open || !other.is_named() || !other.drills)
        });
    }
}

/// Exactly one group of layers and one of drill files: one board in two folders.
fn halves(groups: &mut Vec<Group>) {
    let layered = groups.iter().filter(|group| !group.layers.is_empty() && !group.drills).count();
    let drilled = groups.iter().filter(|group| group.layers.is_empty() && group.drills).count();
    let whole = groups.iter().filter(|group| group.is_whole()).count();
    if (layered, drilled, whole) == (1, 1, 0) {
        let half = |a: &Group| !a.layers.is_empty() || a.drills;
        join(groups, |a, b| half(a) && half(b));
    }
}

fn named(count: usize, groups: &[Group]) -> Vec<String> {
    let mut out = vec![String::new(); count];
    let mut taken = BTreeSet::new();
    for group in groups.iter().filter(|group| group.drills || !group.layers.is_empty()) {
        let own = if group.label.is_empty() { "board".to_owned() } else { group.label.join("-") };
        let mut name = own.clone();
        let mut number = 2;
        while !taken.insert(name.clone()) {
            name = format!("{own}-{number}");
            number += 1;
        }
        for &member in &group.members {
            if let Some(slot) = out.get_mut(member) {
                slot.clone_from(&name);
            }
        }
    }
    out
}

fn common_root<'a>(mut folders: impl Iterator<Item = &'a str>) -> String {
    let Some(first) = folders.next() else { return String::new() };
    let mut root = first.to_owned();
    for folder in folders {
        while !folder.starts_with(&root) {
            let Some(at) = root.rfind(['/', '\\']) else { return String::new() };
            root.truncate(at);
        }
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Groups names, each with its type: `t` top copper, `b` bottom, `o` outline, `d` drill, `s` silkscreen.
    fn grouped(files: &[(&str, char)]) -> Vec<String> {
        let items: Vec<Item<'_>> = (0..)
            .zip(files)
            .map(|(at, &(name, what))| Item {
                name,
                role: Some(match what {
                    't' => (Role::Copper, Some(Side::Top)),
                    'b' => (Role::Copper, Some(Side::Bottom)),
                    'o' => (Role::Outline, None),
                    'd' => (Role::Drill, None),
                    _ => (Role::Silk, Some(Side::Top)),
                }),
                project: None,
                fingerprint: at,
                bounds: None,
            })
            .collect();
        boards(&items)
    }

    #[test]
    fn files_of_one_board_are_grouped() {
        let rows: [&[(&str, char)]; 13] = [
            &[
                ("clock-F_Cu.gbr", 't'),
                ("clock-Edge_Cuts.gbr", 'o'),
                ("clock.drl", 'd'),
                ("clock-NPTH.drl", 'd'),
            ],
            &[("Top.pho", 't'), ("Bottom.pho", 'b'), ("Drill.drl", 'd')],
            &[("rs232_cm.top", 't'), ("thruhole.tap", 'd')],
            &[("Excellon_PTH_Through.drl", 'd'), ("Gerber_BottomLayer.gbl", 'b')],
            &[
                ("LimeSDR-QPCIe_1v2-RoundHoles.TXT", 'd'),
                ("LimeSDR-QPCIe_1v2-SlotHoles.TXT", 'd'),
                ("LimeSDR-QPCIe_1v2.GTL", 't'),
            ],
            &[
                ("MinnowMax_RevA1_NCDRILL.drl", 'd'),
                ("MinnowMax_RevA1_NCROUTE.rou", 'd'),
                ("MinnowMax_lyr2.art", 't'),
            ],
            &[("etchlayer1top.gdo", 't'), ("ThruHolePlated.ncd", 'd'), ("ContourPlated.ncd", 'd')],
            &[("a/Gerber/top.gbr", 't'), ("a/NC Drill/holes.drl", 'd')],
            &[("a/Gerber/led.gtl", 't'), ("a/Drill/led.txt", 'd')],
            &[("b-F_Cu.gtl", 't'), ("b.drl", 'd'), ("new/b-F_Cu.gtl", 't')],
            &[("usb.gtl", 't'), ("usb.txt", 'd'), ("usb.gko", 'o'), ("usb.gto", 's')],
            &[("myboardtop.gbr", 't'), ("myboardbottom.gbr", 'b'), ("myboarddrill.xln", 'd')],
            &[("pcb-F_Cu.gbr", 't'), ("via.drl", 'd'), ("mounting.drl", 'd'), ("extra.drl", 'd')],
        ];
        for row in rows {
            let names: BTreeSet<String> = grouped(row).into_iter().filter(|name| !name.is_empty()).collect();
            assert_eq!(names.len(), 1, "{row:?}: {names:?}");
        }
    }

    #[test]
    fn boards_in_one_folder_stay_separate() {
        type Named<'a> = &'a [(&'a str, char)];
        let rows: [(Named<'_>, &[&str]); 6] = [
            (
                &[
                    ("left-F_Cu.gbr", 't'),
                    ("left.drl", 'd'),
                    ("right-F_Cu.gbr", 't'),
                    ("right.drl", 'd'),
                    ("mid.drl", 'd'),
                    ("mid-Edge.gbr", 'o'),
                    ("mid-B_Cu.gbr", 'b'),
                ],
                &["left", "left", "right", "right", "mid", "mid", "mid"],
            ),
            (
                &[("keyboard.drl", 'd'), ("panel.drl", 'd'), ("panel_Bottom.gbr", 'b')],
                &["keyboard", "panel", "panel"],
            ),
            (&[("amp.drl", 'd'), ("radio.drl", 'd'), ("clock.drl", 'd')], &["amp", "radio", "clock"]),
            (
                &[("one/top.gbr", 't'), ("one/drill.drl", 'd'), ("two/top.gbr", 't'), ("two/drill.drl", 'd')],
                &["one", "one", "two", "two"],
            ),
            (
                &[
                    ("x/one.zip!/top.gbr", 't'),
                    ("x/one.zip!/d.drl", 'd'),
                    ("x/two.zip!/top.gbr", 't'),
                    ("x/two.zip!/d.drl", 'd'),
                ],
                &["one", "one", "two", "two"],
            ),
            (
                &[("led.gtl", 't'), ("led.drl", 'd'), ("old/led.gtl", 't'), ("old/led.drl", 'd')],
                &["led", "led", "led-2", "led-2"],
            ),
        ];
        for (row, wanted) in rows {
            assert_eq!(grouped(row), wanted, "{row:?}");
        }
    }
}
