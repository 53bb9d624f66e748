//! Findings grouped by cause for one report: problem, tool, count, smallest width.
//!
//! ```text
//!   gap A·B 0.120 ┐                     "Gaps narrower than your cut of 0.143 mm: 3, from 0.118 mm."
//!   gap A·B 0.122 ├─ one group, tool ─▶    A · B   2, from 0.120 mm
//!   gap C·D 0.118 ┘                        C · D   1, 0.118 mm
//! ```

use super::finding::{Finding, FindingKind};
use crate::diagnostic::Diagnostic;
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A narrower gap counts as none: the nets touch.
const NO_WIDTH: Length = Length::from_nm(500);

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Group {
    pub kind: FindingKind,
    pub must_be_read: bool,
    /// Width of the tool, if that is the cause.
    pub tool: Option<Length>,
    /// Number of findings.
    pub count: u32,
    pub least: Length,
    pub most: Length,
    /// The findings by nets, the narrowest first.
    pub pairs: Vec<Pair>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pair {
    pub nets: Vec<String>,
    /// Smallest width.
    pub least: Length,
    /// Names of the findings.
    pub ids: Vec<String>,
}

impl Finding {
    /// The group's key.
    pub fn cause(&self) -> (FindingKind, bool, Option<Length>) {
        let by_tool = matches!(self.kind, FindingKind::Short | FindingKind::Gap);
        (self.kind, self.must_be_read(), self.tool.filter(|_| by_tool))
    }
}

/// Key of a group: kind, whether it must be read, tool width.
type Cause = (FindingKind, bool, Option<Length>);

/// Kind and name of every finding that the user must accept, including those not listed.
pub fn to_be_read(groups: &[Group]) -> impl Iterator<Item = (FindingKind, &str)> {
    let grave = groups.iter().filter(|group| group.must_be_read);
    grave.flat_map(|group| group.ids().map(|id| (group.kind, id)))
}

/// The first `most` findings of every cause, in order.
pub(super) fn listed(findings: Vec<Finding>, most: usize) -> Vec<Finding> {
    let mut counts: BTreeMap<Cause, usize> = BTreeMap::new();
    let mut one = |finding: &Finding| {
        let count = counts.entry(finding.cause()).or_default();
        *count += 1;
        *count <= most
    };
    findings.into_iter().filter(|finding| one(finding)).collect()
}

pub(super) fn groups(findings: &[Finding]) -> Vec<Group> {
    let mut causes: Vec<(Cause, Vec<&Finding>)> = Vec::new();
    for finding in findings {
        let cause = finding.cause();
        match causes.iter_mut().find(|(known, _)| *known == cause) {
            Some((_, members)) => members.push(finding),
            None => causes.push((cause, vec![finding])),
        }
    }
    causes.into_iter().map(|(cause, members)| group(cause, &members)).collect()
}

fn group((kind, must_be_read, tool): (FindingKind, bool, Option<Length>), members: &[&Finding]) -> Group {
    let mut by_nets: BTreeMap<&[String], Pair> = BTreeMap::new();
    for finding in members {
        let pair = by_nets.entry(&finding.nets).or_insert_with(|| Pair {
            nets: finding.nets.clone(),
            least: finding.width,
            ids: Vec::new(),
        });
        pair.least = pair.least.min(finding.width);
        pair.ids.push(finding.id.clone());
    }
    let mut pairs: Vec<Pair> = by_nets.into_values().collect();
    pairs.sort_by(|a, b| (a.least, &a.nets).cmp(&(b.least, &b.nets)));
    let widths = || members.iter().map(|finding| finding.width);
    Group {
        kind,
        must_be_read,
        tool,
        count: members.len() as u32,
        least: widths().min().unwrap_or_default(),
        most: widths().max().unwrap_or_default(),
        pairs,
    }
}

impl Group {
    /// The names of its findings, listed or not, by nets.
    pub fn ids(&self) -> impl Iterator<Item = &str> {
        self.pairs.iter().flat_map(|pair| pair.ids.iter().map(String::as_str))
    }

    pub fn diagnostic(&self) -> Diagnostic {
        let mm = |length: Length| format!("{:.3}", length.mm());
        let name = match self.kind {
            FindingKind::Gap if self.least < NO_WIDTH => "gap_of_none",
            kind => kind.code().rsplit('.').next().unwrap_or_default(),
        };
        Diagnostic::new(self.kind.severity(), &format!("proof.group.{name}"))
            .with("count", self.count)
            .with("tool", self.tool.map(mm).unwrap_or_default())
            .with("least", mm(self.least))
            .with("most", mm(self.most))
            .with("pairs", self.pairs.len())
    }
}
