//! The control law for one sample: fuzzy gains, terms that depend on the stage, and anti-windup.
//!
//! ```text
//!  stage                       P  I             D        the integrator sums the product Ki·e, so a changing
//!  travel, fast return         1  |e| < e0      0        Ki does not make u jump. Every change of the stage
//!  approach to the board       1  0             0        clears it, and it ignores errors that would drive
//!  in the board                1  1             1        the control further into its limit
//!  plain PID, any stage        1  1             1
//! ```

use super::fuzzy::{FuzzyRules, Tables, infer};
use super::within;
use crate::diagnostic::Diagnostic;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Proportional, V/mm.
    pub kp: f64,
    /// Integral, V/(mm·s).
    pub ki: f64,
    /// Derivative, V·s/mm.
    pub kd: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fuzzy {
    /// Greatest change of each gain by the rules (at ±3).
    pub span: Gains,
    /// Error that counts as 3, mm.
    pub e_max_mm: f64,
    /// Change of the error that counts as 3, mm/s.
    pub ec_max_mm_per_s: f64,
    /// The integral works below this error during travel and return, mm.
    pub e0_mm: f64,
    /// Rule tables, entries −3 … 3.
    pub rules: Tables,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoController {
    /// Gains if the rules give 0.
    pub gains: Gains,
    /// Rules and stages; none: a plain PID with all terms always on.
    pub fuzzy: Option<Fuzzy>,
    pub u_max_v: f64,
    pub sample_s: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CycleStage {
    Travel,
    /// Z moves from the reference point to the board's surface.
    Approach,
    /// Z is in the board, from the contact signal on.
    Cut,
    /// Z returns fast.
    Return,
}

/// State between samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    pub integral_v: f64,
    /// Error of the previous sample, mm; none at the first.
    pub last_error_mm: Option<f64>,
}

impl Memory {
    /// Call at every change of the stage: clears the integral but not the error.
    pub fn change_stage(&mut self) {
        self.integral_v = 0.0;
    }
}

/// The staged fuzzy PID of the source, with symmetric rules.
pub const fn staged_fuzzy() -> ServoController {
    let fuzzy = Fuzzy {
        span: Gains { kp: 1.2, ki: 40.0, kd: 0.0032 },
        e_max_mm: 0.5,
        ec_max_mm_per_s: 45.0,
        e0_mm: 0.1,
        rules: *FuzzyRules::Even.tables(),
    };
    let gains = Gains { kp: 1.6, ki: 20.0, kd: 0.004 };
    ServoController { gains, fuzzy: Some(fuzzy), u_max_v: 10.0, sample_s: 0.0005 }
}

/// A plain PID with more P and D, for a fair comparison.
pub const fn retuned_pid() -> ServoController {
    let gains = Gains { kp: 5.0, ki: 20.0, kd: 0.02 };
    ServoController { gains, fuzzy: None, u_max_v: 10.0, sample_s: 0.0005 }
}

/// One sample: reference `r_mm`, position `y_mm`, feed-forward `ahead_v`. Returns the control in V.
///
/// The parameters must have passed [`ServoController::check`].
pub fn control(
    controller: &ServoController,
    memory: &mut Memory,
    stage: CycleStage,
    r_mm: f64,
    y_mm: f64,
    ahead_v: f64,
) -> f64 {
    let (limit, sample_s) = (controller.u_max_v, controller.sample_s);
    let e = r_mm - y_mm;
    let ec = memory.last_error_mm.map_or(0.0, |last| (e - last) / sample_s);
    memory.last_error_mm = Some(e);
    let gains = controller.gains_at(e, ec);
    let (integral_on, derivative_on) = controller.terms(stage, e);
    let base = gains.kp * e + if derivative_on { gains.kd * ec } else { 0.0 } + ahead_v;
    if integral_on {
        let more = gains.ki * e * sample_s;
        let would_be = base + memory.integral_v + more;
        let further = (would_be > limit && more > 0.0) || (would_be < -limit && more < 0.0);
        memory.integral_v += if further { 0.0 } else { more };
    } else {
        memory.integral_v = 0.0;
    }
    (base + memory.integral_v).clamp(-limit, limit)
}

impl ServoController {
    #[must_use]
    pub const fn plain(mut self) -> Self {
        self.fuzzy = None;
        self
    }

    /// Gains at an error and its change, never below 0.
    pub fn gains_at(&self, e_mm: f64, ec_mm_per_s: f64) -> Gains {
        let Some(fuzzy) = &self.fuzzy else { return self.gains };
        let (e, ec) = (3.0 * e_mm / fuzzy.e_max_mm, 3.0 * ec_mm_per_s / fuzzy.ec_max_mm_per_s);
        let tables = &fuzzy.rules;
        let moved = |base: f64, span: f64, table| (base + span * infer(table, e, ec) / 3.0).max(0.0);
        Gains {
            kp: moved(self.gains.kp, fuzzy.span.kp, &tables.kp),
            ki: moved(self.gains.ki, fuzzy.span.ki, &tables.ki),
            kd: moved(self.gains.kd, fuzzy.span.kd, &tables.kd),
        }
    }

    /// Whether the integral and the derivative are active. An error of exactly e0 counts as large.
    fn terms(&self, stage: CycleStage, e_mm: f64) -> (bool, bool) {
        match (&self.fuzzy, stage) {
            (None, _) | (Some(_), CycleStage::Cut) => (true, true),
            (Some(_), CycleStage::Approach) => (false, false),
            (Some(fuzzy), CycleStage::Travel | CycleStage::Return) => (e_mm.abs() < fuzzy.e0_mm, false),
        }
    }

    pub fn check(&self) -> Result<(), Diagnostic> {
        within("kp", self.gains.kp, 0.0, 1e6)?;
        within("ki", self.gains.ki, 0.0, 1e9)?;
        within("kd", self.gains.kd, 0.0, 1e6)?;
        within("u-max", self.u_max_v, 1e-6, 1e6)?;
        within("sample", self.sample_s, 1e-6, 1.0)?;
        let Some(fuzzy) = &self.fuzzy else { return Ok(()) };
        within("span-kp", fuzzy.span.kp, 0.0, 1e6)?;
        within("span-ki", fuzzy.span.ki, 0.0, 1e9)?;
        within("span-kd", fuzzy.span.kd, 0.0, 1e6)?;
        within("e-max", fuzzy.e_max_mm, 1e-6, 1e6)?;
        within("ec-max", fuzzy.ec_max_mm_per_s, 1e-6, 1e9)?;
        within("e0", fuzzy.e0_mm, 0.0, 1e6)?;
        let rules = [fuzzy.rules.kp, fuzzy.rules.ki, fuzzy.rules.kd];
        let worst = rules.as_flattened().as_flattened().iter().max_by_key(|rule| rule.unsigned_abs());
        within("rules", worst.copied().map_or(0.0, f64::from), -3.0, 3.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_switch_the_controller_terms() {
        let fuzzy = staged_fuzzy();
        let rows = [
            (CycleStage::Travel, 0.05, (true, false)),
            (CycleStage::Travel, -0.1, (false, false)),
            (CycleStage::Return, 0.0999, (true, false)),
            (CycleStage::Return, 3.0, (false, false)),
            (CycleStage::Approach, 0.0, (false, false)),
            (CycleStage::Cut, 3.0, (true, true)),
        ];
        for (stage, e, terms) in rows {
            assert_eq!(fuzzy.terms(stage, e), terms, "{stage:?} {e}");
            assert_eq!(fuzzy.plain().terms(stage, e), (true, true));
        }
    }

    #[test]
    fn integral_does_not_wind_up_and_output_is_limited() {
        let plain = staged_fuzzy().plain();
        let mut memory = Memory::default();
        for _ in 0..10_000 {
            assert_eq!(control(&plain, &mut memory, CycleStage::Travel, 100.0, 0.0, 0.0), 10.0);
        }
        assert_eq!(memory.integral_v, 0.0, "nothing was taken in while the control was at its limit");
        // Away from the limit the integral grows, and shrinks at once when the error changes sign.
        for _ in 0..100 {
            control(&plain, &mut memory, CycleStage::Travel, 1.0, 0.0, 0.0);
        }
        let wound = memory.integral_v;
        assert!((wound - 1.0).abs() < 1e-12, "{wound}");
        control(&plain, &mut memory, CycleStage::Travel, -100.0, 0.0, 0.0);
        assert!(memory.integral_v <= wound);
        memory.change_stage();
        assert_eq!((memory.integral_v, memory.last_error_mm), (0.0, Some(-100.0)));
    }

    #[test]
    fn bad_parameters_are_refused_by_name() {
        let fuzzy = || staged_fuzzy().fuzzy.unwrap();
        let wild = || {
            let mut rules = *FuzzyRules::Even.tables();
            rules.ki[6][2] = -4;
            rules
        };
        let good = staged_fuzzy();
        let gains = good.gains;
        let rows = [
            ("kp", ServoController { gains: Gains { kp: -1.0, ..gains }, ..good }),
            ("ki", ServoController { gains: Gains { ki: f64::NAN, ..gains }, ..good }),
            ("kd", ServoController { gains: Gains { kd: f64::INFINITY, ..gains }, ..good }),
            ("u-max", ServoController { u_max_v: 0.0, ..good }),
            ("sample", ServoController { sample_s: -0.0005, ..good }),
            (
                "span-kp",
                ServoController {
                    fuzzy: Some(Fuzzy { span: Gains { kp: -2.0, ..gains }, ..fuzzy() }),
                    ..good
                },
            ),
            ("e-max", ServoController { fuzzy: Some(Fuzzy { e_max_mm: 0.0, ..fuzzy() }), ..good }),
            (
                "ec-max",
                ServoController { fuzzy: Some(Fuzzy { ec_max_mm_per_s: f64::NAN, ..fuzzy() }), ..good },
            ),
            ("rules", ServoController { fuzzy: Some(Fuzzy { rules: wild(), ..fuzzy() }), ..good }),
            ("e0", ServoController { fuzzy: Some(Fuzzy { e0_mm: -0.1, ..fuzzy() }), ..good }),
        ];
        for (field, controller) in rows {
            let why = controller.check().unwrap_err();
            assert_eq!(why.args[0].1, field);
            assert!(why.message("en").contains(field), "{}", why.message("en"));
        }
        assert_eq!(good.check().and(retuned_pid().check()), Ok(()));
    }
}
