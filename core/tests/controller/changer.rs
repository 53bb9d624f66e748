//! A machine that changes its tools itself, by the lines of its owner: the right tool with its own length at every hole, and an end of the
//! job where the lines do anything else than that. The judge knows which tool is in and how long it is, the engine does not.

use super::setter::{STEP_MM, ready, setter};
use super::survey::found;
use super::{Bench, Faults, ZERO, job};
use annulus_core::control::Ending;
use annulus_core::controller::{
    BoardHeight, Changer, EngineAction, EngineAsk, EngineEvent, EnginePhase, EngineStart, ToolMacro,
};

/// How much further a tool stands out than the one with which zero was set.
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

fn changer(lines: &[&str]) -> Option<Changer> {
    let lines = ToolMacro::of_lines(lines.iter().copied()).unwrap();
    Some(Changer { lines, numbers: vec![Some(7), Some(9)] })
}

/// A job whose tools the machine changes by these lines, measured on the tool setter.
pub(super) fn measured(lines: &[&str], from: usize) -> EngineStart {
    EngineStart { changer: changer(lines), setter: Some(setter()), ..job(from) }
}

/// The same, unmeasured.
fn trusted(lines: &[&str]) -> EngineStart {
    EngineStart { changer: changer(lines), ..job(0) }
}

/// Zero is set, and the machine has this rack.
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

    /// Waits for a phase, of a job that is not over before.
    fn comes_to(&mut self, phase: EnginePhase) {
        let there = self.until(600_000, |bench| bench.engine().phase == phase || bench.ended().is_some());
        assert!(there && self.engine().phase == phase, "{phase:?}: {:?}", self.words());
    }
}

#[test]
fn every_tool_that_the_machine_fetches_is_measured_before_it_cuts() {
    let mut bench = with_rack(lengths);
    bench.start_as(measured(&FETCHES, 0));
    assert_eq!(bench.is_over(), Some(Ending::Done), "{:?}", bench.words());
    assert_eq!((bench.board.fetched.clone(), bench.board.fetched_turning), (vec![7, 9], false));
    assert_eq!(bench.asked_for(), Vec::<u32>::new(), "nobody is asked");
    assert!(bench.off_mm() <= STEP_MM, "{}", bench.off_mm());
    assert_eq!((bench.missing(), bench.wrong()), (vec![], vec![]));
}

#[test]
fn without_a_setter_the_lines_leave_the_length_in_an_offset_or_all_are_alike() {
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
fn lines_are_sent_alone_each_after_the_one_before_has_come_to_rest() {
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
fn a_line_that_is_refused_ends_the_job_with_its_text() {
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
fn stop_ends_a_change_in_its_middle_and_nothing_moves_afterwards() {
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
fn lines_that_move_the_zero_or_fetch_another_tool_end_the_job_before_anything_is_cut() {
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
fn a_tool_whose_number_nobody_knows_is_refused_before_anything_moves() {
    let mut bench = with_rack(alike);
    let mut start = trusted(&FETCHES);
    start.changer.as_mut().unwrap().numbers = vec![Some(7), None];
    bench.start_as(start.clone());
    assert_eq!((bench.engine().phase, found(&bench)[0].as_str()), (EnginePhase::Ready, "changer.no_number"));
    // Lines that do not want to know it go without.
    start.changer.as_mut().unwrap().lines = ToolMacro::of_lines(["M6"]).unwrap();
    assert!(bench.engine().check(&start).iter().all(|why| why.code != "changer.no_number"));
}

#[test]
fn a_job_that_is_taken_up_fetches_its_tool_anew_and_a_person_touches_it_off_where_nothing_is_known() {
    let mut bench = with_rack(lengths);
    // The link was opened anew: by the switches zero is where it was, but nothing was measured.
    bench.start_as(EngineStart { zero_mm: Some(ZERO), ..measured(&FETCHES, 3) });
    bench.comes_to(EnginePhase::Measuring);
    assert_eq!(bench.board.fetched, Vec::<u32>::new(), "the tool that is in is the one to go by");
    assert_eq!(bench.is_over(), Some(Ending::Done), "{:?}", bench.words());
    assert_eq!(bench.board.fetched, [7, 9]);
    assert_eq!(bench.wrong(), Vec::<[f64; 3]>::new());
    // Once more: the tool that is in is of nobody knows what length.
    bench.start_as(EngineStart { zero_mm: bench.engine().zero_mm, ..measured(&FETCHES, 3) });
    bench.event(annulus_core::controller::EngineEvent::Ask(EngineAsk::NewBit));
    bench.comes_to(EnginePhase::Measuring);
    assert_eq!(bench.is_over(), Some(Ending::Done), "{:?}", bench.words());
    assert_eq!(bench.wrong(), Vec::<[f64; 3]>::new());
}

#[test]
fn the_first_change_of_another_board_asks_a_person_to_touch_off_what_was_fetched() {
    let mut bench = with_rack(lengths);
    bench.event(annulus_core::controller::EngineEvent::Ask(EngineAsk::NewBit));
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
fn whatever_is_damaged_on_the_way_nothing_is_cut_where_nothing_is_wanted() {
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
fn a_worn_tool_is_not_replaced_by_one_whose_length_nobody_knows() {
    let mut bench = with_rack(lengths);
    bench.start_as(trusted(&["M6 T{tool}", "G43 H{tool}"]));
    bench.event(EngineEvent::Ask(EngineAsk::ToolBefore { section: 1 }));
    assert_eq!(bench.is_over(), Some(Ending::Alarm), "{:?}", bench.words());
    assert!(found(&bench).contains(&"changer.worn".to_owned()), "{:?}", found(&bench));
    assert_eq!((bench.asked_for(), bench.cuts().count()), (Vec::<u32>::new(), 0));
}
