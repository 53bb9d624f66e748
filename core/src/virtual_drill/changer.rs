//! Clamp, presser foot and magazine of the virtual drill. A clamp that opens drops its tool, at any position.
//!
//! ```text
//! output  ____██████████████______      a cylinder arrives after 0.6 of its time
//! clamp   ________██████████████__      the tool stays in an empty slot below it, and falls elsewhere
//! ```
//!
//! These crashes break the tool and are counted:
//! - two tools in one slot,
//! - a closed clamp, or a tool, pushed onto another tool,
//! - a clamp that opens while the spindle turns,
//! - a sideways move among the slots.
//!
//! Positions in machine steps.

use crate::job::Input;
use crate::machine::Machine;
use crate::magazine::{Held, StockedTool, ToolStock};

/// Share of its time after which a cylinder arrives.
const ARRIVES_SHARE: f64 = 0.6;

const OVER_MM: f64 = 0.2;

/// Z tolerance of a tool in its slot, over and under the height of the magazine, mm.
const STANDS_MM: f64 = 0.2;

const AMONG_MM: f64 = 2.0;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cylinder {
    /// None if the machine lacks this cylinder.
    output: Option<u8>,
    ticks: u64,
    wanted: bool,
    since: u64,
    is_out: bool,
}

impl Cylinder {
    fn new(output: Option<u8>, ticks: u64) -> Self {
        Self { output, ticks: (ticks as f64 * ARRIVES_SHARE) as u64, ..Self::default() }
    }

    fn switch(&mut self, tick: u64, on: bool) {
        if self.wanted != on {
            (self.wanted, self.since) = (on, tick);
        }
    }

    fn arrives(&mut self, tick: u64) -> bool {
        let there = self.is_out != self.wanted && tick >= self.since + self.ticks;
        if there {
            self.is_out = self.wanted;
        }
        there
    }
}

