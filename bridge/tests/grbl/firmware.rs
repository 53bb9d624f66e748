//! The simulated controller: finds and builds the firmware, starts and disturbs it, and reads its pins.
//! Every wait has a limit.
//!
//! In steps and seconds of controller time.

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::env;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

pub(crate) const STEPS: f64 = 250.0;
/// Travel of every axis, mm; positions run from minus that to 0.
pub(crate) const TRAVEL: f64 = 200.0;
pub(crate) const SPEED: f64 = 2.0;
/// Seconds after which a controller ends on its own, if its test did not end it.
const MOST: &str = "900";

pub(crate) fn long() -> bool {
    env::var_os("ANNULUS_LONG").is_some()
}

/// The instrument, ready to run; `None` if it is not installed.
pub(crate) fn instrument() -> Option<&'static Instrument> {
    static BUILT: OnceLock<Result<Instrument, String>> = OnceLock::new();
    match BUILT.get_or_init(Instrument::build) {
        Ok(instrument) => Some(instrument),
        Err(why) => {
            assert!(env::var_os("ANNULUS_NOTHING_SKIPPED").is_none(), "{why}");
            println!("skipped: {why}");
            None
        }
    }
}

/// The instrument for long tests only, since the short ones already take four minutes. Tests of `core` and
/// `drill` cover the same engine on every run, though not every word of the command line.
pub(crate) fn long_instrument() -> Option<&'static Instrument> {
    if !long() {
        println!("skipped: a long test, which ANNULUS_LONG runs");
        return None;
    }
    instrument()
}

/// The simulator, and the firmware that it runs.
pub(crate) struct Instrument {
    simulator: PathBuf,
    firmware: PathBuf,
}

impl Instrument {
    fn build() -> Result<Self, String> {
        let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/instruments/grbl");
        let folder = env::var_os("ANNULUS_GRBL").map_or_else(beside, PathBuf::from);
        let source = folder.join("grbl-pty.c");
        if !source.is_file() {
            return Err(format!("no GRBL at {}", folder.display()));
        }
        let built = Path::new(env!("CARGO_TARGET_TMPDIR")).join("grbl-pty");
        let compiled = Command::new("cc")
            .args(["-std=gnu11", "-O2", "-w", "-I/usr/include/simavr", "-o"])
            .arg(&built)
            .arg("-I")
            .arg(&folder)
            .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/instruments/grbl-pty-eeprom.c"))
            .args(["-lsimavr", "-lelf", "-lm"])
            .output()
            .map_err(|error| format!("no C compiler for GRBL: {error}"))?;
        if !compiled.status.success() {
            let said = String::from_utf8_lossy(&compiled.stderr).into_owned();
            return Err(format!("GRBL was not built, simavr is needed: {said}"));
        }
        Ok(Self { simulator: built, firmware: folder.join("grbl-1.1h.elf") })
    }
}

/// A machine of moderate speed, whose jobs take seconds; with limit switches if `homes`.
pub(crate) fn settings(homes: bool) -> Vec<(u16, f64)> {
    let mut all = vec![(22, f64::from(u8::from(homes)))];
    if homes {
        all.extend([(20, 1.0), (24, 600.0), (25, 5000.0), (26, 25.0), (27, 1.0)]);
    }
    for axis in 0..3 {
        all.extend([(100 + axis, STEPS), (110 + axis, 5000.0), (120 + axis, 500.0), (130 + axis, TRAVEL)]);
    }
    all
}

pub(crate) struct Board {
    child: Child,
    /// The simulator reports each connection there, and ends if the pipe is closed.
    _says: BufReader<ChildStdout>,
    folder: tempfile::TempDir,
    start: [f64; 3],
}

impl Board {
    /// Powers up a controller with these settings, its carriage at `start` (mm, 0 is the end with the
    /// switch), and more options of the instrument.
    pub(crate) fn new(
        instrument: &Instrument,
        settings: &[(u16, f64)],
        start: [f64; 3],
        options: &[&str],
    ) -> Self {
        let mut first =
            Self::launch(instrument, tempfile::tempdir().unwrap(), start, &["--speed", "0", "--fast-eeprom"]);
        first.write_settings(settings);
        first.end();
        let folder = tempfile::tempdir().unwrap();
        fs::copy(first.folder.path().join("eeprom"), folder.path().join("eeprom")).unwrap();
        let speed = SPEED.to_string();
        let fixed = ["--speed", &speed];
        Self::launch(instrument, folder, start, &[&fixed, options].concat())
    }

