//! Files of expected numbers, recomputed: every case from its inputs alone, compared within the tolerance of its file.
//!
//! Comes in: the text of a file in one of the known schemas. Goes out: a [`Report`]: per case how many values were
//! compared and which is farthest off, or a diagnostic with the place of what cannot be read. Does not know files or exit
//! codes.
//!
//! ```text
//!  text ─ document ─▶ values with places ─ one module a schema ─▶ tallies, one a case
//!                                            │ inputs ─▶ core (profiles, automaton, cycles, servo) ─▶ found
//!                                            └ expected ─────────────────────────────────────────────▶ found − expected
//! ```

mod automaton;
mod document;
mod fuzzy;
mod profiles;
mod tally;
mod throughput;
mod timeline;

pub(crate) use tally::Tally;

use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Dynamics;
use document::{Document, Node};

/// Largest file that is read, bytes.
pub(crate) const MOST_BYTES: u64 = 16 << 20;
/// Samples and interrupts that are computed for one file at most.
const MOST_WORK: u64 = 20_000_000;
/// Tolerances above this are not believed.
const LOOSEST: f64 = 0.01;

/// Checks the cases of a file.
type Checker = fn(&mut Checked, Node<'_>) -> Result<(), Diagnostic>;

/// The schemas there are. One more is one more line here and its module.
const SCHEMAS: &[(&str, Checker)] = &[
    ("step-automaton/1", automaton::step_automaton),
    ("trapezoid-scurve/1", profiles::trapezoid_scurve),
    ("fuzzy-pid/1", fuzzy::fuzzy_pid),
    ("power11/1", profiles::power11),
    ("xyz-timeline/1", timeline::xyz_timeline),
    ("oracle-durations/1", profiles::oracle),
    ("throughput/1", throughput::throughput),
];

/// What a file's cases came to.
#[derive(Debug)]
pub(crate) struct Report {
    /// Its schema.
    pub(crate) schema: &'static str,
    /// Its cases, in the file's order.
    pub(crate) cases: Vec<Tally>,
}

impl Report {
    /// How many cases are within tolerance.
    pub(crate) fn within(&self) -> usize {
        self.cases.iter().filter(|case| case.is_within()).count()
    }
}

/// A file under check: its cases so far, and how much may still be computed for it.
#[derive(Debug)]
pub(crate) struct Checked {
    cases: Vec<Tally>,
    work_left: u64,
}

impl Checked {
    /// Takes `work` samples from what may be computed.
    fn spend(&mut self, work: u64, at: &Node<'_>) -> Result<(), Diagnostic> {
        let left = self.work_left.checked_sub(work);
        self.work_left = left.ok_or_else(|| at.refuse("lab.too_much_work").with("most", MOST_WORK))?;
        Ok(())
    }

    /// A case is done. One without any expected value proves nothing and is refused.
    fn done(&mut self, tally: Tally, at: &Node<'_>) -> Result<(), Diagnostic> {
        if tally.values == 0 {
            return Err(at.refuse("lab.nothing_expected"));
        }
        self.cases.push(tally);
        Ok(())
    }
}

/// Recomputes every case of the file `name` with this text.
pub(crate) fn check(name: &str, text: &str) -> Result<Report, Diagnostic> {
    let document = Document::parse(name, text)?;
    let root = document.root();
    let schema = root.get("schema")?;
    let word = schema.text()?;
    let Some((schema, checker)) = SCHEMAS.iter().find(|(known, _)| *known == word) else {
        let known: Vec<_> = SCHEMAS.iter().map(|(known, _)| *known).collect();
        return Err(schema.refuse("lab.schema").with("found", word).with("known", known.join(", ")));
    };
    let mut checked = Checked { cases: Vec::new(), work_left: MOST_WORK };
    checker(&mut checked, root)?;
    if checked.cases.is_empty() {
        return Err(document.root().refuse("lab.nothing_expected"));
    }
    if let Some(member) = document.unknown() {
        return Err(member.refuse("lab.unknown_key"));
    }
    Ok(Report { schema, cases: checked.cases })
}

/// The table of dynamics in a JSON file: an object with `period`, `enter` and `leave`.
pub(crate) fn dynamics_file(name: &str, text: &str) -> Result<Dynamics, Diagnostic> {
    let document = Document::parse(name, text)?;
    automaton::dynamics(&document.root())
}

/// The tolerance `name` of the file, or `usual` where it says none.
fn tolerance(root: &Node<'_>, name: &str, usual: f64) -> Result<f64, Diagnostic> {
    let Some(said) = root.find("tolerance").and_then(|all| all.find(name)) else { return Ok(usual) };
    let value = said.number()?;
    if value > 0.0 && value <= LOOSEST {
        return Ok(value);
    }
    Err(said.refuse("lab.bad_tolerance").with("found", value).with("most", LOOSEST))
}

/// A diagnostic of the core, at the place of the inputs that it refused.
fn at<'a, T>(node: &'a Node<'_>) -> impl Fn(Diagnostic) -> Result<T, Diagnostic> + 'a {
    |why| Err(node.place(why))
}

/// An error.
fn error(code: &str) -> Diagnostic {
    Diagnostic::error(code)
}

#[cfg(test)]
mod tests;
