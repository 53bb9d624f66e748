//! Tests of parking on a controller: at the position in the settings, and after a job only if set.

use super::*;

const PLACE_MM: [f64; 3] = [-50.0, -260.0, -1.0];

fn is_parked(status: &Status) -> bool {
    (0..3).all(|axis| (status.machine_mm[axis] - PLACE_MM[axis]).abs() < 0.01)
}

#[test]
fn machine_parks_at_its_configured_position() {
    let word = |word: &str| Value::Text(word.to_owned());
    let set = |rows: &[(&str, Value)]| {
        let changes = rows.iter().map(|(key, value)| ((*key).to_owned(), value.clone()));
        Ask::Configure { changes: changes.collect() }
    };
    // From the lower ends of a travel of 300 mm, as in the settings.
    let low_mm = |bench: &Bench, key: &str| {
        let told = bench.heard.iter().rev().find_map(|tell| match tell {
            Tell::Machine { settings, .. } => settings.iter().find(|(known, _)| known == key),
            _ => None,
        });
        if let Some((_, Value::Number(mm))) = told { *mm } else { panic!("{key}: {told:?}") }
    };
    for (after_job, stops, parks) in [("no", false, false), ("yes", false, true), ("yes", true, false)] {
        let mut board = Automaton::new([-20.0, -30.0, -10.0]);
        // The pull-off distance after homing.
        board.settings.push((27, 1.0));
        let mut bench = Bench::ready_with(&Memory::default(), board);
        let along = |key: &str, axis: usize| Value::Number(low_mm(&bench, key) + 300.0 + PLACE_MM[axis]);
        let apart =
            [("park.at", word("place")), ("park.x", along("x.min", 0)), ("park.y", along("y.min", 1))];
        assert_eq!(bench.refused(&set(&apart)), None);
        assert_eq!(bench.refused(&set(&[("park.after_job", word(after_job))])), None);
        assert_eq!(bench.refused(&Ask::Park), None);
        bench.state(State::Parking);
        let status = bench.state(State::Ready);
        assert!(is_parked(&status), "{status:?}");
        bench.heard.clear();
        let key = bench.upload(&super::level::one_bit(4));
        bench.start(&key, 0);
        if stops {
            bench.state(State::ToolChange);
            assert_eq!(bench.refused(&Ask::ToolChanged), None);
            bench.until(|status| status.holes_done == 3);
            bench.ask(&Ask::StopAfterHole);
        }
        assert_eq!(bench.finish(), (Ending::Done, 4));
        (0..9_000).for_each(|_| bench.millisecond());
        let status = bench.status().unwrap().clone();
        let was_parking = bench
            .heard
            .iter()
            .any(|tell| matches!(tell, Tell::Status(status) if status.state == State::Parking));
        assert_eq!((is_parked(&status), was_parking), (parks, parks), "{after_job} {stops}: {status:?}");
        assert_eq!((status.state, status.trust), (State::Ready, Trust::Trusted), "{after_job}");
    }
}
