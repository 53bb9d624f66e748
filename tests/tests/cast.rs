//! Golden test of messages and saved records, byte for byte: renaming a type or a field must not change them.
//! `ANNULUS_BLESS=1` rewrites `data/cast/words.txt`; `rows.txt` is written manually.

use annulus_core::cam::HoleOrder;
use annulus_core::cam::work::{CutDirection, CutSide, Flip, Holes, Lines, OperationKind, Remedy, Zero};
use annulus_core::control::{Ending, State, Timing, Trust};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::grbl::{ResetOnOpen, SetterStep};
use annulus_core::job::{Command, Cutter, Input, Mark, Otherwise, Stage, Switching};
use annulus_core::level::HeightMap;
use annulus_core::machine::{ToolWear, Value};
use annulus_core::magazine::{ChangeStep, Held, Seen, ToolStock};
use annulus_core::pins::{SpindleState, SpindleTrouble};
use annulus_core::project::saved::SaidOfFiles;
use annulus_core::queue::{Mode, RowState};
use annulus_core::wire::{self, Ask, LinkBody, PairBody, Paired, QueuePhase, RowVerdict, Scope, Tell};
use annulus_host::KeptSurface;
use annulus_host::grbl::AttendedJob;
use annulus_host::journal::{Damage, JobRecord, Progress, WorkZero, sealed};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::{env, fs};

/// Reads a value and writes it again.
type Again = fn(&str) -> Result<String, serde_json::Error>;

/// The types of the rows in `rows.txt`.
const TYPES: [(&str, Again); 19] = [
    ("Ask", again::<Ask>),
    ("AttendedJob", again::<AttendedJob>),
    ("Command", again::<Command>),
    ("Damage", again::<Damage>),
    ("Diagnostic", again::<Diagnostic>),
    ("HeightMap", again::<HeightMap>),
    ("JobRecord", again::<JobRecord>),
    ("KeptSurface", again::<KeptSurface>),
    ("LinkBody", again::<LinkBody>),
    ("PairBody", again::<PairBody>),
    ("Paired", again::<Paired>),
    ("Progress", again::<Progress>),
    ("SaidOfFiles", again::<SaidOfFiles>),
    ("Tell", again::<Tell>),
    ("Timing", again::<Timing>),
    ("ToolStock", again::<ToolStock>),
    ("ToolWear", again::<ToolWear>),
    ("Value", again::<Value>),
    ("WorkZero", again::<WorkZero>),
];

fn again<T: Serialize + DeserializeOwned>(text: &str) -> Result<String, serde_json::Error> {
    serde_json::to_string(&serde_json::from_str::<T>(text)?)
}

fn golden(name: &str) -> String {
    format!("{}/data/cast/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[track_caller]
fn compare(name: &str, text: &str) {
    let path = golden(name);
    if env::var_os("ANNULUS_BLESS").is_some() {
        return fs::write(path, text).unwrap();
    }
    let expected = fs::read_to_string(&path).unwrap();
    for (line, (found, expected)) in (1..).zip(text.lines().zip(expected.lines())) {
        assert_eq!(found, expected, "{path}:{line}");
    }
    assert_eq!(text.lines().count(), expected.lines().count(), "{path}");
}

/// The serde names of an enum's variants in order, taken from serde's error message. A saved program stores
/// the index.
fn words<T: DeserializeOwned>(text: &str) -> Vec<String> {
    let Err(why) = serde_json::from_str::<T>(text) else { return Vec::new() };
    let why = why.to_string();
    let (_, known) = why.split_once("expected ").unwrap_or_else(|| panic!("{why}"));
    known.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn messages_and_records_have_stable_bytes() {
    let rows = fs::read_to_string(golden("rows.txt")).unwrap();
    let mut wrong = String::new();
    for (line, row) in (1..).zip(rows.lines()).filter(|(_, row)| !row.is_empty()) {
        let (name, text) = row.split_once(' ').unwrap();
        let (_, again) = TYPES.iter().find(|(known, _)| *known == name).unwrap_or_else(|| panic!("{name}"));
        match again(text) {
            Ok(now) if now == text => {}
            Ok(now) => writeln!(wrong, "rows.txt:{line}\n  was {text}\n  now {now}").unwrap(),
            Err(why) => writeln!(wrong, "rows.txt:{line} {text}\n  {why}").unwrap(),
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn every_message_has_a_row() {
    #[derive(Deserialize)]
    struct Tagged {
        t: String,
    }
    let rows = fs::read_to_string(golden("rows.txt")).unwrap();
    let there = |name: &str| -> BTreeSet<String> {
        let rows = rows.lines().filter_map(|row| row.strip_prefix(name)?.strip_prefix(' '));
        rows.map(|row| serde_json::from_str::<Tagged>(row).unwrap().t).collect()
    };
    let unknown = r#"{"t":"?"}"#;
    assert_eq!(BTreeSet::from_iter(words::<Ask>(unknown)), there("Ask"));
    assert_eq!(BTreeSet::from_iter(words::<Tell>(unknown)), there("Tell"));
    for (name, _) in TYPES {
        assert!(rows.lines().any(|row| row.split(' ').next() == Some(name)), "no row of {name}");
    }
}

#[test]
fn enums_have_stable_words() {
    let unknown = r#""?""#;
    macro_rules! rows {
        ($($kind:ty),* $(,)?) => {
            [$((stringify!($kind), words::<$kind>(unknown))),*]
        };
    }
    let rows = rows![
        CutDirection,
        CutSide,
        Flip,
        HoleOrder,
        OperationKind,
        Remedy,
        Zero,
        ChangeStep,
        Command,
        Cutter,
        Ending,
        Held,
        Holes,
        Input,
        Lines,
        Mark,
        Mode,
        Otherwise,
        QueuePhase,
        ResetOnOpen,
        RowState,
        RowVerdict,
        Scope,
        Seen,
        SetterStep,
        Severity,
        SpindleState,
        SpindleTrouble,
        Stage,
        State,
        Switching,
        Trust,
        annulus_core::board::Face,
        annulus_core::board::changes::Fate,
        annulus_core::board::drawing::Layer,
        annulus_core::motion::profile::MotionLaw,
        annulus_core::proof::Cure,
        annulus_core::proof::FindingKind,
        wire::LengthKnown,
    ];
    let text = rows.iter().fold(String::new(), |mut text, (kind, words)| {
        let _ = writeln!(text, "{kind}: {}", words.join(" "));
        text
    });
    compare("words.txt", &text);
}

#[test]
fn journal_records_have_a_16_digit_digest() {
    let text = String::from_utf8(sealed(&Progress::default())).unwrap();
    assert_eq!(text, r#"8592db6dec0c6dbd{"done":0,"begun":0,"holes":0,"toolpaths":0}"#);
}
