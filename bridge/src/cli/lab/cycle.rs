//! `annulus lab cycle`: computes table and spindles in time, hole by hole, with and without overlap.
//!
//! A machine whose table and spindles do not move together shows its own moves.

use super::super::{Answer, Refusal};
use super::output::{ComputedCase, OutputArgs, deliver, ms, short, word};
use crate::machine_file;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::{self, Law, Machine};
use annulus_core::motion::coordination::{Cycle, SpindleRules, SpindleTimes, cycles, sequential_s};
use annulus_core::motion::drill_cycles;
use annulus_core::motion::one_by_one::one_by_one;
use annulus_core::motion::profile::{
    Limits, MotionLaw, Stroke, choose, plan, point_of_no_return_s, two_speeds,
};
use annulus_core::plot::{Plot, PlotAxis, PlotMark, PlotPanel, Series, SeriesLook};
use serde_json::{Value, json};

/// Default rapids, from the reference.
const HOPS_MM: [[f64; 2]; 3] = [[10.0, 0.0], [2.54, 2.54], [0.5, 0.0]];

/// Arguments of `annulus lab cycle`. Missing values come from the machine, or from the reference.
#[derive(Debug, clap::Args)]
pub(crate) struct CycleArgs {
    /// Add a rapid in X and Y, in mm, for one hole. Repeatable.
    #[arg(long, allow_hyphen_values = true, value_name = "X,Y")]
    hop: Vec<String>,
    /// Use this machine, a name or a file.
    #[arg(short, long, value_name = "NAME")]
    machine: Option<String>,
    /// Set the maximum speed of X and Y, in mm/s.
    #[arg(long, value_name = "MM/S", allow_negative_numbers = true)]
    xy_speed: Option<f64>,
    /// Set the maximum acceleration of X and Y, in mm/s².
    #[arg(long, value_name = "MM/S2", allow_negative_numbers = true)]
    xy_acceleration: Option<f64>,
    /// Set the maximum jerk of X and Y, in mm/s³.
    #[arg(long, value_name = "MM/S3", allow_negative_numbers = true)]
    xy_jerk: Option<f64>,
    /// Set the maximum speed of Z downward, in mm/s.
    #[arg(long, value_name = "MM/S", allow_negative_numbers = true)]
    down_speed: Option<f64>,
    /// Set the maximum acceleration of Z downward, in mm/s².
    #[arg(long, value_name = "MM/S2", allow_negative_numbers = true)]
    down_acceleration: Option<f64>,
    /// Set the maximum jerk of Z downward, in mm/s³.
    #[arg(long, value_name = "MM/S3", allow_negative_numbers = true)]
    down_jerk: Option<f64>,
    /// Set the maximum speed of Z upward, in mm/s.
    #[arg(long, value_name = "MM/S", allow_negative_numbers = true)]
    up_speed: Option<f64>,
    /// Set the maximum acceleration of Z upward, in mm/s².
    #[arg(long, value_name = "MM/S2", allow_negative_numbers = true)]
    up_acceleration: Option<f64>,
    /// Set the maximum jerk of Z upward, in mm/s³.
    #[arg(long, value_name = "MM/S3", allow_negative_numbers = true)]
    up_jerk: Option<f64>,
    /// Set the order of the power law of Z downward; 0 for an S-curve.
    #[arg(long, value_name = "ALPHA", allow_negative_numbers = true)]
    order: Option<f64>,
    /// Use a two-speed plunge: fast to the board, then with this feed, in mm/s.
    #[arg(long, value_name = "MM/S", allow_negative_numbers = true)]
    feed: Option<f64>,
    /// Set the height of the resting tool above the board, in mm.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    height_mm: Option<f64>,
    /// Set the depth below the surface, in mm.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    depth_mm: Option<f64>,
    /// Set the height of the tool from which the table may move, in mm.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    clear_mm: Option<f64>,
    /// Set the rest of the table before a tool may touch the board, in ms.
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    settle_ms: Option<f64>,
    /// Set the latency of a signal, in ms.
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    latency_ms: Option<f64>,
    /// Set how long before the contact the table must have settled, in ms.
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    margin_ms: Option<f64>,
    /// Set the pause at the bottom, in ms.
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    dwell_bottom_ms: Option<f64>,
    /// Set the minimum rest at the top, in ms.
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    dwell_top_ms: Option<f64>,
    /// Set the number of equal spindles.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=6))]
    spindles: Option<u32>,
    #[command(flatten)]
    output: OutputArgs,
}

