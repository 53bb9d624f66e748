//! Long tasks in a worker, so that the page stays responsive.
//!
//! ```text
//! engine.ask(Request).await ─▶ Answer        reading, planning, proving, timing, writing
//! ```

mod board_files;
mod cache;
mod exporting;
mod mesh;
pub mod messages;
mod planning;
mod proving;
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

    #[derive(Clone, Default)]
    pub struct PassingEngine(Weak<RefCell<requests::Requests>>);

    impl PassingEngine {
        pub fn there(&self) -> Option<Engine> {
            self.0.upgrade().map(Engine)
        }
    }
}

/// A progress callback for a part that covers the per cent `from` to `to` of the whole.
fn part(whole: &mut dyn FnMut(u64, u64), from: u64, to: u64) -> impl FnMut(u64, u64) {
    move |done, total: u64| {
        let total = total.max(1);
        whole(from * total + to.saturating_sub(from) * done.min(total), 100 * total);
    }
}

#[cfg(test)]
mod tests {
    use super::part;

    #[test]
    fn partial_progress_maps_onto_its_share_of_the_whole() {
        let mut told = Vec::new();
        let mut whole = |done: u64, total: u64| told.push(done * 100 / total);
        let mut half = part(&mut whole, 40, 60);
        [(0, 4), (1, 4), (4, 4), (5, 4), (0, 0)].into_iter().for_each(|(done, total)| half(done, total));
        drop(half);
        assert_eq!(told, [40, 45, 60, 60, 40]);
    }
}
