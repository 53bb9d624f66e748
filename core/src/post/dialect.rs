//! Dialects as plain TOML files: what a drilling program looks like for one controller (S6). Those that ship lie in
//! `dialects/`; a person can add others.
//!
//! Comes in: the text of a dialect file. Goes out: a [`Dialect`], or a remark with the line and column. Does not know
//! programs.

use super::names::{Field, PARAMETERS};
use super::template::{Fault, Template};
use crate::remark::{Remark, Weight};
use serde::Deserialize;
use toml::Spanned;

/// Most digits after the point: whole nanometres.
const MOST_DECIMALS: u32 = 6;

/// The words of one controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Dialect {
    /// Name for people.
    pub name: String,
    /// Extension of its files, without the dot.
    pub extension: String,
    /// Digits after the point in lengths.
    pub decimals: u32,
    /// Whether zeros at the end of lengths are written.
    pub trailing_zeros: bool,
    /// Added to X and Y, in mm.
    pub shift_mm: [f64; 2],
    /// The templates for drilling.
    pub drill: DrillTemplates,
}

/// The templates of a drilling program, one for each field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DrillTemplates([Template; 4]);

impl DrillTemplates {
    pub(super) fn of(&self, field: Field) -> &Template {
        &self.0[field as usize]
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    schema: u32,
    name: String,
    extension: String,
    decimals: u32,
    trailing_zeros: bool,
    #[serde(default)]
    shift_mm: [f64; 2],
    drill: WrittenDrill,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenDrill {
    start: Spanned<String>,
    change: Spanned<String>,
    hole: Spanned<String>,
    end: Spanned<String>,
}

/// The dialects that ship: the name on the command line, and the file.
pub fn shipped() -> impl Iterator<Item = (&'static str, &'static str)> {
    [("grbl", include_str!("dialects/grbl.toml"))].into_iter()
}

impl Dialect {
    /// Reads the dialect in `text`; `file` names it in remarks.
    pub fn parse(file: &str, text: &str) -> Result<Self, Remark> {
        let refuse = |why: &str, offset: usize| {
            let (line, column) = place(text, offset);
            Remark::new(Weight::Loss, "post.dialect_unreadable").with("why", why).at(file, line, column)
        };
        let written: Written = toml::from_str(text)
            .map_err(|error| refuse(error.message(), error.span().map_or(0, |span| span.start)))?;
        let plain = |c: char| c.is_ascii_alphanumeric();
        if written.schema != 1 {
            return Err(refuse("schema is not 1", 0));
        }
        if written.extension.is_empty() || !written.extension.chars().all(plain) {
            return Err(refuse("extension is not made of letters and digits", 0));
        }
        if written.decimals > MOST_DECIMALS
            || written.shift_mm.iter().any(|shift| !(-1e4..=1e4).contains(shift))
        {
            return Err(refuse("decimals go from 0 to 6 and shift_mm from -10000 to 10000", 0));
        }
        let drill = &written.drill;
        let template = |field: Field, spanned: &Spanned<String>| {
            let known =
                |name: &str| PARAMETERS.iter().any(|row| row.name == name && row.fields.contains(&field));
            Template::parse(spanned.get_ref(), known)
                .map_err(|(fault, at)| explain(file, text, field, spanned, &fault, at))
        };
        let templates = [
            template(Field::Start, &drill.start)?,
            template(Field::Change, &drill.change)?,
            template(Field::Hole, &drill.hole)?,
            template(Field::End, &drill.end)?,
        ];
        Ok(Self {
            name: written.name,
            extension: written.extension,
            decimals: written.decimals,
            trailing_zeros: written.trailing_zeros,
            shift_mm: written.shift_mm,
            drill: DrillTemplates(templates),
        })
    }
}

/// The remark for a fault at byte `at` of a template.
fn explain(
    file: &str,
    text: &str,
    field: Field,
    value: &Spanned<String>,
    fault: &Fault,
    at: usize,
) -> Remark {
    let span = value.span();
    let raw = text.get(span.clone()).unwrap_or_default();
    // A text in quotes of one or three signs; after three the first end of line does not count.
    let quotes = if raw.starts_with("\"\"\"") || raw.starts_with("'''") { 3 } else { 1 };
    let body = raw.get(quotes..).unwrap_or_default();
    let skipped = body.len() - body.strip_prefix("\r\n").or(body.strip_prefix('\n')).unwrap_or(body).len();
    let verbatim = value.get_ref().get(..at).is_some_and(|before| body[skipped..].starts_with(before));
    let offset = if verbatim { span.start + quotes + skipped + at } else { span.start };
    let (line, column) = place(text, offset);
    let known: Vec<String> = PARAMETERS
        .iter()
        .filter(|row| row.fields.contains(&field))
        .map(|row| format!("@{}@", row.name))
        .collect();
    let remark = match fault {
        Fault::Unknown(name) => Remark::new(Weight::Loss, "post.unknown_parameter").with("name", name),
        Fault::Unclosed => Remark::new(Weight::Loss, "post.unclosed_parameter"),
    };
    remark.with("field", field.key()).with("known", known.join(" ")).at(file, line, column)
}

/// Line and column, from 1, of byte `offset`.
fn place(text: &str, offset: usize) -> (u32, u32) {
    let before = text.get(..offset).unwrap_or_default();
    let line = before.matches('\n').count() + 1;
    let column = before.len() - before.rfind('\n').map_or(0, |end| end + 1) + 1;
    (line as u32, column as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "schema = 1\nname = \"x\"\nextension = \"nc\"\ndecimals = 3\ntrailing_zeros = true\n";

    #[test]
    fn what_ships_can_be_read() {
        for (name, text) in shipped() {
            assert!(Dialect::parse(name, text).is_ok(), "{:?}", Dialect::parse(name, text));
        }
    }

    #[test]
    fn a_fault_is_told_with_its_place() {
        // the four templates as written, code, line, column
        let rows = [
            ("start = \"\"\nchange = \"\"\nhole = \"@Q@\"\nend = \"\"\n", "post.unknown_parameter", 9, 9),
            (
                "start = \"\"\nchange = \"\"\nhole = '''\nG0\n X@X@ @AX@\n'''\nend = \"\"\n",
                "post.unknown_parameter",
                11,
                7,
            ),
            (
                "start = \"G0 X@X@\"\nchange = \"\"\nhole = \"\"\nend = \"\"\n",
                "post.unknown_parameter",
                7,
                14,
            ),
            ("start = \"\"\nchange = \"@T\"\nhole = \"\"\nend = \"\"\n", "post.unclosed_parameter", 8, 11),
            ("start = \"a\\n@Q@\"\nchange = \"\"\nhole = \"\"\nend = \"\"\n", "post.unknown_parameter", 7, 9),
            ("start = \"\"\nchange = \"\"\nend = \"\"\n", "post.dialect_unreadable", 6, 1),
            (
                "start = \"\"\nwobble = 1\nchange = \"\"\nhole = \"\"\nend = \"\"\n",
                "post.dialect_unreadable",
                8,
                1,
            ),
        ];
        for (drill, code, line, column) in rows {
            let remark = Dialect::parse("my.toml", &format!("{HEAD}[drill]\n{drill}")).unwrap_err();
            let place = remark.place.clone().unwrap();
            assert_eq!((remark.code.as_str(), place.line, place.column), (code, line, column), "{drill}");
        }
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        let drill = "[drill]\nstart = \"\"\nchange = \"\"\nhole = \"\"\nend = \"\"\n";
        assert!(Dialect::parse("my.toml", &format!("{HEAD}{drill}")).is_ok());
        let rows = [("decimals = 3", "decimals = 7"), ("schema = 1", "schema = 2"), ("\"nc\"", "\"../nc\"")];
        for (from, to) in rows {
            let text = format!("{HEAD}{drill}").replace(from, to);
            assert_eq!(Dialect::parse("my.toml", &text).unwrap_err().code, "post.dialect_unreadable", "{to}");
        }
    }
}
