//! Machine files: commented TOML, one table per section of the settings. An unreadable file is never
//! overwritten.

use crate::own;
use crate::refusal::Refusal;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::{self, Machine, SECTIONS, Setting, Value, ValueKind};
use annulus_core::project::text;
use std::env;
use std::fmt::Write as _;
use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

#[derive(Debug)]
pub(crate) struct Known {
    /// As configured; the preset if nothing was configured yet.
    pub(crate) machine: Machine,
    /// The file for changes; it need not exist.
    pub(crate) path: PathBuf,
}

const SCHEMA: i64 = 1;

/// Folder of jobs, journal and drilled-board record: `$ANNULUS_HOME`, else `$XDG_DATA_HOME/annulus`, else
/// `~/.local/share/annulus`.
pub(crate) fn data_folder() -> PathBuf {
    folder("XDG_DATA_HOME", ".local/share")
}

fn config_folder() -> PathBuf {
    folder("XDG_CONFIG_HOME", ".config")
}

/// The settings file of the machine `name`: `machines/NAME.toml` in `$ANNULUS_HOME`, else in
/// `$XDG_CONFIG_HOME/annulus`, else in `~/.config/annulus`.
pub(crate) fn path_of(name: &str) -> PathBuf {
    config_folder().join("machines").join(format!("{name}.toml"))
}

/// File with the name of the machine that `annulus machines use` chose.
fn choice() -> PathBuf {
    data_folder().join("machine")
}

/// The machine that `annulus machines use` chose, as name or file; `None` if it chose none.
pub(crate) fn chosen() -> Option<&'static str> {
    static CHOSEN: OnceLock<Option<String>> = OnceLock::new();
    let read = || {
        let text = fs::read_to_string(choice()).ok()?;
        Some(text.trim().to_owned()).filter(|name| !name.is_empty())
    };
    CHOSEN.get_or_init(read).as_deref()
}

/// Saves the choice of `annulus machines use`.
pub(crate) fn choose(name: &str) -> io::Result<()> {
    write_own(&choice(), format!("{name}\n").as_bytes())
}

/// Folder of this user's own frequency converter profiles.
pub(crate) fn converters() -> PathBuf {
    config_folder().join("converters")
}

fn folder(variable: &str, beneath_home: &str) -> PathBuf {
    let set = |name| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    if let Some(home) = set("ANNULUS_HOME") {
        return home;
    }
    let base = set(variable).or_else(|| set("HOME").map(|home| home.join(beneath_home)));
    base.unwrap_or_default().join("annulus")
}

pub(crate) fn names() -> Vec<String> {
    let Some(folder) = path_of("x").parent().map(Path::to_owned) else { return Vec::new() };
    let files = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let tables = files.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    let mut names: Vec<_> =
        tables.filter_map(|path| path.file_stem().map(|stem| stem.to_string_lossy().into_owned())).collect();
    names.sort();
    names
}

/// The machine that `text` means: the name of a machine file, of a preset, or the path of a machine file.
pub(crate) fn named(text: &str) -> Result<Known, Refusal> {
    let text = machine::preset_name(text);
    let is_name = !text.is_empty() && text.chars().all(|c| c.is_alphanumeric() || c == '-' || c == '_');
    if is_name {
        let path = path_of(text);
        if path.exists() {
            return load(&path).map(|machine| Known { machine, path });
        }
        if let Some(machine) = machine::preset(text) {
            return Ok(Known { machine, path });
        }
    }
    let path = PathBuf::from(text);
    if path.is_file() {
        return load(&path).map(|machine| Known { machine, path });
    }
    let why = error!("machine.no_such", name = text, names = words().join(", "));
    Err(Refusal::surroundings(why))
}

/// Every name of a machine, sorted: presets, their aliases, and the user's machine files.
pub(crate) fn words() -> Vec<String> {
    let mut words: Vec<String> = machine::preset_words().map(str::to_owned).chain(names()).collect();
    words.sort();
    words.dedup();
    words
}

pub(crate) fn load(path: &Path) -> Result<Machine, Refusal> {
    let file = path.display().to_string();
    let bytes = fs::read(path).map_err(|error| unreadable(&file, &error))?;
    let refuse = |diagnostic: Diagnostic| Refusal::content(diagnostic);
    let Ok(text) = std::str::from_utf8(&bytes) else {
        let at = std::str::from_utf8(&bytes).err().map_or(0, |error| error.valid_up_to());
        let (line, column) = text::line_and_column(&bytes, at);
        return Err(refuse(error!("machine.file_not_text").at(&file, line, column)));
    };
    parse(&file, text).map_err(refuse)
}

