//! Decides the next request to a converter, and interprets answers and silence. Has no port and no clock.
//!
//! ```text
//! switched on    speed, run … ─▶ speed? speed? trip? speed? …      every 50 ms
//! no answer      repeated at once, three times in all: lost        at most 240 ms after the last answer, up to
//!                                                                  300 ms more after a late answer (`late`)
//! too slow       asked for a trip, read again: lost                200 ms
//! switched off   stop, repeated until it is answered
//! ```
//!
//! A lost spindle stays lost until it is switched off: nothing restarts automatically.

use super::frames::{Answer, Ask};
use annulus_core::pins::{SpindleState, SpindleTrouble};
use std::collections::VecDeque;
use std::time::Duration;

const POLL: Duration = Duration::from_millis(50);

pub(super) const TRIES: u32 = 3;

/// Longest silence about a spindle that should turn. Longer than the detection of missing answers, so it
/// reveals a hanging thread.
const SILENCE: Duration = Duration::from_millis(500);

/// Time between two requests to a silent converter whose spindle need not turn.
const PATIENT: Duration = Duration::from_millis(250);

/// One in this many readings asks for a trip.
const FAULT_EVERY: u32 = 4;

/// Readings in a row out of tolerance that are no coincidence.
const OFF_READINGS: u32 = 2;

#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) tolerance_share: f64,
    pub(super) spin_up: Duration,
    /// Registers to write for run, and for stop.
    pub(super) run_writes: usize,
    pub(super) stop_writes: usize,
    pub(super) tells_faults: bool,
}

#[derive(Debug)]
pub(super) struct Watch {
    limits: Limits,
    wanted_rpm: u32,
    state: SpindleState,
    todo: VecDeque<Ask>,
    /// How often the current request was not answered.
    failures: u32,
    /// Readings in a row out of tolerance, after it was at speed.
    off: u32,
    /// After the first of them: it may have tripped.
    doubts: bool,
    readings: u32,
    rpm: u32,
    /// Since when it should reach its speed, and time of the last request.
    since: Duration,
    asked: Option<Duration>,
    heard: Duration,
}

impl Watch {
    /// Starts with a stop.
    pub(super) fn new(limits: Limits) -> Self {
        let todo = (0..limits.stop_writes).map(|place| Ask::Stop { place }).collect();
        Self {
            limits,
            wanted_rpm: 0,
            state: SpindleState::Unreachable,
            todo,
            failures: 0,
            off: 0,
            doubts: false,
            readings: 0,
            rpm: 0,
            since: Duration::ZERO,
            asked: None,
            heard: Duration::ZERO,
        }
    }

    pub(super) fn state(&self) -> SpindleState {
        self.state
    }

    /// Returns `true` if the spindle should be off and nothing is left to write, or the converter does not
    /// answer.
    pub(super) fn is_over(&self) -> bool {
        self.wanted_rpm == 0 && (self.todo.is_empty() || self.failures >= TRIES)
    }

    pub(super) fn has_writes(&self) -> bool {
        !self.todo.is_empty()
    }

    /// Requests a speed; 0 is off.
    pub(super) fn want(&mut self, rpm: u32, now: Duration) {
        let is_lost = matches!(self.state, SpindleState::Lost { .. });
        if rpm == self.wanted_rpm || (is_lost && rpm > 0) {
            return;
        }
        let stood = self.wanted_rpm == 0;
        if stood {
            self.heard = now;
        }
        (self.wanted_rpm, self.since, self.failures, self.off) = (rpm, now, 0, 0);
        if rpm == 0 {
            self.state = SpindleState::Off { rpm: self.rpm };
            self.todo = (0..self.limits.stop_writes).map(|place| Ask::Stop { place }).collect();
            return;
        }
        self.state = SpindleState::Reaching { rpm: self.rpm };
        let unfinished = self.todo.iter().any(|ask| matches!(ask, Ask::Run { .. }));
        let runs = if stood || unfinished { self.limits.run_writes } else { 0 };
        self.todo =
            [Ask::Speed { rpm }].into_iter().chain((0..runs).map(|place| Ask::Run { place })).collect();
    }

