//! A plot as text: the value at a cursor, a summary in words, rows of a table.

use annulus_core::plot::{Plot, PlotPanel, Series, SeriesLook};

const ROWS: usize = 25;

/// The value of `series` at `x`: interpolated, or held since the last point. None outside the data, in gaps
/// and for bars.
pub fn value_at(series: &Series, x: f64) -> Option<f64> {
    if matches!(series.look, SeriesLook::Bars) {
        return None;
    }
    let behind = series.points.partition_point(|point| point[0] <= x);
    let left = *series.points.get(behind.checked_sub(1)?)?;
    let value = match (series.look, series.points.get(behind)) {
        (SeriesLook::Stairs, _) => left[1],
        (_, None) if left[0] == x => left[1],
        (_, None) => return None,
        (_, Some(right)) => {
            let share = (x - left[0]) / (right[0] - left[0]);
            left[1] + share * (right[1] - left[1])
        }
    };
    value.is_finite().then_some(value)
}

/// A number with four significant digits.
pub fn short(value: f64) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e7).contains(&size) {
        return format!("{value:.3e}").replace('-', "−");
    }
    let digits = if size >= 1000.0 {
        0
    } else if size >= 100.0 {
        1
    } else if size >= 10.0 {
        2
    } else {
        3
    };
    let digits = if size < 0.1 && size > 0.0 { 5 } else { digits };
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.replace('-', "−") }
}

/// The lowest and highest x in the plot.
pub fn reach(plot: &Plot) -> Option<[f64; 2]> {
    let xs = plot.panels.iter().flat_map(|panel| &panel.series).flat_map(|series| &series.points);
    let xs = xs.map(|point| point[0]).filter(|x| x.is_finite());
    xs.fold(None, |reach, x| match reach {
        None => Some([x, x]),
        Some([low, high]) => Some([f64::min(low, x), f64::max(high, x)]),
    })
}

/// The name and value with unit of every curve of `panel` at `x`.
pub fn at_cursor(panel: &PlotPanel, x: f64) -> Vec<(String, String)> {
    let lines = panel.series.iter().filter_map(|series| {
        let value = value_at(series, x)?;
        let name = if series.name.is_empty() { &panel.y.label } else { &series.name };
        Some((name.clone(), with_unit(value, &panel.y.unit)))
    });
    lines.collect()
}

pub fn with_unit(value: f64, unit: &str) -> String {
    if unit.is_empty() { short(value) } else { format!("{} {unit}", short(value)) }
}

/// The range of every curve in words: `speed: S-curve 0 … 12 mm/s`.
pub fn summary(plot: &Plot) -> String {
    let mut parts = Vec::new();
    for panel in &plot.panels {
        for series in panel.series.iter().filter(|series| !matches!(series.look, SeriesLook::Bars)) {
            let values = series.points.iter().map(|point| point[1]).filter(|value| value.is_finite());
            let (low, high) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
            if low <= high {
                let name = if series.name.is_empty() { String::new() } else { format!(" {}", series.name) };
                let high = with_unit(high, &panel.y.unit);
                parts.push(format!("{}{name}: {} … {high}", panel.y.label, short(low)));
            }
        }
    }
    parts.join("; ")
}

/// A table of `panel`: x and the value of every curve there.
pub fn rows(panel: &PlotPanel, reach: [f64; 2]) -> Vec<(f64, Vec<Option<f64>>)> {
    let [low, high] = reach;
    let xs = (0..ROWS).map(|row| {
        let share = row as f64 / (ROWS - 1) as f64;
        if row + 1 == ROWS { high } else { low + share * (high - low) }
    });
    xs.map(|x| (x, panel.series.iter().map(|series| value_at(series, x)).collect())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::plot::PlotAxis;

    fn ramp() -> Series {
        Series::line("ramp", vec![[0.0, 0.0], [2.0, 4.0], [2.0, 10.0], [4.0, 10.0]])
    }

    #[test]
    fn cursor_value_is_interpolated_within_the_series() {
        let rows = [
            (-1.0, None),
            (0.0, Some(0.0)),
            (1.0, Some(2.0)),
            (3.0, Some(10.0)),
            (4.0, Some(10.0)),
            (5.0, None),
        ];
        for (x, value) in rows {
            assert_eq!(value_at(&ramp(), x), value, "{x}");
        }
        let stairs = ramp().looking(SeriesLook::Stairs);
        assert_eq!(value_at(&stairs, 1.9), Some(0.0));
        assert_eq!(value_at(&stairs, 99.0), Some(10.0));
        let gap = Series::line("", vec![[0.0, 1.0], [1.0, f64::NAN], [2.0, 1.0]]);
        assert_eq!(value_at(&gap, 0.5), None);
        assert_eq!(value_at(&Series::default(), 0.0), None);
    }

    #[test]
    fn short_numbers_are_rounded_without_losing_magnitude() {
        let rows = [
            (0.0, "0"),
            (12.3456, "12.35"),
            (0.05, "0.05"),
            (-3.0, "−3"),
            (123_456.7, "123457"),
            (2e9, "2.000e9"),
            (1e-9, "1.000e−9"),
            (f64::NAN, "–"),
        ];
        for (value, text) in rows {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn plot_has_a_text_summary_and_a_table() {
        let panel =
            PlotPanel { y: PlotAxis::new("speed", "mm/s"), series: vec![ramp()], ..PlotPanel::default() };
        let plot = Plot { title: String::new(), panels: vec![panel.clone()] };
        assert_eq!(summary(&plot), "speed ramp: 0 … 10 mm/s");
        assert_eq!(reach(&plot), Some([0.0, 4.0]));
        let table = rows(&panel, [0.0, 4.0]);
        assert_eq!((table.len(), table[ROWS - 1].0), (ROWS, 4.0));
        assert_eq!(table[6].1, [Some(2.0)]);
        assert_eq!(at_cursor(&panel, 1.0), [("ramp".to_owned(), "2 mm/s".to_owned())]);
        assert_eq!(reach(&Plot::default()), None);
    }
}