/// All inputs of a timeline.
struct Setting {
    x: Limits,
    y: Limits,
    down: Limits,
    up: Limits,
    plane_law: Law,
    down_law: Law,
    up_law: Law,
    order: f64,
    feed: Option<f64>,
    height_mm: f64,
    depth_mm: f64,
    clear_mm: f64,
    rules: SpindleRules,
    margin_s: f64,
    dwell_bottom_s: f64,
    dwell_top_s: f64,
    spindles: u32,
    /// Stroke times of each spindle of a machine, and the last moment to stop the first one, s. Without a
    /// machine, they follow from the other values.
    own: Option<(Vec<SpindleTimes>, f64)>,
}

/// All results of a timeline. Times in s.
struct Found {
    /// Of the first spindle.
    times: SpindleTimes,
    /// Of all spindles.
    all: Vec<SpindleTimes>,
    cycles: Vec<Cycle>,
    /// Table and spindles move together.
    overlaps: bool,
    /// How long after its start a stroke can still be stopped clear of the board, s; `None` if the table
    /// rests first.
    last_stop_s: Option<f64>,
    total_s: f64,
    sequential_s: f64,
}

pub(crate) fn run(args: &CycleArgs) -> Result<Answer, Refusal> {
    let hops = hops(&args.hop)?;
    let found = match args.machine.as_deref() {
        None => together(&overridden(args, reference()), &hops),
        Some(name) => {
            let machine = changed(args, &machine_file::named(name)?.machine)?;
            if drill_cycles::overlaps(&machine) {
                of_machine(&machine).and_then(|setting| together(&setting, &hops))
            } else {
                apart(&machine, &hops)
            }
        }
    };
    deliver(&args.output, sheet(&found.map_err(Refusal::content)?, &hops))
}

/// The example of the reference, part C2.4.
fn reference() -> Setting {
    let limits = |speed, acceleration, jerk| Limits {
        speed_mm_per_s: speed,
        acceleration_mm_per_s2: acceleration,
        jerk_mm_per_s3: jerk,
    };
    let xy = limits(500.0, 10_000.0, 1e6);
    Setting {
        x: xy,
        y: xy,
        down: limits(150.0, 10_000.0, 2e6),
        up: limits(300.0, 20_000.0, 4e6),
        plane_law: Law::SCurve,
        down_law: Law::Power,
        up_law: Law::SCurve,
        order: 0.5,
        feed: None,
        height_mm: 3.0,
        depth_mm: 2.0,
        clear_mm: 0.3,
        rules: SpindleRules { settle_s: 0.005, latency_s: 0.0002 },
        margin_s: 0.003,
        dwell_bottom_s: 0.002,
        dwell_top_s: 0.001,
        spindles: 1,
        own: None,
    }
}

/// The timeline of a machine with its own strokes.
fn of_machine(machine: &Machine) -> Result<Setting, Diagnostic> {
    let (_, down, _) = drill_cycles::own(machine, 2)?;
    Ok(Setting {
        x: Limits::of_axis(machine, &machine.x),
        y: Limits::of_axis(machine, &machine.y),
        plane_law: machine.motion.plane,
        order: machine.motion.order,
        rules: SpindleRules {
            settle_s: 1e-3 * machine.settle_ms,
            latency_s: 1e-3 * machine.overlap.latency_ms,
        },
        spindles: machine.spindles,
        own: Some((drill_cycles::own_times(machine)?, drill_cycles::last_stop_s(machine, &down)?)),
        ..reference()
    })
}

