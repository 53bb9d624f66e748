//! Touches of a sensor that are shorter than its filter: told to the page, and by `annulus firmware info`.

use super::bench::{Bench, STEPS};
use super::client::{Running, annulus, output};
use super::shop::{machine, write_file};
use annulus_core::control::State;
use annulus_core::wire::{Status, Tell};
use tempfile::TempDir;

#[test]
fn short_touches_are_told_to_the_page_and_by_firmware_info() {
    let home = TempDir::new().unwrap();
    let (port, file) = (home.path().join("port"), home.path().join("drill.toml"));
    let bench = Bench::new(&port, STEPS);
    let mut machine = machine(&port);
    // X high, which is at input 1.
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
