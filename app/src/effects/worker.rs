//! The workers that are asked: one knows the board, one looks through templates, and one comes and goes with each request beside them.
//! So does the one that times what is proved: the times of a large board take memory that nobody needs afterwards.
//!
//! Comes in: requests with their numbers. Goes out: their progress and answers as events. Does not know what is asked.

use crate::engine::messages::Request;
use crate::engine::{Engine, PassingEngine};
use crate::model::{Event, Lane};
use crate::page::send;
use std::cell::RefCell;

/// The workers that stay.
#[derive(Default)]
pub(super) struct Workers {
    board: Engine,
    times: RefCell<PassingEngine>,
    template: Engine,
}

impl Workers {
    /// The worker of `lane`, where one is there.
    fn there(&self, lane: Lane) -> Option<Engine> {
        match lane {
            Lane::Board => Some(self.board.clone()),
            Lane::Template => Some(self.template.clone()),
            Lane::Times => self.times.borrow().there(),
            Lane::Beside => None,
        }
    }

    /// Hands a request over; its answer comes as an event.
    pub(super) fn ask(&self, lane: Lane, number: u32, request: Request) {
        let engine = match lane {
            Lane::Board | Lane::Template => self.there(lane).unwrap_or_default(),
            Lane::Times | Lane::Beside => Engine::new(),
        };
        if lane == Lane::Times {
            self.times.replace(engine.passing());
        }
        // Handed over at once, so that what is called off behind it is called off.
        let answer = engine.ask(request, move |share| send(Event::Progress { number, share }));
        leptos::task::spawn_local(async move {
            let answer = answer.await;
            drop(engine);
            send(Event::Answered { number, answer });
        });
    }

    /// Ends whatever the worker of `lane` does.
    pub(super) fn call_off(&self, lane: Lane) {
        if let Some(engine) = self.there(lane) {
            engine.cancel();
        }
    }
}
