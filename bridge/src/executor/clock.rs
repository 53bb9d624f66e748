//! Clocks: one that lets the virtual drill run faster than real time, and one that waits for every step.
//!
//! ```text
//! StepClock   ──── sleep ────▶|~ spin ~|step      late = time from the requested tick to the wake-up
//!                             due − 100 µs  due
//! ```

use annulus_core::control::Lateness;
use annulus_core::pins::Clock;
use annulus_core::steps::TICK_HZ;
use std::sync::LazyLock;
use std::thread;
use std::time::{Duration, Instant};

/// How far the lump clock may run ahead of real time, in ms, so that it sleeps rarely.
const LUMP_MS: f64 = 2.0;

/// The last part before a step is spent spinning, not sleeping.
const WATCHED: Duration = Duration::from_micros(100);

pub(crate) const MEASURED: Duration = Duration::from_secs(2);

/// Time between two measured wake-ups, in ticks: 0.5 ms.
const BEAT: u64 = TICK_HZ / 2_000;

/// Real time at a time scale, up to 2 ms ahead of itself so that it sleeps rarely. The clock only paces:
/// the virtual drill itself counts stream ticks.
pub(super) struct LumpClock {
    start: Instant,
    ticks_per_s: f64,
    granted: u64,
}

impl LumpClock {
    pub(super) fn new(speed: f64) -> Self {
        Self { start: Instant::now(), ticks_per_s: speed * TICK_HZ as f64, granted: 0 }
    }
}

impl Clock for LumpClock {
    fn now(&mut self) -> u64 {
        (self.start.elapsed().as_secs_f64() * self.ticks_per_s) as u64
    }

    fn wait_until(&mut self, tick: u64) -> u64 {
        if tick <= self.granted {
            return tick;
        }
        let now = self.now();
        if tick > now {
            thread::sleep(Duration::from_secs_f64((tick - now) as f64 / self.ticks_per_s));
        }
        let now = self.now().max(tick);
        self.granted = now + (LUMP_MS * 1e-3 * self.ticks_per_s) as u64;
        now
    }
}

/// A clock that is late by a constant, as an injected fault.
pub(super) struct LateClock {
    pub(super) clock: LumpClock,
    pub(super) ticks: u64,
}

impl Clock for LateClock {
    fn now(&mut self) -> u64 {
        self.clock.now()
    }

    fn wait_until(&mut self, tick: u64) -> u64 {
        self.clock.wait_until(tick) + self.ticks
    }
}

/// Real time: waits for every single tick, never ahead.
pub(crate) struct StepClock {
    start: Instant,
}

impl StepClock {
    pub(crate) fn new() -> Self {
        Self { start: Instant::now() }
    }
}

impl Clock for StepClock {
    fn now(&mut self) -> u64 {
        (self.start.elapsed().as_nanos() / u128::from(1_000_000_000 / TICK_HZ)) as u64
    }

    fn wait_until(&mut self, tick: u64) -> u64 {
        let due = Duration::from_nanos(tick.saturating_mul(1_000_000_000 / TICK_HZ));
        loop {
            let left = due.saturating_sub(self.start.elapsed());
            if left > WATCHED {
                thread::sleep(left - WATCHED);
            } else if left.is_zero() {
                return self.now().max(tick);
            } else {
                std::hint::spin_loop();
            }
        }
    }
}

pub(crate) fn time() -> Duration {
    static BEGAN: LazyLock<Instant> = LazyLock::new(Instant::now);
    BEGAN.elapsed()
}

pub(crate) fn measure(clock: &mut dyn Clock, how_long: Duration) -> Lateness {
    let begun = clock.now();
    let end = begun + (how_long.as_secs_f64() * TICK_HZ as f64) as u64;
    let mut late_us = Vec::new();
    let mut due = begun + BEAT;
    while due < end {
        let was = clock.wait_until(due);
        late_us.push((was - due) as f64 * 1e6 / TICK_HZ as f64);
        // Lateness is never made up, so count on from the wake-up.
        due = was + BEAT;
    }
    Lateness::of(&mut late_us)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn virtual_clock_is_never_early_at_any_time_scale() {
        for speed in [1.0, 30.0, 1e6] {
            let mut clock = LumpClock::new(speed);
            let mut tick = 0;
            for _ in 0..200 {
                tick += 1 + (speed * 300.0) as u64;
                let was = clock.wait_until(tick);
                assert!(was >= tick, "no earlier than asked");
                tick = was;
            }
        }
    }

    #[test]
    fn step_clock_is_never_early() {
        let mut clock = StepClock::new();
        for step in 1..200 {
            let tick = step * 1_500;
            assert!(clock.wait_until(tick) >= tick);
        }
    }

    /// A simulated clock: late by the next number of a list at every request.
    struct Late(u64, Vec<u64>);

    impl Clock for Late {
        fn now(&mut self) -> u64 {
            self.0
        }
        fn wait_until(&mut self, tick: u64) -> u64 {
            let late = self.1.pop().unwrap_or(10);
            self.0 = self.0.max(tick) + late;
            self.0
        }
    }

    #[test]
    fn lateness_is_measured_per_beat_and_not_caught_up() {
        let found = measure(&mut Late(77, vec![20_000, 40, 30]), Duration::from_secs(2));
        assert_eq!(found.worst_us, 2_000.0);
        assert_eq!(found.p50_us, 1.0);
        // Every beat takes 0.5 ms plus its lateness: the worst ones cost the time of four beats.
        assert_eq!(found.beats, 3_988);
    }
}
