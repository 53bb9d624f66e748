//! The stock: the tool in each slot of the magazine, the tool in the spindle, and a stopped change.
//!
//! ```text
//! slots     1: T1 drill 0.8   2: –   3: T3 drill 1.2        slot 2 belongs to the tool in the spindle
//! spindle   T2 drill 1.0, from slot 2
//! ```
//!
//! A tool is in one location only. Slots are counted from 0 in code, from 1 on screen.

use super::ChangeStep;
use crate::diagnostic::Diagnostic;
use crate::job::{Bit, Input};
use crate::machine::{MOST_PLACES, Machine, ToolWear, tool_of};
use crate::{code, error};
use serde::{Deserialize, Serialize};

const LONGEST_NAME: usize = 60;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StockedTool {
    /// Unique tool number.
    pub number: u32,
    pub bit: Bit,
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Held {
    /// Unknown: the user must check.
    #[default]
    Unknown,
    Nothing,
    Tool {
        tool: StockedTool,
        /// Slot where the tool belongs; none if the user inserted it.
        place: Option<u8>,
    },
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Unfinished {
    /// The current step, or the one at which the change stopped.
    pub step: ChangeStep,
    /// Tool to put back, and its slot.
    pub old: Option<(StockedTool, u8)>,
    /// Tool to fetch, and its slot.
    pub new: (StockedTool, u8),
    /// Sensors contradict the stock, so only the user can state where the tool is.
    #[serde(default)]
    pub is_lost: bool,
}

/// Location of the tool after a change stopped, as the user sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Seen {
    InSpindle,
    /// The spindle is empty, and the tool is in its slot.
    InPlace,
    /// The spindle is empty, and the tool was removed from the machine.
    TakenAway,
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToolStock {
    pub places: Vec<Option<StockedTool>>,
    pub spindle: Held,
    pub change: Option<Unfinished>,
}

impl ToolStock {
    pub fn lies(&self, place: u8) -> Option<&StockedTool> {
        self.places.get(usize::from(place))?.as_ref()
    }

    /// The first slot with a tool like `bit`.
    pub fn place_of(&self, bit: &Bit) -> Option<u8> {
        let like = |tool: &Option<StockedTool>| tool.as_ref().is_some_and(|tool| tool.bit.is_same_tool(bit));
        self.places.iter().position(like).and_then(|place| u8::try_from(place).ok())
    }

    /// True if the spindle holds a tool like `bit`.
    pub fn holds(&self, bit: &Bit) -> bool {
        matches!(&self.spindle, Held::Tool { tool, .. } if tool.bit.is_same_tool(bit))
    }

    pub fn has(&self, bit: &Bit) -> bool {
        self.holds(bit) || self.place_of(bit).is_some()
    }

    /// Slot for the tool in the spindle: its own if that is empty, else the first empty slot.
    pub fn way_back(&self, belongs: Option<u8>) -> Option<u8> {
        let is_free = |place: &u8| self.places.get(usize::from(*place)) == Some(&None);
        let free = || (0..self.places.len()).filter_map(|place| u8::try_from(place).ok()).find(is_free);
        belongs.filter(is_free).or_else(free)
    }

    pub(super) fn lay(&mut self, place: u8, tool: Option<StockedTool>) {
        if let Some(lies) = self.places.get_mut(usize::from(place)) {
            *lies = tool;
        }
    }

    /// The stock as the user states it. Fails if the slots don't match `machine` or a tool appears twice. A
    /// stopped change is forgotten.
    pub fn reported(
        places: Vec<Option<StockedTool>>,
        spindle: Held,
        machine: &Machine,
    ) -> Result<Self, Diagnostic> {
        let most = machine.magazine.places().min(MOST_PLACES);
        let refuse = |code: &str| Diagnostic::error(code);
        if places.len() > most {
            return Err(refuse(code!("magazine.too_many_places"))
                .with("places", places.len())
                .with("most", most));
        }
        let held = if let Held::Tool { tool, .. } = &spindle { Some(tool) } else { None };
        let tools: Vec<&StockedTool> = places.iter().flatten().chain(held).collect();
        for (at, tool) in tools.iter().enumerate() {
            if tools.iter().take(at).any(|other| other.number == tool.number) {
                return Err(refuse(code!("magazine.tool_twice")).with("number", tool.number));
            }
            if tool.bit.name.chars().count() > LONGEST_NAME || tool.bit.diameter.nm() <= 0 {
                return Err(refuse(code!("magazine.no_such_bit")).with("number", tool.number));
            }
        }
        let mut stock = Self { places, spindle, change: None };
        stock.places.resize(most, None);
        Ok(stock)
    }

    /// Updates the stock after a change stopped and the axes are at rest. `told` is the set of inputs that
    /// the machine has. `is_over_place` is true if the spindle is over the tool's slot. If the sensors don't
    /// decide what the spindle holds, it stays `Unknown`.
    pub fn settle(&mut self, told: u32, inputs: u32, is_over_place: bool) {
        let Some(change) = self.change.clone() else { return };
        let says = |input: Input| (told & input.bit() != 0).then_some(inputs & input.bit() != 0);
        let held = says(Input::ToolHeld);
        let is_gone = is_over_place && says(Input::PlaceTaken) == Some(false);
        let contradicts = match &self.spindle {
            Held::Tool { .. } => held == Some(false),
            Held::Nothing => held == Some(true),
            Held::Unknown => held == Some(false) && is_gone,
        };
        if contradicts {
            // A tool vanished, or one appeared. Its location can't be inferred from there.
            self.spindle = Held::Unknown;
            self.change = Some(Unfinished { is_lost: true, ..change });
            return;
        }
        match &self.spindle {
            Held::Tool { .. } | Held::Nothing => {}
            Held::Unknown if change.is_lost => {}
            Held::Unknown => match held {
                // In an open clamp, the tool may still fall.
                Some(true) if says(Input::ClampOpen) == Some(false) => self.see(&change, Seen::InSpindle),
                Some(false) => self.see(&change, Seen::InPlace),
                _ => {}
            },
        }
    }

    /// Records that the user opens the clamp, after a change stopped or while a worn tool waits for a new
    /// one. The spindle's contents stay unknown until the user states them. Fails if no slot could take the
    /// tool back.
    pub fn opens_by_hand(&mut self) -> Result<(), Diagnostic> {
        let change = match (&self.change, &self.spindle) {
            (_, Held::Nothing) | (None, Held::Unknown) => return Ok(()),
            (Some(change), _) => Unfinished { is_lost: true, ..change.clone() },
            (None, Held::Tool { tool, place }) => {
                let no_room = || error!("magazine.no_room", number = tool.number);
                let new = (tool.clone(), self.way_back(*place).ok_or_else(no_room)?);
                Unfinished { step: ChangeStep::CheckTaken, old: None, new, is_lost: true }
            }
        };
        (self.spindle, self.change) = (Held::Unknown, Some(change));
        Ok(())
    }

    /// Ticks to wait before the spindle may rise. A moving clamp must finish first, or its tool would fall.
    pub fn wait_before_lift_ticks(&self, machine: &Machine) -> u64 {
        let moves =
            [ChangeStep::OpenClamp, ChangeStep::WaitOpen, ChangeStep::CloseClamp, ChangeStep::WaitClosed];
        let clamp = self.change.as_ref().is_some_and(|change| moves.contains(&change.step));
        if clamp { machine.magazine.clamp_ticks() } else { 0 }
    }

    /// Like [`Self::settle`], but from what the user sees.
    pub fn seen(&mut self, seen: Seen) -> Result<(), Diagnostic> {
        let change = self.change.clone().ok_or_else(|| error!("magazine.nothing_stopped"))?;
        self.see(&change, seen);
        self.change = Some(Unfinished { is_lost: false, ..change });
        Ok(())
    }

    fn see(&mut self, change: &Unfinished, seen: Seen) {
        let &(ref tool, place) = change.uncertain();
        let lies = (seen == Seen::InPlace).then(|| tool.clone());
        self.lay(place, lies);
        self.spindle = match seen {
            Seen::InSpindle => Held::Tool { tool: tool.clone(), place: Some(place) },
            Seen::InPlace | Seen::TakenAway => Held::Nothing,
        };
    }

    /// Step at which the stopped change resumes; none if the user must check the tool first.
    pub fn goes_on_with(&self) -> Option<ChangeStep> {
        let change = self.change.as_ref()?;
        match &self.spindle {
            Held::Unknown => None,
            Held::Nothing => Some(ChangeStep::RaiseBeforeNew),
            Held::Tool { tool, .. } if *tool == change.new.0 => Some(ChangeStep::GoOn),
            Held::Tool { .. } => Some(ChangeStep::RaiseZ),
        }
    }
}

/// The tools for `bits`, one per slot in order of use, without duplicates. Numbers come from the tool list of
/// `machine`; other tools get the lowest free number. `known` is the recorded wear.
pub fn laid_out(bits: &[Bit], machine: &Machine, known: &[ToolWear]) -> Vec<Option<StockedTool>> {
    let mut tools: Vec<StockedTool> = Vec::new();
    for bit in bits {
        if tools.iter().any(|tool| tool.bit.is_same_tool(bit)) {
            continue;
        }
        let own = tool_of(&machine.rack, bit, &machine.name, known).map(|tool| tool.number);
        let is_taken = |number: &u32| {
            machine.rack.iter().any(|tool| tool.number == *number)
                || tools.iter().any(|tool| tool.number == *number)
        };
        let number = own.or_else(|| (1..).find(|number| !is_taken(number))).unwrap_or_default();
        tools.push(StockedTool { number, bit: bit.clone() });
    }
    tools.into_iter().map(Some).collect()
}

impl Unfinished {
    /// The tool in doubt and its slot: the old one until it is put back, then the new one.
    pub fn uncertain(&self) -> &(StockedTool, u8) {
        match &self.old {
            Some(old) if self.step <= ChangeStep::RaiseFromOld => old,
            _ => &self.new,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Cutter;
    use crate::machine::{RackTool, virtual_drill};
    use crate::units::Length;

    pub(crate) fn tool(number: u32) -> StockedTool {
        let diameter = Length::from_um(500 + 100 * i64::from(number));
        StockedTool {
            number,
            bit: Bit {
                diameter,
                name: format!("{number}"),
                cutter: Cutter::Drill,
                handling: Default::default(),
            },
        }
    }

    fn held(number: u32, place: u8) -> Held {
        Held::Tool { tool: tool(number), place: Some(place) }
    }

    #[test]
    fn reported_stock_is_accepted_if_every_tool_is_once() {
        let machine = virtual_drill();
        let told = |numbers: &[u32], spindle| {
            let places = numbers.iter().map(|number| (*number > 0).then(|| tool(*number))).collect();
            ToolStock::reported(places, spindle, &machine)
                .map(|stock| stock.places.len())
                .map_err(|why| why.code)
        };
        let code = |code: &str| Err(code.to_owned());
        assert_eq!(told(&[1, 0, 2], held(3, 1)), Ok(8));
        assert_eq!(told(&[1, 0, 1], Held::Nothing), code("magazine.tool_twice"));
        assert_eq!(told(&[1, 0, 2], held(2, 1)), code("magazine.tool_twice"));
        assert_eq!(told(&[0; 9], Held::Nothing), code("magazine.too_many_places"));
        let mut nothing = tool(4);
        nothing.bit.diameter = Length::ZERO;
        let found = ToolStock::reported(vec![Some(nothing)], Held::Nothing, &machine).unwrap_err();
        assert_eq!(found.code, "magazine.no_such_bit");
    }

    #[test]
    fn job_tools_get_the_numbers_of_the_tool_list() {
        let lines = ["T2 drill 0.6", "T6 drill 0.8 life 3", "T7 drill 0.8 life 9", "T1 mill 2"];
        let rack = lines.map(|line| RackTool::read(line).unwrap()).to_vec();
        let machine = Machine { rack, ..virtual_drill() };
        let strange = RackTool::read("T99 vee 3.175 angle 30").unwrap();
        let other = RackTool::read("T98 drill 1.1").unwrap();
        let order =
            [&machine.rack[1], &strange, &machine.rack[3], &machine.rack[1], &other, &machine.rack[0]];
        let bits = order.map(RackTool::bit);
        let numbers = |known: &[ToolWear]| -> Vec<u32> {
            laid_out(&bits, &machine, known).into_iter().flatten().map(|tool| tool.number).collect()
        };
        assert_eq!(numbers(&[]), [6, 3, 1, 4, 2]);
        let worn = ToolWear { hits: 3, ..ToolWear::new(&machine.name, &machine.rack[1]) };
        assert_eq!(numbers(&[worn]), [7, 3, 1, 4, 2], "its life is over: the next one alike");
        let places = laid_out(&bits, &machine, &[]);
        assert!(ToolStock::reported(places, Held::Nothing, &machine).is_ok());
    }

    #[test]
    fn tool_returns_to_its_slot_or_the_first_empty_one() {
        let places = vec![Some(tool(1)), None, None];
        let stock = ToolStock { places, ..ToolStock::default() };
        let rows = [(Some(2), Some(2)), (Some(0), Some(1)), (None, Some(1)), (Some(9), Some(1))];
        for (belongs, back) in rows {
            assert_eq!(stock.way_back(belongs), back, "{belongs:?}");
        }
        let full = ToolStock { places: vec![Some(tool(1))], ..ToolStock::default() };
        assert_eq!(full.way_back(None), None);
    }

    #[test]
    fn sensors_decide_what_the_spindle_holds_after_a_stop() {
        let [hand, open, place] = [Input::ToolHeld, Input::ClampOpen, Input::PlaceTaken].map(Input::bit);
        let all = hand | open | place;
        let unknown = Held::Unknown;
        // (believed, step, inputs that exist, inputs that are on, over the slot, expected spindle, expected
        // slots 1 and 2)
        type Row = (Held, ChangeStep, u32, u32, bool, Held, [u32; 2]);
        let rows: [Row; 15] = [
            (held(1, 0), ChangeStep::YToOld, all, hand, false, held(1, 0), [0, 2]),
            (held(1, 0), ChangeStep::YToOld, all, 0, false, unknown.clone(), [0, 2]),
            (held(1, 0), ChangeStep::YToOld, 0, 0, false, held(1, 0), [0, 2]),
            (unknown.clone(), ChangeStep::OpenClamp, all, hand, true, held(1, 0), [0, 2]),
            (unknown.clone(), ChangeStep::WaitOpen, all, hand | open, true, unknown.clone(), [0, 2]),
            (unknown.clone(), ChangeStep::WaitOpen, all, open | place, true, Held::Nothing, [1, 2]),
            (unknown.clone(), ChangeStep::WaitOpen, all, open, true, unknown.clone(), [0, 2]),
            (unknown.clone(), ChangeStep::WaitOpen, all, open, false, Held::Nothing, [1, 2]),
            (
                unknown.clone(),
                ChangeStep::WaitOpen,
                open | place,
                open | place,
                true,
                unknown.clone(),
                [0, 2],
            ),
            (Held::Nothing, ChangeStep::XToNew, all, open, false, Held::Nothing, [0, 2]),
            (Held::Nothing, ChangeStep::XToNew, all, hand, false, unknown.clone(), [0, 2]),
            (unknown.clone(), ChangeStep::CloseClamp, all, hand, true, held(2, 1), [0, 0]),
            (unknown.clone(), ChangeStep::WaitClosed, all, place, true, Held::Nothing, [0, 2]),
            (unknown.clone(), ChangeStep::RaiseFromNew, all, 0, true, unknown.clone(), [0, 2]),
            (held(2, 1), ChangeStep::PauseAtEnd, all, 0, false, unknown, [0, 2]),
        ];
        for (believed, step, told, inputs, over, known, lie) in rows {
            let change = Unfinished { step, old: Some((tool(1), 0)), new: (tool(2), 1), is_lost: false };
            let mut stock = ToolStock {
                places: vec![None, Some(tool(2))],
                spindle: believed.clone(),
                change: Some(change),
            };
            stock.settle(told, inputs, over);
            // Later readings must not overrule what earlier ones left open.
            let settled = stock.spindle.clone();
            stock.settle(told, inputs, false);
            assert_eq!(stock.spindle, settled, "{step:?} {told:b} {inputs:b}");
            let numbers = [0, 1].map(|place| stock.lies(place).map_or(0, |tool| tool.number));
            assert_eq!((&stock.spindle, numbers), (&known, lie), "{believed:?} {step:?} {told:b} {inputs:b}");
        }
    }

    #[test]
    fn change_continues_from_the_reported_tool_position() {
        let rows = [
            (ChangeStep::WaitOpen, Seen::InSpindle, held(1, 0), [0, 2], ChangeStep::RaiseZ),
            (ChangeStep::WaitOpen, Seen::InPlace, Held::Nothing, [1, 2], ChangeStep::RaiseBeforeNew),
            (ChangeStep::WaitOpen, Seen::TakenAway, Held::Nothing, [0, 2], ChangeStep::RaiseBeforeNew),
            (ChangeStep::WaitClosed, Seen::InSpindle, held(2, 1), [0, 0], ChangeStep::GoOn),
            (ChangeStep::WaitClosed, Seen::InPlace, Held::Nothing, [0, 2], ChangeStep::RaiseBeforeNew),
            (ChangeStep::WaitClosed, Seen::TakenAway, Held::Nothing, [0, 0], ChangeStep::RaiseBeforeNew),
        ];
        for (step, seen, spindle, lie, on) in rows {
            let change = Unfinished { step, old: Some((tool(1), 0)), new: (tool(2), 1), is_lost: false };
            let mut stock =
                ToolStock { places: vec![None, Some(tool(2))], spindle: Held::Unknown, change: Some(change) };
            assert_eq!(stock.goes_on_with(), None);
            stock.seen(seen).unwrap();
            let numbers = [0, 1].map(|place| stock.lies(place).map_or(0, |tool| tool.number));
            assert_eq!((&stock.spindle, numbers), (&spindle, lie), "{step:?} {seen:?}");
            assert_eq!(stock.goes_on_with(), Some(on), "{step:?} {seen:?}");
        }
        assert_eq!(ToolStock::default().seen(Seen::InPlace).unwrap_err().code, "magazine.nothing_stopped");
    }

    #[test]
    fn clamp_opened_by_user_asks_for_the_tool() {
        let stopped = |step| Unfinished { step, old: Some((tool(1), 0)), new: (tool(2), 1), is_lost: false };
        // Believed contents, the step of the stop, and the tool and slot that the user is asked about.
        let rows = [
            (held(1, 0), Some(ChangeStep::YToOld), Some((1, 0))),
            (Held::Unknown, Some(ChangeStep::WaitOpen), Some((1, 0))),
            (held(2, 1), Some(ChangeStep::PauseAtEnd), Some((2, 1))),
            (Held::Nothing, Some(ChangeStep::XToNew), None),
            (held(3, 2), None, Some((3, 2))),
            (Held::Tool { tool: tool(3), place: None }, None, Some((3, 0))),
            (Held::Unknown, None, None),
        ];
        for (believed, step, asked) in rows {
            let mut stock =
                ToolStock { places: vec![None; 3], spindle: believed.clone(), change: step.map(stopped) };
            stock.opens_by_hand().unwrap();
            let doubt = stock.change.clone().filter(|change| change.is_lost);
            let found = doubt.map(|change| (change.uncertain().0.number, change.uncertain().1));
            assert_eq!(found, asked, "{believed:?} {step:?}");
            let known = if asked.is_some() { Held::Unknown } else { believed };
            assert_eq!(stock.spindle, known, "{step:?}");
            // No sensor can know where the user put the tool.
            stock.settle(u32::MAX, 0, false);
            assert_eq!(stock.spindle, known, "{step:?}");
            if asked.is_some() {
                stock.seen(Seen::InSpindle).unwrap();
                let number = asked.map(|(number, _)| number);
                let is_back =
                    matches!(&stock.spindle, Held::Tool { tool, .. } if Some(tool.number) == number);
                assert!(is_back, "{step:?}: {:?}", stock.spindle);
            }
        }
        let mut full = ToolStock { places: vec![Some(tool(1))], spindle: held(2, 0), change: None };
        assert_eq!(full.opens_by_hand().unwrap_err().code, "magazine.no_room");
        assert_eq!(full.spindle, held(2, 0));
    }
}
