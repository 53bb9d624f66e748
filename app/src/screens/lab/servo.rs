//! The closed-loop axis: four controllers on the same step or working stroke, side by side. Changes nothing.
//!
//! ```text
//! step │ stroke
//! gains, axis, load │ position, error and control over time, one curve per controller
//! metrics           │
//! ```

use super::fields::{self, Field};
use crate::i18n::{say, t};
use crate::lab::servo::{self, ServoRun, ServoStep, ServoStroke, Typed};
use crate::model::LabEvent;
use crate::page::{send, shared, watch};
use crate::readout::short;
use crate::widgets::{choice, plotted, refusal, segmented};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Machine;
use annulus_core::motion::profile::Limits;
use annulus_core::plot::{Plot, PlotAxis, PlotMark, PlotPanel, Series};
use annulus_core::servo::{Gains, Plant, StepMetrics, StrokeMetrics, default_plant, staged_fuzzy};
use leptos::html::{caption, div, h3, section, table, tbody, td, th, thead, tr};
use leptos::prelude::*;
use std::sync::Arc;

#[derive(Clone, Copy)]
struct Fields {
    kp: Field,
    ki: Field,
    kd: Field,
    gain: Field,
    tau: Field,
    e0: Field,
    sample: Field,
    load: Field,
    setpoint: Field,
    duration: Field,
    height: Field,
    depth: Field,
}

/// The results, one column of numbers per controller.
#[derive(Clone, Debug, PartialEq)]
enum Found {
    Steps(f64, Vec<(ServoRun, Option<StepMetrics>)>),
    Strokes(Vec<[f64; 2]>, f64, Vec<(ServoRun, StrokeMetrics)>),
}

fn controller_name(controller: usize) -> String {
    match controller {
        0 => say!("page.lab.servo.plain"),
        1 => say!("page.lab.servo.retuned"),
        2 => say!("page.lab.servo.even"),
        _ => say!("page.lab.servo.classic"),
    }
}

fn typed_fields() -> Fields {
    let own = |value: f64| Memo::new(move |_| value);
    let (controller, plant) = (staged_fuzzy(), default_plant());
    let of_machine =
        |read: fn(&Machine) -> f64| Memo::new(move |_| shared(|m| &m.machine).with(|machine| read(machine)));
    let field = |name, unit, range, own| Field { name, unit, range, own };
    Fields {
        kp: field("servo.kp", "V/mm", (0.0, 1e3), own(controller.gains.kp)),
        ki: field("servo.ki", "V/(mm·s)", (0.0, 1e5), own(controller.gains.ki)),
        kd: field("servo.kd", "V·s/mm", (0.0, 10.0), own(controller.gains.kd)),
        gain: field("servo.gain", "mm/(s·V)", (0.01, 1e4), own(plant.gain_mm_per_s_per_v)),
        tau: field("servo.tau", "ms", (0.1, 1e3), own(1000.0 * plant.tau_s)),
        e0: field("servo.e0", "mm", (0.0, 100.0), own(0.1)),
        sample: field("servo.sample", "ms", (0.1, 10.0), own(1000.0 * controller.sample_s)),
        load: field("servo.load", "V", (0.0, 10.0), own(0.2)),
        setpoint: field("servo.setpoint", "mm", (-100.0, 100.0), own(1.0)),
        duration: field("servo.duration", "ms", (10.0, 2000.0), own(400.0)),
        height: field(
            "servo.height",
            "mm",
            (0.1, 50.0),
            of_machine(|machine| machine.process.safe_height.mm()),
        ),
        depth: field(
            "servo.depth",
            "mm",
            (0.1, 50.0),
            of_machine(|machine| (machine.process.board_thickness + machine.process.breakthrough).mm()),
        ),
    }
}

