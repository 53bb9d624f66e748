//! The workers: one holds the board, one checks templates, and one exists per further request. The one that
//! computes the times of a plan also ends with its answer, because the times of a large board need much
//! memory.

use crate::engine::messages::Request;
use crate::engine::{Engine, PassingEngine};
use crate::model::{Event, Lane};
use crate::page::send;
use std::cell::RefCell;

#[derive(Default)]
pub(super) struct Workers {
    board: Engine,
    times: RefCell<PassingEngine>,
    template: Engine,
}

impl Workers {
    /// The worker of `lane`, if it exists.
    fn there(&self, lane: Lane) -> Option<Engine> {
        match lane {
            Lane::Board => Some(self.board.clone()),
            Lane::Template => Some(self.template.clone()),
            Lane::Times => self.times.borrow().there(),
            Lane::Beside => None,
        }
    }

    /// Sends a request; its answer arrives as an event.
    pub(super) fn ask(&self, lane: Lane, number: u32, request: Request) {
        let engine = match lane {
            Lane::Board | Lane::Template => self.there(lane).unwrap_or_default(),
            Lane::Times | Lane::Beside => Engine::new(),
        };
        if lane == Lane::Times {
            self.times.replace(engine.passing());
        }
        // Sent before any await, so that a later cancel applies to it.
        let answer = engine.ask(request, move |share| send(Event::Progress { number, share }));
        leptos::task::spawn_local(async move {
            let answer = answer.await;
            drop(engine);
            send(Event::Answered { number, answer });
        });
    }

    /// Terminates the worker of `lane`.
    pub(super) fn call_off(&self, lane: Lane) {
        if let Some(engine) = self.there(lane) {
            engine.cancel();
        }
    }
}
