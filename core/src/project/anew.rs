//! Opening files while a board is open: decides whether they are new exports of it, and merges them.
//!
//! ```text
//!   open       out/top.gbr  out/holes.drl  notes.txt
//!   opened     holes.drl                      ─▶ out/top.gbr  out/holes.drl′  notes.txt
//!                                                replaces the file of that name
//!   opened     out/top.gbr  out/npth.drl      ─▶ out/top.gbr′ out/npth.drl    notes.txt
//!                                                a folder replaces the whole folder
//! ```

use super::saved;

type Files = Vec<(String, Vec<u8>)>;

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportedAnew {
    /// All files of the board.
    pub files: Files,
    pub replaced: Vec<String>,
    pub added: Vec<String>,
    pub gone: Vec<String>,
}

fn last(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

fn folder(name: &str) -> Option<&str> {
    name.split_once('/').map(|(folder, _)| folder)
}

/// Index in `open` of the file that `name` replaces: an equal full name, else the only file with that name in
/// another folder.
pub fn place_of(open: &[(String, Vec<u8>)], name: &str) -> Option<usize> {
    let same = open.iter().position(|(other, _)| other == name);
    let alike = || {
        let mut alike = open.iter().enumerate().filter(|(_, (other, _))| last(other) == last(name));
        alike.next().map(|(place, _)| place).filter(|_| alike.next().is_none())
    };
    same.or_else(alike)
}

/// Merges the opened files into `open`. None if no name matches, or if one of them is a saved project: then
/// they are another board.
pub fn exported_anew(open: &[(String, Vec<u8>)], brought: &[(String, Vec<u8>)]) -> Option<ExportedAnew> {
    if brought.iter().any(|(_, bytes)| saved::looks_like_one(bytes)) {
        return None;
    }
    let folders: Vec<&str> = brought.iter().filter_map(|(name, _)| folder(name)).collect();
    let mut anew = ExportedAnew::default();
    let mut taken = vec![None; open.len()];
    let mut more = Vec::new();
    for (name, bytes) in brought {
        match place_of(open, name).filter(|place| taken[*place].is_none()) {
            Some(place) => taken[place] = Some(bytes),
            None => more.push((name.clone(), bytes.clone())),
        }
    }
    if taken.iter().all(Option::is_none) {
        return None;
    }
    for ((name, before), now) in open.iter().zip(taken) {
        match now {
            Some(bytes) => {
                if bytes != before {
                    anew.replaced.push(name.clone());
                }
                anew.files.push((name.clone(), bytes.clone()));
            }
            None if folder(name).is_some_and(|folder| folders.contains(&folder)) => {
                anew.gone.push(name.clone());
            }
            None => anew.files.push((name.clone(), before.clone())),
        }
    }
    anew.added = more.iter().map(|(name, _)| name.clone()).collect();
    anew.files.extend(more);
    Some(anew)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parses names with one character of content each: `a.drl=1 b.gbr=2`.
    fn files(text: &str) -> Files {
        text.split_whitespace()
            .filter_map(|word| word.split_once('='))
            .map(|(name, content)| (name.to_owned(), content.as_bytes().to_vec()))
            .collect()
    }

    fn in_words(anew: Option<ExportedAnew>) -> String {
        let Some(anew) = anew else { return "another board".to_owned() };
        let files =
            anew.files.iter().map(|(name, bytes)| format!("{name}={}", String::from_utf8_lossy(bytes)));
        let files = files.collect::<Vec<_>>().join(" ");
        format!("{files} | {} | {} | {}", anew.replaced.join(" "), anew.added.join(" "), anew.gone.join(" "))
    }

    #[test]
    fn new_files_replace_those_of_the_same_name() {
        let rows = [
            ("a.drl=1 b.gbr=1", "a.drl=2", "a.drl=2 b.gbr=1 | a.drl |  | "),
            ("a.drl=1 b.gbr=1", "a.drl=1", "a.drl=1 b.gbr=1 |  |  | "),
            ("a.drl=1 b.gbr=1", "b.gbr=2 a.drl=2", "a.drl=2 b.gbr=2 | a.drl b.gbr |  | "),
            ("a.drl=1 b.gbr=1", "c.drl=2", "another board"),
            ("a.drl=1", "a.drl=2 n.drl=2", "a.drl=2 n.drl=2 | a.drl | n.drl | "),
            // matched by file name, if that is unique
            ("out/a.drl=1 out/b.gbr=1", "a.drl=2", "out/a.drl=2 out/b.gbr=1 | out/a.drl |  | "),
            ("a.drl=1", "new/a.drl=2", "a.drl=2 | a.drl |  | "),
            ("l/a.drl=1 r/a.drl=1", "a.drl=2", "another board"),
            ("l/a.drl=1 r/a.drl=1", "r/a.drl=2", "l/a.drl=1 r/a.drl=2 | r/a.drl |  | "),
            // a folder replaces the whole folder
            (
                "out/a.drl=1 out/b.gbr=1 n.txt=1",
                "out/a.drl=2 out/c.drl=2",
                "out/a.drl=2 n.txt=1 out/c.drl=2 | out/a.drl | out/c.drl | out/b.gbr",
            ),
            // two files of one name: the first replaces, the other is added
            ("a.drl=1", "a.drl=2 x/a.drl=3", "a.drl=2 x/a.drl=3 | a.drl | x/a.drl | "),
            ("", "a.drl=1", "another board"),
            ("a.drl=1", "", "another board"),
        ];
        for (open, brought, expected) in rows {
            assert_eq!(
                in_words(exported_anew(&files(open), &files(brought))),
                expected,
                "{open} + {brought}"
            );
        }
    }

    #[test]
    fn saved_project_is_a_separate_board() {
        let project = saved::write(&saved::Project::default()).unwrap();
        let open = vec![("a.annulus".to_owned(), vec![1])];
        assert_eq!(exported_anew(&open, &[("a.annulus".to_owned(), project)]), None);
    }
}
