//! The graphics state: what the next coordinate does, with which aperture, how that is held, and where the image lies.
//!
//! Comes in: D01 to D03, G01 to G03, G74, G75, `%LP`, `%LM`, `%LR`, `%LS`, and the old `%OF`, `%SF`, `%MI`, `%IR`. Goes out:
//! the state, and objects that carry it. Does not read coordinates.

use super::image::Image;
use super::object::{Object, ObjectShape};
use super::reader::Reader;
use super::transform::{Held, Transform};
use super::words::{At, Block, fields, number, plain};
use crate::artwork::number::Decimal;
use crate::diagnostic::Severity;
use crate::geometry::{Path, Point};
use crate::units::Length;
use std::collections::BTreeMap;

/// Scales of the image and of transforms, either way.
const MOST_SCALE_FACTOR: f64 = 100.0;
/// Degrees of a turn, either way.
const MOST_TURN_DEG: f64 = 3_600.0;

/// What a coordinate does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Action {
    /// D01.
    Draw,
    /// D02.
    #[default]
    Move,
    /// D03.
    Flash,
}

/// On what way it is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Interpolation {
    /// G01.
    #[default]
    Straight,
    /// G02.
    Clockwise,
    /// G03.
    Counter,
}

/// How far an arc goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quadrants {
    /// G74: a quarter at most, I and J without sign.
    One,
    /// G75.
    Many,
}

/// The state that coordinates meet.
#[derive(Clone, Debug)]
pub(super) struct Graphics {
    /// Current point as written, before the image is placed.
    pub(super) at: Point,
    pub(super) action: Action,
    pub(super) interpolation: Interpolation,
    /// Once stated.
    pub(super) quadrants: Option<Quadrants>,
    /// Index of the aperture in force.
    pub(super) aperture: Option<u32>,
    /// Inside G36 … G37: the contour so far.
    pub(super) region: Option<Path>,
    /// Clear polarity.
    clear: bool,
    pub(super) image: Image,
    held: Held,
    /// Index of the transform with the image's turn, if it is known.
    transform: Option<u32>,
    /// Indices of transforms, by mirror, turn and scale.
    transforms: BTreeMap<(bool, u64, u64), u32>,
}

impl Graphics {
    /// As every layer starts; the first transform is the plain one.
    pub(super) fn new() -> Self {
        Self {
            at: Point::default(),
            action: Action::default(),
            interpolation: Interpolation::default(),
            quadrants: None,
            aperture: None,
            region: None,
            clear: false,
            image: Image::default(),
            held: Held::PLAIN,
            transform: Some(0),
            transforms: BTreeMap::new(),
        }
    }

    /// Index of the transform in force among `all`.
    fn transform_now(&mut self, all: &mut Vec<Transform>) -> u32 {
        *self.transform.get_or_insert_with(|| {
            let transform = self.image.turned(self.held.transform());
            let key = (transform.mirrored, transform.turn_deg.to_bits(), transform.scale.to_bits());
            let next = all.len() as u32;
            let index = *self.transforms.entry(key).or_insert(next);
            if index == next {
                all.push(transform);
            }
            index
        })
    }
}

impl Reader {
    /// Keeps an object with the state in force.
    pub(super) fn put(&mut self, shape: ObjectShape, aperture: u32, At { line, column }: At) {
        let tag = self.attributes.tag_now(matches!(shape, ObjectShape::Contour(_)), &mut self.out.tags);
        let transform = self.graphics.transform_now(&mut self.out.transforms);
        let clear = self.graphics.clear;
        self.keep(Object { shape, clear, aperture, transform, tag, line, column });
    }

    /// `C` or `D` behind `LP`.
    pub(super) fn polarity(&mut self, rest: &[u8], block: &Block<'_>) {
        match rest {
            b"C" | b"D" => self.graphics.clear = rest == b"C",
            _ => self.tell_once(Severity::Warning, "gerber.unknown_command", block.at, block.text),
        }
    }

    /// `XY` behind `LM`.
    pub(super) fn mirror(&mut self, rest: &[u8], block: &Block<'_>) {
        let known = matches!(rest, b"N" | b"X" | b"Y" | b"XY" | b"YX");
        let axes = known.then(|| (rest.contains(&b'X'), rest.contains(&b'Y')));
        self.hold(axes, block, |held, (x, y)| (held.mirror_x, held.mirror_y) = (x, y));
    }

