//! The tool for which the height of the board is known. No other tool may cut. The rule holds for
//! machines that Annulus drives itself, and for controllers.
//!
//! ```text
//!  Unknown ── zero of Z is set or probed ──▶ OfThisBit
//!                                               │ another tool is requested or inserted,
//!             OfAnotherBit ◀────────────────────┘ unless all tools are equally long
//! ```

/// The bit to which the zero of Z applies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoardHeight {
    /// Not set since the link opened, or rejected.
    #[default]
    Unknown,
    /// A previous bit.
    OfAnotherBit,
    /// The bit in the spindle.
    OfThisBit,
}

impl BoardHeight {
    /// The height after a possible tool change. `alike`: all tools are equally long.
    #[must_use]
    pub fn with_another_tool(self, alike: bool) -> Self {
        if self == Self::OfThisBit && !alike { Self::OfAnotherBit } else { self }
    }

    /// True if the tool in the spindle may cut.
    pub fn may_cut(self) -> bool {
        self == Self::OfThisBit
    }
}
