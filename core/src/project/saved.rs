//! The saved project: a zip with the original files of a board, the user's choices about them, and the job.
//!
//! ```text
//!  board.annulus ─┬─ annulus.json     version, and choices about the files ([`SaidOfFiles`])
//!                 ├─ job.toml         job file, if there is a job
//!                 └─ files/…          original files, unchanged
//! ```
//!
//! Equal projects give equal bytes.

use crate::artwork::{self, Artwork, Digits, Overrides, PROJECT_HEAD, Role, Side, Units, Zeros};
use crate::diagnostic::Diagnostic;
use crate::{code, error};
use serde::{Deserialize, Serialize};

const SCHEMA: u32 = 1;
/// Zip member with the job; also its name in diagnostics.
pub const JOB: &str = "job.toml";
pub const ENDING: &str = "annulus";
const FILES: &str = "files/";

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Project {
    /// Names and original bytes, in order.
    pub files: Vec<(String, Vec<u8>)>,
    /// The user's choices about the files.
    pub said: SaidOfFiles,
    /// Text of the job file, if there is a job.
    pub job: Option<String>,
}

/// The user's choices about files, beyond their contents. Files have their names as read; members of a zip
/// are named like `board.zip!/drill.drl`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SaidOfFiles {
    pub board: Option<String>,
    pub numbers: NumberReading,
    /// Files with the holes of the board; none if the reader decides.
    pub used: Option<Vec<String>>,
    /// Roles of layers: file name, role, side.
    pub roles: Vec<(String, String, Option<String>)>,
    /// Shift layers with a different origin until they fit the copper.
    pub aligned: bool,
}

/// Number format of drill files, as far as the user set it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NumberReading {
    /// `mm` or `inch`.
    pub units: Option<String>,
    /// Digits before and after the decimal point.
    pub digits: Option<(u8, u8)>,
    /// Suppressed zeros: `leading`, `trailing` or `none`.
    pub zeros: Option<String>,
}

/// Contents of `annulus.json`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    annulus_project: u32,
    said: SaidOfFiles,
}

impl NumberReading {
    pub fn of(told: &Overrides) -> Self {
        Self {
            units: told.units.map(|units| units.name().to_owned()),
            digits: told.digits.map(|digits| (digits.integer, digits.decimal)),
            zeros: told.zeros.map(|zeros| zeros.name().to_owned()),
        }
    }

    /// The settings as the reader takes them.
    pub fn overrides(&self) -> Overrides {
        Overrides {
            units: self.units.as_deref().and_then(Units::named),
            digits: self.digits.map(|(integer, decimal)| Digits { integer, decimal }),
            zeros: self.zeros.as_deref().and_then(Zeros::named),
        }
    }
}

impl SaidOfFiles {
    /// Removes the files of other boards, if the selected board exists.
    pub fn choose_board(&self, artwork: &mut Artwork) {
        let Some(board) = &self.board else { return };
        if !artwork.files.iter().any(|file| file.board == *board) {
            return;
        }
        let rows = artwork.files.iter().enumerate();
        let others = rows.filter(|(_, file)| !file.board.is_empty() && file.board != *board);
        let others: Vec<usize> = others.map(|(index, _)| index).collect();
        artwork.leave_out(&others);
    }

    /// Applies the user's roles and sides of layers.
    pub fn say_roles(&self, artwork: &mut Artwork) {
        for (name, role, side) in &self.roles {
            if let Some(role) = Role::named(role) {
                artwork.say_role(name, role, side.as_deref().and_then(Side::named));
            }
        }
    }

    /// Indices of the files to use, if the user chose any.
    pub fn used_of(&self, artwork: &Artwork) -> Option<Vec<usize>> {
        let names = self.used.as_ref()?;
        let rows = (0..).zip(&artwork.files).filter(|(_, file)| names.contains(&file.name));
        Some(rows.map(|(row, _)| row).collect())
    }
}

/// True if `bytes` start like a project.
pub fn looks_like_one(bytes: &[u8]) -> bool {
    artwork::lists(bytes, PROJECT_HEAD)
}

/// True if `name` has the extension of a project.
pub fn is_called_one(name: &str) -> bool {
    let ending = name.rsplit_once('.').map(|(_, ending)| ending);
    ending.is_some_and(|ending| ending.eq_ignore_ascii_case(ENDING))
}

/// Reads a project; `file` is the file name for diagnostics.
pub fn read(file: &str, bytes: &[u8]) -> Result<Project, Diagnostic> {
    let of_file = |why: Diagnostic| if why.place.is_some() { why } else { why.at(file, 0, 0) };
    let refuse = |code: &str| Diagnostic::error(code).at(file, 0, 0);
    let members = artwork::members(bytes).map_err(of_file)?;
    let (mut head, mut project) = (None, Project::default());
    for (name, bytes) in members {
        if name == PROJECT_HEAD {
            head = Some(bytes);
        } else if name == JOB {
            project.job = Some(String::from_utf8_lossy(&bytes).into_owned());
        } else if let Some(name) = name.strip_prefix(FILES) {
            project.files.push((name.to_owned(), bytes));
        }
    }
    // Read only the version first, because the head of another version may not parse.
    let version = |bytes: &[u8]| {
        let value: serde_json::Value = serde_json::from_slice(bytes).ok()?;
        value.get("annulus_project")?.as_u64()
    };
    let head = head.ok_or_else(|| refuse(code!("saved.damaged")))?;
    if let Some(found) = version(&head).filter(|found| *found != u64::from(SCHEMA)) {
        return Err(refuse(code!("saved.schema")).with("found", found).with("known", SCHEMA));
    }
    let head: Head =
        serde_json::from_slice(&head).map_err(|why| refuse(code!("saved.head")).with("what", why))?;
    Ok(Project { said: head.said, ..project })
}

