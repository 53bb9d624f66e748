//! The table and its spindles over time: `xyz-timeline/1`. Reference part C2.

use super::document::Node;
use super::profiles::{limits, planned};
use super::tally::Tally;
use super::{Checked, at, tolerance};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::motion::coordination::{Cycle, SpindleRules, SpindleTimes, cycles, sequential_s};
use annulus_core::motion::profile::{Limits, MotionLaw, Stroke, point_of_no_return_s};

pub(super) fn xyz_timeline(checked: &mut Checked, root: Node<'_>) -> Result<(), Diagnostic> {
    let room = tolerance(&root, "time_abs", 1e-9)?;
    for case in root.get("cases")?.items()? {
        let mut tally = Tally::of(&case);
        let hops = hops(&case)?;
        let rules =
            SpindleRules { settle_s: case.number_at("settle")?, latency_s: case.number_at("latency")? };
        let nodes = case.get("z")?.items()?;
        checked.spend((hops.len() * nodes.len()) as u64, &case)?;
        let mut spindles = Vec::new();
        for node in &nodes {
            spindles.push(spindle(&mut tally, node, room)?);
        }
        let found = cycles(&hops, rules, &spindles).or_else(at(&case))?;
        if let Some(events) = case.find("events") {
            compare(&mut tally, &events, &found, room)?;
        }
        let last = found.iter().flat_map(|cycle| &cycle.spindles).map(|one| one.top_s).fold(0.0, f64::max);
        tally.member(&case, "total_time", last, room)?;
        tally.member(&case, "sequential_time", sequential_s(&hops, rules, &spindles), room)?;
        checked.done(tally, &case)?;
    }
    Ok(())
}

/// Duration of each rapid, which is that of its slower axis.
fn hops(case: &Node<'_>) -> Result<Vec<f64>, Diagnostic> {
    let xy = case.get("xy")?;
    let axis = |name: &str| limits(&xy.get(name)?, ["V", "A", "J"]);
    let (x, y) = (axis("x")?, axis("y")?);
    let one = |row: Node<'_>| {
        let [dx, dy] = row.exactly()?;
        let mut longest = 0.0_f64;
        for (way, limits) in [(dx, x), (dy, y)] {
            let profile = planned(&way, MotionLaw::SCurve, way.number()?.abs(), limits)?;
            longest = longest.max(profile.duration_s());
        }
        Ok(longest)
    };
    case.get("moves")?.items()?.into_iter().map(one).collect()
}

/// The times of one spindle; also compares the derived values of the file.
fn spindle(tally: &mut Tally, node: &Node<'_>, room: f64) -> Result<SpindleTimes, Diagnostic> {
    let (height_mm, depth_mm) = (node.number_at("H")?, node.number_at("D")?);
    let (down, up) = (node.get("down")?, node.get("up")?);
    let order = MotionLaw::Power(down.number_at("alpha")?);
    let full_mm = height_mm + depth_mm;
    let down = Stroke::One(planned(&down, order, full_mm, limits(&down, ["Vm", "Am", "Jm"])?)?);
    let up = Stroke::One(planned(&up, MotionLaw::SCurve, full_mm, limits(&up, ["Vm", "Am", "J"])?)?);
    let times = SpindleTimes {
        dwell_bottom_s: node.number_at("dwell_bottom")?,
        dwell_top_s: node.number_at("dwell_top")?,
        margin_s: node.number_at("margin")?,
        ..SpindleTimes::of(&down, &up, height_mm, node.number_at("c")?)
    };
    let Some(derived) = node.find("derived") else { return Ok(times) };
    compare_times(tally, &derived, &times, |_| room)?;
    if let Some(abort) = derived.find("abort") {
        let bounds = Limits {
            speed_mm_per_s: node.get("down")?.number_at("Vm")?,
            acceleration_mm_per_s2: abort.number_at("A_stop")?,
            jerk_mm_per_s3: abort.number_at("J_stop")?,
        };
        let last_s =
            point_of_no_return_s(&down, height_mm, abort.number_at("gap")?, bounds).or_else(at(&abort))?;
        tally.member(&abort, "t_pnr", last_s, room)?;
        tally.member(&abort, "safe_margin", times.contact_s - last_s, room)?;
    }
    Ok(times)
}

pub(super) fn compare_times(
    tally: &mut Tally,
    expected: &Node<'_>,
    found: &SpindleTimes,
    room: impl Fn(f64) -> f64,
) -> Result<(), Diagnostic> {
    let rows = [
        ("T_dn", found.down_s),
        ("T_up", found.up_s),
        ("t_z", found.contact_s),
        ("t_leave", found.leave_s),
        ("t_air", found.air_s()),
        ("t_board", found.board_s()),
    ];
    rows.into_iter().try_for_each(|(key, value)| tally.member(expected, key, value, room(value)))
}

fn compare(tally: &mut Tally, events: &Node<'_>, found: &[Cycle], room: f64) -> Result<(), Diagnostic> {
    let rows = events.items()?;
    tally.equal_count(events, rows.len(), found.len());
    for (row, cycle) in rows.iter().zip(found) {
        tally.member(row, "xy_start", cycle.release_s, room)?;
        tally.member(row, "xy_end", cycle.arrive_s, room)?;
        tally.member(row, "ready", cycle.ready_s, room)?;
        tally.member(row, "all_clear", cycle.clear_s, room)?;
        match cycle.cycle_s {
            Some(cycle_s) => tally.member(row, "cycle", cycle_s, room)?,
            None => tally.equal_member(row, "cycle", serde_json::Value::Null),
        }
        let Some(z) = row.find("z") else { continue };
        let spindles = z.items()?;
        tally.equal_count(&z, spindles.len(), cycle.spindles.len());
        for (node, one) in spindles.iter().zip(&cycle.spindles) {
            let moments = [
                ("trigger", one.trigger_s),
                ("start", one.start_s),
                ("contact", one.contact_s),
                ("bottom", one.bottom_s),
                ("up_start", one.up_start_s),
                ("clear", one.clear_s),
                ("top", one.top_s),
            ];
            for (key, value) in moments {
                tally.member(node, key, value, room)?;
            }
        }
    }
    Ok(())
}
