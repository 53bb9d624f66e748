//! Tests of a machine that changes its tools by lines that its owner configured. Every hole must be made
//! with the right tool at the right height; if the lines do anything else, the job must end. Only the judge
//! knows the fitted tool and its length; the engine does not.

use super::setter::{STEP_MM, ready, setter};
use super::survey::found;
use super::{Bench, Faults, ZERO, job};
use annulus_core::control::Ending;
use annulus_core::grbl::{
    BoardHeight, Changer, EngineAction, EngineAsk, EngineEvent, EnginePhase, EngineStart, ToolMacro,
};

/// Length of a tool relative to the one with which zero was set, in mm.
fn lengths(tool: u32) -> f64 {
    match tool {
        7 => 1.5,
        9 => -2.25,
        _ => 0.0,
    }
}

fn alike(_: u32) -> f64 {
    0.0
}

pub(super) const FETCHES: [&str; 3] = ["G53 G0 Z-1", "M6 T{tool}", "G53 G0 X-200 Y-100"];

pub(super) fn changer(lines: &[&str]) -> Option<Changer> {
    let lines = ToolMacro::of_lines(lines.iter().copied()).unwrap();
    Some(Changer { lines, numbers: vec![Some(7), Some(9)] })
}

/// A job whose tools are changed by these lines and measured on the tool setter.
pub(super) fn measured(lines: &[&str], from: usize) -> EngineStart {
    EngineStart { changer: changer(lines), setter: Some(setter()), ..job(from) }
}

fn trusted(lines: &[&str]) -> EngineStart {
    EngineStart { changer: changer(lines), ..job(0) }
}

fn with_rack(rack: fn(u32) -> f64) -> Bench {
    let mut bench = ready();
    bench.board.rack = Some(rack);
    bench
}

impl Bench {
    fn asked_for(&self) -> Vec<u32> {
        let tools = self.told.iter().filter_map(|told| match told {
            EngineAction::ToolWanted { tool } => Some(*tool),
            _ => None,
        });
        tools.collect()
    }

    /// Waits for a phase that must come before the job ends.
    fn comes_to(&mut self, phase: EnginePhase) {
        let there = self.until(600_000, |bench| bench.engine().phase == phase || bench.ended().is_some());
        assert!(there && self.engine().phase == phase, "{phase:?}: {:?}", self.words());
    }
}

#[test]
fn every_fetched_tool_is_measured_before_it_cuts() {
    let mut bench = with_rack(lengths);
    bench.start_as(measured(&FETCHES, 0));
    assert_eq!(bench.is_over(), Some(Ending::Done), "{:?}", bench.words());
    assert_eq!((bench.board.fetched.clone(), bench.board.fetched_turning), (vec![7, 9], false));
    assert_eq!(bench.asked_for(), Vec::<u32>::new(), "nobody is asked");
    assert!(bench.off_mm() <= STEP_MM, "{}", bench.off_mm());
    assert_eq!((bench.missing(), bench.wrong()), (vec![], vec![]));
}

#[test]
fn changer_without_setter_uses_offsets_or_equal_lengths() {
    type Row = (fn(u32) -> f64, &'static [&'static str]);
    let rows: [Row; 2] = [(lengths, &["M6 T{tool}", "G43 H{tool}"]), (alike, &FETCHES)];
    for (rack, lines) in rows {
        let mut bench = with_rack(rack);
        let said = bench.engine().check(&trusted(lines));
        assert!(said.iter().any(|why| why.code == "changer.lengths"), "{said:?}");
        bench.start_as(trusted(lines));
        assert_eq!(bench.is_over(), Some(Ending::Done), "{:?}", bench.words());
        assert_eq!((bench.board.fetched.clone(), bench.asked_for()), (vec![7, 9], vec![]));
        assert!(bench.off_mm() <= STEP_MM, "{}", bench.off_mm());
        assert_eq!((bench.missing(), bench.wrong()), (vec![], vec![]));
    }
}

