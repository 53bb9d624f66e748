//! Simplified lines for small zooms: consecutive lines with the same look are merged while the difference is
//! invisible.
//!
//! ```text
//! a million segments of 10 µm   ·-·-·-·-·-·-·-·     full detail, for large zooms
//! the same at a small zoom      ·---------------·   error of at most a quarter of a pixel
//! ```

use super::scene::Line;

/// Fewer lines are never simplified.
const MANY_LINES: usize = 20_000;
/// Maximum error of the levels, mm.
const LEVELS_MM: [f32; 4] = [0.004, 0.016, 0.064, 0.256];
/// A level must have at most this share of the previous level's lines. Then all levels add at most a third to
/// the memory.
const WORTH_SHARE: f64 = 0.25;
const MOST_PIECES: usize = 64;
/// An error of this share of a pixel is invisible.
const UNSEEN_PX: f64 = 0.25;

/// The levels of `lines` with their maximum error in mm; none if there are few lines.
pub(super) fn levels(lines: &[Line]) -> Vec<(f32, Vec<Line>)> {
    let mut found: Vec<(f32, Vec<Line>)> = Vec::new();
    for off_mm in LEVELS_MM {
        let before = found.last().map_or(lines, |(_, lines)| lines);
        if before.len() < MANY_LINES {
            break;
        }
        // The input is already off by up to a quarter of this error, so only the rest is available here.
        let thinned = thin(before, 0.75 * off_mm);
        if thinned.len() as f64 <= WORTH_SHARE * before.len() as f64 {
            found.push((off_mm, thinned));
        }
    }
    found
}

/// The level to draw at this zoom; none for the full lines.
pub(super) fn level_for(offs_mm: impl IntoIterator<Item = f32>, px_per_mm: f64) -> Option<usize> {
    offs_mm
        .into_iter()
        .take_while(|off_mm| f64::from(*off_mm) * px_per_mm <= UNSEEN_PX)
        .count()
        .checked_sub(1)
}

/// Merges lines. No end of a segment is further than `off_mm` from the merged line.
fn thin(lines: &[Line], off_mm: f32) -> Vec<Line> {
    let mut found: Vec<Line> = Vec::new();
    let mut ends: Vec<[f32; 2]> = Vec::new();
    for line in lines {
        let goes_on = found.last().filter(|last| {
            let same = last.colour == line.colour && last.width == line.width && last.order == line.order;
            let near = |end: &[f32; 2]| distance_mm(last.a_mm, line.b_mm, *end) <= off_mm;
            same && last.b_mm == line.a_mm
                && ends.len() < MOST_PIECES
                && near(&line.a_mm)
                && ends.iter().all(near)
        });
        if goes_on.is_some() && !turns_back(found.last(), line) {
            ends.push(line.a_mm);
            if let Some(last) = found.last_mut() {
                last.b_mm = line.b_mm;
            }
        } else {
            ends.clear();
            found.push(*line);
        }
    }
    found
}

/// True if a segment reverses along the line. Merging would lose the point where it turned.
fn turns_back(last: Option<&Line>, line: &Line) -> bool {
    last.is_some_and(|last| {
        let way = |from: [f32; 2], to: [f32; 2]| [to[0] - from[0], to[1] - from[1]];
        let (before, now) = (way(last.a_mm, last.b_mm), way(line.a_mm, line.b_mm));
        before[0] * now[0] + before[1] * now[1] < 0.0
    })
}

fn distance_mm(a: [f32; 2], b: [f32; 2], at: [f32; 2]) -> f32 {
    let (way, off) = ([b[0] - a[0], b[1] - a[1]], [at[0] - a[0], at[1] - a[1]]);
    let squared = way[0] * way[0] + way[1] * way[1];
    let share =
        if squared > 0.0 { ((way[0] * off[0] + way[1] * off[1]) / squared).clamp(0.0, 1.0) } else { 0.0 };
    let [x, y] = [off[0] - share * way[0], off[1] - share * way[1]];
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::palette::Colour;
    use super::super::scene::Width;
    use super::*;

    fn line(a_mm: [f32; 2], b_mm: [f32; 2], order: u32) -> Line {
        Line { a_mm, b_mm, width: Width::Mm(0.2), colour: Colour::rgb(0), order }
    }

    /// A million segments: circles around a hundred points.
    fn circles() -> Vec<Line> {
        let pieces = 10_000;
        let round = |circle: u32| {
            let at = move |piece: u32| {
                let (turn, radius) =
                    (std::f32::consts::TAU * piece as f32 / pieces as f32, 1.0 + circle as f32 * 0.1);
                let centre = [circle as f32 % 10.0 * 12.0, (circle / 10) as f32 * 12.0];
                [centre[0] + radius * turn.cos(), centre[1] + radius * turn.sin()]
            };
            (0..pieces).map(move |piece| line(at(piece), at(piece + 1), circle))
        };
        (0..100).flat_map(round).collect()
    }

    #[test]
    fn million_lines_are_merged_within_tolerance() {
        let all = circles();
        let levels = levels(&all);
        assert!(levels.last().is_some_and(|(_, lines)| lines.len() < MANY_LINES), "many are left");
        let more: usize = levels.iter().map(|(_, lines)| lines.len()).sum();
        assert!(more <= all.len() / 3, "{more} lines more");
        for (off_mm, lines) in &levels {
            // Both visit the same points in the same order: a line ends where a segment ends.
            let mut pieces = all.iter();
            for one in lines {
                let mut open = true;
                while open {
                    let piece = pieces.next().expect("no line without its pieces");
                    let away = distance_mm(one.a_mm, one.b_mm, piece.b_mm);
                    assert!(away <= 2.0 * off_mm, "{away} mm is more than {off_mm} mm");
                    assert_eq!(one.order, piece.order);
                    open = piece.b_mm != one.b_mm;
                }
            }
            assert_eq!(pieces.next(), None, "all pieces are drawn");
        }
    }

    #[test]
    fn only_equal_and_straight_lines_are_merged() {
        let straight = [line([0.0, 0.0], [1.0, 0.0], 1), line([1.0, 0.0], [2.0, 0.0], 1)];
        assert_eq!(thin(&straight, 0.01), [line([0.0, 0.0], [2.0, 0.0], 1)]);
        let rows = [
            [straight[0], line([1.0, 0.0], [2.0, 0.0], 2)],
            [straight[0], line([1.1, 0.0], [2.0, 0.0], 1)],
            [straight[0], line([1.0, 0.0], [2.0, 0.1], 1)],
            [straight[0], line([1.0, 0.0], [0.5, 0.0], 1)],
            [straight[0], Line { width: Width::Mm(0.3), ..straight[1] }],
            [straight[0], Line { colour: Colour::rgb(0xff_00_00), ..straight[1] }],
        ];
        for row in rows {
            assert_eq!(thin(&row, 0.01), row);
        }
        assert_eq!(levels(&straight), [], "few lines are drawn as they are");
    }

    #[test]
    fn closer_view_uses_a_finer_level() {
        let offs = [0.004, 0.016, 0.064];
        for (px_per_mm, level) in [(1_000.0, None), (62.0, Some(0)), (15.0, Some(1)), (2.0, Some(2))] {
            assert_eq!(level_for(offs, px_per_mm), level, "{px_per_mm} px/mm");
        }
    }
}
