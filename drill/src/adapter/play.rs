//! Segments played by an adapter: fed as it has room, held, slowed or stopped as ordered, ended where a sensor says so.
//!
//! ```text
//! Ready ─ chunks of 250 ms, Begin ─▶ Running ─ path rests ─▶ Ready                 as planned
//!                                      │ Stopped: as ordered   Limit: a sensor, at its very step   RanDry: the line was cut
//!                                      └─ Clear ─▶ Ready, the index exact
//! ```
//!
//! Comes in: segments, what is shared with the owner. Goes out: how they ended, at rest, with every step counted. An error means
//! that nobody knows any more where the machine is. Does not know tasks.

use super::feed::{Feed, Path};
use super::greet::{self, lost, refused, trouble};
use super::line::{AdapterLine, Lost};
use super::path::{guard, last_steps};
use crate::executor::{Ended, Glimpse, Shared};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Gate, Input, Otherwise};
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

/// So much path beside that in which it comes to rest is there before it begins, and is kept there while it goes, in ticks: a chunk;
/// a chunk and 350 ms, in which nobody has to be heard.
const FIRST: u32 = LONGEST;
const AHEAD: u32 = LONGEST + 3_500_000;

/// Frames of path on their way at once: what is ordered waits behind them.
const ON_THE_WAY: u32 = 4;

/// How long an unplugged adapter is waited for.
const ABSENT: Duration = Duration::from_secs(20);

/// The output of the spindle.
const SPINDLE: u8 = 1;

/// A task that is no task: only the end of everything stops it.
pub(super) const NO_TASK: u64 = u64::MAX;

/// An adapter that is ready, and where its machine is.
pub(super) struct Adapter {
    pub(super) machine: Machine,
    pub(super) line: AdapterLine,
    pub(super) shared: Arc<Shared>,
    motors: Motors,
    settings_crc: u32,
    other_firmware: Option<OtherFirmware>,
    /// Steps counted, machine coordinates.
    pub(super) position: Steps,
    /// Axes whose latest step counted down.
    pub(super) down: AxisSet,
    /// The task in work.
    pub(super) task: u64,
    /// Stream time that was played, in ticks.
    pub(super) ticks: u64,
    rpm: u32,
    outputs: u8,
    limits: u8,
    rate: u32,
}

