//! Times every work natively. `cargo xtask bench` runs it, then the same works in WebAssembly.

use annulus_speed::works;
use std::time::Instant;

/// Repetitions per work; the best time counts.
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