    fn launch(instrument: &Instrument, folder: tempfile::TempDir, start: [f64; 3], options: &[&str]) -> Self {
        let at = |name: &str| folder.path().join(name);
        let mut command = Command::new(&instrument.simulator);
        command.arg("--link").arg(at("port")).arg("--json").arg(at("report")).arg("--edges").arg(at("edges"));
        command.arg("--eeprom").arg(at("eeprom")).args(["--max-seconds", MOST, "--boot-ms", "200"]);
        command.args(["--steps", &STEPS.to_string(), "--travel", &TRAVEL.to_string()]);
        command.args(["--start", &start.map(|mm| mm.to_string()).join(",")]).args(options);
        let mut child =
            command.arg(&instrument.firmware).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut line = String::new();
        let mut says = BufReader::new(child.stdout.take().unwrap());
        says.read_line(&mut line).unwrap();
        assert!(line.starts_with("PTY "), "the board did not start: {line}");
        Self { child, _says: says, folder, start }
    }

    fn write_settings(&self, settings: &[(u16, f64)]) {
        let mut port = Line::open(self);
        port.hears("help]");
        for (number, value) in settings {
            port.asks(&format!("${number}={value}"));
        }
    }

    /// Jogs to these net steps, Z first, like a pendant.
    pub(crate) fn jog_to(&self, wanted: [i64; 3]) {
        let mut port = Line::awake(self);
        let at = steps(&self.snapshot());
        let way = |axis: usize| (wanted[axis] - at[axis]) as f64 / STEPS;
        for words in [format!("Z{}", way(2)), format!("X{}Y{}", way(0), way(1))] {
            port.asks(&format!("$J=G91G21{words}F3000"));
        }
        eventually("the head at its place", Duration::from_secs(60), || steps(&self.snapshot()) == wanted);
    }

    /// The number of the error for the last of these lines in check mode; `None` if all are accepted.
    pub(crate) fn answers(&self, texts: &[&str]) -> Option<u16> {
        let mut port = Line::awake(self);
        port.asks("$C");
        let mut error = None;
        for line in texts.iter().flat_map(|text| text.lines()) {
            assert_eq!(error, None, "{line}");
            error = port.refuses(line);
        }
        port.0.write_all(&[0x18]).unwrap();
        port.hears("help]");
        error
    }

    /// Starts a jog, like a pendant, without waiting for its end.
    pub(crate) fn jogs(&self, words: &str, mm_per_min: u32) {
        let mut port = Line::awake(self);
        port.asks(&format!("$J=G91G21{words}F{mm_per_min}"));
    }

    pub(crate) fn port(&self) -> String {
        self.folder.path().join("port").display().to_string()
    }

    pub(crate) fn plugged(&self) -> bool {
        fs::exists(self.port()).unwrap()
    }

    pub(crate) fn plug(&self, wanted: bool) {
        if self.plugged() != wanted {
            self.signal(Signal::USR2);
        }
        eventually("the cable", Duration::from_secs(10), || self.plugged() == wanted);
    }

    pub(crate) fn reset(&self) {
        self.signal(Signal::HUP);
    }

    fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).unwrap();
    }

    fn reports(&self) -> Vec<Value> {
        let text = fs::read_to_string(self.folder.path().join("report")).unwrap_or_default();
        text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
    }

    pub(crate) fn snapshot(&self) -> Value {
        let before = self.reports().len();
        self.signal(Signal::USR1);
        eventually("a report", Duration::from_secs(20), || self.reports().len() > before);
        self.reports().pop().unwrap()
    }

    /// Waits until it has stopped for a while. Returns its net steps.
    pub(crate) fn rests(&self) -> [i64; 3] {
        let mut before = Value::Null;
        eventually("rest", Duration::from_secs(60), || {
            let now = self.snapshot();
            let same = now["edges"] == before["edges"];
            before = now;
            std::thread::sleep(Duration::from_millis(200));
            same
        });
        steps(&before)
    }

    pub(crate) fn end(&mut self) -> Value {
        self.signal(Signal::TERM);
        let child = &mut self.child;
        eventually("the end of the board", Duration::from_secs(30), || child.try_wait().unwrap().is_some());
        self.reports().pop().unwrap()
    }

    pub(crate) fn edges(&self) -> PathBuf {
        self.folder.path().join("edges")
    }

    /// Net steps since power-on at a position in machine coordinates.
    pub(crate) fn steps_at(&self, machine: [f64; 3]) -> [i64; 3] {
        core::array::from_fn(|axis| ((machine[axis] - self.start[axis]) * STEPS).round() as i64)
    }
}

struct Line(Box<dyn serialport::SerialPort>);

impl Line {
    fn open(board: &Board) -> Self {
        let mut port = None;
        // Another process that was just started may hold the port until it runs its own program.
        eventually("the port to be free", Duration::from_secs(60), || {
            port = serialport::new(board.port(), 115_200).timeout(Duration::from_millis(50)).open().ok();
            port.is_some()
        });
        Self(port.unwrap())
    }

    /// Opens it and waits for an answer: during a reset the controller would lose what it is sent.
    fn awake(board: &Board) -> Self {
        let mut line = Self::open(board);
        eventually("an answer of the board", Duration::from_secs(60), || {
            let mut bytes = [0; 256];
            writeln!(line.0).unwrap();
            std::thread::sleep(Duration::from_millis(200));
            line.0.read(&mut bytes).is_ok_and(|count| String::from_utf8_lossy(&bytes[..count]).contains("ok"))
        });
        // Drop the answers to the other empty lines.
        std::thread::sleep(Duration::from_millis(200));
        line.0.clear(serialport::ClearBuffer::Input).unwrap();
        line
    }

    fn hears(&mut self, wanted: &str) {
        let (mut heard, since) = (String::new(), Instant::now());
        while !heard.contains(wanted) {
            assert!(since.elapsed() < Duration::from_secs(30), "no {wanted} in {heard}");
            let mut bytes = [0; 256];
            if let Ok(count) = self.0.read(&mut bytes) {
                heard += &String::from_utf8_lossy(&bytes[..count]);
            }
        }
        assert!(!heard.contains("error"), "{heard}");
    }

    fn refuses(&mut self, line: &str) -> Option<u16> {
        writeln!(self.0, "{line}").unwrap();
        let (mut heard, since) = (String::new(), Instant::now());
        loop {
            assert!(since.elapsed() < Duration::from_secs(30), "no answer to {line}: {heard}");
            let mut bytes = [0; 256];
            if let Ok(count) = self.0.read(&mut bytes) {
                heard += &String::from_utf8_lossy(&bytes[..count]);
            }
            let whole = heard.rfind('\n').and_then(|end| heard.get(..end)).unwrap_or_default();
            for answer in whole.lines().map(str::trim) {
                if answer == "ok" {
                    return None;
                }
                if let Some(number) = answer.strip_prefix("error:") {
                    return Some(number.parse().unwrap());
                }
            }
        }
    }

    fn asks(&mut self, line: &str) {
        writeln!(self.0, "{line}").unwrap();
        self.hears("ok");
    }
}

impl Drop for Board {
    /// If the test failed, prints the record of pins and line.
    fn drop(&mut self) {
        if std::thread::panicking() {
            let _ = kill_process(Pid::from_child(&self.child), Signal::TERM);
            std::thread::sleep(Duration::from_secs(1));
            println!("The board: {}", self.reports().pop().unwrap_or_default());
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub(crate) fn steps(report: &Value) -> [i64; 3] {
    core::array::from_fn(|axis| report["steps"][axis].as_i64().unwrap())
}

/// Waits until `so` holds; panics after a time limit.
pub(crate) fn eventually(what: &str, limit: Duration, mut so: impl FnMut() -> bool) {
    let since = Instant::now();
    while !so() {
        assert!(since.elapsed() < limit, "{what}: not within {limit:?}");
        std::thread::sleep(Duration::from_millis(5));
    }
}
