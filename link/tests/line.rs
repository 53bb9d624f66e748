//! Tests of bridge and adapter over a bad line: frames lost, garbled, doubled, out of order, and not one
//! wrong step.

use crate::card::windings;
use crate::machines::Machines;
use crate::support::{PULSE, SETUP, path, seeds};
use annulus_core::chance::Chance;
use annulus_core::machine::phases::preset;
use annulus_link::adapter::{Adapter, Inputs, NO_INPUT, OUTPUTS_AT_LAST_US, OUTPUTS_US, Order};
use annulus_link::chunk::places;
use annulus_link::cobs::Unstuffer;
use annulus_link::cutter::{ChunkCutter, Piece, Rule};
use annulus_link::frame::{FRAME, ON_LINE, open, seal};
use annulus_link::message::{
    Ask, Beat, Begin, Chunk, Clear, Configure, CountTouches, Filters, Guard, Hello, Outputs, Place, Rate,
    Refusal, Refused, State, Status, Stop, Tell, Touches, Trust, Welcome,
};
use annulus_link::phases::tables_crc;
use annulus_link::player::End;
use annulus_link::run::Run;
use annulus_link::sender::Sender;
use annulus_link::store::Store;
use annulus_link::{AXES, FULL_RATE};

const SETTINGS: Configure = Configure {
    pulse: PULSE as u8,
    setup: SETUP as u16,
    limits: 0b11,
    low_inputs: 0,
    low_steps: 0,
    low_forward: 0,
    phases: 0,
};

/// A line that damages bytes at random, with the probability `bad` per byte.
struct Line {
    chance: Chance,
    bad: f64,
    frames: Vec<Vec<u8>>,
}

impl Line {
    fn put(&mut self, frame: &[u8]) {
        let mut frame = frame.to_vec();
        for byte in &mut frame {
            if self.chance.unit() < self.bad {
                *byte ^= 1 << self.chance.below(8);
            }
        }
        let odds = self.bad * 100.0;
        if self.chance.unit() < odds {
            frame.truncate(self.chance.below(frame.len()));
        }
        if self.chance.unit() < odds {
            return;
        }
        let place = if self.chance.unit() < odds { self.chance.below(self.frames.len() + 1) } else { 0 };
        if self.chance.unit() < odds {
            self.frames.insert(0, frame.clone());
        }
        self.frames.insert(place.min(self.frames.len()), frame);
    }
}

struct World {
    now: u64,
    sender: Sender,
    there: Line,
    back: Line,
    adapter: Adapter<'static>,
    machines: Machines,
    ending: Option<End>,
    unstuffer: Unstuffer<FRAME>,
    status: Option<Status>,
    welcome: Option<Welcome>,
    begun: u32,
}

impl World {
    fn new(seed: u64, bad: f64) -> Self {
        let line = |seed| Line { chance: Chance::new(seed), bad, frames: Vec::new() };
        Self {
            now: 1,
            sender: Sender::new(seed as u32 | 1),
            there: line(seed << 8),
            back: line(seed << 8 | 1),
            adapter: Adapter::new(Welcome::default(), Box::leak(Box::new(Store::new()))),
            machines: Machines::new(),
            ending: None,
            unstuffer: Unstuffer::new(),
            status: None,
            welcome: None,
            begun: 0,
        }
    }

    fn turn(&mut self) {
        self.now += 1000;
        let mut line = [0; ON_LINE];
        if self.welcome.is_none() {
            let length = self.sender.hello(&mut line).unwrap();
            self.there.put(&line[..length]);
        } else {
            while let Some(length) = self.sender.due(self.now, &mut line) {
                self.there.put(&line[..length]);
            }
            if self.now % 50_000 < 1000 {
                let length = self.sender.unnumbered(&Beat {}.into(), &mut line).unwrap();
                self.there.put(&line[..length]);
            }
        }
        let now = self.now as u32;
        while let Some(frame) = self.there.frames.pop() {
            frame.iter().for_each(|byte| self.adapter.hear(*byte, now));
        }
        while self.adapter.obey_next() {}
        while let Some(order) = self.adapter.order() {
            if order == Order::Begin {
                self.begun += 1;
                self.adapter.begin();
            }
        }
        for _ in 0..8 {
            if self.adapter.state() == State::Running && self.ending.is_none() {
                self.ending = self.adapter.slice(&mut self.machines);
            }
        }
        if let Some(end) = self.ending.take() {
            self.adapter.ended(end);
        }
        self.adapter.attend(Inputs::default(), now);
        while let Some(length) = self.adapter.tell(now, &mut line) {
            self.back.put(&line[..length]);
        }
        while let Some(frame) = self.back.frames.pop() {
            for byte in frame {
                let Some((header, payload)) = self.unstuffer.take(byte).and_then(open) else { continue };
                assert_eq!(header.session, self.sender.session());
                match Tell::take(header.kind, payload) {
                    Some((Tell::Welcome(welcome), [])) => self.welcome = Some(welcome),
                    Some((Tell::Status(status), [])) => {
                        self.sender.hear(&status);
                        let is_newer = self.status.is_none_or(|old| status.micros >= old.micros);
                        self.status = if is_newer { Some(status) } else { self.status };
                    }
                    other => panic!("{other:?}"),
                }
            }
        }
    }

