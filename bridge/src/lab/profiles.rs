//! Profiles: `trapezoid-scurve/1`, `power11/1`, `oracle-durations/1`. Reference parts B, C and D.

use super::document::Node;
use super::tally::Tally;
use super::{Checked, at, tolerance};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::motion::profile::{self, Limits, MotionLaw, Profile};

/// Tolerances of a profile, relative to its quantities.
#[derive(Clone, Copy)]
struct Room {
    time_rel: f64,
    s_rel: f64,
    v_rel: f64,
    a_rel: f64,
    j_rel: f64,
}

impl Room {
    fn of(root: &Node<'_>, a_rel: f64, j_rel: f64) -> Result<Self, Diagnostic> {
        Ok(Self {
            time_rel: tolerance(root, "time_rel", 1e-9)?,
            s_rel: tolerance(root, "s_rel_L", 1e-9)?,
            v_rel: tolerance(root, "v_rel_vlimit", 1e-9)?,
            a_rel: tolerance(root, "a_rel_alimit", a_rel)?,
            j_rel: tolerance(root, "j_rel_jlimit", j_rel)?,
        })
    }
}

pub(super) fn limits(node: &Node<'_>, [v, a, j]: [&str; 3]) -> Result<Limits, Diagnostic> {
    Ok(Limits {
        speed_mm_per_s: node.number_at(v)?,
        acceleration_mm_per_s2: node.number_at(a)?,
        jerk_mm_per_s3: node.number_at(j)?,
    })
}

/// Plans a profile; an error has the position of its case.
pub(super) fn planned(
    node: &Node<'_>,
    shape: MotionLaw,
    length_mm: f64,
    limits: Limits,
) -> Result<Profile, Diagnostic> {
    profile::plan(shape, length_mm, limits).or_else(at(node))
}

pub(super) fn trapezoid_scurve(checked: &mut Checked, root: Node<'_>) -> Result<(), Diagnostic> {
    let room = Room::of(&root, 1e-8, 1e-8)?;
    for case in root.get("cases")?.items()? {
        let (length_mm, limits) = (case.number_at("L")?, limits(&case, ["v", "a", "J"])?);
        let mut tally = Tally::of(&case);
        if let Some(expected) = case.find("selection") {
            selection(&mut tally, &case, &expected, room)?;
        }
        for (key, shape) in [("trapezoid", MotionLaw::Linear), ("scurve", MotionLaw::SCurve)] {
            if let Some(expected) = case.find(key) {
                let found = planned(&case, shape, length_mm, limits)?;
                compare(&mut tally, &expected, &found, limits, room)?;
            }
        }
        checked.done(tally, &case)?;
    }
    for case in root.find("selection_cases").map_or(Ok(Vec::new()), |cases| cases.items())? {
        let mut tally = Tally::of(&case);
        selection(&mut tally, &case, &case, room)?;
        checked.done(tally, &case)?;
    }
    Ok(())
}

/// The automatic choice, and peaks and times of both laws.
fn selection(tally: &mut Tally, case: &Node<'_>, expected: &Node<'_>, room: Room) -> Result<(), Diagnostic> {
    let (length_mm, limits) = (case.number_at("L")?, limits(case, ["v", "a", "J"])?);
    let found = profile::choose(length_mm, limits).or_else(at(case))?;
    let letter = |shape| if shape == MotionLaw::Linear { "T" } else { "S" };
    tally.relative(expected, "L_T", found.linear_from_mm, room.s_rel)?;
    tally.relative(expected, "L_S", found.s_curve_from_mm, room.s_rel)?;
    tally.equal_member(expected, "a_reached", found.reaches_acceleration);
    tally.equal_member(expected, "choice", letter(found.choice));
    tally.equal_member(expected, "choice_strict", letter(found.choice_strict));
    tally.equal_member(expected, "case", found.case);
    tally.member(
        expected,
        "v_peak_linear",
        found.linear_peak_mm_per_s,
        room.v_rel * limits.speed_mm_per_s,
    )?;
    tally.member(expected, "v_peak_s", found.s_curve_peak_mm_per_s, room.v_rel * limits.speed_mm_per_s)?;
    for (key, shape) in [("t_linear", MotionLaw::Linear), ("t_s", MotionLaw::SCurve)] {
        let duration_s = planned(case, shape, length_mm, limits)?.duration_s();
        tally.relative(expected, key, duration_s, room.time_rel)?;
    }
    Ok(())
}

