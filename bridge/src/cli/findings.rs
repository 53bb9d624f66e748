//! Prints the problems of a proof: for scripts one by one and in groups, for people in groups.

use super::{mm, sentence, verbosity};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::proof::{
    Cure, Finding, FindingKind, Group, Pair, ProofResult, Shallower, Whole, to_be_read,
};
use annulus_core::units::Length;
use serde::{Serialize, Serializer};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;

/// Maximum number of problems shown per group as text without `--verbose`.
const SHOWN: usize = 12;

/// Returns `true` if a problem was accepted by its name, its code or the last word of its code.
fn accepted(kind: FindingKind, id: &str, accept: &[String]) -> bool {
    let code = kind.code();
    let last = code.rsplit('.').next().unwrap_or(code);
    accept.iter().any(|word| word == id || word == code || word == last)
}

/// Number of problems that must be accepted and are not, listed or not.
pub(super) fn unread(groups: &[Group], accept: &[String]) -> usize {
    to_be_read(groups).filter(|(kind, id)| !accepted(*kind, id, accept)).count()
}

/// Kinds with at least one accepted problem.
pub(super) fn kinds_accepted(groups: &[Group], accept: &[String]) -> BTreeSet<&'static str> {
    to_be_read(groups).filter(|(kind, id)| accepted(*kind, id, accept)).map(|(kind, _)| kind.code()).collect()
}

/// A problem.
#[derive(Serialize)]
pub(super) struct FindingReport {
    id: String,
    kind: FindingKind,
    code: &'static str,
    severity: Severity,
    agreed: bool,
    x_mm: f64,
    y_mm: f64,
    width_mm: f64,
    tool_mm: Option<f64>,
    nets: Vec<String>,
    program: Option<u32>,
    leg: Option<u32>,
    cures: Vec<CureReport>,
    accepted: bool,
    unread: bool,
    message: String,
    advice: String,
    #[serde(skip)]
    must_be_read: bool,
    /// The side, if every side has its own report.
    #[serde(skip_serializing_if = "Option::is_none")]
    face: Option<&'static str>,
}

impl FindingReport {
    pub(super) fn of(finding: &Finding, accept: &[String], face: Option<&'static str>) -> Self {
        let (why, accepted) = (finding.diagnostic(), accepted(finding.kind, &finding.id, accept));
        Self {
            id: finding.id.clone(),
            kind: finding.kind,
            code: finding.kind.code(),
            severity: why.severity,
            agreed: finding.agreed,
            x_mm: mm(finding.at.x),
            y_mm: mm(finding.at.y),
            width_mm: mm(finding.width),
            tool_mm: finding.tool.map(mm),
            nets: finding.nets.clone(),
            program: finding.leg.map(|(program, _)| program),
            leg: finding.leg.map(|(_, leg)| leg),
            cures: finding.cures.iter().map(CureReport::of).collect(),
            accepted,
            unread: finding.must_be_read() && !accepted,
            message: why.message("en"),
            advice: why.advice("en"),
            must_be_read: finding.must_be_read(),
            face,
        }
    }

    /// The problem as part of its group, with its fixes.
    fn lines(&self) -> String {
        let read = if self.unread { "-" } else { "✓" };
        let head = format!("  {read} {} {}\n", self.id, self.message);
        self.cures.iter().fold(head, |out, cure| out + &format!("      {}\n", cure.message))
    }
}

/// A fix.
#[derive(Serialize)]
struct CureReport {
    cure: &'static str,
    bit: String,
    depth_mm: f64,
    width_mm: f64,
    lost_mm: Option<f64>,
    message: String,
}

impl CureReport {
    fn of(cure: &Cure) -> Self {
        let (Cure::Shallower { bit, depth, width }
        | Cure::OtherBit { bit, depth, width, .. }
        | Cure::Centred { bit, depth, width, .. }
        | Cure::Deeper { bit, depth, width }) = cure;
        let lost = if let Cure::Centred { lost, .. } = cure { Some(*lost) } else { None };
        let text = |length: Length| format!("{:.3}", length.mm());
        let lost_text = lost.map(text).unwrap_or_default();
        let message = sentence(
            &format!("proof.cure.{}", cure_key(cure)),
            &[("bit", bit), ("depth", &text(*depth)), ("width", &text(*width)), ("lost", &lost_text)],
        );
        let (depth_mm, width_mm, lost_mm) = (mm(*depth), mm(*width), lost.map(mm));
        Self { cure: cure_key(cure), bit: bit.clone(), depth_mm, width_mm, lost_mm, message }
    }
}

pub(super) fn cure_key(cure: &Cure) -> &'static str {
    match cure {
        Cure::Shallower { .. } => "shallower",
        Cure::OtherBit { .. } => "other_bit",
        Cure::Centred { .. } => "centred",
        Cure::Deeper { .. } => "deeper",
    }
}

