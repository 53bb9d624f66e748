//! Builds the page: compiles, binds, shrinks, compresses.
//!
//! ```text
//! app ─cargo▶ page, painter, engine.wasm ─wasm-bindgen▶ page.js + page_bg.wasm, … ─wasm-opt▶ ─▶ .br .gz
//! www ─copy─────────────────────────────────────────────────────────────────────────────────▶ .br .gz
//! ```

use crate::sh::{Done, command, root, run, say, target};
use crate::{npm, wasm};
use sha2::{Digest, Sha256};
use std::fs;
use std::io::Write;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

pub(crate) fn folder() -> PathBuf {
    root().join("target/www")
}

/// The WebAssembly files: the window's first one, its GPU drawing, and its workers.
pub(crate) const PARTS: [&str; 3] = ["page", "painter", "engine"];

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Effort {
    Whole,
    /// For development: three times as large and not compressed, in a fraction of the time.
    Quick,
}

/// Cargo options for a quick page.
const QUICK: [&str; 4] = [
    "--config",
    "profile.page.package.annulus-app.opt-level=1",
    "--config",
    "profile.page.package.annulus-app.codegen-units=64",
];

/// Builds the page, unless nothing has changed.
pub(crate) fn build(effort: Effort) -> Done<PathBuf> {
    let toolchain = wasm::ensure()?;
    let mut cargo =
        command("cargo", &["build", "-p", "annulus-app", "--profile", "page", "--target", wasm::TRIPLE]);
    cargo.args(["--config", &anonymous()]);
    if effort == Effort::Quick {
        cargo.args(QUICK);
    }
    run(toolchain.apply(&mut cargo))?;
    let compiled = PARTS.map(|part| target().join(wasm::TRIPLE).join("page").join(format!("{part}.wasm")));
    let stamp = stamp(effort, &compiled)?;
    let stamp_file = target().join("www.stamp");
    let is_there = folder().join("index.html").is_file();
    if is_there && fs::read_to_string(&stamp_file).is_ok_and(|found| found == stamp) {
        return Ok(folder());
    }
    say("Binding, shrinking and compressing the page");
    let _ = fs::remove_dir_all(folder());
    fs::create_dir_all(folder()).map_err(|error| format!("{}: {error}.", folder().display()))?;
    copy(&root().join("www"), &folder())?;
    PARTS.iter().zip(&compiled).try_for_each(|(part, compiled)| bind(part, compiled))?;
    if effort == Effort::Whole {
        at_once(&PARTS.map(|part| folder().join(format!("{part}_bg.wasm"))), shrink)?;
        at_once(&files_below(&folder()), compress)?;
    }
    fs::write(&stamp_file, stamp).map_err(|error| format!("{}: {error}.", stamp_file.display()))?;
    Ok(folder())
}

/// Cargo configuration that keeps this computer's paths out of the page.
pub(crate) fn anonymous() -> String {
    let home = |variable: &str, name: &str| {
        let own = std::env::var_os(variable).map(PathBuf::from);
        own.or_else(|| std::env::var_os("HOME").map(|home| Path::new(&home).join(name)))
    };
    let folders = [
        (home("HOME", ""), "/home"),
        (home("RUSTUP_HOME", ".rustup"), "/rustup"),
        (home("CARGO_HOME", ".cargo"), "/cargo"),
        (Some(root()), "/annulus"),
    ];
    let flag = |(folder, name): (Option<PathBuf>, &str)| {
        let path = folder?.to_string_lossy().trim_end_matches('/').to_owned();
        (!path.is_empty()).then(|| format!("{:?}", format!("--remap-path-prefix={path}={name}")))
    };
    let flags: Vec<String> = folders.into_iter().filter_map(flag).collect();
    format!("target.{}.rustflags=[{}]", wasm::TRIPLE, flags.join(", "))
}

fn stamp(effort: Effort, compiled: &[PathBuf]) -> Done<String> {
    let mut digest = Sha256::new();
    digest.update(format!("{effort:?}"));
    let mut files = compiled.to_vec();
    files.extend(files_below(&root().join("www")));
    for file in files {
        digest.update(file.to_string_lossy().as_bytes());
        digest.update(fs::read(&file).map_err(|error| format!("{}: {error}.", file.display()))?);
    }
    Ok(format!("{:x}", digest.finalize()))
}

pub(crate) fn files_below(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let below = |path: PathBuf| if path.is_dir() { files_below(&path) } else { vec![path] };
    paths.into_iter().flat_map(below).collect()
}

