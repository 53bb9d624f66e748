//! `annulus lab profile`: computes the same move under several laws of motion: position, speed, acceleration
//! and jerk over time.

use super::super::{Answer, Refusal};
use super::output::{ComputedCase, OutputArgs, deliver, ms, panel, short, word};
use crate::machine_file;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::motion::profile::{self, Choice, Limits, MotionLaw, Profile, bounds};
use annulus_core::plot::{Plot, Series};
use serde_json::{Value, json};

/// Arguments of `annulus lab profile`.
#[derive(Debug, clap::Args)]
pub(crate) struct ProfileArgs {
    /// Set the length of the move, in mm.
    #[arg(long, default_value_t = 10.0, value_name = "MM", allow_negative_numbers = true)]
    length_mm: f64,
    /// Set the maximum speed, in mm/s.
    #[arg(long, value_name = "MM/S", allow_negative_numbers = true)]
    speed: Option<f64>,
    /// Set the maximum acceleration, in mm/s².
    #[arg(long, value_name = "MM/S2", allow_negative_numbers = true)]
    acceleration: Option<f64>,
    /// Set the maximum jerk, in mm/s³.
    #[arg(long, value_name = "MM/S3", allow_negative_numbers = true)]
    jerk: Option<f64>,
    /// Set the order α of the power law, above 0, at most 2.
    #[arg(long, default_value_t = 0.5, value_name = "ALPHA", allow_negative_numbers = true)]
    order: f64,
    /// Choose a law of motion; auto chooses by length. Repeatable [default: all three].
    #[arg(long, value_enum, value_name = "LAW")]
    shape: Vec<Law>,
    /// Use the limits of this machine, a name or a file; given limits override them.
    #[arg(short, long, value_name = "NAME")]
    machine: Option<String>,
    /// Choose the axis of the machine.
    #[arg(long, value_enum, default_value_t = AxisName::X)]
    axis: AxisName,
    /// Set the number of samples from the start to the end.
    #[arg(long, default_value_t = 401, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    samples: u32,
    #[command(flatten)]
    output: OutputArgs,
}

/// A law of motion by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Law {
    /// Constant acceleration.
    Linear,
    /// Constant jerk, seven phases.
    S,
    /// Jerk as a power of time, eleven phases.
    Power,
    /// Linear or S-curve, by length.
    Auto,
}

/// An axis by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum AxisName {
    /// Left and right.
    X,
    /// Away and back.
    Y,
    /// Up and down.
    Z,
}

pub(crate) fn run(args: &ProfileArgs) -> Result<Answer, Refusal> {
    let limits = limits(args)?;
    let choice = profile::choose(args.length_mm, limits).map_err(Refusal::content)?;
    let laws = if args.shape.is_empty() { vec![Law::Linear, Law::S, Law::Power] } else { args.shape.clone() };
    let mut profiles = Vec::new();
    for law in laws {
        let shape = match law {
            Law::Linear => MotionLaw::Linear,
            Law::S => MotionLaw::SCurve,
            Law::Power => MotionLaw::Power(args.order),
            Law::Auto => choice.choice,
        };
        profiles.push(profile::plan(shape, args.length_mm, limits).map_err(Refusal::content)?);
    }
    let sheet = sheet(args, limits, &choice, &profiles).map_err(Refusal::content)?;
    deliver(&args.output, sheet)
}

fn limits(args: &ProfileArgs) -> Result<Limits, Refusal> {
    let mut limits = Limits { speed_mm_per_s: 500.0, acceleration_mm_per_s2: 10_000.0, jerk_mm_per_s3: 1e6 };
    if let Some(name) = &args.machine {
        let machine = machine_file::named(name)?.machine;
        let axis = match args.axis {
            AxisName::X => &machine.x,
            AxisName::Y => &machine.y,
            AxisName::Z => &machine.z,
        };
        limits = Limits::of_axis(&machine, axis);
    }
    Ok(Limits {
        speed_mm_per_s: args.speed.unwrap_or(limits.speed_mm_per_s),
        acceleration_mm_per_s2: args.acceleration.unwrap_or(limits.acceleration_mm_per_s2),
        jerk_mm_per_s3: args.jerk.unwrap_or(limits.jerk_mm_per_s3),
    })
}

/// Name of the law in JSON and in column names.
fn key(shape: MotionLaw) -> &'static str {
    match shape {
        MotionLaw::Linear => "linear",
        MotionLaw::SCurve => "s",
        MotionLaw::Power(_) => "power",
    }
}

