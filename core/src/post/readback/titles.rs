//! Tool names in headers and comments.
//!
//! ```text
//!   (tool 2: end mill 0.8)          a tool and its number, in the header of a file
//!   (MSG, put in tool 1: V-bit 30°, tip 0.1)          likewise, and the tool is loaded here
//! ```
//!
//! Sizes in mm.

use crate::job::{Bit, Cutter};
use crate::units::Length;

/// Diameter of a V-bit if its name doesn't state it, in mm.
const VEE_MM: f64 = 3.175;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Named {
    pub(super) number: u32,
    /// `None` if the comment doesn't state type and size.
    pub(super) bit: Option<Bit>,
    /// The tool is loaded here.
    pub(super) goes_in: bool,
}

pub(super) fn named(comment: &str) -> Option<Named> {
    let lower = comment.to_ascii_lowercase();
    let at = ["tool ", "bit "].iter().find_map(|word| Some(lower.find(word)? + word.len()))?;
    let rest = lower.get(at..)?;
    let digits = rest.chars().take_while(char::is_ascii_digit).count();
    let number = rest.get(..digits)?.parse().ok()?;
    let title = rest.get(digits..)?.trim_start_matches([':', ' ']);
    Some(Named { number, bit: titled(title), goes_in: lower.contains("put in") })
}

/// The tool with a title: `V-bit 30°, tip 0.1`, `end mill 0.8`, `drill 0.8`, with or without `mm`.
pub fn titled(title: &str) -> Option<Bit> {
    let lower = title.to_lowercase();
    let number_after = |word: &str| {
        let rest = lower.get(lower.find(word)? + word.len()..)?;
        let rest = rest.trim_start_matches(|c: char| !c.is_ascii_digit());
        let digits = rest.chars().take_while(|c| c.is_ascii_digit() || *c == '.').count();
        rest.get(..digits)?.trim_end_matches('.').parse::<f64>().ok()
    };
    let in_reach = |mm: f64| (mm > 0.0 && mm < 100.0).then(|| Length::from_mm(mm));
    let (diameter, cutter) = if lower.contains("v-bit") || lower.contains("vee") {
        let word = if lower.contains("v-bit") { "v-bit" } else { "vee" };
        let (angle, tip) = (number_after(word)?, number_after("tip")?);
        let angle_mdeg = libm::round(angle * 1e3) as u32;
        if !(1_000..180_000).contains(&angle_mdeg) || !(0.0..VEE_MM).contains(&tip) {
            return None;
        }
        (Length::from_mm(VEE_MM), Cutter::Vee { tip: Length::from_mm(tip), angle_mdeg })
    } else if lower.contains("mill") {
        (in_reach(number_after("mill")?)?, Cutter::Mill)
    } else {
        (in_reach(number_after("drill")?)?, Cutter::Drill)
    };
    Some(Bit { diameter, name: title.trim().to_owned(), cutter, handling: Default::default() })
}
