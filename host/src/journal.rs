//! The records of the journal, and how each is sealed.
//!
//! ```text
//! digest (16 bytes) │ JSON          a damaged or half-written record is ignored
//! ```

use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Steps, ToolWear};
use annulus_core::magazine::ToolStock;
use annulus_core::wire::auth;
use serde::{Deserialize, Serialize};

/// The meaning of one step of X and Y: a work zero in steps is valid only while this is unchanged.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ruler {
    /// Scale of X and Y: millionths of a step, per this many nanometres.
    pub scale: [(i64, i64); 2],
    /// The first step of X and Y at which the home sensor is on.
    pub home_edge: [i64; 2],
}

/// A work zero, and the meaning of its steps.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorkZero {
    pub steps: [i64; 2],
    pub ruler: Ruler,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobRecord {
    /// SHA-256 of the program.
    pub key: String,
    pub name: String,
    /// Fingerprint of its machine.
    pub fingerprint: String,
    /// Work zero, machine steps.
    pub zero: [i64; 2],
    /// The meaning of those steps; missing in records of older bridges.
    #[serde(default)]
    pub ruler: Option<Ruler>,
    pub stream_digest: String,
    pub holes_total: u32,
    /// Number of toolpaths; 0 in records of older bridges.
    #[serde(default)]
    pub toolpaths_total: u32,
    /// Key of the height map that its depths follow, if any.
    #[serde(default)]
    pub levelled: Option<String>,
    /// Length of the drilled-board record at the start of the job, bytes; missing in records of older
    /// bridges.
    #[serde(default)]
    pub record_from: Option<u64>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Progress {
    /// Completed legs, which is also the index of the next leg.
    pub done: u32,
    /// The last leg that was started.
    pub begun: u32,
    pub holes: u32,
    #[serde(default)]
    pub toolpaths: u32,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contents {
    /// The interrupted job.
    pub job: Option<(JobRecord, Progress)>,
    pub zero: Option<WorkZero>,
    pub wear: Vec<ToolWear>,
    /// The previous journal was damaged, and the user has not acknowledged that.
    pub damage: Option<Damage>,
    pub stock: Option<ToolStock>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Damage {
    /// Where the damaged file was moved to; `None` if it is missing.
    pub file: Option<String>,
    pub job: Option<String>,
}

impl Damage {
    /// The alarm that reports it; `holes` is the number of lines in the drilled-board record.
    pub fn told(&self, holes: usize) -> Diagnostic {
        let Some(file) = &self.file else { return Diagnostic::error(GONE).with("holes", holes) };
        let told = Diagnostic::error(DAMAGED).with("file", file);
        told.with("job", self.job.as_deref().unwrap_or("?")).with("holes", holes)
    }

    pub(crate) fn is_told_by(alarm: &Diagnostic) -> bool {
        [GONE, DAMAGED].contains(&alarm.code.as_str())
    }
}

const DAMAGED: &str = code!("journal.damaged");
const GONE: &str = code!("journal.gone");

/// A change to write; changes are written in order.
pub enum Record {
    /// A job starts; the owner is notified when this is durable.
    Begin {
        job: Box<JobRecord>,
        progress: Progress,
        /// The program's bytes.
        program: Vec<u8>,
    },
    /// A leg is completed and the next one started. Wear and stop position are in the same record, so that
    /// no hole is lost or counted twice.
    Advance {
        progress: Progress,
        wear: Option<ToolWear>,
        /// The leg whose drill cycle ended on a sensor, and the position.
        stop: Option<(u32, Steps)>,
    },
    Finish,
    /// A tool's new wear; zero for a new tool.
    Wear(ToolWear),
    Zero(Option<WorkZero>),
    /// Contents of the magazine; the owner is notified when this is durable.
    Stock {
        stock: Box<ToolStock>,
        number: u32,
    },
    /// The user acknowledged the damage of the previous journal.
    DamageRead,
}

/// Length of the digest before a value, bytes.
pub const SEAL: usize = 16;

/// Serializes a value after the first bytes of its digest, which reveal damage.
pub fn sealed(value: &impl Serialize) -> Vec<u8> {
    let body = serde_json::to_vec(value).unwrap_or_default();
    let mut bytes = auth::sha256(&body).into_bytes();
    bytes.truncate(SEAL);
    bytes.extend(body);
    bytes
}

/// Reads a sealed value, or returns why it is invalid.
pub fn unsealed<T: for<'a> Deserialize<'a>>(bytes: &[u8]) -> Result<T, String> {
    let (seal, body) = bytes.split_at_checked(SEAL).ok_or("a record is too short")?;
    if !auth::sha256(body).as_bytes().starts_with(seal) {
        return Err("a record does not match its digest".to_owned());
    }
    serde_json::from_slice(body).map_err(|error| error.to_string())
}
