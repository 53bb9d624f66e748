//! Tests of `annulus firmware flash`: what it refuses, and what it copies. A folder replaces the board's
//! disk, a pseudo-terminal the user.

use crate::server::client::{Running, annulus, output};
use annulus_link::adapter::{Adapter, Inputs};
use annulus_link::frame::ON_LINE;
use annulus_link::message::Welcome;
use annulus_link::store::Store;
use serde_json::Value;
use serialport::{SerialPort, TTYPort};
use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tempfile::TempDir;

fn firmware() -> Vec<u8> {
    let mut out = Vec::new();
    let head: [u32; 8] = [0x0A32_4655, 0x9E5D_5157, 0x2000, 0x1000_0000, 256, 0, 1, 0xE48B_FF56];
    head.iter().for_each(|word| out.extend(word.to_le_bytes()));
    out.extend(b"Annulus step adapter, sources 305419896.");
    out.resize(508, 0);
    out.extend(0x0AB1_6F30_u32.to_le_bytes());
    out
}

/// A computer with the file and a board in boot mode.
struct Desk {
    home: TempDir,
    file: PathBuf,
    disk: PathBuf,
}

impl Desk {
    fn new() -> Self {
        let home = TempDir::new().unwrap();
        let (file, disk) = (home.path().join("annulus-adapter.uf2"), home.path().join("RPI-RP2"));
        fs::write(&file, firmware()).unwrap();
        fs::create_dir(&disk).unwrap();
        fs::write(disk.join("INFO_UF2.TXT"), "UF2 Bootloader v3.0\r\nBoard-ID: RPI-RP2\r\n").unwrap();
        Self { home, file, disk }
    }

    /// Types `word` in the terminal. Returns the exit code and the code of the refusal.
    fn typed(&self, word: &str, disk: &Path) -> (i32, Value) {
        self.flashed(word, disk, &["--no-wait"])
    }

    fn flashed(&self, word: &str, disk: &Path, more: &[&str]) -> (i32, Value) {
        let (mut person, terminal) = TTYPort::pair().unwrap();
        let name = terminal.name().unwrap();
        let input = File::options().read(true).write(true).open(name).unwrap();
        let file = self.file.display().to_string();
        let named = disk.display().to_string();
        let arguments = ["firmware", "flash", &file, "--disk", &named, "--json"];
        let mut command = annulus(&self.home, &[&arguments[..], more].concat());
        writeln!(person, "{word}").unwrap();
        let output = command.stdin(input).output().unwrap();
        let object: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
        (output.status.code().unwrap_or(-1), object)
    }

    fn is_written(&self) -> bool {
        self.disk.join("annulus-adapter.uf2").exists()
    }
}

fn code(object: &Value) -> &str {
    object["error"]["code"].as_str().unwrap_or_default()
}

struct CameBack {
    name: String,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    _theirs: TTYPort,
}

impl CameBack {
    fn with(firmware: u32) -> Self {
        let (mut own, theirs) = TTYPort::pair().unwrap();
        own.set_timeout(Duration::from_millis(5)).unwrap();
        let ends = Arc::new(AtomicBool::new(false));
        let over = Arc::clone(&ends);
        let thread = thread::spawn(move || {
            let (mut store, since) = (Box::<Store>::default(), Instant::now());
            let mut adapter = Adapter::new(Welcome { firmware, ..Welcome::default() }, &mut store);
            let (mut bytes, mut line) = ([0; 1024], [0; ON_LINE]);
            while !over.load(Ordering::SeqCst) {
                let count = own.read(&mut bytes).unwrap_or(0);
                let now_us = since.elapsed().as_micros() as u32;
                bytes[..count].iter().for_each(|byte| adapter.hear(*byte, now_us));
                while adapter.obey_next() {}
                adapter.attend(Inputs::default(), now_us);
                while let Some(length) = adapter.tell(now_us, &mut line) {
                    let _ = own.write_all(&line[..length]);
                }
            }
        });
        Self { name: theirs.name().unwrap(), ends, thread: Some(thread), _theirs: theirs }
    }
}

impl Drop for CameBack {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::SeqCst);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

#[test]
fn firmware_is_flashed_only_after_typed_confirmation() {
    let desk = Desk::new();
    let (file, disk) = (desk.file.display().to_string(), desk.disk.display().to_string());
    let (exit, object, _) =
        output(&desk.home, &["firmware", "flash", &file, "--disk", &disk, "--no-wait", "--json"]);
    assert_eq!((exit, code(&object)), (1, "firmware.no_person"));
    let (exit, object) = desk.typed("flash it", &desk.disk);
    assert_eq!((exit, code(&object)), (130, "firmware.not_confirmed"));
    let (exit, object) = desk.typed("FLASH", desk.home.path());
    assert_eq!((exit, code(&object)), (3, "firmware.no_boot_disk"));
    assert!(!desk.is_written());
    let (exit, object) = desk.typed("FLASH", &desk.disk);
    assert_eq!((exit, object["firmware"].as_str()), (0, Some("12345678")), "{object}");
    assert_eq!(fs::read(desk.disk.join("annulus-adapter.uf2")).unwrap(), firmware());
}

#[test]
fn bad_firmware_files_are_refused_before_flashing() {
    let desk = Desk::new();
    let mut stranger = firmware();
    stranger[40] = b'x';
    for (bytes, wanted) in [
        (&firmware()[..300], "firmware.damaged"),
        (&stranger[..], "firmware.stranger"),
        (&[0; 5 << 20][..], "firmware.unreadable"),
    ] {
        fs::write(&desk.file, bytes).unwrap();
        let (exit, object) = desk.typed("FLASH", &desk.disk);
        assert_eq!(code(&object), wanted, "{exit} {object}");
    }
    fs::remove_file(&desk.file).unwrap();
    assert_eq!(code(&desk.typed("FLASH", &desk.disk).1), "firmware.unreadable");
    assert!(!desk.is_written());
}

#[test]
fn running_bridge_refuses_flashing() {
    let desk = Desk::new();
    let Desk { home, file, disk } = desk;
    let mut bridge = Running::start_in(home);
    let desk = Desk { home: bridge.home.take().unwrap(), file, disk };
    let (exit, object) = desk.typed("FLASH", &desk.disk);
    assert_eq!((exit, code(&object)), (3, "firmware.bridge_runs"));
    assert!(!desk.is_written());
}

#[test]
fn flashed_adapter_must_report_the_new_firmware() {
    let desk = Desk::new();
    for (firmware, exit, wanted) in [(0x1234_5678, 0, ""), (0x1234_5679, 3, "firmware.not_taken")] {
        let adapter = CameBack::with(firmware);
        let found = desk.flashed("FLASH", &desk.disk, &["--port", &adapter.name]);
        assert_eq!((found.0, code(&found.1)), (exit, wanted), "{}", found.1);
        assert!(desk.is_written());
        if exit == 0 {
            assert_eq!(found.1["firmware"], "12345678");
            assert_eq!(found.1["port"], adapter.name.as_str());
        } else {
            let said = found.1["error"]["message"].as_str().unwrap();
            assert!(said.contains("12345679") && said.contains("12345678"), "{said}");
        }
    }
}
