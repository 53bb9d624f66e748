//! Recomputes files of expected numbers: every case from its inputs alone, compared within the tolerance of
//! its file.
//!
//! ```text
//!  text ─ document ─▶ values with positions ─ one module per schema ─▶ tallies, one per case
//!                                            │ inputs ─▶ core (profiles, automaton, …) ─▶ found
//!                                            └ expected ────────────────────────────────▶ found − expected
//! ```

mod automaton;
mod document;
mod fuzzy;
mod profiles;
mod tally;
mod throughput;
mod timeline;

use annulus_core::code;
pub(crate) use tally::Tally;

use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Dynamics;
use document::{Document, Node};

pub(crate) const MOST_BYTES: u64 = 16 << 20;
const MOST_WORK: u64 = 20_000_000;
/// Largest accepted tolerance.
const LOOSEST: f64 = 0.01;

type Checker = fn(&mut Checked, Node<'_>) -> Result<(), Diagnostic>;

/// The schemas. A new one needs a line here and its module.
const SCHEMAS: &[(&str, Checker)] = &[
    ("step-automaton/1", automaton::step_automaton),
    ("trapezoid-scurve/1", profiles::trapezoid_scurve),
    ("fuzzy-pid/1", fuzzy::fuzzy_pid),
    ("power11/1", profiles::power11),
    ("xyz-timeline/1", timeline::xyz_timeline),
    ("oracle-durations/1", profiles::oracle),
    ("throughput/1", throughput::throughput),
];

#[derive(Debug)]
pub(crate) struct Report {
    pub(crate) schema: &'static str,
    /// In the file's order.
    pub(crate) cases: Vec<Tally>,
}

impl Report {
    pub(crate) fn within(&self) -> usize {
        self.cases.iter().filter(|case| case.is_within()).count()
    }
}

/// A file being checked: its finished cases, and how much may still be computed.
#[derive(Debug)]
pub(crate) struct Checked {
    cases: Vec<Tally>,
    work_left: u64,
}

impl Checked {
    fn spend(&mut self, work: u64, at: &Node<'_>) -> Result<(), Diagnostic> {
        let left = self.work_left.checked_sub(work);
        self.work_left = left.ok_or_else(|| at.refuse(code!("lab.too_much_work")).with("most", MOST_WORK))?;
        Ok(())
    }

    /// Adds a finished case. A case without an expected value proves nothing and is refused.
    fn done(&mut self, tally: Tally, at: &Node<'_>) -> Result<(), Diagnostic> {
        if tally.values == 0 {
            return Err(at.refuse(code!("lab.nothing_expected")));
        }
        self.cases.push(tally);
        Ok(())
    }
}

pub(crate) fn check(name: &str, text: &str) -> Result<Report, Diagnostic> {
    let document = Document::parse(name, text)?;
    let root = document.root();
    let schema = root.get("schema")?;
    let word = schema.text()?;
    let Some((schema, checker)) = SCHEMAS.iter().find(|(known, _)| *known == word) else {
        let known: Vec<_> = SCHEMAS.iter().map(|(known, _)| *known).collect();
        return Err(schema.refuse(code!("lab.schema")).with("found", word).with("known", known.join(", ")));
    };
    let mut checked = Checked { cases: Vec::new(), work_left: MOST_WORK };
    checker(&mut checked, root)?;
    if checked.cases.is_empty() {
        return Err(document.root().refuse(code!("lab.nothing_expected")));
    }
    if let Some(member) = document.unknown() {
        return Err(member.refuse(code!("lab.unknown_key")));
    }
    Ok(Report { schema, cases: checked.cases })
}

/// Reads a dynamics table from a JSON object with `period`, `enter` and `leave`.
pub(crate) fn dynamics_file(name: &str, text: &str) -> Result<Dynamics, Diagnostic> {
    let document = Document::parse(name, text)?;
    automaton::dynamics(&document.root())
}

/// The tolerance `name` of the file; `usual` if it has none.
fn tolerance(root: &Node<'_>, name: &str, usual: f64) -> Result<f64, Diagnostic> {
    let Some(said) = root.find("tolerance").and_then(|all| all.find(name)) else { return Ok(usual) };
    let value = said.number()?;
    if value > 0.0 && value <= LOOSEST {
        return Ok(value);
    }
    Err(said.refuse(code!("lab.bad_tolerance")).with("found", value).with("most", LOOSEST))
}

/// Adds the position of the refused inputs to a diagnostic of core.
fn at<'a, T>(node: &'a Node<'_>) -> impl Fn(Diagnostic) -> Result<T, Diagnostic> + 'a {
    |why| Err(node.place(why))
}

#[cfg(test)]
mod tests;
