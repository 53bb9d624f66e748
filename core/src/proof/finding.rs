//! A finding: the problem, its position, width, nets and possible fixes.

use crate::code;
use crate::diagnostic::{Diagnostic, Severity};
use crate::geometry::Point;
use crate::job::Mark;
use crate::locale;
use crate::units::Length;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;

/// Findings of one kind and nets nearer to each other than this are merged.
const SAME_PLACE_MM: f64 = 0.5;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingKind {
    /// Two nets in one piece, although a tool of the program fits between them.
    Short,
    /// Two nets in one piece: the gap between them is narrower than every tool of the program.
    Gap,
    /// No net is isolated, because nothing is milled between them.
    NotIsolated,
    /// An island of copper is in two or more pieces.
    Break,
    /// Nothing is left of an island.
    Gone,
    /// A cut into copper that must stay.
    Lost,
    Hit,
    /// A cut without a tool.
    NoBit,
    Still,
    /// A cut that does not go through the copper.
    Shallow,
    /// Too little copper around a drilled hole, or none.
    Ring,
    /// Copper of no net that is nearer to a net than the required clearance.
    Remnant,
    /// Copper so thin that it may tear off.
    Sliver,
    /// A loose piece so small that it may come off.
    Fragment,
}

impl FindingKind {
    pub const ALL: [Self; 14] = [
        Self::Short,
        Self::Gap,
        Self::NotIsolated,
        Self::Break,
        Self::Gone,
        Self::Lost,
        Self::Hit,
        Self::NoBit,
        Self::Still,
        Self::Shallow,
        Self::Ring,
        Self::Remnant,
        Self::Sliver,
        Self::Fragment,
    ];

