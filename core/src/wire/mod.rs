//! Messages between page and bridge: JSON text frames on one socket, and programs as bytes over HTTP.
//!
//! ```text
//! page                                    bridge
//!  (annulus link)  POST /api/link Link  ──▶  a fresh one-time address
//!  POST /api/pair Pair           ──▶        one-time token → Paired: session id and key
//!  GET  /api/socket              ──▶
//!                                ◀──        Tell::Challenge {nonce}
//!  Ask::Hello {session, proof}   ──▶        proof = auth::hello(key, nonce), within 2 s
//!                                ◀──        Tell::Welcome, Tell::Machine, Tell::Status …
//!  PUT  /api/jobs/SHA256 bytes   ──▶        headers SESSION_HEADER, PROOF_HEADER: auth::request(…)
//!  GET  /api/jobs/SHA256         ──▶        the same bytes back, for a page that opened later
//!                                ◀──        every refusal: {ok: false, error: {code, message, advice}}
//! ```
//!
//! Saved pages and bridges of other versions read these types: append only, never renumber. `project` has the
//! same rule.

pub mod auth;
mod frames;
mod job;
pub mod program;
mod status;

pub use frames::understand;
pub use job::{ArmedJob, InterruptedJob, JobEnd, Outputs, PreflightRow, QueuePhase, QueueStatus, RowVerdict};
pub use status::{
    ChangeReport, CheckModeReport, Control, ControllerReport, DrilledReport, HeightMapReport, LengthKnown,
    MagazineReport, MissingReport, OtherFirmware, SlipReport, Status, ToolsReport,
};

use crate::control::Timing;
use crate::diagnostic::Diagnostic;
use crate::level::ProbeGrid;
use crate::machine::Value;
use crate::magazine::{Held, Seen, StockedTool};
use crate::queue::Mode;
use serde::{Deserialize, Serialize};

/// Version of these messages. Each side also sends the oldest version that it understands.
pub const PROTOCOL: u16 = 1;

/// Largest text frame either side sends or accepts, in bytes.
pub const FRAME_LIMIT: usize = 64 * 1024;

/// Largest program, in bytes.
pub const PROGRAM_LIMIT: usize = 32 * 1024 * 1024;

/// Longest motion that one [`Ask::Jog`] or [`Ask::JogOn`] permits, in ms.
pub const JOG_GRANT_MS: u64 = 150;

/// Oldest version of these messages that this build understands.
pub const OLDEST_PROTOCOL: u16 = 1;

/// Request header with the session id.
pub const SESSION_HEADER: &str = "x-annulus-session";

/// Request header with the proof from [`auth::request`].
pub const PROOF_HEADER: &str = "x-annulus-proof";

/// Body of `POST /api/pair`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PairBody {
    /// One-time token: the part after `#t=` in the address.
    pub token: String,
}

/// Answer to `POST /api/pair`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Paired {
    pub ok: bool,
    /// Session id; sent in the clear.
    pub session: String,
    /// Session key, hexadecimal. Sent only here: later messages prove it instead of sending it.
    pub key: String,
}

/// Body of `POST /api/link`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkBody {
    pub scope: Scope,
}

/// Permissions of a session; each scope includes those before it. `annulus link --scope` sets it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scope {
    View,
    /// Take control, jog, home, set the zero.
    Jog,
    Run,
    #[default]
    Configure,
}

