//! Problems in groups: the common text appears once. An open group lists its locations; pressing one shows it
//! on the board.
//!
//! ```text
//! ! 1,955 gaps are narrower than your cut of 0.143 mm      [Cure each] [Places] [ ] Seen
//!      GND · VCC: 0.118 mm at X 12.30 Y 4.56               [Cut it 0.05 mm deep there]  [ ] Seen
//! ```

use crate::i18n::{advice, message, say, t};
use crate::model::JobEvent;
use crate::page::{board, peek, read, send, watch};
use crate::screens::shown::zero;
use crate::widgets::{Icon, icon, push, tick};
use crate::workbench::edit;
use annulus_core::diagnostic::Severity;
use annulus_core::proof::{Cure, Finding, FindingKind, Group, Verdict};
use annulus_core::units::Length;
use leptos::ev;
use leptos::html::{button, div, li, p, span, strong, ul};
use leptos::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Maximum number of listed locations per group. The picture marks all of them.
const MOST_LISTED: usize = 100;
/// Groups of up to this many locations are open by default.
const FEW: usize = 3;

/// The locations of a group, narrowest nets first, as indices into the listed findings.
fn members(group: &Group, by_name: &BTreeMap<&str, usize>) -> Vec<usize> {
    let names = group.pairs.iter().flat_map(|pair| &pair.ids);
    names.filter_map(|name| by_name.get(name.as_str()).copied()).collect()
}

fn by_name(proved: &Verdict) -> BTreeMap<&str, usize> {
    proved.findings.iter().enumerate().map(|(at, finding)| (finding.id.as_str(), at)).collect()
}

/// The groups in display order: first those that must be accepted; copper remnants last.
fn listed(proved: &Verdict) -> Vec<&Group> {
    let mut groups: Vec<&Group> = proved.groups.iter().collect();
    let crumbs = |group: &Group| {
        matches!(group.kind, FindingKind::Remnant | FindingKind::Sliver | FindingKind::Fragment)
    };
    groups.sort_by_key(|group| (crumbs(group), !group.must_be_read));
    groups
}

/// All locations in display order.
pub(super) fn order(proved: &Verdict) -> Vec<usize> {
    let by_name = by_name(proved);
    listed(proved).into_iter().flat_map(|group| members(group, &by_name)).collect()
}

/// Key of a group's open state. Doesn't contain the width, so that it survives changes of widths.
fn name_of(group: &Group) -> String {
    format!("{} {}", group.kind.code(), group.must_be_read)
}

fn is_open(group: &Group) -> bool {
    watch(|m| &m.job.turned).with(|turned| turned.contains(&name_of(group))) != (group.count as usize <= FEW)
}

fn turn(group: &Group) {
    send(JobEvent::TurnGroup { name: name_of(group) });
}

pub(super) fn open_for(proved: &Verdict, at: usize) {
    let Some(finding) = proved.findings.get(at) else { return };
    let own = |group: &&Group| (group.kind, group.must_be_read, group.tool) == finding.cause();
    if let Some(group) = proved.groups.iter().find(own)
        && !untrack(|| is_open(group))
    {
        turn(group);
    }
}

pub(super) fn groups(proved: &Arc<Verdict>) -> impl IntoView + use<> {
    let by_name = by_name(proved);
    let lines = listed(proved).into_iter().map(|group| {
        let members = members(group, &by_name);
        line(proved.clone(), group.clone(), members).into_any()
    });
    ul().class("findings").child(lines.collect::<Vec<_>>())
}

fn look(severity: Severity) -> (&'static str, Icon) {
    match severity {
        Severity::Error => ("finding tone-alarm", Icon::Alarm),
        Severity::Warning => ("finding tone-pause", Icon::Warning),
        Severity::Note => ("finding tone-quiet", Icon::Check),
    }
}

fn line(proved: Arc<Verdict>, group: Group, members: Vec<usize>) -> impl IntoView {
    let severity = if group.must_be_read { group.kind.severity() } else { Severity::Note };
    let (class, sign) = look(severity);
    let diagnostic = group.diagnostic();
    let (what, meaning) = (diagnostic.clone(), diagnostic);
    let names: Arc<Vec<String>> =
        Arc::new(group.pairs.iter().flat_map(|pair| pair.ids.iter().cloned()).collect());
    let seen = group.must_be_read.then(|| seen_of(names));
    let open = {
        let group = group.clone();
        Memo::new(move |_| is_open(&group))
    };
    let count = group.count as usize;
    let cure_all = cure_all(&proved, &members);
    let name = format!("places-{}-{}", group.kind.code().replace('.', "-"), group.must_be_read);
    let places = {
        let name = name.clone();
        move || {
            open.get().then(|| {
                let marked = peek(|m| m.job.marked);
                let reach = members.iter().position(|at| Some(*at) == marked).map_or(0, |place| place + 1);
                let listed = members.iter().take(MOST_LISTED.max(reach));
                let lines: Vec<AnyView> =
                    listed.filter_map(|&at| Some(place(at, proved.findings.get(at)?).into_any())).collect();
                let more = count.saturating_sub(lines.len());
                let more = (more > 0).then(|| p().class("quiet").child(t!("page.cam.more", count = more)));
                div()
                    .class("places")
                    .attr("id", name.clone())
                    .child((ul().attr("aria-label", t!("page.cam.places")).child(lines), more))
            })
        }
    };
    let toggle = button()
        .attr("type", "button")
        .class("button small")
        .attr("aria-expanded", move || if open.get() { "true" } else { "false" })
        .attr("aria-controls", move || open.get().then(|| name.clone()))
        .on(ev::click, move |_| turn(&group))
        .child(move || {
            if open.get() {
                say!("page.cam.hide_places")
            } else {
                say!("page.cam.show_places", count = count)
            }
        });
    li().child((
        div().class(class).child((
            icon(sign),
            div().class("grow").child((
                strong().child(move || message(&what)),
                span().class("quiet").child(move || advice(&meaning)),
            )),
            div().class("row").child((cure_all, toggle, seen)),
        )),
        places,
    ))
}

