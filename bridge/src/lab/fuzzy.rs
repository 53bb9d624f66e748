//! The closed loop: `fuzzy-pid/1`. Reference part B2.

use super::document::Node;
use super::profiles::{limits, planned};
use super::tally::Tally;
use super::{Checked, at, tolerance};
use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::motion::profile::{MotionLaw, Profile};
use annulus_core::servo::{
    self, CycleStage, Fuzzy, FuzzyRules, Gains, LEVELS, Load, Plant, Reference, ReferenceMoment,
    ServoController, StepRun, StrokeRun, Table, Tables,
};

#[derive(Clone, Copy)]
struct Room {
    inference: f64,
    y: f64,
    u: f64,
    metrics: f64,
}

pub(super) fn fuzzy_pid(checked: &mut Checked, root: Node<'_>) -> Result<(), Diagnostic> {
    let room = Room {
        inference: tolerance(&root, "inference_abs", 1e-12)?,
        y: tolerance(&root, "closed_loop_y_abs", 1e-6)?,
        u: tolerance(&root, "closed_loop_u_abs", 1e-5)?,
        metrics: tolerance(&root, "metrics_rel", 1e-3)?,
    };
    let list = |key: &str| root.find(key).map_or(Ok(Vec::new()), |list| list.items());
    for (name, set) in root.find("rules").map_or(Ok(Vec::new()), |rules| rules.members())? {
        // Built-in sets are compared; other sets are inputs of the file's own cases.
        if let Some(rules) = FuzzyRules::named(name) {
            let mut tally = Tally::new(format!("rules {name}"));
            compare_rules(&mut tally, &set, rules.tables())?;
            checked.done(tally, &set)?;
        }
    }
    for case in list("inference")? {
        let tables = tables(&root, &case)?;
        let (e, ec) = (case.number_at("E")?, case.number_at("EC")?);
        let mut tally = Tally::of(&case);
        for (key, table) in [("dKp", &tables.kp), ("dKi", &tables.ki), ("dKd", &tables.kd)] {
            tally.member(&case, key, servo::infer(table, e, ec), room.inference)?;
        }
        checked.done(tally, &case)?;
    }
    for case in list("steps")? {
        let tally = step(checked, &root, &case, room)?;
        checked.done(tally, &case)?;
    }
    for case in list("strokes")? {
        let tally = stroke(checked, &root, &case, room)?;
        checked.done(tally, &case)?;
    }
    Ok(())
}

fn compare_rules(tally: &mut Tally, set: &Node<'_>, tables: &Tables) -> Result<(), Diagnostic> {
    for (key, table) in [("Kp", &tables.kp), ("Ki", &tables.ki), ("Kd", &tables.kd)] {
        let rows = set.get(key)?.exactly::<LEVELS>()?;
        for (row, rules) in rows.iter().zip(table) {
            for (entry, rule) in row.exactly::<LEVELS>()?.iter().zip(rules) {
                tally.equal(entry, *rule);
            }
        }
    }
    Ok(())
}

/// The rules that a case names: a built-in set, or one of the file. Without a name, the even set.
fn tables(root: &Node<'_>, case: &Node<'_>) -> Result<Tables, Diagnostic> {
    let Some(named) = case.find("rules") else { return Ok(*FuzzyRules::Even.tables()) };
    let name = named.text()?;
    if let Some(rules) = FuzzyRules::named(name) {
        return Ok(*rules.tables());
    }
    let set = root.find("rules").and_then(|rules| rules.find(name));
    let set = set.ok_or_else(|| named.refuse(code!("lab.unknown_name")).with("found", name))?;
    let table = |key: &str| -> Result<Table, Diagnostic> {
        let mut table = [[0; LEVELS]; LEVELS];
        for (row, entries) in table.iter_mut().zip(set.get(key)?.exactly::<LEVELS>()?) {
            for (rule, entry) in row.iter_mut().zip(entries.exactly::<LEVELS>()?) {
                *rule = entry.whole(-3, 3)? as i8;
            }
        }
        Ok(table)
    };
    Ok(Tables { kp: table("Kp")?, ki: table("Ki")?, kd: table("Kd")? })
}

