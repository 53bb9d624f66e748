//! Passes the checksum of the matching firmware of the USB step adapter to the drill.

use std::path::Path;

include!("../bridge/firmware/sources.rs");

fn main() {
    let firmware = Path::new(env!("CARGO_MANIFEST_DIR")).join("../bridge/firmware");
    println!("cargo:rustc-env=ANNULUS_FIRMWARE_SOURCES={}", firmware_sources(&firmware));
}
