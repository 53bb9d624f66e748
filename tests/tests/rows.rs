//! The index of requirements and the sources stay together.
//!
//! Comes in: `docs/requirements.md`, and every source and data file of the repository. Goes out: ids that are quoted and not in the
//! index, rows without a test, tests that are not there. Does not know what the requirements mean.

use crate::faults::is_there;
use annulus_tests::{files_below, root};
use std::collections::BTreeMap;
use std::fs;

/// Ids of the index and what proves each.
fn index() -> BTreeMap<String, String> {
    let text = fs::read_to_string(root().join("docs/requirements.md")).unwrap();
    let rows = text.lines().filter_map(|line| line.strip_prefix("| ")?.strip_suffix(" |"));
    let cells = rows.map(|row| row.split(" | ").map(str::to_owned).collect::<Vec<_>>());
    let known = cells.filter(|cells| cells.len() == 3 && is_id(&cells[0]));
    let mut found = BTreeMap::new();
    for row in known {
        assert!(found.insert(row[0].clone(), row[2].clone()).is_none(), "{} is there twice", row[0]);
    }
    found
}

fn is_id(word: &str) -> bool {
    let mut letters = word.chars();
    let first = letters.next().is_some_and(|letter| "AMPSCN".contains(letter));
    let number: String = letters.collect();
    first && (1..=2).contains(&number.len()) && number.chars().all(|letter| letter.is_ascii_digit())
}

/// The ids in brackets at the end of sentences, as in `(N8, C6)`, and of a row's field `rows = ["N15"]`.
fn quoted(line: &str) -> Vec<String> {
    let mut found = Vec::new();
    for bracket in line.split('(').skip(1).filter_map(|rest| rest.split(')').next()) {
        let words: Vec<_> = bracket.split([',', ' ']).filter(|word| !word.is_empty()).collect();
        if words.iter().all(|word| is_id(word)) {
            found.extend(words.into_iter().map(str::to_owned));
        }
    }
    if let Some(rows) = line.trim().strip_prefix("rows = ") {
        found.extend(rows.split('"').filter(|word| is_id(word)).map(str::to_owned));
    }
    found
}

#[test]
fn every_row_that_is_quoted_is_in_the_index_and_has_its_proof() {
    let index = index();
    assert!(index.len() > 60, "{} rows", index.len());
    let mut wrong = Vec::new();
    for (id, proof) in &index {
        let test = proof.trim_matches('`');
        if !proof.starts_with("later") && !is_there(test) && !root().join(test).is_file() {
            wrong.push(format!("{id}: no test {test}"));
        }
    }
    let mut count = 0;
    for folder in [
        "core",
        "drill",
        "link",
        "bridge",
        "app",
        "xtask",
        "tests/tests",
        "tests/src",
        "tests/browser",
        "tests/faults",
    ] {
        let wanted = ["rs", "mjs", "toml"];
        for file in files_below_apart(&root().join(folder)) {
            if !file.extension().is_some_and(|ending| wanted.iter().any(|one| ending == *one)) {
                continue;
            }
            let text = fs::read_to_string(&file).unwrap_or_default();
            let is_comment =
                |line: &&str| line.trim_start().starts_with("//") || line.trim_start().starts_with("rows = ");
            for id in text.lines().filter(is_comment).flat_map(quoted) {
                count += 1;
                if !index.contains_key(&id) {
                    wrong.push(format!("{}: {id} is not in the index", file.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 100, "only {count} ids are quoted");
}

/// Files below a folder without what builds and installs leave there.
fn files_below_apart(folder: &std::path::Path) -> Vec<std::path::PathBuf> {
    let apart = |path: &std::path::PathBuf| {
        !path.components().any(|part| part.as_os_str() == "node_modules" || part.as_os_str() == "target")
    };
    files_below(folder).into_iter().filter(apart).collect()
}