    fn until(&mut self, done: impl Fn(&Self) -> bool) {
        for _ in 0..60_000 {
            if done(self) {
                return;
            }
            self.turn();
        }
        panic!("it never came about: {:?}", self.status);
    }

    fn say(&mut self, ask: impl Into<Ask>) -> Status {
        let ask = ask.into();
        self.until(|world| world.welcome.is_some());
        let mut number = None;
        while number.is_none() {
            number = self.sender.offer(&ask);
            self.turn();
        }
        self.until(|world| world.sender.pending() == 0);
        self.status.unwrap()
    }

    fn begin(&mut self) {
        self.say(SETTINGS);
        self.say(Place { index: [0; AXES] });
    }

    fn offer(&mut self, piece: &Piece) -> Option<u32> {
        self.sender.offer_chunk(&piece.head, piece.slices())
    }
}

#[test]
fn bad_line_costs_time_and_never_a_step() {
    let (mut starved, mut rested) = (0, 0);
    for seed in seeds(60) {
        // Error rates from 1e-5 to 1e-3 per byte, including the promised 1e-4.
        let bad = Chance::new(seed).scale(1e-5, 1e-3);
        let mut world = World::new(seed, bad);
        let mut chance = Chance::new(seed);
        let (runs, ticks) = path(&mut chance, 3_000_000);
        let rule = Rule::resting_within(50_000);
        world.begin();
        let mut cutter = ChunkCutter::new(runs.each_ref().map(Vec::as_slice), ticks.into(), 0, [0; AXES]);
        let (mut next, mut asked) = (cutter.cut(&rule), false);
        world.until_played(&mut cutter, &mut next, &rule, &mut asked);
        let status = world.status.unwrap();
        let made: Vec<usize> = world.machines.steps.iter().map(Vec::len).collect();
        let wanted = crate::support::meant(&runs, ticks);
        for axis in 0..AXES {
            let same = world.machines.steps[axis].iter().zip(&wanted[axis]).all(|(a, b)| a.forward == b.1);
            assert!(same && made[axis] <= wanted[axis].len(), "axis {axis}");
            let counted =
                world.machines.steps[axis].iter().map(|step| if step.forward { 1 } else { -1 }).sum::<i32>();
            assert_eq!(status.index[axis], counted);
        }
        if status.state == State::Starved {
            starved += 1;
        } else {
            assert_eq!(status.state, State::Ready, "{status:?}");
            assert_eq!(made, wanted.iter().map(Vec::len).collect::<Vec<_>>(), "all of it");
            rested += 1;
        }
        assert_eq!((status.refusal, status.trust, world.begun), (Refusal::None, Trust::Trusted, 1));
    }
    assert!(rested > 30, "{rested} rested, {starved} starved");
}

impl World {
    /// Sends what there is room for, until everything is played or the adapter starved.
    fn until_played(
        &mut self,
        cutter: &mut ChunkCutter<'_>,
        next: &mut Option<Piece>,
        rule: &Rule,
        asked: &mut bool,
    ) {
        for _ in 0..60_000 {
            while let Some(piece) = next {
                if self.offer(piece).is_none() {
                    break;
                }
                *next = cutter.cut(rule);
            }
            let status = self.status.unwrap();
            let is_here = status.chunk > 5 || next.is_none() && self.sender.pending() == 0;
            if !*asked && is_here && self.sender.offer(&Begin {}.into()).is_some() {
                *asked = true;
            }
            self.turn();
            let status = self.status.unwrap();
            let is_over = status.state == State::Ready && status.resident == 0 && status.next > 3;
            if *asked && self.begun > 0 && (status.state == State::Starved || is_over && next.is_none()) {
                return;
            }
        }
        panic!("it never ended: {:?}", self.status);
    }
}

