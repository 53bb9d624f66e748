//! Puts the memory map where the linker finds it, and passes the checksum of the sources to the program.

use std::path::{Path, PathBuf};
use std::{env, fs};

include!("sources.rs");

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo says where"));
    fs::write(out.join("memory.x"), include_bytes!("memory.x")).expect("the folder can be written");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-env=ANNULUS_SOURCES={}", firmware_sources(Path::new(".")));
}
