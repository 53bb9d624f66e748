//! Builds the firmware of the USB step adapter with the stable compiler. The result is a UF2 file, which a
//! board in boot mode accepts as on a disk.
//!
//! If no compiled `core` library for that processor is available, it is built from source.
//!
//! ```text
//! bridge/firmware ─ cargo ─▶ ELF ─ loaded segments ─▶ blocks of 256 bytes ─▶ target/firmware/annulus-adapter.uf2
//! ```

use crate::npm;
use crate::sh::{Done, command, output, root, run, say, target, which};
use crate::suites::ALL;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const TRIPLE: &str = "thumbv6m-none-eabi";

/// Address and size of the chip's flash and memory, in bytes.
const FLASH: (u32, u32) = (0x1000_0000, 2 << 20);
const RAM: (u32, u32) = (0x2000_0000, 256 << 10);

/// Builds it, and reports its size. Returns the ELF file.
pub(crate) fn build() -> Done<PathBuf> {
    let folder = folder();
    let into = target().join("firmware");
    let mut cargo = command("cargo", &["build", "--release", "--locked"]);
    if !has_target() {
        // The stable compiler accepts this option only with `RUSTC_BOOTSTRAP`.
        cargo.args(["-Z", "build-std=core"]).env("RUSTC_BOOTSTRAP", "1");
        ensure_sources()?;
    }
    run(cargo.arg("--target-dir").arg(&into).current_dir(&folder))?;
    let elf = into.join(TRIPLE).join("release/annulus-firmware");
    let bytes = read(&elf)?;
    let parts = parts(&bytes).ok_or_else(|| no_elf(&elf))?;
    let uf2 = into.join("annulus-adapter.uf2");
    fs::write(&uf2, blocks(&parts)).map_err(|error| format!("{}: {error}.", uf2.display()))?;
    let (flash, ram) = taken(&parts);
    say(&format!(
        "firmware: {flash} of {} bytes of flash, {ram} of {} bytes of memory, which leaves {} for the stack",
        FLASH.1,
        RAM.1,
        RAM.1.saturating_sub(ram)
    ));
    say(&format!("for a board in its boot mode: {}", uf2.display()));
    Ok(elf)
}

fn read(elf: &Path) -> Done<Vec<u8>> {
    fs::read(elf).map_err(|error| format!("{}: {error}.", elf.display()))
}

fn no_elf(elf: &Path) -> String {
    format!("{} is not what a linker makes.", elf.display())
}

/// Flash and memory used, in bytes.
fn taken(parts: &[Part<'_>]) -> (u32, u32) {
    let loaded = |part: &&Part<'_>| (FLASH.0..FLASH.0 + FLASH.1).contains(&part.load);
    let flash = parts.iter().filter(loaded).map(|part| part.bytes.len() as u32).sum();
    (flash, parts.iter().filter(|part| part.address >= RAM.0).map(|part| part.in_memory).sum())
}

/// Flash and memory used by the firmware, in bytes, without the stack.
pub(crate) fn sizes(elf: &Path) -> Done<(u32, u32)> {
    parts(&read(elf)?).map(|parts| taken(&parts)).ok_or_else(|| no_elf(elf))
}

/// Builds the firmware and installs its emulator for the tests.
pub(crate) fn emulated() -> Done<PathBuf> {
    let elf = build()?;
    npm::ensure_in(&folder().join("emulator"))?;
    Ok(elf)
}

/// The command that runs the tests of the real firmware in the emulator.
pub(crate) fn tests() -> Done<Command> {
    let elf = emulated()?;
    // Naming all packages reuses what the other suites have built.
    let mut tests = command("cargo", &["test"]);
    tests.args(ALL).args(["--no-fail-fast", "--test", "adapter", "--test", "usb", "--", "--show-output"]);
    tests.env("ANNULUS_FIRMWARE", elf);
    Ok(tests)
}

fn folder() -> PathBuf {
    root().join("bridge/firmware")
}

/// Returns `true` if the current toolchain can compile for the adapter.
pub(crate) fn present() -> bool {
    let sysroot = output(&mut command("rustc", &["--print", "sysroot"])).map(PathBuf::from);
    sysroot.is_some_and(|sysroot| sysroot.join("lib/rustlib").join(TRIPLE).join("lib").is_dir())
}

/// Adds the target if possible. Returns `true` if the toolchain then has it.
fn has_target() -> bool {
    present() || which("rustup").is_some() && run(&mut command("rustup", &["target", "add", TRIPLE])).is_ok()
}

/// Ensures the sources of the standard library, for a toolchain without the target.
fn ensure_sources() -> Done {
    let lies = |root: PathBuf| root.join("lib/rustlib/src/rust/library/core").is_dir();
    if output(&mut command("rustc", &["--print", "sysroot"])).map(PathBuf::from).is_some_and(lies) {
        return Ok(());
    }
    if which("rustup").is_some() {
        return run(&mut command("rustup", &["component", "add", "rust-src"]));
    }
    Err(format!(
        "The compiler has neither the target {TRIPLE} nor the sources of its library. Install one of them: `rustup target add {TRIPLE}`, \
         or `rustup component add rust-src`, or your system's package of the Rust sources."
    ))
}

/// A segment of an ELF file: load address, run address, size in memory, bytes.
struct Part<'a> {
    load: u32,
    address: u32,
    in_memory: u32,
    bytes: &'a [u8],
}

