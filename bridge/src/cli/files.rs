//! Reads the PATHs of the command line. Requested drawings are laid over the other files.

use super::{ReadingArgs, Units, Zeros, roles};
use crate::refusal::Refusal;
use annulus_core::artwork::{self, Artwork, Digits, FileRead, Overrides, Role};
use annulus_core::board::{Board, BoardWanted, drawing, from_artwork_with};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::project::saved::{self, NumberReading, Project, SaidOfFiles};
use annulus_core::{code, error};
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Maximum number of files from folders.
const MOST_FILES: usize = 5_000;
/// Maximum size of one file, in bytes.
const MOST_BYTES: u64 = 256 << 20;
/// Maximum size of all files together, in bytes.
const MOST_BYTES_TOGETHER: u64 = 512 << 20;
/// Maximum size of a file that is read only as a sibling, in bytes.
const MOST_BYTES_BESIDE: u64 = 16 << 20;
/// Maximum number of siblings.
const MOST_BESIDE: usize = 200;

/// Files that were read, and which of them were requested.
#[derive(Debug, Default)]
pub(crate) struct ReadFiles {
    /// All files.
    pub(crate) artwork: Artwork,
    /// Requested files, in order.
    pub(crate) listed: Vec<usize>,
    /// Files that make the holes by default.
    pub(crate) used: Vec<usize>,
    /// Messages about drawings.
    pub(crate) drawn: Vec<Diagnostic>,
    /// Names and bytes as given: first the requested files, then their siblings.
    pub(crate) given: Vec<(String, Vec<u8>)>,
    /// Number of requested files in `given`.
    pub(crate) asked_for: usize,
    /// The user's settings for the files, from flags or a saved project.
    pub(crate) said: SaidOfFiles,
    /// Job file of a saved project.
    pub(crate) job: Option<String>,
}

impl ReadFiles {
    /// The board, with its copper if wanted, and messages about it and the drawings.
    pub(crate) fn board(&self, copper: bool) -> (Board, Vec<Diagnostic>) {
        let wanted = BoardWanted { copper, aligned: self.said.aligned };
        let (board, mut diagnostics) = from_artwork_with(&self.artwork, &self.used, wanted);
        diagnostics.extend(self.drawn.iter().cloned());
        (board, diagnostics)
    }
}

pub(crate) fn read(paths: &[PathBuf], reading: &ReadingArgs) -> Result<ReadFiles, Refusal> {
    let overrides = overrides(reading)?;
    let mut files = Collected::default();
    for path in paths {
        files.collect(path)?;
    }
    let asked_for = files.named.len();
    if !reading.alone {
        for path in paths.iter().filter(|path| path.is_file()) {
            files.beside(path);
        }
    }
    let beside: Vec<String> = files.named.iter().skip(asked_for).map(|(name, _)| name.clone()).collect();
    let mut artwork = drawing::read_under(&files.named, &overrides);
    let said = SaidOfFiles {
        numbers: NumberReading::of(&overrides),
        aligned: reading.align,
        roles: roles::of(&reading.roles, &artwork)?,
        ..SaidOfFiles::default()
    };
    said.say_roles(&mut artwork);
    let is_beside =
        |name: &str| beside.iter().any(|other| name == other || name.starts_with(&format!("{other}!/")));
    let listed: Vec<usize> =
        (0..artwork.files.len()).filter(|&index| !is_beside(&artwork.files[index].name)).collect();
    let listed = of_board(&mut artwork, listed, reading.board.as_deref())?;
    asked_first(&mut artwork, &listed, &said);
    Ok(drawn_over(ReadFiles { artwork, listed, given: files.named, asked_for, said, ..ReadFiles::default() }))
}

/// The files of `listed` that belong to the `asked` board or to no board; all if none is asked for. Drops the
/// other files and the siblings of other boards.
fn of_board(artwork: &mut Artwork, listed: Vec<usize>, asked: Option<&str>) -> Result<Vec<usize>, Refusal> {
    let boards = artwork.boards(&listed);
    if let Some(asked) =
        asked.filter(|asked| !boards.iter().any(|(name, _)| name.eq_ignore_ascii_case(asked)))
    {
        let names: Vec<String> = boards.into_iter().map(|(name, _)| name).collect();
        let why = error!("cli.unknown_board", found = asked, ..);
        return Err(Refusal::usage(why.with("names", names.join(", "))));
    }
    let wanted = |board: &str| match asked {
        Some(asked) => board.eq_ignore_ascii_case(asked),
        None => boards.iter().any(|(name, _)| name == board),
    };
    let others = artwork.files.iter().enumerate();
    let others =
        others.filter(|(_, file)| !file.board.is_empty() && !wanted(&file.board) && !boards.is_empty());
    let others: Vec<usize> = others.map(|(index, _)| index).collect();
    artwork.leave_out(&others);
    Ok(listed.into_iter().filter(|index| !others.contains(index)).collect())
}

