//! The workers that are asked: one knows the board, one times what that one proves, one looks through templates, and one comes and
//! goes with each request beside them.
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
    times: Engine,
    template: Engine,
}

impl Workers {
    /// The worker of `lane`, where one stays there.
    fn staying(&self, lane: Lane) -> Option<&Engine> {
        match lane {
            Lane::Board => Some(&self.board),
            Lane::Times => Some(&self.times),
            Lane::Template => Some(&self.template),
            Lane::Beside => None,
        }
    }

    /// Hands a request over; its answer comes as an event.
    pub(super) fn ask(&self, lane: Lane, number: u32, request: Request) {
        let engine = self.staying(lane).cloned().unwrap_or_default();
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
        self.staying(lane).into_iter().for_each(Engine::cancel);
    }
}
