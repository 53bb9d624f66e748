//! The one table of template parameters (S8): name, unit, where it may stand. The sentence for each is
//! `post.parameter.<name>` in the locale tables; the page, the manual and the tests read this table.

/// A piece of a drilling program that has its own template.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// Once, first.
    Start,
    /// Once for every bit.
    Change,
    /// Once for every hole.
    Hole,
    /// Once, last.
    End,
}

impl Field {
    /// All of them in the order of the output.
    pub const ALL: [Self; 4] = [Self::Start, Self::Change, Self::Hole, Self::End];

    /// Its key in a dialect file.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Change => "change",
            Self::Hole => "hole",
            Self::End => "end",
        }
    }
}

/// One parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// What stands between the `@`.
    pub name: &'static str,
    /// Unit of the number, empty for counts.
    pub unit: &'static str,
    /// The templates it may stand in.
    pub fields: &'static [Field],
}

const fn row(name: &'static str, unit: &'static str, fields: &'static [Field]) -> Parameter {
    Parameter { name, unit, fields }
}

/// Every parameter of the drilling templates.
pub const PARAMETERS: &[Parameter] = &[
    row("X", "mm", &[Field::Hole]),
    row("Y", "mm", &[Field::Hole]),
    row("Z", "mm", &[Field::Hole]),
    row("F", "mm/min", &[Field::Hole]),
    row("P", "s", &[Field::Hole]),
    row("S", "rpm", &[Field::Change, Field::Hole]),
    row("T", "", &[Field::Change, Field::Hole]),
    row("D", "mm", &[Field::Change, Field::Hole]),
    row("W", "s", &[Field::Change]),
    row("H", "mm", &Field::ALL),
    row("N", "", &Field::ALL),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_has_a_sentence() {
        for parameter in PARAMETERS {
            let key = format!("post.parameter.{}", parameter.name);
            assert!(crate::locale::lookup("en", &key).is_some(), "no sentence {key}");
        }
    }
}
