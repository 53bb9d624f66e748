//! Tests of opening a port whose controller does not restart on opening: reset or only queried, as
//! configured.

use super::survey::found;
use super::{Bench, Faults};
use annulus_core::control::Trust;
use annulus_core::grbl::{EngineAction, EngineAsk, EngineEvent, EnginePhase};

impl Bench {
    fn opens(&mut self, event: EngineEvent) {
        self.board.said();
        self.told.clear();
        self.open = true;
        self.event(event);
    }

    /// Real-time characters that were written, without status queries.
    fn signs(&self) -> Vec<u8> {
        let written = self.told.iter().filter_map(|told| match told {
            EngineAction::Write(bytes) => Some(bytes.as_slice()),
            _ => None,
        });
        let is_sign = |byte: &u8| matches!(byte, b'!' | b'~' | 0x18 | 0x80..);
        written.flatten().copied().filter(is_sign).collect()
    }

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
fn silent_controller_is_reset_if_allowed() {
    let mut bench = Bench::unlocked();
    bench.opens(EngineEvent::Opened);
    assert!(bench.rests(), "{:?}", bench.words());
    assert_eq!(bench.signs(), [0x18]);
    assert!(!bench.engine().info.banner.is_empty());
}

#[test]
fn controller_opened_without_reset_is_only_queried() {
    for locked in [false, true] {
        let mut bench = if locked { Bench::new(1, Faults::default()) } else { Bench::unlocked() };
        bench.opens(EngineEvent::OpenedSparing);
        assert!(bench.rests(), "{:?}", bench.words());
        assert_eq!((bench.signs(), bench.engine().trust), (vec![], Trust::Lost));
        let phase = if locked { EnginePhase::Locked } else { EnginePhase::Ready };
        assert_eq!((bench.engine().phase, bench.engine().info.flavour()), (phase, "GRBL"));
        assert_eq!(bench.engine().info.values.get(&110), Some(&6000.0));
        // From here on, homing and use are as usual.
        bench.event(EngineEvent::Ask(EngineAsk::Home));
        assert!(bench.until(5_000, |bench| bench.engine().trust == Trust::Trusted), "{:?}", bench.words());
    }
}

#[test]
fn moving_controller_at_opening_is_awaited_and_can_be_held() {
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
            assert!(bench.rests(), "{:?}", bench.words());
            assert!(bench.board.place()[0] > -59.0, "{:?}", bench.board.place());
            assert_eq!(bench.signs().last(), Some(&0x18), "reset at standstill");
            continue;
        }
        assert!(bench.rests(), "{:?}", bench.words());
        assert_eq!((bench.signs(), found(&bench).len()), (vec![], 1));
        assert!((bench.board.place()[0] + 60.0).abs() < 0.01, "{:?}", bench.board.place());
    }
}

#[test]
fn stopped_controller_opened_without_reset_is_identified() {
    let asks = |bench: &Bench| bench.told.contains(&EngineAction::Write(b"$I\n".to_vec()));
    // STOP before the first query, and with queries unanswered. Nothing moves.
    for (is_locked, is_asked) in [(false, false), (false, true), (true, false), (true, true)] {
        let mut bench = if is_locked { Bench::new(1, Faults::default()) } else { Bench::unlocked() };
        bench.opens(EngineEvent::OpenedSparing);
        assert!(!is_asked || bench.until(4_000, asks), "{:?}", bench.words());
        bench.event(EngineEvent::Ask(EngineAsk::Stop));
        assert!(bench.rests(), "{:?}", bench.words());
        assert_eq!(bench.signs(), [b'!', 0x18], "locked {is_locked}, asked {is_asked}");
        let phase = if is_locked { EnginePhase::Locked } else { EnginePhase::Ready };
        assert!(bench.until(1_000, |bench| bench.engine().phase == phase), "{:?}", bench.words());
    }
}

#[test]
fn silent_controller_opened_without_reset_is_not_held() {
    for (event, signs) in [(EngineEvent::OpenedSparing, vec![]), (EngineEvent::Opened, vec![0x85, b'!'])] {
        let mut bench = Bench::unlocked();
        bench.opens(event);
        bench.asleep_until_ms = u64::MAX;
        assert!(bench.until(30_000, |bench| !bench.open), "{:?}", bench.words());
        assert_eq!(bench.signs(), signs);
    }
}

#[test]
fn missing_settings_are_requested_again() {
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