fn unreadable(file: &str, error: &io::Error) -> Refusal {
    let why = error!("machine.file_unreadable", file = file, reason = error);
    Refusal::surroundings(why)
}

/// Parses a machine file. Settings that it does not mention are those of the virtual drill.
fn parse(file: &str, written: &str) -> Result<Machine, Diagnostic> {
    let document = toml::de::DeTable::parse(written).map_err(|error| {
        let at = error.span().map_or(0, |span| span.start);
        let (line, column) = text::line_and_column(written.as_bytes(), at);
        let what = error.message().lines().next().unwrap_or_default().to_owned();
        error!("machine.file_syntax", what = what).at(file, line, column)
    })?;
    let place = |diagnostic: Diagnostic, at: usize| {
        let (line, column) = text::line_and_column(written.as_bytes(), at);
        diagnostic.at(file, line, column)
    };
    let mut machine = machine::virtual_drill();
    let mut changes = Vec::new();
    let mut schema = None;
    for (section, value) in document.get_ref() {
        let at = section.span().start;
        match value.get_ref() {
            toml::de::DeValue::Integer(number) if section.get_ref() == "schema" => {
                schema = number.as_str().parse::<i64>().ok();
            }
            toml::de::DeValue::Table(rows) => {
                for (name, value) in rows {
                    let key = format!("{}.{}", section.get_ref(), name.get_ref());
                    let (value_at, name_at) = (value.span().start, name.span().start);
                    let change = [(key.clone(), text::value(value.get_ref()))];
                    // First one by one, so that an error has the line of its field; limits between fields
                    // later.
                    if machine::setting(&key).is_none() {
                        let why = error!("machine.setting_unknown", key = key);
                        return Err(place(why, name_at));
                    }
                    if let Some(why) = machine::apply(&machine, &change).err().and_then(|all| {
                        all.into_iter().find(|diagnostic| diagnostic.code.starts_with("machine.setting_"))
                    }) {
                        return Err(place(why, value_at));
                    }
                    changes.extend(change.map(|change| (change, name_at)));
                }
            }
            _ => {
                let why = error!("machine.setting_unknown", key = section.get_ref());
                return Err(place(why, at));
            }
        }
    }
    if schema != Some(SCHEMA) {
        let found = schema.map_or_else(|| "none".to_owned(), |number| number.to_string());
        let why = error!("machine.file_schema", found = found, known = SCHEMA);
        return Err(place(why, 0));
    }
    let moved = moved_from_card(&changes);
    changes.extend(moved);
    let all: Vec<_> = changes.iter().map(|(change, _)| change.clone()).collect();
    match machine::apply(&machine, &all) {
        Ok(changed) => {
            machine = changed;
            Ok(machine)
        }
        Err(refusals) => {
            let none = || error!("machine.file_syntax", what = "?");
            let why = refusals.into_iter().next().unwrap_or_else(none);
            let key = why.args.iter().find(|(name, _)| name == "key").map(|(_, key)| key.clone());
            let at =
                changes.iter().find(|((name, _), _)| Some(name) == key.as_ref()).map_or(0, |(_, at)| *at);
            Err(place(why, at))
        }
    }
}

/// A change in a file, and its offset.
type Placed = ((String, Value), usize);

/// In older files the settings of the parallel port are in the card's section: moves them.
fn moved_from_card(changes: &[Placed]) -> Vec<Placed> {
    let is_on_it =
        |((key, value), _): &Placed| key == "machine.output" && *value == Value::Text("parallel".to_owned());
    let has_own = changes.iter().any(|((key, _), _)| key.starts_with("parallel."));
    let was_wired = changes.iter().any(|((key, _), _)| key.starts_with("card."));
    if has_own || !was_wired || !changes.iter().any(is_on_it) {
        return Vec::new();
    }
    let usual = machine::virtual_drill();
    let moved = machine::settings().filter_map(|row| {
        let name = row.key.strip_prefix("parallel.")?;
        let old = if name == "address" { "machine.card_address".to_owned() } else { format!("card.{name}") };
        let said =
            changes.iter().find(|((key, _), _)| *key == old).map(|((_, value), at)| (value.clone(), *at));
        let (value, at) = said.or_else(|| Some((machine::setting(&old)?.value(&usual), 0)))?;
        Some(((row.key.to_owned(), value), at))
    });
    moved.collect()
}

