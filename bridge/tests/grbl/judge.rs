//! Finds holes and cuts from the step pins, in the intervals with Z below the surface. Without motion of XY
//! the interval is a hole, with motion a cut.
//!
//! In steps and seconds of controller time.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

const HZ: f64 = 16e6;

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Dip {
    pub(crate) at: [i64; 2],
    pub(crate) lowest: i64,
    /// XY positions during the stay; empty if XY stood still.
    pub(crate) path: Vec<[i64; 2]>,
    /// Number of the edge with which it went in, from 1 over all axes.
    pub(crate) edge: u64,
}

#[derive(Debug, Default)]
pub(crate) struct Log {
    pub(crate) dips: Vec<Dip>,
    pub(crate) end: [i64; 3],
    pub(crate) seconds: Vec<f64>,
}

pub(crate) fn read(edges: &Path, surface: i64) -> Log {
    let mut log = Log::default();
    let mut dip: Option<Dip> = None;
    for line in BufReader::new(File::open(edges).unwrap()).lines() {
        let line = line.unwrap();
        let (axis, to, cycle) = edge(&line).unwrap_or_else(|| panic!("not an edge: {line}"));
        assert_eq!((to - log.end[axis]).abs(), 1, "an edge is one step: {line}");
        log.end[axis] = to;
        log.seconds.push(cycle / HZ);
        let [x, y, z] = log.end;
        if z >= surface {
            log.dips.extend(dip.take());
            continue;
        }
        let edge = log.seconds.len() as u64;
        let dip = dip.get_or_insert(Dip { at: [x, y], lowest: z, path: Vec::new(), edge });
        dip.lowest = dip.lowest.min(z);
        if axis != 2 {
            dip.path.push([x, y]);
        }
    }
    log.dips.extend(dip);
    log
}

/// The first of these positions (net steps) that the tool did not reach in order, within a tolerance in
/// steps.
pub(crate) fn not_come_to(edges: &Path, places: &[[i64; 3]], tolerance: i64) -> Option<usize> {
    let (mut at, mut next) = ([0_i64; 3], 0);
    let mut pass = |at: [i64; 3]| {
        let here = |place: &[i64; 3]| (0..3).all(|axis| (place[axis] - at[axis]).abs() <= tolerance);
        while places.get(next).is_some_and(here) {
            next += 1;
        }
        next
    };
    let mut passed = pass(at);
    for line in BufReader::new(File::open(edges).unwrap()).lines() {
        let (axis, to, _) = edge(&line.unwrap()).expect("an edge");
        at[axis] = to;
        passed = pass(at);
    }
    (passed < places.len()).then_some(passed)
}

pub(crate) fn edge(line: &str) -> Option<(usize, i64, f64)> {
    let mut words = line.split(' ');
    let cycle = words.next()?.parse().ok()?;
    let axis = "XYZ".find(words.next()?)?;
    Some((axis, words.next()?.parse().ok()?, cycle))
}

#[derive(Clone, Debug, Default)]
pub(crate) struct Wanted {
    pub(crate) holes: Vec<[i64; 3]>,
    /// Cuts along straight lines: their corners, and their bottom.
    pub(crate) cuts: Vec<(Vec<[i64; 2]>, i64)>,
}

#[derive(Debug, Default, PartialEq)]
pub(crate) struct Verdict {
    /// Expected holes, then cuts, that were never completed.
    pub(crate) left_out: Vec<usize>,
    pub(crate) wrong: Vec<Dip>,
    /// How often holes and cuts were repeated, in total.
    pub(crate) repeated: usize,
}

pub(crate) fn compare(log: &Log, wanted: &Wanted, tolerance: i64) -> Verdict {
    let count = wanted.holes.len() + wanted.cuts.len();
    let (mut begun, mut whole) = (vec![0; count], vec![false; count]);
    let mut verdict = Verdict::default();
    for dip in &log.dips {
        let hole = wanted.holes.iter().position(|hole| drilled(dip, hole, tolerance).is_some());
        let cut = || wanted.cuts.iter().position(|cut| milled(dip, cut, tolerance).is_some());
        let found = hole.or_else(|| cut().map(|cut| wanted.holes.len() + cut));
        let Some(found) = found else {
            verdict.wrong.push(dip.clone());
            continue;
        };
        begun[found] += 1;
        whole[found] |= match found.checked_sub(wanted.holes.len()) {
            None => drilled(dip, &wanted.holes[found], tolerance) == Some(true),
            Some(cut) => milled(dip, &wanted.cuts[cut], tolerance) == Some(true),
        };
    }
    verdict.left_out = (0..count).filter(|one| !whole[*one]).collect();
    verdict.repeated = begun.into_iter().map(|begun: usize| begun.saturating_sub(1)).sum();
    verdict
}