    pub const fn code(self) -> &'static str {
        match self {
            Self::Short => code!("proof.short"),
            Self::Gap => code!("proof.gap"),
            Self::NotIsolated => code!("proof.not_isolated"),
            Self::Break => code!("proof.break"),
            Self::Gone => code!("proof.gone"),
            Self::Lost => code!("proof.lost"),
            Self::Hit => code!("proof.hit"),
            Self::NoBit => code!("proof.no_bit"),
            Self::Still => code!("proof.still"),
            Self::Shallow => code!("proof.shallow"),
            Self::Ring => code!("proof.ring"),
            Self::Sliver => code!("proof.sliver"),
            Self::Remnant => code!("proof.remnant"),
            Self::Fragment => code!("proof.fragment"),
        }
    }

    pub const fn severity(self) -> Severity {
        match self {
            Self::Short
            | Self::Gap
            | Self::Break
            | Self::Gone
            | Self::Lost
            | Self::Hit
            | Self::NoBit
            | Self::Still => Severity::Error,
            Self::Shallow | Self::Ring | Self::Remnant | Self::Sliver => Severity::Warning,
            Self::NotIsolated | Self::Fragment => Severity::Note,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
    /// Stable name: depends only on kind, nets and position, not on other findings.
    pub id: String,
    pub kind: FindingKind,
    /// In the board's coordinates.
    pub at: Point,
    /// Width of the gap, of the cut or of the remaining copper, depending on the kind. Negative if a hole
    /// breaks out of its pad.
    pub width: Length,
    /// Width of the tool there, if a tool is involved.
    pub tool: Option<Length>,
    /// The nets by name; unnamed nets by a position on them, as `@x,y` in mm.
    pub nets: Vec<String>,
    /// The gap's two sides, for shorts and gaps.
    pub ends: Option<(Point, Point)>,
    /// The leg involved: index of the program, and of the leg in it.
    pub leg: Option<(u32, u32)>,
    #[serde(default)]
    pub mark: Option<Mark>,
    /// Name of the leg's operation in messages, set by the planner, because the proof has no job.
    #[serde(default)]
    pub operation: Option<String>,
    /// Possible fixes, the mildest first.
    pub cures: Vec<Cure>,
    /// The cost of a fix that the user chose: listed, but no longer to be accepted.
    #[serde(default)]
    pub agreed: bool,
    /// Number of nets, if different from `nets`.
    #[serde(default)]
    pub count: u32,
    /// No net depends on it: listed, but not to be accepted.
    #[serde(default)]
    pub slight: bool,
}

impl Finding {
    /// A finding without tool, leg and fixes.
    pub fn new(kind: FindingKind, at: Point, width: Length, mut nets: Vec<String>) -> Self {
        nets.sort();
        nets.dedup();
        Self {
            id: name(kind, at, &nets),
            kind,
            at,
            width,
            tool: None,
            nets,
            ends: None,
            leg: None,
            mark: None,
            operation: None,
            cures: Vec::new(),
            agreed: false,
            count: 0,
            slight: false,
        }
    }

    pub const fn severity(&self) -> Severity {
        self.kind.severity()
    }

    /// Its nets as in messages; unnamed nets by their positions relative to `zero`.
    pub fn nets_from(&self, zero: Point) -> String {
        let called: Vec<String> = self.nets.iter().map(|net| net_called(net, zero)).collect();
        called.join(" · ")
    }

    pub fn must_be_read(&self) -> bool {
        self.severity() > Severity::Note && !self.agreed && !self.slight
    }

    /// The message, in the board's coordinates.
    pub fn diagnostic(&self) -> Diagnostic {
        self.diagnostic_from(Point::default())
    }

    /// The message, with positions relative to `zero`.
    pub fn diagnostic_from(&self, zero: Point) -> Diagnostic {
        let nets = self.nets_from(zero);
        let mm = |length: Length| format!("{:.3}", length.mm());
        let place = |length: Length| format!("{:.2}", length.mm());
        let (piece, number) = match self.mark {
            Some(Mark::Hole(hole)) => ("hole", (hole + 1).to_string()),
            Some(Mark::Toolpath(way)) => ("way", (way + 1).to_string()),
            _ => ("other", String::new()),
        };
        let unnamed = || locale::word("proof.piece.program");
        Diagnostic::new(self.severity(), self.kind.code())
            .with("x", place(self.at.x - zero.x))
            .with("y", place(self.at.y - zero.y))
            .with("width", mm(self.width))
            .with("tool", self.tool.map(mm).unwrap_or_default())
            .with("nets", &nets)
            .with("of", if nets.is_empty() { nets } else { format!(" ({nets})") })
            .with("count", self.count)
            .with("leg", self.leg.map(|(_, leg)| (leg + 1).to_string()).unwrap_or_default())
            .with("piece", locale::word(&format!("proof.piece.{piece}")))
            .with("number", number)
            .with("operation", self.operation.clone().unwrap_or_else(unnamed))
            .with("id", &self.id)
    }
}

/// A net as in messages: its name, or its position relative to `zero`.
fn net_called(net: &str, zero: Point) -> String {
    let place = net.strip_prefix('@').and_then(|place| place.split_once(','));
    let place = place.and_then(|(x, y)| Some([x.parse::<f64>().ok()?, y.parse::<f64>().ok()?]));
    let Some([x, y]) = place else { return net.to_owned() };
    let mm = |number: f64| format!("{number:.2}");
    locale::phrase("proof.net.unnamed", &[("x", mm(x - zero.x.mm())), ("y", mm(y - zero.y.mm()))])
}

/// Eight hexadecimal digits from kind, nets and position; the position rounded to 0.1 mm.
fn name(kind: FindingKind, at: Point, nets: &[String]) -> String {
    let tenth = |length: Length| libm::round(length.mm() * 10.0) as i64;
    let text = format!("{}|{}|{}|{}", kind.code(), nets.join("|"), tenth(at.x), tenth(at.y));
    Sha256::digest(text.as_bytes()).iter().take(4).map(|byte| format!("{byte:02x}")).collect()
}

/// Key of findings that may be merged: kind, whether it must be read, nets, column and row.
type Cell = (FindingKind, bool, Vec<String>, i64, i64);

/// Merges findings of one cause at one position, the worst first. The width decides which position stays: the
/// narrowest; for lost copper the widest.
pub(super) fn merged(mut findings: Vec<Finding>) -> Vec<Finding> {
    let rank = |finding: &Finding| {
        if finding.kind == FindingKind::Lost { -finding.width } else { finding.width }
    };
    findings.sort_by(|a, b| {
        let key = |f: &Finding| (f.kind, rank(f), f.at);
        key(a).cmp(&key(b)).then_with(|| (&a.nets, &a.leg, &a.cures).cmp(&(&b.nets, &b.leg, &b.cures)))
    });
    // Cells as large as the merge distance: a neighbour is in one of nine.
    let mut seen: BTreeMap<Cell, Vec<Point>> = BTreeMap::new();
    let mut kept: Vec<Finding> = Vec::new();
    for finding in findings {
        let cell = |length: Length| libm::floor(length.mm() / SAME_PLACE_MM) as i64;
        let (column, row) = (cell(finding.at.x), cell(finding.at.y));
        let mut places = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (column + dx, row + dy)));
        let known = places.any(|(column, row)| {
            let here = seen.get(&(finding.kind, finding.must_be_read(), finding.nets.clone(), column, row));
            here.is_some_and(|points| points.iter().any(|p| p.distance_mm(finding.at) <= SAME_PLACE_MM))
        });
        if !known {
            let cell = (finding.kind, finding.must_be_read(), finding.nets.clone(), column, row);
            seen.entry(cell).or_default().push(finding.at);
            kept.push(finding);
        }
    }
    // By position within a kind, so that the list follows the board.
    kept.sort_by(|a, b| (a.kind, a.slight, a.at, &a.nets).cmp(&(b.kind, b.slight, b.at, &b.nets)));
    kept
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(tag = "cure", rename_all = "snake_case")]
pub enum Cure {
    /// A V-bit of the program, less deep there.
    Shallower {
        bit: String,
        depth: Length,
        width: Length,
    },
    /// An owned tool that fits.
    OtherBit {
        owned: u32,
        bit: String,
        /// Depth of the tip: for a V-bit the depth that gives the width, else the least depth through the
        /// copper.
        depth: Length,
        width: Length,
    },
    /// One pass through the middle of the gap with the narrowest tool of the program.
    Centred {
        bit: String,
        depth: Length,
        width: Length,
        /// Copper lost on each side.
        lost: Length,
    },
    Deeper {
        bit: String,
        depth: Length,
        width: Length,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_from_zero_in_the_format_of_the_language() {
        let nets = ["GND", "@33.63,14.72", "@home"].map(str::to_owned).to_vec();
        let (at, width) = (Point::from_mm(30.5, 12.25), Length::from_um(120));
        let finding = Finding::new(FindingKind::Gap, at, width, nets);
        let said = |language: &str, zero| finding.diagnostic_from(zero).message(language);
        let (here, corner) = (Point::default(), Point::from_mm(30.0, 10.0));
        for (language, zero, parts) in [
            ("en", here, ["X 33.63 Y 14.72", "30.50", "12.25"]),
            ("en", corner, ["X 3.63 Y 4.72", "0.50", "2.25"]),
            ("pl", corner, ["X 3,63 Y 4,72", "0,50", "2,25"]),
            ("zh", corner, ["X 3.63 Y 4.72", "0.50", "2.25"]),
        ] {
            let said = said(language, zero);
            assert!(parts.iter().all(|part| said.contains(part)), "{said}");
            assert!(said.contains("GND") && said.contains("@home") && !said.contains("@3"), "{said}");
        }
        assert_eq!(finding.diagnostic(), finding.diagnostic_from(here));
    }
}