impl Adapter {
    /// An adapter behind `line`, which was greeted and set. It stands where nobody knows: at 0.
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
        }
    }

    fn status(&self) -> Status {
        self.line.status.unwrap_or_default()
    }

    /// The inputs, one bit each.
    pub(super) fn inputs(&self) -> u32 {
        self.machine.adapter.inputs(self.status().inputs)
    }

    /// Touches of the sensors that were shorter than their filter; none where no sensor has one, and before it was told.
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

    /// Hears what came, sends what is due, gives way. An adapter that was unplugged is waited for.
    pub(super) async fn turn(&mut self) -> Result<Status, Diagnostic> {
        if let Err(why) = self.line.turn() {
            self.wait_for_it(&why).await?;
        }
        give_way().await;
        let status = self.status();
        let port = self.line.port();
        match status.state {
            State::EmergencyStop => Err(trouble("adapter.emergency_stop", port)),
            State::Fault => Err(trouble("adapter.fault", port)),
            _ if status.settings != self.settings_crc => Err(trouble("adapter.restarted", port)),
            _ => Ok(status),
        }
    }

    /// Waits until it is plugged in again, and goes on with the same session: it knows what of it is done.
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

    /// Says it, and waits until the adapter did it.
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
            return Err(refused(&self.line, &status, &format!("{ask:?}")));
        }
        Ok(status)
    }

    /// Sets the spindle's speed: it turns or not.
    pub(super) async fn spindle(&mut self, rpm: u32) -> Result<(), Diagnostic> {
        self.rpm = rpm;
        let others = self.outputs & !SPINDLE;
        self.switch(others | if rpm > 0 { SPINDLE } else { 0 }).await
    }

    /// Switches the output that has a name.
    pub(super) async fn output(&mut self, on: bool) -> Result<(), Diagnostic> {
        const NAMED: u8 = 2;
        self.switch(self.outputs & !NAMED | if on { NAMED } else { 0 }).await
    }

    async fn switch(&mut self, on: u8) -> Result<(), Diagnostic> {
        self.outputs = on;
        self.say(Outputs { on }).await.map(drop)
    }

    /// Everything off.
    pub(super) async fn safe(&mut self) -> Result<(), Diagnostic> {
        self.rpm = 0;
        self.switch(0).await
    }

    /// Where the adapter is to be: its index is the machine's.
    fn place(&self) -> Result<[i32; AXES], Diagnostic> {
        let mut index = self.status().index;
        for (own, place) in index.iter_mut().zip(self.position).take(self.axes()) {
            let beyond = || trouble("adapter.refused", self.line.port()).with("what", "Place");
            *own = i32::try_from(place).map_err(|error| beyond().with("reason", error))?;
        }
        Ok(index)
    }

    /// Axes that there are.
    fn axes(&self) -> usize {
        (2 + self.machine.spindles as usize).min(AXES)
    }

    /// Takes up where the adapter is.
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

    /// Leaves the latest place for people to look at.
    pub(super) fn leave(&self, segment: Option<&Segment>) {
        let before = self.shared.glimpse();
        self.shared.set_glimpse(Glimpse {
            position: self.position,
            inputs: self.inputs(),
            touches: self.touches(),
            other_firmware: self.other_firmware,
            rpm: self.rpm,
            spindle: before.spindle,
            stage: segment.map(|segment| segment.stage),
            end: segment.map_or(before.end, |segment| segment.end),
        });
    }

    /// Nothing more is played: what people look at says so.
    pub(super) fn rest(&mut self) {
        self.rpm = 0;
        self.leave(None);
    }

    /// Plays segments one behind the other, from rest to rest; only the last may have a gate.
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
        let played = Play { gate, watched, granted, feed, stopping, late, dry, path, begun };
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
            self.leave(shown);
            // At rest nothing is ahead of it because the rest was forgotten.
            if status.state == State::Running {
                let passed = play.feed.passed(&status);
                self.ticks = before.saturating_add(passed);
                let deadline = play.gate.map_or(u64::MAX, |gate| u64::from(gate.deadline_us) * 10);
                play.late |= passed > deadline;
            }
            // Outputs that went off by themselves: nobody was heard for a while. What cuts may stand still.
            play.dry |= self.line.pending() == 0 && status.outputs != self.outputs;
            if let Some(ended) = self.ended(&play, &status).await? {
                return Ok(ended);
            }
        }
    }

    /// Offers path as there is room, and begins where it rests with path ahead.
    fn feed(&mut self, play: &mut Play<'_>) -> Result<(), Diagnostic> {
        let status = self.status();
        let ahead = play.feed.tail + if status.state == State::Running { AHEAD } else { FIRST };
        let mut is_full = false;
        // What follows a piece that was refused would be refused too.
        let goes_on = !play.stopping && !play.is_refused(&status);
        while goes_on && status.resident < ahead && self.line.pending() < ON_THE_WAY {
            if !play.feed.cut() {
                return Err(trouble("adapter.too_dense", self.line.port()));
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

    /// Hands on what is ordered: a stop once, a rate when it changes.
    fn order(&mut self, play: &mut Play<'_>) {
        if play.stopping {
            return;
        }
        let granted = if play.granted { self.shared.granted() } else { Order::Go };
        let is_over = self.shared.stopped() >= self.task || granted == Order::Stop;
        let full = FULL_RATE * u32::from(self.shared.feed_override()) / 100;
        let rate = if granted == Order::Hold { 0 } else { full };
        if is_over || play.late || play.dry {
            play.stopping = self.line.offer(Stop {}).is_some();
        } else if rate != self.rate && self.line.offer(Rate { wanted: rate }).is_some() {
            self.rate = rate;
        }
    }

    /// Whether it came to its end, and how.
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
                Err(trouble("adapter.restarted", self.line.port()))
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
        // A sensor turned on in the moment in which it was to begin.
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

    /// A sensor stopped the pulses: at this very step.
    async fn limited(&mut self, gate: Option<Gate>, status: &Status) -> Result<Ended, Diagnostic> {
        let is_it = |input: &Input| self.machine.adapter.sensor(*input) == Some(status.input);
        let Some(input) = Input::ALL.into_iter().find(is_it) else {
            return Err(trouble("adapter.fault", self.line.port()));
        };
        self.clear().await?;
        let ended = self.hit(input, gate);
        // The adapter turned everything off: where the sensor was looked for, it goes on.
        if matches!(ended, Ended::Gated(_)) {
            self.switch(self.outputs).await?;
        } else {
            (self.outputs, self.rpm) = (0, 0);
        }
        Ok(ended)
    }

    /// It came to rest because nothing newer came, or nobody was heard: what is off stays off.
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

    /// Ready again after what stopped it: a sensor may still be on.
    async fn clear(&mut self) -> Result<(), Diagnostic> {
        self.limits = 0;
        self.say(Guard { limits: 0 }).await?;
        let status = self.say(Clear {}).await?;
        self.follow(&status);
        Ok(())
    }
}

/// Some segments in play.
struct Play<'a> {
    gate: Option<Gate>,
    /// Inputs that end it, one bit each.
    watched: u32,
    granted: bool,
    feed: Feed<'a>,
    /// It was told to stop.
    stopping: bool,
    /// The gate's deadline passed.
    late: bool,
    /// Nobody was heard for so long that the outputs went off.
    dry: bool,
    /// Numbers of the frame that brought the first of its path, and of the one with which it began.
    path: Option<u32>,
    begun: u32,
}

impl Play<'_> {
    /// Whether an adapter that is so refused a piece of this path, or to begin it, for what it is. In which state it was, and which
    /// sensors were on then, is looked at elsewhere.
    fn is_refused(&self, status: &Status) -> bool {
        let is_ours = self.path.is_some_and(|first| status.refused.wrapping_sub(first) as i32 >= 0);
        is_ours && !matches!(status.refusal, Refusal::None | Refusal::State | Refusal::Input)
    }
}

/// The first of some inputs.
fn first(inputs: u32) -> Option<Input> {
    Input::ALL.into_iter().find(|input| inputs & input.bit() != 0)
}