#[test]
fn changer_lines_are_sent_one_at_a_time_at_rest() {
    let mut bench = with_rack(alike);
    bench.start_as(trusted(&FETCHES));
    bench.comes_to(EnginePhase::Changing);
    let mut seen = Vec::new();
    while bench.engine().phase == EnginePhase::Changing {
        if let Some(line) = bench.engine().changing().filter(|line| seen.last() != Some(line)) {
            seen.push(line);
        }
        bench.tick();
    }
    assert_eq!(seen, [[1, 3], [2, 3], [3, 3]]);
    let lines: Vec<String> = bench
        .told
        .iter()
        .filter_map(|told| match told {
            EngineAction::Write(bytes) if bytes.len() > 1 => {
                Some(String::from_utf8_lossy(bytes).trim().to_owned())
            }
            _ => None,
        })
        .collect();
    let first = lines.iter().position(|line| line == FETCHES[0]).unwrap();
    let wanted = ["M5M9", "G21G17G90G94", "G54"];
    assert!(wanted.iter().all(|word| lines[first - 5..first].iter().any(|line| line == word)), "{lines:?}");
    assert_eq!(lines[first..first + 6], [FETCHES[0], "G4P0", "M6 T7", "G4P0", FETCHES[2], "G4P0"]);
}

#[test]
fn refused_changer_line_ends_the_job_with_its_text() {
    let mut bench = with_rack(alike);
    bench.start_as(trusted(&["G53 G0 Z-1", "G65 P3", "M6 T{tool}"]));
    assert_eq!(bench.is_over(), Some(Ending::Alarm), "{:?}", bench.words());
    let why = bench.told.iter().find_map(|told| match told {
        EngineAction::Found(why) if why.code == "changer.refused" => Some(why.message("en")),
        _ => None,
    });
    assert!(why.is_some_and(|why| why.contains("line 2") && why.contains("G65 P3")), "{:?}", bench.words());
    assert_eq!((bench.board.fetched.len(), bench.cuts().count()), (0, 0));
}

#[test]
fn stop_ends_a_tool_change_and_nothing_moves_afterwards() {
    let mut bench = with_rack(alike);
    bench.start_as(trusted(&["G53 G0 Z-1", "G53 G0 X-290 Y-290", "M6 T{tool}"]));
    bench.comes_to(EnginePhase::Changing);
    assert!(bench.until(60_000, |bench| bench.engine().changing() == Some([2, 3])));
    bench.until(50, |_| false);
    bench.asked(EngineAsk::Stop);
    assert_eq!(bench.is_over(), Some(Ending::Stopped), "{:?}", bench.words());
    assert!(found(&bench).contains(&"changer.stopped".to_owned()), "{:?}", found(&bench));
    let place = bench.board.place();
    bench.until(3_000, |_| false);
    assert_eq!((bench.board.place(), bench.board.fetched.len()), (place, 0));
}

#[test]
fn changer_line_that_moves_zero_ends_the_job_before_a_cut() {
    let rows: [(&[&str], &str); 4] = [
        (&["M6 T{tool}", "G10 L2 P1 X-149"], "changer.moved_zero"),
        (&["M6 T{tool}", "T3"], "changer.other_tool"),
        (&["M6 T{tool}", "G4 P0.1", "G10 L20 P1 Y5"], "changer.moved_zero"),
        (&["M6 T{tool}", "G91 G38.2 Z-1 F50"], "grbl.alarm_5"),
    ];
    for (lines, code) in rows {
        let mut bench = with_rack(alike);
        bench.start_as(trusted(lines));
        assert_eq!(bench.is_over(), Some(Ending::Alarm), "{lines:?} {:?}", bench.words());
        assert!(found(&bench).contains(&code.to_owned()), "{lines:?} {:?}", found(&bench));
        assert_eq!(bench.cuts().count(), 0, "{lines:?}");
    }
}