fn compare(
    tally: &mut Tally,
    expected: &Node<'_>,
    found: &Profile,
    limits: Limits,
    room: Room,
) -> Result<(), Diagnostic> {
    let total_s = found.duration_s();
    let (time, place) = (room.time_rel * total_s, room.s_rel * found.length_mm);
    let (speed, acceleration) =
        (room.v_rel * limits.speed_mm_per_s, room.a_rel * limits.acceleration_mm_per_s2);
    tally.equal_member(expected, "case", found.case.name());
    tally.member(expected, "total_time", total_s, time)?;
    tally.member(expected, "v_peak", found.speed_mm_per_s, speed)?;
    tally.member(expected, "a_peak", found.acceleration_mm_per_s2, acceleration)?;
    let phases = found.phases();
    if let Some(node) = expected.find("phases") {
        let rows = node.items()?;
        tally.equal_count(&node, rows.len(), phases.len());
        for (row, phase) in rows.iter().zip(&phases) {
            tally.number(row, *phase, time)?;
        }
    }
    for row in expected.find("samples_t_s_v_a_j").map_or(Ok(Vec::new()), |rows| rows.items())? {
        let [t, s, v, a, j] = row.exactly()?;
        let t = t.number()?;
        tally.number(&s, found.position_mm(t), place)?;
        tally.number(&v, found.speed(t), speed)?;
        tally.number(&a, found.acceleration(t), acceleration)?;
        if found.shape == MotionLaw::Linear {
            tally.equal(&j, serde_json::Value::Null);
        } else {
            tally.number(&j, found.jerk(t), room.j_rel * limits.jerk_mm_per_s3)?;
        }
    }
    if let Some(node) = expected.find("boundaries_t_s_v") {
        let rows = node.items()?;
        tally.equal_count(&node, rows.len(), phases.len() - 1);
        let mut end_s = 0.0;
        for (row, phase) in rows.iter().zip(&phases) {
            let [t, s, v] = row.exactly()?;
            end_s += phase;
            tally.number(&t, end_s, time)?;
            tally.number(&s, found.position_mm(end_s), place)?;
            tally.number(&v, found.speed(end_s), speed)?;
        }
    }
    Ok(())
}

pub(super) fn power11(checked: &mut Checked, root: Node<'_>) -> Result<(), Diagnostic> {
    let room = Room::of(&root, 1e-7, 1e-6)?;
    for case in root.get("cases")?.items()? {
        let (length_mm, order) = (case.number_at("L")?, case.number_at("alpha")?);
        let limits = limits(&case, ["Vm", "Am", "Jm"])?;
        let found = planned(&case, MotionLaw::Power(order), length_mm, limits)?;
        let time = room.time_rel * found.duration_s();
        let mut tally = Tally::of(&case);
        compare(&mut tally, &case, &found, limits, room)?;
        tally.member(&case, "Tf", 0.5 * found.jerk_time_s, time)?;
        tally.relative(&case, "J_equivalent", limits.jerk_mm_per_s3 / (1.0 + order), room.time_rel)?;
        let s_curve = planned(&case, MotionLaw::SCurve, length_mm, limits)?;
        tally.relative(&case, "scurve_total_time", s_curve.duration_s(), room.time_rel)?;
        tally.member(&case, "time_at_half", found.time_at(0.5 * length_mm), time)?;
        tally.member(&case, "time_at_three_quarters", found.time_at(0.75 * length_mm), time)?;
        checked.done(tally, &case)?;
    }
    Ok(())
}

/// `oracle-durations/1`: durations of an independent generator. The generator has no power law, so that law
/// is compared with its move at the equivalent jerk.
pub(super) fn oracle(checked: &mut Checked, root: Node<'_>) -> Result<(), Diagnostic> {
    let relative = tolerance(&root, "duration_rel", 1e-9)?;
    for case in root.get("cases")?.items()? {
        let (length_mm, limits) = (case.number_at("L")?, limits(&case, ["V", "A", "J"])?);
        let mut tally = Tally::of(&case);
        let mut compare = |keys: &[&str], shape| -> Result<(), Diagnostic> {
            let found_s = planned(&case, shape, length_mm, limits)?.duration_s();
            keys.iter().try_for_each(|key| tally.relative(&case, key, found_s, relative))
        };
        compare(&["oracle_duration", "scurve_duration"], MotionLaw::SCurve)?;
        compare(&["linear_duration"], MotionLaw::Linear)?;
        if let Some(order) = case.find("alpha") {
            let power = MotionLaw::Power(order.number()?);
            compare(&["power11_duration", "oracle_duration_at_J_over_1_plus_alpha"], power)?;
        }
        checked.done(tally, &case)?;
    }
    Ok(())
}
