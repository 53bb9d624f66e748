//! Times every work here. `cargo xtask bench` runs it and then does the same works in WebAssembly.
//!
//! Goes out: a line for each work on standard output: name, best time in ms, what was made; apart by tabs.

use annulus_speed::works;
use std::time::Instant;

/// Each work is done so often; the best time counts.
const ROUNDS: usize = 5;

fn main() {
    for work in 0..works::COUNT {
        let made = works::run(work);
        let timed = || {
            let began = Instant::now();
            works::run(work);
            began.elapsed().as_secs_f64() * 1e3
        };
        let best = std::iter::repeat_with(timed).take(ROUNDS).fold(f64::INFINITY, f64::min);
        println!("{}\t{best}\t{made}", works::name(work));
    }
}
