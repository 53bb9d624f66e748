//! Reads the blocks of a Gerber layer in one walk.
//!
//! Comes in: text. Goes out: a [`Gerber`] and remarks. Does not paint; includes are never opened.
//!
//! ```text
//!  block ─┬─ G04 …           comment, or attribute in a comment      attributes
//!         ├─ two letters      %FS %MO %AD %AM %AB %SR %LP %TF …       extended, copies
//!         ├─ in a macro       its lines                               macros
//!         └─ words            G X Y I J D M                           here ─▶ draw
//! ```

use super::attributes::Attributes;
use super::copies::Open;
use super::crossing;
use super::image::Image;
use super::macros::{self, Macro};
use super::mount::{Held, Mount};
use super::object::Tag;
use super::object::{Gerber, Object, Shape};
use super::paint::is_too_wide;
use super::words::{At, Block, Numbers, blocks, raised};
use crate::artwork::findings::Findings;
use crate::artwork::number::{Decimal, Reading, Scale, decimal};
use crate::artwork::text::{front, holds};
use crate::artwork::{Overrides, Units, Zeros};
use crate::geometry::{Path, Point};
use crate::remark::{Remark, Weight};
use std::collections::BTreeMap;

/// Objects kept of one layer, blocks included.
const MOST_OBJECTS: usize = 1_000_000;
/// Bytes looked through for units that stand behind the first aperture.
const LOOKED_AT: usize = 64 * 1024;

/// What the walk knows so far.
pub(super) struct Machine {
    pub(super) findings: Findings,
    pub(super) out: Gerber,
    /// What the coordinates mean, once format and units are known.
    pub(super) scale: Option<Scale>,
    /// Units before any were stated: those stated further down, else inches.
    pub(super) units_ahead: Option<Units>,
    /// Units of the first coordinate, once there was one.
    pub(super) first_units: Option<Units>,
    /// Apertures by D-code.
    pub(super) codes: BTreeMap<u32, u32>,
    pub(super) macros: BTreeMap<Vec<u8>, Macro>,
    /// The macro whose lines are being read.
    pub(super) macro_open: Option<Vec<u8>>,
    /// Bytes of macros that may still be worked through.
    pub(super) fuel: usize,
    pub(super) aperture: Option<u32>,
    /// Current point as written, before the image is placed.
    pub(super) at: Point,
    /// 1 draw, 2 move, 3 flash.
    pub(super) action: u32,
    /// 1 straight, 2 clockwise, 3 counter-clockwise.
    pub(super) motion: u32,
    /// Whether arcs may be longer than a quarter (G75), once stated.
    pub(super) many_quadrants: Option<bool>,
    /// The format was stated.
    pub(super) formatted: bool,
    pub(super) incremental: bool,
    /// Pairs of edges that may still be looked at for crossings.
    pub(super) pairs: u32,
    /// Inside G36 … G37: the contour so far.
    pub(super) region: Option<Path>,
    pub(super) clear: bool,
    pub(super) held: Held,
    /// Index of the mount with the image's turn, if it is known.
    pub(super) mount_index: Option<u32>,
    /// Indices of mounts, by mirror, turn and scale.
    pub(super) mounts: BTreeMap<(bool, u64, u64), u32>,
    pub(super) image: Image,
    pub(super) attributes: Attributes,
    pub(super) tags: BTreeMap<Tag, u32>,
    /// Index of the tag in force for flashes and strokes, and for contours, if it is known.
    pub(super) tag_index: [Option<u32>; 2],
    /// Blocks and repeats that are being written.
    pub(super) open: Vec<Open>,
    /// Objects kept.
    pub(super) kept: usize,
    /// Objects there are when all copies are made.
    pub(super) copies: u64,
    /// Whether a level (`%LN`) has named the layer.
    pub(super) level_named: bool,
    ended: bool,
}

