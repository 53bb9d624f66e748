//! The job file: a [`Work`] as TOML, one table for the setup, one for every bit and every operation.
//!
//! ```text
//!  schema = 1
//!  [setup]                       omitted rows keep the values of the opened board
//!  [[bit]]                       any bit replaces all bits
//!  [[operation]]                 any operation replaces all operations;
//!  kind = "isolate"              omitted rows keep the defaults of the kind
//!  [[operation.cure]]
//! ```

pub mod anew;
pub mod saved;
pub mod text;

use crate::board::Face;
use crate::cam::parameters;
use crate::cam::work::{LocalIsolation, Operation, OperationKind, Remedy, Work};
use crate::diagnostic::{Diagnostic, nearest};
use crate::geometry::Point;
use crate::job::{Bit, Cutter};
use crate::locale;
use crate::machine::{Field, Value, ValueKind};
use crate::units::Length;
use crate::{code, error};
use std::fmt::Write as _;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Old name of `mill_holes`, in older job files.
const MILL_HOLES_ONCE: &str = "bore";

const SCHEMA: i64 = 1;
/// Allowed entries outside all tables.
const TOP: &[&str] = &["schema = 1", "[setup]", "[[bit]]", "[[operation]]"];
const CURE: &[&str] = &["from", "to", "bit", "depth", "with"];
/// Longest job file, in bytes.
pub const LONGEST: usize = 1 << 20;
const MOST: usize = 64;
const MOST_CURES: usize = 4_096;

/// Parses the job in `text`. Omitted values come from `base`. `file` is the file name for diagnostics.
pub fn read(file: &str, text: &str, base: &Work) -> Result<Work, Diagnostic> {
    if text.len() > LONGEST {
        return Err(error!("project.too_long", longest = LONGEST).at(file, 0, 0));
    }
    let reader = Reader { file, text };
    let document = DeTable::parse(text).map_err(|error| {
        let what = error.message().lines().next().unwrap_or_default().to_owned();
        let why = error!("project.syntax", what = what);
        reader.place(why, error.span().map_or(0, |span| span.start))
    })?;
    reader.work(document.get_ref(), base)
}

struct Reader<'a> {
    file: &'a str,
    text: &'a str,
}

type Table<'a> = DeTable<'a>;

