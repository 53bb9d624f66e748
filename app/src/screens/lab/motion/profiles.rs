//! The same move with the three motion laws: position, speed, acceleration and jerk over time. Changes
//! nothing.
//!
//! ```text
//! axis, length, limits, order   │ s, v, a, j of trapezoid, S-curve, power law
//! the law that the machine uses │ times, peaks, cases
//! ```

use crate::i18n::{say, t};
use crate::lab::motion::curve;
use crate::model::LabEvent;
use crate::page::{read, send, shared, watch};
use crate::readout::short;
use crate::screens::lab::fields::{self, Field};
use crate::widgets::{choice, plotted, refusal, segmented};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::axis_name;
use annulus_core::motion::profile::bounds::least_duration_s;
use annulus_core::motion::profile::{Case, Choice, Limits, MotionLaw, Profile, choose, plan};
use annulus_core::plot::{Plot, PlotAxis, PlotPanel, Series};
use leptos::html::{caption, dd, div, dl, dt, h3, p, section, span, table, tbody, td, th, thead, tr};
use leptos::prelude::*;
use std::sync::Arc;

#[derive(Clone, Copy)]
struct Typed {
    length: Field,
    speed: Field,
    acceleration: Field,
    jerk: Field,
    order: Field,
}

#[derive(Clone, Debug, PartialEq)]
struct Compared {
    length_mm: f64,
    limits: Limits,
    profiles: [Profile; 3],
    choice: Choice,
    least_s: f64,
}

fn law_name(law: usize) -> String {
    match law {
        0 => say!("page.lab.motion.linear"),
        1 => say!("page.lab.motion.s_curve"),
        _ => say!("page.lab.motion.power"),
    }
}

fn typed() -> Typed {
    let motor = watch(|m| &m.lab.motor);
    let of = move |limit: usize| {
        Memo::new(move |_| {
            shared(|m| &m.machine).with(|machine| {
                let axis = machine.axis(motor.get());
                let limits =
                    [axis.max_speed_mm_per_s, axis.max_acceleration_mm_per_s2, axis.max_jerk_mm_per_s3];
                limits[limit]
            })
        })
    };
    let order = Memo::new(|_| read(|m| m.machine.motion.order));
    let field = |name, unit, range, own| Field { name, unit, range, own };
    Typed {
        length: field("move.length", "mm", (0.0, 10_000.0), Memo::new(|_| 10.0)),
        speed: field("move.speed", "mm/s", (0.001, 1e5), of(0)),
        acceleration: field("move.acceleration", "mm/s²", (0.001, 1e7), of(1)),
        jerk: field("move.jerk", "mm/s³", (0.001, 1e10), of(2)),
        order: field("move.order", "", (0.01, 2.0), order),
    }
}

fn compared(typed: Typed) -> Result<Compared, Option<Diagnostic>> {
    let number = |field: Field| field.number().ok_or(None);
    let length_mm = number(typed.length)?;
    let (speed, acceleration) = (number(typed.speed)?, number(typed.acceleration)?);
    let limits = Limits {
        speed_mm_per_s: speed,
        acceleration_mm_per_s2: acceleration,
        jerk_mm_per_s3: number(typed.jerk)?,
    };
    let planned = |shape| plan(shape, length_mm, limits).map_err(Some);
    let profiles = [
        planned(MotionLaw::Linear)?,
        planned(MotionLaw::SCurve)?,
        planned(MotionLaw::Power(number(typed.order)?))?,
    ];
    let choice = choose(length_mm, limits).map_err(Some)?;
    let least_s = least_duration_s(length_mm, limits, None).map_err(Some)?;
    Ok(Compared { length_mm, limits, profiles, choice, least_s })
}

pub(super) fn profiles() -> impl IntoView {
    let typed = typed();
    let compared = Memo::new(move |_| compared(typed));
    let plot = Memo::new(move |_| {
        Arc::new(compared.with(|compared| compared.as_ref().map(drawn).unwrap_or_default()))
    });
    let answer = move || match compared.get() {
        Ok(compared) => (chosen(compared.clone()), numbers(compared)).into_any(),
        Err(Some(why)) => refusal(why),
        Err(None) => fields::mend().into_any(),
    };
    div().class("lab-part").child(
        div().class("lab-columns").child((
            div().class("lab-inputs").child((
                section().class("block").attr("aria-label", t!("page.lab.motion.move")).child((
                    h3().child(t!("page.lab.motion.move")),
                    axes(),
                    div().class("pairs").child((
                        typed.length.view(t!("page.lab.motion.length")),
                        typed.speed.view(t!("page.lab.motion.speed_limit")),
                        typed.acceleration.view(t!("page.lab.motion.acceleration_limit")),
                        typed.jerk.view(t!("page.lab.motion.jerk_limit")),
                        typed.order.view(t!("page.lab.motion.order")),
                    )),
                )),
                section()
                    .class("block")
                    .attr("aria-label", t!("page.lab.motion.choice"))
                    .attr("aria-live", "polite")
                    .child(answer),
            )),
            section().class("block lab-plots").attr("aria-label", t!("page.lab.motion.comparison")).child((
                h3().child(t!("page.lab.motion.comparison")),
                plotted(t!("page.lab.motion.comparison"), plot, 620.0),
            )),
        )),
    )
}