fn found(fields: Fields, strokes: bool) -> Result<Found, Option<Diagnostic>> {
    let number = |field: Field| field.number().ok_or(None);
    let typed = Typed {
        gains: Gains { kp: number(fields.kp)?, ki: number(fields.ki)?, kd: number(fields.kd)? },
        plant: Plant { gain_mm_per_s_per_v: number(fields.gain)?, tau_s: number(fields.tau)? / 1000.0 },
        e0_mm: number(fields.e0)?,
        u_max_v: staged_fuzzy().u_max_v,
        sample_s: number(fields.sample)? / 1000.0,
        load_v: number(fields.load)?,
    };
    if !strokes {
        let setpoint_mm = number(fields.setpoint)?;
        let step = ServoStep { setpoint_mm, duration_s: number(fields.duration)? / 1000.0 };
        return servo::steps(&typed, step).map(|runs| Found::Steps(setpoint_mm, runs)).map_err(Some);
    }
    let (down, up) = shared(|m| &m.machine).with(|machine| {
        let (down, z) = (&machine.down, &machine.z);
        let limits = |speed, acceleration, jerk| Limits {
            speed_mm_per_s: speed,
            acceleration_mm_per_s2: acceleration,
            jerk_mm_per_s3: jerk,
        };
        (
            limits(down.max_speed_mm_per_s, down.max_acceleration_mm_per_s2, down.max_jerk_mm_per_s3),
            limits(z.max_speed_mm_per_s, z.max_acceleration_mm_per_s2, z.max_jerk_mm_per_s3),
        )
    });
    let (height_mm, depth_mm) = (number(fields.height)?, number(fields.depth)?);
    let wanted = ServoStroke { height_mm, depth_mm, down, up, feed_forward: true };
    let made = servo::strokes(&typed, &wanted).map_err(Some)?;
    Ok(Found::Strokes(made.0, height_mm, made.1))
}

pub(super) fn servo() -> impl IntoView {
    let fields = typed_fields();
    let strokes = watch(|m| &m.lab.stroke);
    let found = Memo::new(move |_| found(fields, strokes.get()));
    let plot =
        Memo::new(move |_| Arc::new(found.with(|found| found.as_ref().map(drawn).unwrap_or_default())));
    let answer = move || match found.get() {
        Ok(Found::Steps(_, runs)) => step_numbers(runs).into_any(),
        Ok(Found::Strokes(_, _, runs)) => stroke_numbers(runs).into_any(),
        Err(Some(why)) => refusal(why),
        Err(None) => fields::mend().into_any(),
    };
    let name = move || {
        if strokes.get() { say!("page.lab.servo.stroke_plot") } else { say!("page.lab.servo.step_plot") }
    };
    div().class("lab-sheet").child((
        div().class("lab-tools").child(parts(strokes)),
        div().class("lab-columns").child((
            div().class("lab-inputs").child((asked(fields, strokes), loop_fields(fields))),
            section().class("block lab-plots").attr("aria-label", name).child((
                h3().child(name),
                plotted(Box::new(name), plot, 470.0),
                div().attr("aria-live", "polite").child(answer),
            )),
        )),
    ))
}

fn parts(strokes: ReadSignal<bool>) -> impl IntoView {
    segmented(
        t!("page.lab.motion.parts"),
        (
            choice(
                move || !strokes.get(),
                t!("page.lab.servo.step"),
                |_| send(LabEvent::Stroke { on: false }),
            ),
            choice(
                move || strokes.get(),
                t!("page.lab.servo.stroke"),
                |_| send(LabEvent::Stroke { on: true }),
            ),
        ),
    )
}

fn asked(fields: Fields, strokes: ReadSignal<bool>) -> impl IntoView {
    section().class("block pairs").child(move || {
        if strokes.get() {
            (
                fields.height.view(t!("page.lab.servo.height")).into_any(),
                fields.depth.view(t!("page.lab.servo.depth")).into_any(),
                fields.load.view(t!("page.lab.servo.cutting_load")).into_any(),
            )
        } else {
            (
                fields.setpoint.view(t!("page.lab.servo.setpoint")).into_any(),
                fields.duration.view(t!("page.lab.servo.duration")).into_any(),
                fields.load.view(t!("page.lab.servo.load")).into_any(),
            )
        }
    })
}

fn loop_fields(fields: Fields) -> impl IntoView {
    (
        section().class("block").attr("aria-label", t!("page.lab.servo.controller")).child((
            h3().child(t!("page.lab.servo.controller")),
            div().class("pairs").child((
                fields.kp.view(t!("page.lab.servo.kp")),
                fields.ki.view(t!("page.lab.servo.ki")),
                fields.kd.view(t!("page.lab.servo.kd")),
                fields.e0.view(t!("page.lab.servo.e0")),
                fields.sample.view(t!("page.lab.servo.sample")),
            )),
        )),
        section().class("block").attr("aria-label", t!("page.lab.servo.plant")).child((
            h3().child(t!("page.lab.servo.plant")),
            div().class("pairs").child((
                fields.gain.view(t!("page.lab.servo.gain")),
                fields.tau.view(t!("page.lab.servo.tau")),
            )),
        )),
    )
}

