//! Checks of a side's toolpaths: missing features, duplicates, parts that get loose. Makes no toolpaths.

pub(super) mod duplicates;
pub(super) mod holding;
pub(super) mod no_clearance;
pub(super) mod no_tool;
pub(super) mod outside_outline;
pub(super) mod tab_strength;
