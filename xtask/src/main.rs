//! `cargo xtask run | test | build | page | site | firmware | tools | bench | doctor`: prepares what is missing and does the thing.
//!
//! Comes in: one word. Goes out: a running page, a tested tree, a built page, numbers, or a list of what is there.
//! Does not know what Annulus does.

mod adapter;
mod bench;
mod browser;
mod doctor;
mod firmware;
mod grbl;
mod npm;
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
  firmware  build the firmware of the USB step adapter into target/firmware
  tools     build what the tests need, once
  bench     print the measured numbers: parsing, tours, steps, the budgets of the page; --page these alone, or groups of them;
            --page --what [CRATE] to whom the bytes of the page belong; --adapter the table of the USB step adapter
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

/// How small the page is to become: as it ships, but where `--quick` says otherwise.
fn effort(arguments: &[String]) -> sh::Done<Effort> {
    match arguments {
        [] => Ok(Effort::Whole),
        [word] if word == "--quick" => Ok(Effort::Quick),
        _ => Err(USAGE.to_owned()),
    }
}
