//! The comparison results of one case.

use super::document::Node;
use annulus_core::diagnostic::Diagnostic;
use serde::Serialize;
use serde_json::{Value, json};

#[derive(Debug)]
pub(crate) struct Tally {
    pub(crate) id: String,
    pub(crate) values: usize,
    pub(crate) worst: Option<Worst>,
}

/// A value that deviates.
#[derive(Debug, Serialize)]
pub(crate) struct Worst {
    /// Path of the expected value in the file.
    pub(crate) what: String,
    pub(crate) expected: Value,
    pub(crate) found: Value,
    /// Largest allowed deviation; `None` for words, counts and others that must be equal.
    pub(crate) tolerance: Option<f64>,
    /// Deviation over tolerance; infinite if none is allowed.
    #[serde(skip)]
    pub(crate) ratio: f64,
}

impl Tally {
    pub(super) fn new(id: impl Into<String>) -> Self {
        Self { id: id.into(), values: 0, worst: None }
    }

    /// The case in `node`, named by its member `id`, or else by its path.
    pub(super) fn of(node: &Node<'_>) -> Self {
        let id = node.find("id").and_then(|id| id.text().ok().map(str::to_owned));
        Self::new(id.unwrap_or_else(|| node.path()))
    }

    pub(crate) fn is_within(&self) -> bool {
        self.worst.as_ref().is_none_or(|worst| worst.ratio <= 1.0)
    }

    pub(super) fn number(
        &mut self,
        expected: &Node<'_>,
        found: f64,
        tolerance: f64,
    ) -> Result<(), Diagnostic> {
        let value = expected.number()?;
        let off = (found - value).abs();
        let ratio = if off == 0.0 {
            0.0
        } else if tolerance > 0.0 && off.is_finite() {
            off / tolerance
        } else {
            f64::INFINITY
        };
        self.count(expected, || [expected.value().clone(), json!(found)], Some(tolerance), ratio);
        Ok(())
    }

    pub(super) fn member(
        &mut self,
        expected: &Node<'_>,
        key: &str,
        found: f64,
        tolerance: f64,
    ) -> Result<(), Diagnostic> {
        expected.find(key).map_or(Ok(()), |node| self.number(&node, found, tolerance))
    }

    pub(super) fn relative(
        &mut self,
        expected: &Node<'_>,
        key: &str,
        found: f64,
        relative: f64,
    ) -> Result<(), Diagnostic> {
        let Some(node) = expected.find(key) else { return Ok(()) };
        let room = relative * node.number()?.abs();
        self.number(&node, found, room)
    }

    /// Compares values that must be equal: words, counts, booleans, null.
    pub(super) fn equal(&mut self, expected: &Node<'_>, found: impl Into<Value>) {
        let found = found.into();
        let same = match (expected.value(), &found) {
            // 3 and 3.0 are the same count.
            (Value::Number(one), Value::Number(other)) => one.as_f64() == other.as_f64(),
            (one, other) => one == other,
        };
        self.count(
            expected,
            || [expected.value().clone(), found],
            None,
            if same { 0.0 } else { f64::INFINITY },
        );
    }

    pub(super) fn equal_member(&mut self, expected: &Node<'_>, key: &str, found: impl Into<Value>) {
        if let Some(node) = expected.find(key) {
            self.equal(&node, found);
        }
    }

    pub(super) fn equal_count(&mut self, rows: &Node<'_>, expected: usize, found: usize) {
        let ratio = if expected == found { 0.0 } else { f64::INFINITY };
        self.count(rows, || [json!(expected), json!(found)], None, ratio);
    }

    fn count(
        &mut self,
        at: &Node<'_>,
        values: impl FnOnce() -> [Value; 2],
        tolerance: Option<f64>,
        ratio: f64,
    ) {
        self.values += 1;
        if ratio > self.worst.as_ref().map_or(0.0, |worst| worst.ratio) {
            let [expected, found] = values();
            self.worst = Some(Worst { what: at.path(), expected, found, tolerance, ratio });
        }
    }
}
