//! Plays segments on an adapter: feeds path as there is room, and holds, slows or stops on order or at a
//! sensor.
//!
//! ```text
//! Ready ─ chunks of 250 ms, Begin ─▶ Running ─ path ends ─▶ Ready          as planned
//!                                      │ Stopped: as ordered   Limit: a sensor, at its step   RanDry: line cut
//!                                      └─ Clear ─▶ Ready, the index exact
//! ```
//!
//! An error means that the machine's position is unknown.

use super::feed::{Feed, Path};
use super::greet::{self, lost, refused, trouble};
use super::line::{AdapterLine, Lost};
use super::path::{guard, last_steps};
use crate::executor::{Ended, Glimpse, Shared};
use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Gate, Input, Mark, Otherwise};
use annulus_core::machine::{Machine, Steps};
use annulus_core::pins::{AxisSet, Motors, Order, ShortTouches, give_way};
use annulus_core::steps::{Segment, Stage};
use annulus_core::wire::OtherFirmware;
use annulus_link::chunk::LONGEST;
use annulus_link::message::{
    Ask, Begin, Clear, Guard, Outputs, Place, Rate, Refusal, State, Status, Stop, Trust,
};
use annulus_link::{AXES, FULL_RATE};
use std::sync::Arc;
use std::time::Duration;

/// Path in the adapter beyond its stopping distance, in ticks. One chunk before the start; one chunk and
/// 350 ms during the run, to bridge a silence of the host.
const FIRST: u32 = LONGEST;
const AHEAD: u32 = LONGEST + 3_500_000;

/// Most unconfirmed path frames: a stop queues after them, so few keep it prompt.
const ON_THE_WAY: u32 = 4;

/// How long to wait for an unplugged adapter.
const ABSENT: Duration = Duration::from_secs(20);

const SPINDLE: u8 = 1;

/// Task number outside any task: no stop order reaches it, only the end of the session.
pub(super) const NO_TASK: u64 = u64::MAX;

/// A ready adapter, and the position of its machine.
pub(super) struct Adapter {
    pub(super) machine: Machine,
    pub(super) line: AdapterLine,
    pub(super) shared: Arc<Shared>,
    motors: Motors,
    settings_crc: u32,
    other_firmware: Option<OtherFirmware>,
    /// Steps counted in machine coordinates.
    pub(super) position: Steps,
    /// Axes whose latest step counted down.
    pub(super) down: AxisSet,
    pub(super) task: u64,
    pub(super) ticks: u64,
    rpm: u32,
    outputs: u8,
    limits: u8,
    rate: u32,
    /// Number of the hold that stopped it on its path; 0 if none.
    held: u64,
}

impl Adapter {
    /// An adapter on `line`, already identified and configured. Its position is unknown, so it counts from
    /// 0.
    pub(super) fn new(machine: &Machine, line: AdapterLine, shared: Arc<Shared>) -> Self {
        Self {
            other_firmware: line.welcome.and_then(greet::other_firmware),
            machine: machine.clone(),
            line,
            shared,
            motors: Motors::of(machine),
            settings_crc: greet::settings_crc(&greet::settings(machine)),
            position: Steps::default(),
            down: 0,
            task: NO_TASK,
            ticks: 0,
            rpm: 0,
            outputs: 0,
            limits: 0,
            rate: FULL_RATE,
            held: 0,
        }
    }

    fn status(&self) -> Status {
        self.line.status.unwrap_or_default()
    }

    pub(super) fn inputs(&self) -> u32 {
        self.machine.adapter.inputs(self.status().inputs)
    }

    /// Touches shorter than the sensor's filter. `None` before the first report, or if no sensor has a
    /// filter.
    fn touches(&self) -> Option<[ShortTouches; Input::OF_AXES.len()]> {
        let told = self.line.touches?;
        let of = |input: Input| {
            let number = self.machine.adapter.sensor(input).map(usize::from);
            let own =
                number.and_then(|number| Some((*told.short.get(number)?, *told.longest_us.get(number)?)));
            own.map_or(ShortTouches::default(), |(count, longest_us)| ShortTouches { count, longest_us })
        };
        Some(Input::OF_AXES.map(of))
    }

    /// Receives, sends and yields once. Waits for an adapter that was unplugged.
    pub(super) async fn turn(&mut self) -> Result<Status, Diagnostic> {
        if let Err(why) = self.line.turn() {
            self.wait_for_it(&why).await?;
        }
        give_way().await;
        let status = self.status();
        let port = self.line.port();
        match status.state {
            State::EmergencyStop => Err(trouble(code!("adapter.emergency_stop"), port)),
            State::Fault => Err(trouble(code!("adapter.fault"), port)),
            _ if status.settings != self.settings_crc => Err(trouble(code!("adapter.restarted"), port)),
            _ => Ok(status),
        }
    }

