//! Prints the problems of a proof: for scripts one by one and in groups, for people in groups.

use super::rounded;
use annulus_core::locale;
use annulus_core::proof::{Cure, Finding, FindingKind, Group, ProofResult, Shallower, Whole, to_be_read};
use annulus_core::units::Length;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Maximum number of problems shown per group as text.
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

/// Returns `true` if a problem must be accepted and is not.
fn is_unread(finding: &Finding, accept: &[String]) -> bool {
    finding.must_be_read() && !accepted(finding.kind, &finding.id, accept)
}

/// A problem as JSON.
pub(super) fn finding_object(finding: &Finding, accept: &[String]) -> Value {
    let diagnostic = finding.diagnostic();
    let mm = |length: Length| rounded(length.mm());
    json!({
        "id": finding.id,
        "kind": finding.kind,
        "code": diagnostic.code,
        "severity": diagnostic.severity,
        "agreed": finding.agreed,
        "x_mm": mm(finding.at.x),
        "y_mm": mm(finding.at.y),
        "width_mm": mm(finding.width),
        "tool_mm": finding.tool.map(mm),
        "nets": finding.nets,
        "program": finding.leg.map(|(program, _)| program),
        "leg": finding.leg.map(|(_, leg)| leg),
        "cures": finding.cures.iter().map(cure_object).collect::<Vec<_>>(),
        "accepted": accepted(finding.kind, &finding.id, accept),
        "unread": is_unread(finding, accept),
        "message": diagnostic.message("en"),
        "advice": diagnostic.advice("en"),
    })
}

/// A fix as JSON: kind, tool, depth, width, lost copper and its sentence.
fn cure_object(cure: &Cure) -> Value {
    let (key, bit, depth, width, lost) = match cure {
        Cure::Shallower { bit, depth, width } => ("shallower", bit, depth, width, None),
        Cure::OtherBit { bit, depth, width, .. } => ("other_bit", bit, depth, width, None),
        Cure::Centred { bit, depth, width, lost } => ("centred", bit, depth, width, Some(*lost)),
        Cure::Deeper { bit, depth, width } => ("deeper", bit, depth, width, None),
    };
    let text = |length: Length| format!("{:.3}", length.mm());
    let words = [
        ("bit", bit.clone()),
        ("depth", text(*depth)),
        ("width", text(*width)),
        ("lost", lost.map(text).unwrap_or_default()),
    ];
    let words = words.map(|(name, value)| (name.to_owned(), value));
    json!({
        "cure": key,
        "bit": bit,
        "depth_mm": rounded(depth.mm()),
        "width_mm": rounded(width.mm()),
        "lost_mm": lost.map(|lost| rounded(lost.mm())),
        "message": locale::text("en", &format!("proof.cure.{key}"), &words),
    })
}

/// Groups as JSON; their members are named by their nets.
pub(super) fn groups_object(groups: &[Group], accept: &[String]) -> Value {
    let mm = |length: Length| rounded(length.mm());
    let object = |group: &Group| {
        let diagnostic = group.diagnostic();
        let unread = unread(std::slice::from_ref(group), accept);
        let pair = |pair: &annulus_core::proof::Pair| json!({ "nets": pair.nets, "width_min_mm": mm(pair.least), "ids": pair.ids });
        json!({
            "kind": group.kind,
            "code": group.kind.code(),
            "severity": diagnostic.severity,
            "count": group.count,
            "unread": unread,
            "tool_mm": group.tool.map(mm),
            "width_min_mm": mm(group.least),
            "width_max_mm": mm(group.most),
            "message": diagnostic.message("en"),
            "advice": diagnostic.advice("en"),
            "pairs": group.pairs.iter().map(pair).collect::<Vec<_>>(),
        })
    };
    groups.iter().map(object).collect()
}

/// The listed problems of a group.
fn members<'f>(group: &Group, findings: &'f [Finding]) -> impl Iterator<Item = &'f Finding> {
    let cause = (group.kind, group.must_be_read, group.tool);
    findings.iter().filter(move |finding| finding.cause() == cause)
}

/// The result of a proof as a sentence. `unread` is the number of problems that are not accepted.
pub(super) fn outcome_line(outcome: &ProofResult, unread: usize) -> String {
    let (key, words) = outcome.sentence(unread);
    let words: Vec<_> = words.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    locale::text("en", key, &words) + "\n"
}

/// The result of a proof as JSON.
pub(super) fn outcome_object(outcome: &ProofResult) -> Value {
    json!({
        "isolates": outcome.isolates,
        "nets": outcome.nets,
        "isolated": outcome.isolated,
        "smallest_gap_mm": outcome.smallest_gap.map(|gap| rounded(gap.mm())),
    })
}

/// What a change of the whole job opens, as JSON.
pub(super) fn whole_object(whole: &Whole) -> Value {
    let mm = |length: Length| rounded(length.mm());
    let shallower = whole.shallower.as_ref().map(|Shallower { bit, depth, width, opens }| {
        json!({ "bit": bit, "depth_mm": mm(*depth), "width_mm": mm(*width), "opens": opens })
    });
    let said: Vec<String> = whole.diagnostics().iter().map(|diagnostic| diagnostic.message("en")).collect();
    json!({
        "gaps": whole.gaps,
        "shallower": shallower,
        "rest": whole.rest,
        "tip_mm": whole.tip.map(mm),
        "tip_opens": whole.tip_opens,
        "messages": said,
    })
}

/// What a change of the whole job opens, as text.
pub(super) fn whole_lines(whole: Option<&Whole>) -> String {
    let diagnostics = whole.map(Whole::diagnostics).unwrap_or_default();
    diagnostics
        .iter()
        .map(|diagnostic| format!("→ {} {}\n", diagnostic.message("en"), diagnostic.advice("en")))
        .collect()
}

/// Problems as text, grouped. The first ones of each group are listed with the names to accept them by.
pub(super) fn finding_lines(groups: &[Group], findings: &[Finding], accept: &[String]) -> String {
    let mut out = String::new();
    for group in groups {
        let diagnostic = group.diagnostic();
        let unread = unread(std::slice::from_ref(group), accept);
        let sign = if unread > 0 { "!" } else { "✓" };
        out += &format!(
            "{sign} {} {} ({})\n",
            diagnostic.message("en"),
            diagnostic.advice("en"),
            group.kind.code()
        );
        let by_id: BTreeMap<&str, &Finding> =
            members(group, findings).map(|finding| (finding.id.as_str(), finding)).collect();
        for finding in group.ids().filter_map(|id| by_id.get(id)).take(SHOWN) {
            out += &finding_line(finding, accept);
        }
        let more = (group.count as usize).saturating_sub(SHOWN);
        if more > 0 {
            let count = [("count".to_owned(), more.to_string())];
            out += &format!("    {}\n", locale::text("en", "proof.report.more", &count));
        }
    }
    out
}

/// One problem of a group, with its fixes.
fn finding_line(finding: &Finding, accept: &[String]) -> String {
    let read = if is_unread(finding, accept) { "-" } else { "✓" };
    let mut out = format!("  {read} {} {}\n", finding.id, finding.diagnostic().message("en"));
    for cure in &finding.cures {
        if let Some(text) = cure_object(cure)["message"].as_str() {
            out += &format!("      {text}\n");
        }
    }
    out
}
