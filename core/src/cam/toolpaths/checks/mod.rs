//! What is looked at before a side's toolpaths are handed on: what is left out, what is there twice, what would come loose.
//!
//! Comes in: operations, holes, toolpaths. Goes out: diagnostics, and what is to be left out. Makes no toolpath.

pub(super) mod duplicates;
pub(super) mod holding;
pub(super) mod no_clearance;
pub(super) mod no_tool;
pub(super) mod outside_outline;
pub(super) mod tab_strength;
