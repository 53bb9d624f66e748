//! The actions of a controller and the actions that a program requires in one common form, and their
//! comparison.
//!
//! Lengths are mm.

use annulus_core::job::{Command, Mark, Program};
use std::f64::consts::{PI, TAU};

pub(crate) const MICROMETRE: f64 = 1e-3;

/// Rounding error of a coordinate's digits in mm: half of the fourth digit. For a helix that ends by its
/// angle, the errors of its centre and its angle are included. A fifth of a micrometre.
const DIGITS: f64 = 2e-4;

/// Moves shorter than this count as none, in mm: the end of a helix by angle is not exact.
const NOWHERE: f64 = 2e-4;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Seen {
    Bit(u32),
    Spindle(f64),
    Wait(f64),
    /// A straight move with a feed in mm/min, or a rapid.
    Move {
        to: [f64; 3],
        feed: Option<f64>,
    },
    Arc {
        to: [f64; 3],
        by: By,
        feed: f64,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum By {
    Centre([f64; 2], bool),
    Through([f64; 3]),
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Exactness {
    pub(crate) feed: f64,
    pub(crate) wait: f64,
    /// Maximum deviation of lines that approximate arcs; 0 if there must be none.
    pub(crate) chord: f64,
    /// Height above the board to which tools fall rapidly, in mm; `None` if they always move down at feed.
    pub(crate) fall_to: Option<f64>,
}

pub(crate) fn wanted(program: &Program, fall_to: Option<f64>) -> Vec<Seen> {
    let mut out = Vec::new();
    let mut at = [0.0, 0.0, program.safe_height.mm()];
    for leg in &program.legs {
        for command in &leg.commands {
            let feed = |um_per_s: u32| f64::from(um_per_s) * 0.06;
            match *command {
                Command::Rapid { to } => {
                    at = [to.x.mm(), to.y.mm(), at[2]];
                    out.push(Seen::Move { to: at, feed: None });
                }
                Command::Plunge { to, feed_um_per_s, .. } => {
                    // Rapids never go below that height, and never upwards to it.
                    let fallen = fall_to.map_or(at[2], |fall_to| fall_to.min(at[2])).max(to.mm());
                    out.push(Seen::Move { to: [at[0], at[1], fallen], feed: None });
                    at[2] = to.mm();
                    out.push(Seen::Move { to: at, feed: Some(feed(feed_um_per_s)) });
                }
                Command::Retract { to } => {
                    at[2] = to.mm();
                    out.push(Seen::Move { to: at, feed: None });
                }
                Command::Mill { to, height, feed_um_per_s } => {
                    at = [to.x.mm(), to.y.mm(), height.mm()];
                    out.push(Seen::Move { to: at, feed: Some(feed(feed_um_per_s)) });
                }
                Command::MillArc { to, height, center, ccw, feed_um_per_s } => {
                    at = [to.x.mm(), to.y.mm(), height.mm()];
                    let by = By::Centre([center.x.mm(), center.y.mm()], ccw);
                    out.push(Seen::Arc { to: at, by, feed: feed(feed_um_per_s) });
                }
                Command::Dwell { us } => out.push(Seen::Wait(f64::from(us) / 1e6)),
                Command::Spindle { rpm } => out.push(Seen::Spindle(f64::from(rpm))),
                Command::AwaitBit { bit } => out.push(Seen::Bit(bit + 1)),
            }
        }
        assert!(!matches!(leg.mark, Mark::Toolpath(_)) || at[2] == program.safe_height.mm(), "a leg ends up");
    }
    out
}

/// Removes empty moves and repeated speeds. Heights above the safe height are irrelevant.
fn plain(list: &[Seen], start: [f64; 3]) -> Vec<Seen> {
    let (mut at, mut rpm) = (start, 0.0);
    let mut out = Vec::new();
    for &seen in list {
        let seen = match seen {
            Seen::Move { to, feed: None } => {
                Seen::Move { to: [to[0], to[1], to[2].min(start[2])], feed: None }
            }
            other => other,
        };
        match seen {
            Seen::Move { to, .. } if distance(to, at) < NOWHERE => continue,
            Seen::Spindle(speed) if speed == rpm => continue,
            Seen::Spindle(speed) => rpm = speed,
            Seen::Move { to, .. } | Seen::Arc { to, .. } => at = to,
            Seen::Bit(_) | Seen::Wait(_) => {}
        }
        out.push(seen);
    }
    out
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    libm::sqrt(x * x + y * y + z * z)
}

fn near(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= DIGITS)
}

pub(crate) fn compare(read: &[Seen], program: &Program, exact: Exactness) -> Result<(), String> {
    let start = [0.0, 0.0, program.safe_height.mm()];
    let (read, wanted) = (plain(read, start), plain(&wanted(program, exact.fall_to), start));
    let mut at = start;
    let mut was = start;
    let mut next = 0;
    for (index, &wish) in wanted.iter().enumerate() {
        let from_here = at;
        let told = |what: &str, next: usize| {
            let from = next.saturating_sub(2);
            let around: Vec<_> = read.iter().skip(from).take(5).collect();
            Err(format!("{what}: wanted {wish:?} (the {index}th) from {from_here:?}, around: {around:#?}"))
        };
        if let Seen::Arc { to, by: By::Centre(centre, ccw), feed } = wish {
            match follow(&read[next..], was, at, to, centre, ccw, feed, exact) {
                Ok((used, end)) => (next, at, was) = (next + used, to, end),
                Err(what) => return told(&what, next),
            }
            continue;
        }
        let Some(&found) = read.get(next) else { return told("nothing is left", next) };
        next += 1;
        let same = match (wish, found) {
            (Seen::Bit(a), Seen::Bit(b)) => a == b,
            (Seen::Spindle(a), Seen::Spindle(b)) => a == b,
            (Seen::Wait(a), Seen::Wait(b)) => (a - b).abs() <= exact.wait,
            (Seen::Move { to, feed }, Seen::Move { to: found, feed: speed }) => {
                let speeds = match (feed, speed) {
                    (None, None) => true,
                    (Some(a), Some(b)) => (a - b).abs() <= exact.feed,
                    _ => false,
                };
                (at, was) = (to, found);
                speeds && near(to, found)
            }
            _ => false,
        };
        if !same {
            return told("something else", next);
        }
    }
    if next == read.len() { Ok(()) } else { Err(format!("more than wanted: {:#?}", &read[next..])) }
}

/// The angle from `a` to `b` around `centre` in the given direction, from 0 to a full turn.
fn turned(a: [f64; 3], b: [f64; 3], centre: [f64; 2], ccw: bool) -> f64 {
    let angle = |at: [f64; 3]| libm::atan2(at[1] - centre[1], at[0] - centre[0]);
    let turn = if ccw { angle(b) - angle(a) } else { angle(a) - angle(b) };
    if turn < 0.0 { turn + TAU } else { turn }
}

/// Follows an arc through the pieces that were read. Each must be on the circle and continue forwards.
/// Returns the number of pieces and their end.
#[allow(clippy::too_many_arguments)]
fn follow(
    read: &[Seen],
    mut was: [f64; 3],
    from: [f64; 3],
    to: [f64; 3],
    centre: [f64; 2],
    ccw: bool,
    feed: f64,
    exact: Exactness,
) -> Result<(usize, [f64; 3]), String> {
    let radius_at = |at: [f64; 3]| libm::hypot(at[0] - centre[0], at[1] - centre[1]);
    let radius = radius_at(from);
    let whole = if from[..2] == to[..2] { TAU } else { turned(from, to, centre, ccw) };
    let slack = 3.0 * MICROMETRE / radius;
    let mut done = 0.0;
    for (index, &piece) in read.iter().enumerate() {
        let (end, speed) = match piece {
            Seen::Move { to, feed: Some(feed) } => (to, feed),
            Seen::Arc { to, feed, .. } => (to, feed),
            _ => return Err(format!("the arc stops after {done} of {whole} rad")),
        };
        let mut step = turned(was, end, centre, ccw);
        if matches!(piece, Seen::Arc { .. }) && step < slack && whole > PI {
            step = TAU;
        }
        if (radius_at(end) - radius).abs() > 1.5 * MICROMETRE || (speed - feed).abs() > exact.feed {
            return Err(format!("off the circle by {}, feed {speed}", radius_at(end) - radius));
        }
        match piece {
            Seen::Arc { by: By::Centre(found, sense), .. } => {
                let off = [found[0] - centre[0], found[1] - centre[1]];
                if sense != ccw || off.iter().any(|off| off.abs() > MICROMETRE) {
                    return Err(format!("another centre {found:?} or sense {sense}"));
                }
            }
            Seen::Arc { by: By::Through(middle), .. } => {
                let before = turned(was, middle, centre, ccw);
                let off = (radius_at(middle) - radius).abs();
                if off > 1.5 * MICROMETRE
                    || before >= step
                    || (before - step / 2.0).abs() * radius > 3.0 * MICROMETRE
                {
                    return Err(format!("{middle:?} is not half way"));
                }
            }
            _ => {
                let sagitta = radius * (1.0 - libm::cos(step / 2.0));
                if sagitta > exact.chord + 1.5 * MICROMETRE {
                    return Err(format!("a line is {sagitta} off the arc"));
                }
            }
        }
        done += step;
        let height = from[2] + (to[2] - from[2]) * done / whole;
        // A small error along the circle causes a small error along the slope.
        let slope = (to[2] - from[2]).abs() / whole * slack;
        if (end[2] - height).abs() > 2.0 * MICROMETRE + slope {
            return Err(format!("height {} instead of {height}", end[2]));
        }
        if (done - whole).abs() <= slack {
            let there = end.iter().zip(to).all(|(a, b)| (a - b).abs() <= NOWHERE);
            return if there { Ok((index + 1, end)) } else { Err("ends elsewhere".to_owned()) };
        }
        if done > whole {
            return Err("goes too far".to_owned());
        }
        was = end;
    }
    Err(format!("the arc stops after {done} of {whole} rad"))
}