#[test]
fn incompatible_versions_are_refused() {
    let mut world = World::new(5, 0.0);
    let mut line = [0; ON_LINE];
    for (oldest, newest) in [(2, 9), (0, 0)] {
        let hello = world.sender.unnumbered(&Hello { oldest, newest }.into(), &mut line).unwrap();
        line[..hello].iter().for_each(|byte| world.adapter.hear(*byte, 0));
        let length = world.adapter.tell(0, &mut line).unwrap();
        let mut unstuffer = Unstuffer::<FRAME>::new();
        let frame = line[..length].iter().find_map(|byte| unstuffer.take(*byte).map(<[u8]>::to_vec)).unwrap();
        let (header, payload) = open(&frame).unwrap();
        let refused = Refused { oldest: 1, newest: 1 };
        assert_eq!(Tell::take(header.kind, payload), Some((refused.into(), [].as_slice())));
        assert_eq!((world.adapter.tell(50_000, &mut line), world.adapter.order()), (None, None));
    }
}

#[test]
fn new_session_ends_the_older_one_permanently() {
    let mut world = World::new(7, 0.0);
    world.begin();
    let (runs, ticks) = path(&mut Chance::new(7), 3_000_000);
    let mut cutter = ChunkCutter::new(runs.each_ref().map(Vec::as_slice), ticks.into(), 0, [0; AXES]);
    for _ in 0..8 {
        let piece = cutter.cut(&Rule::resting_within(20_000)).unwrap();
        assert!(world.offer(&piece).is_some());
    }
    world.until(|world| world.sender.pending() == 0);
    world.say(Outputs { on: 1 });
    world.say(Begin {});
    world.until(|world| world.machines.steps[0].len() > 20);
    let (old, settings) = (world.sender, world.status.unwrap().settings);
    assert!(settings != 0);
    world.sender = Sender::new(0xABCD);
    (world.welcome, world.status) = (None, None);
    // Frames of the old session, its hello included, are ignored.
    let mut line = [0; ON_LINE];
    world.until(|world| world.welcome.is_some());
    assert_eq!(
        (world.adapter.state(), world.adapter.outputs()),
        (State::Running, 1),
        "no bit stands in a board"
    );
    for ask in [Ask::from(Hello { oldest: 1, newest: 1 }), Beat {}.into()] {
        let length = old.unnumbered(&ask, &mut line).unwrap();
        world.there.put(&line[..length]);
    }
    world.until(|world| world.status.is_some_and(|status| status.state != State::Running));
    let status = world.status.unwrap();
    assert_eq!((status.state, status.settings, status.resident), (State::Unset, 0, 0));
    assert_eq!(
        (status.trust, status.outputs),
        (Trust::Trusted, 0),
        "it came to rest on the path, then all is off"
    );
    assert_eq!(world.say(Begin {}).refusal, Refusal::State);
    assert_eq!(world.say(SETTINGS).state, State::Ready);
}

#[test]
fn old_outputs_go_off_during_repeated_hellos() {
    let mut world = World::new(23, 0.0);
    world.begin();
    let steady = [Run { count: 4_000, ..Run::one(true, 1_000) }];
    let mut cutter = ChunkCutter::new([&steady, &[], &[], &[]], 4_000_000, 0, [0; AXES]);
    while let Some(piece) = cutter.cut(&Rule { ticks: 1_000_000, ..Rule::resting_within(100_000) }) {
        assert!(world.offer(&piece).is_some());
    }
    world.say(Outputs { on: 1 });
    world.say(Begin {});
    let mut line = [0; ON_LINE];
    // New sessions say hello in turn, and no words are made.
    let since = world.now as u32;
    for session in 0..20 {
        let now = since + OUTPUTS_AT_LAST_US / 20 * session;
        let length = Sender::new(100 + session).hello(&mut line).unwrap();
        line[..length].iter().for_each(|byte| world.adapter.hear(*byte, now));
        world.adapter.attend(Inputs::default(), now + 1_000);
        assert_eq!((world.adapter.state(), world.adapter.outputs()), (State::Running, 1));
    }
    world.adapter.attend(Inputs::default(), since + OUTPUTS_AT_LAST_US);
    assert_eq!((world.adapter.state(), world.adapter.outputs()), (State::Running, 0));
}

