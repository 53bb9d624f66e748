//! `annulus`: reads boards, plans, simulates, exports and drills; without a command it serves the page.
//! Each command is a file in `cli/`.

mod adapter;
mod cli;
mod drill;
mod executor;
mod grbl;
mod hosted;
mod journal;
mod lab;
mod machine_file;
mod outputs;
mod own;
mod quiet;
mod refusal;
mod serial;
mod server;
mod signals;
mod spindle;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
