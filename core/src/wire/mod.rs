//! What page and bridge say to each other: JSON text frames on one socket, and programs as bytes over HTTP.
//!
//! ```text
//! page                                    bridge
//!  (annulus link)  POST /api/link Link  ──▶  a fresh one-time address
//!  POST /api/pair Pair           ──▶        one-time token → Paired: session id and key
//!  GET  /api/socket              ──▶
//!                                ◀──        Tell::Challenge {nonce}
//!  Ask::Hello {session, proof}   ──▶        proof = auth::hello(key, nonce), within 2 s
//!                                ◀──        Tell::Welcome, Tell::Machine, Tell::Status …
//!  PUT  /api/jobs/SHA256 bytes   ──▶        headers SESSION_HEADER, PROOF_HEADER = auth::request(key, method, path)
//!  GET  /api/jobs/SHA256         ──▶        the same bytes back, for a page that opened later
//!                                ◀──        every refusal: {ok: false, error: {code, message, advice}}
//! ```
//!
//! Comes in and goes out: messages. Does not know how they travel. With `project`, the only floor whose types are
//! promised to stay readable: append only, never renumber.

pub mod auth;
mod check;
mod frames;
mod lab;
mod level;
mod magazine;
pub mod program;
mod status;

pub use check::CheckModeReport;
pub use frames::understand;
pub use lab::{Outputs, QueuePhase, QueueStatus};
pub use level::HeightMapReport;
pub use magazine::MagazineReport;
pub use status::{DrilledReport, MissingReport, OtherFirmware, SlipReport, Status, ToolsReport};

use crate::control::{Ending, Timing};
use crate::controller::{ResetOnOpen, ToolLengths};
use crate::diagnostic::Diagnostic;
use crate::level::ProbeGrid;
use crate::machine::Value;
use crate::magazine::{Held, Seen, StockedTool};
use crate::queue::Mode;
use serde::{Deserialize, Serialize};

/// Version of these messages. Both sides state theirs and the oldest they still understand.
pub const PROTOCOL: u16 = 1;

/// Largest text frame either side sends or accepts, in bytes.
pub const FRAME_LIMIT: usize = 64 * 1024;

/// Largest program, in bytes.
pub const PROGRAM_LIMIT: usize = 32 * 1024 * 1024;

/// What one [`Ask::Jog`] or [`Ask::JogOn`] grants of motion at most, in ms.
pub const JOG_GRANT_MS: u64 = 150;

/// Oldest version of these messages that this build still understands.
pub const OLDEST_PROTOCOL: u16 = 1;

/// Header of a request: the session id.
pub const SESSION_HEADER: &str = "x-annulus-session";

/// Header of a request: [`auth::request`] for it.
pub const PROOF_HEADER: &str = "x-annulus-proof";

/// Body of `POST /api/pair`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairBody {
    /// The one-time token: what follows `#t=` in the address.
    pub token: String,
}

/// Answer to `POST /api/pair`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Paired {
    /// Always true.
    pub ok: bool,
    /// Session id, to be said.
    pub session: String,
    /// Session key in hexadecimal, never to be said again.
    pub key: String,
}

/// Body of `POST /api/link`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkBody {
    /// What the page that uses the address may do.
    pub scope: Scope,
}

/// What a session may do; each includes those before it. Whoever asks for an address chooses (`annulus link --scope`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scope {
    /// Watch, and stop.
    View,
    /// Take control, move by hand, home, set the zero.
    Jog,
    /// Bring and run jobs.
    Run,
    /// Change the machine's settings.
    #[default]
    Configure,
}

