//! The proof of a program: which copper is left when it has run, and what that does to the nets.
//!
//! ```text
//!  programs ─ replay ─▶ cuts ─ strokes ─▶ what is cut away ─┐
//!  board ─ outline ─▶ blank ────────────────────────────────┴─ minus ─▶ copper left ─┬─ two nets in one piece: short, gap
//!  board ─ copper ─▶ islands and their nets ─────────────────────────────────────────┼─ a net in two pieces: break
//!                                                                                    ├─ thin or tiny pieces: sliver, fragment
//!  cuts over islands: lost copper · cuts not through: shallow · drills over islands: ring, hit
//! ```
//!
//! Comes in: a [`Board`] and its programs, in the same coordinates. Goes out: a [`Verdict`]: findings with place, width,
//! nets, a stable name and cures. Lengths in [`Length`], areas in mm². Does not know how the programs came about.

mod breaks;
mod cures;
mod cut_out;
mod deep;
mod drilled;
mod edges;
mod finding;
mod groups;
mod held;
mod isolated;
mod lost;
mod remnants;
mod repeated;
mod replay;
mod rings;
mod scene;
mod shorts;
mod slivers;
mod slots;
mod strokes;
mod unhurried;
mod whole;
mod written;

pub use cures::Cure;
pub use drilled::{DrillingProof, SideRun, drilled};
pub use finding::{Finding, FindingKind};
pub use groups::{Group, Pair, to_be_read};
pub use replay::{PathCut, ReplayedCuts, Still, replay};
pub use unhurried::unhurried;
pub use whole::{Shallower, Whole};
pub use written::differences;

use crate::board::{Board, COPPER_THICKNESS, DEPTH_MARGIN, Face, THINNEST};
use crate::geometry::{Point, Region};
use crate::job::{Bit, Cleared, Program, Promised};
use crate::units::Length;
use scene::Scene;

/// What a proof is measured against.
#[derive(Clone, Debug, PartialEq)]
pub struct ProofOptions {
    /// The side whose copper is looked at.
    pub face: Face,
    /// How thick the copper is: a cut that is less deep isolates nothing.
    pub copper_thickness: Length,
    /// How much deeper than the copper a cure has to go at least.
    pub depth_margin: Length,
    /// A cut may go this far into copper that must stay.
    pub tolerance: Length,
    /// Copper thinner than this may tear off.
    pub thinnest: Length,
    /// Loose pieces smaller than this, in mm², are told.
    pub smallest_mm2: f64,
    /// A drilled pad has at least this much copper all around its hole.
    pub ring: Length,
    /// How far copper that belongs to nothing must be away from the nets; none where it may touch them.
    pub clearance: Option<Length>,
    /// Whether the programs are to separate the nets at all; where nobody says, whether anything is milled among the copper.
    pub isolates: Option<bool>,
    /// What the job says it clears: copper left there is told.
    pub cleared: Vec<Cleared>,
    /// The bits that a person owns, for cures.
    pub owned: Vec<Bit>,
    /// Gaps, by their two sides, through whose middle a person had a pass made that is too wide for them: what that takes
    /// off the copper beside them is listed, and was agreed to.
    pub agreed: Vec<(Point, Point)>,
    /// Whether to measure the copper that is lost.
    pub measured: bool,
    /// At most this many findings of one cause are listed.
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
    /// What the programs of `face` are measured against that a job `promised`.
    pub fn of(face: Face, promised: Promised) -> Self {
        let Promised { owned, agreed, cleared, isolates } = promised;
        Self { face, owned, agreed, cleared, isolates, ..Self::default() }
    }
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// The worst first.
    pub findings: Vec<Finding>,
    /// How many more there are. What must be read of them is in the groups, see [`to_be_read`].
    pub more: u32,
    /// All of them by what they have in common, in the same order.
    pub groups: Vec<Group>,
    /// What a change of the whole job opens, where gaps are not open.
    pub whole: Option<Whole>,
    /// Islands of copper that shall stay.
    pub islands: u32,
    /// Nets that they belong to.
    pub nets: u32,
    /// Copper of nets that is taken away beside the holes and slots of the board, in mm², where it was asked for.
    pub lost_mm2: f64,
    /// The copper left, in connected pieces.
    pub left: Region,
}

/// Proves `programs`, run one after the other on `board`.
pub fn prove(board: &Board, programs: &[Program], options: &ProofOptions) -> Verdict {
    prove_telling(board, programs, options, &mut |_, _| {})
}

/// What looks for one kind of findings.
type Look = fn(&Scene<'_>) -> Vec<Finding>;

/// So many hundredths of a proof are done when it is known what stays joined.
const LOOKED_ACROSS: u64 = 88;

/// What is looked for once it is known what stays joined, each with how many hundredths of a proof are done before.
const LOOKS: [(u64, Look); 7] = [
    (LOOKED_ACROSS, breaks::breaks),
    (89, lost::lost),
    (94, lost::shallow),
    (95, slivers::slivers),
    (97, slivers::fragments),
    (98, rings::rings),
    (99, remnants::remnants),
];

/// The same; `progress` is told how much of the proof is done, and how much there is.
pub fn prove_telling(
    board: &Board,
    programs: &[Program],
    options: &ProofOptions,
    progress: &mut dyn FnMut(u64, u64),
) -> Verdict {
    let mut tell = |hundredths| progress(hundredths, 100);
    let Some(scene) = Scene::new(board, programs, options, &mut tell) else { return Verdict::default() };
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
        lost_mm2: if options.measured { lost::lost_mm2(&scene) } else { 0.0 },
        left: scene.left,
    }
}

#[cfg(test)]
mod tests;
