//! Reads the blocks of a Gerber layer in one pass.
//!
//! ```text
//!  block ─┬─ G04 …           comment, or attribute in a comment      attributes
//!         ├─ two letters      %FS %MO %AD %AM %AB %SR %LP %TF …       commands ─▶ the state
//!         ├─ in a macro       its lines                               macros
//!         └─ words            G                                       commands
//!                             X Y I J D M                             here ─▶ draw
//!
//!  state: format · apertures · graphics · attributes · step_repeat
//! ```

use super::Reader;
use super::aperture::Apertures;
use super::attributes::Attributes;
use super::crossing;
use super::format::Format;
use super::graphics::{Action, Graphics};
use super::object::{Gerber, Tag};
use super::paint::is_too_wide;
use super::step_repeat::StepRepeat;
use super::transform::Transform;
use super::words::{At, Block, Numbers, blocks, raised};
use crate::artwork::findings::Findings;
use crate::artwork::number::decimal;
use crate::artwork::text::front;
use crate::artwork::{Overrides, Units};
use crate::code;
use crate::diagnostic::{Diagnostic, Severity};

/// Maximum number of objects per layer, including blocks.
const MOST_OBJECTS: usize = 1_000_000;
/// Number of bytes searched for a units statement after the first aperture.
const LOOKED_AT: usize = 64 * 1024;

/// Reads a layer. The user's statements about numbers apply where the layer has none.
pub(in crate::artwork) fn read(name: &str, text: &[u8], person: &Overrides) -> (Gerber, Vec<Diagnostic>) {
    let text = &*raised(text);
    let mut reader = Reader::new(name, text, person);
    reader.run(text);
    reader.finish()
}

impl Reader {
    fn new(name: &str, text: &[u8], person: &Overrides) -> Self {
        Self {
            findings: Findings::new(name),
            out: Gerber {
                size: text.len(),
                transforms: vec![Transform::PLAIN],
                tags: vec![Tag::default()],
                ..Gerber::default()
            },
            format: Format::new(front(text, LOOKED_AT), person),
            apertures: Apertures::default(),
            graphics: Graphics::new(),
            attributes: Attributes::new(),
            step_repeat: StepRepeat::default(),
            pairs_left: crossing::FUEL,
            level_named: false,
            ended: false,
            cut: false,
        }
    }

    fn run(&mut self, text: &[u8]) {
        for block in blocks(text) {
            let joined = block.joined();
            let block = block.with(&joined);
            if self.ended {
                self.tell(Severity::Note, code!("gerber.after_end"), block.at, block.text);
                break;
            }
            if block.ended || block.is_whole() {
                self.block(&block);
            } else {
                self.tell(Severity::Error, code!("gerber.cut_off"), block.at, block.text);
            }
            if self.step_repeat.kept >= MOST_OBJECTS {
                self.tell(Severity::Error, code!("gerber.too_many_objects"), block.at, b"");
                self.cut = true;
                break;
            }
        }
    }

    fn block(&mut self, block: &Block<'_>) {
        match block.text {
            [b'G' | b'g', b'0', b'4', rest @ ..] | [b'G' | b'g', b'4', b' ', rest @ ..] => {
                self.comment(rest, block);
            }
            [b'G', b'4'] => {}
            [b'0'..=b'9' | b'$', ..] if self.apertures.macros.is_open() => self.macro_line(block),
            [first, second, rest @ ..] if is_command(*first, *second) => {
                self.apertures.macros.close();
                self.command([*first, *second], rest, block);
            }
            _ => {
                self.apertures.macros.close();
                self.words(block);
            }
        }
    }

