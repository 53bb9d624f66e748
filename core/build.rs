//! Turns `www/locales/*.toml` into sorted tables of (key, text): one file, one language.
//!
//! The page carries English alone and fetches the others when they are chosen, so for wasm only that table is written.

use std::collections::{BTreeMap, BTreeSet};
use std::{env, fmt::Write, fs, path::Path};

const ALWAYS: &str = "en";

fn flatten(prefix: &str, table: &toml::Table, rows: &mut Vec<(String, String)>) {
    for (name, value) in table {
        let key = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
        match value {
            toml::Value::String(text) => rows.push((key, text.clone())),
            toml::Value::Table(inner) => flatten(&key, inner, rows),
            other => panic!("locale key {key}: expected a text or a table, found {other}"),
        }
    }
}

/// The argument names of each text, and of each code: those of its message and advice.
fn arguments(rows: &[(String, String)]) -> BTreeMap<&str, BTreeSet<&str>> {
    let mut found: BTreeMap<_, BTreeSet<_>> = BTreeMap::new();
    for (key, text) in rows {
        let names = text.split('{').skip(1).filter_map(|rest| rest.split(['|', '}']).next());
        let code = key.strip_suffix(".message").or_else(|| key.strip_suffix(".advice"));
        for key in code.into_iter().chain([key.as_str()]) {
            found.entry(key).or_default().extend(names.clone());
        }
    }
    found
}

fn main() {
    let folder = Path::new(&env::var("CARGO_MANIFEST_DIR").unwrap()).join("../www/locales");
    let in_browser = env::var("CARGO_CFG_TARGET_FAMILY").is_ok_and(|family| family.contains("wasm"));
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut files: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    let mut languages = String::from("pub(super) const LANGUAGES: [(&str, &str); COUNT] = [\n");
    let mut tables = String::from("pub(super) const TABLES: [(&str, &[(&str, &str)]); COUNT] = [\n");
    let mut checked = String::from("pub(super) const ARGUMENTS: &[(&str, &[&str])] = &[\n");
    for path in &files {
        println!("cargo::rerun-if-changed={}", path.display());
        let text = fs::read_to_string(path).unwrap();
        let table: toml::Table = text.parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut rows = Vec::new();
        flatten("", &table, &mut rows);
        rows.sort();
        let language = path.file_stem().unwrap().to_string_lossy().into_owned();
        let name = rows.iter().find(|(key, _)| key == "page.language").map_or(&language, |(_, name)| name);
        writeln!(languages, "({language:?}, {name:?}),").unwrap();
        for (key, names) in arguments(&rows).iter().filter(|_| language == ALWAYS) {
            writeln!(checked, "({key:?}, &{:?}),", Vec::from_iter(names)).unwrap();
        }
        writeln!(tables, "({language:?}, &[").unwrap();
        for (key, text) in rows.iter().filter(|_| !in_browser || language == ALWAYS) {
            writeln!(tables, "({key:?}, {text:?}),").unwrap();
        }
        tables.push_str("]),\n");
    }
    let source = format!("const COUNT: usize = {};\n{languages}];\n{tables}];\n{checked}];\n", files.len());
    fs::write(Path::new(&env::var("OUT_DIR").unwrap()).join("locales.rs"), source).unwrap();
}
