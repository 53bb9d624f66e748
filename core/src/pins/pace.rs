//! Pace: how fast stream time passes. The path stays as planned, only its timing is stretched.
//!
//! ```text
//! speed of the lead axis        planned ________________
//!                                      /   |\           \          w² falls by 2A a step from where the order came,
//!                              _______/    | \___________\___      and rises by 2A a step when it goes on;
//!                                        Stop  rest               never above the planned speed
//! ```
//!
//! On a straight line all axes move in proportion, so braking the lead axis (the one with most steps) at `A` brakes every
//! axis evenly; `A` is chosen so that none exceeds its own limit. Between two steps of the lead axis the stretch is even.
//!
//! Comes in: stream ticks and the wish to stop or go. Goes out: stretched ticks. Does not know pins.

/// What the pace is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mode {
    /// As planned.
    Full,
    /// Braking; the square of the speed in steps² per tick².
    Down(f64),
    /// At rest in the middle of the segment.
    Rest,
    /// Gathering speed again.
    Up(f64),
}

/// The clock of one segment: stream ticks in, stretched ticks out.
#[derive(Clone, Debug)]
pub(super) struct Pace {
    mode: Mode,
    /// Braking of the lead axis, steps per tick².
    braking: f64,
    /// Stream tick and stretched tick from which the stretch holds.
    base: (u64, f64),
    stretch: f64,
}

impl Pace {
    /// At full pace from `start` on, which is stream tick 0.
    pub(super) fn new(start: u64, braking: f64) -> Self {
        Self { mode: Mode::Full, braking, base: (0, start as f64), stretch: 1.0 }
    }

    /// The stretched tick of `stream_tick`.
    pub(super) fn at(&self, stream_tick: u64) -> u64 {
        if self.stretch == 1.0 {
            return self.base.1 as u64 + (stream_tick - self.base.0.min(stream_tick));
        }
        (self.base.1 + (stream_tick - self.base.0.min(stream_tick)) as f64 * self.stretch) as u64
    }

    pub(super) fn is_full(&self) -> bool {
        self.mode == Mode::Full
    }

    pub(super) fn at_rest(&self) -> bool {
        self.mode == Mode::Rest
    }

    /// Begins to brake at a step of the lead axis. `last` and `next` are the planned intervals before and after it.
    pub(super) fn brake(&mut self, last: Option<u64>, next: Option<u64>) {
        let planned = match (last, next) {
            (Some(last), Some(next)) => 2.0 / (last + next).max(1) as f64,
            _ => 0.0,
        };
        self.mode = match self.mode {
            Mode::Full => Mode::Down(planned * planned),
            Mode::Up(square) => Mode::Down(square),
            other => other,
        };
    }

    /// Goes on again.
    pub(super) fn go_on(&mut self) {
        self.mode = match self.mode {
            Mode::Rest => Mode::Up(0.0),
            Mode::Down(square) => Mode::Up(square),
            other => other,
        };
    }

    /// Sets the stretch from the lead axis' step at `stream_tick` to its next one, `interval` ticks later as planned.
    pub(super) fn next_step(&mut self, stream_tick: u64, interval: Option<u64>) {
        self.base = (stream_tick, self.at(stream_tick) as f64);
        self.stretch = 1.0;
        // After the last step the segment only rests.
        let Some(interval) = interval else { return };
        let planned = interval.max(1) as f64;
        let (before, after) = match self.mode {
            Mode::Full | Mode::Rest => return,
            Mode::Down(square) => (square, square - 2.0 * self.braking),
            Mode::Up(square) => (square, square + 2.0 * self.braking),
        };
        if after <= 0.0 {
            // Comes to rest before the next step: the time that takes is spent here.
            self.base.1 += libm::ceil(libm::sqrt(before.max(0.0)) / self.braking);
            self.mode = Mode::Rest;
            return;
        }
        let braked = 2.0 / (libm::sqrt(before) + libm::sqrt(after));
        let slower = braked.max(planned);
        self.stretch = slower / planned;
        self.mode = match self.mode {
            // Where the plan brakes harder than this, its own speed is where braking goes on from.
            Mode::Down(_) if braked < planned => Mode::Down(after.min(1.0 / (planned * planned))),
            Mode::Down(_) => Mode::Down(after),
            Mode::Up(_) if braked <= planned => Mode::Full,
            _ => Mode::Up(after),
        };
    }

    /// Time stands still: what follows comes `ticks` later.
    pub(super) fn wait(&mut self, ticks: u64) {
        self.base.1 += ticks as f64;
    }
}
