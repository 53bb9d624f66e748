//! How the numbers of a drill file are read, on what grounds, and how else they could be.
//!
//! Comes in: the evidence. Goes out: what the person says instead.

use super::preview;
use crate::engine::messages::DrillRow;
use crate::i18n::{key, say, t};
use crate::model::{Document, FilesEvent};
use crate::page::open_board;
use crate::page::send;
use crate::widgets::push;
use annulus_core::project::saved::NumberReading;
use leptos::ev;
use leptos::html::{div, figcaption, figure, label, option, select, span};
use leptos::prelude::*;

fn percent(share: f64) -> String {
    format!("{:.0}", share * 100.0)
}

fn grounds(evidence: &str) -> &'static str {
    match evidence {
        "person" => key!("page.evidence.person"),
        "header" => key!("page.evidence.header"),
        "comment" => key!("page.evidence.comment"),
        "companion" => key!("page.evidence.companion"),
        "copper" => key!("page.evidence.copper"),
        "shape" => key!("page.evidence.shape"),
        _ => key!("page.evidence.custom"),
    }
}

fn reading(drill: &DrillRow) -> String {
    let digits = drill.digits.map(|(before, behind)| format!("{before}.{behind}"));
    let parts = [drill.units.clone(), digits, drill.zeros.clone()];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" ")
}

fn again(change: impl FnOnce(&mut NumberReading)) {
    let Some(mut numbers) =
        open_board().document.with_untracked(|open| open.as_ref().map(|open| open.said.numbers.clone()))
    else {
        return;
    };
    change(&mut numbers);
    send(FilesEvent::Numbers { numbers });
}

fn pick(
    name: &'static str,
    now: Option<String>,
    choices: &'static [&'static str],
    set: fn(&mut NumberReading, Option<String>),
) -> impl IntoView {
    let one = move |word: &'static str, now: &Option<String>| {
        option().attr("value", word).prop("selected", now.as_deref() == Some(word)).child(word)
    };
    let options: Vec<_> = choices.iter().map(|word| one(word, &now)).collect();
    let choose = move |event| {
        let word = event_target_value(&event);
        again(move |numbers| set(numbers, (!word.is_empty()).then_some(word)));
    };
    label().class("field").child((
        span().child(move || crate::i18n::text(name, &[])),
        select()
            .on(ev::change, choose)
            .child((option().attr("value", "").child(t!("page.review.as_read")), options)),
    ))
}

fn digits_of(word: &str) -> Option<(u8, u8)> {
    let (before, behind) = word.split_once('.')?;
    Some((before.parse().ok()?, behind.parse().ok()?))
}

/// A reading for people, as what a person would say: `inch 2.4 leading`.
fn said(reading: &str) -> NumberReading {
    let mut words = reading.split(' ');
    let units = words.next().map(str::to_owned);
    let (digits, zeros) = (words.next().and_then(digits_of), words.next().map(str::to_owned));
    NumberReading { units, digits, zeros }
}

/// How else the numbers could be read: what that looks like, how well it fits, and the button that takes it.
pub(super) fn rival(document: &Document, drill: &DrillRow) -> Option<AnyView> {
    let (share, reading) = (drill.runner_up?, drill.runner_up_reading.clone()?);
    let picture = preview::holes_of(&drill.runner_up_holes, document.reading.body)?;
    let written = reading.clone();
    let words = t!("page.review.runner_up", reading = written, percent = percent(share));
    let take = move |_| again(|numbers| *numbers = said(&reading));
    let figure = figure().class("rival").child((
        picture,
        figcaption().class("tabular").child(words),
        push("button small", t!("page.review.read_so"), take),
    ));
    Some(figure.into_any())
}

/// The line.
pub(crate) fn format(numbers: NumberReading, drill: DrillRow) -> impl IntoView {
    let counts = t!("page.review.counts", holes = drill.hits, slots = drill.slots, routes = drill.routes);
    let ground = grounds(&drill.evidence);
    let read = reading(&drill);
    let read_as =
        move || say!("page.review.read_as", reading = read, because = crate::i18n::text(ground, &[]));
    let score = drill
        .score
        .map(|share| span().class("tabular").child(t!("page.review.score", percent = percent(share))));
    let digits = numbers.digits.map(|(before, behind)| format!("{before}.{behind}"));
    div().class("evidence").child((
        span().class("tabular").child(counts),
        span().child(read_as),
        score,
        pick(key!("page.review.units"), numbers.units, &["mm", "inch"], |numbers, word| numbers.units = word),
        pick(
            key!("page.review.digits"),
            digits,
            &["2.4", "2.3", "3.3", "4.2", "2.5", "3.2", "4.4"],
            |numbers, word| {
                numbers.digits = word.as_deref().and_then(digits_of);
            },
        ),
        pick(key!("page.review.zeros"), numbers.zeros, &["leading", "trailing", "none"], |numbers, word| {
            numbers.zeros = word;
        }),
    ))
}
