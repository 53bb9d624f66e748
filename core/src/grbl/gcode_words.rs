//! Splits a line of G-code into words, by letter and in order.

use crate::gcode::{Interpreter, grbl};

#[derive(Debug, Default)]
pub(super) struct Words {
    /// Codes in hundredths: G91.1 is 9110.
    pub(super) g: Vec<u32>,
    pub(super) m: Vec<u32>,
    pub(super) all: Vec<(char, f64)>,
    letters: [Option<f64>; 26],
}

impl Words {
    /// Parses a line; the error is the text from the first part that is no word.
    pub(super) fn of(bare: &str) -> Result<Self, String> {
        let unknown = |text: &str| text.chars().take(20).collect::<String>();
        let mut words = Self::default();
        let mut rest = bare;
        while let Some(letter) = rest.chars().next() {
            if !letter.is_ascii_uppercase() {
                return Err(unknown(rest));
            }
            let end = rest[1..].find(|c: char| c.is_ascii_uppercase()).map_or(rest.len(), |at| at + 1);
            let number: Option<f64> = rest[1..end].parse().ok().filter(|n: &f64| n.is_finite());
            let number = number.ok_or_else(|| unknown(rest))?;
            let taken = grbl::taken(Interpreter::Grbl, letter, number);
            let hundredths = libm::round(taken * 100.0).clamp(0.0, 1e6) as u32;
            match letter {
                'G' => words.g.push(hundredths),
                'M' => words.m.push(hundredths / 100),
                _ => words.letters[usize::from(letter as u8 - b'A')] = Some(number),
            }
            words.all.push((letter, number));
            rest = &rest[end..];
        }
        Ok(words)
    }

    pub(super) fn letter(&self, name: u8) -> Option<f64> {
        self.letters[usize::from(name - b'A')]
    }

    pub(super) fn any(&self, names: &[u8]) -> bool {
        names.iter().any(|name| self.letter(*name).is_some())
    }
}
