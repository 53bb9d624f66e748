//! Every test that needs more than one module, in one program, so that it is linked once.

mod carved_copper;
mod codes;
mod corpus_cam;
mod corpus_drill;
mod corpus_gerber;
mod dependencies;
mod drill_everyday;
mod drill_rows;
mod drill_units;
mod faults;
mod floor_plan;
mod hostile_gerber;
mod languages;
mod module_graph;
mod mutations;
mod named_fields;
mod one_noun;
mod page_floors;
mod page_words;
mod pairing;
mod public_words;
#[allow(
    clippy::disallowed_methods,
    reason = "a checker apart from the product computes with what the platform has"
)]
mod raster_sweep;
mod rows;
mod sentence_words;
mod tours;
mod units;
