//! Converts a plot into shapes: lines, boxes, dots and texts, each with its ink.
//! Long lines are thinned to what pixels can show: the first, lowest, highest and last point of each column.

use super::layout::{BAR, ROW_PX, SMALL_PX, TITLE_PX, is_bars, layout, text_width_px};
use super::{Plot, PlotFrame, PlotMark, PlotPanel, Series, SeriesLook};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    Text,
    Axis,
    /// Lines at round numbers.
    Grid,
    Mark,
    Series(usize),
}

/// Part of a text that is at its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// A shape to paint. Numbers are px from the top left corner.
#[derive(Clone, Debug, PartialEq)]
pub enum PlotShape {
    Line {
        ink: Ink,
        points: Vec<[f64; 2]>,
    },
    Area {
        ink: Ink,
        /// Left edge, upper edge, width, height.
        at: [f64; 4],
    },
    Dot {
        ink: Ink,
        at: [f64; 2],
    },
    Words {
        ink: Ink,
        at: [f64; 2],
        size: f64,
        anchor: Anchor,
        /// Rotated by a quarter turn, reading upwards.
        turned: bool,
        text: String,
    },
}

/// Draws `plot` in a picture of `width_px` × `height_px`.
pub fn draw(plot: &Plot, width_px: f64, height_px: f64) -> Vec<PlotShape> {
    let mut shapes = Vec::new();
    if !plot.title.is_empty() {
        let at = [0.5 * width_px, 10.0 + TITLE_PX];
        shapes.push(words(Ink::Text, at, TITLE_PX, Anchor::Middle, &plot.title));
    }
    for (panel, frame) in plot.panels.iter().zip(layout(plot, width_px, height_px)) {
        axes(&mut shapes, panel, &frame);
        for (index, series) in panel.series.iter().enumerate() {
            data(&mut shapes, series, Ink::Series(index), &frame);
        }
        marks(&mut shapes, panel, &frame);
        if frame.legend {
            legend(&mut shapes, panel, &frame);
        }
    }
    shapes
}

fn words(ink: Ink, at: [f64; 2], size: f64, anchor: Anchor, text: &str) -> PlotShape {
    PlotShape::Words { ink, at, size, anchor, turned: false, text: text.to_owned() }
}

fn line(ink: Ink, points: &[[f64; 2]]) -> PlotShape {
    PlotShape::Line { ink, points: points.to_vec() }
}

fn axes(shapes: &mut Vec<PlotShape>, panel: &PlotPanel, frame: &PlotFrame) {
    let (left, top) = (frame.left_px, frame.top_px);
    let (right, bottom) = (left + frame.width_px, top + frame.height_px);
    for (value, word) in frame.x_ticks.values.iter().zip(&frame.x_ticks.words) {
        let x = frame.px(*value);
        shapes.push(line(Ink::Grid, &[[x, top], [x, bottom]]));
        shapes.push(words(Ink::Text, [x, bottom + ROW_PX - 1.0], SMALL_PX, Anchor::Middle, word));
    }
    let named: Vec<(f64, &String)> = if panel.y.names.is_empty() {
        frame.y_ticks.values.iter().copied().zip(&frame.y_ticks.words).collect()
    } else {
        panel.y.names.iter().enumerate().map(|(index, name)| (index as f64, name)).collect()
    };
    for (value, word) in named {
        let y = frame.py(value);
        shapes.push(line(Ink::Grid, &[[left, y], [right, y]]));
        shapes.push(words(Ink::Text, [left - 5.0, y + 0.35 * SMALL_PX], SMALL_PX, Anchor::End, word));
    }
    shapes.push(line(Ink::Axis, &[[left, top], [left, bottom], [right, bottom], [right, top], [left, top]]));
    if frame.x_words {
        let at = [0.5 * (left + right), bottom + 2.0 * ROW_PX + 1.0];
        shapes.push(words(Ink::Text, at, SMALL_PX, Anchor::Middle, &panel.x.words()));
    }
    shapes.push(PlotShape::Words {
        ink: Ink::Text,
        at: [SMALL_PX + 5.0, 0.5 * (top + bottom)],
        size: SMALL_PX,
        anchor: Anchor::Middle,
        turned: true,
        text: panel.y.words(),
    });
}

fn data(shapes: &mut Vec<PlotShape>, series: &Series, ink: Ink, frame: &PlotFrame) {
    if is_bars(series.look) {
        for pair in series.points.chunks_exact(2) {
            shapes.extend(bar(pair[0], pair[1][0], ink, frame));
        }
        return;
    }
    let mut piece: Vec<[f64; 2]> = Vec::new();
    for point in series.points.iter().chain([&[f64::NAN; 2]]) {
        if point.iter().all(|value| value.is_finite()) {
            if let (SeriesLook::Stairs, Some(last)) = (series.look, piece.last()) {
                piece.push([frame.px(point[0]), last[1]]);
            }
            piece.push([frame.px(point[0]), frame.py(point[1])]);
            continue;
        }
        let piece = inside(thinned(&std::mem::take(&mut piece)), frame);
        match series.look {
            SeriesLook::Dots => {
                shapes.extend(piece.into_iter().flatten().map(|at| PlotShape::Dot { ink, at }));
            }
            _ => shapes.extend(piece.into_iter().map(|points| PlotShape::Line { ink, points })),
        }
    }
}