    /// Waits until the adapter is plugged in, then continues the same session: the adapter knows which
    /// frames it has.
    async fn wait_for_it(&mut self, why: &Lost) -> Result<(), Diagnostic> {
        let since = self.line.now();
        while self.line.now().saturating_sub(since) < ABSENT && self.shared.stopped() < self.task {
            if self.line.again() {
                while self.line.turn().is_ok() {
                    if self.line.status.is_some() {
                        return Ok(());
                    }
                    give_way().await;
                }
            }
            give_way().await;
        }
        Err(lost(&self.line, why))
    }

    async fn say(&mut self, ask: impl Into<Ask>) -> Result<Status, Diagnostic> {
        let ask = ask.into();
        let number = loop {
            match self.line.offer(ask) {
                Some(number) => break number,
                None => self.turn().await?,
            };
        };
        let mut status = self.turn().await?;
        while self.line.pending() > 0 {
            status = self.turn().await?;
        }
        if status.refusal != Refusal::None && status.refused == number {
            return Err(refused(&self.line, &status, ask.name()));
        }
        Ok(status)
    }

    /// Sets the spindle speed. Without speed control, any `rpm` above 0 switches it on.
    pub(super) async fn spindle(&mut self, rpm: u32) -> Result<(), Diagnostic> {
        self.rpm = rpm;
        let others = self.outputs & !SPINDLE;
        self.switch(others | if rpm > 0 { SPINDLE } else { 0 }).await
    }

    pub(super) async fn output(&mut self, on: bool) -> Result<(), Diagnostic> {
        const NAMED: u8 = 2;
        self.switch(self.outputs & !NAMED | if on { NAMED } else { 0 }).await
    }

    async fn switch(&mut self, on: u8) -> Result<(), Diagnostic> {
        self.outputs = on;
        self.say(Outputs { on }).await.map(drop)
    }

    pub(super) async fn safe(&mut self) -> Result<(), Diagnostic> {
        self.rpm = 0;
        self.switch(0).await
    }

    /// The index that the adapter should have: its index is the machine position.
    fn place(&self) -> Result<[i32; AXES], Diagnostic> {
        let mut index = self.status().index;
        for (own, place) in index.iter_mut().zip(self.position).take(self.axes()) {
            let beyond = || trouble(code!("adapter.refused"), self.line.port()).with("what", "Place");
            *own = i32::try_from(place).map_err(|error| beyond().with("reason", error))?;
        }
        Ok(index)
    }

    fn axes(&self) -> usize {
        (2 + self.machine.spindles as usize).min(AXES)
    }

    fn follow(&mut self, status: &Status) {
        for axis in 0..self.axes() {
            let now = i64::from(status.index[axis]);
            match now.cmp(&self.position[axis]) {
                std::cmp::Ordering::Less => self.down |= 1 << axis,
                std::cmp::Ordering::Greater => self.down &= !(1 << axis),
                std::cmp::Ordering::Equal => {}
            }
            self.position[axis] = now;
        }
    }

    pub(super) fn leave(&self, segment: Option<&Segment>) {
        let before = self.shared.glimpse();
        self.shared.change_glimpse(|glimpse| {
            *glimpse = Glimpse {
                position: self.position,
                inputs: self.inputs(),
                touches: self.touches(),
                other_firmware: self.other_firmware,
                rpm: self.rpm,
                spindle: before.spindle,
                held: self.held,
                lifted: false,
                stage: segment.map(|segment| segment.stage),
                end: segment.map_or(before.end, |segment| segment.end),
            }
        });
    }

    /// Publishes that nothing is being played.
    pub(super) fn rest(&mut self) {
        (self.rpm, self.held) = (0, 0);
        self.leave(None);
    }