/// Requests from the page. After its hello, any page may send `Ping`, `TakeControl`, `ReleaseControl` and
/// `Stop`. All others need control.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "t", rename_all = "snake_case")]
pub enum Ask {
    /// First frame: identifies the session.
    Hello {
        proto: u16,
        /// Oldest protocol version that the page understands.
        min: u16,
        app: String,
        session: String,
        /// HMAC-SHA256 of the challenge under the session key, hexadecimal.
        proof: String,
    },
    /// Keep-alive. Control lapses 3 s after the last frame.
    Ping {
        /// Echoed, so that the page can measure the round trip.
        stamp: f64,
    },
    /// Take control if no page has it, or if the page that had it went silent.
    TakeControl {
        /// Take control even if another page has it.
        force: bool,
    },
    ReleaseControl,
    /// Home: Z up, then to the limit switches.
    Home,
    /// Make the current XY position the work zero. Nothing moves.
    SetZero,
    /// Restore the work zero from before the last `SetZero`.
    UndoZero,
    /// Jog one axis. X and Y are refused while the tip may be in the board, unless `anyway`. Motion lasts
    /// [`JOG_GRANT_MS`] at most, then decelerates to a stop. [`Ask::JogOn`] must arrive in time, repeatedly,
    /// to reach the full distance.
    Jog {
        /// 0 X, 1 Y, 2 Z.
        axis: u8,
        /// Signed distance, µm.
        distance_um: i32,
        /// Move X and Y even if the tip may be in the board. The user confirmed it.
        #[serde(default)]
        anyway: bool,
    },
    /// Jog keep-alive: extends a running jog by [`JOG_GRANT_MS`]. No-op if no jog is running.
    JogOn,
    /// Check this uploaded job and prepare it for start.
    Arm {
        job: String,
        /// First leg to run, as [`Ask::Start`] will send it. The pre-flight covers the job from that leg on.
        #[serde(default)]
        from_leg: u32,
    },
    Start {
        job: String,
        /// SHA-256 of the step stream as the page computed it.
        stream_digest: String,
        /// First leg to run: 0, or the leg that [`Tell::Interrupted`] offered.
        from_leg: u32,
    },
    /// Hold. On a toolpath the machine decelerates at once and waits there. A hole is finished first.
    Pause,
    Resume,
    /// Lift the tool off the toolpath on which it is paused, and switch the spindle off. [`Ask::Resume`]
    /// returns to the paused point.
    LiftTool,
    /// Finish this hole, then end the job.
    StopAfterHole,
    /// Feed in percent of the planned feed, 10 … 200. The path doesn't change. Up to 100, stream time is
    /// stretched at once. Above 100, the job is planned and checked again with higher feeds, from its next
    /// stop on.
    FeedOverride {
        percent: u8,
    },
    /// Spindle speed in percent of the programmed speed, 10 … 200. GRBL-family controllers only.
    SpindleOverride {
        percent: u8,
    },
    /// Rapids in percent of the fastest: 25, 50 or 100. GRBL-family controllers only.
    RapidOverride {
        percent: u8,
    },
    /// Run this uploaded job through the check mode of a GRBL-family controller, line by line and without a
    /// move. [`Tell::Checked`] reports the result.
    Check {
        job: String,
    },
    Stop,
    ToolChanged,
    /// The user declares that the new tool is exactly as long as the previous one. During a tool change on
    /// a machine that Annulus drives itself; not on a controller.
    SameLength,
    /// Measure the length of the tool in the spindle at the tool setter. During a tool change on a
    /// machine that Annulus drives itself; not on a controller.
    MeasureTool,
    /// A new tool has this number, in the tool list or in the spindle. Its wear starts at zero.
    NewTool {
        number: u32,
    },
    /// The user states which tools the magazine and the spindle hold. Refused while anything moves, and if
    /// there is no magazine.
    Stock {
        places: Vec<Option<StockedTool>>,
        spindle: Held,
    },
    /// The user states where the tool is after a tool change stopped. The clamp closes if the tool is in the
    /// spindle.
    ToolSeen {
        seen: Seen,
    },
    /// The tool falls out: the clamp of the spindle opens, and a hand must hold the tool. Allowed if a tool
    /// change stopped, or if a worn tool waits for a new one. Refused while anything moves or turns.
    OpenClamp,
    AcknowledgeAlarm,
    ForgetInterrupted,
    /// Check this queue of work commands against the current state of the machine, and hold it ready.
    Queue {
        /// Source text for [`crate::queue::read`].
        text: String,
    },
    QueueRun {
        mode: Mode,
    },
    QueueClear,
    /// Unlock the outputs for this time from now; 0 locks them. They lock automatically when the time is
    /// over, when control changes hands, and when anything moves.
    OutputLease {
        /// At most 5.
        minutes: u8,
    },
    /// Switch an unlocked output while nothing moves.
    Output {
        /// A name from [`Outputs::names`].
        name: String,
        on: bool,
        /// If set, the output switches back after this time.
        pulse_ms: Option<u32>,
    },
    /// Change machine settings. Refused while anything moves.
    Configure {
        changes: Vec<(String, Value)>,
    },
    /// Replace the injected faults of the virtual drill with these ([`crate::virtual_drill::faults`]). The
    /// drill must be homed again. Refused while anything moves, and by every other machine.
    Provoke {
        faults: Vec<String>,
    },
    /// Make the current height the zero of Z: the tip touches the board.
    SetHeight,
    /// Move down until the probe input finds the board, or a plate on it, and set the zero of Z there.
    Probe {
        depth_um: u32,
        /// Thickness of the plate on the board, µm; 0 for bare copper.
        plate_um: u32,
    },
    /// Find the edge of the board with the probe input and set the work zero of this axis there. The tip must
    /// already be next to the board, below its surface.
    Edge {
        axis: u8,
        /// Direction of travel: towards larger coordinates.
        up: bool,
        reach_um: u32,
        /// Tool diameter, µm. The edge is half of it away from the tool's axis.
        tool_um: u32,
    },
    /// Probe the board at every point of this grid, for its height map.
    Survey {
        grid: ProbeGrid,
        /// Key of the job ([`crate::level::key_of`]).
        job: String,
        /// Height of travel between points, over the highest point found, µm.
        clear_um: u32,
        /// Greatest drop from one point to the next, µm.
        depth_um: u32,
        /// Current time, seconds since 1970.
        now_s: u64,
    },
    ForgetHeightMap,
    /// Unlock without homing: the position stays unknown, and jogging is allowed. Controllers only.
    Unlock,
    /// Park: Z all the way up, spindle off, X and Y to the park position of the settings. Runs to its end
    /// unless stopped.
    Park,
}

