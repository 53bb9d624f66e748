//! Reads the words of a Gerber layer in one walk.
//!
//! Comes in: text. Goes out: a [`Gerber`] and remarks. Does not paint; includes are never opened.

use super::{Gerber, Track};
use crate::artwork::findings::Findings;
use crate::artwork::number::{Decimal, Reading, Scale, decimal};
use crate::artwork::text::{holds, starts};
use crate::artwork::{Digits, Units, Zeros};
use crate::geometry::{Point, chords};
use crate::remark::{Remark, Weight};
use crate::units::Length;
use std::collections::BTreeMap;

/// Objects kept of one layer.
const MOST_OBJECTS: usize = 500_000;
/// Apertures of one layer.
const MOST_APERTURES: usize = 10_000;
/// How far a chord may be from its arc.
const CHORD_ERROR_MM: f64 = 0.005;

/// A word and where it starts.
struct Block<'a> {
    text: &'a [u8],
    extended: bool,
    line: u32,
}

/// Splits a text at `*` and `%`; line ends do not count.
fn blocks(text: &[u8]) -> impl Iterator<Item = Block<'_>> {
    let (mut at, mut line, mut extended) = (0, 1, false);
    std::iter::from_fn(move || {
        loop {
            let rest = text.get(at..).filter(|rest| !rest.is_empty())?;
            let skipped = rest.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
            line += rest.iter().take(skipped).filter(|&&byte| byte == b'\n').count() as u32;
            at += skipped;
            let rest = text.get(at..)?;
            if rest.first() == Some(&b'%') {
                extended = !extended;
                at += 1;
                continue;
            }
            let length = rest.iter().position(|&byte| byte == b'*' || byte == b'%').unwrap_or(rest.len());
            let block = Block { text: rest.get(..length)?, extended, line };
            line += block.text.iter().filter(|&&byte| byte == b'\n').count() as u32;
            at += length + usize::from(rest.get(length) == Some(&b'*'));
            if !block.text.is_empty() {
                return Some(block);
            }
            if length == rest.len() {
                return None;
            }
        }
    })
}

/// Reads a layer.
pub(in crate::artwork) fn read(name: &str, text: &[u8]) -> (Gerber, Vec<Remark>) {
    let mut reader = Reader::new(name);
    for block in blocks(text) {
        if block.extended {
            reader.extended(&block);
        } else if starts(block.text, "G04") || starts(block.text, "G4 ") {
            reader.comment(block.text);
        } else {
            reader.words(&block);
        }
        if reader.out.pads.len() + reader.out.tracks.len() >= MOST_OBJECTS {
            reader.findings.at(Weight::Doubt, "gerber.too_many_objects", block.line, 1, b"");
            break;
        }
    }
    if reader.out.units.is_none() || reader.out.digits.is_none() {
        reader.findings.at(Weight::Doubt, "gerber.format_missing", 0, 0, b"");
    }
    (reader.out, reader.findings.finish())
}

struct Reader {
    findings: Findings,
    out: Gerber,
    scale: Option<Scale>,
    /// Half sizes of apertures by number.
    apertures: BTreeMap<u32, Length>,
    aperture: Option<u32>,
    at: Point,
    /// 1 draw, 2 move, 3 flash.
    action: u32,
    /// 1 straight, 2 clockwise, 3 counterclockwise.
    motion: u32,
    many_quadrants: bool,
    in_region: bool,
    incremental: bool,
}

/// The numbers of one block.
#[derive(Default)]
struct Numbers {
    x: Option<Decimal>,
    y: Option<Decimal>,
    i: Option<Decimal>,
    j: Option<Decimal>,
}

impl Reader {
    fn new(name: &str) -> Self {
        Self {
            findings: Findings::new(name),
            out: Gerber::default(),
            scale: None,
            apertures: BTreeMap::new(),
            aperture: None,
            at: Point::default(),
            action: 2,
            motion: 1,
            many_quadrants: false,
            in_region: false,
            incremental: false,
        }
    }

    fn comment(&mut self, text: &[u8]) {
        let text = text.get(3..).unwrap_or_default().trim_ascii();
        let shown = || {
            String::from_utf8_lossy(text)
                .chars()
                .filter(|letter| !letter.is_control())
                .take(80)
                .collect::<String>()
        };
        if let Some(at) = text.windows(3).position(|window| window == b"TF.") {
            self.attribute(text.get(at..).unwrap_or_default());
        } else if holds(text, "created by")
            || holds(text, "Creator:")
            || holds(text, "generated")
            || holds(text, "ULTIpost")
            || holds(text, "EasyEDA")
            || holds(text, "DipTrace")
        {
            self.out.generator.get_or_insert_with(shown);
        } else if holds(text, "layer") || starts(text, "Title") || holds(text, "Film Name") {
            self.out.layer_name.get_or_insert_with(shown);
        }
    }

