//! Every dependency in a manifest is used in a source of its package.

use crate::floor_plan::rust_files;
use annulus_tests::root;
use std::fs;
use std::path::Path;

const PACKAGES: &[&str] =
    &["core", "host", "link", "app", "bridge", "bridge/firmware", "tests", "tests/speed", "xtask"];

/// Needed only for its feature: it makes `syn` keep line numbers.
const FOR_A_FEATURE: &[&str] = &["proc-macro2"];

/// The dependencies of a manifest, in all kinds of tables.
fn dependencies(manifest: &toml::Table, found: &mut Vec<String>) {
    for (key, value) in manifest {
        let Some(table) = value.as_table() else { continue };
        match key.as_str() {
            "dependencies" | "dev-dependencies" | "build-dependencies" => found.extend(table.keys().cloned()),
            "target" => {
                table.values().filter_map(toml::Value::as_table).for_each(|own| dependencies(own, found));
            }
            _ => {}
        }
    }
}

/// True if a line of code, apart from comments, contains `name` as a word.
fn names(source: &str, name: &str) -> bool {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
    source.lines().filter(|line| !line.trim_start().starts_with("//")).any(|line| {
        line.match_indices(name)
            .any(|(at, _)| !line[..at].ends_with(is_part) && !line[at + name.len()..].starts_with(is_part))
    })
}

fn unused(package: &Path) -> Vec<String> {
    let text = fs::read_to_string(package.join("Cargo.toml")).unwrap();
    let mut wanted = Vec::new();
    dependencies(&text.parse().unwrap(), &mut wanted);
    let mut files = Vec::new();
    for folder in ["src", "tests", "benches"] {
        rust_files(&package.join(folder), &mut files);
    }
    files.extend(Some(package.join("build.rs")).filter(|file| file.exists()));
    let sources: Vec<String> = files.iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    assert!(!sources.is_empty(), "{}", package.display());
    wanted.sort();
    wanted.dedup();
    wanted.retain(|name| !FOR_A_FEATURE.contains(&name.as_str()));
    wanted.retain(|name| !sources.iter().any(|source| names(source, &name.replace('-', "_"))));
    wanted
}

#[test]
fn packages_have_no_unused_dependencies() {
    let rows = PACKAGES.iter().map(|package| (package, unused(&root().join(package))));
    let left: Vec<_> = rows.filter(|(_, unused)| !unused.is_empty()).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn comments_do_not_count_as_uses() {
    assert!(names("use geo::Area;", "geo") && names("    geo::area()", "geo"));
    assert!(!names("// geo is near", "geo") && !names("let geometry = 1;", "geo"));
    let mut found = Vec::new();
    let manifest = "[dependencies]\na = \"1\"\n[target.'cfg(unix)'.dev-dependencies]\nb = \"1\"\n";
    dependencies(&manifest.parse().unwrap(), &mut found);
    assert_eq!(found, ["a", "b"]);
}
