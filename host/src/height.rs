//! Which tool the Z zero is valid for, on Annulus' own drill.

use annulus_core::control::BoardHeight;
use annulus_core::job::Bit;

/// The tool for which the board height is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnownHeight {
    /// Whether that is the current tool.
    pub height: BoardHeight,
    /// The tool; `None` if zero was set with a tool that no job requested.
    pub of: Option<Bit>,
    /// Steps of Z by which the tool setter is above the board, from a tool of known length; `None` before
    /// one met it.
    pub setter_steps: Option<i64>,
}
