//! Renders a plot as SVG for reports: white background, with colours and dashes that differ even in
//! greyscale.
//! Names are escaped; characters that SVG can't hold are omitted. Equal plots give equal bytes.

use super::Plot;
use super::draw::{Anchor, Ink, PlotShape, draw};
use std::fmt::Write as _;

/// Colours of the series in turn, distinguishable with colour blindness and in greyscale.
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#b8860b", "#444444"];
/// Dash patterns of the series in turn, distinguishable in black and white.
const DASHES: [&str; 7] = ["", "7 3", "2 2", "9 3 2 3", "12 3", "4 4", "1 3"];

/// Renders `plot` as an SVG file of `width_px` × `height_px`, each clamped to 100 … 10000.
pub fn svg(plot: &Plot, width_px: f64, height_px: f64) -> String {
    let size = |px: f64| if px.is_finite() { px.clamp(100.0, 10_000.0) } else { 100.0 };
    let (width_px, height_px) = (size(width_px), size(height_px));
    let mut out = String::new();
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_px}\" height=\"{height_px}\" \
         viewBox=\"0 0 {width_px} {height_px}\" role=\"img\" font-family=\"Helvetica, Arial, sans-serif\">\n\
         <title>{}</title>\n<rect width=\"{width_px}\" height=\"{height_px}\" fill=\"#ffffff\"/>\n",
        escaped(&plot.title)
    );
    for shape in draw(plot, width_px, height_px) {
        write_shape(&mut out, &shape);
    }
    out.push_str("</svg>\n");
    out
}

fn write_shape(out: &mut String, shape: &PlotShape) {
    let _ = match shape {
        PlotShape::Line { ink, points } => {
            let mut path = String::new();
            for point in points {
                let gap = if path.is_empty() { "" } else { " " };
                let _ = write!(path, "{gap}{},{}", short(point[0]), short(point[1]));
            }
            writeln!(out, "<polyline points=\"{path}\" fill=\"none\" {}/>", stroke(*ink))
        }
        PlotShape::Area { ink, at: [x, y, width, height] } => {
            let (x, y, width, height) = (short(*x), short(*y), short(*width), short(*height));
            let fill = colour(*ink);
            writeln!(out, "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{fill}\"/>")
        }
        PlotShape::Dot { ink, at: [x, y] } => {
            writeln!(
                out,
                "<circle cx=\"{}\" cy=\"{}\" r=\"2.2\" fill=\"{}\"/>",
                short(*x),
                short(*y),
                colour(*ink)
            )
        }
        PlotShape::Words { ink, at: [x, y], size, anchor, turned, text } => {
            let (x, y) = (short(*x), short(*y));
            let turn = if *turned { format!(" transform=\"rotate(-90 {x} {y})\"") } else { String::new() };
            let anchor = match anchor {
                Anchor::Start => "start",
                Anchor::Middle => "middle",
                Anchor::End => "end",
            };
            let (fill, text) = (colour(*ink), escaped(text));
            writeln!(
                out,
                "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{fill}\"{turn}>{text}</text>"
            )
        }
    };
}

fn colour(ink: Ink) -> &'static str {
    match ink {
        Ink::Text => "#111111",
        Ink::Axis => "#333333",
        Ink::Grid => "#dddddd",
        Ink::Mark => "#777777",
        Ink::Series(index) => COLOURS[index % COLOURS.len()],
    }
}

fn stroke(ink: Ink) -> String {
    let (width, dash) = match ink {
        Ink::Series(index) => (1.6, DASHES[index % DASHES.len()]),
        Ink::Mark => (0.8, "3 3"),
        _ => (0.8, ""),
    };
    let dashes = if dash.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dash}\"") };
    format!("stroke=\"{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dashes}", colour(ink))
}

/// Rounds to a hundredth of a pixel.
fn short(px: f64) -> f64 {
    let clamped = if px.is_finite() { px.clamp(-1e5, 1e5) } else { 0.0 };
    (clamped * 100.0).round() / 100.0 + 0.0
}

