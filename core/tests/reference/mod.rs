//! Reference numbers computed elsewhere. They lie beside the repository, or where `ANNULUS_VECTORS` says.

use serde_json::Value;
use std::path::PathBuf;

/// The vectors of that name, or none when they are not there (which fails where CI says so).
pub(crate) fn vectors(name: &str) -> Option<Value> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/reference/vectors");
    let folder = std::env::var_os("ANNULUS_VECTORS").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    let Ok(text) = std::fs::read_to_string(folder.join(name)) else {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "no reference vectors");
        println!("skipped: no reference vectors");
        return None;
    };
    Some(serde_json::from_str(&text).unwrap())
}