    /// `90.0` behind `LR`.
    pub(super) fn turn(&mut self, rest: &[u8], block: &Block<'_>) {
        let turn_deg = number(rest).filter(|turn| turn.abs() <= MOST_TURN_DEG);
        self.hold(turn_deg, block, |held, turn_deg| held.turn_deg = turn_deg);
    }

    /// `0.8` behind `LS`.
    pub(super) fn scale(&mut self, rest: &[u8], block: &Block<'_>) {
        let factor = number(rest).filter(|factor| is_scale(*factor));
        self.hold(factor, block, |held, factor| held.scale = factor);
    }

    /// Holds apertures otherwise, where what was said is understood.
    fn hold<T>(&mut self, said: Option<T>, block: &Block<'_>, set: impl FnOnce(&mut Held, T)) {
        match said {
            Some(said) => set(&mut self.graphics.held, said),
            None => self.tell(Severity::Error, "gerber.bad_mount", block.at, block.text),
        }
        self.graphics.transform = None;
    }

    /// `A1.5B0` behind `OF`: gone from the format, found in old files, as the three below.
    pub(super) fn image_offset(&mut self, rest: &[u8], block: &Block<'_>) {
        let units = self.format.size_units();
        let length = |n: Option<Decimal>| n.map_or(Some(Length::ZERO), |n| n.length(units));
        let offset = fields(rest, *b"AB").and_then(|[a, b]| length(a).zip(length(b)));
        self.place_image(offset, block, |image, (x, y)| image.offset = Point::new(x, y));
    }

    /// `A1B1` behind `SF`.
    pub(super) fn image_scale(&mut self, rest: &[u8], block: &Block<'_>) {
        let factors = fields(rest, *b"AB").map(|both| both.map(|factor| factor.map_or(1.0, plain)));
        let factor = factors.filter(|[a, b]| a == b && is_scale(*a)).map(|[a, _]| a);
        self.place_image(factor, block, |image, factor| image.scale = (factor != 1.0).then_some(factor));
    }

    /// `A1B0` behind `MI`.
    pub(super) fn image_mirror(&mut self, rest: &[u8], block: &Block<'_>) {
        let known = fields(rest, *b"AB");
        let known = known.filter(|both| both.iter().flatten().all(|n| matches!(n.mantissa, 0 | 1)));
        let axes = known.map(|both| both.map(|axis| axis.is_some_and(|n| n.mantissa != 0)));
        self.place_image(axes, block, |image, [x, y]| (image.mirror_x, image.mirror_y) = (x, y));
    }

    /// `90` behind `IR`.
    pub(super) fn image_turn(&mut self, rest: &[u8], block: &Block<'_>) {
        let turn_deg = number(rest).filter(|turn| [0.0, 90.0, 180.0, 270.0].contains(turn));
        self.place_image(turn_deg, block, |image, turn_deg| image.quarters = (turn_deg / 90.0) as u8);
    }

    /// Places the image otherwise, where what was said is understood.
    fn place_image<T>(&mut self, said: Option<T>, block: &Block<'_>, set: impl FnOnce(&mut Image, T)) {
        let before = self.graphics.image;
        match said {
            Some(said) => set(&mut self.graphics.image, said),
            None => self.tell(Severity::Error, "gerber.image_place", block.at, block.text),
        }
        if self.graphics.image != before {
            self.tell_once(Severity::Note, "gerber.image_moved", block.at, block.text);
        }
        self.graphics.transform = None;
    }

    /// `POS` or `NEG` behind `IP`.
    pub(super) fn image_polarity(&mut self, rest: &[u8], block: &Block<'_>) {
        match rest {
            b"POS" | b"NEG" => self.out.negative_image = rest == b"NEG",
            _ => self.tell_once(Severity::Warning, "gerber.unknown_command", block.at, block.text),
        }
    }

    /// G36: a contour begins.
    pub(super) fn open_region(&mut self, block: &Block<'_>) {
        if self.graphics.region.is_some() {
            self.tell_once(Severity::Warning, "gerber.region_open", block.at, block.text);
            self.end_contour(block.at);
        }
        self.graphics.region = Some(Path::default());
    }

    /// G37: it ends.
    pub(super) fn close_region(&mut self, block: &Block<'_>) {
        if self.graphics.region.is_none() {
            self.tell_once(Severity::Warning, "gerber.unknown_word", block.at, block.text);
        }
        self.end_contour(block.at);
        self.graphics.region = None;
    }
}

fn is_scale(factor: f64) -> bool {
    (1.0 / MOST_SCALE_FACTOR..=MOST_SCALE_FACTOR).contains(&factor)
}
