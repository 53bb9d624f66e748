//! Fuzzes `annulus_tests::targets::job`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| annulus_tests::targets::job(bytes));