fn controller(root: &Node<'_>, case: &Node<'_>) -> Result<ServoController, Diagnostic> {
    let node = case.get("controller")?;
    let gains = |[kp, ki, kd]: [&str; 3]| -> Result<Gains, Diagnostic> {
        Ok(Gains { kp: node.number_at(kp)?, ki: node.number_at(ki)?, kd: node.number_at(kd)? })
    };
    let plain = case.get("plain_pid")?.truth()?;
    let fuzzy = if plain {
        None
    } else {
        Some(Fuzzy {
            span: gains(["dKp", "dKi", "dKd"])?,
            e_max_mm: node.number_at("e_max")?,
            ec_max_mm_per_s: node.number_at("ec_max")?,
            e0_mm: node.number_at("e0")?,
            rules: tables(root, &node)?,
        })
    };
    let controller = ServoController {
        gains: gains(["Kp0", "Ki0", "Kd0"])?,
        fuzzy,
        u_max_v: node.number_at("u_max")?,
        sample_s: node.number_at("Ts")?,
    };
    controller.check().map_err(|why| node.place(why))?;
    Ok(controller)
}

fn plant(case: &Node<'_>) -> Result<Plant, Diagnostic> {
    let node = case.get("plant")?;
    Ok(Plant { gain_mm_per_s_per_v: node.number_at("K")?, tau_s: node.number_at("tau")? })
}

/// The sample nearest to a time in the file; `first` is the number of the sample at time 0.
fn sample_at<'a, T>(samples: &'a [T], t: &Node<'_>, sample_s: f64, first: f64) -> Result<&'a T, Diagnostic> {
    let index = t.number()? / sample_s - first;
    let nearest = index.round();
    if (index - nearest).abs() > 1e-3 || nearest < 0.0 || nearest >= samples.len() as f64 {
        return Err(t.refuse(code!("lab.no_sample")).with("sample", sample_s));
    }
    Ok(&samples[nearest as usize])
}

fn step(checked: &mut Checked, root: &Node<'_>, case: &Node<'_>, room: Room) -> Result<Tally, Diagnostic> {
    let controller = controller(root, case)?;
    let stage = case.get("stage")?;
    let [from, to] = case.get("disturbance_window")?.exactly()?;
    let run = StepRun {
        controller,
        plant: plant(case)?,
        stage: match stage.text()? {
            "xy" => CycleStage::Travel,
            "z_approach" => CycleStage::Approach,
            "z_cut" => CycleStage::Cut,
            "z_return" => CycleStage::Return,
            other => return Err(stage.refuse(code!("lab.unknown_name")).with("found", other)),
        },
        setpoint_mm: case.number_at("setpoint")?,
        duration_s: case.number_at("duration")?,
        load: Load {
            volts: case.number_at("disturbance_V")?,
            from_s: from.number()?,
            to_s: to.maybe_number()?,
        },
    };
    checked.spend((run.duration_s / controller.sample_s) as u64, case)?;
    let samples = servo::step_response(&run).or_else(at(case))?;
    let mut tally = Tally::of(case);
    for row in case.find("samples_t_y_u").map_or(Ok(Vec::new()), |rows| rows.items())? {
        let [t, y, u] = row.exactly()?;
        let sample = sample_at(&samples, &t, controller.sample_s, 1.0)?;
        tally.number(&y, sample.y_mm, room.y)?;
        tally.number(&u, sample.u_v, room.u)?;
    }
    let Some(expected) = case.find("metrics") else { return Ok(tally) };
    if let Some(found) = servo::step_metrics(&samples, run.setpoint_mm, controller.sample_s) {
        tally.relative(&expected, "overshoot_pct", found.overshoot_pct, room.metrics)?;
        tally.relative(&expected, "settling_s", found.settling_s, room.metrics)?;
        tally.relative(&expected, "steady_error_mm", found.steady_error_mm, room.metrics)?;
        tally.relative(&expected, "iae_mm_s", found.iae_mm_s, room.metrics)?;
        match (expected.find("rise90_s"), found.rise90_s) {
            (Some(node), None) => tally.equal(&node, serde_json::Value::Null),
            (Some(_), Some(rise_s)) => tally.relative(&expected, "rise90_s", rise_s, room.metrics)?,
            (None, _) => {}
        }
    }
    if let Some(found) = servo::load_metrics(&samples, run.setpoint_mm, run.load.to_s, controller.sample_s) {
        tally.relative(&expected, "max_deviation_mm", found.max_deviation_mm, room.metrics)?;
        tally.relative(&expected, "final_mm", found.final_mm, room.metrics)?;
        tally.relative(&expected, "at_window_end_mm", found.at_window_end_mm, room.metrics)?;
    }
    Ok(tally)
}

