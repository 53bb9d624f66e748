//! The tables of two-letter commands and G-codes. A command is implemented in the file of the state that it
//! changes; those without state are here.

use super::Reader;
use super::graphics::{Interpolation, Quadrants};
use super::words::Block;
use crate::artwork::Units;
use crate::code;
use crate::diagnostic::Severity;

const LONGEST_NAME: usize = 80;

/// Executes a command; gets the text after its letters.
type Command = fn(&mut Reader, &[u8], &Block<'_>);

const COMMANDS: [(&[u8; 2], Command); 27] = [
    (b"AB", Reader::block_aperture),
    (b"AD", Reader::aperture_definition),
    (b"AM", Reader::macro_definition),
    (b"AS", axes),
    (b"FS", Reader::format),
    (b"IC", |reader, rest, block| reader.only(matches!(rest, b"" | b"AS" | b"ASCII"), block)),
    (b"IF", |reader, rest, block| reader.tell(Severity::Error, code!("gerber.include"), block.at, rest)),
    // Centers the image on the film: no effect on coordinates.
    (b"IJ", |reader, rest, block| {
        reader.only(rest.iter().all(|byte| b"ABLC.+-".contains(byte) || byte.is_ascii_digit()), block);
    }),
    (b"IN", |reader, rest, _| reader.name_layer(rest, false)),
    (b"IP", Reader::image_polarity),
    (b"IR", Reader::image_turn),
    (b"KO", |reader, _, block| reader.tell(Severity::Error, code!("gerber.knockout"), block.at, block.text)),
    (b"LM", Reader::mirror),
    (b"LN", |reader, rest, _| reader.name_layer(rest, true)),
    (b"LP", Reader::polarity),
    (b"LR", Reader::turn),
    (b"LS", Reader::scale),
    (b"MI", Reader::image_mirror),
    (b"MO", Reader::units),
    (b"OF", Reader::image_offset),
    // Names the film.
    (b"PF", |_, _, _| {}),
    (b"SF", Reader::image_scale),
    (b"SR", Reader::step_and_repeat),
    (b"TA", |reader, rest, _| reader.aperture_attribute(rest)),
    (b"TD", |reader, rest, block| reader.forget(rest, block.at)),
    (b"TF", |reader, rest, _| reader.file_attribute(rest)),
    (b"TO", |reader, rest, _| reader.attributes.of_objects(rest)),
];

type Code = fn(&mut Reader, &Block<'_>);

/// By number. G54 and G55 precede a D-code and need no action.
const CODES: [(i64, Code); 17] = [
    (0, |_, _| {}),
    (1, |reader, _| reader.graphics.interpolation = Interpolation::Straight),
    (2, |reader, _| reader.graphics.interpolation = Interpolation::Clockwise),
    (3, |reader, _| reader.graphics.interpolation = Interpolation::Counter),
    (10, |reader, _| reader.graphics.interpolation = Interpolation::Straight),
    (11, scaled_lines),
    (12, scaled_lines),
    (36, Reader::open_region),
    (37, Reader::close_region),
    (54, |_, _| {}),
    (55, |_, _| {}),
    (70, |reader, block| reader.set_units(Units::Inch, block.at)),
    (71, |reader, block| reader.set_units(Units::Mm, block.at)),
    (74, |reader, _| reader.graphics.quadrants = Some(Quadrants::One)),
    (75, |reader, _| reader.graphics.quadrants = Some(Quadrants::Many)),
    (90, |reader, _| reader.format.incremental = false),
    (91, |reader, _| reader.format.incremental = true),
];

impl Reader {
    pub(super) fn command(&mut self, letters: [u8; 2], rest: &[u8], block: &Block<'_>) {
        match COMMANDS.iter().find(|(known, _)| **known == letters) {
            Some((_, does)) => does(self, rest.trim_ascii(), block),
            None => self.only(false, block),
        }
    }

    pub(super) fn code(&mut self, number: i64, block: &Block<'_>) {
        match CODES.iter().find(|(known, _)| *known == number) {
            Some((_, does)) => does(self, block),
            None => self.tell_once(Severity::Warning, code!("gerber.unknown_word"), block.at, block.text),
        }
    }

    /// Warns if a command without effect has an unknown argument.
    fn only(&mut self, understood: bool, block: &Block<'_>) {
        if !understood {
            self.tell_once(Severity::Warning, code!("gerber.unknown_command"), block.at, block.text);
        }
    }

    /// The first level name (`%LN`) is the layer's name; without one, the image name (`%IN`) is.
    fn name_layer(&mut self, rest: &[u8], level: bool) {
        if level && !self.level_named || self.out.layer_name.is_none() {
            let name = String::from_utf8_lossy(rest);
            self.level_named |= level;
            self.out.layer_name = Some(name.chars().filter(|c| !c.is_control()).take(LONGEST_NAME).collect());
        }
    }
}

fn axes(reader: &mut Reader, rest: &[u8], block: &Block<'_>) {
    match rest {
        b"AXBY" => {}
        b"AYBX" => reader.tell_once(Severity::Warning, code!("gerber.axes_swapped"), block.at, block.text),
        _ => reader.only(false, block),
    }
}

/// G11, G12: lines at a tenth and a hundredth of the scale. Not supported.
fn scaled_lines(reader: &mut Reader, block: &Block<'_>) {
    reader.graphics.interpolation = Interpolation::Straight;
    reader.tell_once(Severity::Error, code!("gerber.scaled_lines"), block.at, block.text);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_tables_have_no_duplicates() {
        let letters: std::collections::BTreeSet<_> = COMMANDS.iter().map(|(letters, _)| letters).collect();
        let numbers: std::collections::BTreeSet<_> = CODES.iter().map(|(number, _)| number).collect();
        assert_eq!((letters.len(), numbers.len()), (COMMANDS.len(), CODES.len()));
    }
}