    fn finish(mut self) -> (Gerber, Vec<Diagnostic>) {
        if self.graphics.region.is_some() {
            if !self.cut {
                // Without M02 the file was truncated inside the region, so copper is missing.
                let severity = if self.ended { Severity::Warning } else { Severity::Error };
                self.findings.at(severity, code!("gerber.region_open"), 0, 0, b"");
            }
            self.end_contour(At::default());
        }
        self.close_all();
        if self.out.centre_bounds().is_some_and(is_too_wide) {
            self.findings.at(Severity::Error, code!("gerber.out_of_reach"), 0, 0, b"");
        }
        (self.out.digits, self.out.zeros) = (self.format.digits, self.format.zeros);
        self.out.units = self.format.layer_units();
        if self.format.unstated {
            self.findings.at(
                Severity::Error,
                code!("gerber.units_missing"),
                0,
                0,
                Units::Inch.name().as_bytes(),
            );
        } else if self.out.units.is_none() || self.out.digits.is_none() {
            self.findings.at(Severity::Warning, code!("gerber.format_missing"), 0, 0, b"");
        } else if !self.ended && !self.cut {
            self.findings.at(Severity::Warning, code!("gerber.no_end"), 0, 0, b"");
        }
        (self.out, self.findings.finish())
    }

    fn words(&mut self, block: &Block<'_>) {
        let (mut numbers, mut at, mut acted) = (Numbers::default(), 0, None);
        while let Some(&letter) = block.text.get(at) {
            at += 1;
            if letter.is_ascii_whitespace() {
                continue;
            }
            let Some((number, used)) = decimal(block.text.get(at..).unwrap_or_default()) else {
                return self.bad_word(letter, block, at - 1);
            };
            at += used;
            if number.point {
                self.point(letter, block, at - used - 1);
            }
            match letter.to_ascii_uppercase() {
                b'X' if numbers.x.is_none() => numbers.x = Some(number),
                b'Y' if numbers.y.is_none() => numbers.y = Some(number),
                b'I' if numbers.i.is_none() => numbers.i = Some(number),
                b'J' if numbers.j.is_none() => numbers.j = Some(number),
                b'G' => self.code(number.mantissa, block),
                b'D' if number.mantissa >= 10 => self.select(number, block),
                b'D' if number.mantissa == 1 => acted = Some(Action::Draw),
                b'D' if number.mantissa == 2 => acted = Some(Action::Move),
                b'D' if number.mantissa == 3 => acted = Some(Action::Flash),
                b'M' if number.mantissa == 0 || number.mantissa == 2 => self.ended = true,
                b'N' => {}
                b'X' | b'Y' | b'I' | b'J' | b'0'..=b'9' | b'.' | b'+' | b'-' => {
                    return self.bad_word(b'X', block, at - used - 1);
                }
                _ => {
                    let place = block.place(at - used - 1);
                    self.tell_once(Severity::Warning, code!("gerber.unknown_word"), place, block.text);
                }
            }
        }
        self.graphics.action = acted.unwrap_or(self.graphics.action);
        self.go(&numbers, acted, block.at);
    }

    /// A number with a point, which coordinates and codes must not have. Reads it as written.
    fn point(&mut self, letter: u8, block: &Block<'_>, offset: usize) {
        let place = matches!(letter.to_ascii_uppercase(), b'X' | b'Y' | b'I' | b'J');
        let (severity, code) = if place {
            (Severity::Warning, code!("gerber.point"))
        } else {
            (Severity::Error, code!("gerber.broken_word"))
        };
        self.tell_once(severity, code, block.place(offset), block.text);
    }

    /// An unreadable word. An error if it would move or select something.
    fn bad_word(&mut self, letter: u8, block: &Block<'_>, offset: usize) {
        let (severity, code) = match letter.to_ascii_uppercase() {
            b'X' | b'Y' | b'I' | b'J' | b'D' | b'G' | b'M' => (Severity::Error, code!("gerber.broken_word")),
            b'0'..=b'9' | b'.' | b'+' | b'-' => (Severity::Error, code!("gerber.broken_word")),
            _ => (Severity::Warning, code!("gerber.unknown_word")),
        };
        self.tell_once(severity, code, block.place(offset), block.text);
    }

    pub(super) fn tell(&mut self, severity: Severity, code: &str, at: At, found: &[u8]) {
        self.findings.at(severity, code, at.line, at.column, found);
    }

    pub(super) fn tell_once(&mut self, severity: Severity, code: &str, at: At, found: &[u8]) {
        self.findings.once(severity, code, at.line, at.column, found);
    }
}

