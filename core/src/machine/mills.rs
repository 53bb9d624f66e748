//! Mills with a controller of the GRBL family as they are sold: what is expected of one before it says anything of itself, and compared
//! with its numbered settings once it does.
//!
//! ```text
//! name ─▶ MillProfile ─▶ Machine     to plan for: `--machine NAME`, or chosen in the page's settings
//!                └─────▶ compared with `$100`, `$110`, `$120`, `$130`, `$30` of the controller that is there
//! ```
//!
//! Machines of one name differ by year and by shop: what is not known of one is not compared. Goes out: plain data and complete
//! [`Machine`]s. Knows no controller.

use super::{Axis, DownLimits, Machine, Scale, hobby_3018};
use crate::units::Length;

/// A mill as it is sold. Axes are X, Y, Z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MillProfile {
    /// What it is called by on the command line.
    pub name: &'static str,
    /// Its name for people.
    pub title: &'static str,
    /// The firmware that its board runs, where all of them run the same.
    pub flavour: Option<&'static str>,
    /// Travel.
    pub travel_mm: [f64; 3],
    /// Steps in a millimetre.
    pub steps_per_mm: Option<[f64; 3]>,
    /// Fastest of each axis.
    pub mm_per_min: Option<[f64; 3]>,
    /// Acceleration of each axis.
    pub mm_per_s2: Option<[f64; 3]>,
    /// Fastest of the spindle, where the controller sets its speed.
    pub rpm: Option<f64>,
}

/// The key under which the name of the mill is set that a controller is said to be; no setting of a machine.
pub const MILL_KEY: &str = "controller.mill";

/// Screws of 2 mm a turn with eighths of steps.
const SCREW_2_MM: Option<[f64; 3]> = Some([800.0; 3]);
/// Belts with a pulley of 20 teeth, eighths of steps.
const BELT_40_MM: Option<[f64; 3]> = Some([40.0; 3]);

/// All of them.
pub const MILLS: [MillProfile; 6] = [
    MillProfile {
        name: "3018",
        title: "3018 router",
        flavour: None,
        travel_mm: [300.0, 180.0, 45.0],
        steps_per_mm: SCREW_2_MM,
        // From shop to shop another one.
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
        // Its router has a wheel of its own.
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
        // By the board's own file: as many as its drivers are set to.
        steps_per_mm: None,
        mm_per_min: None,
        mm_per_s2: None,
        rpm: None,
    },
];

/// The mill called `name`.
pub fn mill(name: &str) -> Option<&'static MillProfile> {
    MILLS.iter().find(|mill| mill.name == name)
}

impl MillProfile {
    /// The same as a machine to plan for; what is not known of it is as on a 3018.
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
    fn every_mill_is_a_machine_that_can_be_planned_for_and_named() {
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
