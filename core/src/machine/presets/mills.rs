//! Commercial mills with GRBL-family controllers: expected values before the controller reports its numbered
//! settings, and for comparison afterwards.
//!
//! ```text
//! name ─▶ MillProfile ─▶ Machine     for planning: `--machine NAME`, or chosen in the page's settings
//!                └─────▶ compared with `$100`, `$110`, `$120`, `$130`, `$30` of the connected controller
//! ```
//!
//! Machines of one name differ by year and seller; unknown values are not compared.

use super::own::hobby_3018;
use crate::machine::{Axis, DownLimits, Machine, Scale};
use crate::units::Length;

/// A commercial mill. Arrays are in the order X, Y, Z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MillProfile {
    pub name: &'static str,
    pub title: &'static str,
    /// Firmware of the controller; none if it differs between machines of this name.
    pub flavour: Option<&'static str>,
    pub travel_mm: [f64; 3],
    pub steps_per_mm: Option<[f64; 3]>,
    pub mm_per_min: Option<[f64; 3]>,
    pub mm_per_s2: Option<[f64; 3]>,
    pub rpm: Option<f64>,
}

/// Key that stores the user's choice of a mill; not a machine setting.
pub const MILL_KEY: &str = "controller.mill";

/// 2 mm lead screws, 1/8 steps.
const SCREW_2_MM: Option<[f64; 3]> = Some([800.0; 3]);
/// Belts with 20-tooth pulleys, 1/8 steps.
const BELT_40_MM: Option<[f64; 3]> = Some([40.0; 3]);

pub const MILLS: [MillProfile; 6] = [
    MillProfile {
        name: "3018",
        title: "3018 router",
        flavour: None,
        travel_mm: [300.0, 180.0, 45.0],
        steps_per_mm: SCREW_2_MM,
        // Differs between sellers.
        mm_per_min: None,
        mm_per_s2: None,
        rpm: None,
    },
    MillProfile {
        name: "genmitsu-3018-pro",
        title: "Genmitsu 3018-PRO",
        flavour: Some("GRBL"),
        travel_mm: [300.0, 180.0, 45.0],
        steps_per_mm: SCREW_2_MM,
        mm_per_min: Some([1_000.0, 1_000.0, 800.0]),
        mm_per_s2: Some([30.0; 3]),
        rpm: Some(10_000.0),
    },
    MillProfile {
        name: "genmitsu-4040-pro",
        title: "Genmitsu 4040-PRO",
        flavour: Some("GRBL"),
        travel_mm: [400.0, 400.0, 78.0],
        steps_per_mm: None,
        mm_per_min: None,
        mm_per_s2: None,
        rpm: Some(10_000.0),
    },
    MillProfile {
        name: "shapeoko-3",
        title: "Shapeoko 3",
        flavour: Some("GRBL"),
        travel_mm: [425.0, 465.0, 80.0],
        steps_per_mm: BELT_40_MM,
        mm_per_min: Some([5_000.0; 3]),
        mm_per_s2: Some([400.0; 3]),
        // The router has its own speed dial.
        rpm: None,
    },
    MillProfile {
        name: "shapeoko-3-xxl",
        title: "Shapeoko 3 XXL",
        flavour: Some("GRBL"),
        travel_mm: [850.0, 850.0, 80.0],
        steps_per_mm: BELT_40_MM,
        mm_per_min: Some([5_000.0; 3]),
        mm_per_s2: Some([400.0; 3]),
        rpm: None,
    },
    MillProfile {
        name: "fluidnc-3018",
        title: "3018 with a FluidNC board",
        flavour: Some("FluidNC"),
        travel_mm: [300.0, 180.0, 45.0],
        // Depends on the driver settings in the controller's own file.
        steps_per_mm: None,
        mm_per_min: None,
        mm_per_s2: None,
        rpm: None,
    },
];

pub fn mill(name: &str) -> Option<&'static MillProfile> {
    MILLS.iter().find(|mill| mill.name == name)
}

impl MillProfile {
    /// The mill as a machine for planning; unknown values are those of a 3018.
    pub fn machine(&self) -> Machine {
        let base = hobby_3018();
        let axis = |index: usize, axis: &Axis| {
            let travel = Length::from_mm(self.travel_mm[index]);
            let (min, max) = if index == 2 { (-travel, Length::ZERO) } else { (Length::ZERO, travel) };
            let speed = self.mm_per_min.map_or(axis.max_speed_mm_per_s, |most| most[index] / 60.0);
            Axis {
                scale: self.steps_per_mm.map_or(axis.scale, |steps| Scale::per_mm(steps[index])),
                min,
                max,
                max_speed_mm_per_s: speed,
                max_acceleration_mm_per_s2: self
                    .mm_per_s2
                    .map_or(axis.max_acceleration_mm_per_s2, |most| most[index]),
                home_search: travel + Length::from_mm(if index == 2 { 15.0 } else { 30.0 }),
                ..axis.clone()
            }
        };
        let (x, y, z) = (axis(0, &base.x), axis(1, &base.y), axis(2, &base.z));
        let down = DownLimits {
            max_speed_mm_per_s: z.max_speed_mm_per_s,
            max_acceleration_mm_per_s2: z.max_acceleration_mm_per_s2,
            ..base.down
        };
        let mut process = base.process.clone();
        process.surface = Length::from_mm(-(self.travel_mm[2] * 0.6).min(30.0));
        if let Some(rpm) = self.rpm {
            (process.max_rpm, process.spindle_rpm) = (rpm as u32, process.spindle_rpm.min(rpm as u32));
        }
        let description = format!("{} with its own controller.", self.title);
        Machine { name: self.title.to_owned(), description, x, y, z, down, process, ..base }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{preset, preset_words, validate};

    #[test]
    fn every_mill_is_a_valid_named_preset() {
        for mill in &MILLS {
            let machine = mill.machine();
            assert_eq!(validate(&machine), [], "{}", mill.name);
            let named = preset(mill.name).unwrap();
            assert_eq!((&named.x, &named.y, &named.z), (&machine.x, &machine.y, &machine.z), "{}", mill.name);
            assert!(preset_words().any(|word| word == mill.name), "{}", mill.name);
            let travel = |axis: &Axis| (axis.max - axis.min).mm();
            assert_eq!([&machine.x, &machine.y, &machine.z].map(travel), mill.travel_mm, "{}", mill.name);
        }
    }
}
