//! Tests of touches shorter than their sensor's filter, reported to the page and by `annulus firmware
//! info`. A touched board must be exactly where the pulses stopped.

use super::bench::{Bench, STEPS};
use super::client::{Running, annulus, output};
use super::shop::{Shop, machine, write_file};
use annulus_core::control::State;
use annulus_core::geometry::Point;
use annulus_core::level::ProbeGrid;
use annulus_core::units::Length;
use annulus_core::wire::{Ask, Status, Tell};
use tempfile::TempDir;

#[test]
fn short_touches_are_reported_by_page_and_firmware_info() {
    let home = TempDir::new().unwrap();
    let (port, file) = (home.path().join("port"), home.path().join("drill.toml"));
    let bench = Bench::new(&port, STEPS);
    let mut machine = machine(&port);
    // X high, on input 1.
    machine.adapter.filters_us[1] = 200;
    write_file(&machine, &file);
    let named = file.display().to_string();
    let home = {
        let serve = annulus(&home, &["serve", "--port", "0", "--no-open", "--machine", &named]);
        let mut bridge = Running::of(serve, home);
        let mut page = bridge.page();
        let mut until = |wanted: &dyn Fn(&Status) -> bool| {
            page.until(|tell| matches!(tell, Tell::Status(status) if wanted(status)));
        };
        until(&|status| status.touches.is_some_and(|touches| touches[1].count == 0));
        for _ in 0..3 {
            bench.touch(1, 150);
        }
        until(&|status| status.touches.is_some_and(|touches| touches[1].count == 3));
        until(&|status| status.state == State::NotHomed && status.inputs & 0b10 == 0);
        bridge.child.kill().unwrap();
        bridge.child.wait().unwrap();
        bridge.home.take().unwrap()
    };
    let named = port.display().to_string();
    let (code, object, said) = output(&home, &["firmware", "info", "--port", &named, "--json"]);
    assert_eq!(code, 0, "{object} {said}");
    let told = &object["short_touches"];
    assert_eq!((told[0]["input"].as_u64(), told[0]["pin"].as_u64()), (Some(1), Some(12)), "{object}");
    assert_eq!((told[0]["count"].as_u64(), told[1].is_null()), (Some(3), true), "{object}");
    assert!((150..160).contains(&told[0]["longest_us"].as_u64().unwrap()), "{object}");
}

/// The tilted board surface in steps from the switches: it rises along X and falls along Y.
fn askew(place: &[i64; 3]) -> bool {
    place[2] <= -300 + place[0] / 25 - place[1] / 40
}

#[test]
fn height_map_through_the_adapter_is_exact_to_one_step() {
    let mut shop = Shop::homed_over(askew);
    let (low, high) = (Point::from_mm(0.5, 0.5), Point::from_mm(3.5, 2.5));
    let grid = ProbeGrid { low, high, columns: 2, rows: 2, margin: Length::ZERO };
    let job = "0".repeat(64);
    shop.page.ask(&Ask::Survey { grid, job, clear_um: 300, depth_um: 1_000, now_s: 1_764_000_000 });
    let told =
        shop.page.until(|tell| matches!(tell, Tell::HeightMap(map) if map.grid.is_some() && !map.goes));
    let Tell::HeightMap(map) = told else { panic!("{told:?}") };
    let status = shop.until(|status| status.state == State::Ready);
    assert_eq!((status.alarm, map.heights.len()), (None, 4));
    let record = shop.agrees();
    assert_eq!(record.touches.len(), 4, "{:?}", record.touches);
    let (axis_z, surface) = (&shop.machine.z, shop.machine.process.surface);
    for (index, height) in map.heights.iter().enumerate() {
        let place = grid.nth(index);
        let wanted = [(place.x, 0), (place.y, 1)].map(|(at, axis)| {
            shop.rested[axis] + shop.machine.axis(axis).scale.steps(at) + shop.offset[axis]
        });
        let near = |touch: &&([i64; 3], u64)| (0..2).all(|axis| touch.0[axis].abs_diff(wanted[axis]) <= 1);
        let (at, more) = record.touches.iter().find(near).unwrap_or_else(|| panic!("{:?}", record.touches));
        let found = axis_z.scale.length(at[2] - shop.offset[2]) - surface;
        assert_eq!(height.unwrap(), found, "{index}: {at:?}");
        // One step up, which opens the contact.
        assert_eq!(*more, 1, "{index}: no step down after it had closed");
    }
    let lifted = axis_z.scale.length(record.place[2] - shop.offset[2]) - surface;
    assert!(lifted >= Length::from_um(300), "it lifts: {lifted:?}");
}