/// What a page asks of the bridge. Stop is taken from any page that said hello; the rest needs control, except
/// `Hello`, `TakeControl` and `Ping`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "t", rename_all = "snake_case")]
pub enum Ask {
    /// First frame: who is speaking.
    Hello {
        /// Its protocol version.
        proto: u16,
        /// Oldest version it understands.
        min: u16,
        /// Its build.
        app: String,
        /// Session id from pairing.
        session: String,
        /// HMAC-SHA256 of the challenge under the session key, hexadecimal.
        proof: String,
    },
    /// Still here. Control lapses 3 s after the last frame.
    Ping {
        /// Echoed, so that the page can measure the way.
        stamp: f64,
    },
    /// Become the controller, if nobody is or the other one agreed by going silent.
    TakeControl {
        /// Take it even though another page has it.
        force: bool,
    },
    /// Give control back.
    ReleaseControl,
    /// Home: Z up, then to the end sensors.
    Home,
    /// Base: the place the head is at becomes work zero. Nothing moves.
    SetZero,
    /// Work zero as it was before the last `SetZero`.
    UndoZero,
    /// Move one axis a little; Z only upwards of the safe height when XY moves. It goes for [`JOG_GRANT_MS`] at most, then
    /// comes to rest on its way: whoever wants the rest of it says [`Ask::JogOn`] in time, again and again.
    Jog {
        /// 0 X, 1 Y, 2 Z.
        axis: u8,
        /// How far, in µm, signed.
        distance_um: i32,
    },
    /// The page is still there and still wants the move by hand: [`JOG_GRANT_MS`] more from now on. Without one, nothing.
    JogOn,
    /// Check this uploaded job and make it ready to start.
    Arm {
        /// SHA-256 of the program's bytes.
        job: String,
        /// First leg to run, as it will be said to [`Ask::Start`]: the pre-flight is about the rest of the job from there.
        #[serde(default)]
        from_leg: u32,
    },
    /// Start the armed job, or go on with an interrupted one.
    Start {
        /// The same.
        job: String,
        /// SHA-256 of the step stream as the page computed it.
        stream_digest: String,
        /// First leg to run; 0, or what [`Tell::Interrupted`] offered.
        from_leg: u32,
    },
    /// Finish the stroke, then hold.
    Pause,
    /// Go on after a pause.
    Resume,
    /// Finish this hole, then end.
    StopAfterHole,
    /// Go at this many percent of the planned feed, 10 … 200. The path stays the same. Up to 100 from now on, by slower
    /// time; above, with higher feeds from the next rest of the job in work on, planned and checked anew.
    FeedOverride {
        /// Percent.
        percent: u8,
    },
    /// The spindle at this many percent of the programmed speed, 10 … 200. Controllers of the GRBL family alone.
    SpindleOverride {
        /// Percent.
        percent: u8,
    },
    /// Moves without cutting at this many percent of the fastest: 25, 50 or 100. Controllers of the GRBL family alone.
    RapidOverride {
        /// Percent.
        percent: u8,
    },
    /// Have a controller of the GRBL family read this uploaded job in its check mode, line by line and without a move. What comes of it is
    /// told by [`Tell::Checked`].
    Check {
        /// SHA-256 of the program's bytes.
        job: String,
    },
    /// Stop now.
    Stop,
    /// The bit that was asked for is in.
    ToolChanged,
    /// A new tool is in the rack, or in the spindle, under this number: what the one before did is not its.
    NewTool {
        /// Number in the rack.
        number: u32,
    },
    /// What lies in the places of the magazine and in the spindle, as a person says. Refused while anything moves, and where there is no
    /// magazine.
    Stock {
        /// The tool in each place, from the first on.
        places: Vec<Option<StockedTool>>,
        /// What the spindle holds.
        spindle: Held,
    },
    /// What a person sees where a change of tools stopped. The clamp closes where the tool is in the spindle.
    ToolSeen {
        /// Where the tool is.
        seen: Seen,
    },
    /// The clamp of the spindle opens where a change of tools stopped, or where a tool that is worn waits for a new one: what it
    /// holds falls out, so a person has it in the hand. Refused while anything moves or turns.
    OpenClamp,
    /// The alarm was read.
    AcknowledgeAlarm,
    /// Forget an interrupted job.
    ForgetInterrupted,
    /// Check this queue of work commands against the machine as it stands, and keep it ready.
    Queue {
        /// Its text ([`crate::queue::read`]).
        text: String,
    },
    /// Begin the queue or go on with it.
    QueueRun {
        /// How far.
        mode: Mode,
    },
    /// Forget the queue.
    QueueClear,
    /// Unlock the outputs for so long, or for so long from now on; 0 locks them. They lock by themselves when the time is
    /// over, when control changes hands, and when anything moves.
    OutputLease {
        /// At most 5.
        minutes: u8,
    },
    /// Switch an unlocked output while nothing moves.
    Output {
        /// Its name in [`Outputs::names`].
        name: String,
        /// On or off.
        on: bool,
        /// Only for so long; then it goes back.
        pulse_ms: Option<u32>,
    },
    /// Change machine settings. Refused while anything moves.
    Configure {
        /// Keys and new values.
        changes: Vec<(String, Value)>,
    },
    /// The virtual drill has these faults from now on, and no others ([`crate::virtual_drill::faults`]); it has to be homed anew.
    /// Refused while anything moves, and by every other machine.
    Provoke {
        /// Each `NAME` or `NAME@HOLES`.
        faults: Vec<String>,
    },
    /// The tip touches the board here: this height becomes zero of Z.
    SetHeight,
    /// The same where the contact finds the board, or a plate on it, at most so far below.
    Probe {
        /// How far down at most, µm.
        depth_um: u32,
        /// Thickness of the plate that the tip meets, µm; 0 for the bare copper.
        plate_um: u32,
    },
    /// The tip stands beside the board, below its surface, and goes along an axis to where the contact finds its edge: that becomes
    /// work zero of the axis.
    Edge {
        /// 0 X, 1 Y.
        axis: u8,
        /// Upwards in its numbers.
        up: bool,
        /// How far at most, µm.
        reach_um: u32,
        /// Diameter of the tool, µm: half of it is between its axis and the edge.
        tool_um: u32,
    },
    /// Touch the board at every place of this grid, for its height map.
    Survey {
        /// Where, work coordinates.
        grid: ProbeGrid,
        /// For which job ([`crate::level::key_of`]).
        job: String,
        /// How far over the highest place touched the tip goes from place to place, µm.
        clear_um: u32,
        /// How far one place may lie below the one before, µm.
        depth_um: u32,
        /// What time it is, seconds since 1970.
        now_s: u64,
    },
    /// Forget the height map.
    ForgetHeightMap,
    /// Unlock without homing: the position stays unknown, and moves by hand are allowed. Controllers alone.
    Unlock,
    /// Park: Z all the way up, spindle off, X and Y to where the settings say. It goes to its end by itself, or to where it is stopped.
    Park,
}

