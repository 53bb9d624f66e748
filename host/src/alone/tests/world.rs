//! An adapter in memory with the virtual drill at its pins. The adapter's own program runs, without the
//! chip.

use super::{Memory, now};
use crate::adapter::own_firmware;
use crate::alone::Port;
use crate::files::{File, Files};
use crate::owner::board;
use annulus_core::chance::Chance;
use annulus_core::machine::Machine;
use annulus_core::pins::Pins;
use annulus_core::virtual_drill::{Breakage, Faults, VirtualDrill, VirtualHole};
use annulus_link::adapter::{Adapter, Inputs, Order};
use annulus_link::cobs::Unstuffer;
use annulus_link::frame::{FRAME, Header, ON_LINE, open, seal};
use annulus_link::message::{Ask, Status, Touches, Welcome};
use annulus_link::player::{BEFORE_PULSE, End, WITHOUT_PULSE, Words};
use annulus_link::receiver::WINDOW;
use annulus_link::store::Store;
use annulus_link::{AXES, CYCLES_PER_TICK, INPUTS, TICK_HZ};
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, channel};

const ROUND_US: u64 = 250;
/// How far ahead words are made, in ticks.
const AHEAD: u32 = 20_000;
const TICKS_PER_US: u64 = 10;

/// Pulses that are made but not yet given: cycle and direction.
#[derive(Default)]
struct Rings {
    behind: [u64; AXES],
    pulses: [VecDeque<(u64, bool)>; AXES],
    pulse: u32,
    places: [u32; 8],
}

impl Words for Rings {
    fn put(&mut self, axis: usize, word: u32) {
        let begin = self.behind[axis] + u64::from(word >> 2);
        if word >> 1 & 1 == 1 {
            let cycle = begin + u64::from(BEFORE_PULSE);
            self.pulses[axis].push_back((cycle, word & 1 == 1));
            self.behind[axis] = cycle + u64::from(self.pulse * CYCLES_PER_TICK);
        } else {
            self.behind[axis] = begin + u64::from(WITHOUT_PULSE);
        }
    }

    fn places(&mut self, _axis: usize) -> &mut [u32] {
        &mut self.places
    }

    fn filled(&mut self, axis: usize, count: u32) {
        for place in 0..count as usize {
            self.put(axis, self.places[place]);
        }
    }
}

enum Motion {
    Rest,
    Making,
    Playing(End),
}

pub(super) struct World {
    pub(super) port: Port,
    machine: Machine,
    adapter: Adapter<'static>,
    rings: Rings,
    motion: Motion,
    begun_us: u64,
    now_us: u64,
    drill: VirtualDrill,
    holes: Receiver<String>,
    files: Memory,
    /// Simulates firmware without filters.
    pub(super) knows_no_filters: bool,
    pub(super) touches: Touches,
    pub(super) pressed: bool,
    plugged: bool,
    pub(super) stalled: bool,
    /// How much faster the adapter's clock runs, in parts per million.
    pub(super) fast_ppm: u64,
    pub(super) garble: Option<(Chance, usize)>,
    pub(super) steps: u64,
    pub(super) bytes: u64,
    pub(super) of_path: u64,
    frames: Unstuffer<FRAME>,
    since: u64,
    pub(super) written_down: Option<Vec<Pulse>>,
    /// Number of packets that still arrive; all later ones are lost.
    pub(super) packets: Option<u64>,
    /// Position of X, Y and Z at each stop by an input, in steps, and the input.
    pub(super) stops: Vec<([i64; 3], u8)>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Pulse {
    pub(super) tick: u64,
    pub(super) axis: usize,
    pub(super) forward: bool,
}

fn without_filters(bytes: &[u8]) -> Vec<u8> {
    const UNKNOWN: u8 = 100;
    let (mut frames, mut all, mut since) = (Unstuffer::<FRAME>::new(), Vec::new(), 0);
    for byte in bytes {
        all.push(*byte);
        let Some(frame) = frames.take(*byte) else { continue };
        if let Some((header, payload)) = open(frame)
            && matches!(Ask::take(header.kind, payload), Some((Ask::Filters(_), _)))
        {
            let mut line = [0; ON_LINE];
            let length = seal(Header { kind: UNKNOWN, ..header }, payload, &mut line).unwrap();
            all.truncate(since);
            all.extend_from_slice(&line[..length]);
        }
        since = all.len();
    }
    all
}

const PACKET: usize = 64;

fn fresh(firmware: u32) -> Adapter<'static> {
    let welcome = Welcome {
        firmware,
        clock_hz: TICK_HZ * CYCLES_PER_TICK,
        window: WINDOW as u8,
        axes: AXES as u8,
        max_rate_hz: 500_000,
        ..Welcome::default()
    };
    Adapter::new(welcome, Box::leak(Box::<Store>::default()))
}