/// State of a profile at second `t`, in the loop's form.
fn moment(profile: &Profile, t: f64) -> ReferenceMoment {
    ReferenceMoment {
        s_mm: profile.position_mm(t),
        v_mm_per_s: profile.speed(t),
        a_mm_per_s2: profile.acceleration(t),
    }
}

fn stroke(checked: &mut Checked, root: &Node<'_>, case: &Node<'_>, room: Room) -> Result<Tally, Diagnostic> {
    let controller = controller(root, case)?;
    let (height_mm, depth_mm) = (case.number_at("H")?, case.number_at("D")?);
    let (down, up) = (case.get("down")?, case.get("up")?);
    let order = MotionLaw::Power(down.number_at("alpha")?);
    let full_mm = height_mm + depth_mm;
    let down = planned(&down, order, full_mm, limits(&down, ["Vm", "Am", "Jm"])?)?;
    let up = planned(&up, MotionLaw::SCurve, full_mm, limits(&up, ["Vm", "Am", "J"])?)?;
    let run = StrokeRun {
        controller,
        plant: plant(case)?,
        height_mm,
        depth_mm,
        down: Reference { duration_s: down.duration_s(), at: &|t| moment(&down, t) },
        up: Reference { duration_s: up.duration_s(), at: &|t| moment(&up, t) },
        dwell_s: case.number_at("dwell")?,
        rest_s: case.number_at("rest")?,
        feed_forward: case.get("feedforward")?.truth()?,
        cutting_load_v: case.number_at("cutting_load_V")?,
    };
    let total_s = run.down.duration_s + run.dwell_s + run.up.duration_s + run.rest_s;
    checked.spend((total_s / controller.sample_s) as u64, case)?;
    let (samples, found) = servo::stroke(&run).or_else(at(case))?;
    let mut tally = Tally::of(case);
    for row in case.find("samples_t_r_y_u").map_or(Ok(Vec::new()), |rows| rows.items())? {
        let [t, r, y, u] = row.exactly()?;
        let sample = sample_at(&samples, &t, controller.sample_s, 0.0)?;
        tally.number(&r, sample.r_mm, room.y)?;
        tally.number(&y, sample.y_mm, room.y)?;
        tally.number(&u, sample.u_v, room.u)?;
    }
    let Some(expected) = case.find("metrics") else { return Ok(tally) };
    let mut compare = |key: &str, found: f64| tally.relative(&expected, key, found, room.metrics);
    compare("max_error_approach_mm", found.max_error_approach_mm)?;
    compare("max_error_cut_mm", found.max_error_cut_mm)?;
    compare("depth_error_end_of_dwell_mm", found.depth_error_mm)?;
    compare("over_travel_mm", found.over_travel_mm)?;
    compare("final_error_mm", found.final_error_mm)?;
    match (expected.find("contact_time_s"), found.contact_s) {
        (Some(node), None) => tally.equal(&node, serde_json::Value::Null),
        (Some(_), Some(contact_s)) => {
            tally.relative(&expected, "contact_time_s", contact_s, room.metrics)?;
        }
        (None, _) => {}
    }
    Ok(tally)
}
