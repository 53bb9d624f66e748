//! Tests of the board height: the tool that it is valid for, over jobs, worn tools and STOP. Also of a zero
//! that moved before a job resumes.

use super::*;
use annulus_core::wire::{ArmedJob, JobEnd};

impl Bench {
    fn first_change(&mut self, key: &str, from_leg: u32) {
        self.start(key, from_leg);
        self.state(State::ToolChange);
    }

    fn tools(&mut self, lines: &[&str]) {
        let lines = lines.iter().map(|line| (*line).to_owned()).collect();
        let changes = vec![("rack.tools".to_owned(), Value::Texts(lines))];
        assert_eq!(self.refused(&Ask::Configure { changes }), None);
    }

    /// Pre-flight rows that need to be accepted.
    pub(super) fn ticks(&mut self, key: &str, from_leg: u32) -> Vec<String> {
        self.fails(key, from_leg);
        let armed = self.heard.iter().find_map(|tell| match tell {
            Tell::Armed(ArmedJob { checks, .. }) => Some(checks.clone()),
            _ => None,
        });
        let warned = armed.unwrap().into_iter().filter(|row| row.verdict == RowVerdict::Warn);
        warned.map(|row| row.finding.code).collect()
    }

    /// Stops a job after some holes. Returns the offer to resume.
    pub(super) fn stopped(&mut self, key: &str) -> (String, u32) {
        self.first_change(key, 0);
        assert_eq!(self.refused(&Ask::ToolChanged), None);
        self.until(|status| status.holes_done == 3);
        self.ask(&Ask::Stop);
        self.state(State::Ready);
        (0..500).for_each(|_| self.millisecond());
        let (job, next_leg, _) = self.offer().unwrap();
        (job, next_leg)
    }

    fn zeroed(&mut self, ask: &Ask) {
        assert_eq!(self.refused(ask), None);
        (0..500).for_each(|_| self.millisecond());
    }
}

const FIRST: Option<&str> = Some("grbl.height_first");

#[test]
fn first_tool_of_the_second_board_needs_touch_off() {
    let (files, program) = (Memory::default(), holes(10));
    let mut bench = Bench::ready(&files);
    let key = bench.upload(&program);
    assert!(bench.ticks(&key, 0).contains(&"grbl.height_of_first".to_owned()));
    bench.start(&key, 0);
    assert_eq!(bench.finish(), (Ending::Done, 10));
    // The Z zero is now that of the second tool.
    bench.first_change(&key, 0);
    assert_eq!(bench.refused(&Ask::ToolChanged).as_deref(), FIRST);
    assert_eq!(bench.finish(), (Ending::Done, 10));
    assert_eq!(bench.made(&program), (vec![2; 10], 0));
    // Touched off between two boards, the zero is that of the current tool.
    bench.zeroed(&Ask::SetHeight);
    bench.first_change(&key, 0);
    assert_eq!(bench.refused(&Ask::ToolChanged), None);
}

#[test]
fn replaced_first_tool_needs_touch_off() {
    let (files, program) = (Memory::default(), holes(10));
    let mut bench = Bench::ready(&files);
    bench.tools(&["T1 drill 0.8 life 6", "T2 drill 1 life 100"]);
    let key = bench.upload(&program);
    bench.start(&key, 0);
    assert_eq!(bench.finish(), (Ending::Done, 10));
    bench.zeroed(&Ask::SetHeight);
    bench.first_change(&key, 0);
    assert_eq!(bench.refused(&Ask::ToolChanged).as_deref(), FIRST, "another one goes in");
    assert_eq!(bench.finish(), (Ending::Done, 10));
}

#[test]
fn tool_reported_as_new_needs_touch_off() {
    let mut bench = Bench::ready(&Memory::default());
    bench.tools(&["T1 drill 0.8 life 6", "T2 drill 1 life 100"]);
    let key = bench.upload(&holes(10));
    assert_eq!(bench.refused(&Ask::NewTool { number: 1 }), None);
    bench.first_change(&key, 0);
    assert_eq!(bench.refused(&Ask::ToolChanged).as_deref(), FIRST);
}

#[test]
fn stopped_job_resumes_with_touch_off() {
    let (files, program) = (Memory::default(), holes(10));
    let mut bench = Bench::ready(&files);
    let key = bench.upload(&program);
    let (job, next_leg) = bench.stopped(&key);
    let cuts = bench.board.cuts.len();
    bench.first_change(&job, next_leg);
    assert_eq!(bench.refused(&Ask::ToolChanged).as_deref(), FIRST, "the bit may have broken");
    assert!(bench.board.cuts[cuts..].iter().all(|place| place[2] >= ZERO[2] - 2.0 - NEAR));
    assert_eq!(bench.finish(), (Ending::Done, 10));
    let (times, elsewhere) = bench.made(&program);
    assert!(times.iter().all(|times| (1..=2).contains(times)) && elsewhere == 0, "{times:?} {elsewhere}");
}

