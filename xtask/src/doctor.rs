//! `cargo xtask doctor`: lists what is present and what would be installed or built. Changes nothing.

use crate::sh::{Done, command, output, which};
use crate::{browser, firmware, grbl, npm, tools, wasm};

pub(crate) fn run() -> Done {
    let line = |good: bool, what: &str, detail: &str| {
        println!("{} {what:<26} {detail}", if good { "ok     " } else { "missing" });
    };
    let rustc = output(&mut command("rustc", &["--version"]));
    line(rustc.is_some(), "Rust compiler", rustc.as_deref().unwrap_or("install it with rustup"));
    line(wasm::present(), "WebAssembly target", "rustup target add, or Debian's packages");
    line(firmware::present(), "target of the adapter", "rustup target add, when the firmware is built");
    let node = output(&mut command("node", &["--version"]));
    line(node.is_some(), "Node 20 or newer", node.as_deref().unwrap_or("from your system or nodejs.org"));
    line(
        npm::folder().join("node_modules").exists(),
        "npm packages",
        "installed from the lock file when needed",
    );
    line(browser::find().is_some(), "Chromium and its driver", "only the tests need them");
    let absent = tools::missing();
    line(
        absent.is_empty(),
        "test tools",
        &if absent.is_empty() { "built".to_owned() } else { absent.join(", ") },
    );
    line(grbl::buildable(), "simavr with its headers", "only the tests with the GRBL firmware need it");
    line(which("cc").is_some(), "C compiler", "links what cargo builds");
    Ok(())
}