impl Reader<'_> {
    fn place(&self, diagnostic: Diagnostic, at: usize) -> Diagnostic {
        let (line, column) = text::line_and_column(self.text.as_bytes(), at);
        diagnostic.at(self.file, line, column)
    }

    fn refuse<T>(&self, code: &str, key: &str, at: usize) -> Result<T, Diagnostic> {
        Err(self.place(Diagnostic::error(code).with("key", key), at))
    }

    fn unknown<T>(&self, key: &str, known: &[&str], at: usize) -> Result<T, Diagnostic> {
        let diagnostic = error!("project.unknown_row", key = key, ..);
        Err(self.place(diagnostic.with("nearest", nearest(key, known.iter().copied())), at))
    }

    fn work(&self, document: &Table<'_>, base: &Work) -> Result<Work, Diagnostic> {
        let mut work = base.clone();
        let mut schema = None;
        for (name, value) in document {
            match (name.get_ref().as_ref(), value.get_ref()) {
                ("schema", DeValue::Integer(number)) => schema = number.as_str().parse::<i64>().ok(),
                ("setup", DeValue::Table(rows)) => {
                    self.rows(rows, parameters::SETUP, &[], &mut work.setup)?;
                }
                ("bit", DeValue::Array(tables)) => {
                    work.bits = self.several(tables, MOST, "bit", |rows, at| self.bit(rows, at))?;
                }
                ("operation", DeValue::Array(tables)) => {
                    work.operations =
                        self.several(tables, MOST, "operation", |rows, at| self.operation(rows, at))?;
                }
                (other, _) => return self.unknown(other, TOP, name.span().start),
            }
        }
        if schema != Some(SCHEMA) {
            let found = schema.map_or_else(|| "none".to_owned(), |number| number.to_string());
            let why = error!("project.schema", found = found, known = SCHEMA);
            return Err(self.place(why, 0));
        }
        self.names(document, &work)?;
        Ok(work)
    }

    fn several<T>(
        &self,
        tables: &[Spanned<DeValue<'_>>],
        most: usize,
        name: &str,
        mut read: impl FnMut(&Table<'_>, usize) -> Result<T, Diagnostic>,
    ) -> Result<Vec<T>, Diagnostic> {
        let mut found = Vec::new();
        for table in tables {
            let at = table.span().start;
            match table.get_ref() {
                DeValue::Table(_) if found.len() == most => {
                    let why = error!("project.too_many", ..);
                    return Err(self.place(why.with("key", name).with("most", most), at));
                }
                DeValue::Table(rows) => found.push(read(rows, at)?),
                _ => return self.unknown(name, TOP, at),
            }
        }
        Ok(found)
    }

    /// Applies the rows of a table to `of`. Rows named in `others` are left to the caller.
    fn rows<T>(
        &self,
        rows: &Table<'_>,
        table: &'static [Field<T>],
        others: &[&'static str],
        of: &mut T,
    ) -> Result<(), Diagnostic> {
        for (name, value) in rows {
            let name_text = name.get_ref().as_ref();
            if others.contains(&name_text) {
                continue;
            }
            let known = table.iter().find(|row| row.name() == name_text && row.belongs_to(of));
            let Some(row) = known else {
                let here = table.iter().filter(|row| row.belongs_to(of)).map(Field::name);
                let known: Vec<&str> = here.chain(others.iter().copied()).collect();
                return self.unknown(name_text, &known, name.span().start);
            };
            row.set(of, &text::value(value.get_ref())).map_err(|why| self.place(why, value.span().start))?;
        }
        Ok(())
    }

    fn bit(&self, rows: &Table<'_>, at: usize) -> Result<Bit, Diagnostic> {
        let mut bit = Bit {
            diameter: Length::from_mm(1.0),
            name: String::new(),
            cutter: Cutter::Mill,
            handling: Default::default(),
        };
        // The form decides whether tip and angle exist, so apply it first.
        let form = rows.iter().find(|(name, _)| name.get_ref() == "form");
        if let (Some((_, value)), Some(row)) = (form, parameters::find(parameters::BIT, "bit.form")) {
            row.set(&mut bit, &text::value(value.get_ref()))
                .map_err(|why| self.place(why, value.span().start))?;
        }
        self.rows(rows, parameters::BIT, &["form"], &mut bit)?;
        if bit.name.is_empty() {
            return self.refuse(code!("project.no_name"), "bit", at);
        }
        if let Cutter::Vee { tip, .. } = bit.cutter
            && tip > bit.diameter
        {
            return self.refuse(code!("project.tip_too_wide"), &bit.name, at);
        }
        Ok(bit)
    }

    fn operation(&self, rows: &Table<'_>, at: usize) -> Result<Operation, Diagnostic> {
        let kind = rows.iter().find(|(name, _)| name.get_ref() == "kind");
        let (word, word_at) = match kind.map(|(_, value)| (value.get_ref(), value.span().start)) {
            Some((DeValue::String(word), at)) if word == MILL_HOLES_ONCE => ("mill_holes", at),
            Some((DeValue::String(word), at)) => (word.as_ref(), at),
            Some((_, at)) => ("", at),
            None => ("", at),
        };
        let Some(mut operation) = Operation::usual(word, Face::Top) else {
            let why = error!("project.unknown_kind", ..);
            return Err(
                self.place(why.with("found", word).with("known", OperationKind::WORDS.join(", ")), word_at)
            );
        };
        let others = if matches!(operation.action, OperationKind::Isolate(_)) {
            &["kind", "cure"][..]
        } else {
            &["kind"]
        };
        self.rows(rows, parameters::OPERATION, others, &mut operation)?;
        let cures = rows.iter().find(|(name, _)| name.get_ref() == "cure");
        if let (OperationKind::Isolate(isolate), Some((name, value))) = (&mut operation.action, cures) {
            let DeValue::Array(tables) = value.get_ref() else {
                return self.unknown("cure", &["[[operation.cure]]"], name.span().start);
            };
            isolate.cures = self.several(tables, MOST_CURES, "cure", |rows, at| self.cure(rows, at))?;
        }
        Ok(operation)
    }

    fn cure(&self, rows: &Table<'_>, at: usize) -> Result<LocalIsolation, Diagnostic> {
        let (mut from, mut to, mut bit, mut depth, mut with) = (None, None, None, None, None);
        for (name, found) in rows {
            let value = text::value(found.get_ref());
            match (name.get_ref().as_ref(), value) {
                ("from", Value::Numbers(at)) => from = point(&at),
                ("to", Value::Numbers(at)) => to = point(&at),
                ("bit", Value::Text(name)) => bit = Some(name),
                ("depth", Value::Number(mm)) if (0.001..=30.0).contains(&mm) => {
                    depth = Some(Length::from_mm(mm));
                }
                ("with", Value::Text(word)) => with = Some(word),
                (other, _) => return self.unknown(other, CURE, name.span().start),
            }
        }
        let with = match (with.as_deref(), bit, depth) {
            (Some("bit"), Some(bit), None) => Some(Remedy::Bit(bit)),
            (Some("depth"), None, Some(depth)) => Some(Remedy::Depth(depth)),
            (Some("centred"), None, None) => Some(Remedy::Centred),
            _ => None,
        };
        match (from, to, with) {
            (Some(from), Some(to), Some(with)) => Ok(LocalIsolation { from, to, with }),
            _ => self.refuse(code!("project.bad_cure"), "cure", at),
        }
    }

    /// Checks that bit names are unique, and that every name used belongs to a bit.
    fn names(&self, document: &Table<'_>, work: &Work) -> Result<(), Diagnostic> {
        let at = |list: &str, index: usize| {
            let list =
                document.iter().find(|(name, _)| name.get_ref() == list).map(|(_, value)| value.get_ref());
            match list {
                Some(DeValue::Array(tables)) => tables.get(index).map_or(0, |table| table.span().start),
                _ => 0,
            }
        };
        for (index, bit) in work.bits.iter().enumerate() {
            if work.bits.iter().take(index).any(|other| other.name == bit.name) {
                return self.refuse(code!("project.name_twice"), &bit.name, at("bit", index));
            }
        }
        for (index, operation) in work.operations.iter().enumerate() {
            if let Some(missing) = operation.bit_names().into_iter().find(|name| work.bit(name).is_none()) {
                return self.refuse(code!("project.no_such_bit"), missing, at("operation", index));
            }
        }
        Ok(())
    }
}

fn point(at: &[f64]) -> Option<Point> {
    match at {
        [x, y] if x.abs() <= 2000.0 && y.abs() <= 2000.0 => Some(Point::from_mm(*x, *y)),
        _ => None,
    }
}

/// Writes the job file of `work`, with a comment above every row: description, range and unit.
pub fn write(work: &Work) -> String {
    let mut out = format!("# A job of Annulus. Missing lines have their default value.\nschema = {SCHEMA}\n");
    out += "\n[setup]\n";
    write_rows(&mut out, parameters::SETUP, &work.setup, true);
    for (index, bit) in work.bits.iter().enumerate() {
        out += "\n[[bit]]\n";
        write_rows(&mut out, parameters::BIT, bit, index == 0);
    }
    let mut described: Vec<&str> = Vec::new();
    for operation in &work.operations {
        let word = operation.action.word();
        let _ = write!(out, "\n[[operation]]\nkind = {}\n", text::literal(&Value::Text(word.to_owned())));
        write_rows(&mut out, parameters::OPERATION, operation, !described.contains(&word));
        described.push(word);
        operation.action.rules().cures.iter().for_each(|cure| write_cure(&mut out, cure));
    }
    out
}

fn write_rows<T>(out: &mut String, table: &[Field<T>], of: &T, explained: bool) {
    for row in table {
        if !row.belongs_to(of) {
            continue;
        }
        if explained {
            let _ = writeln!(out, "# {}", explain(row));
        }
        let _ = match row.get(of) {
            Some(value) => writeln!(out, "{} = {}", row.name(), text::literal(&value)),
            None => writeln!(out, "# {} = \"{}\"", row.name(), parameters::OF_MACHINE),
        };
    }
}

fn explain<T>(row: &Field<T>) -> String {
    let sentence = locale::text("en", &row.sentence_key(), &[]);
    let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
    match (row.kind, row.kind.range()) {
        (ValueKind::Choice(words), _) => format!("{sentence} One of: {}.", words.join(", ")),
        (_, Some((low, high))) => format!("{sentence} {low} … {high}{unit}."),
        _ => sentence,
    }
}

fn write_cure(out: &mut String, cure: &LocalIsolation) {
    let (x0, y0, x1, y1) = (cure.from.x.mm(), cure.from.y.mm(), cure.to.x.mm(), cure.to.y.mm());
    let _ = write!(out, "\n[[operation.cure]]\nfrom = [{x0}, {y0}]\nto = [{x1}, {y1}]\n");
    let _ = match &cure.with {
        Remedy::Bit(name) => {
            writeln!(out, "with = \"bit\"\nbit = {}", text::literal(&Value::Text(name.clone())))
        }
        Remedy::Depth(depth) => writeln!(out, "with = \"depth\"\ndepth = {}", depth.mm()),
        Remedy::Centred => writeln!(out, "with = \"centred\""),
    };
}

#[cfg(test)]
mod tests;
