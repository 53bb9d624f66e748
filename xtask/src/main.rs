//! `cargo xtask run | test | build | page | site | docs | firmware | tools | bench | doctor`: installs what
//! is missing, then runs the task.

mod adapter;
mod bench;
mod browser;
mod doctor;
mod firmware;
mod grbl;
mod npm;
mod pads;
mod page;
mod recap;
mod run;
mod sh;
mod site;
mod suites;
mod test;
mod tools;
mod wasm;
mod what;

use page::Effort;
use std::process::ExitCode;

const USAGE: &str = "usage: cargo xtask COMMAND

  run       build page and bridge, start the bridge with the virtual drill and a sample board
  test      prepare and run every test and check; the last line counts them; --long for the full size
  build     build the page into target/www and the bridge in release
  page      build the page alone; --quick for work on it: larger, in a fraction of the time
  site      build the page as a site of files, for any server, into target/site; --quick likewise
  docs      build the manual into target/book; --serve shows it in a browser and follows changes
  firmware  build the firmware of the USB step adapter into target/firmware
  tools     build what the tests need, once
  bench     print the measured numbers: parsing, tours, steps, the budgets of the page; --page these alone, or groups of them;
            --page --what [CRATE] to whom the bytes of the page belong; --adapter the table of the USB step adapter;
            --memory [PADS…] what annulus cam takes for boards of so many pads
  doctor    list what is there and what would be installed
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let rest = arguments.get(1..).unwrap_or_default();
    let done = match arguments.first().map(String::as_str) {
        Some("run") => run::run(rest),
        Some("test") => test::run(rest),
        Some("build") => page::build(Effort::Whole).and_then(|_| run::build_bridge()).map(drop),
        Some("tools") => tools::ensure().map(drop),
        Some("site") => effort(rest).and_then(site::build).map(drop),
        Some("page") => effort(rest).and_then(page::build).map(drop),
        Some("docs") => docs(rest),
        Some("firmware") => firmware::build().map(drop),
        Some("bench") => bench::run(rest),
        Some("doctor") => doctor::run(),
        _ => Err(USAGE.to_owned()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// Builds the manual, or serves it.
fn docs(arguments: &[String]) -> sh::Done {
    let word = match arguments {
        [] => ["build"].as_slice(),
        [word] if word == "--serve" => ["serve", "--open"].as_slice(),
        _ => return Err(USAGE.to_owned()),
    };
    sh::run(sh::command(tools::book()?, word).arg(sh::root().join("docs")))
}

/// The effort to make the page small: `--quick` or as shipped.
fn effort(arguments: &[String]) -> sh::Done<Effort> {
    match arguments {
        [] => Ok(Effort::Whole),
        [word] if word == "--quick" => Ok(Effort::Quick),
        _ => Err(USAGE.to_owned()),
    }
}
