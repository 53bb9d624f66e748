//! The journal: started and completed legs, durable before the next drill cycle starts.
//!
//! ```text
//! leg k   travel ─ [earlier legs durable?] ─ cycle ─ up │ record {done: k+1, begun: k+1} ── fsync ── durable = k+1
//! leg k+1                                               │ travel … waits here ───────────────────────┴─▶ cycle
//! ```
//!
//! So at any moment at most one completed cycle is not yet durable: that one is drilled twice, and none is
//! left out.
//!
//! A damaged journal is moved aside, never overwritten. The new one remembers that until the user
//! acknowledges it.

use crate::quiet;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Steps, ToolWear};
use annulus_core::magazine::ToolStock;
use annulus_core::{code, error};
use annulus_host::Keeper;
use annulus_host::journal::{Contents, Damage, JobRecord, Progress, SEAL, WorkZero, sealed, unsealed};
use redb::{Database, DatabaseError, Durability, ReadableDatabase, TableDefinition};
use std::fs;
use std::path::{Path, PathBuf};

const TABLE: TableDefinition<'_, &str, &[u8]> = TableDefinition::new("journal");
/// Keys of tool wear start with the first and sort before the second.
const WEAR: &str = "wear/";
const WEAR_END: &str = "wear0";
const STOPS: TableDefinition<'_, u32, &[u8]> = TableDefinition::new("stops");

pub(crate) struct Journal {
    /// `None` while it cannot be opened again.
    database: Option<Database>,
    opens: Opener,
}

/// Opens the journal again.
type Opener = Box<dyn Fn() -> Result<Database, String> + Send>;

#[derive(Debug)]
pub(crate) enum Trouble {
    InUse,
    Damaged(String),
    Disk(String),
}

/// Opens the journal at `path` and returns its contents. A damaged one is moved aside. A missing one is
/// reported as damage if the drill was `used` before.
pub(crate) fn open(path: &Path, used: bool) -> Result<(Journal, Contents), Diagnostic> {
    if !path.exists() {
        if used {
            return begin_anew(path, Damage { file: None, job: None });
        }
        create(path)?;
    }
    match try_open(path) {
        Ok(found) => Ok(found),
        Err(Trouble::Damaged(_)) => {
            let aside = free_name(path);
            let damage = Damage { file: Some(aside.display().to_string()), job: salvaged(path) };
            fs::rename(path, &aside)
                .map_err(|error| cannot(code!("journal.cannot_open"), path, &error.to_string()))?;
            begin_anew(path, damage).inspect_err(|_| {
                // Without a new journal to remember it, the damage must be found again.
                let _ = fs::rename(&aside, path);
            })
        }
        Err(trouble) => Err(refusal(path, trouble)),
    }
}

/// Creates an empty journal atomically: a partial one would count as damaged.
fn create(path: &Path) -> Result<(), Diagnostic> {
    let beside = path.with_extension("new");
    let cannot =
        |error: &dyn std::fmt::Display| cannot(code!("journal.cannot_open"), path, &error.to_string());
    match fs::remove_file(&beside) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(cannot(&error)),
        _ => {}
    }
    let database = Some(Database::create(&beside).map_err(|error| cannot(&error))?);
    let journal = Journal { database, opens: Box::new(|| Err(String::new())) };
    journal.write(&[], None, false).map_err(|error| cannot(&error))?;
    drop(journal);
    fs::rename(&beside, path).map_err(|error| cannot(&error))
}

/// Creates a new journal at `path` that remembers the damage of the old one.
fn begin_anew(path: &Path, damage: Damage) -> Result<(Journal, Contents), Diagnostic> {
    create(path)?;
    let (journal, contents) = try_open(path).map_err(|trouble| refusal(path, trouble))?;
    journal.write(&[("damage", Some(sealed(&damage)))], None, false).map_err(full)?;
    Ok((journal, Contents { damage: Some(damage), ..contents }))
}

/// The name of the last job in a damaged journal, from the records with a valid digest.
fn salvaged(path: &Path) -> Option<String> {
    const BEGINS: &[u8] = br#"{"key":""#;
    let bytes = fs::read(path).ok()?;
    let places = bytes.windows(BEGINS.len()).enumerate().filter(|(_, window)| *window == BEGINS);
    let job = |at: usize| {
        let mut records = serde_json::Deserializer::from_slice(bytes.get(at..)?).into_iter::<JobRecord>();
        records.next()?.ok()?;
        let end = at + records.byte_offset();
        unsealed::<JobRecord>(bytes.get(at.checked_sub(SEAL)?..end)?).ok()
    };
    places.filter_map(|(at, _)| job(at)).next_back().map(|job| job.name)
}

