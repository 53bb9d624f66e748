//! `cargo xtask bench --memory [PADS…]`: memory of `annulus cam` for boards of that many round pads.
//!
//! ```text
//!   pads on a grid of 1.27 mm, an outline ─▶ annulus cam (release) ─▶ peak memory, per pad, seconds, exit code
//! ```
//!
//! Judges nothing: the limits are in the documents. The peak comes from `/proc` while the program runs, so
//! only Linux has it.

use crate::sh::{Done, command, run, say, target};
use std::fmt::Write;
use std::path::Path;
use std::process::Stdio;
use std::thread::sleep;
use std::time::{Duration, Instant};
use std::{fs, io};

const PADS: [usize; 4] = [1_000, 10_000, 100_000, 300_000];
/// Distance between pads in nm, and diameter of a pad in mm.
const PITCH_NM: usize = 1_270_000;
const PAD_MM: f64 = 0.8;
const LOOK: Duration = Duration::from_millis(10);

pub(crate) fn bench(arguments: &[String]) -> Done {
    let sizes: Vec<usize> = arguments.iter().filter_map(|word| word.parse().ok()).collect();
    if sizes.len() != arguments.len() {
        return Err("--memory takes numbers of pads.".to_owned());
    }
    run(&mut command("cargo", &["build", "-p", "annulus-bridge", "--release"]))?;
    say("Memory of annulus cam, by pads");
    for pads in if sizes.is_empty() { PADS.to_vec() } else { sizes } {
        let folder = target().join("pads").join(pads.to_string());
        write_board(&folder, pads).map_err(|error| format!("{}: {error}.", folder.display()))?;
        println!("{}", measured(&folder, pads)?);
    }
    Ok(())
}

/// Writes a board of round pads on a grid: copper and outline.
fn write_board(folder: &Path, pads: usize) -> io::Result<()> {
    let side = pads.isqrt() + usize::from(pads.isqrt().pow(2) < pads);
    let head = |function: &str, wide: f64| {
        format!("%FSLAX46Y46*%\n%MOMM*%\n%TF.FileFunction,{function}*%\n%ADD10C,{wide}*%\nD10*\n")
    };
    let mut copper = head("Copper,L1,Top", PAD_MM);
    for pad in 0..pads {
        let (x, y) = ((pad % side + 1) * PITCH_NM, (pad / side + 1) * PITCH_NM);
        let _ = writeln!(copper, "X{x}Y{y}D03*");
    }
    let far = (side + 1) * PITCH_NM;
    let mut outline = head("Profile,NP", 0.1) + "X0Y0D02*\n";
    for (x, y) in [(far, 0), (far, far), (0, far), (0, 0)] {
        let _ = writeln!(outline, "X{x}Y{y}D01*");
    }
    fs::create_dir_all(folder.join("board"))?;
    fs::write(folder.join("board/pads-top.gbr"), copper + "M02*\n")?;
    fs::write(folder.join("board/pads-outline.gbr"), outline + "M02*\n")
}

fn measured(folder: &Path, pads: usize) -> Done<String> {
    let program = target().join("release/annulus");
    let mut cam =
        command(program, &["cam", "board", "--machine", "hobby", "--to", "grbl", "-o", "out", "--json"]);
    cam.current_dir(folder).stdout(Stdio::null()).stderr(Stdio::null());
    let began = Instant::now();
    let mut child = cam.spawn().map_err(|error| format!("annulus: {error}."))?;
    let mut peak_kb = 0;
    let status = loop {
        peak_kb = peak_kb.max(peak_of(child.id()).unwrap_or_default());
        if let Some(status) = child.try_wait().map_err(|error| format!("annulus: {error}."))? {
            break status;
        }
        sleep(LOOK);
    };
    let (seconds, peak_mb) = (began.elapsed().as_secs_f64(), peak_kb as f64 / 1024.0);
    let each_kb = peak_kb as f64 / pads as f64;
    Ok(format!("{pads:>8} pads {peak_mb:>8.0} MB {each_kb:>7.1} KB each {seconds:>7.1} s  {status}"))
}

/// Peak memory of a process, in kB; `None` if the system does not report it.
fn peak_of(process: u32) -> Option<u64> {
    let text = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse().ok()
}
