//! Message about the magazine, the spindle and the state of a tool change.

use crate::magazine::{ChangeStep, ToolStock};
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MagazineReport {
    pub stock: ToolStock,
    /// A tool change is running; `stock` holds its step.
    pub changes: bool,
    /// Step with which a stopped change resumes. None if the user must check the tool first, or if no change
    /// stopped.
    pub goes_on_with: Option<ChangeStep>,
}
