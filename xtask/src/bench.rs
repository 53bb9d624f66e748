//! `cargo xtask bench`: the measured numbers. Speeds by criterion, steps per second in WebAssembly by Node, sizes of the
//! page.
//!
//! Goes out: lines on standard output. Judges nothing: the bars are in the documents.

use crate::sh::{Done, command, root, run as call, say, target};
use crate::{page, wasm};
use std::fs;

const NODE: &str = "
import { readFileSync } from 'node:fs';
const { instance } = await WebAssembly.instantiate(readFileSync(process.argv[2]), {});
const steps = Number(instance.exports.prepare(500));
let best = Infinity;
for (let round = 0; round < 5; round++) {
  const began = performance.now();
  instance.exports.make();
  best = Math.min(best, performance.now() - began);
}
console.log(`stream/steps in WebAssembly: ${(steps / best / 1e3).toFixed(1)} M steps/s (${steps} steps, best of 5)`);
";

/// Prints everything; `arguments` go to criterion.
pub(crate) fn run(arguments: &[String]) -> Done {
    call(command("cargo", &["bench", "-p", "annulus-speed", "--bench", "speed", "--"]).args(arguments))?;
    wasm_speed()?;
    sizes()
}

fn wasm_speed() -> Done {
    let toolchain = wasm::ensure()?;
    let mut build =
        command("cargo", &["build", "-p", "annulus-speed", "--release", "--target", wasm::TRIPLE]);
    call(toolchain.apply(&mut build))?;
    let module = target().join(wasm::TRIPLE).join("release/annulus_speed.wasm");
    let script = target().join("speed.mjs");
    fs::write(&script, NODE).map_err(|error| format!("{}: {error}.", script.display()))?;
    call(command("node", &[]).arg(script).arg(module).current_dir(root()))
}

fn sizes() -> Done {
    let folder = page::build()?;
    say("Sizes of the page");
    for name in ["annulus_bg.wasm", "annulus.js"] {
        let size =
            |suffix: &str| fs::metadata(folder.join(format!("{name}{suffix}"))).map_or(0, |file| file.len());
        println!("size/{name}: {} raw, {} gzip, {} brotli (bytes)", size(""), size(".gz"), size(".br"));
    }
    Ok(())
}
