//! Puts the map of the memory where the linker looks, and tells the program which sources it was made of.

use annulus_link::crc::crc32c;
use std::path::{Path, PathBuf};
use std::{env, fs};

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of sources").flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found)
        } else {
            found.push(path)
        }
    }
}

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo says where"));
    fs::write(out.join("memory.x"), include_bytes!("memory.x")).expect("the folder can be written");
    println!("cargo:rustc-link-search={}", out.display());
    let mut found = Vec::new();
    for folder in ["src", "../../link/src"] {
        println!("cargo:rerun-if-changed={folder}");
        sources(Path::new(folder), &mut found);
    }
    println!("cargo:rerun-if-changed=memory.x");
    found.push("Cargo.lock".into());
    found.sort();
    let bytes: Vec<u8> = found.iter().flat_map(|file| fs::read(file).unwrap_or_default()).collect();
    println!("cargo:rustc-env=ANNULUS_SOURCES={}", crc32c(&bytes));
}
