//! Tests of the closed loop against reference numbers computed elsewhere.

use annulus_core::motion::profile::{Limits, MotionLaw, Profile, plan};
use annulus_core::servo::{
    CycleStage, Fuzzy, FuzzyRules, Gains, Load, Plant, Reference, ReferenceMoment, ServoController, StepRun,
    StrokeRun, infer, load_metrics, retuned_pid, staged_fuzzy, step_metrics, step_response, stroke,
};
use serde_json::Value;

fn vectors() -> Value {
    crate::reference::vectors("fuzzy_pid.json")
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("no number {key} in {row}"))
}

fn near(found: f64, expected: f64, room: f64, what: &str) {
    assert!((found - expected).abs() <= room, "{what}: {found} instead of {expected}");
}

fn controller(row: &Value) -> ServoController {
    let gain = |name: &str| Gains {
        kp: number(row, &format!("{name}Kp")),
        ki: number(row, &format!("{name}Ki")),
        kd: number(row, &format!("{name}Kd")),
    };
    let base = Gains { kp: number(row, "Kp0"), ki: number(row, "Ki0"), kd: number(row, "Kd0") };
    let rules = FuzzyRules::named(row["rules"].as_str().unwrap_or("even")).unwrap();
    let fuzzy = row["e_max"].is_number().then(|| Fuzzy {
        span: gain("d"),
        e_max_mm: number(row, "e_max"),
        ec_max_mm_per_s: number(row, "ec_max"),
        e0_mm: number(row, "e0"),
        rules: *rules.tables(),
    });
    ServoController { gains: base, fuzzy, u_max_v: number(row, "u_max"), sample_s: number(row, "Ts") }
}

#[test]
fn fuzzy_rules_and_inference_match_the_reference() {
    let file = vectors();
    for rules in [FuzzyRules::Even, FuzzyRules::Classic] {
        let tables = rules.tables();
        for (name, table) in [("Kp", &tables.kp), ("Ki", &tables.ki), ("Kd", &tables.kd)] {
            assert_eq!(serde_json::to_value(table).unwrap(), file["rules"][rules.name()][name]);
        }
    }
    let rows = file["inference"].as_array().unwrap();
    assert!(rows.len() > 50);
    for row in rows {
        let tables = FuzzyRules::named(row["rules"].as_str().unwrap()).unwrap().tables();
        for (name, table) in [("dKp", &tables.kp), ("dKi", &tables.ki), ("dKd", &tables.kd)] {
            near(infer(table, number(row, "E"), number(row, "EC")), number(row, name), 1e-12, name);
        }
    }
}

#[test]
fn closed_loops_match_the_reference() {
    let file = vectors();
    let cases = file["steps"].as_array().unwrap();
    assert!(cases.len() > 10);
    for case in cases {
        let id = case["id"].as_str().unwrap();
        let mut controller = controller(&case["controller"]);
        if case["plain_pid"] == true {
            controller = controller.plain();
        }
        let stage = match case["stage"].as_str().unwrap() {
            "xy" => CycleStage::Travel,
            "z_approach" => CycleStage::Approach,
            "z_cut" => CycleStage::Cut,
            other => panic!("{other}"),
        };
        let window = &case["disturbance_window"];
        let run = StepRun {
            controller,
            plant: Plant {
                gain_mm_per_s_per_v: number(&case["plant"], "K"),
                tau_s: number(&case["plant"], "tau"),
            },
            stage,
            setpoint_mm: number(case, "setpoint"),
            duration_s: number(case, "duration"),
            load: Load {
                volts: number(case, "disturbance_V"),
                from_s: window[0].as_f64().unwrap(),
                to_s: window[1].as_f64(),
            },
        };
        let samples = step_response(&run).unwrap();
        for row in case["samples_t_y_u"].as_array().unwrap() {
            let [t, y, u] = [0, 1, 2].map(|column| row[column].as_f64().unwrap());
            let sample = samples[(t / controller.sample_s).round() as usize - 1];
            near(sample.t_s, t, 1e-12, id);
            near(sample.y_mm, y, 1e-6, &format!("{id} place at {t}"));
            near(sample.u_v, u, 1e-5, &format!("{id} control at {t}"));
        }
        let expected = &case["metrics"];
        let close = |name: &str, found: f64| {
            let value = number(expected, name);
            near(found, value, 1e-3 * value.abs(), &format!("{id} {name}"));
        };
        if let Some(found) = step_metrics(&samples, run.setpoint_mm, controller.sample_s) {
            close("overshoot_pct", found.overshoot_pct);
            close("settling_s", found.settling_s);
            close("rise90_s", found.rise90_s.unwrap());
            close("steady_error_mm", found.steady_error_mm);
            close("iae_mm_s", found.iae_mm_s);
        } else {
            let found = load_metrics(&samples, 0.0, run.load.to_s, controller.sample_s).unwrap();
            close("max_deviation_mm", found.max_deviation_mm);
            close("final_mm", found.final_mm);
            close("at_window_end_mm", found.at_window_end_mm);
        }
    }
}

fn moment(profile: &Profile, t: f64) -> ReferenceMoment {
    ReferenceMoment {
        s_mm: profile.position_mm(t),
        v_mm_per_s: profile.speed(t),
        a_mm_per_s2: profile.acceleration(t),
    }
}

