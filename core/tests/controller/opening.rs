//! A port that is opened at a board which does not begin anew by that: made to greet, or only asked, as its owner chose.

use super::survey::found;
use super::{Bench, Faults};
use annulus_core::control::Trust;
use annulus_core::controller::{EngineAction, EngineAsk, EngineEvent, EnginePhase};

impl Bench {
    /// The port is opened, and the board goes on with what it does.
    fn opens(&mut self, event: EngineEvent) {
        self.board.said();
        self.told.clear();
        self.open = true;
        self.event(event);
    }

    /// Real-time characters that were written, questions apart.
    fn signs(&self) -> Vec<u8> {
        let written = self.told.iter().filter_map(|told| match told {
            EngineAction::Write(bytes) => Some(bytes.as_slice()),
            _ => None,
        });
        let is_sign = |byte: &u8| matches!(byte, b'!' | b'~' | 0x18 | 0x80..);
        written.flatten().copied().filter(is_sign).collect()
    }

    /// A board that somebody else has unlocked.
    fn unlocked() -> Self {
        let mut bench = Self::new(1, Faults::default());
        bench.board.hear(b"$X\n");
        bench.until(50, |_| false);
        bench.board.said();
        bench
    }

    fn rests(&mut self) -> bool {
        self.until(20_000, |bench| {
            matches!(bench.engine().phase, EnginePhase::Ready | EnginePhase::Locked)
                && bench.engine().place().is_some()
        })
    }
}

#[test]
fn a_board_that_does_not_greet_is_reset_where_that_may_be() {
    let mut bench = Bench::unlocked();
    bench.opens(EngineEvent::Opened);
    assert!(bench.rests(), "{:?}", bench.words());
    assert_eq!(bench.signs(), [0x18]);
    assert!(!bench.engine().info.banner.is_empty());
}

#[test]
fn a_board_that_is_spared_is_only_asked_who_it_is_and_its_place_is_believed_of_nobody() {
    for locked in [false, true] {
        let mut bench = if locked { Bench::new(1, Faults::default()) } else { Bench::unlocked() };
        bench.opens(EngineEvent::OpenedSparing);
        assert!(bench.rests(), "{:?}", bench.words());
        assert_eq!((bench.signs(), bench.engine().trust), (vec![], Trust::Lost));
        let phase = if locked { EnginePhase::Locked } else { EnginePhase::Ready };
        assert_eq!((bench.engine().phase, bench.engine().info.flavour()), (phase, "GRBL"));
        assert_eq!(bench.engine().info.values.get(&110), Some(&6000.0));
        // It is homed and used as any other.
        bench.event(EngineEvent::Ask(EngineAsk::Home));
        assert!(bench.until(5_000, |bench| bench.engine().trust == Trust::Trusted), "{:?}", bench.words());
    }
}

#[test]
fn a_board_that_moves_when_its_port_is_opened_is_waited_for_and_stop_holds_it() {
    for stops in [false, true] {
        let mut bench = Bench::unlocked();
        bench.board.hear(b"$J=G91G21X-40F300\n");
        bench.opens(EngineEvent::OpenedSparing);
        assert!(bench.until(4_000, |bench| !found(bench).is_empty()), "{:?}", bench.words());
        assert_eq!((found(&bench), bench.signs()), (vec!["grbl.busy_at_opening".to_owned()], vec![]));
        assert_eq!(bench.engine().phase, EnginePhase::Greeting);
        if stops {
            bench.event(EngineEvent::Ask(EngineAsk::Stop));
            assert_eq!(bench.signs(), [b'!']);
            bench.until(20_000, |_| false);
            assert!(bench.board.place()[0] > -59.0, "{:?}", bench.board.place());
            assert_eq!(bench.signs(), [b'!'], "it is held, not reset");
            continue;
        }
        assert!(bench.rests(), "{:?}", bench.words());
        assert_eq!((bench.signs(), found(&bench).len()), (vec![], 1));
        assert!((bench.board.place()[0] + 60.0).abs() < 0.01, "{:?}", bench.board.place());
    }
}

#[test]
fn a_board_that_is_silent_is_not_held_where_it_is_spared() {
    for (event, signs) in [(EngineEvent::OpenedSparing, vec![]), (EngineEvent::Opened, vec![0x85, b'!'])] {
        let mut bench = Bench::unlocked();
        bench.opens(event);
        bench.asleep_until_ms = u64::MAX;
        assert!(bench.until(30_000, |bench| !bench.open), "{:?}", bench.words());
        assert_eq!(bench.signs(), signs);
    }
}

#[test]
fn settings_that_were_not_said_are_asked_for_again() {
    let mut bench = Bench::unlocked();
    bench.instead = Some((b"$$\n", b"$Q\n"));
    bench.opens(EngineEvent::OpenedSparing);
    assert!(bench.until(10_000, |bench| {
        bench
            .told
            .iter()
            .filter(|told| matches!(told, EngineAction::Write(bytes) if bytes == b"$$\n"))
            .count()
            > 2
    }));
    assert_eq!(bench.engine().phase, EnginePhase::Greeting);
    bench.instead = None;
    assert!(bench.rests(), "{:?}", bench.words());
    assert!(bench.engine().info.values.contains_key(&22) && bench.signs().is_empty());
}