impl World {
    /// A connected adapter, whose drill writes its holes to `files`.
    pub(super) fn new(machine: &Machine, files: &Memory) -> Self {
        Self::broken_by(machine, files, Faults::default())
    }

    pub(super) fn broken_by(machine: &Machine, files: &Memory, faults: Faults) -> Self {
        let (told, holes) = channel();
        let record = Box::new(move |hole: &VirtualHole| drop(told.send(board::line(hole))));
        let port = Port::default();
        port.opened();
        Self {
            port,
            machine: machine.clone(),
            adapter: fresh(own_firmware()),
            rings: Rings::default(),
            motion: Motion::Rest,
            begun_us: 0,
            now_us: now().as_micros() as u64,
            drill: VirtualDrill::new(machine, 7, faults, record),
            holes,
            files: files.clone(),
            knows_no_filters: false,
            touches: Touches::default(),
            pressed: false,
            plugged: true,
            stalled: false,
            fast_ppm: 0,
            garble: None,
            steps: 0,
            bytes: 0,
            of_path: 0,
            frames: Unstuffer::new(),
            since: 0,
            written_down: None,
            packets: None,
            stops: Vec::new(),
        }
    }

    pub(super) fn port_again(&mut self) -> Port {
        self.port = Port::default();
        self.port.opened();
        self.port.clone()
    }

    pub(super) fn plug(&mut self, plugged: bool) {
        self.plugged = plugged;
        if plugged { self.port.opened() } else { self.port.gone() }
    }

    pub(super) fn power(&mut self) {
        self.flashed(own_firmware());
    }

    pub(super) fn flashed(&mut self, firmware: u32) {
        (self.adapter, self.rings, self.motion) = (fresh(firmware), Rings::default(), Motion::Rest);
        self.drill.safe();
    }

    pub(super) fn drives_phases(&self) -> bool {
        self.adapter.settings().phases != 0
    }

    /// True position of X, Y and Z, in steps.
    pub(super) fn real(&self) -> [i64; 3] {
        self.drill.real()
    }

    pub(super) fn broken(&self) -> Option<Breakage> {
        self.drill.broken()
    }

    pub(super) fn go_on(&mut self) {
        let now_us = now().as_micros() as u64;
        let until_us = now_us + now_us * self.fast_ppm / 1_000_000;
        let mut bytes = if self.stalled { Vec::new() } else { self.port.written() };
        self.carried(&mut bytes);
        self.bytes += bytes.len() as u64;
        bytes.iter().for_each(|byte| self.weigh(*byte));
        let bytes = if self.knows_no_filters { without_filters(&bytes) } else { bytes };
        let bytes = if self.plugged { self.spoiled(bytes) } else { Vec::new() };
        bytes.iter().for_each(|byte| self.adapter.hear(*byte, self.now_us as u32));
        while self.now_us < until_us {
            self.now_us = (self.now_us + ROUND_US).min(until_us);
            self.round();
        }
        for hole in self.holes.try_iter() {
            self.files.append(File::Drilled, hole.as_bytes()).unwrap();
        }
    }

    fn weigh(&mut self, byte: u8) {
        self.since += 1;
        let Some(frame) = self.frames.take(byte) else { return };
        let is_path = open(frame)
            .and_then(|(header, payload)| Ask::take(header.kind, payload))
            .is_some_and(|(ask, _)| matches!(ask, Ask::Chunk(_)));
        self.of_path += if is_path { self.since } else { 0 };
        self.since = 0;
    }

    /// Cuts off everything after the last packet that still arrives.
    fn carried(&mut self, bytes: &mut Vec<u8>) {
        let Some(left) = &mut self.packets else { return };
        let come = bytes.len().div_ceil(PACKET).min(usize::try_from(*left).unwrap_or(usize::MAX));
        bytes.truncate(come * PACKET);
        *left -= come as u64;
    }

