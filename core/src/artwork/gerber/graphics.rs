//! The graphics state: action, interpolation, aperture, its transform, and the image's placement.

use super::Reader;
use super::object::{Object, ObjectShape};
use super::transform::{Held, Image, Transform};
use super::words::{At, Block, fields, number, plain};
use crate::artwork::number::Decimal;
use crate::code;
use crate::diagnostic::Severity;
use crate::geometry::{Path, Point};
use crate::units::Length;
use std::collections::BTreeMap;

/// Limit for scale factors of image and transforms; also for their inverse.
const MOST_SCALE_FACTOR: f64 = 100.0;
/// Limit for rotations, in either direction.
const MOST_TURN_DEG: f64 = 3_600.0;

/// The action of a coordinate.
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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quadrants {
    /// G74: at most a quarter turn; I and J have no sign.
    One,
    /// G75.
    Many,
}

#[derive(Clone, Debug)]
pub(super) struct Graphics {
    /// Current point as written, before the image transform.
    pub(super) at: Point,
    pub(super) action: Action,
    pub(super) interpolation: Interpolation,
    pub(super) quadrants: Option<Quadrants>,
    pub(super) aperture: Option<u32>,
    /// Between G36 and G37: the current contour.
    pub(super) region: Option<Path>,
    clear: bool,
    pub(super) image: Image,
    held: Held,
    /// Index of the current transform, including the image's rotation; none until the next use.
    transform: Option<u32>,
    /// Indices of transforms by mirroring, rotation and scale.
    transforms: BTreeMap<(bool, u64, u64), u32>,
}

impl Graphics {
    /// The initial state; the first transform is the identity.
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
    pub(super) fn put(&mut self, shape: ObjectShape, aperture: u32, At { line, column }: At) {
        let tag = self.attributes.tag_now(matches!(shape, ObjectShape::Contour(_)), &mut self.out.tags);
        let transform = self.graphics.transform_now(&mut self.out.transforms);
        let clear = self.graphics.clear;
        self.keep(Object { shape, clear, aperture, transform, tag, line, column });
    }

    /// `C` or `D` after `LP`.
    pub(super) fn polarity(&mut self, rest: &[u8], block: &Block<'_>) {
        match rest {
            b"C" | b"D" => {
                // An open region keeps the polarity that it was drawn with, as in every viewer.
                self.end_contour(block.at);
                self.graphics.clear = rest == b"C";
            }
            _ => self.tell_once(Severity::Error, code!("gerber.unknown_command"), block.at, block.text),
        }
    }

    pub(super) fn mirror(&mut self, rest: &[u8], block: &Block<'_>) {
        let known = matches!(rest, b"N" | b"X" | b"Y" | b"XY" | b"YX");
        let axes = known.then(|| (rest.contains(&b'X'), rest.contains(&b'Y')));
        self.hold(axes, block, |held, (x, y)| (held.mirror_x, held.mirror_y) = (x, y));
    }

    /// `90.0` after `LR`.
    pub(super) fn turn(&mut self, rest: &[u8], block: &Block<'_>) {
        let turn_deg = number(rest).filter(|turn| turn.abs() <= MOST_TURN_DEG);
        self.hold(turn_deg, block, |held, turn_deg| held.turn_deg = turn_deg);
    }

    /// `0.8` after `LS`.
    pub(super) fn scale(&mut self, rest: &[u8], block: &Block<'_>) {
        let factor = number(rest).filter(|factor| is_scale(*factor));
        self.hold(factor, block, |held, factor| held.scale = factor);
    }

    /// Changes the aperture transform; reports an invalid argument.
    fn hold<T>(&mut self, said: Option<T>, block: &Block<'_>, set: impl FnOnce(&mut Held, T)) {
        match said {
            Some(said) => set(&mut self.graphics.held, said),
            None => self.tell(Severity::Error, code!("gerber.bad_mount"), block.at, block.text),
        }
        self.graphics.transform = None;
    }

    /// `A1.5B0` after `OF`. This command and the three below are obsolete, but occur in old files.
    pub(super) fn image_offset(&mut self, rest: &[u8], block: &Block<'_>) {
        let units = self.format.size_units();
        let length = |n: Option<Decimal>| n.map_or(Some(Length::ZERO), |n| n.length(units));
        let offset = fields(rest, *b"AB").and_then(|[a, b]| length(a).zip(length(b)));
        self.place_image(offset, block, |image, (x, y)| image.offset = Point::new(x, y));
    }

    /// `A1B1` after `SF`.
    pub(super) fn image_scale(&mut self, rest: &[u8], block: &Block<'_>) {
        let factors = fields(rest, *b"AB").map(|both| both.map(|factor| factor.map_or(1.0, plain)));
        let factor = factors.filter(|[a, b]| a == b && is_scale(*a)).map(|[a, _]| a);
        self.place_image(factor, block, |image, factor| image.scale = (factor != 1.0).then_some(factor));
    }

    /// `A1B0` after `MI`.
    pub(super) fn image_mirror(&mut self, rest: &[u8], block: &Block<'_>) {
        let known = fields(rest, *b"AB");
        let known = known.filter(|both| both.iter().flatten().all(|n| matches!(n.mantissa, 0 | 1)));
        let axes = known.map(|both| both.map(|axis| axis.is_some_and(|n| n.mantissa != 0)));
        self.place_image(axes, block, |image, [x, y]| (image.mirror_x, image.mirror_y) = (x, y));
    }

    /// `90` after `IR`.
    pub(super) fn image_turn(&mut self, rest: &[u8], block: &Block<'_>) {
        let turn_deg = number(rest).filter(|turn| [0.0, 90.0, 180.0, 270.0].contains(turn));
        self.place_image(turn_deg, block, |image, turn_deg| image.quarters = (turn_deg / 90.0) as u8);
    }

    /// Changes the image transform; reports an invalid argument.
    fn place_image<T>(&mut self, said: Option<T>, block: &Block<'_>, set: impl FnOnce(&mut Image, T)) {
        let before = self.graphics.image;
        match said {
            Some(said) => set(&mut self.graphics.image, said),
            None => self.tell(Severity::Error, code!("gerber.image_place"), block.at, block.text),
        }
        if self.graphics.image != before {
            self.tell_once(Severity::Note, code!("gerber.image_moved"), block.at, block.text);
        }
        self.graphics.transform = None;
    }

    pub(super) fn image_polarity(&mut self, rest: &[u8], block: &Block<'_>) {
        match rest {
            b"POS" | b"NEG" => self.out.negative_image = rest == b"NEG",
            _ => self.tell_once(Severity::Error, code!("gerber.unknown_command"), block.at, block.text),
        }
    }

    /// G36: starts a region.
    pub(super) fn open_region(&mut self, block: &Block<'_>) {
        if self.graphics.region.is_some() {
            self.tell_once(Severity::Warning, code!("gerber.region_open"), block.at, block.text);
            self.end_contour(block.at);
        }
        self.graphics.region = Some(Path::default());
    }

    /// G37: ends the region.
    pub(super) fn close_region(&mut self, block: &Block<'_>) {
        if self.graphics.region.is_none() {
            self.tell_once(Severity::Warning, code!("gerber.unknown_word"), block.at, block.text);
        }
        self.end_contour(block.at);
        self.graphics.region = None;
    }
}

fn is_scale(factor: f64) -> bool {
    (1.0 / MOST_SCALE_FACTOR..=MOST_SCALE_FACTOR).contains(&factor)
}
