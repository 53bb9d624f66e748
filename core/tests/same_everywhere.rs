//! Tests that the same programs give the same steps in a browser and natively: both are compared with one
//! golden file. `ANNULUS_BLESS=1` accepts a change, natively only.

use crate::programs::{Chance, machines, random_program};
use annulus_core::motion::timeline;
use annulus_core::steps;
use std::fmt::Write;

/// Digest and length of many streams, for native and browser alike.
fn digests() -> String {
    let mut text = String::new();
    for machine in machines() {
        for seed in 0..12 {
            let program = random_program(&mut Chance::new(seed), &machine, 40);
            let stream =
                timeline(&program, &machine).and_then(|plan| steps::stream(&plan, &machine)).unwrap();
            let (digest, bytes) = (steps::digest(&stream), steps::encoded_len(&stream));
            writeln!(text, "{} {seed} {digest} {bytes}", machine.name).unwrap();
        }
    }
    text
}

#[cfg_attr(target_arch = "wasm32", wasm_bindgen_test::wasm_bindgen_test)]
#[cfg_attr(not(target_arch = "wasm32"), test)]
fn streams_are_the_same_in_the_browser_and_natively() {
    #[cfg(not(target_arch = "wasm32"))]
    if std::env::var_os("ANNULUS_BLESS").is_some() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/digests.txt");
        return std::fs::write(file, digests()).unwrap();
    }
    assert_eq!(digests(), include_str!("golden/digests.txt"));
}
