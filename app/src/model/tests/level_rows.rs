//! The planned height map: positions, spacing, job and time.

use super::lines_rows::program;
use crate::model::{Clocks, Effect, Event, Job, LevelEvent, Model, StartEvent, start, update};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::level::key_of;
use annulus_core::wire::ArmedJob;
use annulus_core::wire::{Ask, HeightMapReport, PreflightRow, RowVerdict};
use std::sync::Arc;

fn job() -> Arc<Job> {
    let program = program();
    Arc::new(Job { program, bytes: Vec::new(), key: String::new(), stream_digest: String::new() })
}

fn told(events: &[LevelEvent]) -> (Model, Vec<Effect>) {
    let mut model = Model::default();
    model.board.job = Some(job());
    let clock = Clocks { page_ms: 0.0, wall_ms: 1_800_000_000_900.0 };
    update(&mut model, Event::Clock { clock });
    let mut effects = Vec::new();
    for event in events {
        effects = update(&mut model, (*event).into());
    }
    (model, effects)
}

#[test]
fn height_map_grid_covers_the_cuts_at_the_chosen_spacing() {
    let count = |events: &[LevelEvent]| {
        let planned = told(events).0.level.planned;
        planned.map(|planned| planned.map(|planned| (planned.grid.columns, planned.grid.rows)))
    };
    let show = LevelEvent::Show { on: true };
    assert_eq!(count(&[]), None, "nobody looks at it");
    assert_eq!(count(&[show]), Some(Ok((3, 2))), "16 × 6 mm, at most 10 mm apart");
    assert_eq!(count(&[show, LevelEvent::Space { mm: 5 }]), Some(Ok((5, 3))));
    let (mut model, _) = told(&[show]);
    model.board.job = None;
    update(&mut model, show.into());
    assert_eq!(model.level.planned, None, "there is no job any more");
}

#[test]
fn height_map_request_names_job_and_time() {
    let (_, effects) = told(&[LevelEvent::Touch]);
    assert_eq!(effects, [], "nothing is planned");
    let (model, effects) = told(&[LevelEvent::Show { on: true }, LevelEvent::Touch]);
    let [Effect::Send { text }] = effects.as_slice() else { panic!("{effects:?}") };
    let Ok(Ask::Survey { grid, job, now_s, .. }) = serde_json::from_str(text) else { panic!("{text}") };
    let planned = model.level.planned.unwrap().unwrap();
    assert_eq!((grid, job, now_s), (planned.grid, key_of(&program()), 1_800_000_000));
}

#[test]
fn preflight_shows_the_age_of_the_height_map() {
    let (mut model, _) = told(&[]);
    // 2 h 5 min and some seconds ago.
    let report = HeightMapReport { measured_s: 1_800_000_000 - 7_520, ..HeightMapReport::default() };
    model.link.height_map = Arc::new(report);
    update(&mut model, StartEvent::Open.into());
    let finding = Diagnostic::warning("level.follows").with("mm", "0.12");
    let checks = vec![PreflightRow { finding, verdict: RowVerdict::Warn }];
    let armed = ArmedJob { job: String::new(), stream_digest: String::new(), levelled: false, checks };
    let preflight = model.start.preflight.clone().unwrap();
    let row = start::rows(&preflight, &armed, None).swap_remove(0);
    let said: Vec<_> = row.finding.args.iter().map(|(_, value)| value.as_str()).collect();
    assert_eq!((row.finding.code.as_str(), said), ("level.follows_aged", vec!["0.12", "2", "5"]));
    assert_eq!(row.verdict, RowVerdict::Warn);
}
