//! Turns `www/locales/*.toml` into sorted tables of (key, text): one file, one language.

use std::{env, fmt::Write, fs, path::Path};

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

fn main() {
    let folder = Path::new(&env::var("CARGO_MANIFEST_DIR").unwrap()).join("../www/locales");
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut files: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    let mut source = String::from("pub(super) const TABLES: &[(&str, &[(&str, &str)])] = &[\n");
    for path in files {
        println!("cargo::rerun-if-changed={}", path.display());
        let text = fs::read_to_string(&path).unwrap();
        let table: toml::Table = text.parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut rows = Vec::new();
        flatten("", &table, &mut rows);
        rows.sort();
        let language = path.file_stem().unwrap().to_string_lossy().into_owned();
        writeln!(source, "({language:?}, &[").unwrap();
        for (key, text) in rows {
            writeln!(source, "({key:?}, {text:?}),").unwrap();
        }
        source.push_str("]),\n");
    }
    source.push_str("];\n");
    fs::write(Path::new(&env::var("OUT_DIR").unwrap()).join("locales.rs"), source).unwrap();
}