/// Checks that the journal at `path` can be read; a missing one is fine. Changes nothing.
pub(crate) fn examine(path: &Path) -> Result<(), Diagnostic> {
    if !path.exists() {
        return Ok(());
    }
    match try_open(path) {
        Ok(_) => Ok(()),
        Err(Trouble::Damaged(why)) => Err(cannot(code!("doctor.journal_damaged"), path, &why)),
        Err(trouble) => Err(refusal(path, trouble)),
    }
}

/// Opens the journal at `path`, to read or change tool wear; `None` if there is none. Never moves it aside.
pub(crate) fn look_into(path: &Path) -> Result<Option<(Journal, Contents)>, Diagnostic> {
    if !path.exists() {
        return Ok(None);
    }
    try_open(path).map(Some).map_err(|trouble| refusal(path, trouble))
}

fn refusal(path: &Path, trouble: Trouble) -> Diagnostic {
    match trouble {
        Trouble::InUse => cannot(code!("journal.in_use"), path, ""),
        Trouble::Damaged(why) | Trouble::Disk(why) => cannot(code!("journal.cannot_open"), path, &why),
    }
}

fn cannot(code: &str, path: &Path, why: &str) -> Diagnostic {
    Diagnostic::error(code).with("file", path.display()).with("reason", why)
}

fn free_name(path: &Path) -> PathBuf {
    let candidates = (1..).map(|number| path.with_extension(format!("damaged-{number}")));
    candidates
        .into_iter()
        .find(|candidate| !candidate.exists())
        .unwrap_or_else(|| path.with_extension("damaged"))
}

/// Opens and reads. The library may panic on manipulated files; that counts as damage, without a message.
fn try_open(path: &Path) -> Result<(Journal, Contents), Trouble> {
    if fs::metadata(path).is_ok_and(|file| file.is_file() && file.len() == 0) {
        return Err(Trouble::Damaged("it is empty".to_owned()));
    }
    let opened = quiet::caught(|| {
        let again = path.to_owned();
        let opens = Box::new(move || open_database(&again).map_err(Trouble::why));
        let journal = Journal { database: Some(open_database(path)?), opens };
        let contents = journal.contents().map_err(Trouble::Damaged)?;
        Ok((journal, contents))
    });
    opened.unwrap_or_else(|| Err(Trouble::Damaged("its structure is broken".to_owned())))
}

fn open_database(path: &Path) -> Result<Database, Trouble> {
    let mut database = Database::create(path).map_err(|error| match error {
        DatabaseError::DatabaseAlreadyOpen => Trouble::InUse,
        DatabaseError::Storage(redb::StorageError::Io(error))
            if !matches!(
                error.kind(),
                std::io::ErrorKind::InvalidData | std::io::ErrorKind::UnexpectedEof
            ) =>
        {
            Trouble::Disk(error.to_string())
        }
        other => Trouble::Damaged(other.to_string()),
    })?;
    // Check every page's checksum: a key must not go missing because it was changed.
    match database.check_integrity() {
        Ok(true) => Ok(database),
        Ok(false) => Err(Trouble::Damaged("its checksums do not match".to_owned())),
        Err(error) => Err(Trouble::Damaged(error.to_string())),
    }
}

impl Trouble {
    fn why(self) -> String {
        match self {
            Self::InUse => "another program has it".to_owned(),
            Self::Damaged(why) | Self::Disk(why) => why,
        }
    }
}

impl Journal {
    /// A journal on the caller's backend, to test failing disks.
    #[cfg(test)]
    pub(crate) fn on<B: redb::StorageBackend>(
        backend: impl Fn() -> B + Send + 'static,
    ) -> Result<Self, String> {
        let opens =
            move || Database::builder().create_with_backend(backend()).map_err(|error| error.to_string());
        Ok(Self { database: Some(opens()?), opens: Box::new(opens) })
    }

    fn database(&self) -> Result<&Database, String> {
        self.database.as_ref().ok_or_else(|| "it is closed".to_owned())
    }

