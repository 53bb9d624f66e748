//! `cargo xtask bench [--page [GROUP… | --what [CRATE]] | --adapter | --isolation [BOARD…] | --memory
//! [PADS…]]`: prints measurements. By default: speeds by criterion, and the works of `tests/speed` natively
//! and in WebAssembly by Node. In Chromium: the page's budgets and the simulation's frame rate. `--page`
//! measures the budgets alone.
//!
//! Judges nothing: the limits are in the documents.

use crate::page::Effort;
use crate::sh::{Done, command, output, root, run as call, say, shown, target};
use crate::{adapter, browser, npm, pads, site, wasm, what};
use std::fs;
use std::path::Path;

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
const here = readFileSync(process.argv[3], 'utf8').trim().split('\\n').map((line) => line.split('\\t'));
for (const [number, [name, native, made]] of here.entries()) {
  const same = String(BigInt.asUintN(64, instance.exports.work(number))) === made;
  let best = Infinity;
  for (let round = 0; round < 5; round++) {
    const began = performance.now();
    instance.exports.work(number);
    best = Math.min(best, performance.now() - began);
  }
  const factor = best / Number(native);
  const times = `${Number(native).toFixed(1).padStart(7)} ms native ${best.toFixed(1).padStart(7)} ms WebAssembly`;
  console.log(`work/${name.padEnd(22)} ${times}  × ${factor.toFixed(2)}  ${same ? 'the same result' : 'NOT THE SAME RESULT'}`);
}
";

/// Prints all measurements, with `arguments` for criterion. `--page`: the page's budgets, all or the named
/// groups; with `--what`, its size by crate. `--adapter`: the table of the USB step adapter. `--isolation`:
/// the corpus' isolation compared with pcb2gcode.
pub(crate) fn run(arguments: &[String]) -> Done {
    if let [word, groups @ ..] = arguments
        && word == "--page"
    {
        return match groups {
            [word, of @ ..] if word == "--what" => what::run(of),
            _ => budgets(groups),
        };
    }
    if let [word, boards @ ..] = arguments
        && word == "--isolation"
    {
        let run = ["run", "--release", "-p", "annulus-tests", "--example", "isolation", "--"];
        return call(command("cargo", &run).args(boards));
    }
    if let [word, sizes @ ..] = arguments
        && word == "--memory"
    {
        return pads::bench(sizes);
    }
    if arguments == ["--adapter"] {
        return adapter::bench();
    }
    call(command("cargo", &["bench", "-p", "annulus-speed", "--bench", "speed", "--"]).args(arguments))?;
    wasm_speed()?;
    pads::bench(&[])?;
    budgets(&[])?;
    frames()
}

fn frames() -> Done {
    let browser = browser::ensure()?;
    npm::ensure()?;
    call(&mut command("cargo", &["build", "-p", "annulus-bridge"]))?;
    say("Frames of the simulation, drawn in software");
    let mut page = command("node", &["tests/browser/frames.mjs"]);
    page.env("ANNULUS_BIN", target().join("debug/annulus")).env("ANNULUS_CHROMIUM", &browser.chromium);
    call(page.current_dir(root()))
}

fn wasm_speed() -> Done {
    let toolchain = wasm::ensure()?;
    let mut build =
        command("cargo", &["build", "-p", "annulus-speed", "--release", "--target", wasm::TRIPLE]);
    call(toolchain.apply(&mut build))?;
    let module = target().join(wasm::TRIPLE).join("release/annulus_speed.wasm");
    let (script, here) = (target().join("speed.mjs"), target().join("speed.tsv"));
    let write = |file: &Path, text: &str| {
        fs::write(file, text).map_err(|error| format!("{}: {error}.", file.display()))
    };
    write(&script, NODE)?;
    say("Works here and in WebAssembly");
    let mut native = command("cargo", &["run", "-p", "annulus-speed", "--release"]);
    write(&here, &output(&mut native).ok_or_else(|| format!("`{}` failed.", shown(&native)))?)?;
    call(command("node", &[]).arg(script).arg(module).arg(here).current_dir(root()))
}

/// The page's response times in a browser.
fn budgets(groups: &[String]) -> Done {
    let site = site::build(Effort::Whole)?;
    call(&mut command("cargo", &["build", "-p", "annulus-bridge"]))?;
    let chromium = browser::ensure()?.chromium;
    let script = npm::ensure()?.join("budgets.mjs");
    say("Budgets of the page");
    let mut node = command("node", &[]);
    node.arg(script).args(groups).env("ANNULUS_CHROMIUM", chromium).env("ANNULUS_SITE", site);
    call(node.env("ANNULUS_BIN", target().join("debug/annulus")))
}
