//! Fuzzes `annulus_tests::targets::gerber`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| annulus_tests::targets::gerber(bytes));
