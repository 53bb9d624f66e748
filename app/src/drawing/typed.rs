//! Parser of typed lengths and positions: `0,8`, `20 mil`, `x 10 y 5`, `12.7; 5`, `@5 0`.
//!
//! Reads point and comma as decimal marks; rejects ambiguous input.

use crate::format::Unit;
use annulus_core::geometry::Point;
use annulus_core::locale::typed;
use annulus_core::units::Length;

/// Larger than any board.
const MOST_MM: f64 = 10_000.0;

/// A length in the typed unit, else in `unit`.
pub fn length(text: &str, unit: Unit) -> Option<Length> {
    millimetres(text, unit).filter(|mm| mm.abs() <= MOST_MM).map(Length::from_mm)
}

/// Like [`length`], in mm and without its limit.
pub fn millimetres(text: &str, unit: Unit) -> Option<f64> {
    let text = text.trim().to_lowercase();
    let units = [
        ("mm", 1.0),
        ("mil", 0.0254),
        ("inch", 25.4),
        ("in", 25.4),
        ("\"", 25.4),
        ("µm", 0.001),
        ("um", 0.001),
    ];
    let found = units.into_iter().find_map(|(word, mm)| Some((text.strip_suffix(word)?, mm)));
    let own = if unit == Unit::Inch { 25.4 } else { 1.0 };
    let (number, mm) = found.unwrap_or((&text, own));
    Some(typed(number)? * mm)
}

pub fn degrees(text: &str) -> Option<i32> {
    let degrees = typed(text.trim().trim_end_matches('°'))?;
    (degrees.abs() <= 3_600.0).then(|| libm::round(degrees * 1_000.0) as i32)
}

/// A position. Text that begins with `@` is relative to `from`; an axis that isn't typed keeps its value in
/// `from`.
pub fn place(text: &str, from: Point, unit: Unit) -> Option<Point> {
    let text = text.trim();
    let (text, by) = match text.strip_prefix('@') {
        Some(rest) => (rest.trim(), true),
        None => (text, false),
    };
    let (x, y) = if text.contains(['x', 'y', 'X', 'Y']) { axes(text, unit)? } else { pair(text, unit)? };
    let along = |typed: Option<Length>, from: Length| match typed {
        Some(length) if by => from + length,
        Some(length) => length,
        None => from,
    };
    Some(Point::new(along(x, from.x), along(y, from.y)))
}

type Typed = (Option<Length>, Option<Length>);

/// `x 10 y 5`, in either order, each at most once.
fn axes(text: &str, unit: Unit) -> Option<Typed> {
    let mut found: Typed = (None, None);
    let mut rest = text.trim();
    while let Some(axis) = rest.chars().next() {
        let behind = rest.get(1..)?;
        let until = behind.find(['x', 'y', 'X', 'Y']).unwrap_or(behind.len());
        let number = behind.get(..until)?.trim().trim_start_matches('=').trim_end_matches([',', ';']);
        let place = match axis {
            'x' | 'X' => &mut found.0,
            'y' | 'Y' => &mut found.1,
            _ => return None,
        };
        if place.replace(length(number, unit)?).is_some() {
            return None;
        }
        rest = behind.get(until..)?.trim();
    }
    Some(found)
}

/// Two numbers separated by a semicolon or a space, or by a single comma.
fn pair(text: &str, unit: Unit) -> Option<Typed> {
    let parts: Vec<&str> = if text.contains(';') {
        text.split(';').collect()
    } else if text.contains(char::is_whitespace) {
        let parts: Vec<&str> = text.split_whitespace().collect();
        // A comma before the space is a separator, not a decimal mark.
        return match parts.as_slice() {
            [x, y] => Some((Some(length(x.trim_end_matches(','), unit)?), Some(length(y, unit)?))),
            _ => None,
        };
    } else {
        text.split(',').collect()
    };
    match parts.as_slice() {
        [x, y] if !is_grouped(x, y) => Some((Some(length(x, unit)?), Some(length(y, unit)?))),
        _ => None,
    }
}

/// True if the two numbers could also be one number with a thousands separator: `1,234.5`.
fn is_grouped(x: &str, y: &str) -> bool {
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let whole = x.trim_start_matches('-');
    let thousands = y.split_once('.').is_some_and(|(before, _)| before.len() == 3 && digits(before));
    thousands && (1..=3).contains(&whole.len()) && digits(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typed_positions_parse_with_units_and_relative_marks() {
        let from = Point::from_mm(1.0, 2.0);
        let rows = [
            ("x 10 y 5", Some((10.0, 5.0))),
            ("Y5 X10", Some((10.0, 5.0))),
            ("x10,5 y-0,5", Some((10.5, -0.5))),
            ("x=10, y=5", Some((10.0, 5.0))),
            ("x 7", Some((7.0, 2.0))),
            ("10,5", Some((10.0, 5.0))),
            ("10.5,5.25", Some((10.5, 5.25))),
            ("12,34.5", Some((12.0, 34.5))),
            ("1,234.5", None),
            ("@-1,234.5", None),
            ("1; 234.5", Some((1.0, 234.5))),
            ("1.5,234.5", Some((1.5, 234.5))),
            ("10,5; 5,25", Some((10.5, 5.25))),
            ("10,5 5,25", Some((10.5, 5.25))),
            ("10, 5", Some((10.0, 5.0))),
            ("@5,0", Some((6.0, 2.0))),
            ("@ x -1", Some((0.0, 2.0))),
            ("@2,54 0", Some((3.54, 2.0))),
            ("100mil 1in", Some((2.54, 25.4))),
            ("", None),
            ("7", None),
            ("@", None),
            ("10,5,3", None),
            ("x1 x2", None),
            ("1,234.5 3", None),
            ("ten five", None),
            ("x y", None),
            ("é,ß", None),
            ("99999 0", None),
        ];
        for (text, expected) in rows {
            let expected = expected.map(|(x, y)| Point::from_mm(x, y));
            assert_eq!(place(text, from, Unit::Millimetre), expected, "{text}");
        }
        assert_eq!(place("@1 0", from, Unit::Inch), Some(Point::from_mm(26.4, 2.0)));
    }

    #[test]
    fn typed_lengths_and_angles_parse_with_units() {
        let rows = [
            ("0,8", Unit::Millimetre, Some(0.8)),
            ("0.8 mm", Unit::Inch, Some(0.8)),
            ("20mil", Unit::Millimetre, Some(0.508)),
            ("1\"", Unit::Millimetre, Some(25.4)),
            ("0.1", Unit::Inch, Some(2.54)),
            ("600 µm", Unit::Millimetre, Some(0.6)),
            ("wide", Unit::Millimetre, None),
            ("1e9", Unit::Millimetre, None),
        ];
        for (text, unit, mm) in rows {
            assert_eq!(length(text, unit), mm.map(Length::from_mm), "{text}");
        }
        assert_eq!([degrees("45"), degrees("-22,5°"), degrees("a")], [Some(45_000), Some(-22_500), None]);
    }
}
