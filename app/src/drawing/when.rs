//! When something can be done in the board editor: a button that cannot be pressed, a line that is not offered.
//!
//! Comes in: an [`Act`], what is chosen. Goes out: whether it can be done. Does not know screens.

use super::Act;
use annulus_core::board::drawing::Catch;
use std::collections::BTreeSet;

/// When something can be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// As long as the board editor is open.
    Always,
    /// Something of the drawing is chosen.
    Drawn,
    /// Anything is, also of files.
    Any,
    /// More than one thing is.
    Several,
    /// Something was copied.
    Copied,
    /// Files are drawn over.
    Files,
}

/// What there is to do something with.
#[derive(Clone, Copy, Debug)]
pub struct AtHand<'a> {
    /// What is chosen.
    pub chosen: &'a BTreeSet<Catch>,
    /// Something was copied.
    pub copied: bool,
    /// Files are drawn over.
    pub files: bool,
}

impl When {
    /// What is chosen goes into a group.
    pub const GROUP: Self = Self::Any;
    /// What is chosen is repeated in columns and rows.
    pub const ARRAY: Self = Self::Any;

    /// Whether it can be done now.
    pub fn holds(self, now: AtHand<'_>) -> bool {
        match self {
            Self::Always => true,
            Self::Drawn => now.chosen.iter().any(|one| matches!(one, Catch::Drawn(_))),
            Self::Any => !now.chosen.is_empty(),
            Self::Several => now.chosen.len() > 1,
            Self::Copied => now.copied,
            Self::Files => now.files,
        }
    }
}

impl Act {
    /// When it can be done.
    pub const fn when(self) -> When {
        match self {
            Self::All | Self::Snap | Self::NextGrid | Self::Dim | Self::Undo { .. } => When::Always,
            Self::Ungroup | Self::Layer(_) => When::Drawn,
            Self::Turn { .. } | Self::Mirror { .. } | Self::Array { .. } => When::Any,
            Self::Copy | Self::Cut | Self::Duplicate | Self::Delete => When::Any,
            Self::Align(_) => When::Several,
            Self::Paste => When::Copied,
            Self::PutBack => When::Files,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::board::drawing::{Align, Id, Sides};

    /// All that is at hand, and what can be done with it.
    #[test]
    fn what_can_be_done_follows_from_what_is_chosen_and_choosing_all_from_nothing() {
        let line = Act::Align(Align { x: true, sides: Sides::Low });
        let acts = [Act::All, Act::Ungroup, Act::Delete, line, Act::Paste, Act::PutBack];
        let (drawn, of_file) = (Catch::Drawn(Id(1)), Catch::Imported(0));
        let rows: [(&[Catch], bool, bool, [bool; 6]); 5] = [
            (&[], false, false, [true, false, false, false, false, false]),
            (&[of_file], false, true, [true, false, true, false, false, true]),
            (&[drawn], false, true, [true, true, true, false, false, true]),
            (&[of_file, drawn], true, true, [true, true, true, true, true, true]),
            (&[], true, false, [true, false, false, false, true, false]),
        ];
        for (chosen, copied, files, wanted) in rows {
            let chosen: BTreeSet<Catch> = chosen.iter().copied().collect();
            let now = AtHand { chosen: &chosen, copied, files };
            assert_eq!(acts.map(|act| act.when().holds(now)), wanted, "{now:?}");
        }
    }
}