/// Copies `from` into `to`, without the English messages, which are compiled in.
fn copy(from: &Path, to: &Path) -> Done {
    for file in files_below(from) {
        let Ok(name) = file.strip_prefix(from) else { continue };
        if name.ends_with("locales/en.toml") {
            continue;
        }
        let place = to.join(name);
        let failed = |error: std::io::Error| format!("{}: {error}.", place.display());
        fs::create_dir_all(place.parent().unwrap_or(to)).map_err(failed)?;
        fs::copy(&file, &place).map_err(failed)?;
    }
    Ok(())
}

/// Processes every file, on all cores; the first error ends it.
fn at_once(files: &[PathBuf], act: fn(&Path) -> Done) -> Done {
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(file) = files.get(next.fetch_add(1, Ordering::Relaxed)) {
            act(file)?;
        }
        Ok(())
    };
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    thread::scope(|scope| {
        let workers: Vec<_> = (0..cores.min(files.len())).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| {
            worker.join().unwrap_or_else(|_| Err("A file of the page could not be made.".to_owned()))
        })
    })
}

fn bind(part: &str, compiled: &Path) -> Done {
    let mut bindgen = wasm_bindgen_cli_support::Bindgen::new();
    bindgen.input_path(compiled).out_name(part).typescript(false).remove_name_section(true);
    bindgen.remove_producers_section(true);
    let bound = bindgen.web(true).and_then(|bindgen| bindgen.generate(folder()));
    bound.map_err(|error| format!("The page could not be bound: {error:#}."))
}

/// Passes of `wasm-opt`: remove unused functions, and merge identical ones. `-O2` would make the file a
/// fifteenth smaller but its compressed form a fifteenth larger, and take ten times as long.
const PASSES: [&str; 4] =
    ["--duplicate-function-elimination", "--remove-unused-module-elements", "--dce", "--vacuum"];

fn shrink(file: &Path) -> Done {
    let optimiser = npm::ensure()?.join("node_modules/.bin/wasm-opt");
    let smaller = file.with_extension("small");
    let (from, to) = (file.to_string_lossy(), smaller.to_string_lossy());
    let features = [
        "--enable-bulk-memory",
        "--enable-bulk-memory-opt",
        "--enable-nontrapping-float-to-int",
        "--enable-sign-ext",
        "--enable-mutable-globals",
        "--enable-reference-types",
        "--enable-multivalue",
    ];
    run(command(optimiser, &[&from, "-o", &to]).args(PASSES).args(features))?;
    fs::rename(&smaller, file).map_err(|error| format!("{}: {error}.", file.display()))
}

/// Writes `FILE.br` and `FILE.gz` next to a file, unless it is too small to gain.
fn compress(file: &Path) -> Done {
    let bytes = fs::read(file).map_err(|error| format!("{}: {error}.", file.display()))?;
    if bytes.len() < 512 {
        return Ok(());
    }
    let name = file.to_string_lossy();
    let save = |extension: &str, packed: &[u8]| {
        fs::write(format!("{name}.{extension}"), packed)
            .map_err(|error| format!("{name}.{extension}: {error}."))
    };
    save("br", &brotli(&bytes)?)?;
    save("gz", &gzip(&bytes)?)
}

pub(crate) fn brotli(bytes: &[u8]) -> Done<Vec<u8>> {
    let mut packed = Vec::new();
    let mut writer = brotli::CompressorWriter::new(&mut packed, 1 << 16, 11, 22);
    writer.write_all(bytes).map_err(|error| error.to_string())?;
    drop(writer);
    Ok(packed)
}

fn gzip(bytes: &[u8]) -> Done<Vec<u8>> {
    let mut writer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    writer.write_all(bytes).and_then(|()| writer.finish()).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_build_remaps_the_paths_of_its_builder() {
        let setting = anonymous();
        let own = root().to_string_lossy().into_owned();
        assert!(setting.contains(&format!("{own}=/annulus")), "{setting}");
        // The compiler takes the last match, so the most specific prefix comes last.
        assert!(setting.trim_end_matches(']').ends_with("=/annulus\""), "{setting}");
        let document: String = format!("{setting}\n");
        assert!(document.matches("--remap-path-prefix=").count() >= 2, "{setting}");
    }

    #[test]
    fn page_folder_differs_from_cargo_folders() {
        // Cargo stores native builds under a profile's name, and building the page empties its folder.
        let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
        let own = folder().file_name().unwrap().to_string_lossy().into_owned();
        let profiles =
            manifest.lines().filter_map(|line| line.strip_prefix("[profile.")?.split(['.', ']']).next());
        let names: Vec<_> = profiles.chain(["debug", "release", "doc", "tmp", "package"]).collect();
        assert!(names.contains(&"page"), "the profile of the page is no longer called so");
        assert!(!names.contains(&own.as_str()), "{own}");
    }
}
