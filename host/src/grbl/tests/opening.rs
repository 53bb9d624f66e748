//! Tests of the setting whether opening the port may reset the controller.

use super::{Bench, Memory};
use annulus_core::control::{State, Trust};
use annulus_core::grbl::{RESET_KEY, ResetOnOpen};
use annulus_core::machine::Value;
use annulus_core::wire::{Ask, ControllerReport, Tell};

fn choice(word: &str) -> Ask {
    Ask::Configure { changes: vec![(RESET_KEY.to_owned(), Value::Text(word.to_owned()))] }
}

impl Bench {
    fn chosen(&self) -> Option<ResetOnOpen> {
        self.heard.iter().rev().find_map(|tell| match tell {
            Tell::Controller(ControllerReport { reset_on_open, .. }) => Some(*reset_on_open),
            _ => None,
        })
    }

    /// Reloads the page while the controller keeps running, its spindle on.
    fn reload(mut self) -> Self {
        self.board.hear(b"M3S9000\n");
        (0..50).for_each(|_| self.board.tick());
        self.board.said();
        Self::plug(&self.files, self.board)
    }

    fn spindle_turns(&mut self) -> bool {
        self.board.said();
        self.board.hear(b"$G\n");
        (0..50).for_each(|_| self.board.tick());
        String::from_utf8_lossy(&self.board.said()).contains(" M3 ")
    }
}

#[test]
fn controller_without_reset_continues_after_a_reload() {
    let mut bench = Bench::ready(&Memory::default());
    assert_eq!(bench.chosen(), Some(ResetOnOpen::Usual));
    assert_eq!(bench.refused(&choice("sometimes")), Some("grbl.no_such_reset".to_owned()));
    assert_eq!(bench.refused(&choice("never")), None);
    assert_eq!(bench.chosen(), Some(ResetOnOpen::Never));
    let mut bench = bench.reload();
    assert_eq!((bench.chosen(), bench.spindle_turns()), (Some(ResetOnOpen::Never), true));
    // The controller's position is not trusted.
    let status = bench.status().unwrap().clone();
    assert_eq!((status.state, status.trust), (State::NotHomed, Trust::Lost));
    assert_eq!(bench.refused(&choice("usual")), None);
    let mut bench = bench.reload();
    assert_eq!((bench.chosen(), bench.spindle_turns()), (Some(ResetOnOpen::Usual), false));
}
