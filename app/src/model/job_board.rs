//! The board of the job that the machine has, in a page that was opened later: after a reload in mid-job the kept project is opened
//! again by itself, for its outline and copper on the map.
//!
//! ```text
//!  machine: job "clockblock-top" ─┐
//!  store: "clockblock", "robot" ──┴─ Machine on show, nothing open ─▶ "clockblock" is opened; Machine stays on show
//! ```
//!
//! Comes in: the job, what is kept. Goes out: what is to be restored, once a job, or offered; the outline, where the open board is
//! that of a program. Does not know the store.

use super::{Effect, KeepEvent, Model, Offer, OnTheWay, keeping};
use crate::keys::Tab;
use annulus_core::board::{Board, Face};
use annulus_core::geometry::{Point, Region};
use annulus_core::job::{Command, Leg, Mark, Program};
use annulus_core::units::Length;
use std::collections::BTreeSet;

/// A hole of a program is one of a board where they are no farther apart than this.
const SAME_PLACE: Length = Length::from_um(1);

/// What was opened for the machine's job.
#[derive(Clone, Debug, Default)]
pub(super) struct JobBoard {
    /// The job that a board was looked for last.
    job: Option<String>,
    /// Where the board that is being opened for it is kept.
    place: Option<u32>,
}

impl JobBoard {
    /// Whether what is kept at `place` is opened for the machine's job, and not because a person asked for it.
    pub(super) fn is_at(&self, place: Option<u32>) -> bool {
        place.is_some() && self.place == place
    }
}

/// Opens the board of the machine's job, where it is kept in this browser and nothing else is open.
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

/// What of `offers`, the latest first, is to be restored beside the machine: the board of the job that was broken off, else what was
/// open last.
pub fn to_restore<'o>(broken_off: Option<&str>, offers: &'o [Offer]) -> Option<&'o Offer> {
    let of_job = |program: &str| offers.iter().find(|offer| is_called(program, &offer.name));
    broken_off.and_then(of_job).or_else(|| offers.first())
}

/// Whether a program is called as those of a side of the board `name` are.
fn is_called(program: &str, name: &str) -> bool {
    let face = program.strip_prefix(name).and_then(|rest| rest.strip_prefix('-'));
    !name.is_empty()
        && face.is_some_and(|face| [Face::Top, Face::Bottom].iter().any(|one| one.name() == face))
}

/// The outline of `board`, as it lies with its work zero at `origin`, where it is the board of `program`: it is called so, lies so, and
/// has all holes that the program drills.
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

/// Where a leg goes first, in the files' coordinates.
pub fn place(program: &Program, leg: &Leg) -> Option<Point> {
    let to = leg.commands.iter().find_map(|command| match command {
        Command::Rapid { to } => Some(*to),
        _ => None,
    })?;
    Some(Point::new(to.x + program.origin.x, to.y + program.origin.y))
}
