//! Every test that needs more than one module, in one program, so that it is linked once.

mod corpus_cam;
mod corpus_drill;
mod corpus_gerber;
mod drill_everyday;
mod drill_rows;
mod faults;
mod floor_plan;
mod hostile_gerber;
mod mutations;
mod page_words;
mod pairing;
mod raster_sweep;
mod tours;
