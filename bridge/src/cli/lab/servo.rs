//! `annulus lab servo`: computes the closed loop of a step or a stroke, with staged fuzzy PID next to plain
//! PID.

use super::super::{Answer, Refusal};
use super::output::{ComputedCase, OutputArgs, deliver, ms, panel, short, word};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::motion::profile::{self, Limits, MotionLaw, Profile};
use annulus_core::plot::{Plot, PlotMark, Series};
use annulus_core::servo::{
    self, CycleStage, FuzzyRules, Gains, Load, Plant, Reference, ReferenceMoment, ServoController, StepRun,
    StrokeRun,
};
use serde_json::{Value, json};

/// Arguments of `annulus lab servo`.
#[derive(Debug, clap::Args)]
pub(crate) struct ServoArgs {
    /// Compute a whole drill cycle of Z instead of a step.
    #[arg(long)]
    stroke: bool,
    /// Set the step, in mm; 0 for only the load.
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true, value_name = "MM")]
    step_mm: f64,
    /// Observe the step for this time, in s.
    #[arg(long, default_value_t = 0.4, value_name = "S", allow_negative_numbers = true)]
    duration: f64,
    /// Set the load during the step, in V; with --stroke, the load of cutting.
    #[arg(long, allow_negative_numbers = true, value_name = "V")]
    load: Option<f64>,
    /// Start the load at this time, in s.
    #[arg(long, default_value_t = 0.0, value_name = "S", allow_negative_numbers = true)]
    load_from: f64,
    /// End the load at this time, in s.
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    load_to: Option<f64>,
    /// Choose the stage of the drill cycle that contains the step.
    #[arg(long, value_enum, default_value_t = StageName::Travel)]
    stage: StageName,
    /// Choose the rules of the fuzzy controller.
    #[arg(long, value_enum, default_value_t = RuleSet::Even)]
    rules: RuleSet,
    /// Set the proportional gain, in V/mm.
    #[arg(long, default_value_t = 1.6, allow_negative_numbers = true)]
    kp: f64,
    /// Set the integral gain, in V/(mm·s).
    #[arg(long, default_value_t = 20.0, allow_negative_numbers = true)]
    ki: f64,
    /// Set the derivative gain, in V·s/mm.
    #[arg(long, default_value_t = 0.004, allow_negative_numbers = true)]
    kd: f64,
    /// Set the gain of the axis, in (mm/s)/V.
    #[arg(long, default_value_t = 60.0, allow_negative_numbers = true)]
    plant_gain: f64,
    /// Set the time constant of the axis, in s.
    #[arg(long, default_value_t = 0.006, value_name = "S", allow_negative_numbers = true)]
    plant_tau: f64,
    /// Set the sample time, in s.
    #[arg(long, default_value_t = 0.0005, value_name = "S", allow_negative_numbers = true)]
    sample: f64,
    /// Set the height of the resting tool above the board in a drill cycle, in mm.
    #[arg(long, default_value_t = 5.0, value_name = "MM", allow_negative_numbers = true)]
    height_mm: f64,
    /// Set the depth below the surface in a drill cycle, in mm.
    #[arg(long, default_value_t = 3.0, value_name = "MM", allow_negative_numbers = true)]
    depth_mm: f64,
    /// Set the speed down in a drill cycle, in mm/s.
    #[arg(long, default_value_t = 120.0, value_name = "MM/S", allow_negative_numbers = true)]
    down_speed: f64,
    /// Set the speed up in a drill cycle, in mm/s.
    #[arg(long, default_value_t = 200.0, value_name = "MM/S", allow_negative_numbers = true)]
    up_speed: f64,
    /// Feed forward the speed and acceleration of the reference in a drill cycle.
    #[arg(long)]
    feed_forward: bool,
    #[command(flatten)]
    output: OutputArgs,
}

/// A stage by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum StageName {
    /// X or Y in motion.
    Travel,
    /// Z above the board.
    Approach,
    /// Z in the board.
    Cut,
    /// Z on its way back.
    Return,
}

/// A rule set by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum RuleSet {
    /// Equal in both directions.
    Even,
    /// As in most textbooks.
    Classic,
}

