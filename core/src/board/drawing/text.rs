//! A drawing with its edits as text, for project files.
//!
//! ```text
//!  { "annulus_drawing": 1, "name": …, "things": { "1": { "node": {…} }, … }, "back": […], "on": […] }
//! ```
//!
//! Equal histories give equal texts.

use super::{Drawing, Edit, Entry, History, Id, MOST_THINGS};
use crate::diagnostic::Diagnostic;
use crate::{code, error};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;

const SCHEMA: u32 = 1;
/// Start of a drawing file, without spaces.
const HEAD: &[u8] = b"{\"annulus_drawing\"";
const LONGEST: usize = 256 << 20;

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Kept<'a> {
    annulus_drawing: u32,
    name: String,
    things: Cow<'a, BTreeMap<Id, Entry>>,
    /// Undo steps, the latest last.
    #[serde(default)]
    back: Cow<'a, [Edit]>,
    /// Redo steps.
    #[serde(default)]
    on: Cow<'a, [Edit]>,
}

/// True if `bytes` start like a drawing file.
pub fn is_one(bytes: &[u8]) -> bool {
    let letters = bytes.iter().filter(|byte| !byte.is_ascii_whitespace());
    letters.take(HEAD.len()).eq(HEAD)
}

/// Parses a drawing; `file` is its name in diagnostics.
pub fn read(file: &str, text: &str) -> Result<History, Diagnostic> {
    let refuse = |code: &str| Diagnostic::error(code).at(file, 0, 0);
    if text.len() > LONGEST {
        return Err(refuse(code!("drawing.too_many")).with("what", MOST_THINGS));
    }
    let version = |text: &str| {
        let value: serde_json::Value = serde_json::from_str(text).ok()?;
        value.get("annulus_drawing")?.as_u64()
    };
    let kept: Kept<'_> = match serde_json::from_str(text) {
        Ok(kept) => kept,
        Err(why) => {
            if let Some(found) = version(text).filter(|found| *found != u64::from(SCHEMA)) {
                return Err(refuse(code!("drawing.schema")).with("found", found).with("known", SCHEMA));
            }
            let damaged = error!("drawing.damaged", ..);
            let damaged = damaged.at(file, why.line() as u32, why.column() as u32);
            return Err(damaged.with("what", why));
        }
    };
    if kept.annulus_drawing != SCHEMA {
        return Err(refuse(code!("drawing.schema"))
            .with("found", kept.annulus_drawing)
            .with("known", SCHEMA));
    }
    let mut drawing = Drawing::default();
    let changes = kept.things.into_owned().into_iter().map(|(id, entry)| (id, Some(entry))).collect();
    drawing.apply(&Edit { name: Some(kept.name), changes }).map_err(|why| why.at(file, 0, 0))?;
    Ok(History::restored(drawing, kept.back.into_owned(), kept.on.into_owned()))
}

pub fn write(history: &History) -> String {
    let (back, on) = history.edits();
    let drawing = history.now();
    let kept = Kept {
        annulus_drawing: SCHEMA,
        name: drawing.name().to_owned(),
        things: Cow::Borrowed(&drawing.things),
        back: back.into(),
        on: on.into(),
    };
    // Can't fail: plain data with whole numbers.
    serde_json::to_string(&kept).unwrap_or_default()
}