#[test]
fn whole_strokes_match_the_reference() {
    let file = vectors();
    let cases = file["strokes"].as_array().unwrap();
    assert!(cases.len() > 3);
    for case in cases {
        let id = case["id"].as_str().unwrap();
        let mut controller = controller(&case["controller"]);
        if case["plain_pid"] == true {
            controller = controller.plain();
        }
        let (height_mm, depth_mm) = (number(case, "H"), number(case, "D"));
        let limits = |row: &Value, jerk: &str| Limits {
            speed_mm_per_s: number(row, "Vm"),
            acceleration_mm_per_s2: number(row, "Am"),
            jerk_mm_per_s3: number(row, jerk),
        };
        let order = number(&case["down"], "alpha");
        let down = plan(MotionLaw::Power(order), height_mm + depth_mm, limits(&case["down"], "Jm")).unwrap();
        let up = plan(MotionLaw::SCurve, height_mm + depth_mm, limits(&case["up"], "J")).unwrap();
        let run = StrokeRun {
            controller,
            plant: Plant {
                gain_mm_per_s_per_v: number(&case["plant"], "K"),
                tau_s: number(&case["plant"], "tau"),
            },
            height_mm,
            depth_mm,
            down: Reference { duration_s: down.duration_s(), at: &|t| moment(&down, t) },
            up: Reference { duration_s: up.duration_s(), at: &|t| moment(&up, t) },
            dwell_s: number(case, "dwell"),
            rest_s: number(case, "rest"),
            feed_forward: case["feedforward"] == true,
            cutting_load_v: number(case, "cutting_load_V"),
        };
        let (samples, found) = stroke(&run).unwrap();
        let rows = case["samples_t_r_y_u"].as_array().unwrap();
        assert!(rows.len() > 20);
        for row in rows {
            let [t, r, y, u] = [0, 1, 2, 3].map(|column| row[column].as_f64().unwrap());
            let sample = samples[(t / controller.sample_s).round() as usize];
            near(sample.r_mm, r, 1e-9, &format!("{id} reference at {t}"));
            near(sample.y_mm, y, 1e-6, &format!("{id} place at {t}"));
            near(sample.u_v, u, 1e-5, &format!("{id} control at {t}"));
        }
        for (name, found) in [
            ("contact_time_s", found.contact_s.unwrap()),
            ("max_error_approach_mm", found.max_error_approach_mm),
            ("max_error_cut_mm", found.max_error_cut_mm),
            ("depth_error_end_of_dwell_mm", found.depth_error_mm),
            ("over_travel_mm", found.over_travel_mm),
            ("final_error_mm", found.final_error_mm),
        ] {
            let value = number(&case["metrics"], name);
            near(found, value, 1e-3 * value.abs(), &format!("{id} {name}"));
        }
    }
}

fn step(controller: ServoController, plant: Plant, setpoint_mm: f64) -> StepRun {
    let load = Load { volts: -0.05, ..Load::default() };
    StepRun { controller, plant, stage: CycleStage::Travel, setpoint_mm, duration_s: 0.4, load }
}

/// Part B2.4: the staged loop still overshoots less if the gain or the delay of the axis differs.
#[test]
fn staged_loop_tolerates_another_plant() {
    for (controller, low, high) in
        [(staged_fuzzy(), 0.0, 6.7), (staged_fuzzy().plain(), 9.8, 19.8), (retuned_pid(), 1.6, 8.1)]
    {
        for (gain, tau_s) in [(42.0, 0.006), (60.0, 0.006), (78.0, 0.006), (60.0, 0.004), (60.0, 0.009)] {
            let run = step(controller, Plant { gain_mm_per_s_per_v: gain, tau_s }, 1.0);
            let samples = step_response(&run).unwrap();
            let found = step_metrics(&samples, 1.0, controller.sample_s).unwrap().overshoot_pct;
            assert!((low..=high).contains(&found), "K {gain}, τ {tau_s}: {found} %");
        }
    }
}

/// The rules are symmetric: left and right are mirror images, bit for bit.
#[test]
fn opposite_directions_respond_symmetrically() {
    let plant = Plant { gain_mm_per_s_per_v: 60.0, tau_s: 0.006 };
    for size in [0.01, 0.2, 1.0, 30.0] {
        let right = step_response(&step(staged_fuzzy(), plant, size)).unwrap();
        let mut left = step(staged_fuzzy(), plant, -size);
        left.load.volts = 0.05;
        for (one, other) in right.iter().zip(step_response(&left).unwrap()) {
            assert!((one.y_mm + other.y_mm).abs() < 1e-12 * size.max(1.0), "{size} mm at {}", one.t_s);
        }
    }
}

#[test]
fn impossible_runs_are_refused_by_field() {
    let plant = Plant { gain_mm_per_s_per_v: 60.0, tau_s: 0.006 };
    let good = step(staged_fuzzy(), plant, 1.0);
    let rows = [
        ("plant-gain", StepRun { plant: Plant { gain_mm_per_s_per_v: 0.0, ..plant }, ..good }),
        ("plant-tau", StepRun { plant: Plant { tau_s: f64::NAN, ..plant }, ..good }),
        ("setpoint", StepRun { setpoint_mm: f64::INFINITY, ..good }),
        ("load", StepRun { load: Load { volts: f64::NAN, ..good.load }, ..good }),
        ("load-to", StepRun { load: Load { from_s: 0.2, to_s: Some(0.1), ..good.load }, ..good }),
    ];
    for (field, run) in rows {
        assert_eq!(step_response(&run).unwrap_err().args[0].1, field);
    }
    for duration_s in [0.0, -1.0, f64::NAN, 1e9] {
        assert_eq!(step_response(&StepRun { duration_s, ..good }).unwrap_err().code, "servo.too_long");
    }
}
