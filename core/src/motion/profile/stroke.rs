//! A stroke of a spindle down through the board: one profile, or two speeds.
//!
//! ```text
//! v ^     ______                V_p: as fast as the height over the board permits
//!   |   ,'      '.
//!   | ,'          '.________    v_f: the feed, constant from the surface on
//!   |'             |        '.
//!   +--------------+-----------'-> t
//!    | height H    | depth D   |
//! ```
//!
//! Maths: `docs/motion-profiles.md` C2.5.

use super::{GREATEST, LEAST_LIMIT, Limits, MotionLaw, Profile, Span, wrong};
use crate::code;
use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

/// Bisections for the approach speed: more than the digits of an `f64`.
const HALVINGS: u32 = 120;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stroke {
    One(Profile),
    Two(Box<TwoSpeeds>),
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TwoSpeeds {
    pub length_mm: f64,
    /// V_p: highest approach speed, mm/s.
    pub approach_mm_per_s: f64,
    /// v_f: speed at the surface and in the board, mm/s.
    pub feed_mm_per_s: f64,
    /// t_z: time of contact with the surface, s.
    pub contact_s: f64,
    /// Rise, constant speed, fall to the feed, cut, stop.
    pub spans: [Span; 5],
}

/// A stroke with two speeds. First `height_mm` to the surface as fast as `limits` permit, arriving with
/// `feed_mm_per_s` and without acceleration. Then `depth_mm` at feed, to rest.
///
/// Fails if the height is too small to reach the feed, or the depth too small to stop from it; the diagnostic
/// has the required value. Also fails for unusable numbers.
pub fn two_speeds(
    shape: MotionLaw,
    height_mm: f64,
    depth_mm: f64,
    feed_mm_per_s: f64,
    limits: Limits,
) -> Result<Stroke, Diagnostic> {
    shape.check(limits)?;
    for length_mm in [height_mm, depth_mm] {
        if !(0.0..=GREATEST).contains(&length_mm) {
            return Err(wrong(code!("motion.bad_length"), length_mm));
        }
    }
    if !(LEAST_LIMIT..=limits.speed_mm_per_s).contains(&feed_mm_per_s) {
        return Err(wrong(code!("motion.bad_feed"), feed_mm_per_s).with("greatest", limits.speed_mm_per_s));
    }
    let change = |from, to| Span::change(shape, from, to, limits);
    let approach_mm = |speed| change(0.0, speed).length_mm + change(speed, feed_mm_per_s).length_mm;
    let stop = change(feed_mm_per_s, 0.0);
    let needed_mm = approach_mm(feed_mm_per_s);
    if needed_mm > height_mm {
        return Err(wrong(code!("motion.low_start"), height_mm)
            .with("feed", feed_mm_per_s)
            .with("needed", needed_mm));
    }
    if stop.length_mm > depth_mm {
        let diagnostic = wrong(code!("motion.shallow_stroke"), depth_mm).with("feed", feed_mm_per_s);
        return Err(diagnostic.with("needed", stop.length_mm));
    }
    let mut speed = limits.speed_mm_per_s;
    if approach_mm(speed) > height_mm {
        let mut high = speed;
        speed = feed_mm_per_s;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (speed + high);
            if approach_mm(middle) <= height_mm {
                speed = middle;
            } else {
                high = middle;
            }
        }
    }
    let rise = change(0.0, speed);
    let steady = Span::steady(speed, (height_mm - approach_mm(speed)).max(0.0)).after(&rise);
    let fall = change(speed, feed_mm_per_s).after(&steady);
    let cut = Span::steady(feed_mm_per_s, depth_mm - stop.length_mm).after(&fall);
    Ok(Stroke::Two(Box::new(TwoSpeeds {
        length_mm: height_mm + depth_mm,
        approach_mm_per_s: speed,
        feed_mm_per_s,
        contact_s: fall.end_s(),
        spans: [rise, steady, fall, cut, stop.after(&cut)],
    })))
}

impl Stroke {
    pub fn length_mm(&self) -> f64 {
        match self {
            Self::One(profile) => profile.length_mm,
            Self::Two(two) => two.length_mm,
        }
    }

    /// Law of its ramps.
    pub fn shape(&self) -> MotionLaw {
        match self {
            Self::One(profile) => profile.shape,
            Self::Two(two) => two.spans[0].ramp.shape,
        }
    }

    /// Highest speed, acceleration and jerk: mm/s, mm/s², mm/s³.
    pub fn peaks(&self) -> (f64, f64, f64) {
        match self {
            Self::One(one) => (one.speed_mm_per_s, one.acceleration_mm_per_s2, one.jerk_mm_per_s3),
            Self::Two(two) => {
                let ramps = two.spans.iter().map(|span| span.ramp);
                let most = ramps.fold((0.0, 0.0), |(a, j): (f64, f64), ramp| {
                    (a.max(ramp.acceleration_mm_per_s2), j.max(ramp.jerk_mm_per_s3))
                });
                (two.approach_mm_per_s.max(two.feed_mm_per_s), most.0, most.1)
            }
        }
    }

    pub fn duration_s(&self) -> f64 {
        match self {
            Self::One(profile) => profile.duration_s(),
            Self::Two(two) => two.spans[4].end_s(),
        }
    }

    /// Position at second `t`, mm from the start: exactly 0 before it, exactly the length after the end.
    pub fn position_mm(&self, t: f64) -> f64 {
        match self {
            Self::One(profile) => profile.position_mm(t),
            Self::Two(two) if t >= two.spans[4].end_s() => two.length_mm,
            Self::Two(two) => two.at(t).position_mm(t),
        }
    }

    /// Speed at second `t`, mm/s.
    pub fn speed(&self, t: f64) -> f64 {
        match self {
            Self::One(profile) => profile.speed(t),
            Self::Two(two) => two.at(t).speed(t),
        }
    }

    /// Acceleration at second `t`, mm/s²; negative while braking.
    pub fn acceleration(&self, t: f64) -> f64 {
        match self {
            Self::One(profile) => profile.acceleration(t),
            Self::Two(two) if t <= 0.0 || t >= two.spans[4].end_s() => 0.0,
            Self::Two(two) => two.at(t).acceleration(t),
        }
    }

    /// Jerk at second `t`, mm/s³.
    pub fn jerk(&self, t: f64) -> f64 {
        match self {
            Self::One(profile) => profile.jerk(t),
            Self::Two(two) if t <= 0.0 || t >= two.spans[4].end_s() => 0.0,
            Self::Two(two) => two.at(t).jerk(t),
        }
    }

    /// Time in seconds at position `s_mm`: 0 before the start, the duration after the end.
    pub fn time_at(&self, s_mm: f64) -> f64 {
        match self {
            Self::One(profile) => profile.time_at(s_mm),
            Self::Two(two) if s_mm >= two.length_mm => two.spans[4].end_s(),
            Self::Two(two) => {
                let [first, others @ ..] = &two.spans;
                let span = others.iter().rev().find(|span| s_mm >= span.start_mm).unwrap_or(first);
                span.time_at(s_mm)
            }
        }
    }
}

impl TwoSpeeds {
    fn at(&self, t: f64) -> &Span {
        let [first, others @ ..] = &self.spans;
        others.iter().rev().find(|span| t >= span.start_s).unwrap_or(first)
    }
}
