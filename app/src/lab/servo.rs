//! The closed-loop runs that the Lab compares: a setpoint step, and a whole stroke. Moves nothing.
//!
//! ```text
//! Typed ─▶ PID, PID re-tuned, fuzzy even, fuzzy classic ─ core::servo ─▶ samples and metrics of each
//! ```

use annulus_core::diagnostic::Diagnostic;
use annulus_core::motion::profile::{Limits, MotionLaw, Profile, plan};
use annulus_core::servo::{
    CycleStage, FuzzyRules, Gains, Load, Plant, Reference, ReferenceMoment, ServoController, StepMetrics,
    StepRun, StrokeMetrics, StrokeRun, retuned_pid, staged_fuzzy, step_metrics, step_response, stroke,
};

pub const CONTROLLERS: usize = 4;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Typed {
    /// Gains at rule output 0; also those of the plain PID.
    pub gains: Gains,
    pub plant: Plant,
    /// While travelling, the integral is active only below this error, mm.
    pub e0_mm: f64,
    pub u_max_v: f64,
    pub sample_s: f64,
    /// Load in V: in the second half of a step; during a stroke, while cutting.
    pub load_v: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoStep {
    pub setpoint_mm: f64,
    pub duration_s: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoStroke {
    /// From the rest position at the top to the board, mm.
    pub height_mm: f64,
    /// From the board's surface to the lowest point, mm.
    pub depth_mm: f64,
    pub down: Limits,
    pub up: Limits,
    /// Feed forward the reference's speed and acceleration.
    pub feed_forward: bool,
}

/// One controller's run: curves over ms.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ServoRun {
    /// Position, mm.
    pub place: Vec<[f64; 2]>,
    /// Reference minus position, mm.
    pub error: Vec<[f64; 2]>,
    pub control: Vec<[f64; 2]>,
}

/// In display order: plain PID, re-tuned PID, fuzzy with even rules, fuzzy with classic rules.
pub fn controllers(typed: &Typed) -> [ServoController; CONTROLLERS] {
    let with = |mut controller: ServoController, rules: Option<FuzzyRules>| {
        (controller.u_max_v, controller.sample_s) = (typed.u_max_v, typed.sample_s);
        if let Some(fuzzy) = &mut controller.fuzzy {
            fuzzy.e0_mm = typed.e0_mm;
            fuzzy.rules = *rules.unwrap_or_default().tables();
        }
        controller
    };
    let fuzzy = |rules| ServoController { gains: typed.gains, ..with(staged_fuzzy(), Some(rules)) };
    [
        fuzzy(FuzzyRules::Even).plain(),
        with(retuned_pid(), None),
        fuzzy(FuzzyRules::Even),
        fuzzy(FuzzyRules::Classic),
    ]
}

/// All controllers on a step, with their metrics.
pub fn steps(typed: &Typed, step: ServoStep) -> Result<Vec<(ServoRun, Option<StepMetrics>)>, Diagnostic> {
    let each = controllers(typed).into_iter().map(|controller| {
        let load = Load { volts: -typed.load_v, from_s: 0.5 * step.duration_s, to_s: None };
        let (setpoint_mm, duration_s) = (step.setpoint_mm, step.duration_s);
        let asked = StepRun {
            controller,
            plant: typed.plant,
            stage: CycleStage::Travel,
            setpoint_mm,
            duration_s,
            load,
        };
        let samples = step_response(&asked)?;
        let mut run = ServoRun::default();
        for sample in &samples {
            let ms = 1000.0 * sample.t_s;
            run.place.push([ms, sample.y_mm]);
            run.error.push([ms, setpoint_mm - sample.y_mm]);
            run.control.push([ms, sample.u_v]);
        }
        Ok((run, step_metrics(&samples, setpoint_mm, controller.sample_s)))
    });
    each.collect()
}

/// The reference of a stroke over ms, and each controller's run with its metrics.
pub type Strokes = (Vec<[f64; 2]>, Vec<(ServoRun, StrokeMetrics)>);

/// All controllers on a stroke, and the reference.
pub fn strokes(typed: &Typed, wanted: &ServoStroke) -> Result<Strokes, Diagnostic> {
    let way_mm = wanted.height_mm + wanted.depth_mm;
    let down = plan(MotionLaw::SCurve, way_mm, wanted.down)?;
    let up = plan(MotionLaw::SCurve, way_mm, wanted.up)?;
    let (down_at, up_at) = (moment(&down), moment(&up));
    let mut reference = Vec::new();
    let mut runs = Vec::new();
    for controller in controllers(typed) {
        let asked = StrokeRun {
            controller,
            plant: typed.plant,
            height_mm: wanted.height_mm,
            depth_mm: wanted.depth_mm,
            down: Reference { duration_s: down.duration_s(), at: &down_at },
            up: Reference { duration_s: up.duration_s(), at: &up_at },
            dwell_s: 0.0,
            rest_s: 0.05,
            feed_forward: wanted.feed_forward,
            cutting_load_v: typed.load_v,
        };
        let (samples, metrics) = stroke(&asked)?;
        reference = samples.iter().map(|sample| [1000.0 * sample.t_s, sample.r_mm]).collect();
        let mut run = ServoRun::default();
        for sample in &samples {
            let ms = 1000.0 * sample.t_s;
            run.place.push([ms, sample.y_mm]);
            run.error.push([ms, sample.r_mm - sample.y_mm]);
            run.control.push([ms, sample.u_v]);
        }
        runs.push((run, metrics));
    }
    Ok((reference, runs))
}

fn moment(profile: &Profile) -> impl Fn(f64) -> ReferenceMoment + '_ {
    |t| ReferenceMoment {
        s_mm: profile.position_mm(t),
        v_mm_per_s: profile.speed(t),
        a_mm_per_s2: profile.acceleration(t),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::servo::default_plant;

    fn typed() -> Typed {
        let ServoController { gains, u_max_v, sample_s, .. } = staged_fuzzy();
        Typed { gains, plant: default_plant(), e0_mm: 0.1, u_max_v, sample_s, load_v: 0.0 }
    }

    #[test]
    fn four_controllers_reach_the_setpoint_differently() {
        let runs = steps(&typed(), ServoStep { setpoint_mm: 1.0, duration_s: 0.4 }).unwrap();
        assert_eq!(runs.len(), CONTROLLERS);
        for (run, metrics) in &runs {
            let last = run.place.last().unwrap();
            assert!((last[0] - 400.0).abs() < 1e-6 && (last[1] - 1.0).abs() < 0.05, "{last:?}");
            assert!(metrics.is_some());
        }
        assert!(runs.windows(2).all(|two| two[0].0.place != two[1].0.place));
    }

    #[test]
    fn stroke_goes_down_and_returns() {
        let limits = Limits { speed_mm_per_s: 150.0, acceleration_mm_per_s2: 10_000.0, jerk_mm_per_s3: 2e6 };
        let wanted =
            ServoStroke { height_mm: 3.0, depth_mm: 2.0, down: limits, up: limits, feed_forward: true };
        let (reference, runs) = strokes(&typed(), &wanted).unwrap();
        assert_eq!(runs.len(), CONTROLLERS);
        assert!(reference.iter().any(|point| (point[1] - 5.0).abs() < 1e-2));
        for (run, metrics) in runs {
            assert!(metrics.contact_s.is_some() && run.place.last().unwrap()[1].abs() < 0.1, "{metrics:?}");
        }
    }

    #[test]
    fn invalid_sample_time_is_refused() {
        let wrong = Typed { sample_s: 0.0, ..typed() };
        let why = steps(&wrong, ServoStep { setpoint_mm: 1.0, duration_s: 0.4 }).unwrap_err();
        assert_eq!(why.code, "servo.bad_parameter");
    }
}
