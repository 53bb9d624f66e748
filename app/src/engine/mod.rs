//! Long work, done in a worker so that the page never waits: reading, planning, timing.
//!
//! ```text
//! engine.read(files).await ─▶ Reading ─ engine.plan(board).await ─▶ Planned ─ engine.time(program).await ─▶ Timed
//! ```
//!
//! Comes in: files, boards, programs. Goes out: futures of what became of them; remarks where it is refused. Does not know
//! what the page shows.

mod exporting;
mod mesh;
pub mod messages;
mod planning;
mod proving;
mod shelf;
mod work;
mod writing;

#[cfg(target_arch = "wasm32")]
mod desk;
#[cfg(target_arch = "wasm32")]
pub mod worker;

pub use shelf::Shelf;
pub use work::perform;

use annulus_core::remark::Remark;

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Stopped {
    /// It was called off.
    Cancelled,
    /// It cannot be done, for these reasons.
    Refused(Vec<Remark>),
}

#[cfg(target_arch = "wasm32")]
pub use handle::Engine;

#[cfg(target_arch = "wasm32")]
mod handle {
    use super::messages::{
        Answer, Checked, Exported, Planned, Proved, Reading, Request, Timed, ToExport, ToOpen, ToPlan,
        ToProve, ToRead, ToTime, ToWrite,
    };
    use super::{Stopped, desk};
    use annulus_core::project::saved::Project;
    use std::cell::RefCell;
    use std::rc::Rc;

    /// A worker of the page's own. Cheap to clone: clones share the worker. Requests are done one after the other; two
    /// engines work side by side.
    #[derive(Clone, Default)]
    pub struct Engine(Rc<RefCell<desk::Desk>>);

    impl Engine {
        /// An engine; its worker starts with the first request.
        pub fn new() -> Self {
            Self::default()
        }

        /// Takes a saved project apart.
        pub async fn open(&self, wanted: ToOpen) -> Result<Project, Stopped> {
            match desk::ask(&self.0, Request::Open(wanted), Box::new(|_| {})).await? {
                Answer::Opened(project) => Ok(project),
                _ => Err(Stopped::Cancelled),
            }
        }

        /// Makes the file of a project.
        pub async fn save(&self, project: Project) -> Result<Vec<u8>, Stopped> {
            match desk::ask(&self.0, Request::Save(project), Box::new(|_| {})).await? {
                Answer::Saved(bytes) => Ok(bytes),
                _ => Err(Stopped::Cancelled),
            }
        }

        /// Reads files and makes the board of some of them.
        pub async fn read(&self, wanted: ToRead) -> Result<Reading, Stopped> {
            match desk::ask(&self.0, Request::Read(wanted), Box::new(|_| {})).await? {
                Answer::Read(reading) => Ok(*reading),
                _ => Err(Stopped::Cancelled),
            }
        }

        /// Plans a board; `progress` is told shares from 0 to 1.
        pub async fn plan(
            &self,
            wanted: ToPlan,
            progress: impl FnMut(f64) + 'static,
        ) -> Result<Planned, Stopped> {
            match desk::ask(&self.0, Request::Plan(wanted), Box::new(progress)).await? {
                Answer::Planned(planned) => Ok(*planned),
                _ => Err(Stopped::Cancelled),
            }
        }

        /// Proves a program against the copper of the board.
        pub async fn prove(&self, wanted: ToProve) -> Result<Proved, Stopped> {
            match desk::ask(&self.0, Request::Prove(wanted), Box::new(|_| {})).await? {
                Answer::Proved(proved) => Ok(proved),
                _ => Err(Stopped::Cancelled),
            }
        }

        /// Writes all sides of a job in a controller's words; `progress` is told shares from 0 to 1.
        pub async fn export(
            &self,
            wanted: ToExport,
            progress: impl FnMut(f64) + 'static,
        ) -> Result<Exported, Stopped> {
            match desk::ask(&self.0, Request::Export(wanted), Box::new(progress)).await? {
                Answer::Exported(exported) => Ok(*exported),
                _ => Err(Stopped::Cancelled),
            }
        }

        /// Looks for faults in a dialect.
        pub async fn check(&self, wanted: ToWrite) -> Result<Checked, Stopped> {
            match desk::ask(&self.0, Request::Check(wanted), Box::new(|_| {})).await? {
                Answer::Checked(checked) => Ok(checked),
                _ => Err(Stopped::Cancelled),
            }
        }

        /// Times a program.
        pub async fn time(&self, wanted: ToTime) -> Result<Timed, Stopped> {
            match desk::ask(&self.0, Request::Time(wanted), Box::new(|_| {})).await? {
                Answer::Timed(timed) => Ok(timed),
                _ => Err(Stopped::Cancelled),
            }
        }

        /// Calls off whatever is in work; who waits is told [`Stopped::Cancelled`].
        pub fn cancel(&self) {
            desk::cancel(&self.0);
        }

        /// Whether anything is in work.
        pub fn busy(&self) -> bool {
            desk::busy(&self.0)
        }
    }
}
