//! The board of the machine's job in a page opened later. After a reload during a job, the saved project
//! opens without a request of the user, so that the map shows its outline and copper.
//!
//! ```text
//!  machine: job "clockblock-top" ─┐
//!  store: "clockblock", "robot" ──┴─ Machine screen, no board open ─▶ "clockblock" opens; the screen stays
//! ```

use super::{Effect, KeepEvent, Model, Offer, OnTheWay, keeping};
use crate::keys::Tab;
use annulus_core::board::{Board, Face};
use annulus_core::geometry::{Point, Region};
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::units::Length;
use std::collections::BTreeSet;

/// Tolerance for matching a program's hole to a board's hole.
const SAME_PLACE: Length = Length::from_um(1);

#[derive(Clone, Debug, Default)]
pub(super) struct JobBoard {
    job: Option<String>,
    place: Option<u32>,
}

impl JobBoard {
    /// True if the project in slot `place` was opened for the machine's job, and not by the user.
    pub(super) fn is_at(&self, place: Option<u32>) -> bool {
        place.is_some() && self.place == place
    }
}

/// Opens the board of the machine's job if it is saved in this browser and no board is open.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let key = model.link.status.as_ref().and_then(|status| status.job.clone());
    let job = model.start.shown.as_ref().filter(|job| Some(&job.key) == key.as_ref());
    let is_free = model.board.document.is_none() && model.on_the_way == OnTheWay::Nothing;
    let is_looked_at = model.frame.tab == Tab::Machine;
    let Some(job) = job.filter(|_| is_free && is_looked_at && model.job_board.job != key) else {
        return Vec::new();
    };
    let of_job = |name: &str| is_called(&job.program.name, name);
    let offer = model.keeping.offers.iter().find(|offer| !offer.elsewhere && of_job(&offer.name)).cloned();
    let Some(offer) = offer else { return Vec::new() };
    model.job_board = JobBoard { job: key, place: Some(offer.place) };
    keeping::update(model, KeepEvent::Restore { offer })
}

/// Which of `offers` (latest first) the Machine screen suggests: the board of the interrupted job, else the
/// latest.
pub fn to_restore<'o>(broken_off: Option<&str>, offers: &'o [Offer]) -> Option<&'o Offer> {
    let of_job = |program: &str| offers.iter().find(|offer| is_called(program, &offer.name));
    broken_off.and_then(of_job).or_else(|| offers.first())
}

fn is_called(program: &str, name: &str) -> bool {
    let face = program.strip_prefix(name).and_then(|rest| rest.strip_prefix('-'));
    !name.is_empty()
        && face.is_some_and(|face| [Face::Top, Face::Bottom].iter().any(|one| one.name() == face))
}

/// The outline of `board`, whose work zero is at `origin`, if `board` matches `program`. They match if their
/// names and origins do, and if the board has all holes that the program drills.
pub fn outline<'b>(program: &Program, board: &'b Board, origin: Point) -> Option<&'b Region> {
    let near = |a: Length, b: Length| (a - b).abs() <= SAME_PLACE;
    let holes: BTreeSet<Point> = board.holes.iter().map(|hole| hole.at).collect();
    let is_there = |at: Point| {
        let from = Point::new(at.x - SAME_PLACE, Length::from_nm(i64::MIN));
        let there = holes.range(from..).take_while(|hole| hole.x <= at.x + SAME_PLACE);
        there.into_iter().any(|hole| near(hole.y, at.y))
    };
    let drilled = program.legs.iter().filter(|leg| matches!(leg.mark, Mark::Hole(_)));
    let fits = is_called(&program.name, &board.name)
        && program.origin == origin
        && drilled.filter_map(|leg| place(program, leg)).all(is_there);
    Some(&board.outline).filter(|outline| fits && !outline.is_empty())
}

/// First position of a segment, in the files' coordinates.
pub fn place(program: &Program, leg: &Leg) -> Option<Point> {
    let to = leg.commands.iter().find_map(|command| match command {
        Command::Rapid { to } => Some(*to),
        _ => None,
    })?;
    Some(Point::new(to.x + program.origin.x, to.y + program.origin.y))
}
