//! `cargo xtask bench --page --what [CRATE]`: the page's size by crate.
//!
//! ```text
//! page.wasm ─┬─ name section   number ─▶ name        crate            functions   bytes   packed alone
//!            ├─ code section   number ─▶ size   ─▶   wgpu_core            2,913   812 kB         214 kB
//!            └─ data section                         annulus_app          …
//! ```
//!
//! Sizes are before unused functions are removed. A generic function counts for its own crate, not its
//! caller's. Judges nothing.

use crate::page::{self, Effort, PARTS};
use crate::sh::{Done, say, target};
use crate::wasm;
use std::collections::BTreeMap;
use std::fs;

/// Rows of crates or modules to print, and of single functions.
const ROWS: usize = 40;

const CUSTOM: u8 = 0;
const IMPORT: u8 = 2;
const CODE: u8 = 10;
const DATA: u8 = 11;

/// Prints the sizes by crate, or by module of one crate.
pub(crate) fn run(arguments: &[String]) -> Done {
    let of = match arguments {
        [] => None,
        [one] => Some(one.as_str()),
        _ => return Err("--what takes one name of a crate.".to_owned()),
    };
    page::build(Effort::Whole)?;
    for part in PARTS {
        let file = target().join(wasm::TRIPLE).join("page").join(format!("{part}.wasm"));
        let bytes = fs::read(&file).map_err(|error| format!("{}: {error}.", file.display()))?;
        let module = read(&bytes).ok_or_else(|| format!("{} is no WebAssembly.", file.display()))?;
        say(&format!("What is in {part}"));
        print(&module, of)?;
    }
    Ok(())
}

/// Contents of a WebAssembly file.
#[derive(Default)]
struct Module<'a> {
    functions: Vec<(String, &'a [u8])>,
    data: &'a [u8],
}

struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take(1)?.first().copied()
    }

    /// A LEB128 number: seven bits per byte, the lowest first.
    fn number(&mut self) -> Option<usize> {
        let mut value = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= usize::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }

    /// Bytes with their length in front.
    fn counted(&mut self) -> Option<&'a [u8]> {
        let count = self.number()?;
        self.take(count)
    }

    fn text(&mut self) -> Option<String> {
        self.counted().map(|bytes| String::from_utf8_lossy(bytes).into_owned())
    }
}

/// Parses a file; `None` if it is not WebAssembly.
fn read(bytes: &[u8]) -> Option<Module<'_>> {
    let mut all = Reader(bytes);
    if all.take(8)? != b"\0asm\x01\0\0\0" {
        return None;
    }
    let (mut module, mut bodies, mut imported, mut names) =
        (Module::default(), Vec::new(), 0, BTreeMap::new());
    while !all.0.is_empty() {
        let (section, content) = (all.byte()?, all.counted()?);
        let mut content = Reader(content);
        match section {
            IMPORT => imported = functions_imported(&mut content)?,
            CODE => {
                let count = content.number()?;
                bodies = (0..count).map(|_| content.counted()).collect::<Option<_>>()?;
            }
            DATA => module.data = content.0,
            CUSTOM if content.text()? == "name" => names = function_names(&mut content)?,
            _ => {}
        }
    }
    let named = (imported..).zip(bodies).map(|(number, body)| {
        let name = names.remove(&number).unwrap_or_else(|| format!("function {number}"));
        (format!("{:#}", rustc_demangle::demangle(&name)), body)
    });
    module.functions = named.collect();
    Some(module)
}

/// Number of imported functions: their indices precede those of the bodies.
fn functions_imported(section: &mut Reader<'_>) -> Option<usize> {
    let mut functions = 0;
    for _ in 0..section.number()? {
        section.counted()?;
        section.counted()?;
        match section.byte()? {
            0 => {
                section.number()?;
                functions += 1;
            }
            kind @ (1 | 2) => {
                section.take(usize::from(kind == 1))?;
                let has_most = section.byte()? & 1 == 1;
                section.number()?;
                has_most.then(|| section.number()).map_or(Some(0), |most| most)?;
            }
            3 => drop(section.take(2)?),
            _ => {
                section.byte()?;
                section.number()?;
            }
        }
    }
    Some(functions)
}

fn function_names(section: &mut Reader<'_>) -> Option<BTreeMap<usize, String>> {
    while !section.0.is_empty() {
        let (kind, content) = (section.byte()?, section.counted()?);
        if kind == 1 {
            let mut content = Reader(content);
            let count = content.number()?;
            return (0..count).map(|_| Some((content.number()?, content.text()?))).collect();
        }
    }
    Some(BTreeMap::new())
}

