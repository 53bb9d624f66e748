//! The sheets of the Lab and their addresses: `#/lab/phases`.
//!
//! Comes in: an address. Goes out: a sheet. Knows no layout.

/// A part of the sheet of motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PanelPart {
    /// The integer table.
    #[default]
    Dynamics,
    /// Profiles in closed form.
    Profiles,
    /// Table and spindles together.
    Cycle,
}

impl PanelPart {
    /// All of them, in the order they stand.
    pub const ALL: [Self; 3] = [Self::Dynamics, Self::Profiles, Self::Cycle];
}

/// One sheet of the Lab.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LabPanel {
    /// Inputs and outputs.
    Io,
    /// Work commands.
    Queue,
    /// Phase tables.
    #[default]
    Phases,
    /// Dynamics and profiles.
    Motion,
    /// The closed-loop axis.
    Servo,
    /// What can be broken of the virtual drill.
    Faults,
    /// What happened.
    Log,
}

impl LabPanel {
    /// All of them, in the order they stand.
    pub const ALL: [Self; 7] =
        [Self::Io, Self::Queue, Self::Phases, Self::Motion, Self::Servo, Self::Faults, Self::Log];

    /// Its word in the address.
    pub fn word(self) -> &'static str {
        match self {
            Self::Io => "io",
            Self::Queue => "queue",
            Self::Phases => "phases",
            Self::Motion => "motion",
            Self::Servo => "servo",
            Self::Faults => "faults",
            Self::Log => "log",
        }
    }

    /// The sheet of an address, if it names one.
    pub fn of_address(hash: &str) -> Option<Self> {
        let word = hash.strip_prefix("#/lab/")?.split(['/', '?']).next()?;
        Self::ALL.into_iter().find(|sheet| sheet.word() == word)
    }

    /// Its place among the others.
    pub fn index(self) -> usize {
        Self::ALL.iter().position(|sheet| *sheet == self).unwrap_or_default()
    }

    /// The sheet `by` places on, round the ends.
    pub fn beside(self, by: isize) -> Self {
        let count = Self::ALL.len() as isize;
        Self::ALL[(self.index() as isize + by).rem_euclid(count) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_find_their_sheet() {
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
