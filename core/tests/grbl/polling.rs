//! Tests of the rate of status queries on a slow link.

use super::*;

#[test]
fn late_reports_are_queried_less_often() {
    let mut bench = Bench::new(1, Faults::default());
    assert!(bench.ready());
    bench.questions.clear();
    bench.start(0);
    let mut asked = 0;
    while bench.ended().is_none() {
        if bench.engine().phase == EnginePhase::ToolChange {
            bench.event(EngineEvent::Ask(EngineAsk::ToolReady));
        }
        bench.tick();
        // Every answer after a query arrives an eighth of a second late.
        if bench.questions.len() > asked {
            asked = bench.questions.len();
            bench.on_the_way_until_ms = bench.now_ms + 125;
        }
    }
    assert_eq!((bench.ended(), bench.missing(), bench.wrong()), (Some(Ending::Done), vec![], vec![]));
    let gaps: Vec<u64> = bench.questions.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(gaps.len() > 40, "{gaps:?}");
    assert!(gaps[..10].iter().any(|gap| *gap < 200) && gaps[10..].iter().all(|gap| *gap >= 200), "{gaps:?}");
}