#[test]
fn invalid_commands_are_refused_and_change_nothing() {
    let mut world = World::new(9, 0.0);
    assert_eq!(world.say(Begin {}).refusal, Refusal::State);
    assert_eq!(world.say(Place { index: [1; AXES] }).refusal, Refusal::State);
    assert_eq!(world.say(Outputs { on: 1 }).outputs, 0);
    assert_eq!(world.say(Configure { pulse: 1, ..SETTINGS }).refusal, Refusal::Settings);
    assert_eq!(world.say(Configure { pulse: 34, ..SETTINGS }).state, State::Unset);
    assert_eq!(world.say(SETTINGS).state, State::Ready);
    assert_eq!(world.say(Begin {}).refusal, Refusal::State);
    assert_eq!(world.say(Clear {}).state, State::Ready);
    let chunk = |number, first| {
        let places = places(first, first);
        Chunk { number, places, ticks: 100, fall: 1000, rests: 1, ..Chunk::default() }
    };
    let refusal = |world: &mut World, head: Chunk| {
        let none: [&[annulus_link::run::Run]; AXES] = [&[]; AXES];
        while world.sender.offer_chunk(&head, none).is_none() {
            world.turn();
        }
        world.until(|world| world.sender.pending() == 0);
        let status = world.status.unwrap();
        (status.refusal, status.chunk)
    };
    assert_eq!(refusal(&mut world, chunk(1, [0; 4])), (Refusal::Gap, 0));
    assert_eq!(refusal(&mut world, chunk(0, [0, 0, 0, 1])), (Refusal::Index, 0));
    assert_eq!(refusal(&mut world, chunk(0, [0; 4])).1, 1);
    assert_eq!(refusal(&mut world, chunk(0, [0; 4])).1, 1, "the same again is nothing new");
    assert_eq!(world.say(Place { index: [1; AXES] }).refusal, Refusal::State, "not with path waiting");
    assert_eq!(world.say(Stop {}).resident, 0);
    assert_eq!(world.say(Place { index: [-5; AXES] }).index, [-5; AXES]);
    assert_eq!(world.say(Guard { limits: 0 }).trust, Trust::Trusted);
    assert_eq!(world.say(Rate { wanted: 2 * FULL_RATE }).state, State::Ready);
}

fn still() -> Chunk {
    let nowhere = places([0; AXES], [0; AXES]);
    Chunk { places: nowhere, ticks: 90_000, fall: 1000, rise: 1000, rests: 1, ..Chunk::default() }
}

#[test]
fn path_starts_only_with_its_complete_tail() {
    let mut world = World::new(21, 0.0);
    world.begin();
    let steady = [Run { count: 4_000, ..Run::one(true, 1_000) }];
    let mut cutter = ChunkCutter::new([&steady, &[], &[], &[]], 4_000_000, 0, [0; AXES]);
    // Stops within 50,000 ticks of path: two and a half chunks.
    let rule = Rule { ticks: 20_000, ..Rule::resting_within(100_000) };
    for chunk in 0..4 {
        let status = world.say(Begin {});
        assert_eq!(status.state, State::Ready);
        assert_eq!(status.refusal, if chunk == 0 { Refusal::State } else { Refusal::Tail });
        let piece = cutter.cut(&rule).unwrap();
        world.offer(&piece).unwrap();
        world.until(|world| world.sender.pending() == 0);
    }
    assert_eq!(world.say(Begin {}).state, State::Running);
    world.until(|world| world.status.unwrap().state == State::Starved);
    let index = world.status.unwrap().index;
    assert_eq!(index[0], world.machines.steps[0].len() as i32);
    assert!((50..=80).contains(&index[0]), "a chunk at full rate, then its tail: {index:?}");
}

