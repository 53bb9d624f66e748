//! Files that are brought while a board is open: whether they are new exports of it, and which files it has then (N24).
//!
//! ```text
//!   open       out/top.gbr  out/holes.drl  notes.txt
//!   brought    holes.drl                      ─▶ out/top.gbr  out/holes.drl′  notes.txt      it takes the place of its namesake
//!   brought    out/top.gbr  out/npth.drl      ─▶ out/top.gbr′ out/npth.drl    notes.txt      a folder comes whole: what is not in it is gone
//! ```
//!
//! Comes in: names and bytes of both. Goes out: the files from now on, under the names by which the person knows them. Does not
//! look into them.

use super::saved;

/// Names and bytes.
type Files = Vec<(String, Vec<u8>)>;

/// What becomes of the files of a board.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportedAnew {
    /// All its files from now on.
    pub files: Files,
    /// Names of those whose bytes are others now.
    pub replaced: Vec<String>,
    /// Names of those that it did not have.
    pub added: Vec<String>,
    /// Names of those that it has no more.
    pub gone: Vec<String>,
}

/// The part of a name behind its folders.
fn last(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

/// The outermost folder of a name.
fn folder(name: &str) -> Option<&str> {
    name.split_once('/').map(|(folder, _)| folder)
}

/// The place among the `open` files that a file called `name` takes: its namesake's, else that of the only one that is called so in
/// another folder.
pub fn place_of(open: &[(String, Vec<u8>)], name: &str) -> Option<usize> {
    let same = open.iter().position(|(other, _)| other == name);
    let alike = || {
        let mut alike = open.iter().enumerate().filter(|(_, (other, _))| last(other) == last(name));
        alike.next().map(|(place, _)| place).filter(|_| alike.next().is_none())
    };
    same.or_else(alike)
}

/// What becomes of the `open` files when others are brought; none where none of them is called as one that is open, or one of
/// them is a saved project, which is a board of its own.
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

    /// Names with a letter of content each: `a.drl=1 b.gbr=2`.
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
    fn files_take_the_places_of_their_namesakes() {
        let rows = [
            ("a.drl=1 b.gbr=1", "a.drl=2", "a.drl=2 b.gbr=1 | a.drl |  | "),
            ("a.drl=1 b.gbr=1", "a.drl=1", "a.drl=1 b.gbr=1 |  |  | "),
            ("a.drl=1 b.gbr=1", "b.gbr=2 a.drl=2", "a.drl=2 b.gbr=2 | a.drl b.gbr |  | "),
            ("a.drl=1 b.gbr=1", "c.drl=2", "another board"),
            ("a.drl=1", "a.drl=2 n.drl=2", "a.drl=2 n.drl=2 | a.drl | n.drl | "),
            // by the last part of the name, where that says which
            ("out/a.drl=1 out/b.gbr=1", "a.drl=2", "out/a.drl=2 out/b.gbr=1 | out/a.drl |  | "),
            ("a.drl=1", "new/a.drl=2", "a.drl=2 | a.drl |  | "),
            ("l/a.drl=1 r/a.drl=1", "a.drl=2", "another board"),
            ("l/a.drl=1 r/a.drl=1", "r/a.drl=2", "l/a.drl=1 r/a.drl=2 | r/a.drl |  | "),
            // a folder comes whole
            (
                "out/a.drl=1 out/b.gbr=1 n.txt=1",
                "out/a.drl=2 out/c.drl=2",
                "out/a.drl=2 n.txt=1 out/c.drl=2 | out/a.drl | out/c.drl | out/b.gbr",
            ),
            // two of one name: the first takes the place, the other is one more
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
    fn a_saved_project_is_a_board_of_its_own() {
        let project = saved::write(&saved::Project::default()).unwrap();
        let open = vec![("a.annulus".to_owned(), vec![1])];
        assert_eq!(exported_anew(&open, &[("a.annulus".to_owned(), project)]), None);
    }
}
