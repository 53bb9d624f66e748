//! The workers that are asked: one knows the board, one looks through templates, and one comes and goes with each request
//! beside them.
//!
//! Comes in: requests with their numbers. Goes out: their progress and answers as events. Does not know what is asked.

use crate::engine::Engine;
use crate::engine::messages::Request;
use crate::model::{Event, Lane};
use crate::page::send;

/// The workers that stay.
#[derive(Default)]
pub(super) struct Workers {
    board: Engine,
    template: Engine,
}

impl Workers {
    /// Hands a request over; its answer comes as an event.
    pub(super) fn ask(&self, lane: Lane, number: u32, request: Request) {
        let engine = match lane {
            Lane::Board => self.board.clone(),
            Lane::Template => self.template.clone(),
            Lane::Beside => Engine::new(),
        };
        // Handed over at once, so that what is called off behind it is called off.
        let answer = engine.ask(request, move |share| send(Event::Progress { number, share }));
        leptos::task::spawn_local(async move {
            let answer = answer.await;
            drop(engine);
            send(Event::Answered { number, answer });
        });
    }

    /// Ends whatever the worker of the board does.
    pub(super) fn call_off(&self) {
        self.board.cancel();
    }
}