#[test]
fn unknown_tool_number_is_refused_before_motion() {
    let mut bench = with_rack(alike);
    let mut start = trusted(&FETCHES);
    start.changer.as_mut().unwrap().numbers = vec![Some(7), None];
    bench.start_as(start.clone());
    assert_eq!((bench.engine().phase, found(&bench)[0].as_str()), (EnginePhase::Ready, "changer.no_number"));
    // Lines that don't use the number don't need one.
    start.changer.as_mut().unwrap().lines = ToolMacro::of_lines(["M6"]).unwrap();
    assert!(bench.engine().check(&start).iter().all(|why| why.code != "changer.no_number"));
}

#[test]
fn resumed_job_fetches_its_tool_again() {
    let mut bench = with_rack(lengths);
    // The link was reopened: homing restores zero, but no tool has been measured.
    bench.start_as(EngineStart { zero_mm: Some(ZERO), ..measured(&FETCHES, 3) });
    bench.comes_to(EnginePhase::Measuring);
    assert_eq!(bench.board.fetched, Vec::<u32>::new(), "the tool that is in is the one to go by");
    assert_eq!(bench.is_over(), Some(Ending::Done), "{:?}", bench.words());
    assert_eq!(bench.board.fetched, [7, 9]);
    assert_eq!(bench.wrong(), Vec::<[f64; 3]>::new());
    // Once more: now the length of the fitted tool is unknown.
    bench.start_as(EngineStart { zero_mm: bench.engine().zero_mm, ..measured(&FETCHES, 3) });
    bench.event(annulus_core::grbl::EngineEvent::Ask(EngineAsk::NewBit));
    bench.comes_to(EnginePhase::Measuring);
    assert_eq!(bench.is_over(), Some(Ending::Done), "{:?}", bench.words());
    assert_eq!(bench.wrong(), Vec::<[f64; 3]>::new());
}

#[test]
fn first_change_on_another_board_asks_for_touch_off() {
    let mut bench = with_rack(lengths);
    bench.event(annulus_core::grbl::EngineEvent::Ask(EngineAsk::NewBit));
    bench.start_as(measured(&FETCHES, 0));
    bench.comes_to(EnginePhase::ToolChange);
    assert_eq!((bench.board.fetched.clone(), bench.asked_for()), (vec![7], vec![0]));
    assert_eq!(bench.engine().height(), BoardHeight::OfAnotherBit);
    assert!(bench.tool_ready().contains(&"setter.no_reference".to_owned()), "{:?}", bench.words());
    bench.touched_off();
    bench.tool_ready();
    assert_eq!(bench.is_over(), Some(Ending::Done), "{:?}", bench.words());
    assert_eq!((bench.board.fetched.clone(), bench.asked_for()), (vec![7, 9], vec![]));
    assert!(bench.off_mm() <= STEP_MM, "{}", bench.off_mm());
}

#[test]
fn damaged_changer_lines_never_fetch_with_spindle_on() {
    for seed in 1..=40 {
        let faults = Faults { lost: 0.000_7, damaged: 0.000_7, back: 0.000_7 };
        let mut bench = Bench::new(seed, faults);
        bench.board.rack = Some(alike);
        if !bench.ready() {
            continue;
        }
        bench.start_as(trusted(&FETCHES));
        assert!(bench.run(), "seed {seed}: {:?}", bench.words());
        assert!(!bench.board.fetched_turning, "seed {seed}");
        let done = bench.ended() == Some(Ending::Done);
        assert!(!done || (bench.missing().is_empty() && bench.board.fetched == [7, 9]), "seed {seed}");
    }
}

#[test]
fn worn_tool_without_known_length_ends_the_job() {
    let mut bench = with_rack(lengths);
    bench.start_as(trusted(&["M6 T{tool}", "G43 H{tool}"]));
    bench.event(EngineEvent::Ask(EngineAsk::ToolBefore { section: 1 }));
    assert_eq!(bench.is_over(), Some(Ending::Alarm), "{:?}", bench.words());
    assert!(found(&bench).contains(&"changer.worn".to_owned()), "{:?}", found(&bench));
    assert_eq!((bench.asked_for(), bench.cuts().count()), (Vec::<u32>::new(), 0));
}