/// Takes the role from siblings if a requested layer has the same role and side. A layer whose role a flag
/// sets keeps it.
fn asked_first(artwork: &mut Artwork, listed: &[usize], said: &SaidOfFiles) {
    let place = |file: &FileRead| (file.role, file.side);
    let layers = |file: &&FileRead| matches!(file.role, Role::Copper | Role::Outline);
    let asked: Vec<_> =
        listed.iter().filter_map(|&index| artwork.files.get(index)).filter(layers).map(place).collect();
    let rows = artwork.files.iter().enumerate();
    let others = rows.filter(|(index, file)| !listed.contains(index) && asked.contains(&place(file)));
    let is_said = |file: &FileRead| said.roles.iter().any(|(name, ..)| *name == file.name);
    let others = others.filter(|(_, file)| !is_said(file));
    let others: Vec<String> = others.map(|(_, file)| file.name.clone()).collect();
    others.iter().for_each(|name| artwork.say_role(name, Role::Other, None));
}

/// Reads the board at `paths`, which may be one saved project. `reading` overrides the project's number
/// format.
pub(crate) fn read_board(paths: &[PathBuf], reading: &ReadingArgs) -> Result<ReadFiles, Refusal> {
    let project = match paths {
        [path] => project_file(path)?,
        _ if paths.iter().any(|path| matches!(project_file(path), Ok(Some(_)))) => {
            return Err(Refusal::usage(error!("saved.alone")));
        }
        _ => None,
    };
    let Some(Project { files, mut said, job }) = project else {
        return read(paths, reading);
    };
    let (told, kept) = (overrides(reading)?, said.numbers.overrides());
    let numbers = Overrides {
        units: told.units.or(kept.units),
        digits: told.digits.or(kept.digits),
        zeros: told.zeros.or(kept.zeros),
    };
    said.aligned |= reading.align;
    said.numbers = NumberReading::of(&numbers);
    let mut artwork = drawing::read_under(&files, &numbers);
    if reading.board.is_none() {
        said.choose_board(&mut artwork);
    }
    said.roles.extend(roles::of(&reading.roles, &artwork)?);
    said.say_roles(&mut artwork);
    let all = (0..artwork.files.len()).collect();
    let listed = of_board(&mut artwork, all, reading.board.as_deref())?;
    let asked_for = files.len();
    Ok(drawn_over(ReadFiles { artwork, listed, asked_for, given: files, said, job, ..ReadFiles::default() }))
}

/// Adds the files that make the holes, and lays the requested drawings over them.
fn drawn_over(mut read: ReadFiles) -> ReadFiles {
    let ReadFiles { artwork, listed, used, drawn, given, asked_for, said, .. } = &mut read;
    *used = said.used_of(artwork).unwrap_or_else(|| artwork.default_use_among(listed));
    let from_files = artwork.files.len();
    let asked_for = given.get(..*asked_for).unwrap_or_default();
    *drawn = drawing::lay_over_all(asked_for, artwork, used);
    listed.extend(from_files..artwork.files.len());
    read
}

/// The saved project at `path`; `None` if the file is something else.
fn project_file(path: &Path) -> Result<Option<Project>, Refusal> {
    if !fs::metadata(path).map_err(|error| trouble(path, &error))?.is_file() {
        return Ok(None);
    }
    let mut head = [0; 2];
    let mut file = fs::File::open(path).map_err(|error| trouble(path, &error))?;
    if file.read_exact(&mut head).is_err() || &head != b"PK" {
        return Ok(None);
    }
    let bytes = read_bytes(path, MOST_BYTES).map_err(|error| trouble(path, &error))?;
    let is_one = saved::looks_like_one(&bytes);
    is_one.then(|| saved::read(&path.display().to_string(), &bytes).map_err(Refusal::content)).transpose()
}

/// The user's number format.
fn overrides(reading: &ReadingArgs) -> Result<Overrides, Refusal> {
    let digits = match reading.digits.as_deref() {
        None => None,
        Some(text) => {
            Some(digits(text).ok_or_else(|| Refusal::usage(error!("files.bad_digits", found = text)))?)
        }
    };
    Ok(Overrides {
        units: reading.units.map(|units| match units {
            Units::Mm => artwork::Units::Mm,
            Units::Inch => artwork::Units::Inch,
        }),
        digits,
        zeros: reading.zeros.map(|zeros| match zeros {
            Zeros::Leading => artwork::Zeros::Leading,
            Zeros::Trailing => artwork::Zeros::Trailing,
            Zeros::None => artwork::Zeros::None,
        }),
    })
}