/// A controller with its name in columns and in the legend.
struct Rival {
    key: &'static str,
    name: String,
    controller: ServoController,
}

/// One point of a curve: time, reference, position, control; s, mm, V.
type Row = [f64; 4];

pub(crate) fn run(args: &ServoArgs) -> Result<Answer, Refusal> {
    let sheet = if args.stroke { stroke(args) } else { step(args) };
    deliver(&args.output, sheet.map_err(Refusal::content)?)
}

fn rivals(args: &ServoArgs) -> [Rival; 3] {
    let gains = Gains { kp: args.kp, ki: args.ki, kd: args.kd };
    let rules = match args.rules {
        RuleSet::Even => FuzzyRules::Even,
        RuleSet::Classic => FuzzyRules::Classic,
    };
    let mut fuzzy = ServoController { gains, sample_s: args.sample, ..servo::staged_fuzzy() };
    if let Some(fuzzy) = &mut fuzzy.fuzzy {
        fuzzy.rules = *rules.tables();
    }
    let retuned = ServoController { sample_s: args.sample, ..servo::retuned_pid() };
    let rival = |key, controller| Rival { key, name: word(key), controller };
    [rival("fuzzy", fuzzy), rival("plain", fuzzy.plain()), rival("retuned", retuned)]
}

fn plant(args: &ServoArgs) -> Plant {
    Plant { gain_mm_per_s_per_v: args.plant_gain, tau_s: args.plant_tau }
}

fn step(args: &ServoArgs) -> Result<ComputedCase, Diagnostic> {
    let stage = match args.stage {
        StageName::Travel => CycleStage::Travel,
        StageName::Approach => CycleStage::Approach,
        StageName::Cut => CycleStage::Cut,
        StageName::Return => CycleStage::Return,
    };
    let load = Load { volts: args.load.unwrap_or(-0.05), from_s: args.load_from, to_s: args.load_to };
    let (mut rows, mut objects, mut curves) = (Vec::new(), Vec::new(), Vec::new());
    for rival in rivals(args) {
        let controller = rival.controller;
        let run = StepRun {
            controller,
            plant: plant(args),
            stage,
            setpoint_mm: args.step_mm,
            duration_s: args.duration,
            load,
        };
        let samples = servo::step_response(&run)?;
        let metrics = match servo::step_metrics(&samples, args.step_mm, controller.sample_s) {
            Some(found) => {
                let (over, settle) = (short(found.overshoot_pct), ms(found.settling_s));
                let rise = found.rise90_s.map_or("-".to_owned(), ms);
                let error = short(1e3 * found.steady_error_mm);
                let words = [word("overshoot"), word("settling"), word("rise"), word("steady")];
                let [o, s, r, e] = words;
                let line = format!("{o} {over} %  {s} {settle}  {r} {rise}  {e} {error} µm");
                rows.push((rival.name.clone(), line));
                json!(found)
            }
            None => match servo::load_metrics(&samples, 0.0, load.to_s, controller.sample_s) {
                Some(found) => {
                    let (most, left) =
                        (short(1e3 * found.max_deviation_mm), short(1e3 * found.at_window_end_mm));
                    let (m, l) = (word("deviation"), word("left"));
                    rows.push((rival.name.clone(), format!("{m} {most} µm  {l} {left} µm")));
                    json!(found)
                }
                None => Value::Null,
            },
        };
        objects.push(json!({ "controller": rival.key, "metrics": metrics }));
        let curve = samples.iter().map(|one| [one.t_s, args.step_mm, one.y_mm, one.u_v]).collect();
        curves.push((rival, curve));
    }
    let mut place = vec![PlotMark::Level(args.step_mm, String::new())];
    if args.step_mm != 0.0 {
        place.extend([0.98, 1.02].map(|part| PlotMark::Level(part * args.step_mm, String::new())));
    }
    let title = format!("{}: {} mm, {} V", word("step_title"), short(args.step_mm), short(load.volts));
    let object =
        json!({ "kind": "step", "step_mm": args.step_mm, "load_v": load.volts, "controllers": objects });
    Ok(sheet(object, rows, &curves, title, place))
}

