//! Other languages than English: every text exists, with the same arguments and all plural forms, and none is
//! left in English.

use annulus_core::locale::{self, FALLBACK, braces};
use fixed_decimal::Decimal;
use icu_locale_core::Locale;
use icu_plurals::{PluralCategory, PluralOperands, PluralRules};
use std::collections::BTreeSet;

/// Texts that are identical in English: names, signs, units, and these words.
const SAME: &[&str] = &[
    "Alarm",
    "Annulus",
    "Auto",
    "CAM",
    "PID",
    "Program",
    "STOP",
    "Start…",
    "Stop",
    "WebGL2",
    "WebGPU",
    "Zip",
    "annulus link",
];

/// Longest text that can consist only of units, axes and signs.
const OF_SIGNS: usize = 3;

/// Words of the UX specification's critical catalogue: key, Polish, Chinese.
const CRITICAL: &[(&str, &str, &str)] = &[
    ("page.stop.label", "STOP", "停止"),
    ("page.job.pause", "Pauza", "暂停"),
    ("page.job.resume", "Wznów", "继续"),
    ("page.machine.home", "Bazuj maszynę (jedzie do krańcówek)", "机床回零"),
    ("page.machine.base", "Ustaw zero robocze tutaj (bez ruchu)", "设工件零点（不移动）"),
    ("page.jog.title", "Ruch ręczny", "点动"),
    ("page.state.tool_change", "Wymiana narzędzia", "换刀"),
    ("page.job.holes", "Otwór {done} z {total}", "第{done}孔 / 共{total}孔"),
    ("page.stage.travel", "przejazd XY", "定位"),
    ("page.stage.approach", "dojazd", "接近"),
    ("page.stage.retract", "wycofanie", "抬刀"),
    ("page.cam.word.isolate", "Grawerowanie izolacji", "隔离雕刻"),
    ("page.cam.word.drill", "Wiercenie", "钻孔"),
    ("page.cam.word.cut_out", "Wycięcie", "外形切割"),
    ("page.state.not_homed", "Niezbazowana", "未回零"),
    ("page.state.alarm", "Alarm", "报警"),
    ("page.state.link_lost", "Utracono łączność", "连接中断"),
];

fn others() -> Vec<&'static str> {
    locale::languages().map(|(language, _)| language).filter(|language| *language != FALLBACK).collect()
}

fn names(text: &str) -> BTreeSet<&str> {
    locale::names(text).collect()
}

/// Every text of `language` that English has too, as (key, English, other).
fn pairs(language: &str) -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    locale::entries(language)
        .iter()
        .filter_map(|(key, text)| locale::lookup(FALLBACK, key).map(|english| (*key, english, *text)))
}

fn none_wrong(wrong: &[String]) {
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn languages_have_no_texts_missing_in_english() {
    let english: BTreeSet<_> = locale::entries(FALLBACK).iter().map(|(key, _)| *key).collect();
    for language in others() {
        let left: Vec<_> = locale::entries(language)
            .iter()
            .map(|(key, _)| *key)
            .filter(|key| !english.contains(key))
            .collect();
        assert!(left.is_empty(), "{language}: {left:?}");
    }
}

#[test]
fn texts_have_the_arguments_of_the_english_ones() {
    let wrong: Vec<_> = others()
        .into_iter()
        .flat_map(|language| pairs(language).map(move |pair| (language, pair)))
        .filter(|(_, (_, english, text))| names(english) != names(text))
        .map(|(language, (key, english, text))| format!("{language} {key}: {english} / {text}"))
        .collect();
    none_wrong(&wrong);
}

#[test]
fn counted_words_have_the_plural_forms_of_their_language() {
    let mut wrong = Vec::new();
    for (language, _) in locale::languages() {
        let most = locale::forms(language);
        let least = if most > 2 { most - 1 } else { 2 };
        for (key, text) in locale::entries(language) {
            for inside in braces(text) {
                let forms = inside.split('|').count() - 1;
                if forms > 0 && !(least..=most).contains(&forms) {
                    wrong.push(format!("{language} {key}: {{{inside}}} has {forms} forms"));
                }
            }
        }
    }
    none_wrong(&wrong);
}

#[test]
fn texts_of_other_languages_are_translated() {
    let has_words = |text: &str| {
        let mut plain = text.to_owned();
        for inside in braces(text) {
            plain = plain.replace(&format!("{{{inside}}}"), " ");
        }
        plain.split(|letter: char| !letter.is_alphabetic()).any(|word| word.chars().count() > OF_SIGNS)
    };
    let mut wrong = Vec::new();
    for language in others() {
        for (key, english, text) in pairs(language) {
            let empty = text.trim().is_empty() != english.trim().is_empty();
            if empty || (english == text && has_words(text) && !SAME.contains(&text)) {
                wrong.push(format!("{language} {key}: {text}"));
            }
        }
    }
    none_wrong(&wrong);
    assert!(has_words("Drilling {count}") && !has_words("{ms} ms") && !has_words("X {x}  Y {y}"));
}

#[test]
fn critical_words_are_the_agreed_ones() {
    for (key, polish, chinese) in CRITICAL {
        assert_eq!(locale::lookup("pl", key), Some(*polish), "{key}");
        assert_eq!(locale::lookup("zh", key), Some(*chinese), "{key}");
    }
}

#[test]
fn plural_forms_follow_cldr() {
    let numbers = (0..2_000).map(|number: u32| number.to_string());
    let fractions = ["0.5", "1.5", "2.25", "12.7", "100.1"].map(str::to_owned);
    let numbers: Vec<String> = numbers.chain(fractions).collect();
    for (language, categories) in [
        ("en", &[PluralCategory::One, PluralCategory::Other][..]),
        ("pl", &[PluralCategory::One, PluralCategory::Few, PluralCategory::Many, PluralCategory::Other]),
        ("zh", &[PluralCategory::Other]),
    ] {
        let rules = PluralRules::try_new_cardinal(language.parse::<Locale>().unwrap().into()).unwrap();
        assert_eq!(categories.len(), locale::forms(language));
        for number in &numbers {
            let operands = PluralOperands::from(&number.parse::<Decimal>().unwrap());
            let expected = rules.category_for(operands);
            let found = locale::form(language, number);
            assert_eq!(categories[found], expected, "{language} {number}");
        }
    }
}

/// Prefix of texts that other languages needn't have: those of tests.
const OF_TESTS: &str = "test.";

#[test]
fn every_text_exists_in_every_language() {
    for language in others() {
        let has: BTreeSet<_> = locale::entries(language).iter().map(|(key, _)| *key).collect();
        let keys = locale::entries(FALLBACK).iter().map(|(key, _)| *key);
        let missing: Vec<_> = keys.filter(|key| !key.starts_with(OF_TESTS) && !has.contains(key)).collect();
        assert!(missing.is_empty(), "{language}: {missing:?}");
    }
}