/// Writes a project. Fails if the result could not be read again.
pub fn write(project: &Project) -> Result<Vec<u8>, Diagnostic> {
    let mut said = project.said.clone();
    // The choices refer to files by name, so rename them like the files.
    said.roles.iter_mut().for_each(|row| row.0 = fitting(&row.0));
    said.used.iter_mut().flatten().for_each(|name| *name = fitting(name));
    let head = serde_json::to_vec_pretty(&Head { annulus_project: SCHEMA, said });
    let head = head.map_err(|why| error!("saved.head", what = why))?;
    let mut members = vec![(PROJECT_HEAD.to_owned(), head)];
    members.extend(project.job.iter().map(|job| (JOB.to_owned(), job.clone().into_bytes())));
    let files =
        project.files.iter().map(|(name, bytes)| (format!("{FILES}{}", fitting(name)), bytes.clone()));
    members.extend(files);
    artwork::packed(&members)
}

/// Converts a file name to a safe name in a zip: without `..`, absolute paths or control characters.
fn fitting(name: &str) -> String {
    let plain = name.replace(|letter: char| letter == '\\' || letter.is_control(), "_");
    let parts: Vec<&str> = plain.split('/').filter(|part| !matches!(*part, "" | "." | "..")).collect();
    if parts.is_empty() { "_".to_owned() } else { parts.join("/") }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRILL: &[u8] = b"M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\nM30\n";
    const COPPER: &[u8] = b"%FSLAX33Y33*%%MOMM*%%ADD10C,1*%D10*X1000Y1000D03*M02*";

    fn project() -> Project {
        let said = SaidOfFiles {
            board: Some("a".into()),
            numbers: NumberReading { units: Some("inch".into()), digits: Some((2, 4)), zeros: None },
            used: Some(vec!["b/a.drl".into()]),
            roles: vec![("b/a.gbr".into(), "copper".into(), Some("bottom".into()))],
            aligned: true,
        };
        let files = [("b/a.drl", DRILL), ("b/a.gbr", COPPER), ("b/more.drl", DRILL)];
        let files = files.map(|(name, bytes)| (name.to_owned(), bytes.to_vec())).to_vec();
        Project { files, said, job: Some("schema = 1\n".into()) }
    }

    #[test]
    fn saved_project_reads_back_unchanged() {
        let bytes = write(&project()).unwrap();
        assert!(looks_like_one(&bytes));
        assert_eq!(read("p", &bytes).unwrap(), project());
        assert_eq!(write(&project()).unwrap(), bytes);
        for none in [&b""[..], DRILL, b"PK\x05\x06"] {
            assert!(!looks_like_one(none));
        }
    }

    #[test]
    fn explicit_choices_override_the_files() {
        let project = project();
        let told = project.said.numbers.overrides();
        assert_eq!(told.units, Some(Units::Inch));
        assert_eq!(NumberReading::of(&told), project.said.numbers);
        let mut artwork = artwork::read_set(&project.files, &Overrides::default());
        project.said.say_roles(&mut artwork);
        assert_eq!((artwork.files[1].role, artwork.files[1].side), (Role::Copper, Some(Side::Bottom)));
        assert_eq!(project.said.used_of(&artwork), Some(vec![0]));
        assert_eq!(SaidOfFiles::default().used_of(&artwork), None);
    }

    #[test]
    fn file_names_stay_inside_the_project() {
        let mut project = project();
        for (name, kept) in [
            ("/boards/x.drl", "boards/x.drl"),
            ("../../x.drl", "x.drl"),
            ("a\\b\n.drl", "a_b_.drl"),
            ("../", "_"),
        ] {
            project.files[0].0 = name.to_owned();
            project.said.used = Some(vec![name.to_owned()]);
            let again = read("p", &write(&project).unwrap()).unwrap();
            assert_eq!((again.files[0].0.as_str(), again.said.used), (kept, Some(vec![kept.to_owned()])));
        }
    }

    #[test]
    fn damaged_projects_are_errors() {
        let packed = |head: &[u8]| artwork::packed(&[(PROJECT_HEAD.to_owned(), head.to_vec())]).unwrap();
        let rows: [(&[u8], &str); 4] = [
            (b"{\"annulus_project\":2,\"more\":1}", "saved.schema"),
            (b"{\"annulus_project\":1}", "saved.head"),
            (b"{\"annulus_project\":1,\"said\":{\"colour\":1}}", "saved.head"),
            (b"no", "saved.head"),
        ];
        for (head, code) in rows {
            let why = read("p.annulus", &packed(head)).unwrap_err();
            assert_eq!(why.code, code);
            assert!(!why.message("en").contains(".message"), "{code} has no sentence");
        }
        let whole = write(&project()).unwrap();
        for end in (0..whole.len()).step_by(11) {
            assert!(read("cut", &whole[..end]).is_err());
        }
    }
}