fn number(file: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(file.get(at..at + 4)?.try_into().ok()?))
}

/// The loaded segments of a 32-bit little-endian ELF file.
fn parts(file: &[u8]) -> Option<Vec<Part<'_>>> {
    file.starts_with(b"\x7fELF\x01\x01").then_some(())?;
    let half = |at: usize| Some(usize::from(u16::from_le_bytes(file.get(at..at + 2)?.try_into().ok()?)));
    let (table, size, count) = (number(file, 28)? as usize, half(42)?, half(44)?);
    let mut parts = Vec::new();
    for index in 0..count {
        let field = |place: usize| number(file, table + index * size + 4 * place);
        const LOADED: u32 = 1;
        if field(0)? == LOADED {
            let (from, length) = (field(1)? as usize, field(4)? as usize);
            let bytes = file.get(from..from + length)?;
            parts.push(Part { address: field(2)?, load: field(3)?, in_memory: field(5)?, bytes });
        }
    }
    Some(parts)
}

/// A UF2 file: every flash page in a block of 512 bytes with its address.
fn blocks(parts: &[Part<'_>]) -> Vec<u8> {
    const PAGE: u32 = 256;
    const FAMILY_OF_RP2040: u32 = 0xE48B_FF56;
    const FAMILY_IS_SAID: u32 = 0x2000;
    let mut pages: std::collections::BTreeMap<u32, [u8; PAGE as usize]> = std::collections::BTreeMap::new();
    for part in parts {
        for (address, byte) in (part.load..).zip(part.bytes) {
            pages.entry(address / PAGE).or_insert([0; PAGE as usize])[(address % PAGE) as usize] = *byte;
        }
    }
    let count = pages.len() as u32;
    let mut out = Vec::new();
    for (index, (page, bytes)) in (0_u32..).zip(&pages) {
        let head =
            [0x0A32_4655, 0x9E5D_5157, FAMILY_IS_SAID, page * PAGE, PAGE, index, count, FAMILY_OF_RP2040];
        head.iter().for_each(|word: &u32| out.extend(word.to_le_bytes()));
        out.extend(bytes);
        out.extend([0; 220]);
        out.extend(0x0AB1_6F30_u32.to_le_bytes());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flash_pages_become_addressed_blocks() {
        let bytes: Vec<u8> = (0..300_u32).map(|byte| byte as u8).collect();
        let part = Part { load: 0x1000_0080, address: 0x2000_0000, in_memory: 400, bytes: &bytes };
        let file = blocks(&[part]);
        assert_eq!(file.len(), 2 * 512);
        let word = |at: usize| number(&file, at).unwrap();
        assert_eq!([0, 4, 8].map(word), [0x0A32_4655, 0x9E5D_5157, 0x2000]);
        assert_eq!([12, 16, 20, 24, 28].map(word), [0x1000_0000, 256, 0, 2, 0xE48B_FF56]);
        assert_eq!([512 + 12, 512 + 20, 508, 1020].map(word), [0x1000_0100, 1, 0x0AB1_6F30, 0x0AB1_6F30]);
        assert_eq!(file[32 + 0x80..32 + 0x100], bytes[..0x80]);
        assert_eq!((file[32 + 0x7F], file[512 + 32], file[512 + 32 + 300 - 0x80]), (0, 0x80, 0));
    }

    #[test]
    fn invalid_elf_file_has_no_parts() {
        assert!(parts(b"MZ").is_none() && parts(b"\x7fELF\x01\x01").is_none());
    }
}
