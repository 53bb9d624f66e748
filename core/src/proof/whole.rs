//! Effect of one change of the whole job, before gaps are fixed one by one.
//!
//! ```text
//!   uncut gaps       0.124  0.126  0.131  0.135  …
//!   the V-bit at its least depth cuts 0.127        ──▶ opens the last two and all wider ones
//!   the same V-bit with a finer tip                ──▶ opens the rest
//! ```

use super::finding::{Finding, FindingKind};
use super::scene::Scene;
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::job::{Bit, Cutter};
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// Depths are offered in multiples of this.
const DEPTH_STEP: Length = Length::from_um(1);
/// Tips are offered in multiples of this.
const TIP_STEP: Length = Length::from_um(10);
/// The finest tip usually sold.
const FINEST_TIP: Length = Length::from_um(50);

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Whole {
    /// Number of uncut gaps.
    pub gaps: u32,
    /// The program's V-bit less deep everywhere, if that opens any gap.
    pub shallower: Option<Shallower>,
    /// Gaps that this does not open.
    pub rest: u32,
    /// The tip that the V-bit needs for the rest, at the least depth; `None` if there is no rest or no tip
    /// would do.
    pub tip: Option<Length>,
    /// Number of the rest that the tip opens.
    pub tip_opens: u32,
}

/// A V-bit less deep everywhere.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shallower {
    pub bit: String,
    pub depth: Length,
    pub width: Length,
    /// Number of gaps that it opens.
    pub opens: u32,
}

/// Remedies for the gaps among `findings`; `None` if there are none, or if no V-bit isolates.
pub(super) fn whole(scene: &Scene<'_>, findings: &[Finding]) -> Option<Whole> {
    let joined =
        findings.iter().filter(|finding| matches!(finding.kind, FindingKind::Short | FindingKind::Gap));
    let mut gaps: Vec<Length> = joined.filter(|gap| gap.ends.is_some()).map(|gap| gap.width).collect();
    gaps.sort_unstable();
    let least = scene.options.copper_thickness + scene.options.depth_margin;
    let mut vees = scene.bits_used.clone();
    vees.retain(|bit| matches!(bit.cutter, Cutter::Vee { .. }));
    let bit = vees.into_iter().min_by_key(|bit| (bit.width_at(least), bit.name.clone()))?;
    let narrowest = bit.width_at(least);
    let (rest, opened) = gaps.split_at(gaps.partition_point(|gap| *gap < narrowest));
    let deepest = deepest(scene, bit);
    let shallower = opened.first().and_then(|gap| {
        let (depth, _) = bit.fitting(*gap, least)?;
        let depth = Length::from_nm(depth.nm() - depth.nm() % DEPTH_STEP.nm()).max(least);
        let opens = opened.len() as u32;
        let offer = Shallower { bit: bit.name.clone(), depth, width: bit.width_at(depth), opens };
        (depth < deepest).then_some(offer)
    });
    let (tip, tip_opens) = tip(bit, narrowest, rest);
    let unopened = if shallower.is_some() { rest.len() } else { gaps.len() };
    (!gaps.is_empty()).then_some(Whole {
        gaps: gaps.len() as u32,
        shallower,
        rest: unopened as u32,
        tip,
        tip_opens,
    })
}

fn deepest(scene: &Scene<'_>, bit: &Bit) -> Length {
    let own = scene.cuts.iter().filter(|cut| scene.bit(cut) == Some(bit));
    own.map(|cut| cut.depth).max().unwrap_or_default()
}

/// The tip with which `bit` opens all of `rest` that any tip opens, and their number. `rest` is sorted, the
/// narrowest first.
fn tip(bit: &Bit, narrowest: Length, rest: &[Length]) -> (Option<Length>, u32) {
    let Cutter::Vee { tip, .. } = bit.cutter else { return (None, 0) };
    let flanks = narrowest - tip;
    let reached = rest.partition_point(|gap| *gap < flanks + FINEST_TIP);
    let Some(gap) = rest.get(reached) else { return (None, 0) };
    let wanted = *gap - flanks;
    (Some(Length::from_nm(wanted.nm() - wanted.nm() % TIP_STEP.nm())), (rest.len() - reached) as u32)
}

impl Whole {
    /// Messages: what a smaller depth opens, what a finer tip opens, what is left for single fixes.
    pub fn diagnostics(&self) -> Vec<Diagnostic> {
        let mm = |length: Length| format!("{:.3}", length.mm());
        let said = |code: &str| Diagnostic::note(code).with("gaps", self.gaps).with("rest", self.rest);
        let mut diagnostics = Vec::new();
        if let Some(Shallower { bit, depth, width, opens }) = &self.shallower {
            let said = said(code!("proof.whole.shallower")).with("bit", bit).with("depth", mm(*depth));
            diagnostics.push(said.with("width", mm(*width)).with("opens", opens));
        }
        if let Some(tip) = self.tip {
            // "The other gaps" makes sense only if a smaller depth opens some.
            let all = self.rest == self.gaps;
            let said =
                if all { said(code!("proof.whole.tip_of_all")) } else { said(code!("proof.whole.tip")) };
            diagnostics.push(said.with("tip", format!("{:.2}", tip.mm())).with("opens", self.tip_opens));
        }
        let narrow = self.rest.saturating_sub(self.tip_opens);
        if narrow > 0 {
            let finest = format!("{:.2}", FINEST_TIP.mm());
            diagnostics.push(said(code!("proof.whole.middle")).with("count", narrow).with("finest", finest));
        }
        diagnostics
    }
}