fn seen_of(names: Arc<Vec<String>>) -> impl IntoView {
    let all = names.clone();
    let every =
        Memo::new(move |_| watch(|m| &m.job.read).with(|read| all.iter().all(|name| read.contains(name))));
    tick(
        move || every.get(),
        t!("page.cam.seen"),
        move |on| send(JobEvent::Read { names: names.to_vec(), on }),
    )
}

/// A button that fixes every location of a group with the mildest fix, if several have one.
fn cure_all(proved: &Arc<Verdict>, members: &[usize]) -> Option<impl IntoView + use<>> {
    let curable = |at: &&usize| proved.findings.get(**at).is_some_and(|finding| !finding.cures.is_empty());
    let curable: Vec<usize> = members.iter().filter(curable).copied().collect();
    let (count, proved) = (curable.len(), proved.clone());
    (count > 1).then(|| {
        push("button small", t!("page.cam.cure_all", count = count), move |_| {
            let chosen = peek(|m| m.job.chosen);
            let cures = curable.iter().filter_map(|at| {
                let finding = proved.findings.get(*at)?;
                Some((finding, finding.cures.first()?))
            });
            board::change_job(None, |work| {
                cures.fold(work.clone(), |work, (finding, cure)| edit::cured(&work, chosen, finding, cure))
            });
        })
    })
}

fn cure_text(cure: &Cure) -> String {
    let mm = |length: Length| format!("{:.3}", length.mm());
    match cure {
        Cure::Shallower { depth, .. } => say!("page.cam.cure_shallower", depth = mm(*depth)),
        Cure::OtherBit { bit, .. } => say!("page.cam.cure_other_bit", bit = super::called(bit)),
        Cure::Centred { lost, .. } => say!("page.cam.cure_centred", lost = mm(*lost)),
        Cure::Deeper { depth, .. } => say!("page.cam.cure_deeper", depth = mm(*depth)),
    }
}

/// Applies a fix to the selected operation if it isolates, else to the first one that does.
fn apply(finding: &Finding, cure: &Cure) {
    let chosen = peek(|m| m.job.chosen);
    board::change_job(None, |work| edit::cured(work, chosen, finding, cure));
}

/// The text of a location without what its group already shows.
fn text(finding: &Finding) -> String {
    let zero = zero();
    let alone = matches!(
        finding.kind,
        FindingKind::Still
            | FindingKind::NoBit
            | FindingKind::NotIsolated
            | FindingKind::Break
            | FindingKind::Gone
            | FindingKind::Shallow
    );
    if alone {
        return message(&finding.diagnostic_from(zero));
    }
    let at = |length: Length| format!("{:.2}", length.mm());
    let (x, y) = (at(finding.at.x - zero.x), at(finding.at.y - zero.y));
    let width = format!("{:.3}", finding.width.mm());
    if finding.nets.is_empty() {
        return say!("page.cam.place", width = width, x = x, y = y);
    }
    say!("page.cam.place_of", nets = finding.nets_from(zero), width = width, x = x, y = y)
}

pub(super) fn line_id(at: usize) -> String {
    format!("finding-{at}")
}

fn place(at: usize, finding: &Finding) -> impl IntoView + use<> {
    let marked = move || read(|m| m.job.marked) == Some(at);
    let told = finding.clone();
    let cures: Vec<AnyView> = finding
        .cures
        .iter()
        .cloned()
        .map(|cure| {
            let (text, finding) = (cure.clone(), finding.clone());
            push("button small", move || cure_text(&text), move |_| apply(&finding, &cure)).into_any()
        })
        .collect();
    let seen = finding.must_be_read().then(|| seen_of(Arc::new(vec![finding.id.clone()])));
    let agreed = finding.agreed.then(|| span().class("quiet").child(t!("page.cam.agreed")));
    li().class("place")
        .attr("id", line_id(at))
        .attr("aria-current", move || marked().then_some("true"))
        .child((
            button()
                .attr("type", "button")
                .attr("title", t!("page.cam.show"))
                .on(ev::click, move |_| send(JobEvent::Mark { at }))
                .child((span().child(move || text(&told)), agreed)),
            div().class("row").child((cures, seen)),
        ))
}
