//! Builds the project that the page would save for the same files and job.
//!
//! ```text
//!   requested   boards/x/x.drl ─▶ x/x.drl     named like a folder dropped on the page: from the requested folder on
//!   siblings    boards/x/x.gtl ─▶ only if the board differs without it; then the files that make the holes are listed
//! ```

use annulus_core::board::{Board, BoardWanted, drawing, from_artwork_with};
use annulus_core::cam::work::Work;
use annulus_core::project;
use annulus_core::project::saved::{Project, SaidOfFiles};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The files that a board was read from.
#[derive(Debug)]
pub(crate) struct Given {
    /// Names and bytes: first the requested files, then their siblings.
    pub(crate) files: Vec<(String, Vec<u8>)>,
    /// Number of requested files.
    pub(crate) asked_for: usize,
    /// Settings for these files.
    pub(crate) said: SaidOfFiles,
    /// Names of the files that make the holes.
    pub(crate) used: Vec<String>,
}

/// The project of `work` on `board`, which was read from `given` at `paths`. Read again, it gives the same
/// board.
pub(crate) fn project(paths: &[PathBuf], given: Given, board: &Board, work: &Work) -> Project {
    let Given { mut files, asked_for, mut said, used } = given;
    if files.len() > asked_for {
        let beside = files.split_off(asked_for);
        if !alike(&board_of(&files, &said), board) {
            files.extend(beside);
            said.used = Some(used);
        }
    }
    rename(paths, &mut files, &mut said);
    Project { files, said, job: Some(project::write(work)) }
}

/// The board of `files` alone.
fn board_of(files: &[(String, Vec<u8>)], said: &SaidOfFiles) -> Board {
    let mut artwork = drawing::read_under(files, &said.numbers.overrides());
    said.say_roles(&mut artwork);
    let mut used = said.used_of(&artwork).unwrap_or_else(|| artwork.default_use());
    drawing::lay_over_all(files, &mut artwork, &mut used);
    from_artwork_with(&artwork, &used, BoardWanted { copper: true, aligned: said.aligned }).0
}

/// Returns `true` if two boards give the same machine work.
fn alike(one: &Board, other: &Board) -> bool {
    let copper = |board: &Board| -> Vec<_> {
        board.copper.iter().map(|copper| (copper.face, copper.region.clone(), copper.nets.clone())).collect()
    };
    (&one.holes, &one.slots, &one.outline) == (&other.holes, &other.slots, &other.outline)
        && copper(one) == copper(other)
}

/// Renames files as the page would, unless two would get the same name.
fn rename(paths: &[PathBuf], files: &mut [(String, Vec<u8>)], said: &mut SaidOfFiles) {
    let names: Vec<String> = files.iter().map(|(name, _)| short(paths, name)).collect();
    if names.iter().collect::<BTreeSet<_>>().len() != names.len() {
        return;
    }
    let with_roles = said.roles.iter_mut().map(|(name, ..)| name);
    for used in said.used.iter_mut().flatten().chain(with_roles) {
        let whole = files.iter().zip(&names).find_map(|((name, _), short)| {
            let rest = used.strip_prefix(name.as_str())?;
            (rest.is_empty() || rest.starts_with("!/")).then(|| format!("{short}{rest}"))
        });
        *used = whole.unwrap_or_else(|| used.clone());
    }
    files.iter_mut().zip(names).for_each(|((name, _), short)| *name = short);
}

/// The name of a file, from the folder of `paths` that contains it.
fn short(paths: &[PathBuf], name: &str) -> String {
    let base = |path: &PathBuf| match (path.file_name(), path.parent()) {
        (Some(_), Some(folder)) => folder.to_owned(),
        _ => path.clone(),
    };
    let inside =
        paths.iter().find_map(|path| Path::new(name).strip_prefix(base(path)).ok().map(Path::to_owned));
    let Some(inside) = inside else { return name.to_owned() };
    let parts: Vec<String> = inside.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn project_files_are_named_as_on_the_page() {
        // Requested path, name of a file, and its new name.
        let rows = [
            ("board.drl", "board.drl", "board.drl"),
            ("./board.drl", "./board.drl", "board.drl"),
            ("/home/me/x/board.drl", "/home/me/x/board.drl", "board.drl"),
            ("/home/me/x/board.drl", "/home/me/x/board.gtl", "board.gtl"),
            ("/home/me/x", "/home/me/x/deep/board.gtl", "x/deep/board.gtl"),
            ("x/", "x/board.gtl", "x/board.gtl"),
            ("..", "../board.gtl", "board.gtl"),
            ("/a", "b/board.gtl", "b/board.gtl"),
        ];
        for (path, name, called) in rows {
            assert_eq!(short(&[PathBuf::from(path)], name), called, "{path} {name}");
        }
        let mut files = ["a/x.drl", "b/x.drl"].map(|name| (name.to_owned(), Vec::new()));
        let paths = ["a/x.drl", "b/x.drl"].map(PathBuf::from);
        rename(&paths, &mut files, &mut SaidOfFiles::default());
        assert_eq!((files[0].0.as_str(), files[1].0.as_str()), ("a/x.drl", "b/x.drl"), "two names stay two");
        let used = Some(vec!["a/b.zip!/x.drl".to_owned(), "a/x.drl".to_owned()]);
        let mut said = SaidOfFiles { used, ..SaidOfFiles::default() };
        let mut files = ["a/b.zip", "a/x.drl"].map(|name| (name.to_owned(), Vec::new()));
        rename(&[PathBuf::from("a/b.zip")], &mut files, &mut said);
        assert_eq!(said.used, Some(vec!["b.zip!/x.drl".to_owned(), "x.drl".to_owned()]));
        let role = |name: &str| (name.to_owned(), "copper".to_owned(), Some("top".to_owned()));
        let mut said = SaidOfFiles { roles: vec![role("a/x.gbr")], ..SaidOfFiles::default() };
        rename(&[PathBuf::from("a/x.gbr")], &mut [("a/x.gbr".to_owned(), Vec::new())], &mut said);
        assert_eq!(said.roles, [role("x.gbr")], "a layer keeps its role under its new name");
    }
}
