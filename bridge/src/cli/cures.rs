//! Applies fixes for `annulus cam --fix-gaps`: first one change of the whole isolation, then gap by gap.
//!
//! ```text
//!   plan ─▶ proof ─┬─ gaps, and a smaller depth opens half of them or more ─▶ isolate with a smaller depth ─┐
//!     ▲            ├─ gaps ─▶ for each, the gentlest fix that was not tried there yet ──────────────────────┤
//!     │            └─ no gaps, or every fix tried ─▶ end                                                    │
//!     └─────────────────────────────────────────────────────────────────────────────────────────────────────┘
//! ```

use super::findings::cure_key;
use super::mm;
use annulus_core::board::Face;
use annulus_core::cam::work::{Isolate, Operation, OperationKind, Remedy, Work};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::proof::{self, Finding, FindingKind, Verdict};
use annulus_core::units::Length;
use annulus_core::warning;
use serde_json::{Value, json};

/// Maximum number of rounds of plan and proof. Gaps that are still closed then are reported.
const MOST_ROUNDS: usize = 12;
/// Findings about the same nets within this distance, in mm, are about the same gap.
const SAME_GAP_MM: f64 = 0.3;
/// Depths of fixes are multiples of this, so that similar gaps are cut together.
const STEP: Length = Length::from_um(5);
/// Minimum depth of a fix: surely through the copper.
const LEAST: Length =
    Length::from_nm(annulus_core::board::COPPER_THICKNESS.nm() + annulus_core::board::DEPTH_MARGIN.nm());

/// Fixes tried at one gap.
struct Tried {
    nets: Vec<String>,
    at: Point,
    /// Both sides of the gap whose fix is in the job.
    sides: (Point, Point),
    words: Vec<&'static str>,
}

/// State of the fixes of one side.
#[derive(Default)]
pub(super) struct Curing {
    rounds: usize,
    whole: Option<Length>,
    tried: Vec<Tried>,
}

impl Curing {
    /// Stores the next fixes for the gaps of `face` in `work`. Returns `true` if there were any.
    pub(super) fn go_on(&mut self, work: &mut Work, face: Face, verdict: &Verdict) -> bool {
        self.rounds += 1;
        if self.rounds > MOST_ROUNDS {
            return false;
        }
        if self.whole.is_none() && self.shallower(work, face, verdict) {
            return true;
        }
        let joined = verdict.findings.iter().filter(|finding| is_joined(finding));
        let changed: Vec<bool> = joined.map(|finding| self.gap(work, face, finding)).collect();
        changed.contains(&true)
    }

    /// Warning about gaps that stay closed after all fixes or rounds: their number and smallest width.
    pub(super) fn left(&self, verdict: &Verdict) -> Option<Diagnostic> {
        let joined = || verdict.findings.iter().filter(|finding| is_joined(finding));
        let narrowest = joined().map(|finding| finding.width).min().filter(|_| self.rounds > 0)?;
        let said = warning!("cam.cures_left", count = joined().count(), ..);
        let said = said.with("rounds", self.rounds.min(MOST_ROUNDS));
        Some(said.with("width", format!("{:.3}", narrowest.mm())))
    }

    /// JSON: the depth of the whole isolation, the number of gaps fixed one by one, and the rounds.
    pub(super) fn object(&self) -> Value {
        json!({ "depth_mm": self.whole.map(mm), "places": self.tried.len(), "rounds": self.rounds })
    }

    /// Reduces the isolation depth of `face` if that opens at least half of the gaps, and more than one.
    fn shallower(&mut self, work: &mut Work, face: Face, verdict: &Verdict) -> bool {
        let Some(whole) = &verdict.whole else { return false };
        let Some(offer) = whole.shallower.as_ref().filter(|offer| offer.opens > 1) else { return false };
        if 2 * offer.opens < whole.gaps {
            return false;
        }
        for operation in isolations(work, face).filter(|operation| operation.bit == offer.bit) {
            if operation.depth > offer.depth {
                operation.depth = offer.depth;
                self.whole = Some(offer.depth);
            }
        }
        self.whole.is_some()
    }

    /// Stores the gentlest untried fix of a gap in the first isolation.
    fn gap(&mut self, work: &mut Work, face: Face, finding: &Finding) -> bool {
        let Some(sides) = finding.ends else { return false };
        let near =
            |tried: &Tried| tried.nets == finding.nets && tried.at.distance_mm(finding.at) <= SAME_GAP_MM;
        let known = self.tried.iter().position(near);
        let words =
            known.and_then(|at| self.tried.get(at)).map(|tried| tried.words.as_slice()).unwrap_or_default();
        let bits = work.bits.clone();
        let usable = |cure: &&proof::Cure| match cure {
            proof::Cure::OtherBit { bit, .. } => bits.iter().any(|own| own.name == *bit),
            proof::Cure::Deeper { .. } => false,
            _ => true,
        };
        let next = finding.cures.iter().filter(usable).find(|cure| !words.contains(&cure_key(cure)));
        let Some((cure, isolate)) = next.zip(isolation(work, face)) else { return false };
        if let Some(tried) = known.and_then(|at| self.tried.get_mut(at)) {
            isolate.cures.retain(|other| (other.from, other.to) != tried.sides);
            tried.sides = sides;
            tried.words.push(cure_key(cure));
        } else {
            let nets = finding.nets.clone();
            self.tried.push(Tried { nets, at: finding.at, sides, words: vec![cure_key(cure)] });
        }
        isolate.cure(sides.0, sides.1, remedy(cure));
        true
    }
}

/// Returns `true` if nets are still joined.
fn is_joined(finding: &Finding) -> bool {
    matches!(finding.kind, FindingKind::Short | FindingKind::Gap)
}

fn remedy(cure: &proof::Cure) -> Remedy {
    match cure {
        proof::Cure::Shallower { depth, .. } | proof::Cure::Deeper { depth, .. } => {
            Remedy::Depth(Length::from_nm(depth.nm() - depth.nm() % STEP.nm()).max(LEAST.min(*depth)))
        }
        proof::Cure::OtherBit { bit, .. } => Remedy::Bit(bit.clone()),
        proof::Cure::Centred { .. } => Remedy::Centred,
    }
}

fn isolations(work: &mut Work, face: Face) -> impl Iterator<Item = &mut Operation> {
    work.operations.iter_mut().filter(move |operation| operation.isolates(face))
}

/// The first isolation of `face`.
fn isolation(work: &mut Work, face: Face) -> Option<&mut Isolate> {
    isolations(work, face).find_map(|operation| match &mut operation.action {
        OperationKind::Isolate(isolate) => Some(isolate),
        _ => None,
    })
}