    pub(super) fn next(&mut self, now: Duration) -> Option<Ask> {
        let since = self.asked.map(|asked| now.saturating_sub(asked));
        let again = (1..TRIES).contains(&self.failures);
        let pause = match self.todo.front() {
            _ if self.failures >= TRIES => PATIENT,
            Some(_) => Duration::ZERO,
            None if again || self.doubts => Duration::ZERO,
            None => POLL,
        };
        if since.is_some_and(|since| since < pause) {
            return None;
        }
        self.asked = Some(now);
        if let Some(ask) = self.todo.front() {
            return Some(*ask);
        }
        if !again {
            self.readings = self.readings.wrapping_add(1);
        }
        let due = std::mem::take(&mut self.doubts) || self.readings.is_multiple_of(FAULT_EVERY);
        let fault = self.limits.tells_faults && due;
        Some(if fault { Ask::Fault } else { Ask::Actual })
    }

    pub(super) fn heard(&mut self, ask: Ask, answer: Result<Answer, SpindleTrouble>, now: Duration) {
        let answer = match answer {
            Ok(answer) => answer,
            Err(trouble) => return self.failed(trouble),
        };
        (self.failures, self.heard) = (0, now);
        if self.todo.front() == Some(&ask) {
            self.todo.pop_front();
        }
        match answer {
            Answer::Done => {
                if self.state == SpindleState::Unreachable {
                    self.state = SpindleState::Off { rpm: self.rpm };
                }
            }
            Answer::Turns { rpm } => self.turns(rpm, now),
            Answer::Tripped { code: Some(code) } if self.wanted_rpm > 0 => {
                self.lose(SpindleTrouble::Tripped { code });
            }
            Answer::Tripped { .. } => {}
        }
    }

    /// Time passes, even if nothing is asked.
    pub(super) fn passed(&mut self, now: Duration) {
        if self.wanted_rpm > 0 && now.saturating_sub(self.heard) > SILENCE {
            self.lose(SpindleTrouble::Silent);
        }
    }

    fn failed(&mut self, trouble: SpindleTrouble) {
        self.failures = self.failures.saturating_add(1);
        if self.failures < TRIES {
            return;
        }
        if self.wanted_rpm > 0 {
            self.lose(trouble);
        } else {
            self.state = SpindleState::Unreachable;
        }
    }

    fn turns(&mut self, rpm: u32, now: Duration) {
        self.rpm = rpm;
        if self.wanted_rpm == 0 {
            self.state = SpindleState::Off { rpm };
            return;
        }
        if matches!(self.state, SpindleState::Lost { .. }) || !self.todo.is_empty() {
            return;
        }
        let slow = SpindleTrouble::Slow { rpm, wanted_rpm: self.wanted_rpm };
        let tolerated = f64::from(self.wanted_rpm) * self.limits.tolerance_share;
        if f64::from(rpm.abs_diff(self.wanted_rpm)) <= tolerated {
            (self.state, self.off) = (SpindleState::AtSpeed { rpm }, 0);
        } else if matches!(self.state, SpindleState::AtSpeed { .. }) {
            self.off += 1;
            self.doubts = self.off == 1;
            if self.off >= OFF_READINGS {
                self.lose(slow);
            }
        } else if now.saturating_sub(self.since) > self.limits.spin_up {
            self.lose(slow);
        } else {
            self.state = SpindleState::Reaching { rpm };
        }
    }

    /// The spindle is lost: drops pending writes that would make it turn.
    fn lose(&mut self, trouble: SpindleTrouble) {
        if !matches!(self.state, SpindleState::Lost { .. }) {
            self.state = SpindleState::Lost { trouble };
        }
        self.todo.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        tolerance_share: 0.05,
        spin_up: Duration::from_secs(5),
        run_writes: 2,
        stop_writes: 1,
        tells_faults: true,
    };

    const ANSWER: Duration = Duration::from_millis(30);
    const SILENCE: Duration = Duration::from_millis(60);

