//! The panels of the Lab and their URLs: `#/lab/phases`.

use annulus_core::code;

/// A tab of the motion panel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PanelPart {
    #[default]
    Dynamics,
    Profiles,
    Cycle,
}

impl PanelPart {
    pub const ALL: [Self; 3] = [Self::Dynamics, Self::Profiles, Self::Cycle];
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LabPanel {
    Io,
    Queue,
    #[default]
    Phases,
    Motion,
    Servo,
    Faults,
    Log,
}

impl LabPanel {
    pub const ALL: [Self; 7] =
        [Self::Io, Self::Queue, Self::Phases, Self::Motion, Self::Servo, Self::Faults, Self::Log];

    /// The word in the URL, and the key of its name.
    const fn row(self) -> (&'static str, &'static str) {
        match self {
            Self::Io => ("io", code!("page.lab.sheet.io")),
            Self::Queue => ("queue", code!("page.lab.sheet.queue")),
            Self::Phases => ("phases", code!("page.lab.sheet.phases")),
            Self::Motion => ("motion", code!("page.lab.sheet.motion")),
            Self::Servo => ("servo", code!("page.lab.sheet.servo")),
            Self::Faults => ("faults", code!("page.lab.sheet.faults")),
            Self::Log => ("log", code!("page.lab.sheet.log")),
        }
    }

    /// The word in the URL.
    pub fn word(self) -> &'static str {
        self.row().0
    }

    /// Key of its name in the locale tables.
    pub fn name(self) -> &'static str {
        self.row().1
    }

    pub fn of_address(hash: &str) -> Option<Self> {
        let word = hash.strip_prefix("#/lab/")?.split(['/', '?']).next()?;
        Self::ALL.into_iter().find(|sheet| sheet.word() == word)
    }

    pub fn index(self) -> usize {
        Self::ALL.iter().position(|sheet| *sheet == self).unwrap_or_default()
    }

    /// The panel `by` positions further; wraps around.
    pub fn beside(self, by: isize) -> Self {
        let count = Self::ALL.len() as isize;
        Self::ALL[(self.index() as isize + by).rem_euclid(count) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_select_their_sheet() {
        for sheet in LabPanel::ALL {
            assert_eq!(LabPanel::of_address(&format!("#/lab/{}", sheet.word())), Some(sheet));
        }
        for other in ["#/lab", "#/lab/", "#/lab/none", "#/machine/io", "", "#t=abc"] {
            assert_eq!(LabPanel::of_address(other), None, "{other}");
        }
        assert_eq!(LabPanel::Io.beside(-1), LabPanel::Log);
        assert_eq!(LabPanel::Log.beside(1), LabPanel::Io);
    }
}
