//! All tests that need more than one module, in one program, so that it is linked once.

mod carved_copper;
mod cast;
mod corpus_cam;
mod corpus_drill;
mod corpus_gerber;
mod dependencies;
mod drill_everyday;
mod drill_rows;
mod drill_units;
mod floor_plan;
mod folders;
mod hostile_gerber;
#[allow(
    clippy::disallowed_methods,
    reason = "a checker apart from the product computes with what the platform has"
)]
mod isolation_sweep;
mod languages;
mod manual;
mod module_graph;
mod mutations;
mod page_floors;
mod page_words;
mod pairing;
#[allow(
    clippy::disallowed_methods,
    reason = "a checker apart from the product computes with what the platform has"
)]
mod raster_sweep;
mod tours;
mod weak_names;