pub(crate) fn save(path: &Path, machine: &Machine) -> Result<(), Diagnostic> {
    write_own(path, text_of(machine).as_bytes()).map_err(|error| {
        let file = path.display();
        error!("machine.file_not_saved", file = file, reason = error)
    })
}

/// The folder of a file; the current one for a bare name.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Writes a file so that after any interruption either the old or the new one exists.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write(path, bytes, |fresh| fs::File::create(fresh))
}

/// The same for a file that only this user may read.
pub(crate) fn write_own(path: &Path, bytes: &[u8]) -> io::Result<()> {
    // The folder of a user's own machine file elsewhere is not ours to change.
    let inside = folder_of(path);
    let ours = [data_folder(), config_folder()].into_iter().find(|root| inside.starts_with(root));
    if let Some(root) = ours {
        own::root(&root)?;
        if inside != root {
            own::folder(inside)?;
        }
    }
    write(path, bytes, |fresh| {
        // A leftover of a killed process; never write into an existing file.
        let _ = fs::remove_file(fresh);
        own::open(fresh, fs::OpenOptions::new().write(true).create_new(true))
    })
}

fn write(path: &Path, bytes: &[u8], make: impl Fn(&Path) -> io::Result<fs::File>) -> io::Result<()> {
    let folder = folder_of(path);
    fs::create_dir_all(folder)?;
    let fresh = path.with_extension(format!("new-{}", std::process::id()));
    let written = make(&fresh).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    let renamed = written.and_then(|()| fs::rename(&fresh, path));
    if renamed.is_err() {
        let _ = fs::remove_file(&fresh);
        return renamed;
    }
    fs::File::open(folder)?.sync_all()
}

/// The file of `machine`, with a comment above every setting: its description, unit and range.
pub(crate) fn text_of(machine: &Machine) -> String {
    let mut out =
        format!("# A machine of Annulus. Missing lines have the virtual drill's value.\nschema = {SCHEMA}\n");
    for section in SECTIONS {
        let _ = write!(out, "\n[{}]\n", section.name);
        for row in section.rows {
            let _ = writeln!(out, "# {}", explain(row));
            let name = row.key.split_once('.').map_or(row.key, |(_, name)| name);
            let _ = writeln!(out, "{name} = {}", text::literal(&row.value(machine)));
        }
    }
    out
}

