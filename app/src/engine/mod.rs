//! Long tasks in a worker, so that the page stays responsive.
//!
//! ```text
//! engine.ask(Request).await ─▶ Answer        reading, planning, proving, timing, writing
//! ```

mod board_files;
mod cache;
mod comparing;
mod copper;
mod drawn_over;
mod exporting;
mod memory;
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

#[derive(Clone, Debug, PartialEq)]
pub enum Stopped {
    Cancelled,
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

    /// A worker of the page. Clones share it. A worker handles its requests one after the other; several
    /// workers run in parallel.
    #[derive(Clone, Default)]
    pub struct Engine(Rc<RefCell<requests::Requests>>);

    impl Engine {
        /// The worker starts with the first request.
        pub fn new() -> Self {
            Self::default()
        }

        /// Sends `request` at once and returns a future of its answer. `progress` receives shares from 0 to
        /// 1.
        pub fn ask<P: FnMut(f64) + 'static>(
            &self,
            request: Request,
            progress: P,
        ) -> impl Future<Output = Result<Answer, Stopped>> + use<P> {
            requests::ask(&self.0, request, Box::new(progress))
        }

        /// A weak reference, which does not keep the worker alive.
        pub fn passing(&self) -> PassingEngine {
            PassingEngine(Rc::downgrade(&self.0))
        }

        /// Cancels all requests; they are answered with [`Stopped::Cancelled`].
        pub fn cancel(&self) {
            requests::cancel(&self.0);
        }
    }

    /// A weak reference to an engine.
    #[derive(Clone, Default)]
    pub struct PassingEngine(Weak<RefCell<requests::Requests>>);

    impl PassingEngine {
        pub fn there(&self) -> Option<Engine> {
            self.0.upgrade().map(Engine)
        }
    }
}