/// Reads a layer. What a person says about its numbers counts where the layer says nothing.
pub(in crate::artwork) fn read(name: &str, text: &[u8], person: &Overrides) -> (Gerber, Vec<Remark>) {
    let text = &*raised(text);
    let mut machine = Machine::new(name, text);
    machine.overrule(person);
    machine.run(text);
    machine.finish()
}

impl Machine {
    pub(super) fn new(name: &str, text: &[u8]) -> Self {
        Self {
            findings: Findings::new(name),
            out: Gerber {
                size: text.len(),
                mounts: vec![Mount::PLAIN],
                tags: vec![Tag::default()],
                ..Gerber::default()
            },
            scale: None,
            units_ahead: units_ahead(front(text, LOOKED_AT)),
            first_units: None,
            codes: BTreeMap::new(),
            macros: BTreeMap::new(),
            macro_open: None,
            fuel: macros::FUEL,
            aperture: None,
            at: Point::default(),
            action: 2,
            motion: 1,
            many_quadrants: None,
            formatted: false,
            incremental: false,
            pairs: crossing::FUEL,
            region: None,
            clear: false,
            held: Held::PLAIN,
            mount_index: Some(0),
            mounts: BTreeMap::new(),
            image: Image::default(),
            attributes: Attributes::default(),
            tags: BTreeMap::from([(Tag::default(), 0)]),
            tag_index: [Some(0); 2],
            open: Vec::new(),
            kept: 0,
            copies: 0,
            level_named: false,
            ended: false,
        }
    }

    fn overrule(&mut self, person: &Overrides) {
        (self.out.digits, self.out.zeros) = (person.digits, person.zeros);
        self.units_ahead = person.units.or(self.units_ahead);
        self.rescale();
    }

    pub(super) fn run(&mut self, text: &[u8]) {
        for block in blocks(text) {
            if self.ended {
                self.tell(Weight::Note, "gerber.after_end", block.at, block.text);
                break;
            }
            if block.ended || block.is_whole() {
                self.block(&block);
            } else {
                self.tell(Weight::Loss, "gerber.cut_off", block.at, block.text);
            }
            if self.kept >= MOST_OBJECTS {
                self.tell(Weight::Loss, "gerber.too_many_objects", block.at, b"");
                break;
            }
        }
    }

    fn block(&mut self, block: &Block<'_>) {
        match block.text {
            [b'G' | b'g', b'0', b'4', rest @ ..] | [b'G' | b'g', b'4', b' ', rest @ ..] => {
                self.comment(rest, block.at);
            }
            [b'G', b'4'] => {}
            [b'0'..=b'9' | b'$', ..] if self.macro_open.is_some() => self.macro_line(block),
            [first, second, ..] if is_command(*first, *second) => {
                self.macro_open = None;
                self.extended(block);
            }
            _ => {
                self.macro_open = None;
                self.words(block);
            }
        }
    }

    pub(super) fn finish(mut self) -> (Gerber, Vec<Remark>) {
        if self.region.is_some() {
            self.findings.at(Weight::Doubt, "gerber.region_open", 0, 0, b"");
            self.end_contour(At::default());
        }
        self.close_all();
        if self.out.centre_bounds().is_some_and(is_too_wide) {
            self.findings.at(Weight::Loss, "gerber.out_of_reach", 0, 0, b"");
        }
        self.out.units = self.first_units.or(self.out.units).or(self.units_ahead);
        if self.out.units.is_none() || self.out.digits.is_none() {
            self.findings.at(Weight::Doubt, "gerber.format_missing", 0, 0, b"");
        } else if !self.ended {
            self.findings.at(Weight::Doubt, "gerber.no_end", 0, 0, b"");
        }
        (self.out, self.findings.finish())
    }

    pub(super) fn rescale(&mut self) {
        let units = self.out.units.or(self.units_ahead).unwrap_or(Units::Inch);
        let zeros = self.out.zeros.unwrap_or(Zeros::Leading);
        self.scale = self.out.digits.map(|digits| Scale::new(Reading { units, digits, zeros }));
    }

