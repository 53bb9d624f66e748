//! The command line as the client of a station: requests for the engine in, all notices of it out, in order.
//! Its job may be plain G-code without a program.

use super::attended::Told;
use super::station::Station;
use crate::files::Files;
use annulus_core::grbl::{EngineAsk, EngineEvent};

impl<F: Files> Station<F> {
    /// Passes a request of the command line to the engine. [`Told::Handled`] follows its results.
    pub fn command(&mut self, ask: EngineAsk) {
        self.look_at_host();
        self.is_late &= !matches!(ask, EngineAsk::Resume | EngineAsk::Stop);
        self.engine(EngineEvent::Ask(ask));
        self.notice(Told::Handled);
    }

    /// The user is present and knows the machine's state: a hold because of absence is no longer needed.
    pub fn attend(&mut self) {
        self.look_at_host();
        self.is_late = false;
    }

    /// Adds a notice for the command line, if it is the client.
    pub fn notice(&mut self, told: Told) {
        if let Some(notices) = &mut self.notices {
            notices.push(told);
        }
    }

    /// Takes the notices for the command line, in order.
    pub fn notices(&mut self) -> Vec<Told> {
        self.notices.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Returns `true` if the command line is the client.
    pub(super) fn is_for_command(&self) -> bool {
        self.notices.is_some()
    }
}