/// Escapes text for SVG: the five special characters are encoded, characters that XML forbids are omitted.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for sign in text.chars() {
        match sign {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\u{fffe}' | '\u{ffff}' => {}
            sign if (sign as u32) < 0x20 && !matches!(sign, '\t' | '\n' | '\r') => {}
            sign => out.push(sign),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::{Plot, PlotAxis, PlotMark, PlotPanel, Series, SeriesLook};
    use super::*;

    fn sample() -> Plot {
        let curve = |k: f64| (0..20_000).map(|i| [f64::from(i) * 1e-5, k * f64::from(i % 700)]).collect();
        let gantt = vec![[0.0, 0.0], [0.05, 0.0], [0.1, 1.0], [0.2, 1.0]];
        let stairs = vec![[0.0, 1.0], [0.1, 3.0], [f64::NAN, 0.0], [0.15, 2.0], [0.2, 2.0]];
        Plot {
            title: "<Z & \"XY\">\u{1}".to_owned(),
            panels: vec![
                PlotPanel {
                    x: PlotAxis::new("time", "s"),
                    y: PlotAxis::new("speed", "mm/s"),
                    series: vec![Series::line("one", curve(1.0)), Series::line("two", curve(-1.0))],
                    marks: vec![PlotMark::At(0.1, "contact".into()), PlotMark::Level(300.0, "limit".into())],
                },
                PlotPanel {
                    x: PlotAxis::new("time", "s"),
                    y: PlotAxis { names: vec!["XY".into(), "Z1".into()], ..PlotAxis::default() },
                    series: vec![Series::line("move", gantt).looking(SeriesLook::Bars)],
                    marks: Vec::new(),
                },
                PlotPanel {
                    x: PlotAxis::new("time", "s"),
                    y: PlotAxis { range: Some([0.0, 2.5]), ..PlotAxis::new("state", "") },
                    series: vec![Series::line("", stairs).looking(SeriesLook::Stairs)],
                    marks: Vec::new(),
                },
            ],
        }
    }

    fn numbers(text: &str, attribute: &str) -> Vec<f64> {
        text.match_indices(&format!(" {attribute}=\""))
            .flat_map(|(at, found)| {
                let rest = &text[at + found.len()..];
                let inner = &rest[..rest.find('"').unwrap()];
                inner.split([' ', ',']).map(|word| word.parse::<f64>().unwrap()).collect::<Vec<_>>()
            })
            .collect()
    }

    #[test]
    fn picture_is_complete_small_and_reproducible() {
        let text = svg(&sample(), 800.0, 600.0);
        assert_eq!(text, svg(&sample(), 800.0, 600.0));
        assert!(text.contains("<title>&lt;Z &amp; &quot;XY&quot;&gt;</title>"), "{}", &text[..300]);
        assert!(!text.contains("NaN") && !text.contains("inf") && !text.contains('\u{1}'));
        // 40 000 points became at most four per column.
        assert!(text.len() < 200_000, "{}", text.len());
        for word in ["speed / mm/s", "time / s", ">XY<", ">contact<", ">limit<", ">one<", "<rect x="] {
            assert!(text.contains(word), "no {word}");
        }
        assert_eq!(text.matches("time / s").count(), 1, "panels over each other share the words of an axis");
        for (attribute, most) in [("x", 800.0), ("y", 600.0), ("points", 800.0)] {
            let found = numbers(&text, attribute);
            assert!(found.len() > 3 && found.iter().all(|v| (0.0..=most).contains(v)), "{attribute}");
        }
    }

    #[test]
    fn lines_are_clipped_and_pixels_map_back_to_values() {
        let plot = sample();
        let frames = super::super::layout(&plot, 640.0, 480.0);
        for frame in &frames {
            for value in [frame.x[0], 0.123, frame.x[1]] {
                assert!((frame.x_at(frame.px(value)) - value).abs() < 1e-12);
            }
            for value in [frame.y[0], 0.3, frame.y[1]] {
                assert!((frame.y_at(frame.py(value)) - value).abs() < 1e-9);
            }
        }
        // The stairs leave their axis at 3 > 2.5 and are clipped there.
        let top = frames[2].top_px;
        let lowest = draw(&plot, 640.0, 480.0).iter().fold(f64::INFINITY, |least, shape| match shape {
            PlotShape::Line { ink: Ink::Series(0), points }
                if points.iter().all(|p| p[1] > frames[1].top_px) =>
            {
                points.iter().map(|p| p[1]).fold(least, f64::min)
            }
            _ => least,
        });
        assert!((lowest - (top - 0.5)).abs() < 1e-9, "{lowest} {top}");
    }

    #[test]
    fn nonfinite_values_and_sizes_do_not_break_the_plot() {
        let strange = [0.0, -0.0, f64::NAN, f64::INFINITY, f64::MIN, f64::MAX, 5e-324, 1e300, 7.0];
        let mut points = Vec::new();
        for x in strange {
            points.extend(strange.map(|y| [x, y]));
        }
        for look in [SeriesLook::Line, SeriesLook::Stairs, SeriesLook::Dots, SeriesLook::Bars] {
            for cut in [0, 1, 2, points.len()] {
                for range in [None, Some([0.0, 0.0]), Some([f64::NAN, 1.0]), Some([-1e308, 1e308])] {
                    let series = Series::line("a", points[..cut].to_vec()).looking(look);
                    let axis = PlotAxis { range, ..PlotAxis::new("a", "b") };
                    let marks =
                        vec![PlotMark::At(f64::NAN, "x".into()), PlotMark::Level(f64::INFINITY, "y".into())];
                    let panel = PlotPanel { x: axis.clone(), y: axis, series: vec![series], marks };
                    let plot = Plot { title: String::new(), panels: vec![panel; 3] };
                    for size in [0.0, -3.0, f64::NAN, 120.0, 1e9] {
                        let text = svg(&plot, size, size);
                        assert!(
                            !text.contains("NaN") && !text.contains("inf"),
                            "{look:?} {cut} {range:?} {size}"
                        );
                    }
                }
            }
        }
    }
}