impl Ask {
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
            | Self::SameLength
            | Self::MeasureTool
            | Self::Stock { .. }
            | Self::ToolSeen { .. }
            | Self::OpenClamp
            | Self::AcknowledgeAlarm => Scope::Jog,
            Self::Arm { .. }
            | Self::Start { .. }
            | Self::Pause
            | Self::Resume
            | Self::LiftTool
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

    /// True if only the page in control may send this.
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

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "t", rename_all = "snake_case")]
pub enum Tell {
    /// First frame: the page must prove its key.
    Challenge {
        proto: u16,
        /// Oldest protocol version that the bridge understands.
        min: u16,
        bridge: String,
        nonce: String,
    },
    Welcome {
        viewer: u32,
    },
    /// All settings of the machine; sent again after every change.
    Machine {
        settings: Vec<(String, Value)>,
        /// [`crate::machine::Machine::fingerprint`].
        fingerprint: String,
        /// Faults injected into the virtual drill; none on any other machine.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        faults: Option<Vec<String>>,
    },
    /// Current state, 10 times a second and after every change.
    Status(Box<Status>),
    Control(Control),
    Armed(ArmedJob),
    Ended(JobEnd),
    /// Wear of the tools in the tool list; sent to a new page and after every change.
    Tools(ToolsReport),
    Interrupted(InterruptedJob),
    /// How punctual the bridge's clock is; sent only if time is real.
    Timing(Box<Timing>),
    /// Source text of the queue; sent to a new page and after every change.
    QueueText {
        /// As the page sent it; empty if there is no queue.
        text: String,
    },
    Queue(Box<QueueStatus>),
    Outputs(Outputs),
    Controller(ControllerReport),
    /// A plunge of the running job ended on a sensor.
    Touched {
        leg: u32,
        /// Height of the tip over the work zero, µm.
        height_um: f64,
    },
    /// Height map of the board; sent to a new page and after every change.
    HeightMap(Box<HeightMapReport>),
    /// Contents of the magazine and state of a tool change; sent to a new page and after every step. Only
    /// from machines with a magazine.
    Magazine(Box<MagazineReport>),
    /// Progress of the check mode and the refused lines; sent during the check and at its end.
    Checked(Box<CheckModeReport>),
    Refused {
        /// Reason and advice.
        why: Diagnostic,
    },
    Pong {
        /// Copied from the ping.
        stamp: f64,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stop_needs_no_control_and_motion_does() {
        let jog = Ask::Jog { axis: 0, distance_um: 1, anyway: false };
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
