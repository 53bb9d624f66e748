//! Long work, done in a worker so that the page never waits: reading, planning, timing.
//!
//! ```text
//! engine.ask(Request).await ─▶ Answer        reading, planning, proving, timing, writing
//! ```
//!
//! Comes in: files, boards, programs. Goes out: futures of what became of them; diagnostics where it is refused. Does not know
//! what the page shows.

mod board_files;
mod cache;
mod comparing;
mod copper;
mod drawn_over;
mod exporting;
mod mesh;
pub mod messages;
mod planning;
mod proving;
mod share;
mod underside;
mod work;
mod writing;

#[cfg(target_arch = "wasm32")]
pub mod drill;
#[cfg(target_arch = "wasm32")]
mod files;
#[cfg(target_arch = "wasm32")]
mod requests;
#[cfg(target_arch = "wasm32")]
pub mod worker;

pub use cache::Cache;
pub use work::perform;

use annulus_core::diagnostic::Diagnostic;

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Stopped {
    /// It was called off.
    Cancelled,
    /// It cannot be done, for these reasons.
    Refused(Vec<Diagnostic>),
}

#[cfg(target_arch = "wasm32")]
pub use handle::{Engine, PassingEngine};

#[cfg(target_arch = "wasm32")]
mod handle {
    use super::messages::{Answer, Request};
    use super::{Stopped, requests};
    use std::cell::RefCell;
    use std::rc::{Rc, Weak};

    /// A worker of the page's own. Cheap to clone: clones share the worker. Requests are done one after the other; two
    /// engines work side by side.
    #[derive(Clone, Default)]
    pub struct Engine(Rc<RefCell<requests::Requests>>);

    impl Engine {
        /// An engine; its worker starts with the first request.
        pub fn new() -> Self {
            Self::default()
        }

        /// Hands `request` over at once; its answer is to be waited for. `progress` is told shares from 0 to 1.
        pub fn ask<P: FnMut(f64) + 'static>(
            &self,
            request: Request,
            progress: P,
        ) -> impl Future<Output = Result<Answer, Stopped>> + use<P> {
            requests::ask(&self.0, request, Box::new(progress))
        }

        /// A hold on this engine that keeps no worker: its worker ends when nothing else has it.
        pub fn passing(&self) -> PassingEngine {
            PassingEngine(Rc::downgrade(&self.0))
        }

        /// Calls off whatever is in work; who waits is told [`Stopped::Cancelled`].
        pub fn cancel(&self) {
            requests::cancel(&self.0);
        }
    }

    /// An engine that others may have let go of.
    #[derive(Clone, Default)]
    pub struct PassingEngine(Weak<RefCell<requests::Requests>>);

    impl PassingEngine {
        /// The engine, where it is still there.
        pub fn there(&self) -> Option<Engine> {
            self.0.upgrade().map(Engine)
        }
    }
}