    /// Units of sizes that stand here.
    pub(super) fn size_units(&self) -> Units {
        self.out.units.or(self.units_ahead).unwrap_or(Units::Inch)
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
            match letter.to_ascii_uppercase() {
                b'X' if numbers.x.is_none() => numbers.x = Some(number),
                b'Y' if numbers.y.is_none() => numbers.y = Some(number),
                b'I' if numbers.i.is_none() => numbers.i = Some(number),
                b'J' if numbers.j.is_none() => numbers.j = Some(number),
                b'G' => self.g_code(number.mantissa, block),
                b'D' if number.mantissa >= 10 => self.select(number, block),
                b'D' if (1..=3).contains(&number.mantissa) => acted = Some(number.mantissa as u32),
                b'M' if number.mantissa == 0 || number.mantissa == 2 => self.ended = true,
                b'N' => {}
                b'X' | b'Y' | b'I' | b'J' | b'0'..=b'9' | b'.' | b'+' | b'-' => {
                    return self.bad_word(b'X', block, at - used - 1);
                }
                _ => {
                    let place = block.place(at - used - 1);
                    self.tell_once(Weight::Doubt, "gerber.unknown_word", place, block.text);
                }
            }
        }
        self.action = acted.unwrap_or(self.action);
        self.go(&numbers, acted, block.at);
    }

    /// A word that cannot be read. Where it would have moved or selected something, that is missing now.
    fn bad_word(&mut self, letter: u8, block: &Block<'_>, offset: usize) {
        let (weight, code) = match letter.to_ascii_uppercase() {
            b'X' | b'Y' | b'I' | b'J' | b'D' | b'G' | b'M' => (Weight::Loss, "gerber.broken_word"),
            b'0'..=b'9' | b'.' | b'+' | b'-' => (Weight::Loss, "gerber.broken_word"),
            _ => (Weight::Doubt, "gerber.unknown_word"),
        };
        self.tell_once(weight, code, block.place(offset), block.text);
    }

    /// Remarks something at a place.
    pub(super) fn tell(&mut self, weight: Weight, code: &str, at: At, found: &[u8]) {
        self.findings.at(weight, code, at.line, at.column, found);
    }

    /// Remarks something at a place, unless the same was said before.
    pub(super) fn tell_once(&mut self, weight: Weight, code: &str, at: At, found: &[u8]) {
        self.findings.once(weight, code, at.line, at.column, found);
    }

    fn select(&mut self, number: Decimal, block: &Block<'_>) {
        let code = u32::try_from(number.mantissa).ok();
        self.aperture = code.and_then(|code| self.codes.get(&code)).copied();
        if self.aperture.is_none() {
            self.tell_once(Weight::Loss, "gerber.aperture_undefined", block.at, block.text);
        }
    }

    fn g_code(&mut self, code: i64, block: &Block<'_>) {
        match code {
            1..=3 => self.motion = code as u32,
            10..=12 => {
                self.motion = 1;
                if code > 10 {
                    self.tell_once(Weight::Loss, "gerber.scaled_lines", block.at, block.text);
                }
            }
            36 => {
                if self.region.is_some() {
                    self.tell_once(Weight::Doubt, "gerber.region_open", block.at, block.text);
                    self.end_contour(block.at);
                }
                self.region = Some(Path::default());
            }
            37 => {
                if self.region.is_none() {
                    self.tell_once(Weight::Doubt, "gerber.unknown_word", block.at, block.text);
                }
                self.end_contour(block.at);
                self.region = None;
            }
            70 => self.set_units(Units::Inch, block.at),
            71 => self.set_units(Units::Mm, block.at),
            74 => self.many_quadrants = Some(false),
            75 => self.many_quadrants = Some(true),
            90 => self.incremental = false,
            91 => self.incremental = true,
            0 | 54 | 55 => {}
            _ => self.tell_once(Weight::Doubt, "gerber.unknown_word", block.at, block.text),
        }
    }

    /// States the units. A second, other statement counts from there on.
    pub(super) fn set_units(&mut self, units: Units, at: At) {
        let before = self.out.units.replace(units);
        if before.is_some_and(|before| before != units) {
            self.tell_once(Weight::Doubt, "gerber.units_change", at, units.name().as_bytes());
        }
        self.rescale();
    }

    /// Keeps an object.
    pub(super) fn put(&mut self, shape: Shape, aperture: u32, At { line, column }: At) {
        let (mount, tag) = (self.mount_now(), self.tag_now(matches!(shape, Shape::Contour(_))));
        let object = Object { shape, clear: self.clear, aperture, mount, tag, line, column };
        self.keep(object);
    }

    fn mount_now(&mut self) -> u32 {
        if let Some(index) = self.mount_index {
            return index;
        }
        let mount = self.image.turned(self.held.mount());
        let key = (mount.mirrored, mount.turn_deg.to_bits(), mount.scale.to_bits());
        let next = self.out.mounts.len() as u32;
        let index = *self.mounts.entry(key).or_insert(next);
        if index == next {
            self.out.mounts.push(mount);
        }
        self.mount_index = Some(index);
        index
    }
}

