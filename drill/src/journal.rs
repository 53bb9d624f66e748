//! What of a job is durable: the records of a journal, and how each is sealed (N16).
//!
//! ```text
//! digest (16 bytes) │ JSON          a record that was damaged, or half written, is not believed
//! ```
//!
//! Comes in: values. Goes out: bytes, and values that are what was written. Does not know where they are kept.

use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Steps, ToolWear};
use annulus_core::magazine::ToolStock;
use annulus_core::wire::auth;
use serde::{Deserialize, Serialize};

/// What the steps of X and Y were counted by: a work zero means a place only as long as this is the same.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ruler {
    /// Scale of X and Y: millionths of a step, per this many nanometres.
    pub scale: [(i64, i64); 2],
    /// The first step of X and Y at which the home sensor is on.
    pub home_edge: [i64; 2],
}

/// A work zero, and what its steps were counted by.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WorkZero {
    /// Machine steps of X and Y.
    pub steps: [i64; 2],
    /// By this.
    pub ruler: Ruler,
}

/// A job that was started.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobRecord {
    /// SHA-256 of the program.
    pub key: String,
    /// Its name.
    pub name: String,
    /// Machine it runs on.
    pub fingerprint: String,
    /// Work zero, machine steps.
    pub zero: [i64; 2],
    /// What they were counted by; not known of a job that an older bridge began.
    #[serde(default)]
    pub ruler: Option<Ruler>,
    /// Digest of its stream.
    pub stream_digest: String,
    /// Holes in all.
    pub holes_total: u32,
    /// Toolpaths in all; none of a job that an older bridge began.
    #[serde(default)]
    pub toolpaths_total: u32,
    /// The height map that its depth follows, by its key; none where it follows none.
    #[serde(default)]
    pub levelled: Option<String>,
    /// How long the drilled-board record was when it began, bytes; not known of a job that an older bridge began.
    #[serde(default)]
    pub record_from: Option<u64>,
}

/// How far it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Progress {
    /// Legs done: the next one to run.
    pub done: u32,
    /// The leg begun last.
    pub begun: u32,
    /// Holes drilled.
    pub holes: u32,
    /// Toolpaths milled.
    #[serde(default)]
    pub toolpaths: u32,
}

/// What a journal holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contents {
    /// The job that did not come to its end.
    pub job: Option<(JobRecord, Progress)>,
    /// Work zero in force.
    pub zero: Option<WorkZero>,
    /// What tools have done since they were new.
    pub wear: Vec<ToolWear>,
    /// A journal before this one was damaged, and nobody has read that yet.
    pub damage: Option<Damage>,
    /// What lies in the magazine.
    pub stock: Option<ToolStock>,
}

/// A journal that was damaged, or is gone.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Damage {
    /// Where it was moved to; one that is gone was not.
    pub file: Option<String>,
    /// The last job that could still be read in it.
    pub job: Option<String>,
}

impl Damage {
    /// The alarm that tells of it; the virtual drill's record has `holes` lines.
    pub fn told(&self, holes: usize) -> Diagnostic {
        let Some(file) = &self.file else { return Diagnostic::error(GONE).with("holes", holes) };
        let told = Diagnostic::error(DAMAGED).with("file", file);
        told.with("job", self.job.as_deref().unwrap_or("?")).with("holes", holes)
    }

    /// Whether `alarm` is one that tells of it.
    pub(crate) fn is_told_by(alarm: &Diagnostic) -> bool {
        [GONE, DAMAGED].contains(&alarm.code.as_str())
    }
}

const DAMAGED: &str = "journal.damaged";
const GONE: &str = "journal.gone";

/// What is to be written, in its order.
pub enum Record {
    /// A job begins; the owner hears when it is durable.
    Begin {
        /// What the job is.
        job: Box<JobRecord>,
        /// Where it stands.
        progress: Progress,
        /// The bytes of its program.
        program: Vec<u8>,
    },
    /// A leg is done, the next begun. With the place where a sensor ended the stroke of a leg, and what its tool has done now: in one
    /// go, so that no hit is lost and none counted twice.
    Advance {
        /// Where the job stands.
        progress: Progress,
        /// What the tool has done, where the leg wore one.
        wear: Option<ToolWear>,
        /// The leg whose stroke a sensor ended, and where.
        stop: Option<(u32, Steps)>,
    },
    /// The job is over or forgotten.
    Finish,
    /// What a tool has done now: nothing, where a new one was put in.
    Wear(ToolWear),
    /// The work zero in force.
    Zero(Option<WorkZero>),
    /// What lies in the magazine; the owner hears when it is durable.
    Stock {
        /// What.
        stock: Box<ToolStock>,
        /// Number of the record.
        number: u32,
    },
    /// It was read that the journal before this one was damaged.
    DamageRead,
}

/// Length of the digest in front of a value.
pub const SEAL: usize = 16;

/// A value with the start of its digest in front, so that no damaged one is believed.
pub fn sealed(value: &impl Serialize) -> Vec<u8> {
    let body = serde_json::to_vec(value).unwrap_or_default();
    let mut bytes = auth::sha256(&body).into_bytes();
    bytes.truncate(SEAL);
    bytes.extend(body);
    bytes
}

/// The value in `bytes`, or why they are not believed.
pub fn unsealed<T: for<'a> Deserialize<'a>>(bytes: &[u8]) -> Result<T, String> {
    let (seal, body) = bytes.split_at_checked(SEAL).ok_or("a record is too short")?;
    if !auth::sha256(body).as_bytes().starts_with(seal) {
        return Err("a record does not match its digest".to_owned());
    }
    serde_json::from_slice(body).map_err(|error| error.to_string())
}