#[test]
fn first_refusal_of_a_path_stays_until_the_next_start() {
    let mut world = World::new(27, 0.0);
    world.begin();
    let steady = [Run { count: 4_000, ..Run::one(true, 1_000) }];
    let mut cutter = ChunkCutter::new([&steady, &[], &[], &[]], 4_000_000, 0, [0; AXES]);
    let rule = Rule { ticks: 20_000, ..Rule::resting_within(100_000) };
    let mut pieces = std::array::from_fn::<Piece, 8, _>(|_| cutter.cut(&rule).unwrap());
    pieces[5].head.ticks = annulus_link::chunk::LONGEST + 1;
    let numbers = pieces.each_ref().map(|piece| world.offer(piece).unwrap());
    world.until(|world| world.sender.pending() == 0);
    let reason = |status: Status| (status.refusal, status.refused, status.chunk);
    let first = (Refusal::Counts, numbers[5], 5);
    assert_eq!(reason(world.status.unwrap()), first, "those behind it have gaps before them");
    assert_eq!(world.say(Begin {}).state, State::Running);
    // The adapter runs dry, then a frame on its way arrives.
    world.until(|world| world.status.unwrap().state == State::Starved);
    world.offer(&pieces[6]).unwrap();
    world.until(|world| world.sender.pending() == 0);
    assert_eq!(
        reason(world.status.unwrap()),
        first,
        "in no state for it, but that is not why it is not whole"
    );
    assert_eq!(world.say(Configure { pulse: 1, ..SETTINGS }).refusal, Refusal::State, "what else is told of");
    assert_eq!(world.say(Clear {}).state, State::Ready);
    assert_eq!(world.say(Begin {}).refusal, Refusal::State, "there is no path");
    assert_eq!(world.say(Configure { pulse: 1, ..SETTINGS }).refusal, Refusal::Settings);
    world.offer(&pieces[6]).unwrap();
    world.until(|world| world.sender.pending() == 0);
    assert_eq!(world.status.unwrap().refusal, Refusal::Gap);
}

#[test]
fn forced_stop_can_be_cleared_by_the_next_session() {
    for (input, stop, state) in
        [(Some(1), false, State::Limit), (None, true, State::EmergencyStop), (None, false, State::Fault)]
    {
        let mut world = World::new(15, 0.0);
        world.begin();
        world.adapter.forced([3, -2, 0, 0], input, stop);
        world.sender = Sender::new(4321);
        world.welcome = None;
        assert_eq!(world.say(SETTINGS).state, state, "settings clear nothing");
        assert_eq!(world.say(Begin {}).refusal, Refusal::State);
        let cleared = world.say(Clear {});
        assert_eq!((cleared.state, cleared.index), (State::Ready, [3, -2, 0, 0]));
    }
}

#[test]
fn emergency_stop_overrides_an_earlier_stop() {
    for input in [Some(1), None] {
        let mut world = World::new(25, 0.0);
        world.begin();
        world.adapter.forced([3, -2, 0, 0], input, false);
        assert_eq!(world.say(Outputs { on: 1 }).outputs, 1, "as soon as it is cleared");
        let pressed = Inputs { on: 0, stop: true };
        let now = world.now as u32;
        world.adapter.attend(pressed, now);
        assert_ne!(world.adapter.state(), State::EmergencyStop, "once is noise");
        world.adapter.attend(pressed, now);
        let status = world.adapter.status(now);
        assert_eq!((status.state, status.input, status.outputs), (State::EmergencyStop, NO_INPUT, 0));
        assert_eq!(status.index, [3, -2, 0, 0]);
        world.turn();
        assert_eq!(world.say(Clear {}).state, State::Ready);
    }
}

#[test]
fn reordered_frames_are_executed_in_order() {
    let mut world = World::new(27, 0.0);
    world.begin();
    let empty: [&[Run]; AXES] = [&[]; AXES];
    for number in 0..4 {
        assert!(world.sender.offer_chunk(&Chunk { number, ..still() }, empty).is_some());
    }
    let mut frames = Vec::new();
    let mut line = [0; ON_LINE];
    while let Some(length) = world.sender.due(world.now, &mut line) {
        frames.push(line[..length].to_vec());
    }
    // The first of them arrives last.
    frames.rotate_left(1);
    frames.concat().iter().for_each(|byte| world.adapter.hear(*byte, 1));
    for chunk in 0..4 {
        assert_eq!(world.adapter.status(1).chunk, chunk);
        assert_eq!(world.adapter.tell(1, &mut line), None, "nobody is asked for what is here");
        assert!(world.adapter.obey_next());
    }
    assert_eq!((world.adapter.status(1).chunk, world.adapter.obey_next()), (4, false));
    assert!(world.adapter.tell(1, &mut line).is_some());
}