    /// A simulated converter, with its own time.
    struct Scene {
        watch: Watch,
        now: Duration,
        asked: Vec<Ask>,
    }

    impl Scene {
        fn new() -> Self {
            Self { watch: Watch::new(LIMITS), now: Duration::ZERO, asked: Vec::new() }
        }

        fn run(&mut self, how_long_ms: u64, mut answer: impl FnMut(Ask) -> Result<Answer, SpindleTrouble>) {
            let until = self.now + Duration::from_millis(how_long_ms);
            while self.now < until && !matches!(self.watch.state(), SpindleState::Lost { .. }) {
                match self.watch.next(self.now) {
                    None => self.now += Duration::from_millis(1),
                    Some(ask) => {
                        let said = answer(ask);
                        self.now += if said.is_ok() { ANSWER } else { SILENCE };
                        self.asked.push(ask);
                        self.watch.heard(ask, said, self.now);
                    }
                }
            }
        }

        fn at_speed() -> Self {
            let mut scene = Self::new();
            scene.run(200, turning(0));
            scene.watch.want(20_000, scene.now);
            scene.run(1_000, turning(20_000));
            assert_eq!(scene.watch.state(), SpindleState::AtSpeed { rpm: 20_000 });
            scene.asked.clear();
            scene
        }
    }

    fn turning(rpm: u32) -> impl FnMut(Ask) -> Result<Answer, SpindleTrouble> {
        move |ask| {
            Ok(match ask {
                Ask::Actual => Answer::Turns { rpm },
                Ask::Fault => Answer::Tripped { code: None },
                _ => Answer::Done,
            })
        }
    }

    #[test]
    fn speed_is_set_before_run_and_monitored_afterwards() {
        let mut scene = Scene::new();
        scene.run(100, turning(0));
        assert_eq!(scene.asked[0], Ask::Stop { place: 0 }, "first of all it stands");
        assert_eq!(scene.watch.state(), SpindleState::Off { rpm: 0 });
        scene.asked.clear();
        scene.watch.want(20_000, scene.now);
        assert_eq!(scene.watch.state(), SpindleState::Reaching { rpm: 0 });
        scene.run(400, turning(9_000));
        let first = [Ask::Speed { rpm: 20_000 }, Ask::Run { place: 0 }, Ask::Run { place: 1 }];
        assert_eq!(scene.asked[..3], first);
        assert!(scene.asked[3..].contains(&Ask::Actual) && scene.asked.contains(&Ask::Fault));
        assert_eq!(scene.watch.state(), SpindleState::Reaching { rpm: 9_000 });
        scene.run(200, turning(19_001));
        assert_eq!(scene.watch.state(), SpindleState::AtSpeed { rpm: 19_001 }, "within 5 %");
        scene.asked.clear();
        scene.watch.want(12_000, scene.now);
        scene.run(200, turning(12_000));
        assert_eq!(scene.asked[0], Ask::Speed { rpm: 12_000 });
        assert!(!scene.asked.iter().any(|ask| matches!(ask, Ask::Run { .. })), "it runs already");
        assert_eq!(scene.watch.state(), SpindleState::AtSpeed { rpm: 12_000 });
        scene.watch.want(0, scene.now);
        assert!(!scene.watch.is_over());
        scene.run(100, turning(0));
        assert!(scene.watch.is_over() && scene.watch.state() == SpindleState::Off { rpm: 0 });
    }