/// The axis whose limits the fields start with.
fn axes() -> impl IntoView {
    let motor = || read(|m| m.lab.motor);
    let choices = [0, 1, 2].map(|axis| {
        choice(
            move || motor() == axis,
            move || axis_name(axis),
            move |_| send(LabEvent::Motor { motor: axis }),
        )
        .into_any()
    });
    div().class("field").child((
        span().child(t!("page.lab.motion.axis")),
        segmented(t!("page.lab.motion.axis"), Vec::from(choices)),
    ))
}

fn drawn(compared: &Compared) -> Plot {
    let time = PlotAxis::new(&say!("page.lab.motion.time"), "ms");
    let panel = |label: String, unit: &str, value: fn(&Profile, f64) -> f64, jumps: bool| {
        let series = compared.profiles.iter().enumerate().map(|(law, profile)| {
            // The linear law has no finite jerk: its acceleration jumps.
            let known = !(jumps && profile.shape == MotionLaw::Linear);
            Series::line(&law_name(law), if known { curve(profile, value) } else { Vec::new() })
        });
        PlotPanel {
            x: time.clone(),
            y: PlotAxis::new(&label, unit),
            series: series.collect(),
            marks: Vec::new(),
        }
    };
    Plot {
        title: String::new(),
        panels: vec![
            panel(say!("page.lab.motion.way"), "mm", Profile::position_mm, false),
            panel(say!("page.lab.motion.speed_is"), "mm/s", Profile::speed, false),
            panel(say!("page.lab.motion.acceleration_is"), "mm/s²", Profile::acceleration, false),
            panel(say!("page.lab.motion.jerk_is"), "mm/s³", Profile::jerk, true),
        ],
    }
}

fn case_words(case: Case) -> String {
    match case {
        Case::Both => say!("page.lab.motion.case_both"),
        Case::Speed | Case::Cruise => say!("page.lab.motion.case_speed"),
        Case::Acceleration => say!("page.lab.motion.case_acceleration"),
        Case::Neither => say!("page.lab.motion.case_neither"),
        Case::Triangle => say!("page.lab.motion.case_triangle"),
    }
}

fn numbers(compared: Compared) -> impl IntoView {
    let head = |text: fn() -> String| th().attr("scope", "col").class("number").child(text);
    let rows = compared.profiles.into_iter().enumerate().map(|(law, profile)| {
        tr().child((
            th().attr("scope", "row").child(move || law_name(law)),
            td().class("number").child(short(1000.0 * profile.duration_s())),
            td().class("number").child(short(profile.speed_mm_per_s)),
            td().class("number").child(short(profile.acceleration_mm_per_s2)),
            td().child(move || case_words(profile.case)),
        ))
    });
    table().class("tight").child((
        caption().class("unseen").child(t!("page.lab.motion.comparison")),
        thead().child(tr().child((
            th().attr("scope", "col").child(t!("page.lab.motion.law")),
            head(|| say!("page.lab.motion.took_ms")),
            head(|| say!("page.lab.motion.peak_speed")),
            head(|| say!("page.lab.motion.peak_acceleration")),
            th().attr("scope", "col").child(t!("page.lab.motion.reaches")),
        ))),
        tbody().child(rows.collect::<Vec<_>>()),
    ))
}

fn chosen(compared: Compared) -> impl IntoView {
    let Compared { choice, length_mm, least_s, .. } = compared;
    let law = usize::from(choice.choice != MotionLaw::Linear);
    let why = move || {
        let (length, from_t, from_s) =
            (short(length_mm), short(choice.linear_from_mm), short(choice.s_curve_from_mm));
        match choice.case {
            1 => say!("page.lab.motion.why_1", length = length, from_s = from_s),
            2 => say!("page.lab.motion.why_2", length = length, from_t = from_t, from_s = from_s),
            _ => say!("page.lab.motion.why_3", length = length, from_t = from_t),
        }
    };
    let fact = |name: fn() -> String, value: String| (dt().child(name), dd().child(value));
    (
        h3().child(t!("page.lab.motion.choice")),
        p().class("choice").child(move || law_name(law)),
        p().class("quiet").child(why),
        dl().class("facts").child((
            fact(|| say!("page.lab.motion.l_t"), format!("{} mm", short(choice.linear_from_mm))),
            fact(|| say!("page.lab.motion.l_s"), format!("{} mm", short(choice.s_curve_from_mm))),
            fact(|| say!("page.lab.motion.bound"), format!("{} ms", short(1000.0 * least_s))),
        )),
    )
}
