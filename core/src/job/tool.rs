//! Names of tools, from their shape and size.
//!
//! ```text
//!   title       V-bit 30°, tip 0.1      end mill 0.8      drill 0.8        display, translated
//!   file_word   V30-0.1                 mill-0.8          drill-0.8        file names
//! ```

use super::{Bit, Cutter};
use crate::locale;

impl Bit {
    /// True if the shape and size are equal; names don't matter.
    pub fn is_same_tool(&self, other: &Self) -> bool {
        self.diameter == other.diameter && self.cutter == other.cutter
    }

    /// Shape and size in `language`.
    pub fn title(&self, language: &str) -> String {
        let (key, numbers) = self.form_and_size();
        let numbers: Vec<_> = numbers.into_iter().map(|(name, number)| (name.to_owned(), number)).collect();
        locale::text(language, key, &numbers)
    }

    /// Shape and size as an argument that is translated with its sentence.
    pub fn titled(&self) -> String {
        let (key, numbers) = self.form_and_size();
        locale::phrase(key, &numbers)
    }

    /// The user's name for the tool; none if the name is just its shape and size.
    pub fn own_name(&self) -> Option<&str> {
        let name = self.name.as_str();
        (!name.is_empty() && name != self.title(locale::FALLBACK)).then_some(name)
    }

    /// Name in sentences: the user's, else shape and size.
    pub fn called(&self) -> String {
        self.own_name().map_or_else(|| self.titled(), str::to_owned)
    }

    /// Message key of the shape, and the numbers of the size.
    fn form_and_size(&self) -> (&'static str, Vec<(&'static str, String)>) {
        let size = || vec![("size", self.diameter.mm().to_string())];
        match self.cutter {
            Cutter::Drill => ("tool.drill", size()),
            Cutter::Mill => ("tool.mill", size()),
            Cutter::Vee { tip, angle_mdeg } => {
                ("tool.vee", vec![("angle", degrees(angle_mdeg)), ("tip", tip.mm().to_string())])
            }
        }
    }

    /// Shape and size for file names, not translated.
    pub fn file_word(&self) -> String {
        match self.cutter {
            Cutter::Drill => format!("drill-{}", self.diameter.mm()),
            Cutter::Mill => format!("mill-{}", self.diameter.mm()),
            Cutter::Vee { tip, angle_mdeg } => format!("V{}-{}", degrees(angle_mdeg), tip.mm()),
        }
    }
}

/// An angle in degrees without trailing zeros.
fn degrees(thousandths: u32) -> String {
    (f64::from(thousandths) / 1e3).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Length;

    #[test]
    fn drill_and_mill_of_one_size_have_different_names() {
        let um = Length::from_um;
        let vee = |tip, angle_mdeg| Cutter::Vee { tip: um(tip), angle_mdeg };
        let rows = [
            (800, Cutter::Drill, "drill 0.8", "drill-0.8"),
            (800, Cutter::Mill, "end mill 0.8", "mill-0.8"),
            (3_175, vee(100, 30_000), "V-bit 30°, tip 0.1", "V30-0.1"),
            (6_000, vee(0, 22_500), "V-bit 22.5°, tip 0", "V22.5-0"),
            (1_000, Cutter::Mill, "end mill 1", "mill-1"),
        ];
        for (diameter, cutter, title, word) in rows {
            let bit = Bit {
                diameter: um(diameter),
                name: "a name of its own".to_owned(),
                cutter,
                handling: Default::default(),
            };
            assert_eq!((bit.title("en").as_str(), bit.file_word().as_str()), (title, word));
        }
    }
}