/// Whether a block that starts so is a command of two letters; words that lack their number are none.
fn is_command(first: u8, second: u8) -> bool {
    let word = matches!(first, b'X' | b'Y' | b'D' | b'G' | b'N');
    first.is_ascii_alphabetic() && second.is_ascii_alphabetic() && !word
}

/// Units stated anywhere near the start.
fn units_ahead(head: &[u8]) -> Option<Units> {
    let stated = |word: &str, units| holds(head, word).then_some(units);
    stated("MOIN*", Units::Inch)
        .or_else(|| stated("MOMM*", Units::Mm))
        .or_else(|| stated("G70", Units::Inch))
        .or_else(|| stated("G71", Units::Mm))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> (Gerber, Vec<String>) {
        let (gerber, remarks) = read("t.gbr", text.as_bytes(), &Overrides::default());
        (gerber, remarks.into_iter().map(|remark| remark.code).collect())
    }

    #[test]
    fn what_is_not_understood_is_remarked_with_its_weight() {
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
            ("X0Y12\n34D03*M02*", Some("gerber.broken_word")),
            ("XY0D03*M02*", Some("gerber.broken_word")),
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
    fn remarks_stand_where_the_word_is() {
        let text =
            "%FSLAX36Y36*%%MOMM*%\n%ADD10C,0.1*%%ZZ1*%\nD10*X0Y0D03*D11*\n  X1\n Q1Y5D03* X2X3D03*\nM01*X5";
        let (_, remarks) = read("t.gbr", text.as_bytes(), &Overrides::default());
        let place = |remark: &Remark| remark.place.as_ref().map(|place| (place.line, place.column));
        let found: Vec<_> =
            remarks.iter().map(|remark| (remark.code.as_str(), place(remark).unwrap())).collect();
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
    fn a_layer_in_small_letters_is_the_same_layer() {
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
    fn units_are_those_of_the_first_coordinate() {
        let (gerber, _) = read_text("%FSLAX24Y24*%%MOIN*%%ADD10C,0.01*%D10*X0Y0D03*G71*X1Y1D03*M02*");
        assert_eq!(gerber.units, Some(Units::Inch));
    }

    #[test]
    fn modal_words_draw_on() {
        let (gerber, remarks) = read_text(
            "%FSLAX24Y24*%%MOIN*%%ADD10C,0.01*%G54D10*X0Y0D02*X10000*D01*Y10000*X0*D03*X20000*M02*",
        );
        assert_eq!((gerber.counts.lines, gerber.counts.flashes), (2, 2), "{:?}", gerber.objects);
        assert_eq!(remarks, Vec::<String>::new());
    }
}