impl Ask {
    /// What a session must be allowed for this.
    pub fn scope(&self) -> Scope {
        match self {
            Self::Hello { .. } | Self::Ping { .. } | Self::Stop => Scope::View,
            Self::TakeControl { .. }
            | Self::ReleaseControl
            | Self::Home
            | Self::Park
            | Self::SetZero
            | Self::UndoZero
            | Self::Jog { .. }
            | Self::JogOn
            | Self::OutputLease { .. }
            | Self::Output { .. }
            | Self::SetHeight
            | Self::Probe { .. }
            | Self::Edge { .. }
            | Self::Survey { .. }
            | Self::ForgetHeightMap
            | Self::Unlock
            | Self::Stock { .. }
            | Self::ToolSeen { .. }
            | Self::OpenClamp
            | Self::AcknowledgeAlarm => Scope::Jog,
            Self::Arm { .. }
            | Self::Start { .. }
            | Self::Pause
            | Self::Resume
            | Self::StopAfterHole
            | Self::FeedOverride { .. }
            | Self::SpindleOverride { .. }
            | Self::RapidOverride { .. }
            | Self::Check { .. }
            | Self::ToolChanged
            | Self::NewTool { .. }
            | Self::Queue { .. }
            | Self::QueueRun { .. }
            | Self::QueueClear
            | Self::ForgetInterrupted => Scope::Run,
            Self::Configure { .. } | Self::Provoke { .. } => Scope::Configure,
        }
    }

    /// Whether only the page in control may ask this. Stop is everybody's.
    pub fn needs_control(&self) -> bool {
        !matches!(
            self,
            Self::Hello { .. }
                | Self::Ping { .. }
                | Self::TakeControl { .. }
                | Self::ReleaseControl
                | Self::Stop
        )
    }
}