/// True if a block with these first letters is a two-letter command, and not a word without its number.
fn is_command(first: u8, second: u8) -> bool {
    let word = matches!(first, b'X' | b'Y' | b'D' | b'G' | b'N');
    first.is_ascii_alphabetic() && second.is_ascii_alphabetic() && !word
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> (Gerber, Vec<String>) {
        let (gerber, diagnostics) = read("t.gbr", text.as_bytes(), &Overrides::default());
        (gerber, diagnostics.into_iter().map(|diagnostic| diagnostic.code).collect())
    }

    #[test]
    fn layers_cut_at_the_object_limit_lack_no_end() {
        let objects = "X0Y0D03*".repeat(MOST_OBJECTS + 1);
        let (_, codes) = read_text(&format!("%FSLAX36Y36*%%MOMM*%%ADD10C,0.1*%D10*{objects}M02*"));
        assert_eq!(codes, ["gerber.too_many_objects"]);
    }

    #[test]
    fn unknown_input_is_reported_with_its_severity() {
        let head = "%FSLAX36Y36*%%MOMM*%%ADD10C,0.1*%D10*";
        for (body, code) in [
            ("X0Y0D03*M02*", None),
            ("X0Y0D03*", Some("gerber.no_end")),
            ("D11*X0Y0D03*M02*", Some("gerber.aperture_undefined")),
            ("Q1*M02*", Some("gerber.unknown_word")),
            ("M99*M02*", Some("gerber.unknown_word")),
            ("M01*M02*", Some("gerber.unknown_word")),
            ("G37*M02*", Some("gerber.unknown_word")),
            ("N5*D10*M02*", None),
            ("X0Y0D03*X12", Some("gerber.cut_off")),
            ("X0Y0D03*%ADD11C,0.", Some("gerber.cut_off")),
            ("X0Y0D03*M02", None),
            ("X0Y12\n34D03*M02*", None),
            ("X0Y12\r\n34D0\n3*M02*", None),
            ("X0Y12 34D03*M02*", Some("gerber.broken_word")),
            ("X0Y0D03\nX5Y5D03*M02*", Some("gerber.broken_word")),
            ("XY0D03*M02*", Some("gerber.broken_word")),
            ("X1.5Y2D03*M02*", Some("gerber.point")),
            ("X0Y0D03*M2.5*X5Y5D03*M02*", Some("gerber.broken_word")),
            ("X0Y0D03*\n\u{1A}", Some("gerber.no_end")),
            ("X0Y0D03*M02*\n\u{1A}", None),
            ("%AD\nD11C,0.5*%D11*X0Y0D03*M02*", None),
            ("X0Y0D*M02*", Some("gerber.broken_word")),
            ("X0X1D03*M02*", Some("gerber.broken_word")),
            ("x0y0d03*m02*", None),
            ("%ZZX*%M02*", Some("gerber.unknown_command")),
            ("%MOXX*%M02*", Some("gerber.bad_units")),
            ("%MOMMX*%M02*", Some("gerber.bad_units")),
            ("%IPPOS*%M02*", None),
            ("%IPPOSX*%M02*", Some("gerber.unknown_command")),
            ("%ASAXBY*%M02*", None),
            ("%ASBY*%M02*", Some("gerber.unknown_command")),
            ("%AS*%M02*", Some("gerber.unknown_command")),
            ("%ASAYBX*%M02*", Some("gerber.axes_swapped")),
            ("%ICX*%M02*", Some("gerber.unknown_command")),
            ("%IJQ*%M02*", Some("gerber.unknown_command")),
            ("%LMXY*%M02*", None),
            ("%LMQ*%M02*", Some("gerber.bad_mount")),
            ("%LR45Q*%M02*", Some("gerber.bad_mount")),
            ("%MIA2B0*%M02*", Some("gerber.image_place")),
            ("%OFA1Q*%M02*", Some("gerber.image_place")),
            ("%SFA1B1*%M02*", None),
            ("%SRX2Y2I1J1Q*%%SR*%M02*", Some("gerber.bad_repeat")),
            ("%ABD20Q*%%AB*%M02*", Some("gerber.bad_block")),
            ("%FSLAX36Y36Q*%M02*", Some("gerber.bad_format")),
            ("%FSQAX36Y36*%M02*", Some("gerber.bad_format")),
            ("%FSLAN2X36Y36D2M2*%M02*", Some("gerber.format_again")),
            ("%ADD12C,1X0.2X0.1X1*%M02*", Some("gerber.bad_aperture")),
            ("G36*X0Y0D02*X1D01*Y1D01*X0Y0D01*G36*G37*M02*", Some("gerber.region_open")),
            ("%LPX*%X0Y0D03*M02*", Some("gerber.unknown_command")),
            ("%FSLAX24Y24*%X0Y0D03*M02*", Some("gerber.format_again")),
            ("%ADD12C,0.5X0.6*%M02*", Some("gerber.aperture_hole")),
            ("%ADD12R,1X0.5X0.2X0.5*%M02*", Some("gerber.aperture_hole")),
            ("%ADD12R,1X0.5X0.4*%M02*", None),
            ("%ADD12R,0X1*%M02*", Some("gerber.aperture_empty")),
            ("%ADD12C,0*%M02*", None),
            ("G74*G03*X0Y0D02*X-2000000Y0I1000000J0D01*M02*", Some("gerber.arc_over_quarter")),
            ("G74*G03*X0Y0D02*X-1000000Y1000000I1000000J0D01*M02*", None),
            ("%IFother.gbr*%M02*", Some("gerber.include")),
            ("%MOIN*%M02*", Some("gerber.units_change")),
            ("M02*X0Y0D03*", Some("gerber.after_end")),
            ("G36*X0Y0D02*X1Y0D01*X1Y1D01*M02*", Some("gerber.region_open")),
            ("%AMBAD*1,1,$1+,0,0*%%ADD12BAD,1*%M02*", Some("gerber.bad_macro")),
        ] {
            let (_, codes) = read_text(&format!("{head}{body}"));
            assert_eq!(codes.iter().map(String::as_str).next(), code, "{body}: {codes:?}");
        }
    }

    #[test]
    fn lost_copper_is_always_an_error() {
        let square = "G36*X0Y0D02*X10000000D01*Y10000000D01*X0D01*Y0D01*";
        let hole = "X4000000Y4000000D02*X6000000D01*Y6000000D01*X4000000D01*Y4000000D01*";
        // The body, and the area in mm² as in viewers, else an error.
        for (body, area) in [
            (format!("{square}%LPC*%G36*{hole}G37*M02*"), Some(96.0)),
            (format!("{square}%LPC*%{hole}G37*M02*"), Some(96.0)),
            (format!("{square}%LPC*%G37*M02*"), Some(100.0)),
            (format!("{square}G36*{hole}G37*M02*"), Some(100.0)),
            (format!("{square}M02*"), Some(100.0)),
            (square.to_owned(), None),
            (format!("{square}X20000000Y0D03*G37*M02*"), None),
            (format!("%ABD20*%{square}G37*M02*"), None),
            (format!("%LPQ*%{square}G37*M02*"), None),
        ] {
            let text = format!("%FSLAX46Y46*%%MOMM*%%ADD10C,1*%D10*G01*{body}");
            let (gerber, diagnostics) = read("t.gbr", text.as_bytes(), &Overrides::default());
            let error = diagnostics.iter().any(|told| told.severity == Severity::Error);
            assert_eq!(error, area.is_none(), "{body}: {diagnostics:?}");
            let drawn = crate::geometry::area_mm2(&super::super::painted(&gerber).unwrap());
            assert!(area.is_none_or(|area| (drawn - area).abs() < 1e-3), "{body}: {drawn}");
        }
    }

    #[test]
    fn line_ends_inside_commands_are_ignored() {
        let plain = "%FSLAX36Y36*%%MOMM*%%TF.FileFunction,Copper,L1,Top*%%AMBox*0 a box*$2=$1x2*\
            21,1,$1,1.25,0,0,30*%%ADD10C,0.1*%%ADD11Box,0.5*%%ADD12R,1.5X0.25*%G04 Plain*\
            D10*X0Y0D02*X1000000Y2500000D01*D11*X5000000Y5000000D03*D12*X7Y8D03*G36*X0Y0D02*X1000D01*Y1000D01*X0Y0D01*G37*M02*";
        let (wanted, none) = read_text(plain);
        assert_eq!((wanted.apertures.len(), none), (3, Vec::new()));
        for end in ["\n", "\r\n", "\r"] {
            // A line end after each byte of every command; the comment stays unchanged.
            let (front, rest) = plain.split_once("G04 Plain*").unwrap();
            let broken = |text: &str| text.split("").collect::<Vec<_>>().join(end);
            let (found, codes) = read_text(&format!("{}G04 Plain*{}", broken(front), broken(rest)));
            assert_eq!(codes, Vec::<String>::new(), "{end:?}");
            let drawn = |gerber: &Gerber| {
                let shape = |object: &super::super::object::Object| {
                    (object.shape.clone(), object.aperture, object.tag)
                };
                gerber.objects.iter().map(shape).collect::<Vec<_>>()
            };
            assert_eq!(drawn(&found), drawn(&wanted), "{end:?}");
            assert_eq!(found.apertures, wanted.apertures, "{end:?}");
            assert_eq!(found.file_function, wanted.file_function, "{end:?}");
        }
    }

    #[test]
    fn problems_have_the_position_of_the_word() {
        let text =
            "%FSLAX36Y36*%%MOMM*%\n%ADD10C,0.1*%%ZZ1*%\nD10*X0Y0D03*D11*\n  X1\n Q1Y5D03* X2X3D03*\nM01*X5";
        let (_, diagnostics) = read("t.gbr", text.as_bytes(), &Overrides::default());
        let place =
            |diagnostic: &Diagnostic| diagnostic.place.as_ref().map(|place| (place.line, place.column));
        let found: Vec<_> = diagnostics
            .iter()
            .map(|diagnostic| (diagnostic.code.as_str(), place(diagnostic).unwrap()))
            .collect();
        let wanted = [
            ("gerber.unknown_command", (2, 15)),
            ("gerber.aperture_undefined", (3, 13)),
            ("gerber.unknown_word", (5, 2)),
            ("gerber.no_aperture", (4, 3)),
            ("gerber.broken_word", (5, 13)),
            ("gerber.unknown_word", (6, 1)),
            ("gerber.cut_off", (6, 5)),
            ("gerber.no_end", (0, 0)),
        ];
        assert_eq!(found, wanted);
    }

    #[test]
    fn lower_case_layers_equal_upper_case_ones() {
        let text = "G04 Small letters: 100%*%FSLAX36Y36*%%MOMM*%%TF.FileFunction,Copper,L1,Top*%\
            %AMBox*$2=$1x2*21,1,$1,$2,0,0,0*%%ADD10C,0.1*%%ADD11Box,0.5*%%TO.N,Gnd*%\
            D10*X0Y0D02*X1000000D01*G36*X0Y0D02*X1000D01*Y1000D01*X0Y0D01*G37*D11*X5Y5D03*M02*";
        let (wanted, none) = read_text(text);
        let small = text.to_ascii_lowercase().replace("g04 small", "g04 Small");
        let (found, codes) = read_text(&small);
        assert_eq!((codes, none), (Vec::new(), Vec::new()));
        assert_eq!(found.counts, wanted.counts);
        assert_eq!(found.objects, wanted.objects);
        assert_eq!(found.file_function.as_deref(), Some("copper,l1,top"));
        assert_eq!(found.tags[1].net.as_deref(), Some("gnd"));
    }

    #[test]
    fn first_coordinate_decides_the_units() {
        let (gerber, _) = read_text("%FSLAX24Y24*%%MOIN*%%ADD10C,0.01*%D10*X0Y0D03*G71*X1Y1D03*M02*");
        assert_eq!(gerber.units, Some(Units::Inch));
    }

    #[test]
    fn modal_words_continue_drawing() {
        let (gerber, diagnostics) = read_text(
            "%FSLAX24Y24*%%MOIN*%%ADD10C,0.01*%G54D10*X0Y0D02*X10000*D01*Y10000*X0*D03*X20000*M02*",
        );
        assert_eq!((gerber.counts.lines, gerber.counts.flashes), (2, 2), "{:?}", gerber.objects);
        assert_eq!(diagnostics, Vec::<String>::new());
    }
}