/// The machine's own moves, one after the other.
fn apart(machine: &Machine, hops_mm: &[[f64; 2]]) -> Result<Found, Diagnostic> {
    let found = one_by_one(machine, hops_mm)?;
    let total_s = found.timeline.total_s();
    Ok(Found {
        times: found.times,
        all: vec![found.times; machine.spindles as usize],
        cycles: found.cycles,
        overlaps: false,
        last_stop_s: None,
        total_s,
        sequential_s: total_s,
    })
}

/// The machine with the given settings; an error if one is out of its range.
fn changed(args: &CycleArgs, machine: &Machine) -> Result<Machine, Refusal> {
    let curved = args.order.is_none_or(|order| order == 0.0);
    let rows = [
        ("x.max_speed", args.xy_speed),
        ("y.max_speed", args.xy_speed),
        ("x.max_acceleration", args.xy_acceleration),
        ("y.max_acceleration", args.xy_acceleration),
        ("x.max_jerk", args.xy_jerk),
        ("y.max_jerk", args.xy_jerk),
        ("motion.down_speed", args.down_speed),
        ("motion.down_acceleration", args.down_acceleration),
        ("motion.down_jerk", args.down_jerk),
        ("z.max_speed", args.up_speed),
        ("z.max_acceleration", args.up_acceleration),
        ("z.max_jerk", args.up_jerk),
        ("motion.order", args.order.filter(|_| !curved)),
        ("stroke.feed", args.feed),
        ("stroke.safe_height", args.height_mm),
        ("stroke.board_thickness", args.depth_mm.map(|depth| depth - machine.process.breakthrough.mm())),
        ("stroke.dwell_bottom", args.dwell_bottom_ms),
        ("stroke.settle", args.settle_ms),
        ("overlap.clear", args.clear_mm),
        ("overlap.latency", args.latency_ms),
        ("overlap.margin", args.margin_ms),
        ("overlap.dwell_top", args.dwell_top_ms),
        ("machine.spindles", args.spindles.map(f64::from)),
    ];
    let given =
        rows.into_iter().filter_map(|(key, value)| Some((key.to_owned(), machine::Value::Number(value?))));
    let mut changes: Vec<(String, machine::Value)> = given.collect();
    if args.order.is_some() {
        let law = if curved { "s_curve" } else { "power" };
        changes.push(("motion.down".to_owned(), machine::Value::Text(law.to_owned())));
    }
    machine::apply(machine, &changes).map_err(|all| {
        let none = || error!("machine.file_syntax", what = "?");
        Refusal::content(all.into_iter().next().unwrap_or_else(none))
    })
}

fn overridden(args: &CycleArgs, mut setting: Setting) -> Setting {
    let set =
        |field: &mut f64, value: Option<f64>, unit: f64| *field = value.map_or(*field, |value| unit * value);
    for axis in [&mut setting.x, &mut setting.y] {
        set(&mut axis.speed_mm_per_s, args.xy_speed, 1.0);
        set(&mut axis.acceleration_mm_per_s2, args.xy_acceleration, 1.0);
        set(&mut axis.jerk_mm_per_s3, args.xy_jerk, 1.0);
    }
    set(&mut setting.down.speed_mm_per_s, args.down_speed, 1.0);
    set(&mut setting.down.acceleration_mm_per_s2, args.down_acceleration, 1.0);
    set(&mut setting.down.jerk_mm_per_s3, args.down_jerk, 1.0);
    set(&mut setting.up.speed_mm_per_s, args.up_speed, 1.0);
    set(&mut setting.up.acceleration_mm_per_s2, args.up_acceleration, 1.0);
    set(&mut setting.up.jerk_mm_per_s3, args.up_jerk, 1.0);
    set(&mut setting.height_mm, args.height_mm, 1.0);
    set(&mut setting.depth_mm, args.depth_mm, 1.0);
    set(&mut setting.clear_mm, args.clear_mm, 1.0);
    set(&mut setting.rules.settle_s, args.settle_ms, 1e-3);
    set(&mut setting.rules.latency_s, args.latency_ms, 1e-3);
    set(&mut setting.margin_s, args.margin_ms, 1e-3);
    set(&mut setting.dwell_bottom_s, args.dwell_bottom_ms, 1e-3);
    set(&mut setting.dwell_top_s, args.dwell_top_ms, 1e-3);
    setting.feed = args.feed.or(setting.feed);
    setting.spindles = args.spindles.unwrap_or(setting.spindles);
    if let Some(order) = args.order {
        (setting.order, setting.down_law) = (order, if order == 0.0 { Law::SCurve } else { Law::Power });
    }
    setting
}