    fn contents(&self) -> Result<Contents, String> {
        let text = |error: &dyn std::fmt::Display| error.to_string();
        let read = self.database()?.begin_read().map_err(|error| text(&error))?;
        let table = match read.open_table(TABLE) {
            Ok(table) => table,
            Err(redb::TableError::TableDoesNotExist(_)) => return Ok(Contents::default()),
            Err(error) => return Err(text(&error)),
        };
        let get = |key| table.get(key).map_err(|error| text(&error));
        let damage = get("damage")?.map(|value| unsealed(value.value())).transpose()?;
        let zero = get("work_zero")?.map(|value| unsealed(value.value())).transpose()?;
        let job = get("job")?.map(|value| unsealed::<JobRecord>(value.value())).transpose()?;
        let progress = get("progress")?.map(|value| unsealed::<Progress>(value.value())).transpose()?;
        let worn = table.range(WEAR..WEAR_END).map_err(|error| text(&error))?;
        let wear = worn.map(|row| unsealed(row.map_err(|error| text(&error))?.1.value()));
        let wear = wear.collect::<Result<Vec<ToolWear>, String>>()?;
        let job = job.map(|job| progress.map(|progress| (job, progress)).ok_or("the progress is missing"));
        let stock = get("stock")?.map(|value| unsealed(value.value())).transpose()?;
        Ok(Contents { job: job.transpose()?, zero, wear, damage, stock })
    }

    fn write(
        &self,
        rows: &[(&str, Option<Vec<u8>>)],
        stop: Option<(u32, Steps)>,
        fresh: bool,
    ) -> Result<(), String> {
        let database = self.database()?;
        let written = || -> Result<(), redb::Error> {
            let mut transaction = database.begin_write()?;
            transaction.set_durability(Durability::Immediate)?;
            if fresh {
                transaction.delete_table(STOPS)?;
            }
            {
                let mut table = transaction.open_table(TABLE)?;
                for (key, value) in rows {
                    match value {
                        Some(value) => drop(table.insert(key, value.as_slice())?),
                        None => drop(table.remove(key)?),
                    }
                }
            }
            if let Some((leg, steps)) = stop {
                let bytes: Vec<u8> = steps.iter().flat_map(|step| step.to_le_bytes()).collect();
                transaction.open_table(STOPS)?.insert(leg, bytes.as_slice())?;
            }
            transaction.commit()?;
            Ok(())
        };
        written().map_err(|error| error.to_string())
    }

    pub(crate) fn program(&self) -> Option<Vec<u8>> {
        let read = self.database().ok()?.begin_read().ok()?;
        let value = read.open_table(TABLE).ok()?.get("program").ok()??;
        Some(value.value().to_vec())
    }
}

impl Keeper for Journal {
    fn begin(&mut self, job: &JobRecord, progress: Progress, program: &[u8]) -> Result<(), Diagnostic> {
        let rows = [
            ("job", Some(sealed(job))),
            ("progress", Some(sealed(&progress))),
            ("program", Some(program.to_vec())),
        ];
        self.write(&rows, None, progress.done == 0).map_err(full)
    }

    fn advance(
        &mut self,
        progress: Progress,
        stop: Option<(u32, Steps)>,
        wear: Option<&ToolWear>,
    ) -> Result<(), Diagnostic> {
        let key = wear.map(wear_key);
        let worn = key.as_deref().zip(wear).map(|(key, wear)| (key, Some(sealed(wear))));
        let rows: Vec<_> = worn.into_iter().chain([("progress", Some(sealed(&progress)))]).collect();
        self.write(&rows, stop, false).map_err(full)
    }

    fn keep_wear(&mut self, wear: &ToolWear) -> Result<(), Diagnostic> {
        self.write(&[(&wear_key(wear), Some(sealed(wear)))], None, false).map_err(full)
    }

    fn finish(&mut self) -> Result<(), Diagnostic> {
        self.write(&[("job", None), ("progress", None), ("program", None)], None, true).map_err(full)
    }

    fn keep_zero(&mut self, zero: Option<&WorkZero>) -> Result<(), Diagnostic> {
        self.write(&[("work_zero", zero.map(sealed))], None, false).map_err(full)
    }

    fn keep_stock(&mut self, stock: &ToolStock) -> Result<(), Diagnostic> {
        self.write(&[("stock", Some(sealed(stock)))], None, false).map_err(full)
    }

    fn forget_damage(&mut self) -> Result<(), Diagnostic> {
        self.write(&[("damage", None)], None, false).map_err(full)
    }

    /// Closes and reopens it: after a failed write, redb accepts no others.
    fn again(&mut self) -> Result<(), Diagnostic> {
        let closed = self.database.take();
        let opened = quiet::caught(|| {
            drop(closed);
            (self.opens)()
        });
        self.database =
            Some(opened.unwrap_or_else(|| Err("its structure is broken".to_owned())).map_err(full)?);
        Ok(())
    }
}

fn wear_key(wear: &ToolWear) -> String {
    format!("{WEAR}{}/{}", wear.machine, wear.number)
}

fn full(reason: String) -> Diagnostic {
    error!("journal.cannot_write", reason = reason)
}
