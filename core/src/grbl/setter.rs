//! The tool setter: a pin or switch at a fixed machine position.

use serde::{Deserialize, Serialize};

/// Key in the controller's settings for the way to find a tool's length: `board` or `setter`.
pub const LENGTH_KEY: &str = "controller.length";
/// Key for the six numbers of the tool setter ([`ToolSetter::numbers`]).
pub const SETTER_KEY: &str = "controller.setter";

/// A tool setter: mm in machine coordinates, mm/min.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToolSetter {
    /// X and Y.
    pub place_mm: [f64; 2],
    /// Z height where probing starts: no tool may meet the setter at or above it.
    pub from_mm: f64,
    pub depth_mm: f64,
    pub fast_mm_per_min: f64,
    pub slow_mm_per_min: f64,
}

impl ToolSetter {
    pub fn usual(place_mm: [f64; 2], from_mm: f64) -> Self {
        Self { place_mm, from_mm, depth_mm: 40.0, fast_mm_per_min: 150.0, slow_mm_per_min: 25.0 }
    }

    /// X, Y, start height, travel, fast and slow feed.
    pub fn numbers(&self) -> [f64; 6] {
        let [x, y] = self.place_mm;
        [x, y, self.from_mm, self.depth_mm, self.fast_mm_per_min, self.slow_mm_per_min]
    }

    pub fn of_numbers(parts: &[f64]) -> Option<Self> {
        let &[x, y, from_mm, depth_mm, fast_mm_per_min, slow_mm_per_min] = parts else { return None };
        let setter = Self { place_mm: [x, y], from_mm, depth_mm, fast_mm_per_min, slow_mm_per_min };
        setter.is_sound().then_some(setter)
    }

    /// True if the numbers are plausible, regardless of the machine's travel.
    pub fn is_sound(&self) -> bool {
        let [x, y] = self.place_mm;
        let places = [x, y, self.from_mm].iter().all(|mm| mm.is_finite() && libm::fabs(*mm) <= 5_000.0);
        let feeds = [self.fast_mm_per_min, self.slow_mm_per_min];
        places
            && (1.0..=500.0).contains(&self.depth_mm)
            && feeds.iter().all(|feed| (1.0..=1_000.0).contains(feed))
    }
}

/// The owner's choice of how to find a tool's length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToolLengths {
    /// Use the tool setter; if false, touch off each tool on the board.
    pub on_setter: bool,
    /// The tool setter, if its position was entered.
    pub setter: Option<ToolSetter>,
}

impl ToolLengths {
    pub fn in_force(&self) -> Option<ToolSetter> {
        self.setter.filter(|_| self.on_setter)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SetterStep {
    Ready,
    Up,
    Over,
    /// Down to the start height.
    Near,
    /// Down until the input closes.
    Touch,
    Back,
    Again,
    /// Queries the touch position again.
    Same,
    Lift,
    /// Writes the Z zero and reads it back.
    Zero,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_numbers_are_no_tool_setter() {
        let setter = ToolSetter::usual([-180.0, -5.0], -1.0);
        assert_eq!(ToolSetter::of_numbers(&setter.numbers()), Some(setter));
        let rows: [&[f64]; 7] = [
            &[],
            &[-180.0, -5.0, -1.0, 40.0, 150.0],
            &[f64::NAN, -5.0, -1.0, 40.0, 150.0, 25.0],
            &[-180.0, 9_000.0, -1.0, 40.0, 150.0, 25.0],
            &[-180.0, -5.0, -1.0, 0.0, 150.0, 25.0],
            &[-180.0, -5.0, -1.0, 40.0, 0.0, 25.0],
            &[-180.0, -5.0, -1.0, 40.0, 150.0, f64::INFINITY],
        ];
        for numbers in rows {
            assert_eq!(ToolSetter::of_numbers(numbers), None, "{numbers:?}");
        }
    }

    #[test]
    fn tool_setter_off_is_not_in_force() {
        let setter = Some(ToolSetter::usual([-180.0, -5.0], -1.0));
        assert_eq!(ToolLengths { on_setter: false, setter }.in_force(), None);
        assert_eq!(ToolLengths { on_setter: true, setter }.in_force(), setter);
    }
}