    fn attribute(&mut self, text: &[u8]) {
        let value = |word: &str| {
            starts(text, word).then(|| {
                let rest = text.get(word.len()..).unwrap_or_default();
                String::from_utf8_lossy(rest)
                    .chars()
                    .filter(|letter| !letter.is_control())
                    .take(80)
                    .collect::<String>()
            })
        };
        if let Some(function) = value("TF.FileFunction,") {
            self.out.file_function = Some(function);
        } else if let Some(software) = value("TF.GenerationSoftware,") {
            self.out.generator = Some(software.replace(',', " "));
        }
    }

    fn extended(&mut self, block: &Block<'_>) {
        let text = block.text;
        match text {
            [b'F', b'S', rest @ ..] => self.format(rest, block.line),
            [b'M', b'O', b'I', ..] => self.set_units(Units::Inch),
            [b'M', b'O', ..] => self.set_units(Units::Mm),
            [b'A', b'D', b'D', rest @ ..] => self.aperture(rest, block),
            [b'T', b'F', ..] => self.attribute(text),
            [b'I', b'P', rest @ ..] => self.out.negative_image = starts(rest, "NEG"),
            [b'L', b'N' | b'P', b'C' | b'D'] | [b'S', b'R', ..] | [b'A', b'B', ..] => {}
            [b'L', b'N', rest @ ..] => {
                let name = String::from_utf8_lossy(rest).trim().to_owned();
                self.out.layer_name = Some(name);
            }
            [b'I', b'F', rest @ ..] => {
                self.findings.at(Weight::Loss, "gerber.include", block.line, 1, rest);
            }
            _ => {}
        }
    }

    fn format(&mut self, rest: &[u8], line: u32) {
        let zeros = if rest.contains(&b'T') { Zeros::Trailing } else { Zeros::Leading };
        let digits = rest.iter().position(|&byte| byte == b'X').and_then(|at| rest.get(at + 1..at + 3));
        match digits {
            Some(&[integer @ b'0'..=b'9', decimal @ b'0'..=b'9']) => {
                self.out.zeros = Some(zeros);
                self.out.digits = Some(Digits { integer: integer - b'0', decimal: decimal - b'0' });
                self.incremental = rest.get(1) == Some(&b'I');
                self.rescale();
            }
            _ => self.findings.at(Weight::Doubt, "gerber.bad_format", line, 1, rest),
        }
    }

    fn set_units(&mut self, units: Units) {
        self.out.units = Some(units);
        self.rescale();
    }

    fn rescale(&mut self) {
        if let (Some(units), Some(digits), Some(zeros)) = (self.out.units, self.out.digits, self.out.zeros) {
            self.scale = Some(Scale::new(Reading { units, digits, zeros }));
        }
    }

    /// `10C,0.8` or `11R,1.5X1.2` or a macro, whose size is not worked out.
    fn aperture(&mut self, rest: &[u8], block: &Block<'_>) {
        let units = self.out.units.unwrap_or(Units::Mm);
        let code =
            decimal(rest).and_then(|(number, used)| Some((u32::try_from(number.mantissa).ok()?, used)));
        let Some((code, used)) = code.filter(|_| self.apertures.len() < MOST_APERTURES) else {
            self.findings.at(Weight::Loss, "gerber.bad_aperture", block.line, 1, block.text);
            return;
        };
        let shape = rest.get(used..).unwrap_or_default();
        let sizes = shape
            .iter()
            .position(|&byte| byte == b',')
            .and_then(|at| shape.get(at + 1..))
            .unwrap_or_default();
        let smallest = sizes
            .split(|&byte| byte == b'X' || byte == b'x')
            .take(2)
            .filter_map(|part| decimal(part.trim_ascii())?.0.length(units))
            .min();
        let plain = matches!(shape, [b'C' | b'R' | b'O' | b'P', b',', ..]);
        if plain && smallest.is_none() {
            self.findings.at(Weight::Loss, "gerber.bad_aperture", block.line, 1, block.text);
        }
        let half = if plain { smallest.map_or(0, |length| length.nm() / 2) } else { 0 };
        self.apertures.insert(code, Length::from_nm(half));
    }