fn explain(row: &Setting) -> String {
    let say = |key: &str| annulus_core::locale::text("en", key, &[]);
    let sentence = format!("{}. {}", say(&row.name_key()), say(&row.help_key()));
    let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
    match row.kind {
        ValueKind::Text(longest) => format!("{sentence} At most {longest} characters."),
        ValueKind::Number(low, high) | ValueKind::Whole(low, high) => {
            format!("{sentence} {low} … {high}{unit}.")
        }
        ValueKind::Choice(words) => format!("{sentence} One of: {}.", words.join(", ")),
        ValueKind::Numbers(low, high) | ValueKind::Wholes(low, high) => {
            format!("{sentence} Each {low} … {high}{unit}, at most 64.")
        }
        ValueKind::Tools => sentence,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::chance::Chance;

    #[test]
    fn saved_presets_load_unchanged() {
        let folder = tempfile::tempdir().unwrap();
        for (name, machine) in machine::presets() {
            let path = folder.path().join("deep").join(format!("{name}.toml"));
            save(&path, &machine).unwrap();
            assert_eq!(load(&path).unwrap(), machine, "{name}");
        }
        let left = fs::read_dir(folder.path().join("deep")).unwrap().count();
        assert_eq!(left, machine::presets().len(), "no half-written file stays");
    }

    #[test]
    fn list_of_diameters_is_read_and_saved_as_tools() {
        let old = "schema = 1\n[rack]\nbits = [0.8, 1.0]\n";
        let machine = parse("old", old).unwrap();
        assert_eq!(machine.drills().len(), 2);
        let text = text_of(&machine);
        assert!(text.contains("tools = [\n  \"T1 drill 0.8\",\n  \"T2 drill 1\",\n]"), "{text}");
        assert_eq!(parse("saved", &text).unwrap(), machine);
        let wrong = "schema = 1\n[rack]\nchange = \"manual\"\ntools = [\"T1 drill 0.8\", \"T2 reamer 1\"]\n";
        let why = parse("wrong", wrong).unwrap_err();
        assert_eq!((why.code.as_str(), why.place.clone().unwrap().line), ("machine.tool_line", 4), "{why:?}");
        assert_eq!(parse("none", "schema = 1\n[rack]\ntools = []\n").unwrap().rack, []);
    }

    #[test]
    fn parallel_port_with_old_card_wiring_is_read() {
        let wired = "x = [0, 1, 2, 3, -1, -1, -1, -1]\ny = [4, 5, 6, 7, -1, -1, -1, -1]\nz = [8, 9, 10, 11, -1, -1, -1, -1]\n\
            spindle = -1\nsensors = [1, -1, 0, -1, 2, 3, 4]\nstart_stop_rate = 90\n";
        let old =
            format!("schema = 1\n[machine]\noutput = \"parallel\"\ncard_address = 632\n[card]\n{wired}");
        let machine = parse("old", &old).unwrap();
        let port = &machine.parallel;
        // Missing values are the defaults of that time.
        assert_eq!((port.address, port.wiring.device.as_str()), (632, "/dev/port"));
        assert_eq!((port.wiring.sensors[..3].to_vec(), port.wiring.start_stop_hz), (vec![1, -1, 0], 90));
        assert_eq!(machine.wiring(), &port.wiring);
        assert_eq!(parse("saved", &text_of(&machine)).unwrap(), machine);
        // A file with the parallel port's own section ignores the card's; with a card, nothing is moved.
        let new = format!("{old}[parallel]\naddress = 888\n");
        let own = parse("new", &new).unwrap().parallel;
        assert_eq!((own.address, own.wiring.start_stop_hz), (888, 70));
        let card = parse("card", &old.replace("parallel", "virtual")).unwrap();
        assert_eq!(card.parallel, machine::virtual_drill().parallel);
        // A new file without wires has the default port.
        for bare in ["", "[parallel]\n"] {
            let bare = format!("schema = 1\n[machine]\noutput = \"parallel\"\n{bare}");
            assert_eq!(parse("bare", &bare).unwrap().parallel, machine::virtual_drill().parallel);
        }
        let why = parse("bad", &old.replace("spindle = -1", "spindle = 24")).unwrap_err();
        let place = why.place.clone().unwrap();
        assert_eq!((why.code.as_str(), place.line), ("machine.card_bit_outside", 9), "{why:?}");
    }

    #[test]
    fn corrupt_file_is_refused_with_line_and_left_unchanged() {
        let rows: [(&str, &str, u32, u32); 9] = [
            ("schema = 1\n[x\nmax = 3\n", "machine.file_syntax", 2, 3),
            ("schema = 1\n[x]\nmax_speed = \"fast\"\n", "machine.setting_kind", 3, 13),
            ("schema = 1\n[x]\nmax_speed = -4\n", "machine.setting_range", 3, 13),
            ("schema = 1\n[x]\n  colour = 4\n", "machine.setting_unknown", 3, 3),
            ("schema = 1\n[w]\ncolour = 4\n", "machine.setting_unknown", 3, 1),
            ("schema = 1\nspeed = 4\n", "machine.setting_unknown", 2, 1),
            ("schema = 1\n[x]\nhome_end = \"left\"\n", "machine.setting_choice", 3, 12),
            ("schema = 1\n[y]\nmax = 10.0\nmin = 20.0\n", "machine.range_inside_out", 4, 1),
            ("schema = 7\n", "machine.file_schema", 1, 1),
        ];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bad.toml");
        for (text, code, line, column) in rows {
            fs::write(&path, text).unwrap();
            let why = load(&path).unwrap_err().why;
            let place = why.place.clone().unwrap();
            assert_eq!((why.code.as_str(), place.line, place.column), (code, line, column), "{text}");
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
    }

    #[test]
    fn truncation_and_random_bytes_do_not_panic() {
        let text = text_of(&machine::virtual_drill());
        for end in (0..text.len()).filter(|end| text.is_char_boundary(*end)) {
            let _ = parse("cut", &text[..end]);
        }
        let mut chance = Chance::new(7);
        for _ in 0..2_000 {
            let mut bytes = text.clone().into_bytes();
            let at = chance.below(bytes.len());
            bytes[at] = chance.below(128) as u8;
            let _ = parse("mutated", &String::from_utf8_lossy(&bytes));
        }
    }
}