fn drawn(found: &Found) -> Plot {
    let time = PlotAxis::new(&say!("page.lab.motion.time"), "ms");
    let runs: Vec<&ServoRun> = match found {
        Found::Steps(_, runs) => runs.iter().map(|(run, _)| run).collect(),
        Found::Strokes(_, _, runs) => runs.iter().map(|(run, _)| run).collect(),
    };
    let panel = |label: String, unit: &str, points: fn(&ServoRun) -> &Vec<[f64; 2]>| {
        let series =
            runs.iter().enumerate().map(|(at, run)| Series::line(&controller_name(at), points(run).clone()));
        PlotPanel {
            x: time.clone(),
            y: PlotAxis::new(&label, unit),
            series: series.collect(),
            marks: Vec::new(),
        }
    };
    let mut place = panel(say!("page.lab.servo.place"), "mm", |run| &run.place);
    match found {
        Found::Steps(setpoint_mm, _) => {
            place.marks.push(PlotMark::Level(*setpoint_mm, say!("page.lab.servo.setpoint")));
        }
        Found::Strokes(reference, height_mm, _) => {
            place.series.push(Series::line(&say!("page.lab.servo.reference"), reference.clone()));
            place.marks.push(PlotMark::Level(*height_mm, say!("page.lab.servo.surface")));
        }
    }
    let panels = vec![
        place,
        panel(say!("page.lab.servo.error"), "mm", |run| &run.error),
        panel(say!("page.lab.servo.control"), "V", |run| &run.control),
    ];
    Plot { title: String::new(), panels }
}

fn numbers(heads: Vec<String>, rows: Vec<Vec<String>>) -> impl IntoView {
    let heads = heads.into_iter().map(|head| th().attr("scope", "col").class("number").child(head));
    let rows = rows.into_iter().enumerate().map(|(at, cells)| {
        let cells = cells.into_iter().map(|cell| td().class("number").child(cell));
        tr().child((th().attr("scope", "row").child(move || controller_name(at)), cells.collect::<Vec<_>>()))
    });
    table().class("tight metrics").child((
        caption().class("unseen").child(t!("page.lab.servo.numbers")),
        thead().child(tr().child((
            th().attr("scope", "col").child(t!("page.lab.servo.controller")),
            heads.collect::<Vec<_>>(),
        ))),
        tbody().child(rows.collect::<Vec<_>>()),
    ))
}

fn step_numbers(runs: Vec<(ServoRun, Option<StepMetrics>)>) -> impl IntoView {
    let heads = vec![
        say!("page.lab.servo.overshoot"),
        say!("page.lab.servo.settling"),
        say!("page.lab.servo.rise"),
        say!("page.lab.servo.steady"),
        say!("page.lab.servo.iae"),
    ];
    let row = |metrics: Option<StepMetrics>| {
        let Some(found) = metrics else { return Vec::new() };
        let rise = found.rise90_s.map_or(f64::NAN, |rise| 1000.0 * rise);
        [
            found.overshoot_pct,
            1000.0 * found.settling_s,
            rise,
            1000.0 * found.steady_error_mm,
            1000.0 * found.iae_mm_s,
        ]
        .map(short)
        .to_vec()
    };
    numbers(heads, runs.into_iter().map(|(_, metrics)| row(metrics)).collect())
}

fn stroke_numbers(runs: Vec<(ServoRun, StrokeMetrics)>) -> impl IntoView {
    let heads = vec![
        say!("page.lab.servo.contact"),
        say!("page.lab.servo.error_approach"),
        say!("page.lab.servo.error_cut"),
        say!("page.lab.servo.depth_error"),
        say!("page.lab.servo.over_travel"),
        say!("page.lab.servo.final_error"),
    ];
    let row = |found: StrokeMetrics| {
        let um = [
            found.max_error_approach_mm,
            found.max_error_cut_mm,
            found.depth_error_mm,
            found.over_travel_mm,
            found.final_error_mm,
        ];
        let contact = found.contact_s.map_or(f64::NAN, |contact| 1000.0 * contact);
        std::iter::once(short(contact)).chain(um.map(|mm| short(1000.0 * mm))).collect::<Vec<_>>()
    };
    numbers(heads, runs.into_iter().map(|(_, metrics)| row(metrics)).collect())
}