/// The path components of a function's name: for `<a::B as c::D>::e`, those of `a::B`.
fn path(name: &str) -> Vec<&str> {
    let begin = name.find(|letter: char| letter.is_alphanumeric() || letter == '_').unwrap_or(0);
    let word = |letter: char| letter.is_alphanumeric() || letter == '_' || letter == ':';
    let rest = name.get(begin..).unwrap_or_default();
    let rest =
        ["mut ", "dyn ", "const "].iter().fold(rest, |rest, word| rest.strip_prefix(word).unwrap_or(rest));
    let end = rest.find(|letter| !word(letter)).unwrap_or(rest.len());
    rest.get(..end).unwrap_or_default().split("::").filter(|word| !word.is_empty()).collect()
}

/// The crate of a function or, with `of`, its module in that crate; `None` for a function of another crate.
fn owner(name: &str, of: Option<&str>) -> Option<String> {
    let path = path(name);
    let (first, more) = path.split_first()?;
    match of {
        None => Some((*first).to_owned()),
        Some(of) if of == *first => {
            let modules =
                more.iter().take(2).take_while(|word| word.starts_with(|letter: char| letter.is_lowercase()));
            Some(modules.copied().collect::<Vec<_>>().join("::"))
        }
        Some(_) => None,
    }
}

fn print(module: &Module<'_>, of: Option<&str>) -> Done {
    let mut owners: BTreeMap<String, (usize, Vec<u8>)> = BTreeMap::new();
    let mut functions: Vec<(usize, &str)> = Vec::new();
    for (name, body) in &module.functions {
        let Some(owner) = owner(name, of) else { continue };
        let (count, bytes) = owners.entry(owner).or_default();
        *count += 1;
        bytes.extend_from_slice(body);
        functions.push((body.len(), name));
    }
    let mut rows: Vec<_> = owners.into_iter().collect();
    rows.sort_by_key(|(_, (_, bytes))| std::cmp::Reverse(bytes.len()));
    println!("{:<40} {:>9} {:>9} {:>13}", of.unwrap_or("crate"), "functions", "bytes", "packed alone");
    for (owner, (count, bytes)) in rows.iter().take(ROWS) {
        let packed = page::brotli(bytes)?.len();
        println!("{owner:<40} {count:>9} {:>6} kB {:>10} kB", bytes.len() / 1000, packed / 1000);
    }
    if of.is_none() {
        let packed = page::brotli(module.data)?.len();
        println!("{:<40} {:>9} {:>6} kB {:>10} kB", "data", "", module.data.len() / 1000, packed / 1000);
    }
    functions.sort_by(|a, b| b.cmp(a));
    println!();
    for (bytes, name) in functions.iter().take(ROWS) {
        println!("{:>6} kB  {name}", bytes / 1000);
    }
    println!();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_have_their_names_after_the_imports() {
        let mut bytes = b"\0asm\x01\0\0\0".to_vec();
        let mut section = |number: u8, content: &[u8]| {
            bytes.push(number);
            bytes.push(content.len() as u8);
            bytes.extend_from_slice(content);
        };
        // Imports a function, a memory with a limit, a table and a global.
        section(IMPORT, b"\x04\x01a\x01b\x00\x00\x01a\x01m\x02\x01\x01\x02\x01a\x01t\x01\x70\x00\x01\x01a\x01g\x03\x7f\x00");
        section(CODE, b"\x02\x02\x00\x0b\x03\x00\x01\x0b");
        section(DATA, b"data");
        section(CUSTOM, b"\x04name\x00\x02\x01x\x01\x21\x02\x01\x0aours::made\x02\x12_ZN5other2up4workE");
        let module = read(&bytes).unwrap();
        let named: Vec<_> = module.functions.iter().map(|(name, body)| (name.as_str(), body.len())).collect();
        assert_eq!(named, [("ours::made", 2), ("other::up::work", 3)]);
        assert_eq!(module.data, b"data");
        assert!(read(b"\0asm\x01\0\0").is_none() && read(&bytes[..bytes.len() - 1]).is_none());
    }

    #[test]
    fn function_belongs_to_the_crate_of_its_path() {
        let rows = [
            ("core::ptr::drop_in_place<app::Model>", None, Some("core")),
            ("<app::job::Leg as serde::Serialize>::serialize", None, Some("app")),
            ("<&mut app::job::Leg as core::fmt::Debug>::fmt", None, Some("app")),
            ("<&[app::Leg] as core::fmt::Debug>::fmt", None, Some("app")),
            ("memcpy", None, Some("memcpy")),
            ("app::job::tool::Bit::title", Some("app"), Some("job::tool")),
            ("app::job::Bit::title", Some("app"), Some("job")),
            ("app::begin", Some("app"), Some("begin")),
            ("core::fmt::write", Some("app"), None),
        ];
        for (name, of, expected) in rows {
            assert_eq!(owner(name, of).as_deref(), expected, "{name}");
        }
    }
}