/// Name of the law in text.
fn name(shape: MotionLaw) -> String {
    match shape {
        MotionLaw::Power(order) => format!("{} α = {}", word("power"), short(order)),
        other => word(key(other)),
    }
}

fn object(profile: &Profile) -> Value {
    json!({ "shape": key(profile.shape), "order": profile.shape.order(), "case": profile.case.name(),
        "duration_s": profile.duration_s(), "peak_speed_mm_per_s": profile.speed_mm_per_s,
        "peak_acceleration_mm_per_s2": profile.acceleration_mm_per_s2,
        "peak_jerk_mm_per_s3": (profile.shape != MotionLaw::Linear).then_some(profile.jerk_mm_per_s3),
        "phases_s": profile.phases() })
}

fn sheet(
    args: &ProfileArgs,
    limits: Limits,
    choice: &Choice,
    profiles: &[Profile],
) -> Result<ComputedCase, Diagnostic> {
    let least_s = bounds::least_duration_s(args.length_mm, limits, None)?;
    let mut rows = vec![
        (word("length"), format!("{} mm", short(args.length_mm))),
        (word("choice"), name(choice.choice)),
        (word("linear_from"), format!("{} mm", short(choice.linear_from_mm))),
        (word("s_from"), format!("{} mm", short(choice.s_curve_from_mm))),
        (word("bound"), ms(least_s)),
    ];
    for profile in profiles {
        let (case, speed) = (profile.case.name(), short(profile.speed_mm_per_s));
        rows.push((name(profile.shape), format!("{}  {case}  {speed} mm/s", ms(profile.duration_s()))));
    }
    let longest_s = profiles.iter().map(Profile::duration_s).fold(0.0, f64::max);
    let mut columns = vec!["t_s".to_owned()];
    for profile in profiles {
        let law = key(profile.shape);
        columns
            .extend(["s_mm", "v_mm_per_s", "a_mm_per_s2", "j_mm_per_s3"].map(|unit| format!("{law}_{unit}")));
    }
    let last = f64::from(args.samples - 1);
    let times = (0..args.samples).map(|index| longest_s * f64::from(index) / last);
    let sample = |t: f64| {
        let all = profiles.iter().flat_map(|profile| moments(profile, t));
        std::iter::once(Some(t)).chain(all).collect::<Vec<_>>()
    };
    Ok(ComputedCase {
        object: json!({ "length_mm": args.length_mm, "limits": limits, "choice": key(choice.choice),
            "choice_case": choice.case, "linear_from_mm": choice.linear_from_mm,
            "s_curve_from_mm": choice.s_curve_from_mm, "least_duration_s": least_s,
            "profiles": profiles.iter().map(object).collect::<Vec<_>>() }),
        rows,
        columns,
        samples: times.map(sample).collect(),
        plot: plot(args, profiles),
    })
}

/// Position, speed, acceleration and jerk. The linear law has no jerk, because its acceleration jumps.
fn moments(profile: &Profile, t: f64) -> [Option<f64>; 4] {
    let jerk = (profile.shape != MotionLaw::Linear).then(|| profile.jerk(t));
    [Some(profile.position_mm(t)), Some(profile.speed(t)), Some(profile.acceleration(t)), jerk]
}

/// Times of the drawn points, s: evenly spaced, and just before and after each end of a phase, where a value
/// may jump.
fn drawn_at(profile: &Profile) -> Vec<f64> {
    let total_s = profile.duration_s();
    let mut times: Vec<f64> = (0..=600).map(|index| total_s * f64::from(index) / 600.0).collect();
    let mut end_s = 0.0;
    for phase in [0.0].into_iter().chain(profile.phases()) {
        end_s += phase;
        times.extend([end_s - 1e-9 * total_s, end_s, end_s + 1e-9 * total_s]);
    }
    times.sort_by(f64::total_cmp);
    times
}

fn plot(args: &ProfileArgs, profiles: &[Profile]) -> Plot {
    let panels = [("place", "mm"), ("speed", "mm/s"), ("acceleration", "mm/s²"), ("jerk", "mm/s³")];
    let panel = |(index, (quantity, unit)): (usize, (&str, &str))| {
        let series = profiles.iter().map(|profile| {
            let at = |t: f64| [1e3 * t, moments(profile, t)[index].unwrap_or(f64::NAN)];
            Series::line(&name(profile.shape), drawn_at(profile).into_iter().map(at).collect())
        });
        panel(quantity, unit, series.collect(), Vec::new())
    };
    Plot {
        title: format!("{}: {} mm", word("profile_title"), short(args.length_mm)),
        panels: panels.into_iter().enumerate().map(panel).collect(),
    }
}
