//! Clamp, presser foot and magazine of the virtual drill, as they are: a clamp that opens lets go of the tool wherever it is.
//!
//! ```text
//! output  ____██████████████______      a cylinder is there when 0.6 of its time is over
//! clamp   ________██████████████__      open over an empty place at its height: the tool stands there; elsewhere it falls
//! ```
//!
//! What must not be breaks the tool and is counted: two tools in one place, a closed clamp or a tool pushed onto another one, a clamp that
//! opens while the spindle turns, a head that goes sideways among the places.
//!
//! Comes in: outputs, where the head really is, ticks. Goes out: inputs, which tool the spindle holds. Machine steps. Does not know the
//! steps of a change, nor what anybody believes.

use crate::job::Input;
use crate::machine::Machine;
use crate::magazine::{Held, StockedTool, ToolStock};

/// Share of its time after which a cylinder is there.
const ARRIVES_SHARE: f64 = 0.6;

/// A head this near to a place, in mm, stands over it.
const OVER_MM: f64 = 0.2;

/// A tool stands in its place this far, in mm, over the height of the magazine and below it.
const STANDS_MM: f64 = 0.2;

/// The head is among the places this far, in mm, over their height.
const AMONG_MM: f64 = 2.0;

/// A cylinder with an output.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cylinder {
    /// Its output; none where there is no such cylinder.
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

    /// Whether it arrives just now.
    fn arrives(&mut self, tick: u64) -> bool {
        let there = self.is_out != self.wanted && tick >= self.since + self.ticks;
        if there {
            self.is_out = self.wanted;
        }
        there
    }
}

/// Where the head really is: X, Y and Z in steps, and whether the spindle turns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Head {
    pub(super) at: [i64; 3],
    pub(super) turns: bool,
}

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Happened {
    /// Nothing.
    Nothing,
    /// The spindle holds another tool, or none.
    Held,
    /// Something broke.
    Crashed,
}

/// All of it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Changer {
    clamp: Cylinder,
    foot: Cylinder,
    /// Where the places are, X and Y.
    places: Vec<[i64; 2]>,
    height: i64,
    steps_per_mm: [f64; 3],
    tools: Vec<Option<StockedTool>>,
    held: Option<StockedTool>,
    /// Where the tool in the spindle was taken from, and it has not left it yet.
    fetched: Option<usize>,
    /// The clamp does not move any more.
    pub(super) stuck: bool,
    /// The next tool that is fetched falls out of the spindle.
    pub(super) drops: bool,
    /// Something lies in the place of the next tool that is fetched.
    pub(super) occupied: bool,
    /// There is no air.
    pub(super) no_air: bool,
    /// The cover is open.
    pub(super) open: bool,
}

impl Changer {
    /// That of `machine`, empty.
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

    /// Whether the spindle's tool comes from a magazine.
    pub(super) fn changes(&self) -> bool {
        self.clamp.output.is_some()
    }

    /// The tool in the spindle.
    pub(super) fn held(&self) -> Option<&StockedTool> {
        self.held.as_ref()
    }

    /// The tools in the places.
    pub(super) fn lie(&self) -> &[Option<StockedTool>] {
        &self.tools
    }

    /// The tools lie as a person says.
    pub(super) fn lay(&mut self, stock: &ToolStock) {
        let count = self.places.len();
        self.tools = stock.places.iter().take(count).cloned().collect();
        self.tools.resize(count, None);
        self.fetched = None;
        self.held = match &stock.spindle {
            Held::Tool { tool, .. } => Some(tool.clone()),
            Held::Nothing => None,
            // What nobody knows stands where it stood.
            Held::Unknown => stock.change.as_ref().map(|change| change.uncertain().0.clone()),
        };
        let held = self.held.as_ref().map(|tool| tool.number);
        self.tools
            .iter_mut()
            .filter(|lies| lies.as_ref().map(|tool| tool.number) == held)
            .for_each(|lies| *lies = None);
    }

    /// An output is switched.
    pub(super) fn output(&mut self, tick: u64, place: u8, on: bool) {
        for cylinder in [&mut self.clamp, &mut self.foot] {
            if cylinder.output == Some(place) && !self.no_air {
                cylinder.switch(tick, on);
            }
        }
    }

    /// Every output is off.
    pub(super) fn safe(&mut self) {
        let tick = self.clamp.since.max(self.foot.since);
        [&mut self.clamp, &mut self.foot].into_iter().for_each(|cylinder| cylinder.switch(tick, false));
    }

    fn near(&self, axis: usize, steps: i64, mm: f64) -> bool {
        steps.unsigned_abs() as f64 <= mm * self.steps_per_mm.get(axis).copied().unwrap_or(1.0).abs()
    }

    /// The place over which the head stands.
    fn over(&self, at: [i64; 3], mm: f64) -> Option<usize> {
        self.places.iter().position(|[x, y]| self.near(0, at[0] - x, mm) && self.near(1, at[1] - y, mm))
    }

    /// Time has passed.
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
            // It falls, or onto another one.
            _ => Happened::Crashed,
        }
    }

    /// The head made a step along `axis`, down where `down`.
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

    /// The head is above the places: what was fetched has left its place, and then the head leaves it too.
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

    /// What its sensors say.
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