    /// Plays segments without a break, from stop to stop. Only the last may have a gate.
    pub(super) async fn play(&mut self, segments: &[Segment], granted: bool) -> Result<Ended, Diagnostic> {
        let status = self.status();
        if status.state == State::Limit {
            return self.limited(None, &status).await;
        }
        if status.outputs != self.outputs {
            return self.ran_dry().await;
        }
        let gate = segments.last().and_then(|last| last.gate);
        let guarded = segments.iter().fold(0, |guarded, segment| guarded | guard(segment));
        let watched = guarded | gate.map_or(0, |gate| gate.input.bit());
        if let Some(hit) = first(watched & self.inputs()) {
            return Ok(self.hit(hit, gate));
        }
        let index = self.place()?;
        let mut status = self.status();
        if status.index != index || status.trust != Trust::Trusted {
            status = self.say(Place { index }).await?;
        }
        let limits = self.machine.adapter.wired(watched);
        if self.limits != limits {
            self.limits = limits;
            status = self.say(Guard { limits }).await?;
        }
        let paths: Vec<Path> = segments.iter().map(|segment| Path::of(segment, &self.motors)).collect();
        let (before, feed) = (self.ticks, Feed::new(&paths, &status));
        let (stopping, late, dry, path, begun) = (false, false, false, None, 0);
        let on_path = segments.iter().any(|segment| matches!(segment.mark, Mark::Toolpath(_)));
        let played = Play { gate, watched, granted, on_path, feed, stopping, late, dry, path, begun };
        let ended = self.run(played, segments).await?;
        if ended == Ended::Completed {
            let all = segments.iter().map(|segment| segment.duration_ticks);
            self.ticks = before.saturating_add(all.sum());
            for (moves, down) in segments.iter().map(last_steps) {
                self.down = self.down & !moves | down;
            }
        }
        match gate {
            Some(gate) if ended == Ended::Completed && gate.otherwise == Otherwise::Alarm => {
                Ok(Ended::Unmet(gate))
            }
            _ => Ok(ended),
        }
    }

    async fn run(&mut self, mut play: Play<'_>, segments: &[Segment]) -> Result<Ended, Diagnostic> {
        let before = self.ticks;
        let shown = segments.iter().find(|segment| segment.stage != Stage::Dwell).or(segments.first());
        loop {
            self.feed(&mut play)?;
            self.order(&mut play);
            let status = self.turn().await?;
            self.follow(&status);
            let rests = status.state == State::Running && status.rate == 0 && self.rate == 0;
            let is_held = rests && play.on_path && self.shared.is_held(self.task);
            self.held = if is_held { self.shared.holds() } else { 0 };
            self.leave(shown);
            // When stopped, nothing is resident because the adapter dropped the rest: count only while it
            // runs.
            if status.state == State::Running {
                let passed = play.feed.passed(&status);
                self.ticks = before.saturating_add(passed);
                let deadline = play.gate.map_or(u64::MAX, |gate| u64::from(gate.deadline_us) * 10);
                play.late |= passed > deadline;
            }
            // The outputs went off by themselves after a silence, so the spindle may have stopped: end
            // here.
            play.dry |= self.line.pending() == 0 && status.outputs != self.outputs;
            if let Some(ended) = self.ended(&play, &status).await? {
                return Ok(ended);
            }
        }
    }

    /// Offers path as there is room, and starts the adapter if it is stopped with enough path ahead.
    fn feed(&mut self, play: &mut Play<'_>) -> Result<(), Diagnostic> {
        let status = self.status();
        let ahead = play.feed.tail + if status.state == State::Running { AHEAD } else { FIRST };
        let mut is_full = false;
        // After a refused piece every later piece would be refused too.
        let goes_on = !play.stopping && !play.is_refused(&status);
        while goes_on && status.resident < ahead && self.line.pending() < ON_THE_WAY {
            if !play.feed.cut() {
                return Err(trouble(code!("adapter.too_dense"), self.line.port()));
            }
            let Some(piece) = &play.feed.piece else { break };
            let number = self.line.offer_piece(piece);
            is_full = number.is_none();
            if is_full {
                break;
            }
            play.path = play.path.or(number);
            play.feed.offered();
        }
        let is_enough = status.resident >= ahead || is_full || play.feed.is_over();
        let rests = status.state == State::Ready && self.line.pending() == 0;
        if rests && !play.stopping && status.resident > 0 && is_enough {
            play.begun = self.line.offer(Begin {}).unwrap_or(play.begun);
        }
        Ok(())
    }

    /// Passes on orders: a stop once, a rate when it changes.
    fn order(&mut self, play: &mut Play<'_>) {
        if play.stopping {
            return;
        }
        let granted = if play.granted { self.shared.granted() } else { Order::Go };
        let is_over = self.shared.stopped() >= self.task || granted == Order::Stop;
        let full = FULL_RATE * u32::from(self.shared.feed_override()) / 100;
        let holds = play.on_path && self.shared.is_held(self.task);
        let rate = if granted == Order::Hold || holds { 0 } else { full };
        if is_over || play.late || play.dry {
            play.stopping = self.line.offer(Stop {}).is_some();
        } else if rate != self.rate && self.line.offer(Rate { wanted: rate }).is_some() {
            self.rate = rate;
        }
    }