    /// How long each input must be touched.
    pub(super) fn filters_us(&self) -> [u16; INPUTS] {
        *self.adapter.filters_us()
    }

    pub(super) fn status(&self) -> Status {
        self.adapter.status(self.now_us as u32)
    }

    fn spoiled(&mut self, mut bytes: Vec<u8>) -> Vec<u8> {
        let Some((chance, every)) = &mut self.garble else { return bytes };
        for byte in &mut bytes {
            if chance.below(*every) == 0 {
                *byte ^= 1 << chance.below(8);
            }
        }
        bytes
    }

    fn round(&mut self) {
        self.adapter.obey_next();
        while let Some(order) = self.adapter.order() {
            if order == Order::Begin {
                let pulse = u32::from(self.adapter.settings().pulse);
                (self.rings, self.begun_us) = (Rings { pulse, ..Rings::default() }, self.now_us);
                self.adapter.begin();
                self.motion = Motion::Making;
            }
        }
        self.give();
        let passed = ((self.now_us - self.begun_us) * TICKS_PER_US) as u32;
        match self.motion {
            Motion::Making => {
                let mut end = None;
                while end.is_none() && self.adapter.machine() < passed + AHEAD {
                    end = self.adapter.slice(&mut self.rings);
                }
                self.motion = end.map_or(Motion::Making, Motion::Playing);
            }
            Motion::Playing(end) if self.adapter.machine() <= passed => {
                self.motion = Motion::Rest;
                self.adapter.ended(end);
            }
            Motion::Playing(_) | Motion::Rest => {}
        }
        let inputs = Inputs { on: self.inputs(), stop: self.pressed };
        if self.pressed {
            self.force(None, true);
        }
        self.adapter.attend(inputs, self.now_us as u32);
        if self.adapter.asks_touches() {
            self.adapter.touched(self.touches);
        }
        let tick = self.now_us * TICKS_PER_US;
        if self.written_down.is_none() {
            self.drill.spindle(tick, if self.adapter.outputs() & 1 == 1 { 20_000 } else { 0 });
        }
        let mut line = [0; ON_LINE];
        while let Some(length) = self.adapter.tell(self.now_us as u32, &mut line) {
            let told = self.spoiled(line[..length].to_vec());
            if self.plugged && !self.stalled {
                self.port.bytes(&told);
            }
        }
    }

    fn inputs(&mut self) -> u8 {
        if self.written_down.is_some() {
            return 0;
        }
        let on = self.drill.inputs(self.now_us * TICKS_PER_US);
        self.machine.adapter.wired(on)
    }

    /// Gives the pulses that are due, in order, until a sensor stops them.
    fn give(&mut self) {
        let cycles = (self.now_us - self.begun_us) * TICKS_PER_US * u64::from(CYCLES_PER_TICK);
        loop {
            let next = |axis: &usize| self.rings.pulses[*axis].front().map_or(u64::MAX, |pulse| pulse.0);
            let axis = (0..AXES).min_by_key(next).unwrap_or(0);
            if next(&axis) > cycles {
                return;
            }
            let Some((cycle, forward)) = self.rings.pulses[axis].pop_front() else { return };
            let tick = self.begun_us * TICKS_PER_US + cycle / u64::from(CYCLES_PER_TICK);
            if let Some(written_down) = &mut self.written_down {
                written_down.push(Pulse { tick, axis, forward });
                continue;
            }
            self.drill.step(tick, 1 << axis, u8::from(forward) << axis);
            self.steps += 1;
            let hit = self.machine.adapter.wired(self.drill.inputs(tick)) & self.adapter.limits();
            if hit != 0 {
                let input = hit.trailing_zeros() as u8;
                self.stops.push((self.drill.real(), input));
                self.force(Some(input), false);
            }
        }
    }

    pub(super) fn fault(&mut self) {
        self.force(None, false);
    }

    /// Stops the pulses: by an input, by the emergency stop, or because there was nothing to play.
    fn force(&mut self, input: Option<u8>, stop: bool) {
        let mut index = self.adapter.index();
        for (index, pulses) in index.iter_mut().zip(&mut self.rings.pulses) {
            for (_, forward) in pulses.drain(..) {
                *index -= if forward { 1 } else { -1 };
            }
        }
        self.motion = Motion::Rest;
        self.adapter.forced(index, input, stop);
    }
}
