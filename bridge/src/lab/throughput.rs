//! Holes per minute: `throughput/1`. Reference part D.3.

use super::document::Node;
use super::profiles::planned;
use super::tally::Tally;
use super::timeline::compare_times;
use super::{Checked, at, tolerance};
use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Dynamics;
use annulus_core::motion::coordination::{SpindleRules, SpindleTimes, cycle_s};
use annulus_core::motion::profile::{Limits, MotionLaw, Stroke, two_speeds};
use annulus_core::steps::automaton;
use std::collections::BTreeMap;

const REACH: i64 = 1_000_000_000;

pub(super) fn throughput(checked: &mut Checked, root: Node<'_>) -> Result<(), Diagnostic> {
    let room = tolerance(&root, "rel", 1e-7)?;
    let named = |key: &str| root.find(key).map_or(Ok(Vec::new()), |all| all.members());
    let mut spindles = BTreeMap::new();
    for (name, node) in named("z")? {
        let times = spindle(&node)?;
        spindles.insert(name, times);
        if let Some(expected) = node.find("times") {
            let mut tally = Tally::new(format!("z {name}"));
            compare_times(&mut tally, &expected, &times, |value| room * value)?;
            checked.done(tally, &expected)?;
        }
    }
    let tables: BTreeMap<&str, Node<'_>> = named("xy")?.into_iter().collect();
    let list = |key: &str| root.find(key).map_or(Ok(Vec::new()), |list| list.items());
    for case in list("rows")? {
        let (xy, z) = (case.get("xy")?, case.get("z")?);
        let unknown = |node: &Node<'_>| node.refuse(code!("lab.unknown_name")).with("found", node.value());
        let table = tables.get(xy.text()?).ok_or_else(|| unknown(&xy))?;
        let times = spindles.get(z.text()?).ok_or_else(|| unknown(&z))?;
        let limits = super::profiles::limits(table, ["V", "A", "J"])?;
        let hop_s = planned(&case, MotionLaw::SCurve, case.number_at("pitch")?, limits)?.duration_s();
        let rules = SpindleRules { settle_s: root.number_at("settle")?, latency_s: 0.0 };
        let mut tally = Tally::of(&case);
        tally.relative(&case, "t_xy", hop_s, room)?;
        rate(&mut tally, &case, cycle_s(hop_s, rules, times), room)?;
        let limited_by = if times.air_s() >= hop_s + rules.settle_s { "z" } else { "xy" };
        tally.equal_member(&case, "limited_by", limited_by);
        checked.done(tally, &case)?;
    }
    if let Some(hobby) = root.find("hobby") {
        sequential(checked, &hobby, room)?;
    }
    for case in list("step_automaton")? {
        let count = |key: &str| -> Result<f64, Diagnostic> {
            let distance = case.get(key)?.whole(0, REACH)?.unsigned_abs();
            Ok(automaton::total(&Dynamics::arendt(), distance).or_else(at(&case))? as f64)
        };
        let cycle = (count("n_xy")? + 2.0 * count("n_z")?) / case.number_at("f")?;
        let mut tally = Tally::of(&case);
        rate(&mut tally, &case, cycle, room)?;
        checked.done(tally, &case)?;
    }
    Ok(())
}

/// Compares cycle time and holes per minute.
fn rate(tally: &mut Tally, case: &Node<'_>, cycle: f64, room: f64) -> Result<(), Diagnostic> {
    tally.relative(case, "cycle", cycle, room)?;
    tally.relative(case, "holes_per_min", 60.0 / cycle, room)
}

/// The stored strokes of a spindle: `["s", V, A, J]` or `["2", V, A, J, feed]` down, `[V, A, J]` up.
fn spindle(node: &Node<'_>) -> Result<SpindleTimes, Diagnostic> {
    let (height_mm, depth_mm) = (node.number_at("H")?, node.number_at("D")?);
    let row = |items: &[Node<'_>]| -> Result<Limits, Diagnostic> {
        match items {
            [v, a, j] => Ok(Limits {
                speed_mm_per_s: v.number()?,
                acceleration_mm_per_s2: a.number()?,
                jerk_mm_per_s3: j.number()?,
            }),
            _ => Err(node.refuse(code!("lab.wrong_length")).with("found", items.len()).with("wanted", 3)),
        }
    };
    let (down, up) = (node.get("down")?, node.get("up")?);
    let items = down.items()?;
    let one = |limits| planned(node, MotionLaw::SCurve, height_mm + depth_mm, limits).map(Stroke::One);
    let stroke = match items.as_slice() {
        [kind, rest @ ..] if kind.text()? == "s" => one(row(rest)?)?,
        [kind, rest @ .., feed] if kind.text()? == "2" => {
            let limits = row(rest)?;
            two_speeds(MotionLaw::SCurve, height_mm, depth_mm, feed.number()?, limits).or_else(at(&down))?
        }
        [kind, ..] => return Err(kind.refuse(code!("lab.unknown_name")).with("found", kind.value())),
        [] => return Err(down.refuse(code!("lab.wrong_length")).with("found", 0).with("wanted", "4 or 5")),
    };
    Ok(SpindleTimes::of(&stroke, &one(row(&up.items()?)?)?, height_mm, node.number_at("c")?))
}

/// A machine with the linear law and no overlap: rapid, approach, plunge and retract are separate moves.
fn sequential(checked: &mut Checked, hobby: &Node<'_>, room: f64) -> Result<(), Diagnostic> {
    let params = hobby.get("params")?;
    let pair = |key: &str| -> Result<Limits, Diagnostic> {
        let [v, a] = params.get(key)?.exactly()?;
        Ok(Limits { speed_mm_per_s: v.number()?, acceleration_mm_per_s2: a.number()?, jerk_mm_per_s3: 1.0 })
    };
    let (xy, z) = (pair("xy")?, pair("z")?);
    let (height_mm, depth_mm) = (params.number_at("H")?, params.number_at("D")?);
    let linear_s = |length_mm: f64, limits| {
        planned(&params, MotionLaw::Linear, length_mm, limits).map(|profile| profile.duration_s())
    };
    let feed = Limits { speed_mm_per_s: params.number_at("feed")?, ..z };
    let stroke_s = linear_s(height_mm, z)? + linear_s(depth_mm, feed)? + linear_s(height_mm + depth_mm, z)?;
    for case in hobby.get("rows")?.items()? {
        let hop_s = linear_s(case.number_at("pitch")?, xy)?;
        let mut tally = Tally::of(&case);
        tally.relative(&case, "t_xy", hop_s, room)?;
        tally.relative(&case, "t_z", stroke_s, room)?;
        rate(&mut tally, &case, hop_s + stroke_s, room)?;
        checked.done(tally, &case)?;
    }
    Ok(())
}