fn stroke(args: &ServoArgs) -> Result<ComputedCase, Diagnostic> {
    let full_mm = args.height_mm + args.depth_mm;
    let down = Limits {
        speed_mm_per_s: args.down_speed,
        acceleration_mm_per_s2: 8_000.0,
        jerk_mm_per_s3: 600_000.0,
    };
    let up = Limits { speed_mm_per_s: args.up_speed, acceleration_mm_per_s2: 10_000.0, jerk_mm_per_s3: 1e6 };
    let down = profile::plan(MotionLaw::Power(0.5), full_mm, down)?;
    let up = profile::plan(MotionLaw::SCurve, full_mm, up)?;
    let (mut rows, mut objects, mut curves, mut marks) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for rival in rivals(args) {
        let run = StrokeRun {
            controller: rival.controller,
            plant: plant(args),
            height_mm: args.height_mm,
            depth_mm: args.depth_mm,
            down: Reference { duration_s: down.duration_s(), at: &|t| moment(&down, t) },
            up: Reference { duration_s: up.duration_s(), at: &|t| moment(&up, t) },
            dwell_s: 0.02,
            rest_s: 0.06,
            feed_forward: args.feed_forward,
            cutting_load_v: args.load.unwrap_or(0.4),
        };
        let (samples, found) = servo::stroke(&run)?;
        let (follow, depth) = (short(found.max_error_approach_mm), short(found.depth_error_mm));
        let (f, d) = (word("following"), word("depth_error"));
        rows.push((rival.name.clone(), format!("{f} {follow} mm  {d} {depth} mm")));
        objects.push(json!({ "controller": rival.key, "metrics": found }));
        if marks.is_empty() {
            marks.extend(found.contact_s.map(|contact_s| PlotMark::At(1e3 * contact_s, word("contact"))));
            let back_s = down.duration_s() + run.dwell_s;
            marks.push(PlotMark::At(1e3 * back_s, word("return")));
            marks.push(PlotMark::Level(args.height_mm, word("surface")));
        }
        let curve = samples.iter().map(|one| [one.t_s, one.r_mm, one.y_mm, one.u_v]).collect();
        curves.push((rival, curve));
    }
    let title = format!("{}: {} + {} mm", word("stroke_title"), short(args.height_mm), short(args.depth_mm));
    let object = json!({ "kind": "stroke", "height_mm": args.height_mm, "depth_mm": args.depth_mm,
        "feed_forward": args.feed_forward, "controllers": objects });
    Ok(sheet(object, rows, &curves, title, marks))
}

fn moment(profile: &Profile, t: f64) -> ReferenceMoment {
    ReferenceMoment {
        s_mm: profile.position_mm(t),
        v_mm_per_s: profile.speed(t),
        a_mm_per_s2: profile.acceleration(t),
    }
}

fn sheet(
    object: Value,
    rows: Vec<(String, String)>,
    curves: &[(Rival, Vec<Row>)],
    title: String,
    place: Vec<PlotMark>,
) -> ComputedCase {
    let mut columns = vec!["t_s".to_owned(), "r_mm".to_owned()];
    for (rival, _) in curves {
        columns.extend(["y_mm", "u_v"].map(|unit| format!("{}_{unit}", rival.key)));
    }
    let count = curves.iter().map(|(_, curve)| curve.len()).min().unwrap_or(0);
    let sample = |index: usize| {
        let mut row = vec![Some(curves[0].1[index][0]), Some(curves[0].1[index][1])];
        row.extend(curves.iter().flat_map(|(_, curve)| [Some(curve[index][2]), Some(curve[index][3])]));
        row
    };
    let series = |value: fn(&Row) -> f64| {
        let line = |(rival, curve): &(Rival, Vec<Row>)| {
            Series::line(&rival.name, curve.iter().map(|row| [1e3 * row[0], value(row)]).collect())
        };
        curves.iter().map(line).collect()
    };
    let plot = Plot {
        title,
        panels: vec![
            panel("place", "mm", series(|row| row[2]), place),
            panel("error", "mm", series(|row| row[1] - row[2]), Vec::new()),
            panel("control", "V", series(|row| row[3]), Vec::new()),
        ],
    };
    ComputedCase { object, rows, columns, samples: (0..count).map(sample).collect(), plot }
}