/// Real position of the spindle: X, Y and Z in steps, and whether it turns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Head {
    pub(super) at: [i64; 3],
    pub(super) turns: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Happened {
    Nothing,
    /// The spindle's tool changed, or it is now empty.
    Held,
    Crashed,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Changer {
    clamp: Cylinder,
    foot: Cylinder,
    places: Vec<[i64; 2]>,
    height: i64,
    steps_per_mm: [f64; 3],
    tools: Vec<Option<StockedTool>>,
    held: Option<StockedTool>,
    /// Slot of the tool in the spindle, until the spindle has left that slot.
    fetched: Option<usize>,
    pub(super) stuck: bool,
    pub(super) drops: bool,
    /// Something occupies the slot of the next fetched tool, after the spindle has left it.
    pub(super) occupied: bool,
    pub(super) no_air: bool,
    pub(super) open: bool,
}

impl Changer {
    pub(super) fn new(machine: &Machine) -> Self {
        let has = machine.has_magazine();
        let magazine = &machine.magazine;
        let clamp = has.then(|| machine.output_place(&magazine.clamp)).flatten();
        let foot = machine.foot.on.then(|| machine.output_place(&machine.foot.output)).flatten();
        let count = if has { magazine.places() } else { 0 };
        let axes = [&machine.x, &machine.y, &machine.z];
        Self {
            clamp: Cylinder::new(clamp, magazine.clamp_ticks()),
            foot: Cylinder::new(foot, machine.foot.ticks()),
            places: (0..count).filter_map(|place| machine.magazine_place(place)).collect(),
            height: machine.z.scale.steps(magazine.height),
            steps_per_mm: axes.map(|axis| axis.scale.steps_per_mm()),
            tools: vec![None; count],
            held: None,
            fetched: None,
            stuck: false,
            drops: false,
            occupied: false,
            no_air: false,
            open: false,
        }
    }

    pub(super) fn changes(&self) -> bool {
        self.clamp.output.is_some()
    }

    pub(super) fn held(&self) -> Option<&StockedTool> {
        self.held.as_ref()
    }

    pub(super) fn lie(&self) -> &[Option<StockedTool>] {
        &self.tools
    }

    /// Arranges the tools as the user stated.
    pub(super) fn lay(&mut self, stock: &ToolStock) {
        let count = self.places.len();
        self.tools = stock.places.iter().take(count).cloned().collect();
        self.tools.resize(count, None);
        self.fetched = None;
        self.held = match &stock.spindle {
            Held::Tool { tool, .. } => Some(tool.clone()),
            Held::Nothing => None,
            // With the location unknown, the drill assumes that the tool in doubt is in the spindle.
            Held::Unknown => stock.change.as_ref().map(|change| change.uncertain().0.clone()),
        };
        // A tool can't be both in the spindle and in a slot.
        let held = self.held.as_ref().map(|tool| tool.number);
        self.tools
            .iter_mut()
            .filter(|lies| lies.as_ref().map(|tool| tool.number) == held)
            .for_each(|lies| *lies = None);
    }

    pub(super) fn output(&mut self, tick: u64, place: u8, on: bool) {
        for cylinder in [&mut self.clamp, &mut self.foot] {
            if cylinder.output == Some(place) && !self.no_air {
                cylinder.switch(tick, on);
            }
        }
    }

    pub(super) fn safe(&mut self) {
        let tick = self.clamp.since.max(self.foot.since);
        [&mut self.clamp, &mut self.foot].into_iter().for_each(|cylinder| cylinder.switch(tick, false));
    }

    fn near(&self, axis: usize, steps: i64, mm: f64) -> bool {
        steps.unsigned_abs() as f64 <= mm * self.steps_per_mm.get(axis).copied().unwrap_or(1.0).abs()
    }

    fn over(&self, at: [i64; 3], mm: f64) -> Option<usize> {
        self.places.iter().position(|[x, y]| self.near(0, at[0] - x, mm) && self.near(1, at[1] - y, mm))
    }

    pub(super) fn attend(&mut self, tick: u64, head: Head) -> Happened {
        self.foot.arrives(tick);
        if self.stuck || !self.clamp.arrives(tick) {
            return Happened::Nothing;
        }
        let stands = self.near(2, head.at[2] - self.height, STANDS_MM);
        let over = self.over(head.at, OVER_MM).filter(|_| stands);
        if !self.clamp.is_out {
            if self.held.is_some() {
                return Happened::Nothing;
            }
            self.held = over.and_then(|place| self.tools.get_mut(place)).and_then(Option::take);
            self.fetched = over.filter(|_| self.held.is_some());
            return if self.held.is_some() { Happened::Held } else { Happened::Nothing };
        }
        let Some(tool) = self.held.take() else { return Happened::Nothing };
        if head.turns {
            return Happened::Crashed;
        }
        match over.and_then(|place| self.tools.get_mut(place)) {
            Some(place) if place.is_none() => {
                *place = Some(tool);
                Happened::Held
            }
            // The tool falls, or lands on another one.
            _ => Happened::Crashed,
        }
    }

    /// Updates the state after a step along `axis`; `down` if Z moved down.
    pub(super) fn moved(&mut self, head: Head, axis: usize, down: bool) -> Happened {
        let is_low = head.at[2] - self.height <= (AMONG_MM * self.steps_per_mm[2].abs()) as i64;
        if self.places.is_empty() || !is_low {
            return self.left(head, axis);
        }
        let over = self.over(head.at, AMONG_MM);
        if axis < 2 {
            return if over.is_some() { Happened::Crashed } else { Happened::Nothing };
        }
        let lies = over.is_some_and(|place| self.tools.get(place).is_some_and(Option::is_some));
        let pushes = self.held.is_some() || !self.clamp.is_out;
        if down && lies && pushes { Happened::Crashed } else { Happened::Nothing }
    }

    /// Injects faults after a fetch, with the spindle above the slots. The tool drops on the way up, or the
    /// slot is occupied once the spindle has left it.
    fn left(&mut self, head: Head, axis: usize) -> Happened {
        let Some(place) = self.fetched else { return Happened::Nothing };
        if axis < 2 && self.over(head.at, AMONG_MM) != Some(place) {
            self.fetched = None;
            if std::mem::take(&mut self.occupied)
                && let (Some(lies), Some(tool)) = (self.tools.get_mut(place), &self.held)
            {
                *lies = Some(StockedTool { number: u32::MAX, bit: tool.bit.clone() });
            }
        } else if axis > 1 && std::mem::take(&mut self.drops) {
            self.held = None;
            return Happened::Held;
        }
        Happened::Nothing
    }

    pub(super) fn inputs(&self, at: [i64; 3]) -> u32 {
        let under = self.over(at, OVER_MM).and_then(|place| self.tools.get(place));
        let rows = [
            (Input::FootDown, self.foot.is_out),
            (Input::ClampOpen, self.clamp.is_out),
            (Input::ToolHeld, self.held.is_some()),
            (Input::PlaceTaken, under.is_some_and(Option::is_some)),
            (Input::CoverOpen, self.open),
            (Input::Air, !self.no_air),
        ];
        rows.into_iter().filter(|(_, on)| *on).fold(0, |inputs, (input, _)| inputs | input.bit())
    }
}
