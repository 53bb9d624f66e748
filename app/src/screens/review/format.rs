//! The number format of a drill file, the evidence for it, and the next best candidate.

use super::preview;
use crate::engine::messages::FileRow;
use crate::i18n::{key, say, t};
use crate::model::{Document, FilesEvent};
use crate::page::{peek, send};
use crate::widgets::push;
use annulus_core::artwork::{Counts, FileRead, Source};
use annulus_core::project::saved::NumberReading;
use leptos::ev;
use leptos::html::{div, figcaption, figure, label, option, select, span};
use leptos::prelude::*;

fn percent(share: f64) -> String {
    format!("{:.0}", share * 100.0)
}

fn grounds(source: Option<Source>) -> &'static str {
    match source {
        Some(Source::Person) => key!("page.evidence.person"),
        Some(Source::Header) => key!("page.evidence.header"),
        Some(Source::Comment) => key!("page.evidence.comment"),
        Some(Source::Companion) => key!("page.evidence.companion"),
        Some(Source::Copper) => key!("page.evidence.copper"),
        Some(Source::Shape) => key!("page.evidence.shape"),
        Some(Source::Default) | None => key!("page.evidence.custom"),
    }
}

fn reading(file: &FileRead) -> String {
    let digits = file.number_format.map(|digits| format!("{}.{}", digits.integer, digits.decimal));
    let word = |name: &'static str| name.to_owned();
    let parts =
        [file.units.map(|units| word(units.name())), digits, file.zeros.map(|zeros| word(zeros.name()))];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" ")
}

fn again(change: impl FnOnce(&mut NumberReading)) {
    let Some(mut numbers) = peek(|m| m.board.document.as_ref().map(|open| open.said.numbers.clone())) else {
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

/// Parses a reading written like `inch 2.4 leading`.
fn said(reading: &str) -> NumberReading {
    let mut words = reading.split(' ');
    let units = words.next().map(str::to_owned);
    let (digits, zeros) = (words.next().and_then(digits_of), words.next().map(str::to_owned));
    NumberReading { units, digits, zeros }
}

/// The next best reading: a picture of its holes, its score, and the button that chooses it.
pub(super) fn rival(document: &Document, file: &FileRow) -> Option<AnyView> {
    let evidence = file.read.evidence.as_ref().filter(|_| file.drill.is_some())?;
    let (share, reading) = (evidence.runner_up?, evidence.runner_up_reading.clone()?);
    let picture = preview::holes_of(&evidence.runner_up_holes, document.reading.body)?;
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

pub(crate) fn format(numbers: NumberReading, file: &FileRead, drill: Counts) -> impl IntoView + use<> {
    let counts =
        t!("page.review.counts", holes = drill.hits, slots = drill.slots, routes = drill.routed_paths);
    let evidence = file.evidence.as_ref();
    let ground = grounds(evidence.map(|evidence| evidence.source));
    let read = reading(file);
    let read_as =
        move || say!("page.review.read_as", reading = read, because = crate::i18n::text(ground, &[]));
    let score = evidence
        .and_then(|evidence| evidence.score)
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
