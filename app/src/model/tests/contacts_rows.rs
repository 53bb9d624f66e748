//! Contact heights: recorded per hole and job, sorted by deviation.

use super::line::status;
use crate::model::{LinkEvent, Model, update};
use annulus_core::control::State;
use annulus_core::geometry::Point;
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::units::Length;
use annulus_core::wire::Tell;

/// A segment without a hole, and four holes.
fn program() -> Program {
    let hole = |number: u32| {
        let to = Point::from_mm(f64::from(number) * 10.0, 5.0);
        let plunge = Command::Plunge { to: Length::from_um(-2_100), feed_um_per_s: 2_000, gate: None };
        let commands = vec![Command::Rapid { to }, plunge, Command::Retract { to: Length::from_um(2_000) }];
        Leg { mark: Mark::Hole(number), commands }
    };
    let first = Leg { mark: Mark::Prepare, commands: Vec::new() };
    Program {
        name: "holes".to_owned(),
        machine: String::new(),
        origin: Point::default(),
        bits: Vec::new(),
        accepted: Vec::new(),
        safe_height: Length::from_um(2_000),
        spindles: 1,
        legs: std::iter::once(first).chain((0..4).map(hole)).collect(),
    }
}

fn tell(model: &mut Model, tell: Tell) {
    update(model, LinkEvent::Heard { tell: Some(Box::new(tell)) }.into());
}

fn works(model: &mut Model, job: Option<&str>, holes_done: u32) {
    let mut now = status(if job.is_some() { State::Running } else { State::Ready }, job);
    now.holes_done = holes_done;
    tell(model, Tell::Status(Box::new(now)));
}

fn rows(model: &Model) -> Vec<(i64, i64)> {
    let um = |mm: f64| (mm * 1e3).round() as i64;
    let rows = model.link.contacts.rows(&program()).into_iter();
    rows.map(|row| (um(row.at.x.mm()) / 1_000, um(row.off_mm))).collect()
}

#[test]
fn contact_strokes_are_listed_by_deviation() {
    let mut model = Model::default();
    works(&mut model, Some("a"), 0);
    for (leg, height_um) in [(1, -2_000.0), (2, -2_010.0), (3, -1_700.0)] {
        tell(&mut model, Tell::Touched { leg, height_um });
    }
    assert_eq!(rows(&model), [(20, 300), (10, -10), (0, 0)]);
    // A resumed job keeps its contacts, and a repeated hole counts once.
    works(&mut model, None, 0);
    works(&mut model, Some("a"), 2);
    tell(&mut model, Tell::Touched { leg: 3, height_um: -2_005.0 });
    tell(&mut model, Tell::Touched { leg: 4, height_um: -2_002.0 });
    assert_eq!(rows(&model), [(0, 5), (10, -5), (30, 3), (20, 0)]);
    // A job started again has no contacts, and another job neither.
    works(&mut model, None, 0);
    works(&mut model, Some("a"), 0);
    assert_eq!(rows(&model), []);
    tell(&mut model, Tell::Touched { leg: 1, height_um: -2_000.0 });
    works(&mut model, Some("b"), 1);
    tell(&mut model, Tell::Touched { leg: 2, height_um: -2_000.0 });
    assert_eq!(rows(&model), [(10, 0)]);
}
