//! Which commands of the board editor are enabled.

use super::Act;
use annulus_core::board::drawing::Catch;
use std::collections::BTreeSet;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    Always,
    Drawn,
    /// Anything is selected, including objects of files.
    Any,
    Several,
    Copied,
    Files,
}

#[derive(Clone, Copy, Debug)]
pub struct AtHand<'a> {
    pub chosen: &'a BTreeSet<Catch>,
    pub copied: bool,
    pub files: bool,
}

impl When {
    pub const GROUP: Self = Self::Any;
    /// For "repeat in columns and rows".
    pub const ARRAY: Self = Self::Any;

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

    #[test]
    fn selection_enables_the_actions_that_need_it() {
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
