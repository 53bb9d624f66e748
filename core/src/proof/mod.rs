//! Proof of a program: the copper left after it has run, and the effect on the nets.
//!
//! ```text
//!  programs ─ replay ─▶ cuts ─ strokes ─▶ removed ─┐
//!  board ─ outline ─▶ blank ───────────────────────┴─ minus ─▶ copper left ─┬─ nets in one piece: short, gap
//!  board ─ copper ─▶ islands and their nets ────────────────────────────────┼─ a net in two pieces: break
//!                                                                           └─ thin, tiny: sliver, fragment
//!  cuts over islands: lost copper · cuts not through: shallow · drills over islands: ring, hit
//! ```
//!
//! Lengths in [`Length`], areas in mm².

mod body;
mod breaks;
mod cures;
mod cut_out;
mod deep;
mod drilled;
mod edges;
mod extra;
mod finding;
mod groups;
mod held;
mod isolated;
mod lost;
mod memory;
mod outcome;
mod outside;
mod remnants;
mod repeated;
mod replay;
mod rings;
mod scene;
mod shorts;
mod sides;
mod slivers;
mod slots;
mod strokes;
mod unhurried;
mod whole;
mod written;

pub use drilled::drilled;
pub use finding::{Cure, Finding, FindingKind};
pub use groups::{Group, Pair, to_be_read};
pub use memory::{MOST_BYTES, too_large};
pub use outcome::{ProofResult, Proven};
pub use replay::{PathCut, ReplayedCuts, Still, replay};
pub use sides::{DrillingProof, SideRun};
pub use unhurried::unhurried;
pub use whole::{Shallower, Whole};
pub use written::differences;

use crate::board::{Board, COPPER_THICKNESS, DEPTH_MARGIN, Face, THINNEST};
use crate::geometry::{Point, Region};
use crate::job::{Bit, Cleared, Program, Promised};
use crate::units::Length;
use scene::Scene;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq)]
pub struct ProofOptions {
    /// The side to prove.
    pub face: Face,
    /// Thickness of the copper: a less deep cut isolates nothing.
    pub copper_thickness: Length,
    /// Minimum extra depth of a fix, beyond the copper.
    pub depth_margin: Length,
    /// A cut may go this far into copper that must stay.
    pub tolerance: Length,
    /// Copper thinner than this may tear off.
    pub thinnest: Length,
    pub smallest_mm2: f64,
    /// Minimum copper around the hole of a drilled pad.
    pub ring: Length,
    /// Minimum distance of loose copper from the nets; `None` if it may touch them.
    pub clearance: Option<Length>,
    /// Whether the programs must isolate the nets; `None`: if anything is milled among the copper.
    pub isolates: Option<bool>,
    /// Areas that the job clears: copper left there is reported.
    pub cleared: Vec<Cleared>,
    /// The user's tools, for fixes.
    pub owned: Vec<Bit>,
    /// Gaps, by their two sides, for which the user chose a centred pass that is too wide. Its losses are
    /// listed as agreed.
    pub agreed: Vec<(Point, Point)>,
    pub measured: bool,
    pub most: usize,
}

impl Default for ProofOptions {
    fn default() -> Self {
        Self {
            face: Face::Top,
            copper_thickness: COPPER_THICKNESS,
            depth_margin: DEPTH_MARGIN,
            tolerance: Length::from_um(5),
            thinnest: THINNEST,
            smallest_mm2: 0.01,
            ring: Length::from_um(50),
            clearance: None,
            isolates: Some(true),
            cleared: Vec::new(),
            owned: Vec::new(),
            agreed: Vec::new(),
            measured: false,
            most: 2_000,
        }
    }
}

impl ProofOptions {
    /// Requirements for `face` from what a job `promised`.
    pub fn of(face: Face, promised: Promised) -> Self {
        let Promised { owned, agreed, cleared, isolates } = promised;
        Self { face, owned, agreed, cleared, isolates, ..Self::default() }
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    pub findings: Vec<Finding>,
    /// Number of findings not listed. Those that must be read are in the groups, see [`to_be_read`].
    pub more: u32,
    /// All findings by cause, in the same order.
    pub groups: Vec<Group>,
    /// Effect of a change of the whole job, if gaps are uncut.
    pub whole: Option<Whole>,
    /// Number of islands that must stay.
    pub islands: u32,
    /// Number of their nets.
    pub nets: u32,
    /// Lost copper of nets outside holes and slots, in mm², if measured.
    pub lost_mm2: f64,
    pub outcome: ProofResult,
    /// The copper left, in connected pieces; not serialized.
    #[serde(skip)]
    pub left: Region,
}

/// Proves `programs`, run one after the other on `board`.
pub fn prove(board: &Board, programs: &[Program], options: &ProofOptions) -> Verdict {
    prove_telling(board, programs, options, &mut |_, _| {})
}

type Look = fn(&Scene<'_>) -> Vec<Finding>;

/// Percentage of a proof that is done when the connections are known.
const LOOKED_ACROSS: u64 = 88;

/// The searches after that, each with the percentage done before.
const LOOKS: [(u64, Look); 7] = [
    (LOOKED_ACROSS, breaks::breaks),
    (89, lost::lost),
    (94, lost::shallow),
    (95, slivers::slivers),
    (97, slivers::fragments),
    (98, rings::rings),
    (99, remnants::remnants),
];

/// As [`prove`]; calls `progress` with the share done and the total.
pub fn prove_telling(
    board: &Board,
    programs: &[Program],
    options: &ProofOptions,
    progress: &mut dyn FnMut(u64, u64),
) -> Verdict {
    let mut tell = |hundredths| progress(hundredths, 100);
    let Some(scene) = Scene::new(board, programs, options, &mut tell) else {
        return Verdict { outcome: ProofResult::nothing(board, options.face), ..Verdict::default() };
    };
    let mut findings = scene.without_bit();
    findings.extend(scene.still());
    tell(scene::MADE);
    match isolated::not_isolated(&scene) {
        Some(finding) => findings.push(finding),
        None => findings.extend(shorts::shorts(&scene, &mut |done, total| {
            tell(scene::MADE + (LOOKED_ACROSS - scene::MADE) * done / total.max(1));
        })),
    }
    for (before, look) in LOOKS {
        tell(before);
        findings.extend(look(&scene));
    }
    let findings = finding::merged(findings);
    let (groups, whole) = (groups::groups(&findings), whole::whole(&scene, &findings));
    let all = findings.len();
    let findings = groups::listed(findings, options.most);
    let more = (all - findings.len()) as u32;
    Verdict {
        findings,
        more,
        groups,
        whole,
        islands: scene.copper.islands.len() as u32,
        nets: scene.labels.len() as u32,
        outcome: ProofResult::of(&scene),
        lost_mm2: if options.measured { lost::lost_mm2(&scene) } else { 0.0 },
        left: scene.left,
    }
}

#[cfg(test)]
mod tests;
