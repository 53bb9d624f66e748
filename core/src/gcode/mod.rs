//! Which words controllers accept in one line of G-code, so that a line is refused before it is sent or
//! trusted.
//!
//! ```text
//!   table   which G and M words each controller knows, their modal groups, the words that each uses
//!   grbl    what GRBL makes of characters, digits and fractions of codes
//!   judge   line by line: unknown, repeated, conflicting, unused and missing words ─▶ Refused
//! ```

pub mod grbl;
mod judge;
mod table;
#[cfg(test)]
mod tests;

pub use judge::Judge;

use crate::diagnostic::Diagnostic;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpreter {
    /// GRBL 1.1h with default build options.
    Grbl,
    GrblHal,
    /// LinuxCNC 2.9 (`rs274`).
    LinuxCnc,
    /// Unknown: only words that no common controller accepts are refused.
    #[default]
    Any,
}

impl Interpreter {
    /// Those with rules of their own.
    pub const KNOWN: [Self; 3] = [Self::Grbl, Self::GrblHal, Self::LinuxCnc];

    /// The controller with this name on the command line.
    pub fn of(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "grbl" => Some(Self::Grbl),
            "grblhal" => Some(Self::GrblHal),
            "linuxcnc" => Some(Self::LinuxCnc),
            "any" => Some(Self::Any),
            _ => None,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Grbl => "GRBL 1.1",
            Self::GrblHal => "grblHAL",
            Self::LinuxCnc => "LinuxCNC",
            Self::Any => "RS-274",
        }
    }

    /// True if it accepts an arc with these radii at start and end, in mm; true for an unknown controller.
    pub fn takes_radii(self, begin_mm: f64, end_mm: f64) -> bool {
        let off = libm::fabs(begin_mm - end_mm);
        !self.is_grbl() || off <= 0.005 || (off <= 0.5 && off <= 0.001 * begin_mm)
    }

    /// Whether it takes an arc with this radius, in mm, between these ends. Controllers without a known rule do.
    pub fn takes_radius(self, from: [f64; 2], to: [f64; 2], radius_mm: f64) -> bool {
        !self.is_grbl() || grbl::has_circle(from, to, radius_mm)
    }

    /// Longest line without spaces and comments, in characters.
    fn longest_line(self) -> usize {
        match self {
            Self::Grbl => 79,
            Self::GrblHal | Self::LinuxCnc => 255,
            Self::Any => usize::MAX,
        }
    }

    fn is_grbl(self) -> bool {
        matches!(self, Self::Grbl | Self::GrblHal)
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// Message code.
    pub code: &'static str,
    /// The word or words that cause it.
    pub word: String,
    /// GRBL's error number.
    pub number: u16,
}

impl Refused {
    pub fn diagnostic(&self, of: Interpreter) -> Diagnostic {
        let why = Diagnostic::error(self.code).with("word", &self.word);
        why.with("controller", of.name()).with("number", self.number)
    }
}