fn hops(texts: &[String]) -> Result<Vec<[f64; 2]>, Refusal> {
    let one = |text: &String| {
        let pair =
            text.split_once(',').and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
        let usable = pair.filter(|pair: &[f64; 2]| pair.iter().all(|way| way.abs() <= 1e6));
        let why = || Refusal::usage(error!("lab.bad_hop", found = text));
        usable.ok_or_else(why)
    };
    if texts.is_empty() { Ok(HOPS_MM.to_vec()) } else { texts.iter().map(one).collect() }
}

fn shape(law: Law, order: f64, length_mm: f64, limits: Limits) -> Result<MotionLaw, Diagnostic> {
    Ok(match law {
        Law::Linear => MotionLaw::Linear,
        Law::SCurve => MotionLaw::SCurve,
        Law::Power => MotionLaw::Power(order),
        Law::Automatic => choose(length_mm, limits)?.choice,
    })
}

/// Duration of a rapid: that of its slower axis.
fn hop_s(setting: &Setting, hop: [f64; 2]) -> Result<f64, Diagnostic> {
    let mut longest_s = 0.0_f64;
    for (way, limits) in hop.into_iter().zip([setting.x, setting.y]) {
        let shape = shape(setting.plane_law, setting.order, way.abs(), limits)?;
        longest_s = longest_s.max(plan(shape, way.abs(), limits)?.duration_s());
    }
    Ok(longest_s)
}

/// Stroke times of every spindle, and the last moment to stop the first one.
fn strokes(setting: &Setting) -> Result<(Vec<SpindleTimes>, f64), Diagnostic> {
    if let Some(own) = &setting.own {
        return Ok(own.clone());
    }
    let full_mm = setting.height_mm + setting.depth_mm;
    if !(setting.clear_mm >= 0.0 && setting.clear_mm < setting.height_mm) {
        let why = error!("lab.bad_clear", found = setting.clear_mm, ..);
        return Err(why.with("height", setting.height_mm));
    }
    let law = shape(setting.down_law, setting.order, full_mm, setting.down)?;
    let down = match setting.feed {
        Some(feed) => two_speeds(law, setting.height_mm, setting.depth_mm, feed, setting.down)?,
        None => Stroke::One(plan(law, full_mm, setting.down)?),
    };
    let law = shape(setting.up_law, setting.order, full_mm, setting.up)?;
    let up = Stroke::One(plan(law, full_mm, setting.up)?);
    let last_stop_s = point_of_no_return_s(&down, setting.height_mm, setting.clear_mm, setting.down)?;
    let times = SpindleTimes {
        dwell_bottom_s: setting.dwell_bottom_s,
        dwell_top_s: setting.dwell_top_s,
        margin_s: setting.margin_s,
        ..SpindleTimes::of(&down, &up, setting.height_mm, setting.clear_mm)
    };
    Ok((vec![times; setting.spindles as usize], last_stop_s))
}