    fn words(&mut self, block: &Block<'_>) {
        let (mut numbers, mut at, mut acted) = (Numbers::default(), 0, false);
        while let Some(&letter) = block.text.get(at) {
            at += 1;
            if letter.is_ascii_whitespace() {
                continue;
            }
            let Some((number, used)) = decimal(block.text.get(at..).unwrap_or_default()) else {
                self.findings.once(Weight::Doubt, "gerber.unknown_word", block.line, at as u32, block.text);
                return;
            };
            at += used;
            match letter {
                b'X' => numbers.x = Some(number),
                b'Y' => numbers.y = Some(number),
                b'I' => numbers.i = Some(number),
                b'J' => numbers.j = Some(number),
                b'G' => self.g_code(number.mantissa),
                b'D' if number.mantissa >= 10 => self.select(number, block),
                b'D' => {
                    self.action = u32::try_from(number.mantissa).unwrap_or(2);
                    acted = true;
                }
                b'M' | b'N' => {}
                _ => self.findings.once(
                    Weight::Doubt,
                    "gerber.unknown_word",
                    block.line,
                    at as u32,
                    block.text,
                ),
            }
        }
        if numbers.x.is_some() || numbers.y.is_some() || acted && self.action == 3 {
            self.go(&numbers);
        }
    }

    fn select(&mut self, number: Decimal, block: &Block<'_>) {
        self.aperture = u32::try_from(number.mantissa).ok();
        if !self.aperture.is_some_and(|code| self.apertures.contains_key(&code)) {
            self.findings.once(Weight::Loss, "gerber.aperture_undefined", block.line, 1, block.text);
        }
    }

    fn g_code(&mut self, code: i64) {
        match code {
            1..=3 => self.motion = code as u32,
            36 => self.in_region = true,
            37 => {
                self.in_region = false;
                self.out.objects.regions += 1;
            }
            70 => self.set_units(Units::Inch),
            71 => self.set_units(Units::Mm),
            74 => self.many_quadrants = false,
            75 => self.many_quadrants = true,
            90 => self.incremental = false,
            91 => self.incremental = true,
            _ => {}
        }
    }

    fn go(&mut self, numbers: &Numbers) {
        let Some(scale) = self.scale else { return };
        let length = |number: Option<Decimal>| number.and_then(|number| scale.length(number));
        let axis = |at: Length, number: Option<Decimal>| match length(number) {
            Some(value) if self.incremental => Length::from_nm(at.nm().saturating_add(value.nm())),
            Some(value) => value,
            None => at,
        };
        let from = self.at;
        let to = Point::new(axis(from.x, numbers.x), axis(from.y, numbers.y));
        if to.x.abs() > Length::LIMIT || to.y.abs() > Length::LIMIT {
            return;
        }
        self.at = to;
        let half_width =
            self.aperture.and_then(|code| self.apertures.get(&code)).copied().unwrap_or_default();
        match (self.action, self.in_region) {
            (_, true) | (2, _) => {}
            (3, _) => {
                self.out.objects.flashes += 1;
                self.out.pads.push(to);
            }
            _ if self.motion == 1 => {
                self.out.objects.lines += 1;
                self.out.tracks.push(Track { from, to, half_width });
            }
            _ => {
                self.out.objects.arcs += 1;
                let offset = (length(numbers.i).unwrap_or_default(), length(numbers.j).unwrap_or_default());
                self.arc(from, to, offset, half_width);
            }
        }
    }

    /// In single-quadrant mode I and J have no sign: of the four middles, the one that fits both ends best and turns
    /// by a quarter at most.
    fn arc(&mut self, from: Point, to: Point, offset: (Length, Length), half_width: Length) {
        let clockwise = self.motion == 2;
        let signs: &[(i64, i64)] =
            if self.many_quadrants { &[(1, 1)] } else { &[(1, 1), (1, -1), (-1, 1), (-1, -1)] };
        let middle = |&(sx, sy): &(i64, i64)| Point::new(from.x + offset.0 * sx, from.y + offset.1 * sy);
        let fits = |centre: &Point| {
            let uneven = (from.distance_mm(*centre) - to.distance_mm(*centre)).abs();
            let turn = chords::turn(from, to, *centre, clockwise);
            uneven + if self.many_quadrants || turn < 1.6 { 0.0 } else { turn * 1_000.0 }
        };
        let best = signs.iter().map(middle).min_by(|a, b| fits(a).total_cmp(&fits(b)));
        let Some(centre) = best else { return };
        let mut last = from;
        for point in chords::arc(from, to, centre, clockwise, CHORD_ERROR_MM) {
            self.out.tracks.push(Track { from: last, to: point, half_width });
            last = point;
        }
    }
}
