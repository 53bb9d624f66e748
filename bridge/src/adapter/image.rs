//! Checks firmware files (UF2), and finds the disks of boards in boot mode.

use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use std::fs;
use std::path::{Path, PathBuf};

/// Longest accepted file, in bytes: twice the flash, as half of each block is payload.
pub(crate) const LONGEST: u64 = 4 << 20;

/// Text in the flash before the firmware's checksum.
const ABOUT: &[u8] = b"Annulus step adapter, sources ";

/// Size of a block, and of its payload.
const BLOCK: usize = 512;
const CARRIED: usize = 256;

const HEAD: [u32; 2] = [0x0A32_4655, 0x9E5D_5157];
const TAIL: u32 = 0x0AB1_6F30;
const FAMILY_OF_RP2040: u32 = 0xE48B_FF56;
const FLASH: std::ops::Range<u32> = 0x1000_0000..0x1020_0000;

/// The checksum of our firmware in a file, or why the file is no such firmware.
pub(crate) fn firmware_of(bytes: &[u8]) -> Result<u32, Diagnostic> {
    let damaged = |block: usize| error!("firmware.damaged", block = block + 1, ..);
    let count = bytes.len() / BLOCK;
    if count == 0 || !bytes.len().is_multiple_of(BLOCK) {
        return Err(damaged(count));
    }
    let mut flash = Vec::with_capacity(count * CARRIED);
    for (index, block) in bytes.chunks_exact(BLOCK).enumerate() {
        let carried = carried(block, index, count).ok_or_else(|| damaged(index))?;
        flash.extend_from_slice(carried);
    }
    let stranger = || error!("firmware.stranger", ..);
    let at = flash.windows(ABOUT.len()).position(|window| window == ABOUT).ok_or_else(stranger)?;
    let digits = flash.iter().skip(at + ABOUT.len()).take_while(|byte| byte.is_ascii_digit());
    let digits: String = digits.map(|digit| char::from(*digit)).collect();
    digits.parse().map_err(|_| stranger())
}

/// The payload of a block, if it is block `index` of `count` for the flash of an RP2040.
fn carried(block: &[u8], index: usize, count: usize) -> Option<&[u8]> {
    let word = |at: usize| Some(u32::from_le_bytes(block.get(at..at + 4)?.try_into().ok()?));
    let address = word(12)?;
    let is_one = [word(0)?, word(4)?] == HEAD
        && word(BLOCK - 4)? == TAIL
        && word(16)? as usize == CARRIED
        && [word(20)? as usize, word(24)? as usize] == [index, count]
        && word(28)? == FAMILY_OF_RP2040
        && FLASH.contains(&address)
        && address.is_multiple_of(CARRIED as u32);
    block.get(32..32 + CARRIED).filter(|_| is_one)
}

/// Returns `true` if `folder` is the disk of an RP2040 in boot mode: a file identifies it.
pub(crate) fn is_boot_disk(folder: &Path) -> bool {
    let said = fs::read_to_string(folder.join("INFO_UF2.TXT")).unwrap_or_default();
    said.len() < 1024 && said.lines().any(|line| line.trim() == "Board-ID: RPI-RP2")
}

pub(crate) fn boot_disks() -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = if cfg!(windows) {
        ('D'..='Z').map(|letter| PathBuf::from(format!("{letter}:\\"))).collect()
    } else {
        let within = |folder: &PathBuf| -> Vec<PathBuf> {
            fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
        };
        let roots = ["/media", "/run/media", "/mnt", "/Volumes"].map(PathBuf::from);
        let outer: Vec<PathBuf> = roots.iter().flat_map(within).collect();
        // Some systems mount below a folder named after the user.
        let inner: Vec<PathBuf> = outer.iter().flat_map(within).collect();
        outer.into_iter().chain(inner).collect()
    };
    folders.retain(|folder| is_boot_disk(folder));
    folders
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(text: &str) -> Vec<u8> {
        let mut flash = vec![0_u8; 2 * CARRIED];
        flash[240..240 + text.len()].copy_from_slice(text.as_bytes());
        let mut out = Vec::new();
        for (index, part) in flash.chunks(CARRIED).enumerate() {
            let address = FLASH.start + (index * CARRIED) as u32;
            let head = [HEAD[0], HEAD[1], 0x2000, address, CARRIED as u32, index as u32, 2, FAMILY_OF_RP2040];
            head.iter().for_each(|word| out.extend(word.to_le_bytes()));
            out.extend(part);
            out.extend([0; 220]);
            out.extend(TAIL.to_le_bytes());
        }
        out
    }

    #[test]
    fn damaged_and_foreign_firmware_files_are_refused() {
        let good = file("Annulus step adapter, sources 3141592653.");
        assert_eq!(firmware_of(&good), Ok(3_141_592_653));
        let code = |bytes: &[u8]| firmware_of(bytes).unwrap_err().code;
        for (at, value) in [(0, 1), (12, 1), (15, 0x20), (16, 1), (20, 7), (28, 0), (508, 0), (512 + 20, 0)] {
            let mut bad = good.clone();
            bad[at] = value;
            assert_eq!(code(&bad), "firmware.damaged", "{at}");
        }
        assert_eq!([code(&[]), code(&good[..700]), code(&good[..512])], ["firmware.damaged"; 3]);
        assert_eq!(code(&file("some blinking light")), "firmware.stranger");
        assert_eq!(code(&file("Annulus step adapter, sources .")), "firmware.stranger");
    }

    #[test]
    fn boot_disk_is_identified_by_its_info_file() {
        let folder = tempfile::TempDir::new().unwrap();
        assert!(!is_boot_disk(folder.path()));
        let says = |text: &str| fs::write(folder.path().join("INFO_UF2.TXT"), text).unwrap();
        says("UF2 Bootloader v3.0\nModel: Another\nBoard-ID: OTHER\n");
        assert!(!is_boot_disk(folder.path()));
        says("UF2 Bootloader v3.0\r\nModel: Raspberry Pi RP2\r\nBoard-ID: RPI-RP2\r\n");
        assert!(is_boot_disk(folder.path()));
    }
}