/// Table and spindles moving together.
fn together(setting: &Setting, hops_mm: &[[f64; 2]]) -> Result<Found, Diagnostic> {
    let hops_s = hops_mm.iter().map(|hop| hop_s(setting, *hop)).collect::<Result<Vec<_>, _>>()?;
    let (spindles, last_stop_s) = strokes(setting)?;
    let times = spindles.first().copied().unwrap_or_default();
    let cycles = cycles(&hops_s, setting.rules, &spindles)?;
    let tops = cycles.iter().flat_map(|cycle| &cycle.spindles).map(|one| one.top_s);
    Ok(Found {
        times,
        total_s: tops.fold(0.0, f64::max),
        sequential_s: sequential_s(&hops_s, setting.rules, &spindles),
        all: spindles,
        overlaps: true,
        last_stop_s: Some(last_stop_s),
        cycles,
    })
}

fn sheet(found: &Found, hops_mm: &[[f64; 2]]) -> ComputedCase {
    let times = &found.times;
    let rate = |seconds: f64| 60.0 * hops_mm.len() as f64 / seconds;
    let all = found.all.len() as f64;
    let columns = "hole,hop_x_mm,hop_y_mm,xy_start_s,xy_end_s,ready_s,trigger_s,start_s,contact_s,bottom_s,\
                   up_start_s,clear_s,top_s,cycle_s,last_stop_s";
    ComputedCase {
        object: json!({ "hops_mm": hops_mm, "overlap": found.overlaps, "spindle": { "down_s": times.down_s,
            "up_s": times.up_s, "contact_s": times.contact_s, "leave_s": times.leave_s, "air_s": times.air_s(),
            "board_s": times.board_s(), "last_stop_s": found.last_stop_s },
            "events": found.cycles.iter().map(|cycle| event(found, cycle)).collect::<Vec<_>>(),
            "total_s": found.total_s, "sequential_s": found.sequential_s, "spindles": found.all.len(),
            "strokes": found.all.iter().map(stroke).collect::<Vec<_>>(),
            "holes_per_min": rate(found.total_s), "holes_per_min_all_spindles": all * rate(found.total_s),
            "holes_per_min_sequential": rate(found.sequential_s) }),
        rows: rows(found, hops_mm, rate),
        columns: columns.split(',').map(str::to_owned).collect(),
        samples: found.cycles.iter().zip(hops_mm).enumerate().map(|row| sample(found, row)).collect(),
        plot: plot(found),
    }
}

fn rows(found: &Found, hops_mm: &[[f64; 2]], rate: impl Fn(f64) -> f64) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    for (index, (cycle, hop)) in found.cycles.iter().zip(hops_mm).enumerate() {
        let hop = format!("{} {}, {} mm", word("hop"), short(hop[0]), short(hop[1]));
        let (clear, cycle_s) = (ms(cycle.clear_s), cycle.cycle_s.map_or("-".to_owned(), ms));
        let what = format!("{} {clear}  {} {cycle_s}", word("clear"), word("cycle"));
        rows.push((format!("{} {hop}", index + 1), what));
    }
    if let Some(last_s) = found.last_stop_s {
        let contact = format!("{} {}", word("contact"), ms(found.times.contact_s));
        rows.push((word("last_stop"), format!("{}  {contact}", ms(last_s))));
    }
    if found.all.windows(2).any(|two| two[0] != two[1]) {
        let contact = |times: &SpindleTimes| format!("{} {}", word("contact"), ms(times.contact_s));
        rows.extend((1..).zip(&found.all).map(|(number, times)| (format!("Z{number}"), contact(times))));
    }
    let totals = [("together", found.total_s), ("sequential", found.sequential_s)];
    for (key, seconds) in totals.into_iter().skip(usize::from(!found.overlaps)) {
        let mut what = format!("{}  {}/min", ms(seconds), short(rate(seconds)));
        if found.all.len() > 1 {
            let all = short(found.all.len() as f64 * rate(seconds));
            what += &format!(", {} {all}/min", word("all_spindles"));
        }
        rows.push((word(key), what));
    }
    rows
}