/// What the bridge tells a page.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "t", rename_all = "snake_case")]
pub enum Tell {
    /// First frame: prove who you are.
    Challenge {
        /// Bridge's protocol version.
        proto: u16,
        /// Oldest version it understands.
        min: u16,
        /// Its build.
        bridge: String,
        /// To be signed, hexadecimal.
        nonce: String,
    },
    /// Hello accepted.
    Welcome {
        /// Number of this page among the viewers.
        viewer: u32,
    },
    /// The machine's settings, all of them; again after every change.
    Machine {
        /// Keys and values.
        settings: Vec<(String, Value)>,
        /// [`crate::machine::Machine::fingerprint`].
        fingerprint: String,
        /// The faults that were provoked; none on a machine that has none on demand.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        faults: Option<Vec<String>>,
    },
    /// How things stand, 10 times a second and after every change.
    Status(Box<Status>),
    /// Who has control now.
    Control {
        /// This page has it.
        yours: bool,
        /// Somebody has it.
        taken: bool,
        /// Pages connected.
        viewers: u32,
    },
    /// The verdict on a job: ready to start, or why not.
    Armed {
        /// SHA-256 of the program's bytes.
        job: String,
        /// SHA-256 of its step stream as the bridge computed it.
        stream_digest: String,
        /// Its depth follows the height map that there is; so do the steps of which that is the digest.
        #[serde(default)]
        levelled: bool,
        /// Pre-flight, row by row.
        checks: Vec<PreflightRow>,
    },
    /// A job ended.
    Ended {
        /// Which.
        job: String,
        /// Why.
        ending: Ending,
        /// Holes drilled.
        holes_done: u32,
        /// Toolpaths milled.
        #[serde(default)]
        toolpaths_done: u32,
    },
    /// What became of the tools of the rack, when a page comes and after every change.
    Tools(ToolsReport),
    /// A job was interrupted and can be taken up.
    Interrupted {
        /// Which.
        job: String,
        /// Its name.
        name: String,
        /// Leg to go on with.
        next_leg: u32,
        /// Holes done for certain.
        holes_done: u32,
        /// Holes in all.
        holes_total: u32,
        /// Toolpaths done for certain.
        #[serde(default)]
        toolpaths_done: u32,
        /// Toolpaths in all.
        #[serde(default)]
        toolpaths_total: u32,
    },
    /// What the bridge found out about its clock; only where time is real.
    Timing(Box<Timing>),
    /// The text of the queue that is ready, when a page comes and after every change.
    QueueText {
        /// As it was sent; empty where there is none.
        text: String,
    },
    /// How the queue stands.
    Queue(Box<QueueStatus>),
    /// The outputs and their lock.
    Outputs(Outputs),
    /// A controller of the GRBL family is the machine: who it is, with its numbered settings. Such a one plans its own motion: in
    /// [`Tell::Armed`] it has no digest.
    Controller {
        /// `GRBL`, `grblHAL` or `FluidNC`.
        flavour: String,
        /// Its version.
        version: String,
        /// Settings by their numbers, as `$$` lists them.
        values: Vec<(u16, f64)>,
        /// The mill that a person said it is ([`crate::machine::mill`]).
        #[serde(default)]
        mill: Option<String>,
        /// How the length of a tool is found.
        #[serde(default)]
        lengths: ToolLengths,
        /// What opening its port may do to the board.
        #[serde(default)]
        reset_on_open: ResetOnOpen,
        /// The lines by which it changes tools itself; none where a person does.
        #[serde(default)]
        changer: Vec<String>,
    },
    /// A stroke of the job in work ended on a sensor.
    Touched {
        /// Its leg.
        leg: u32,
        /// Height of the tip over the work zero, µm.
        height_um: f64,
    },
    /// What is known of the surface of the board; when a page comes and after every change.
    HeightMap(Box<HeightMapReport>),
    /// What lies in the magazine and how a change of tools stands; when a page comes and after every step. Machines with a magazine alone.
    Magazine(Box<MagazineReport>),
    /// How far a controller has read a job in its check mode, and what it refuses of it; while it reads, and when that is over.
    Checked(Box<CheckModeReport>),
    /// An ask was refused; nothing changed.
    Refused {
        /// Why and what to do.
        why: Diagnostic,
    },
    /// Answer to `Ping`.
    Pong {
        /// The page's stamp.
        stamp: f64,
    },
}

/// One line of the pre-flight.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PreflightRow {
    /// What was looked at and what was found; the code names the row.
    pub finding: Diagnostic,
    /// Whether it lets the job start.
    pub verdict: RowVerdict,
}

/// What a pre-flight row means for Start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RowVerdict {
    /// Good.
    Pass,
    /// A person must tick it.
    Warn,
    /// No start.
    Fail,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stop_is_everybodys_and_what_moves_is_not() {
        let jog = Ask::Jog { axis: 0, distance_um: 1 };
        let start = Ask::Start { job: String::new(), stream_digest: String::new(), from_leg: 0 };
        let rows = [
            (Ask::Stop, Scope::View, false),
            (Ask::Ping { stamp: 0.0 }, Scope::View, false),
            (Ask::TakeControl { force: true }, Scope::Jog, false),
            (Ask::Home, Scope::Jog, true),
            (Ask::Park, Scope::Jog, true),
            (jog, Scope::Jog, true),
            (Ask::JogOn, Scope::Jog, true),
            (start, Scope::Run, true),
            (Ask::Resume, Scope::Run, true),
            (Ask::SpindleOverride { percent: 50 }, Scope::Run, true),
            (Ask::RapidOverride { percent: 50 }, Scope::Run, true),
            (Ask::Check { job: String::new() }, Scope::Run, true),
            (Ask::Queue { text: String::new() }, Scope::Run, true),
            (Ask::QueueRun { mode: Mode::Step }, Scope::Run, true),
            (Ask::OutputLease { minutes: 5 }, Scope::Jog, true),
            (Ask::Output { name: String::new(), on: true, pulse_ms: None }, Scope::Jog, true),
            (Ask::Configure { changes: vec![] }, Scope::Configure, true),
            (Ask::SetHeight, Scope::Jog, true),
            (Ask::OpenClamp, Scope::Jog, true),
            (Ask::Unlock, Scope::Jog, true),
            (Ask::Probe { depth_um: 1, plate_um: 0 }, Scope::Jog, true),
            (Ask::Edge { axis: 0, up: true, reach_um: 1, tool_um: 1 }, Scope::Jog, true),
        ];
        for (ask, scope, needs_control) in rows {
            assert_eq!((ask.scope(), ask.needs_control()), (scope, needs_control), "{ask:?}");
        }
        assert!(Scope::View < Scope::Jog && Scope::Jog < Scope::Run && Scope::Run < Scope::Configure);
    }
}