#[test]
fn commands_in_one_packet_are_all_executed() {
    let mut world = World::new(13, 0.0);
    world.begin();
    let empty: [&[annulus_link::run::Run]; AXES] = [&[]; AXES];
    let head = still();
    assert!(world.sender.offer_chunk(&head, empty).is_some());
    for ask in [Guard { limits: 0 }.into(), Ask::from(Begin {}), Stop {}.into()] {
        assert!(world.sender.offer(&ask).is_some());
    }
    let mut line = [0; ON_LINE];
    while let Some(length) = world.sender.due(world.now, &mut line) {
        line[..length].iter().for_each(|byte| world.adapter.hear(*byte, 1));
    }
    while world.adapter.obey_next() {}
    assert_eq!([world.adapter.order(), world.adapter.order()], [Some(Order::Settle), Some(Order::Begin)]);
    world.adapter.begin();
    // A stop before the first word must not be lost.
    let end = (0..200).find_map(|_| world.adapter.slice(&mut world.machines));
    assert_eq!(end, Some(End::Stopped));
}

#[test]
fn outputs_go_off_if_the_bridge_is_silent() {
    let mut world = World::new(11, 0.0);
    world.begin();
    assert_eq!(world.say(Outputs { on: 1 }).outputs, 1);
    let since = world.now as u32;
    let inputs = Inputs::default();
    world.adapter.attend(inputs, since + OUTPUTS_US - 60_000);
    assert_eq!(world.adapter.outputs(), 1);
    world.adapter.attend(inputs, since + OUTPUTS_US);
    assert_eq!(world.adapter.outputs(), 0);
}

#[test]
fn stale_path_starts_only_after_outputs_are_sent_again() {
    let mut world = World::new(19, 0.0);
    world.begin();
    assert_eq!(world.say(Outputs { on: 1 }).outputs, 1);
    let empty: [&[annulus_link::run::Run]; AXES] = [&[]; AXES];
    let head = still();
    assert!(world.sender.offer_chunk(&head, empty).is_some());
    // A hub delayed the frames: silence first, then everything at once.
    world.adapter.attend(Inputs::default(), world.now as u32 + OUTPUTS_US);
    let status = world.say(Begin {});
    assert_eq!((status.state, status.refusal, status.outputs), (State::Ready, Refusal::State, 0));
    assert_eq!(world.say(Stop {}).resident, 0, "it is taken back");
    assert_eq!(world.say(Outputs { on: 1 }).outputs, 1);
    assert!(world.sender.offer_chunk(&Chunk { number: 1, ..head }, empty).is_some());
    assert_eq!(world.say(Begin {}).state, State::Running);
}

#[test]
fn silence_stops_motion_before_the_spindle() {
    for patience_us in [OUTPUTS_US, OUTPUTS_AT_LAST_US] {
        let mut world = World::new(17, 0.0);
        world.begin();
        assert_eq!(world.say(Outputs { on: 1 }).outputs, 1);
        // 400 ms of path are there; then the bridge is silent.
        let steady = Run { count: 4_000, ..Run::one(true, 1_000) };
        let steady = [steady];
        let mut cutter = ChunkCutter::new([&steady, &[], &[], &[]], 4_000_000, 0, [0; AXES]);
        let rule = Rule { ticks: 1_000_000, ..Rule::resting_within(100_000) };
        while let Some(piece) = cutter.cut(&rule) {
            assert!(world.offer(&piece).is_some());
        }
        world.say(Begin {});
        let since = world.now as u32;
        let inputs = Inputs::default();
        while world.adapter.machine() < 2_400_000 {
            assert!(world.ending.is_none());
            world.ending = world.adapter.slice(&mut world.machines);
        }
        world.adapter.attend(inputs, since + OUTPUTS_US - 1_000);
        assert_eq!((world.adapter.state(), world.adapter.outputs()), (State::Running, 1));
        world.adapter.attend(inputs, since + OUTPUTS_US + 1_000);
        assert_eq!(
            (world.adapter.state(), world.adapter.outputs()),
            (State::Running, 1),
            "not before it rests"
        );
        if patience_us == OUTPUTS_AT_LAST_US {
            world.adapter.attend(inputs, since + patience_us + 1_000);
            assert_eq!(world.adapter.outputs(), 0, "whatever moves");
            continue;
        }
        let end = (0..2_000).find_map(|_| world.adapter.slice(&mut world.machines));
        assert_eq!(end, Some(End::Stopped));
        world.adapter.ended(End::Stopped);
        let steps = world.machines.steps[0].len();
        let status = world.adapter.status(0);
        assert_eq!((status.state, status.trust), (State::Starved, Trust::Trusted));
        assert_eq!(status.index[0], steps as i32);
        assert!(
            (2_400..3_000).contains(&steps),
            "{steps}: within 10 ms of stream, not at the end of what was there"
        );
        world.adapter.attend(inputs, since + OUTPUTS_US + 20_000);
        assert_eq!(world.adapter.outputs(), 0);
    }
}

