//! Formats numbers for people: lengths in the chosen unit, times as clocks. The core parses what people type.

use annulus_core::code;
pub use annulus_core::locale::typed;

use crate::said::{Text, key};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;

/// The unit for displayed lengths. Internally all lengths are millimetres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unit {
    #[default]
    Millimetre,
    Inch,
}

impl Unit {
    pub fn of_mm(self, mm: f64) -> f64 {
        match self {
            Self::Millimetre => mm,
            Self::Inch => mm / 25.4,
        }
    }

    /// A coordinate with the resolution of a machine: 1 µm, or 0.0001 inch.
    pub fn coordinate(self, mm: f64) -> String {
        self.with_digits(mm, if self == Self::Inch { 4 } else { 3 })
    }

    pub fn apart(self, from: Point, to: Point) -> [String; 3] {
        let lengths_mm = [from.distance_mm(to), (to.x - from.x).mm(), (to.y - from.y).mm()];
        lengths_mm.map(|mm| self.coordinate(mm))
    }

    /// A coordinate without trailing zeros.
    pub fn short(self, mm: f64) -> String {
        let text = self.coordinate(mm);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    }

    /// A size as written on a drill.
    pub fn size(self, mm: f64) -> String {
        match self {
            Self::Inch => self.with_digits(mm, 4),
            Self::Millimetre => {
                let text = format!("{mm:.3}");
                let short = text.strip_suffix('0').unwrap_or(&text);
                short.strip_suffix('0').filter(|s| !s.ends_with('.')).unwrap_or(short).to_owned()
            }
        }
    }

    /// The longest round scale bar that fits `most_px`: 1, 2 or 5 times a power of ten in this unit. Returns
    /// its length in pixels and in the unit.
    pub fn scale(self, px_per_mm: f64, most_px: f64) -> Option<(f64, f64)> {
        let px_per_unit = px_per_mm / self.of_mm(1.0);
        let most = most_px / px_per_unit;
        if !(most.is_finite() && most > 0.0) {
            return None;
        }
        let decade = libm::pow(10.0, libm::floor(libm::log10(most)));
        let length = [5.0, 2.0, 1.0].map(|step| step * decade).into_iter().find(|length| *length <= most)?;
        Some((length * px_per_unit, length))
    }

    fn with_digits(self, mm: f64, digits: usize) -> String {
        rounded(self.of_mm(mm), digits)
    }
}