#[test]
fn moved_zero_needs_confirmation_before_resume() {
    for way in ["set", "undone", "edge"] {
        let mut bench = Bench::ready(&Memory::default());
        let key = bench.upload(&holes(10));
        let (job, next_leg) = bench.stopped(&key);
        assert!(!bench.ticks(&job, next_leg).contains(&"grbl.zero_moved".to_owned()), "{way}");
        let armed = Ask::Start { job: job.clone(), stream_digest: String::new(), from_leg: next_leg };
        match way {
            "set" => {
                bench.jog(0, 0.8);
                bench.zeroed(&Ask::SetZero);
            }
            "undone" => bench.zeroed(&Ask::UndoZero),
            _ => {
                // A board whose edge is a cliff, 2 mm to the right of the tool.
                bench.jog(2, 5.0);
                bench.board.surface = Some(|x, _| if x > -140.0 { 0.0 } else { -100.0 });
                let at = bench.status().unwrap().machine_mm[0];
                bench.jog(0, -142.0 - at);
                bench.zeroed(&Ask::Edge { axis: 0, up: true, reach_um: 5_000, tool_um: 0 });
                (0..8_000).for_each(|_| bench.millisecond());
                bench.board.surface = None;
            }
        }
        assert_eq!(bench.refused(&armed).as_deref(), Some("control.not_armed"), "{way}: nobody has read it");
        assert!(bench.ticks(&job, next_leg).contains(&"grbl.zero_moved".to_owned()), "{way}");
        if way == "set" {
            // Once accepted, the job starts.
            assert_eq!(bench.refused(&armed), None);
            bench.state(State::ToolChange);
        }
        // Nothing set the zero since the port was opened, so its difference is not intended.
        let mut again = bench.replug();
        again.ask(&Ask::Home);
        again.state(State::Ready);
        (0..500).for_each(|_| again.millisecond());
        let (job, next_leg, _) = again.offer().unwrap();
        // A job that started with the current zero has no difference.
        let moved = again.fails(&job, next_leg).contains(&"grbl.zero_moved".to_owned());
        assert_eq!(moved, way != "set", "{way}");
    }
}

#[test]
fn missing_z_zero_is_in_the_status() {
    let needs_z_zero = |bench: &Bench| bench.status().unwrap().needs_z_zero;
    let mut bench = Bench::plug(&Memory::default(), Automaton::new([-20.0, -30.0, -10.0]));
    bench.ask(&Ask::Home);
    assert!(bench.state(State::Ready).needs_z_zero);
    bench.zeroed(&Ask::SetZero);
    assert!(needs_z_zero(&bench), "only X and Y zero are set");
    bench.zeroed(&Ask::SetHeight);
    assert!(!needs_z_zero(&bench));
    // A resumed job needs no new Z zero if the old one is still valid.
    let mut bench = Bench::ready(&Memory::default());
    let key = bench.upload(&holes(10));
    bench.stopped(&key);
    let mut again = bench.replug();
    again.ask(&Ask::Home);
    again.state(State::Ready);
    (0..500).for_each(|_| again.millisecond());
    assert!(!needs_z_zero(&again));
    assert_eq!(again.refused(&Ask::ForgetInterrupted), None);
    (0..500).for_each(|_| again.millisecond());
    assert!(needs_z_zero(&again), "a new job needs it");
}

#[test]
fn probe_without_contact_discards_the_height() {
    let mut bench = Bench::ready(&Memory::default());
    let key = bench.upload(&holes(4));
    assert_eq!(bench.fails(&key, 0), Vec::<String>::new());
    assert_eq!(bench.refused(&Ask::Probe { depth_um: 2_000, plate_um: 0 }), None);
    bench.state(State::Alarm);
    bench.ask(&Ask::AcknowledgeAlarm);
    bench.ask(&Ask::Home);
    bench.state(State::Ready);
    (0..500).for_each(|_| bench.millisecond());
    assert_eq!(bench.fails(&key, 0), ["grbl.no_height"]);
}

#[test]
fn stop_during_touch_off_ends_the_job() {
    let mut bench = Bench::ready(&Memory::default());
    let key = bench.upload(&holes(10));
    bench.first_change(&key, 0);
    assert_eq!(bench.refused(&Ask::ToolChanged), None);
    bench.until(|status| status.holes_done == 6);
    bench.state(State::ToolChange);
    assert_eq!(bench.refused(&Ask::Jog { axis: 2, distance_um: 20_000, anyway: false }), None);
    bench.state(State::Jogging);
    bench.ask(&Ask::Stop);
    let status = bench.until(|status| status.job.is_none());
    assert_ne!(status.state, State::ToolChange);
    assert!(
        bench.heard.iter().any(|tell| matches!(tell, Tell::Ended(JobEnd { ending: Ending::Stopped, .. })))
    );
    bench.state(State::Ready);
}