    /// Returns how the play ended, or `None` while it runs.
    async fn ended(&mut self, play: &Play<'_>, status: &Status) -> Result<Option<Ended>, Diagnostic> {
        let stopped = match (play.late, play.gate) {
            (true, Some(gate)) => Ended::Unmet(gate),
            _ => Ended::Stopped,
        };
        match status.state {
            State::Running => Ok(None),
            State::Ready => match self.rested(play, status, stopped).await? {
                Some(_) if play.dry => self.ran_dry().await.map(Some),
                ended => Ok(ended),
            },
            State::Stopped | State::Starved => {
                self.clear().await?;
                if play.is_refused(status) && !play.stopping {
                    return Err(refused(&self.line, status, "Chunk"));
                }
                let is_dry = play.dry || status.state == State::Starved && !play.stopping;
                if is_dry { self.ran_dry().await.map(Some) } else { Ok(Some(stopped)) }
            }
            State::Limit => self.limited(play.gate, status).await.map(Some),
            State::Unset | State::EmergencyStop | State::Fault => {
                Err(trouble(code!("adapter.restarted"), self.line.port()))
            }
        }
    }

    async fn rested(
        &mut self,
        play: &Play<'_>,
        status: &Status,
        stopped: Ended,
    ) -> Result<Option<Ended>, Diagnostic> {
        if self.line.pending() > 0 {
            return Ok(None);
        }
        if play.is_refused(status) {
            return Err(refused(&self.line, status, "Chunk"));
        }
        // A sensor turned on at the moment of the start.
        if status.refusal == Refusal::Input
            && status.refused == play.begun
            && let Some(hit) = first(play.watched & self.inputs())
        {
            self.say(Stop {}).await?;
            return Ok(Some(self.hit(hit, play.gate)));
        }
        let is_over = status.resident == 0 && play.feed.is_over();
        if is_over && status.index == play.feed.index {
            return Ok(Some(Ended::Completed));
        }
        Ok((play.stopping && status.resident == 0).then_some(stopped))
    }

    /// A sensor stopped the pulses, at this very step.
    async fn limited(&mut self, gate: Option<Gate>, status: &Status) -> Result<Ended, Diagnostic> {
        let is_it = |input: &Input| self.machine.adapter.sensor(*input) == Some(status.input);
        let Some(input) = Input::ALL.into_iter().find(is_it) else {
            return Err(trouble(code!("adapter.fault"), self.line.port()));
        };
        self.clear().await?;
        let ended = self.hit(input, gate);
        // The adapter turned everything off. If this sensor was the aim of the move, they are switched on
        // again.
        if matches!(ended, Ended::Gated(_)) {
            self.switch(self.outputs).await?;
        } else {
            (self.outputs, self.rpm) = (0, 0);
        }
        Ok(ended)
    }

    /// The adapter stopped because the line was silent: the outputs stay off.
    async fn ran_dry(&mut self) -> Result<Ended, Diagnostic> {
        self.safe().await?;
        Ok(Ended::RanDry)
    }

    fn hit(&self, input: Input, gate: Option<Gate>) -> Ended {
        if gate.is_some_and(|gate| gate.input == input) {
            Ended::Gated(self.position)
        } else {
            Ended::Guarded(input)
        }
    }

    /// Makes the adapter ready again after a stop, without guards: a sensor may still be on.
    async fn clear(&mut self) -> Result<(), Diagnostic> {
        self.limits = 0;
        self.say(Guard { limits: 0 }).await?;
        let status = self.say(Clear {}).await?;
        self.follow(&status);
        Ok(())
    }
}

struct Play<'a> {
    gate: Option<Gate>,
    watched: u32,
    granted: bool,
    /// The play follows a toolpath, on which it can be held.
    on_path: bool,
    feed: Feed<'a>,
    stopping: bool,
    /// The gate's deadline passed.
    late: bool,
    /// The outputs went off after a silence.
    dry: bool,
    /// Numbers of the first path frame, and of the frame that started it.
    path: Option<u32>,
    begun: u32,
}

impl Play<'_> {
    /// Returns `true` if the adapter refused a piece of this path, or its start, because of the content.
    /// Refusals because of its state or of a sensor are handled elsewhere.
    fn is_refused(&self, status: &Status) -> bool {
        let is_ours = self.path.is_some_and(|first| status.refused.wrapping_sub(first) as i32 >= 0);
        is_ours && !matches!(status.refusal, Refusal::None | Refusal::State | Refusal::Input)
    }
}

fn first(inputs: u32) -> Option<Input> {
    Input::ALL.into_iter().find(|input| inputs & input.bit() != 0)
}