/// Stroke times of a spindle as JSON.
fn stroke(times: &SpindleTimes) -> Value {
    json!({ "down_s": times.down_s, "up_s": times.up_s, "contact_s": times.contact_s, "leave_s": times.leave_s,
        "margin_s": times.margin_s })
}

fn event(found: &Found, cycle: &Cycle) -> Value {
    let last_s = |start_s: f64| found.last_stop_s.map(|last_s| start_s + last_s);
    json!({ "xy_start_s": cycle.release_s, "xy_end_s": cycle.arrive_s, "ready_s": cycle.ready_s,
        "spindles": cycle.spindles.iter().map(|one| json!({ "trigger_s": one.trigger_s,
            "start_s": one.start_s, "last_stop_s": last_s(one.start_s), "contact_s": one.contact_s,
            "bottom_s": one.bottom_s, "up_start_s": one.up_start_s, "clear_s": one.clear_s,
            "top_s": one.top_s })).collect::<Vec<_>>(),
        "clear_s": cycle.clear_s, "cycle_s": cycle.cycle_s })
}

/// A hole as a row of the table.
fn sample(found: &Found, (index, (cycle, hop)): (usize, (&Cycle, &[f64; 2]))) -> Vec<Option<f64>> {
    let z = cycle.spindles.first().copied().unwrap_or_default();
    let numbers = [
        (index + 1) as f64,
        hop[0],
        hop[1],
        cycle.release_s,
        cycle.arrive_s,
        cycle.ready_s,
        z.trigger_s,
        z.start_s,
        z.contact_s,
        z.bottom_s,
        z.up_start_s,
        cycle.clear_s,
        z.top_s,
    ];
    let last_s = found.last_stop_s.map(|last_s| z.start_s + last_s);
    numbers.into_iter().map(Some).chain([cycle.cycle_s, last_s]).collect()
}

/// The plot of the motion over time: a row for the table, one per spindle.
fn plot(found: &Found) -> Plot {
    let spindles = found.all.len();
    let bar = |from: f64, to: f64, row: f64| [[1e3 * from, row], [1e3 * to, row]];
    let names: Vec<String> =
        (1..=spindles).rev().map(|one| format!("Z{one}")).chain([word("plane")]).collect();
    let plane = spindles as f64;
    let mut parts: [Vec<[f64; 2]>; 5] = Default::default();
    let mut marks = Vec::new();
    for cycle in &found.cycles {
        parts[0].extend(bar(cycle.release_s, cycle.arrive_s, plane));
        parts[1].extend(bar(cycle.arrive_s, cycle.ready_s, plane));
        for (index, z) in cycle.spindles.iter().enumerate() {
            let row = plane - 1.0 - index as f64;
            parts[2].extend(bar(z.start_s, z.bottom_s, row));
            parts[3].extend(bar(z.bottom_s, z.up_start_s, row));
            parts[4].extend(bar(z.up_start_s, z.top_s, row));
        }
        marks.push(PlotMark::At(1e3 * cycle.release_s, word("release")));
        if let Some(z) = cycle.spindles.first() {
            marks.push(PlotMark::At(1e3 * z.trigger_s, word("trigger")));
            let last =
                found.last_stop_s.map(|last_s| PlotMark::At(1e3 * (z.start_s + last_s), word("last_stop")));
            marks.extend(last);
            marks.push(PlotMark::At(1e3 * z.contact_s, word("contact")));
        }
        marks.push(PlotMark::At(1e3 * cycle.clear_s, word("clear")));
    }
    let looks = ["hop", "settle", "down", "dwell", "up"];
    let series = looks
        .iter()
        .zip(parts)
        .map(|(key, points)| Series::line(&word(key), points).looking(SeriesLook::Bars));
    let panel = PlotPanel {
        x: PlotAxis::new(&word("time"), "ms"),
        y: PlotAxis { names, ..PlotAxis::default() },
        series: series.collect(),
        marks,
    };
    Plot { title: word("cycle_title"), panels: vec![panel] }
}
