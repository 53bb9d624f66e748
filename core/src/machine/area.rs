//! The working area of a machine as numbers for a drawing: mm, machine coordinates.

use super::{Axis, HomeEnd, Machine};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkArea {
    /// Lowest X, Y and Z.
    pub low_mm: [f64; 3],
    pub high_mm: [f64; 3],
    /// Rest position of homing.
    pub home_mm: [f64; 3],
    /// Z with the tip of Z1 on the board.
    pub surface_mm: f64,
}

impl Machine {
    pub fn work_area(&self) -> WorkArea {
        let axes = [&self.x, &self.y, &self.z];
        WorkArea {
            low_mm: axes.map(|axis| axis.min.mm()),
            high_mm: axes.map(|axis| axis.max.mm()),
            home_mm: axes.map(rest_mm),
            surface_mm: self.process.surface.mm(),
        }
    }
}

fn rest_mm(axis: &Axis) -> f64 {
    match axis.home {
        HomeEnd::Min => (axis.min + axis.home_offset).mm(),
        HomeEnd::Max => (axis.max - axis.home_offset).mm(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Value, apply, presets, virtual_drill};

    #[test]
    fn home_is_at_the_end_to_which_an_axis_homes() {
        let text = |key: &str, word: &str| (key.to_owned(), Value::Text(word.to_owned()));
        let number = |key: &str, value: f64| (key.to_owned(), Value::Number(value));
        let offset = || number("x.home_offset", 2.0);
        let low = apply(&virtual_drill(), &[text("x.home_end", "min"), offset()]).unwrap().work_area();
        let high = apply(&virtual_drill(), &[text("x.home_end", "max"), offset()]).unwrap().work_area();
        assert_eq!(low.home_mm[0], low.low_mm[0] + 2.0);
        assert_eq!(high.home_mm[0], high.high_mm[0] - 2.0);
    }

    #[test]
    fn home_and_surface_are_inside_every_preset() {
        for (name, machine) in presets() {
            let area = machine.work_area();
            let inside = |axis: usize, mm: f64| (area.low_mm[axis]..=area.high_mm[axis]).contains(&mm);
            assert!((0..3).all(|axis| inside(axis, area.home_mm[axis])), "{name}: {area:?}");
            assert!(inside(2, area.surface_mm), "{name}: {area:?}");
        }
    }
}
