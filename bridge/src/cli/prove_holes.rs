//! What programs do to holes, slots and the edge of a board, as `annulus prove` tells it (N8, C6).
//!
//! Comes in: the sides as they lie, what the job asks. Goes out: sentences and rows of an object. Does not look at copper.

use super::prove_files::Laid;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::geometry::Point;
use annulus_core::job::Asked;
use annulus_core::proof::{self, DrillingProof, SideRun};
use serde_json::{Value, json};

/// Places that are named.
const NAMED: usize = 5;

/// What was done beyond the copper.
pub(super) struct Done {
    drilled: DrillingProof,
    diagnostics: Vec<Diagnostic>,
}

impl Done {
    /// Compares it with what is `asked`. A board that is cut out though nothing isolates its copper is told, unless `isolates`.
    pub(super) fn of(sides: &[Laid], asked: &Asked, isolates: bool) -> Self {
        let side = |laid| {
            let Laid { board, programs, pins, .. }: &Laid = laid;
            SideRun { board, programs, pins: pins.clone() }
        };
        let sides: Vec<SideRun<'_>> = sides.iter().map(side).collect();
        let drilled = proof::drilled(&sides, asked);
        let mut diagnostics = told(&drilled);
        if drilled.edges_cut > 0 && !isolates {
            diagnostics.push(Diagnostic::error("prove.not_isolated"));
        }
        Self { drilled, diagnostics }
    }

    pub(super) fn diagnostics(&self) -> impl Iterator<Item = Diagnostic> {
        self.diagnostics.iter().cloned()
    }

    /// How many of its sentences were not accepted by their code.
    pub(super) fn unread(&self, accept: &[String]) -> usize {
        let open = |told: &&Diagnostic| told.severity > Severity::Note && !accept.contains(&told.code);
        self.diagnostics.iter().filter(open).count()
    }

    /// Its rows of the answer.
    pub(super) fn rows(&self) -> [(String, Value); 3] {
        let DrillingProof { missing, doubled, shifted, wrong_size, shallow, slots_missing, .. } =
            &self.drilled;
        let holes = json!({
            "missing": missing.len(),
            "doubled": doubled.len(),
            "shifted": shifted.len(),
            "wrong_size": wrong_size.len(),
            "shallow": shallow.len(),
            "slots_missing": slots_missing.len(),
        });
        let DrillingProof {
            edges_missing,
            edges_cut,
            bitten,
            repeated,
            inner_missing,
            tabs_missing,
            loose,
            ..
        } = &self.drilled;
        let edge = json!({
            "missing": edges_missing.len(),
            "cut": edges_cut,
            "into_board": bitten.len(),
            "inner_missing": inner_missing.len(),
            "tabs_missing": tabs_missing.len(),
            "loose": loose.len(),
        });
        [
            ("drilled".to_owned(), holes),
            ("cut_out".to_owned(), edge),
            ("toolpaths_repeated".to_owned(), json!(repeated)),
        ]
    }
}

/// A sentence for every kind of fault.
fn told(drilled: &DrillingProof) -> Vec<Diagnostic> {
    let rows: [(&str, &[Point]); 10] = [
        ("prove.missing", &drilled.missing),
        ("prove.doubled", &drilled.doubled),
        ("prove.shifted", &drilled.shifted),
        ("prove.wrong_size", &drilled.wrong_size),
        ("prove.shallow", &drilled.shallow),
        ("prove.slots_missing", &drilled.slots_missing),
        ("prove.edge_missing", &drilled.edges_missing),
        ("prove.into_board", &drilled.bitten),
        ("prove.inner_missing", &drilled.inner_missing),
        ("prove.tabs_missing", &drilled.tabs_missing),
    ];
    let found = rows.into_iter().filter(|(_, places)| !places.is_empty()).map(|(code, places)| {
        let named = places.iter().take(NAMED).map(|at| format!("X {:.2} Y {:.2}", at.x.mm(), at.y.mm()));
        let named: Vec<String> = named.collect();
        Diagnostic::error(code).with("count", places.len()).with("places", named.join(", "))
    });
    let repeated =
        (drilled.repeated > 0).then(|| Diagnostic::error("prove.repeated").with("count", drilled.repeated));
    // Who plans no tabs holds the board otherwise: it is said, and nobody has to accept it.
    let loose = (!drilled.loose.is_empty())
        .then(|| Diagnostic::note("prove.loose").with("count", drilled.loose.len()));
    found.chain(repeated).chain(loose).collect()
}