/// Problems of one cause.
#[derive(Serialize)]
pub(super) struct GroupReport {
    kind: FindingKind,
    code: &'static str,
    severity: Severity,
    count: u32,
    pub(super) unread: usize,
    tool_mm: Option<f64>,
    width_min_mm: f64,
    width_max_mm: f64,
    message: String,
    advice: String,
    pairs: Vec<PairReport>,
    #[serde(skip)]
    must_be_read: bool,
}

/// The problems of a pair of nets.
#[derive(Serialize)]
struct PairReport {
    nets: Vec<String>,
    width_min_mm: f64,
    ids: Vec<String>,
}

impl GroupReport {
    pub(super) fn of(group: &Group, accept: &[String]) -> Self {
        let why = group.diagnostic();
        let pair = |Pair { nets, least, ids }: &Pair| PairReport {
            nets: nets.clone(),
            width_min_mm: mm(*least),
            ids: ids.clone(),
        };
        Self {
            kind: group.kind,
            code: group.kind.code(),
            severity: why.severity,
            count: group.count,
            unread: unread(std::slice::from_ref(group), accept),
            tool_mm: group.tool.map(mm),
            width_min_mm: mm(group.least),
            width_max_mm: mm(group.most),
            message: why.message("en"),
            advice: why.advice("en"),
            pairs: group.pairs.iter().map(pair).collect(),
            must_be_read: group.must_be_read,
        }
    }

    /// The group with its first problems out of `findings`, and the names to accept them by.
    fn lines(&self, findings: &[FindingReport]) -> String {
        let sign = if self.unread > 0 { "!" } else { "✓" };
        let mut out = format!("{sign} {} {} ({})\n", self.message, self.advice, self.code);
        let members = findings.iter().filter(|finding| finding.must_be_read == self.must_be_read);
        let by_id: BTreeMap<&str, _> = members.map(|finding| (finding.id.as_str(), finding)).collect();
        let ids = self.pairs.iter().flat_map(|pair| &pair.ids);
        let most = if verbosity::is_verbose() { usize::MAX } else { SHOWN };
        let listed = ids.filter_map(|id| by_id.get(id.as_str())).take(most);
        out.extend(listed.map(|finding| finding.lines()));
        let more = (self.count as usize).saturating_sub(most);
        if more > 0 {
            out += &format!("    {}\n", sentence("proof.report.more", &[("count", &more)]));
        }
        out
    }
}

/// Problems as text, grouped.
pub(super) fn finding_lines(groups: &[GroupReport], findings: &[FindingReport]) -> String {
    groups.iter().map(|group| group.lines(findings)).collect()
}

/// The result of a proof as a sentence. `unread` is the number of problems that are not accepted.
pub(super) fn outcome_line(outcome: &ProofResult, unread: usize) -> String {
    let (key, words) = outcome.sentence(unread);
    let words: Vec<_> = words.iter().map(|(name, value)| (*name, value as &dyn Display)).collect();
    sentence(key, &words) + "\n"
}

/// The result of a proof, as a field of a report.
pub(super) fn as_outcome<S: Serializer>(outcome: &ProofResult, to: S) -> Result<S::Ok, S::Error> {
    let gap = outcome.smallest_gap.map(mm);
    let object = json!({ "isolates": outcome.isolates, "nets": outcome.nets, "isolated": outcome.isolated,
        "smallest_gap_mm": gap });
    object.serialize(to)
}

/// What a change of the whole job opens, as a field of a report.
pub(super) fn as_whole<S: Serializer>(whole: &Option<Whole>, to: S) -> Result<S::Ok, S::Error> {
    let shallower = |Shallower { bit, depth, width, opens }: &Shallower| json!({ "bit": bit, "depth_mm": mm(*depth), "width_mm": mm(*width), "opens": opens });
    let object = |whole: &Whole| {
        let said = whole.diagnostics();
        json!({
            "gaps": whole.gaps,
            "shallower": whole.shallower.as_ref().map(shallower),
            "rest": whole.rest,
            "tip_mm": whole.tip.map(mm),
            "tip_opens": whole.tip_opens,
            "messages": said.iter().map(|why| why.message("en")).collect::<Vec<_>>(),
        })
    };
    whole.as_ref().map(object).serialize(to)
}

/// What a change of the whole job opens, as text.
pub(super) fn whole_lines(whole: Option<&Whole>) -> String {
    let line = |why: &Diagnostic| format!("→ {} {}\n", why.message("en"), why.advice("en"));
    whole.map(Whole::diagnostics).unwrap_or_default().iter().map(line).collect()
}
