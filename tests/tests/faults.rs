//! Faults that were found by hard use stay away: every row of `tests/faults/*.toml` names tests that are there.
//!
//! Comes in: the tables, and the files they name. Goes out: rows that nothing holds. Does not run the tests it names.

use annulus_tests::root;
use std::collections::BTreeSet;
use std::fs;

/// The fields of a row and what was wrong with it, if anything.
fn wrong(row: &toml::Value, seen: &mut BTreeSet<String>) -> Option<String> {
    let text = |name: &str| row.get(name).and_then(toml::Value::as_str).unwrap_or_default().trim();
    let list = |name: &str| row.get(name).and_then(toml::Value::as_array).cloned().unwrap_or_default();
    let what = text("what").to_owned();
    for field in ["what", "before", "after"] {
        if text(field).is_empty() {
            return Some(format!("{what}: no {field}"));
        }
    }
    if !seen.insert(what.clone()) {
        return Some(format!("{what}: there twice"));
    }
    if list("rows").is_empty() || list("tests").is_empty() {
        return Some(format!("{what}: no rows or no tests"));
    }
    list("tests").iter().find_map(|test| {
        let test = test.as_str().unwrap_or_default();
        (!is_there(test)).then(|| format!("{what}: no test {test}"))
    })
}

/// Whether a test is there: `FILE::name` of a Rust test, `FILE::"its words"` of one in a browser.
pub(crate) fn is_there(test: &str) -> bool {
    let (file, name) = test.split_once("::").unwrap_or((test, ""));
    let source = fs::read_to_string(root().join(file)).unwrap_or_default();
    if name.is_empty() {
        return false;
    }
    if !file.ends_with(".mjs") {
        return is_a_test(&source, name);
    }
    let name = name.trim_matches('"');
    // A test of its own, or a row of one.
    let named = |before: &str| {
        ['\'', '"', '`'].iter().any(|quote| source.contains(&format!("{before}{quote}{name}{quote}")))
    };
    ["test(", "attack("].iter().any(|before| named(before))
}

/// Whether the function called `name` is one that is run as a test.
fn is_a_test(source: &str, name: &str) -> bool {
    let lines: Vec<&str> = source.lines().map(str::trim).collect();
    let begins = |line: &str| {
        let rest = line.trim_start_matches("pub(crate) ").trim_start_matches("async ");
        rest.strip_prefix("fn ").is_some_and(|rest| rest.starts_with(&format!("{name}(")))
    };
    let Some(at) = lines.iter().position(|line| begins(line)) else { return false };
    let above = lines[..at].iter().rev().take_while(|line| line.starts_with("#[") || line.starts_with("//"));
    let attributes: Vec<&&str> = above.filter(|line| line.starts_with("#[")).collect();
    let run = |line: &&&str| {
        ["#[test]", "#[wasm_bindgen_test]", "#[tokio::test"].iter().any(|is| line.starts_with(is))
    };
    attributes.iter().any(run) && !attributes.iter().any(|line| line.contains("ignore"))
}

#[test]
fn every_mended_fault_is_held_by_a_test_that_is_there() {
    let mut files: Vec<_> =
        fs::read_dir(root().join("tests/faults")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    let (mut seen, mut bad, mut rows) = (BTreeSet::new(), Vec::new(), 0);
    for file in files {
        let table: toml::Value = toml::from_str(&fs::read_to_string(&file).unwrap())
            .unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        for row in table.get("fault").and_then(toml::Value::as_array).into_iter().flatten() {
            rows += 1;
            bad.extend(wrong(row, &mut seen).map(|bad| format!("{}: {bad}", file.display())));
        }
    }
    assert!(bad.is_empty(), "{}", bad.join("\n"));
    assert!(rows > 0, "no rows");
}
