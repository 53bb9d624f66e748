//! Infers how to read the numbers of a drill program, with the source of each part.

use super::survey::{Shape, Survey};
use crate::artwork::number::{Decimal, Reading};
use crate::artwork::{Digits, Overrides, Source, Units, Zeros};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::artwork) struct Stated {
    pub(in crate::artwork) units: Option<Units>,
    pub(in crate::artwork) digits: Option<Digits>,
    pub(in crate::artwork) zeros: Option<Zeros>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::artwork) struct Sensed {
    pub(in crate::artwork) reading: Reading,
    pub(in crate::artwork) units: Source,
    pub(in crate::artwork) digits: Source,
    pub(in crate::artwork) zeros: Source,
    pub(in crate::artwork) companion_disagrees: bool,
}

impl Sensed {
    pub(in crate::artwork) fn weakest(&self) -> Source {
        let numbers =
            if self.reading.zeros == Zeros::Decimal { self.units } else { self.digits.max(self.zeros) };
        self.units.max(numbers)
    }

    /// True if the source is a statement, not an inference.
    pub(in crate::artwork) fn stated(source: Source) -> bool {
        source <= Source::Companion
    }
}

pub(in crate::artwork) fn sense(survey: &Survey, companion: &Stated, person: &Overrides) -> Sensed {
    let said = |value: Option<(Zeros, Source)>| value.filter(|(zeros, _)| *zeros != Zeros::Decimal);
    let contradicts = |own: Option<(Zeros, Source)>, other: Option<Zeros>| matches!((said(own), other), (Some((own, _)), Some(other)) if own != other);
    let units_contradict =
        matches!((survey.units, companion.units), (Some((own, _)), Some(other)) if own != other);
    let distrusted = !survey.shape.decimal() && contradicts(survey.zeros, companion.zeros);
    let companion = if distrusted || units_contradict { &Stated::default() } else { companion };
    let (units, units_by) = person
        .units
        .map(|units| (units, Source::Person))
        .or(survey.units)
        .or(companion.units.map(|units| (units, Source::Companion)))
        .or_else(|| units_by_sizes(&survey.sizes).map(|units| (units, Source::Shape)))
        .unwrap_or((Units::Inch, Source::Default));
    let decimal = survey.shape.decimal() && person.zeros.is_none() && person.digits.is_none();
    let (zeros, zeros_by) = person
        .zeros
        .map(|zeros| (zeros, Source::Person))
        .or(decimal.then_some((Zeros::Decimal, Source::Header)))
        .or(said(survey.zeros))
        .or(companion.zeros.map(|zeros| (zeros, Source::Companion)))
        .unwrap_or_else(|| zeros_by_shape(&survey.shape));
    let (digits, digits_by) = person
        .digits
        .map(|digits| (digits, Source::Person))
        .or(survey.digits)
        .or(companion.digits.map(|digits| (digits, Source::Companion)))
        .unwrap_or_else(|| digits_by_shape(units, &survey.shape));
    Sensed {
        reading: Reading { units, digits, zeros },
        units: units_by,
        digits: digits_by,
        zeros: zeros_by,
        companion_disagrees: distrusted || units_contradict,
    }
}

/// The usual Excellon formats, if nothing is stated.
pub(in crate::artwork) const fn customary(units: Units) -> Digits {
    match units {
        Units::Mm => Digits { integer: 3, decimal: 3 },
        Units::Inch => Digits { integer: 2, decimal: 4 },
    }
}

/// The reading after a units statement: the decided one for its units, else with the stated or usual digits.
pub(super) fn after_switch(decided: Reading, units: Units, digits: Option<Digits>) -> Reading {
    if units == decided.units {
        decided
    } else {
        Reading { units, digits: digits.unwrap_or(customary(units)), zeros: decided.zeros }
    }
}

/// The units that a statement of `units` means. If the user or a trial reads the first coordinate in other
/// units than stated, every statement means the other ones.
pub(super) fn in_trial(decided: Reading, survey: &Survey, units: Units) -> Units {
    let other = if units == Units::Mm { Units::Inch } else { Units::Mm };
    if survey.units.is_some_and(|(stated, _)| stated != decided.units) { other } else { units }
}

/// Infers the units from drill sizes: drills are 0.1 to 7 mm.
pub(in crate::artwork) fn units_by_sizes(sizes: &[Decimal]) -> Option<Units> {
    let share = |units| {
        let plausible =
            |size: &&Decimal| size.length(units).is_some_and(|length| (0.1..=7.0).contains(&length.mm()));
        sizes.iter().filter(plausible).count()
    };
    let (mm, inch) = (share(Units::Mm), share(Units::Inch));
    match mm.cmp(&inch) {
        std::cmp::Ordering::Greater => Some(Units::Mm),
        std::cmp::Ordering::Less => Some(Units::Inch),
        std::cmp::Ordering::Equal => None,
    }
}

fn zeros_by_shape(shape: &Shape) -> (Zeros, Source) {
    if shape.longest > 0 && shape.shortest == shape.longest {
        (Zeros::None, Source::Shape)
    } else if shape.leading_zeros > 0 && shape.trailing_zeros == 0 {
        (Zeros::Trailing, Source::Shape)
    } else if shape.trailing_zeros > 0 && shape.leading_zeros == 0 {
        (Zeros::Leading, Source::Shape)
    } else {
        (Zeros::Leading, Source::Default)
    }
}

/// Numbers that all have exactly the usual number of digits confirm the usual format.
fn digits_by_shape(units: Units, shape: &Shape) -> (Digits, Source) {
    let digits = customary(units);
    (digits, if shape.is_full(digits) { Source::Shape } else { Source::Default })
}
