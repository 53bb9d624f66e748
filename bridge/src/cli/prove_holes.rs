//! Proves holes, slots and the edge of a board for `annulus prove`.

use super::prove_files::Laid;
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::geometry::Point;
use annulus_core::job::Asked;
use annulus_core::proof::{self, DrillingProof, SideRun};
use annulus_core::{code, error, note};
use serde_json::{Value, json};

/// Maximum number of listed positions.
const NAMED: usize = 5;

/// What the programs do to the copper of their sides.
#[derive(Clone, Copy)]
pub(super) struct OfCopper {
    /// They separate nets on at least one side, or should.
    pub(super) isolates: bool,
    /// Nets on at least one side are not separated by anything.
    pub(super) stays: bool,
    /// A job defines the requirements.
    pub(super) planned: bool,
}

/// Result of the proof beyond the copper.
pub(super) struct Done {
    drilled: DrillingProof,
    diagnostics: Vec<Diagnostic>,
}

impl Done {
    /// Compares the drilling with `asked`. `copper` is what the programs do to the copper.
    pub(super) fn of(sides: &[Laid], asked: &Asked, copper: OfCopper) -> Self {
        let side = |laid| {
            let Laid { board, programs, pins, .. }: &Laid = laid;
            SideRun { board, programs, pins: pins.clone() }
        };
        let sides: Vec<SideRun<'_>> = sides.iter().map(side).collect();
        let drilled = proof::drilled(&sides, asked);
        let mut diagnostics = told(&drilled);
        if drilled.edges_cut > 0 && copper.stays && !copper.planned {
            diagnostics.push(error!("prove.not_isolated"));
        }
        if let Some((at, distance)) = drilled.outside {
            let why = error!("prove.outside_board", x = format!("{:.2}", at.x.mm()), ..);
            let why = why.with("y", format!("{:.2}", at.y.mm()));
            diagnostics.push(why.with("distance", format!("{:.2}", distance.mm())));
        }
        let nothing = !copper.isolates && drilled.made == 0 && drilled.edges_cut == 0;
        let nothing = if copper.planned { !drilled.cuts } else { nothing };
        if nothing && diagnostics.iter().all(|told| told.severity == Severity::Note) {
            diagnostics.push(error!("prove.makes_nothing"));
        }
        Self { drilled, diagnostics }
    }

    pub(super) fn diagnostics(&self) -> impl Iterator<Item = Diagnostic> {
        self.diagnostics.iter().cloned()
    }

    /// Number of messages whose code was not accepted.
    pub(super) fn unread(&self, accept: &[String]) -> usize {
        let open = |told: &&Diagnostic| told.severity > Severity::Note && !accept.contains(&told.code);
        self.diagnostics.iter().filter(open).count()
    }

    /// Fields of the report.
    pub(super) fn object(&self) -> Value {
        let done = &self.drilled;
        json!({
            "drilled": {
                "missing": done.missing.len(),
                "doubled": done.doubled.len(),
                "shifted": done.shifted.len(),
                "wrong_size": done.wrong_size.len(),
                "shallow": done.shallow.len(),
                "slots_missing": done.slots_missing.len(),
            },
            "cut_out": {
                "missing": done.edges_missing.len(),
                "cut": done.edges_cut,
                "into_board": done.bitten.len(),
                "inner_missing": done.inner_missing.len(),
                "tabs_missing": done.tabs_missing.len(),
                "loose": done.loose.len(),
            },
            "left": {
                "holes": done.holes_left.len(),
                "slots": done.slots_left.len(),
                "edges": done.edges_left.len(),
            },
            "toolpaths_repeated": done.repeated,
        })
    }
}

/// One message for each kind of fault.
fn told(drilled: &DrillingProof) -> Vec<Diagnostic> {
    let rows: [(&str, &[Point]); 10] = [
        (code!("prove.missing"), &drilled.missing),
        (code!("prove.doubled"), &drilled.doubled),
        (code!("prove.shifted"), &drilled.shifted),
        (code!("prove.wrong_size"), &drilled.wrong_size),
        (code!("prove.shallow"), &drilled.shallow),
        (code!("prove.slots_missing"), &drilled.slots_missing),
        (code!("prove.edge_missing"), &drilled.edges_missing),
        (code!("prove.into_board"), &drilled.bitten),
        (code!("prove.inner_missing"), &drilled.inner_missing),
        (code!("prove.tabs_missing"), &drilled.tabs_missing),
    ];
    let left: [(&str, &[Point]); 3] = [
        (code!("prove.holes_left"), &drilled.holes_left),
        (code!("prove.slots_left"), &drilled.slots_left),
        (code!("prove.edge_left"), &drilled.edges_left),
    ];
    let listed = |severity: Severity, (code, places): (&str, &[Point])| {
        let named = places.iter().take(NAMED).map(|at| format!("X {:.2} Y {:.2}", at.x.mm(), at.y.mm()));
        let mut named: Vec<String> = named.collect();
        if places.len() > NAMED {
            named.push("…".to_owned());
        }
        let told =
            || Diagnostic::new(severity, code).with("count", places.len()).with("places", named.join(", "));
        (!places.is_empty()).then(told)
    };
    let found = rows.into_iter().filter_map(|row| listed(Severity::Error, row));
    let left = left.into_iter().filter_map(|row| listed(Severity::Note, row));
    let repeated = (drilled.repeated > 0).then(|| error!("prove.repeated", count = drilled.repeated));
    // A board without planned tabs is held in another way: a note, which needs no acceptance.
    let loose = (!drilled.loose.is_empty()).then(|| note!("prove.loose", count = drilled.loose.len()));
    found.chain(repeated).chain(loose).chain(left).collect()
}
