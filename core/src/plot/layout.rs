//! Layout of the panels in the picture, and the value ranges of their axes.

use super::ticks::{Ticks, ticks, usable};
use super::{Plot, PlotAxis, PlotMark, PlotPanel, SeriesLook};

pub(super) const SMALL_PX: f64 = 11.0;
pub(super) const TITLE_PX: f64 = 15.0;
pub(super) const ROW_PX: f64 = 15.0;
/// Room for the rotated text of the vertical axis, px.
const TURNED_PX: f64 = 20.0;
const BORDER_PX: f64 = 10.0;
/// Most rows of mark texts; further marks have no text.
pub(super) const MARK_ROWS: usize = 5;
const LEAST_PX: f64 = 20.0;

/// Position of a panel, px from the top left corner, and its value ranges.
#[derive(Clone, Debug, PartialEq)]
pub struct PlotFrame {
    pub left_px: f64,
    pub top_px: f64,
    /// Width between the axes.
    pub width_px: f64,
    /// Height between the axes.
    pub height_px: f64,
    pub x: [f64; 2],
    pub y: [f64; 2],
    pub x_ticks: Ticks,
    pub y_ticks: Ticks,
    /// The panel has its own legend above it.
    pub legend: bool,
    /// The panel has a text below its x axis; else the panel below repeats the axis.
    pub x_words: bool,
    /// Row of the text of each mark, from 0 next to the panel; none without room.
    pub mark_rows: Vec<Option<usize>>,
}

impl PlotFrame {
    pub fn px(&self, x: f64) -> f64 {
        self.left_px + (x - self.x[0]) / (self.x[1] - self.x[0]) * self.width_px
    }

    pub fn py(&self, y: f64) -> f64 {
        self.top_px + (self.y[1] - y) / (self.y[1] - self.y[0]) * self.height_px
    }

    pub fn x_at(&self, px: f64) -> f64 {
        self.x[0] + (px - self.left_px) / self.width_px * (self.x[1] - self.x[0])
    }

    pub fn y_at(&self, py: f64) -> f64 {
        self.y[1] - (py - self.top_px) / self.height_px * (self.y[1] - self.y[0])
    }
}

/// Estimated width of `text` at font size `px`; within 20 % for most fonts.
pub(super) fn text_width_px(text: &str, px: f64) -> f64 {
    0.58 * px * text.chars().count() as f64
}

/// Lays out the panels of `plot` in a picture of `width_px` × `height_px`. If the picture is too small,
/// frames are at least 20 px and extend beyond its edge.
pub fn layout(plot: &Plot, width_px: f64, height_px: f64) -> Vec<PlotFrame> {
    let mut frames: Vec<PlotFrame> = plot.panels.iter().map(valued).collect();
    share_x(plot, &mut frames);
    let widest = |frame: &PlotFrame, axis: &PlotAxis| {
        let words = if axis.names.is_empty() { &frame.y_ticks.words } else { &axis.names };
        words.iter().map(|word| text_width_px(word, SMALL_PX)).fold(0.0, f64::max)
    };
    let labels =
        frames.iter().zip(&plot.panels).map(|(frame, panel)| widest(frame, &panel.y)).fold(0.0, f64::max);
    let left = BORDER_PX + TURNED_PX + labels + 6.0;
    let inner = (width_px - left - 2.0 * BORDER_PX).max(LEAST_PX);
    let mut fixed = 2.0 * BORDER_PX + if plot.title.is_empty() { 0.0 } else { TITLE_PX + 9.0 };
    for (index, panel) in plot.panels.iter().enumerate() {
        frames[index].left_px = left;
        frames[index].width_px = inner;
        frames[index].legend = has_legend(plot, index);
        frames[index].x_words = has_x_words(plot, &frames, index);
        frames[index].mark_rows = mark_rows(panel, &frames[index]);
        let most = (inner / 70.0) as usize;
        let [low, high] = frames[index].x;
        frames[index].x_ticks = ticks(low, high, most);
        fixed += over(&frames[index]) + under(&frames[index]);
    }
    let each = ((height_px - fixed) / plot.panels.len().max(1) as f64).max(LEAST_PX);
    let mut top = BORDER_PX + if plot.title.is_empty() { 0.0 } else { TITLE_PX + 9.0 };
    for (frame, panel) in frames.iter_mut().zip(&plot.panels) {
        frame.top_px = top + over(frame);
        frame.height_px = each;
        if panel.y.names.is_empty() && panel.y.range.is_none() {
            let found = ticks(frame.y[0], frame.y[1], (each / 24.0) as usize);
            frame.y = outward(frame.y, found.step);
        }
        frame.y_ticks = ticks(frame.y[0], frame.y[1], (each / 24.0) as usize);
        top = frame.top_px + each + under(frame);
    }
    frames
}

/// Gives panels with equal x axes and no fixed range one common range, so that their times align.
fn share_x(plot: &Plot, frames: &mut [PlotFrame]) {
    let own: Vec<[f64; 2]> = frames.iter().map(|frame| frame.x).collect();
    for (index, panel) in plot.panels.iter().enumerate().filter(|(_, panel)| panel.x.range.is_none()) {
        let full = |other: &PlotPanel| {
            other.series.iter().any(|one| !one.points.is_empty()) || !other.marks.is_empty()
        };
        let alike = plot.panels.iter().zip(&own).filter(|(other, _)| {
            full(other) && other.x.range.is_none() && other.x.words() == panel.x.words()
        });
        let ends = alike.map(|(_, ends)| *ends);
        let widest = ends.reduce(|one, other| [one[0].min(other[0]), one[1].max(other[1])]);
        frames[index].x = widest.unwrap_or(own[index]);
    }
}