#[test]
fn random_bytes_move_nothing() {
    for seed in seeds(30) {
        let mut chance = Chance::new(seed);
        let mut world = World::new(seed, 0.0);
        world.begin();
        let (mut line, mut taken) = ([0; ON_LINE], 0);
        for _ in 0..400 {
            // Frames with a valid checksum, session and number, but invalid contents.
            let number = world.adapter.status(0).next;
            let header = annulus_link::frame::Header {
                session: world.sender.session(),
                number,
                kind: chance.below(24) as u8,
            };
            let payload: Vec<u8> =
                (0..chance.below(200)).map(|_| chance.bits() as u8 & chance.bits() as u8).collect();
            let length = seal(header, &payload, &mut line).unwrap();
            line[..length].iter().for_each(|byte| world.adapter.hear(*byte, 0));
            taken += u32::from(world.adapter.obey_next());
            assert!(world.adapter.order() != Some(Order::Begin));
        }
        assert!(taken > 200, "{taken}");
        assert_eq!(world.machines.steps.iter().map(Vec::len).sum::<usize>(), 0);
    }
}

#[test]
fn filters_last_one_session_and_touches_are_sent_on_request() {
    let mut world = World::new(21, 0.0);
    let filters = Filters { least_us: [0, 50, 10_000, 0, 0, 0, 0, 1] };
    assert_eq!(world.say(filters).refusal, Refusal::State, "not before the settings");
    world.begin();
    while world.adapter.order().is_some() {}
    assert_eq!(world.say(filters).refusal, Refusal::State, "that was the one before");
    assert_eq!(world.adapter.filters_us(), &filters.least_us);
    let refused = world.say(Filters { least_us: [10_001; 8] });
    assert_eq!((refused.refusal, world.adapter.filters_us()), (Refusal::Settings, &filters.least_us));
    let mut line = [0; ON_LINE];
    let length = world.sender.unnumbered(&CountTouches {}.into(), &mut line).unwrap();
    line[..length].iter().for_each(|byte| world.adapter.hear(*byte, 0));
    assert!(world.adapter.asks_touches());
    let touches = Touches { short: [1, 2, 3, 4, 5, 6, 7, u16::MAX], longest_us: [9; 8] };
    world.adapter.touched(touches);
    assert!(!world.adapter.asks_touches());
    let length = world.adapter.tell(0, &mut line).unwrap();
    let mut unstuffer = Unstuffer::<FRAME>::new();
    let frame = line[..length].iter().find_map(|byte| unstuffer.take(*byte).map(<[u8]>::to_vec)).unwrap();
    let (header, payload) = open(&frame).unwrap();
    assert_eq!(Tell::take(header.kind, payload), Some((touches.into(), [].as_slice())));
    let tables = std::array::from_fn(|axis| windings(axis, &preset("half").unwrap(), 20_000));
    for table in tables {
        assert_eq!(world.say(table).state, State::Ready);
    }
    let phases = tables_crc(&tables);
    assert_eq!(world.say(Configure { pulse: 2, setup: 0, phases, ..SETTINGS }).state, State::Ready);
    assert_eq!(world.adapter.filters_us(), &[0; 8], "they were those of other pins");
    let refused = world.say(Filters { least_us: [0, 0, 0, 0, 1, 0, 0, 0] });
    assert_eq!((refused.refusal, world.adapter.filters_us()), (Refusal::Settings, &[0; 8]), "no such input");
    world.say(Filters { least_us: [0, 0, 0, 1, 0, 0, 0, 0] });
    assert_eq!(world.adapter.filters_us()[3], 1);
    world.sender = Sender::new(0xF11);
    world.welcome = None;
    world.until(|world| world.welcome.is_some());
    assert_eq!(world.adapter.filters_us(), &[0; 8], "the next session says its own");
}