fn digits(text: &str) -> Option<Digits> {
    let (integer, decimal) = text.split_once(['.', ':'])?;
    let digit = |text: &str| text.parse().ok().filter(|digit: &u8| *digit <= 9);
    Some(Digits { integer: digit(integer)?, decimal: digit(decimal)? })
}

#[derive(Default)]
struct Collected {
    named: Vec<(String, Vec<u8>)>,
    bytes: u64,
}

impl Collected {
    /// Adds a file, or a folder with all its contents, in the order of names.
    fn collect(&mut self, path: &Path) -> Result<(), Refusal> {
        let kind = fs::metadata(path).map_err(|error| trouble(path, &error))?;
        if kind.is_dir() {
            for inside in entries(path).map_err(|error| trouble(path, &error))? {
                // A linked folder could form a loop.
                if !inside.is_symlink() || inside.is_file() {
                    self.collect(&inside)?;
                }
            }
            return Ok(());
        }
        if !kind.is_file() {
            return Ok(());
        }
        if kind.len() > MOST_BYTES
            || self.bytes + kind.len() > MOST_BYTES_TOGETHER
            || self.named.len() >= MOST_FILES
        {
            let why = error!("files.too_much", path = path.display(), ..);
            return Err(Refusal::content(
                why.with("files", MOST_FILES).with("megabytes", MOST_BYTES_TOGETHER >> 20),
            ));
        }
        let bytes = read_bytes(path, MOST_BYTES).map_err(|error| trouble(path, &error))?;
        self.bytes += bytes.len() as u64;
        self.named.push((path.display().to_string(), bytes));
        Ok(())
    }

    /// Adds the siblings of a requested file. Unreadable ones are ignored.
    fn beside(&mut self, path: &Path) {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        for other in entries(folder).unwrap_or_default().into_iter().take(MOST_BESIDE) {
            let name = path.with_file_name(other.file_name().unwrap_or_default()).display().to_string();
            let zip = other.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("zip"));
            if zip || !other.is_file() || self.named.iter().any(|(have, _)| *have == name) {
                continue;
            }
            let small = other.metadata().is_ok_and(|kind| kind.len() <= MOST_BYTES_BESIDE);
            if let Some(bytes) = small.then(|| read_bytes(&other, MOST_BYTES_BESIDE).ok()).flatten() {
                self.named.push((name, bytes));
            }
        }
    }
}

fn entries(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut paths =
        fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.path())).collect::<io::Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}

/// Reads at most `most` bytes, even if the file grows meanwhile.
fn read_bytes(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    fs::File::open(path)?.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

pub(super) fn trouble(path: &Path, error: &io::Error) -> Refusal {
    let code = match error.kind() {
        io::ErrorKind::NotFound => code!("files.missing"),
        io::ErrorKind::PermissionDenied => code!("files.no_permission"),
        _ => code!("files.unreadable"),
    };
    Refusal::surroundings(Diagnostic::error(code).with("path", path.display()).with("why", error))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRILL: &[u8] = b"M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\nM30\n";

    #[test]
    fn folders_are_walked_and_siblings_used_but_not_listed() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("inner");
        fs::create_dir(&inner).unwrap();
        fs::write(folder.path().join("b.drl"), b"T01\nX0100Y0100\nX0200Y0300\nM30\n").unwrap();
        fs::write(folder.path().join("b.tools.txt"), b"Tool table\nUnits: mm, 2.2\nT01 0.9\n").unwrap();
        fs::write(inner.join("a.drl"), DRILL).unwrap();
        let reading = ReadingArgs::default();
        let all = read(&[folder.path().to_owned()], &reading).unwrap();
        assert_eq!(all.listed.len(), 3);
        assert_eq!(all.used.len(), 2);

        let one = read(&[folder.path().join("b.drl")], &reading).unwrap();
        let size =
            |read: &ReadFiles| read.artwork.files[read.listed[0]].drill.as_ref().unwrap().tools[0].diameter;
        assert_eq!(one.listed.len(), 1);
        assert_eq!(size(&one).map(|length| length.nm()), Some(900_000));
        let alone = read(&[folder.path().join("b.drl")], &ReadingArgs { alone: true, ..reading }).unwrap();
        assert_eq!(size(&alone), None);
    }

    #[test]
    fn missing_files_and_wrong_options_have_different_exit_codes() {
        let missing = read(&[PathBuf::from("/no/such/file")], &ReadingArgs::default()).unwrap_err();
        assert_eq!(
            (missing.why.code.as_str(), missing.exit),
            ("files.missing", crate::refusal::Exit::Surroundings)
        );
        let digits = ReadingArgs { digits: Some("24".into()), ..ReadingArgs::default() };
        assert_eq!(read(&[], &digits).unwrap_err().exit, crate::refusal::Exit::Usage);
    }
}