    #[test]
    fn lost_spindle_is_detected_within_350_ms() {
        let slow = SpindleTrouble::Slow { rpm: 15_000, wanted_rpm: 20_000 };
        let tripped = |ask| match ask {
            Ask::Fault => Ok(Answer::Tripped { code: Some(7) }),
            ask => turning(20_000)(ask),
        };
        let quiet = |_| Err(SpindleTrouble::Silent);
        let garbled = |_| Err(SpindleTrouble::Garbled);
        let slower = turning(15_000);
        type Says = Box<dyn FnMut(Ask) -> Result<Answer, SpindleTrouble>>;
        let rows: [(Says, SpindleTrouble, u64); 4] = [
            (Box::new(quiet), SpindleTrouble::Silent, 240),
            (Box::new(garbled), SpindleTrouble::Garbled, 240),
            (Box::new(slower), slow, 240),
            (Box::new(tripped), SpindleTrouble::Tripped { code: 7 }, 350),
        ];
        for (says, trouble, within_ms) in rows {
            let mut scene = Scene::at_speed();
            let begun = scene.now;
            scene.run(2_000, says);
            assert_eq!(scene.watch.state(), SpindleState::Lost { trouble });
            let took = scene.now - begun;
            assert!(took <= Duration::from_millis(within_ms), "{trouble:?}: {took:?}");
            // The converter responds again; nothing may turn before the user has switched it off and on.
            for _ in 0..50 {
                scene.now += POLL;
                if let Some(ask) = scene.watch.next(scene.now) {
                    assert!(matches!(ask, Ask::Actual | Ask::Fault), "{ask:?}");
                    scene.watch.heard(ask, turning(20_000)(ask), scene.now);
                }
            }
            scene.watch.want(18_000, scene.now);
            assert_eq!(scene.watch.state(), SpindleState::Lost { trouble });
            scene.watch.want(0, scene.now);
            assert!(matches!(scene.watch.state(), SpindleState::Off { .. }));
            scene.watch.want(18_000, scene.now);
            assert!(matches!(scene.watch.state(), SpindleState::Reaching { .. }));
        }
    }

    #[test]
    fn silence_is_detected_by_time_without_polling() {
        let mut scene = Scene::at_speed();
        scene.watch.passed(scene.now + super::SILENCE - POLL);
        assert_eq!(scene.watch.state(), SpindleState::AtSpeed { rpm: 20_000 });
        scene.watch.passed(scene.now + super::SILENCE + POLL);
        assert_eq!(scene.watch.state(), SpindleState::Lost { trouble: SpindleTrouble::Silent });
        // A spindle that is off may be silent, and one that has just been switched on gets its time.
        scene.watch.want(0, scene.now);
        scene.now += super::SILENCE * 20;
        scene.watch.passed(scene.now);
        assert!(matches!(scene.watch.state(), SpindleState::Off { .. }));
        scene.watch.want(20_000, scene.now);
        scene.watch.passed(scene.now + POLL);
        assert!(matches!(scene.watch.state(), SpindleState::Reaching { .. }));
    }

    #[test]
    fn two_garbled_answers_or_one_odd_reading_raise_no_alarm() {
        let mut scene = Scene::at_speed();
        for _ in 0..20 {
            let mut left = 2;
            scene.run(400, |ask| {
                if left > 0 {
                    left -= 1;
                    return Err(SpindleTrouble::Garbled);
                }
                turning(20_000)(ask)
            });
            let mut odd = true;
            scene.run(400, |ask| {
                turning(if ask == Ask::Actual && std::mem::take(&mut odd) { 90 } else { 20_000 })(ask)
            });
        }
        assert_eq!(scene.watch.state(), SpindleState::AtSpeed { rpm: 20_000 });
    }

    #[test]
    fn spindle_below_speed_is_lost_and_a_stopped_one_may_be_silent() {
        let mut scene = Scene::new();
        scene.watch.want(20_000, scene.now);
        scene.run(10_000, turning(3_000));
        let slow = SpindleTrouble::Slow { rpm: 3_000, wanted_rpm: 20_000 };
        assert_eq!(scene.watch.state(), SpindleState::Lost { trouble: slow });
        assert!(scene.now > LIMITS.spin_up && scene.now < LIMITS.spin_up * 2);
        let mut scene = Scene::new();
        scene.run(3_000, |_| Err(SpindleTrouble::Silent));
        assert_eq!(scene.watch.state(), SpindleState::Unreachable);
        assert!(scene.asked.len() < 20, "patiently: {}", scene.asked.len());
        assert!(scene.watch.is_over(), "whoever ends does not wait for it");
        scene.run(1_000, turning(0));
        assert_eq!(scene.watch.state(), SpindleState::Off { rpm: 0 });
    }
}