/// Whether a dip is at this hole; the value is `true` if it reached the bottom.
fn drilled(dip: &Dip, hole: &[i64; 3], tolerance: i64) -> Option<bool> {
    let here = (0..2).all(|axis| (hole[axis] - dip.at[axis]).abs() <= tolerance);
    let deep = dip.lowest - hole[2];
    (here && dip.path.is_empty() && deep >= -tolerance).then_some(deep <= tolerance)
}

/// Whether a dip is on this cut; the value is `true` if it reached from start to end. A cut that was
/// stopped during its plunge has no motion.
fn milled(dip: &Dip, (corners, bottom): &(Vec<[i64; 2]>, i64), tolerance: i64) -> Option<bool> {
    let near = |a: [i64; 2], b: [i64; 2]| (0..2).all(|axis| (a[axis] - b[axis]).abs() <= tolerance);
    let on = |place: &[i64; 2]| corners.windows(2).any(|ends| off(*place, ends) <= tolerance as f64 + 1.0);
    let here = near(dip.at, corners[0]) && dip.lowest >= bottom - tolerance && dip.path.iter().all(on);
    let mut left = corners.iter();
    let mut next = left.next();
    for place in std::iter::once(&dip.at).chain(&dip.path) {
        if next.is_some_and(|corner| near(*corner, *place)) {
            next = left.next();
        }
    }
    here.then_some(next.is_none() && dip.lowest <= bottom + tolerance)
}

fn off(place: [i64; 2], ends: &[[i64; 2]]) -> f64 {
    let part = |axis: usize| ((ends[1][axis] - ends[0][axis]) as f64, (place[axis] - ends[0][axis]) as f64);
    let ((dx, x), (dy, y)) = (part(0), part(1));
    let along = ((x * dx + y * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
    let (x, y) = (x - along * dx, y - along * dy);
    (x * x + y * y).sqrt()
}

#[test]
fn judge_separates_holes_cuts_and_unwanted_dips() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("edges");
    let (mut text, mut at) = (String::new(), [0_i64; 3]);
    let mut go = |axis: usize, to: i64| {
        while at[axis] != to {
            at[axis] += (to - at[axis]).signum();
            text += &format!("{} {} {}\n", text.len(), ["X", "Y", "Z"][axis], at[axis]);
        }
    };
    // A hole at 0,0; half of one at 40,0 and all of it; a cut from 40,40 to 60,40 that is stopped and
    // repeated.
    for (axis, to) in
        [(2, -10), (2, 5), (0, 40), (2, -4), (2, 5), (2, -10), (2, 5), (1, 40), (2, -3), (0, 50)]
    {
        go(axis, to);
    }
    for (axis, to) in [(2, 5), (0, 40), (2, -3), (0, 60), (2, 5)] {
        go(axis, to);
    }
    std::fs::write(&path, &text).unwrap();
    let wanted =
        Wanted { holes: vec![[0, 0, -10], [40, 0, -10]], cuts: vec![(vec![[40, 40], [60, 40]], -3)] };
    let verdict = compare(&read(&path, 0), &wanted, 1);
    assert_eq!(verdict, Verdict { repeated: 2, ..Verdict::default() });
    // Expected elsewhere: two wrong dips, and one hole too few; deeper: none complete.
    let elsewhere = Wanted { holes: vec![[0, 0, -10], [44, 0, -10]], ..wanted.clone() };
    let verdict = compare(&read(&path, 0), &elsewhere, 1);
    assert_eq!((verdict.left_out, verdict.wrong.len()), (vec![1], 2));
    let deeper = Wanted { holes: vec![[0, 0, -12], [40, 0, -12]], ..wanted };
    assert_eq!(compare(&read(&path, 0), &deeper, 1).left_out, vec![0, 1]);
    // Too deep is wrong as well.
    let flat = Wanted { holes: vec![[0, 0, -4], [40, 0, -4]], cuts: Vec::new() };
    assert!(!compare(&read(&path, 0), &flat, 1).wrong.is_empty());
}
