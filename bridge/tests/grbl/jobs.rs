//! Jobs for the tests, with the holes and cuts that they should make.

use super::firmware::STEPS;
use super::judge::Wanted;
use annulus_core::chance::Chance;

pub(crate) struct Job {
    pub(crate) text: String,
    holes: Vec<[f64; 3]>,
    cuts: Vec<(Vec<[f64; 2]>, f64)>,
    pub(crate) end: [f64; 3],
}

impl Job {
    /// The expected result if the work zero is at these net steps.
    pub(crate) fn wanted(&self, zero: [i64; 3]) -> Wanted {
        let at = |axis: usize, mm: f64| zero[axis] + (mm * STEPS).round() as i64;
        let plane = |place: &[f64; 2]| [at(0, place[0]), at(1, place[1])];
        Wanted {
            holes: self.holes.iter().map(|hole| core::array::from_fn(|axis| at(axis, hole[axis]))).collect(),
            cuts: self.cuts.iter().map(|(path, z)| (path.iter().map(plane).collect(), at(2, *z))).collect(),
        }
    }

    pub(crate) fn end_steps(&self, zero: [i64; 3]) -> [i64; 3] {
        core::array::from_fn(|axis| zero[axis] + (self.end[axis] * STEPS).round() as i64)
    }
}

/// Twelve holes with two drills, and a cut with a third tool: three tool changes, the first at the start.
pub(crate) fn board() -> Job {
    let mut text = "G21 G17 G90 G94\nM5\nG0 Z8\nG0 X0 Y0\n(MSG, put in 0.8 mm)\nM0\nM3 S9000\n".to_owned();
    let (mut holes, depth) = (Vec::new(), -1.7);
    let change = |name: &str| format!("M5\nG0 Z8\nG0 X0 Y0\n(MSG, put in {name})\nM0\nM3 S9000\n");
    for hole in 0..12 {
        if hole == 7 {
            text += &change("1.0 mm");
        }
        let (x, y) = (f64::from(hole % 4) * 3.3, f64::from(hole / 4) * 2.7);
        text += &format!("G0 X{x:.3} Y{y:.3}\nG0 Z0.5\nG1 Z{depth} F600\nG0 Z2\n");
        holes.push([x, y, depth]);
    }
    text += &change("V 30");
    text += "G0 X0 Y12\nG1 Z-0.12 F300\nG1 X6 F1500\nG1 X10 Y16\nG1 Y18\nG0 Z2\nM5\nG0 Z8\nG0 X0 Y0\nM2\n";
    let cuts = vec![(vec![[0.0, 12.0], [6.0, 12.0], [10.0, 16.0], [10.0, 18.0]], -0.12)];
    Job { text, holes, cuts, end: [0.0, 0.0, 8.0] }
}

/// Some 70 lines per toolpath: short lines and arcs in every direction at changing feeds, and holes.
pub(crate) fn winding(toolpaths: u8) -> Job {
    let mut chance = Chance::new(19);
    let mut text = "G21 G17 G90 G94\nG0 Z3\nG0 X0 Y0\nM3 S9000\n".to_owned();
    for toolpath in 0..toolpaths {
        let (mut x, mut y) = (f64::from(toolpath % 7) * 8.0, f64::from(toolpath / 7) * 8.0);
        text += &format!("G0 X{x:.3} Y{y:.3}\nG0 Z0.3\nG1 Z-0.1 F300\n");
        for piece in 0..64 {
            if piece % 16 == 0 {
                text += &format!("G1 F{}\n", [900, 1800, 2700, 3600][chance.below(4)]);
            }
            if piece % 9 == 8 {
                // A half circle, and on from its other end.
                let radius = f64::from(200 + chance.below(600) as u32) / 1e3;
                text += &format!("G{} X{:.3} Y{y:.3} I{radius:.3} J0\n", 2 + piece % 2, x + 2.0 * radius);
                x += 2.0 * radius;
                continue;
            }
            // Anywhere near, and mostly back to the middle.
            let mut aside = |from: f64, middle: f64| {
                let way = (chance.unit() - 0.5) * 1.8 + (middle - from) * 0.3;
                ((from + way) * 1e3).round() / 1e3
            };
            x = aside(x, f64::from(toolpath % 7) * 8.0 + 3.0);
            y = aside(y, f64::from(toolpath / 7) * 8.0 + 3.0);
            text += &format!("G1 X{x:.3} Y{y:.3}\n");
        }
        text += "G0 Z3\n";
    }
    for hole in 0..12 {
        text += &format!("G0 X{} Y40\nG0 Z0.3\nG1 Z-1.6 F300\nG0 Z3\n", hole * 4);
    }
    Job { text: text + "M5\nG0 X1 Y2\nM2\n", holes: Vec::new(), cuts: Vec::new(), end: [1.0, 2.0, 3.0] }
}