/// Room above a frame: legend and mark texts.
fn over(frame: &PlotFrame) -> f64 {
    let rows = frame.mark_rows.iter().flatten().map(|row| row + 1).max().unwrap_or(0);
    let legend = if frame.legend { ROW_PX + 3.0 } else { 0.0 };
    6.0 + legend + rows as f64 * ROW_PX
}

/// Room below a frame: numbers and axis text.
fn under(frame: &PlotFrame) -> f64 {
    ROW_PX + 3.0 + if frame.x_words { ROW_PX + 3.0 } else { 0.0 }
}

fn valued(panel: &PlotPanel) -> PlotFrame {
    let x = panel.x.range.filter(|[low, high]| usable(*low, *high)).unwrap_or_else(|| reach(panel, 0));
    let y = if panel.y.names.is_empty() {
        panel.y.range.filter(|[low, high]| usable(*low, *high)).unwrap_or_else(|| reach(panel, 1))
    } else {
        [-0.6, panel.y.names.len() as f64 - 0.4]
    };
    // Texts of the ticks at a typical height, to measure their width.
    let rounded = if panel.y.names.is_empty() { outward(y, ticks(y[0], y[1], 5).step) } else { y };
    let y_ticks = ticks(rounded[0], rounded[1], 5);
    let (legend, x_words, mark_rows) = (false, true, Vec::new());
    let (left, top, width, height) = (0.0, 0.0, 1.0, 1.0);
    PlotFrame {
        left_px: left,
        top_px: top,
        width_px: width,
        height_px: height,
        x,
        y,
        x_ticks: ticks(x[0], x[1], 5),
        y_ticks,
        legend,
        x_words,
        mark_rows,
    }
}

/// From the lowest to the highest value of all series and marks along an axis (0: x, 1: y); widened if empty.
fn reach(panel: &PlotPanel, axis: usize) -> [f64; 2] {
    let marks = panel.marks.iter().filter_map(|mark| match mark {
        PlotMark::At(x, _) if axis == 0 => Some(*x),
        PlotMark::Level(y, _) if axis == 1 => Some(*y),
        _ => None,
    });
    let points = panel.series.iter().flat_map(|series| series.points.iter().map(|point| point[axis]));
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in points.chain(marks).filter(|value| value.is_finite()) {
        (low, high) = (low.min(value), high.max(value));
    }
    if low > high {
        return [0.0, 1.0];
    }
    if usable(low, high) {
        return [low, high];
    }
    let room = if low == 0.0 { 1.0 } else { 0.1 * low.abs().max(1e-290) };
    let wide = [low - room, high + room];
    if usable(wide[0], wide[1]) { wide } else { [0.0, 1.0] }
}

/// The ends rounded outward to ticks.
fn outward([low, high]: [f64; 2], step: f64) -> [f64; 2] {
    let wide = [(low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step];
    if usable(wide[0], wide[1]) { wide } else { [low, high] }
}

/// A legend is needed if series have names, and the panel above doesn't show it already.
fn has_legend(plot: &Plot, index: usize) -> bool {
    let names =
        |panel: &PlotPanel| -> Vec<String> { panel.series.iter().map(|one| one.name.clone()).collect() };
    let own = names(&plot.panels[index]);
    let said = index > 0 && names(&plot.panels[index - 1]) == own;
    !said && own.iter().any(|name| !name.is_empty())
}

fn has_x_words(plot: &Plot, frames: &[PlotFrame], index: usize) -> bool {
    match plot.panels.get(index + 1) {
        Some(next) => {
            next.x.words() != plot.panels[index].x.words() || frames[index + 1].x != frames[index].x
        }
        None => true,
    }
}

/// Rows for the texts of vertical marks: each in the lowest row without overlap.
fn mark_rows(panel: &PlotPanel, frame: &PlotFrame) -> Vec<Option<usize>> {
    let mut ends = [f64::NEG_INFINITY; MARK_ROWS];
    let mut order: Vec<(usize, f64, f64)> = Vec::new();
    for (index, mark) in panel.marks.iter().enumerate() {
        if let PlotMark::At(x, words) = mark
            && x.is_finite()
            && !words.is_empty()
        {
            order.push((index, frame.px(*x), text_width_px(words, SMALL_PX)));
        }
    }
    order.sort_by(|one, other| one.1.total_cmp(&other.1));
    let mut rows = vec![None; panel.marks.len()];
    for (index, px, width) in order {
        // Texts start at their mark, and shift left if they would leave the panel.
        let start = px.min(frame.left_px + frame.width_px - width);
        if let Some(row) = ends.iter().position(|end| *end + 6.0 <= start) {
            ends[row] = start + width;
            rows[index] = Some(row);
        }
    }
    rows
}

/// Height of a bar, in units of the axis.
pub(super) const BAR: f64 = 0.6;

pub(super) fn is_bars(look: SeriesLook) -> bool {
    look == SeriesLook::Bars
}
