//! What lies in the magazine and the spindle, and how a change of tools stands, as a page hears of it.
//!
//! Comes in and goes out: plain data. Does not know who changes tools.

use crate::magazine::{ChangeStep, ToolStock};
use serde::{Deserialize, Serialize};

/// Which tool lies where.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MagazineReport {
    /// What is known.
    pub stock: ToolStock,
    /// A change is in work; its step is in `stock`.
    pub changes: bool,
    /// The step with which a change that stopped goes on; none where a person has to look first, or none stopped.
    pub goes_on_with: Option<ChangeStep>,
}
