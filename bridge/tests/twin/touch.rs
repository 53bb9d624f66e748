//! A board that lies askew is touched through the bytes of a card: the map is what the board is within two steps of where the contact
//! closed, and so are its height and its corner (N17). The inputs are looked at with every step: what closes behind one is seen with the next.

use super::{Bench, SURFACE_MM, number};
use crate::server::client::in_peace;
use annulus_core::geometry::Point;
use annulus_core::level::ProbeGrid;
use annulus_core::machine::Value;
use annulus_core::units::Length;
use annulus_core::virtual_drill::{Faults, UnevenBoard};
use annulus_core::wire::{Ask, Tell};

/// It rises along X and falls along Y.
const ASKEW: UnevenBoard =
    UnevenBoard { bow_mm: 0.0, tilt_slope: [0.05, -0.03], step_mm: 0.0, step_at_mm: 0.0 };
/// So many steps may come between the contact and the stop.
const LATE: i64 = 2;
const CLEAR_UM: u32 = 600;
/// Steps of the machine.
const STEPS_MM: [f64; 3] = [0.1, 0.1, 0.025];

fn askew() -> Faults {
    Faults { uneven: Some(ASKEW), ..Faults::default() }
}

/// Finer along Z: a bit that stands still breaks where it goes 50 µm into the copper.
fn fine() -> Vec<(&'static str, Value)> {
    let slow = ["z.max_speed", "z.home_speed", "motion.down_speed", "stroke.feed"];
    let scale = ("z.scale", number(1.0 / STEPS_MM[2]));
    slow.map(|key| (key, number(4.0))).into_iter().chain([scale]).collect()
}

fn grid() -> ProbeGrid {
    let (low, high) = (Point::from_mm(1.0, 1.0), Point::from_mm(9.0, 7.0));
    ProbeGrid { low, high, columns: 2, rows: 2, margin: Length::ZERO }
}

/// How far that is along an axis, mm.
fn late(axis: usize) -> f64 {
    LATE as f64 * STEPS_MM[axis] + 1e-9
}

impl Bench {
    fn survey(&mut self) {
        let (grid, job) = (grid(), "0".repeat(64));
        self.page.ask(&Ask::Survey { grid, job, clear_um: CLEAR_UM, depth_um: 2_000, now_s: 1_764_000_000 });
        self.begins();
    }

    /// What the sensor closed at last, in machine steps, after the tip went no further.
    fn touched(&self) -> [i64; 3] {
        let offset = self.offset();
        let (place, further) = *self.seen().touches.last().unwrap();
        assert!(further <= LATE, "{further} steps after that at which it closed");
        std::array::from_fn(|axis| place[axis] + offset[axis])
    }

    fn surface_mm(&self) -> f64 {
        let told = self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Machine { settings, .. } => {
                settings.iter().find(|(key, _)| key == "stroke.surface").map(|(_, value)| value.clone())
            }
            _ => None,
        });
        let Some(Value::Number(mm)) = told else { panic!("{told:?}") };
        mm
    }
}

#[test]
fn a_board_is_touched_through_a_card_and_the_map_is_what_it_is() {
    in_peace(|| {
        let mut bench = Bench::new(&fine(), askew());
        bench.ready([0, 0]);
        bench.survey();
        assert_eq!(bench.rests(), None);
        let report = bench.heard.iter().rev().find_map(|tell| match tell {
            Tell::HeightMap(report) if report.heights.iter().all(Option::is_some) => Some(report.clone()),
            _ => None,
        });
        let (report, status, offset) = (report.unwrap(), bench.status.clone().unwrap(), bench.offset());
        let zero = status.zero_mm.unwrap();
        let touches = bench.seen().touches.clone();
        assert_eq!((report.goes, report.heights.len(), touches.len()), (false, 4, 4), "{touches:?}");
        for (index, height) in report.heights.iter().enumerate() {
            let place = grid().nth(index);
            let [x, y] = [place.x.mm() + zero[0], place.y.mm() + zero[1]];
            let at = |steps: i64, axis: usize| (steps + offset[axis]) as f64 * STEPS_MM[axis];
            let near = |touch: &&([i64; 3], i64)| {
                let is_there = |axis: usize, mm: f64| (at(touch.0[axis], axis) - mm).abs() < STEPS_MM[axis];
                is_there(0, x) && is_there(1, y)
            };
            let (touch, further) = touches.iter().find(near).unwrap_or_else(|| panic!("{index} {touches:?}"));
            let mm = height.unwrap().mm();
            let (late_mm, lies_mm) = (at(touch[2], 2) - SURFACE_MM - mm, ASKEW.raised_mm(x, y));
            println!(
                "{index}: {mm} mm, closed {late_mm:.3} mm before, {further} steps went on; it lies at {lies_mm:.3}"
            );
            assert!(late_mm.abs() < late(2) && *further <= LATE, "{index}: {touch:?} {offset:?}");
            assert!((mm - lies_mm).abs() < late(2) + 1.6 * STEPS_MM[2], "{index}: as the board lies");
        }
        let highest = report.heights.iter().flatten().map(|height| height.mm()).fold(0.0, f64::max);
        assert!(
            status.work_mm[2] >= highest + f64::from(CLEAR_UM) * 1e-3 - STEPS_MM[2],
            "it lifts {status:?}"
        );
        height_and_corner(&mut bench);
    });
}

fn height_and_corner(bench: &mut Bench) {
    bench.page.ask(&Ask::ForgetHeightMap);
    bench.page.ask(&Ask::Probe { depth_um: 5_000, plate_um: 0 });
    bench.begins();
    assert_eq!(bench.rests(), None);
    let touched = bench.touched();
    assert!((bench.surface_mm() - touched[2] as f64 * STEPS_MM[2]).abs() < late(2), "{touched:?}");
    // The corner where the numbers begin: beside the board along one axis, over it along the other.
    for axis in 0..2_usize {
        let mm = |bench: &Bench, axis: usize| bench.status.as_ref().unwrap().machine_mm[axis];
        let um = |way: f64| (way * 1e3).round() as i32;
        bench.by_hand(2, um(-1.0 - mm(bench, 2)));
        bench.by_hand(1 - axis as u8, um(5.0 - mm(bench, 1 - axis)));
        bench.by_hand(axis as u8, um(-mm(bench, axis)));
        bench.by_hand(2, um(SURFACE_MM - 0.5 - mm(bench, 2)));
        bench.page.ask(&Ask::Edge { axis: axis as u8, up: true, reach_um: 2_000, tool_um: 800 });
        bench.begins();
        assert_eq!(bench.rests(), None);
        let (edge, status) = (bench.touched()[axis] as f64 * STEPS_MM[axis], bench.status.clone().unwrap());
        assert!(
            (status.zero_mm.unwrap()[axis] - (edge + 0.4)).abs() < late(axis),
            "{axis}: {edge} {status:?}"
        );
        assert!((edge - 0.2).abs() < 1.5 * STEPS_MM[axis], "{axis}: where the board ends {edge}");
        assert!(mm(bench, axis) < edge, "it stands off the edge");
    }
}