fn bar(start: [f64; 2], end_x: f64, ink: Ink, frame: &PlotFrame) -> Option<PlotShape> {
    let edges =
        [frame.px(start[0]), frame.px(end_x)].map(|x| x.clamp(frame.left_px, frame.left_px + frame.width_px));
    let rows = [frame.py(start[1] + 0.5 * BAR), frame.py(start[1] - 0.5 * BAR)]
        .map(|y| y.clamp(frame.top_px, frame.top_px + frame.height_px));
    let at = [edges[0], rows[0], edges[1] - edges[0], rows[1] - rows[0]];
    (at.iter().all(|value| value.is_finite()) && at[2] >= 0.0).then_some(PlotShape::Area { ink, at })
}

/// Thins a line: the first, lowest, highest and last point of each pixel column, in order.
fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut out: Vec<[f64; 2]> = Vec::new();
    for column in points.chunk_by(|one, other| one[0].floor() == other[0].floor()) {
        let mut keep = [0, 0, 0, column.len() - 1];
        for (index, point) in column.iter().enumerate() {
            keep[1] = if point[1] < column[keep[1]][1] { index } else { keep[1] };
            keep[2] = if point[1] > column[keep[2]][1] { index } else { keep[2] };
        }
        keep.sort_unstable();
        let mut last = usize::MAX;
        for index in keep {
            if index != last {
                out.push(column[index]);
            }
            last = index;
        }
    }
    out
}

fn inside(points: Vec<[f64; 2]>, frame: &PlotFrame) -> Vec<Vec<[f64; 2]>> {
    let low = [frame.left_px - 0.5, frame.top_px - 0.5];
    let high = [frame.left_px + frame.width_px + 0.5, frame.top_px + frame.height_px + 0.5];
    let within = |point: &[f64; 2]| (0..2).all(|k| point[k] >= low[k] && point[k] <= high[k]);
    if points.iter().all(within) {
        return if points.is_empty() { Vec::new() } else { vec![points] };
    }
    let mut pieces: Vec<Vec<[f64; 2]>> = Vec::new();
    for pair in points.windows(2) {
        let Some([start, end]) = cut(pair[0], pair[1], low, high) else { continue };
        match pieces.last_mut() {
            Some(piece) if piece.last() == Some(&start) => piece.push(end),
            _ => pieces.push(vec![start, end]),
        }
    }
    pieces
}

/// The part of the line from `start` to `end` inside the box (Liang–Barsky).
fn cut(start: [f64; 2], end: [f64; 2], low: [f64; 2], high: [f64; 2]) -> Option<[[f64; 2]; 2]> {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for k in 0..2 {
        let way = end[k] - start[k];
        if way == 0.0 {
            if start[k] < low[k] || start[k] > high[k] {
                return None;
            }
            continue;
        }
        let (one, other) = ((low[k] - start[k]) / way, (high[k] - start[k]) / way);
        enter = enter.max(one.min(other));
        leave = leave.min(one.max(other));
    }
    let at = |part: f64| {
        if part <= 0.0 {
            return start;
        }
        if part >= 1.0 { end } else { [0, 1].map(|k| start[k] + part * (end[k] - start[k])) }
    };
    (enter <= leave).then(|| [at(enter), at(leave)])
}

fn marks(shapes: &mut Vec<PlotShape>, panel: &PlotPanel, frame: &PlotFrame) {
    let (right, bottom) = (frame.left_px + frame.width_px, frame.top_px + frame.height_px);
    for (mark, row) in panel.marks.iter().zip(&frame.mark_rows) {
        match mark {
            PlotMark::At(x, text) => {
                let px = frame.px(*x);
                if !(px >= frame.left_px - 0.5 && px <= right + 0.5) {
                    continue;
                }
                let reach = row.map_or(0.0, |row| row as f64 * ROW_PX);
                shapes.push(line(Ink::Mark, &[[px, frame.top_px - reach], [px, bottom]]));
                if let Some(row) = row {
                    let start = px.min(right - text_width_px(text, SMALL_PX));
                    let at = [start + 1.0, frame.top_px - 3.0 - *row as f64 * ROW_PX];
                    shapes.push(words(Ink::Mark, at, SMALL_PX, Anchor::Start, text));
                }
            }
            PlotMark::Level(y, text) => {
                let py = frame.py(*y);
                if !(py >= frame.top_px - 0.5 && py <= bottom + 0.5) {
                    continue;
                }
                shapes.push(line(Ink::Mark, &[[frame.left_px, py], [right, py]]));
                if !text.is_empty() {
                    // Below its line if there is no room above.
                    let over = py - 3.0 >= frame.top_px + SMALL_PX;
                    let at = [right - 4.0, if over { py - 3.0 } else { py + SMALL_PX }];
                    shapes.push(words(Ink::Mark, at, SMALL_PX, Anchor::End, text));
                }
            }
        }
    }
}

fn legend(shapes: &mut Vec<PlotShape>, panel: &PlotPanel, frame: &PlotFrame) {
    let rows = frame.mark_rows.iter().flatten().map(|row| row + 1).max().unwrap_or(0);
    let y = frame.top_px - 6.0 - rows as f64 * ROW_PX;
    let mut x = frame.left_px;
    for (index, series) in panel.series.iter().enumerate().filter(|(_, series)| !series.name.is_empty()) {
        let (ink, middle) = (Ink::Series(index), y - 4.0);
        match series.look {
            SeriesLook::Bars => shapes.push(PlotShape::Area { ink, at: [x, middle - 4.0, 18.0, 8.0] }),
            SeriesLook::Dots => shapes.push(PlotShape::Dot { ink, at: [x + 9.0, middle] }),
            _ => shapes.push(line(ink, &[[x, middle], [x + 18.0, middle]])),
        }
        shapes.push(words(Ink::Text, [x + 23.0, y], SMALL_PX, Anchor::Start, &series.name));
        x += 23.0 + text_width_px(&series.name, SMALL_PX) + 16.0;
    }
}