/// A number with fixed decimals, without a minus sign if it rounds to zero.
fn rounded(number: f64, digits: usize) -> String {
    let text = format!("{number:.digits$}");
    let is_zero = text.chars().all(|c| matches!(c, '-' | '0' | '.'));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

/// Diagnostics with `x` and `y` in file coordinates, apart from those of toolpaths (`cam.…`).
const NAME_PLACES: [&str; 11] = [
    code!("board.holes_in_layer_only"),
    code!("board.nets_meet"),
    code!("board.outline_frame_around"),
    code!("board.outline_frames"),
    code!("board.outline_mended"),
    code!("board.outline_part_empty"),
    code!("board.outline_trimmed"),
    code!("drawing.file_is_another"),
    code!("written.extra"),
    code!("written.missing"),
    code!("written.still"),
];

/// `found` with its `x` and `y` relative to `zero` instead of to the files' origin.
pub fn counted_from(found: &Diagnostic, zero: Point) -> Diagnostic {
    // `cam.zone_beside` repeats coordinates as the user typed them: don't convert these.
    let of_toolpaths = found.code.starts_with("cam.") && found.code != code!("cam.zone_beside");
    let mut found = found.clone();
    if !of_toolpaths && !NAME_PLACES.contains(&found.code.as_str()) {
        return found;
    }
    for (name, value) in &mut found.args {
        let by = match name.as_str() {
            "x" => zero.x,
            "y" => zero.y,
            _ => continue,
        };
        if let Ok(mm) = value.parse::<f64>() {
            let digits = value.split_once('.').map_or(0, |(_, decimals)| decimals.len());
            *value = rounded(mm - by.mm(), digits);
        }
    }
    found
}

/// A typed number from `low` to `high`.
pub fn typed_in(text: &str, (low, high): (f64, f64)) -> Option<f64> {
    typed(text).filter(|number| (low..=high).contains(number))
}

/// A typed whole number from `low` to `high`.
pub fn typed_whole(text: &str, (low, high): (u32, u32)) -> Option<u32> {
    let number = typed_in(text, (f64::from(low), f64::from(high)))?;
    (number.fract() == 0.0).then_some(number as u32)
}

/// A number with up to three decimals, without trailing zeros.
pub fn plain(value: f64) -> String {
    let text = format!("{value:.3}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A duration for people: `6 min 11 s`.
pub fn duration(seconds: f64) -> Text {
    let whole = if seconds.is_finite() { seconds.max(0.0).round() as u64 } else { 0 };
    let (h, min, s) = (whole / 3600, whole / 60 % 60, whole % 60);
    let (key, args) = match (h, min) {
        (0, 0) => (key!("page.duration.s"), vec![("s", s)]),
        (0, _) => (key!("page.duration.min"), vec![("min", min), ("s", s)]),
        _ => (key!("page.duration.h"), vec![("h", h), ("min", min)]),
    };
    Text::Key { key, args: args.into_iter().map(|(name, value)| (name, value.to_string())).collect() }
}

/// `00:42`; from one hour `1:02:03`.
pub fn clock(seconds: f64) -> String {
    let whole = if seconds.is_finite() { seconds.max(0.0) as u64 } else { 0 };
    let (hours, minutes, seconds) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 {
        format!("{hours}:{minutes:02}:{seconds:02}")
    } else {
        format!("{minutes:02}:{seconds:02}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_and_sizes_have_decimals_by_unit() {
        let rows = [
            (Unit::Millimetre, 12.7, "12.700", "12.7"),
            (Unit::Millimetre, 0.85, "0.850", "0.85"),
            (Unit::Millimetre, 3.0, "3.000", "3.0"),
            (Unit::Millimetre, 0.813, "0.813", "0.813"),
            (Unit::Millimetre, -0.0001, "0.000", "-0.0"),
            (Unit::Inch, 12.7, "0.5000", "0.5000"),
            (Unit::Inch, 0.8, "0.0315", "0.0315"),
        ];
        for (unit, mm, coordinate, size) in rows {
            assert_eq!(unit.coordinate(mm), coordinate);
            assert_eq!(unit.size(mm), size);
        }
        let short = [(Unit::Millimetre, 12.345_678, "12.346"), (Unit::Millimetre, -0.000_4, "0")];
        let more = [
            (Unit::Millimetre, 100.0, "100"),
            (Unit::Millimetre, 0.85, "0.85"),
            (Unit::Inch, 20.0, "0.7874"),
        ];
        for (unit, mm, text) in short.into_iter().chain(more) {
            assert_eq!(unit.short(mm), text);
        }
    }

    #[test]
    fn distance_parts_have_equal_decimals() {
        let (from, to) = (Point::from_mm(1.0, 2.0), Point::from_mm(4.0, 0.75));
        assert_eq!(Unit::Millimetre.apart(from, to), ["3.250", "3.000", "-1.250"]);
        assert_eq!(Unit::Inch.apart(from, to), ["0.1280", "0.1181", "-0.0492"]);
    }

    #[test]
    fn board_positions_count_from_work_zero_but_shifts_do_not() {
        let zero = Point::from_mm(100.0, -50.0);
        let rows = [
            ("cam.holes_outside", "112.345", "-40.00", "12.345 10.00"),
            ("board.nets_meet", "100.000", "-50.000", "0.000 0.000"),
            ("written.missing", "101.00", "-49.50", "1.00 0.50"),
            ("board.moved", "112.345", "-40.00", "112.345 -40.00"),
            ("cam.zone_beside", "1.00", "2.00", "1.00 2.00"),
        ];
        for (code, x, y, wanted) in rows {
            let found = Diagnostic::warning(code).with("x", x).with("y", y).with("count", 3);
            let told = counted_from(&found, zero);
            let values: Vec<&str> = told.args.iter().map(|(_, value)| value.as_str()).collect();
            assert_eq!(values.join(" "), format!("{wanted} 3"), "{code}");
        }
    }

    #[test]
    fn every_message_with_a_board_position_is_recognized() {
        // These are a displacement, and a zone as the user typed it.
        let others = [
            "board.holes_shifted",
            "board.moved",
            "board.outline_centred",
            "board.outline_could_move",
            "board.outline_shifted",
            "cam.zone_beside",
            "written.moved",
            "written.shifted",
        ];
        let mut places = 0;
        for (key, text) in annulus_core::locale::entries("en") {
            let Some(code) = key.strip_suffix(".message").filter(|_| text.contains("{x}")) else { continue };
            if !["board.", "cam.", "drawing.", "written."].iter().any(|part| code.starts_with(part)) {
                continue;
            }
            let found = Diagnostic::note(code).with("x", "1.00");
            let is_counted = counted_from(&found, Point::from_mm(1.0, 1.0)) != found;
            assert_eq!(is_counted, !others.contains(&code), "{code}");
            places += u32::from(is_counted);
        }
        assert!(places > 10, "{places}");
    }

    #[test]
    fn scale_bar_is_a_round_length_that_fits() {
        let rows = [
            (Unit::Millimetre, 10.0, Some((100.0, 10.0))),
            (Unit::Millimetre, 6.6, Some((66.0, 10.0))),
            (Unit::Millimetre, 900.0, Some((90.0, 0.1))),
            (Unit::Inch, 10.0, Some((50.8, 0.2))),
            (Unit::Millimetre, 0.0, None),
        ];
        for (unit, px_per_mm, expected) in rows {
            let found = unit.scale(px_per_mm, 120.0).map(|(px, length)| ((px * 10.0).round() / 10.0, length));
            assert_eq!(found, expected, "{px_per_mm}");
        }
    }

    #[test]
    fn durations_are_shown_in_their_largest_units() {
        let rows = [
            (0.4, "page.duration.s", vec!["0"]),
            (59.6, "page.duration.min", vec!["1", "0"]),
            (371.0, "page.duration.min", vec!["6", "11"]),
            (7_385.0, "page.duration.h", vec!["2", "3"]),
            (f64::NAN, "page.duration.s", vec!["0"]),
        ];
        for (seconds, expected, values) in rows {
            let Text::Key { key, args } = duration(seconds) else { panic!("a key") };
            let told: Vec<&str> = args.iter().map(|(_, value)| value.as_str()).collect();
            assert_eq!((key, told), (expected, values), "{seconds} s");
        }
    }

    #[test]
    fn clock_shows_minutes_and_seconds() {
        for (seconds, text) in
            [(0.0, "00:00"), (42.9, "00:42"), (870.0, "14:30"), (3723.0, "1:02:03"), (-3.0, "00:00")]
        {
            assert_eq!(clock(seconds), text);
        }
        assert_eq!(clock(f64::NAN), "00:00");
    }
}
