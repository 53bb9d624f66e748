//! What is known of the machine, from reports and answers alone. Never guess a position: trust it after homing,
//! or after the user set zero.
//!
//! ```text
//!  work zero of a report   ≠ G54, G92 and tool length in `$#`     damaged, or another zero is active
//!  stopped or in a job     then stopped at 0, 0, 0, not a target  a controller without limit switches
//!                                                                 restarted, and its banner was lost
//! ```

use super::asks::Info;
use super::depth::TipDepth;
use super::ends::AxisEnds;
use super::heard::{ControllerStatus, HeardLine, Modes, ReportedState};
use super::settings::{self, MM_PER_INCH};
use crate::control::{BoardHeight, Trust};
use crate::diagnostic::Diagnostic;
use crate::{code, error};

/// Most that a work zero may differ from the zero of the interrupted job, mm.
pub(super) const SAME_ZERO_MM: f64 = 0.01;
/// Tolerance for "the same Z zero", in units of the last digit of a report.
const SAME_HEIGHT_SHARE: f64 = 1.5;
/// Steps per millimetre if unknown.
const USUAL_STEPS: f64 = 80.0;
/// A device that sends such rows without end must not fill the memory.
const MOST_ABOUT: usize = 64;
const MOST_OFFSETS: usize = 32;

/// Positions in mm.
#[derive(Debug, Default)]
pub struct Known {
    pub trust: Trust,
    pub info: Info,
    /// The last report.
    pub status: Option<ControllerStatus>,
    /// Work zero in machine coordinates.
    pub zero_mm: Option<[f64; 3]>,
    pub modes: Option<Modes>,
    /// The controller stored another X or Y zero than was sent: no job starts until one is confirmed.
    pub(super) zero_refused: bool,
    pub(super) height: BoardHeight,
    pub(super) depth: TipDepth,
    /// Ends of X, Y and Z, found by homing.
    pub(super) ends: [Option<AxisEnds>; 3],
    /// Z zero minus the height at which the tool setter meets the same tool.
    pub(super) reference_mm: Option<f64>,
    pub(super) probed: Option<bool>,
    /// Position at which the probe met the board, machine coordinates.
    pub(super) probed_at_mm: Option<[f64; 3]>,
    pub sent_lines: u64,
    /// Job lines answered since then.
    pub answered_lines: u64,
}

impl Known {
    /// Tip position in work coordinates, mm.
    pub fn place(&self) -> Option<[f64; 3]> {
        let (machine, zero) = (self.machine_mm()?, self.zero_mm?);
        Some(core::array::from_fn(|axis| machine[axis] - zero[axis]))
    }

    pub(super) fn machine_mm(&self) -> Option<[f64; 3]> {
        self.status.as_ref()?.machine_mm
    }

    pub(super) fn overrides(&self) -> Option<[u16; 3]> {
        self.status.as_ref()?.overrides
    }

    pub fn height(&self) -> BoardHeight {
        self.height
    }

    /// Work zero without the active tool length, machine coordinates, mm: a reset clears the tool length.
    pub fn job_zero_mm(&self) -> Option<[f64; 3]> {
        let length = self.info.offsets.get("TLO").and_then(|places| places.first()).copied().unwrap_or(0.0);
        self.zero_mm.map(|[x, y, z]| [x, y, z - length])
    }

    /// True if the Z zero is where it was, `before_mm`. Only limit switches make that comparable.
    pub fn height_as_left(&self, before_mm: Option<[f64; 3]>) -> bool {
        let same_mm = self.same_height_mm();
        let same = |before: [f64; 3], now: [f64; 3]| libm::fabs(before[2] - now[2]) <= same_mm;
        self.homes() && before_mm.zip(self.job_zero_mm()).is_some_and(|(before, now)| same(before, now))
    }

    /// True if the machine has limit switches, so that homing restores the same coordinates.
    pub(super) fn homes(&self) -> bool {
        settings::on(&self.info.values, 22)
    }

    pub(super) fn is_homed(&self) -> bool {
        self.homes() && self.trust == Trust::Trusted
    }

    /// True if the machine can home and has not: a zero set now would be elsewhere after homing.
    pub(super) fn is_to_be_homed(&self) -> bool {
        self.homes() && self.trust != Trust::Trusted
    }

    pub(super) fn contact_is_closed(&self) -> bool {
        self.status.as_ref().is_some_and(|status| status.pins.contains('P'))
    }

    pub(super) fn step_mm(&self) -> f64 {
        let scale = settings::axes(&self.info.values, 100).unwrap_or([USUAL_STEPS; 3]);
        scale.into_iter().fold(0.0_f64, |most, steps| most.max(1.0 / steps))
    }

    pub(super) fn same_height_mm(&self) -> f64 {
        SAME_HEIGHT_SHARE * settings::place_digit_mm(&self.info.values)
    }

    /// Why a move that needs the position can't start: the machine was not homed, or no zero was set.
    pub(super) fn untrusted(&self) -> Option<Diagnostic> {
        let code = if self.homes() { code!("grbl.not_homed") } else { code!("grbl.no_zero") };
        (self.trust != Trust::Trusted).then(|| Diagnostic::error(code))
    }

    /// The first of these modal words that is not in force, as an error.
    pub(super) fn other_word(&self, wanted: &[(char, u16)]) -> Option<Diagnostic> {
        let Some(modes) = &self.modes else { return Some(error!("grbl.answer_missing")) };
        let word = modes.first_missing(wanted)?;
        Some(error!("grbl.modes_differ", word = word))
    }

    /// The machine position is unknown now; without limit switches the zeros mean nothing either.
    pub(super) fn lose_place(&mut self) {
        (self.trust, self.reference_mm) = (Trust::Lost, None);
        self.depth.lose_place();
        if !self.homes() {
            self.height = BoardHeight::Unknown;
        }
    }

    /// The controller restarted unasked: its step counts began at zero.
    pub(super) fn restart(&mut self) {
        self.lose_place();
        self.depth = self.depth.restarted();
    }

    /// Another tool may be in. A known board height then belongs to the previous tool, unless all tools of the
    /// job are equally long.
    pub(super) fn change_tool(&mut self, are_alike: bool) {
        self.height = self.height.with_another_tool(are_alike);
    }

    /// Lift needed before X and Y jog without insisting, mm; `None` if the tip is not known to be in the
    /// board.
    pub fn lift_first_mm(&self) -> Option<f64> {
        self.depth.lift_first_mm()
    }

    /// A report arrived. `cuts`: the job does not wait for a tool, when nothing cuts.
    pub(super) fn follow_depth(&mut self, in_job: bool, cuts: bool) {
        let Some(z_mm) = self.machine_mm().map(|place| place[2]) else { return };
        let is_known = (self.height != BoardHeight::Unknown || in_job)
            && (self.trust == Trust::Trusted || !self.homes());
        let surface_mm = self.zero_mm.map(|zero| zero[2]).filter(|_| is_known);
        self.depth.follow(z_mm, surface_mm, cuts);
    }

    /// Range of an axis without limit switches, machine coordinates, mm; `None` if the axis wasn't homed.
    pub fn room_mm(&self, axis: usize) -> Option<[f64; 2]> {
        self.ends_of(axis).map(|ends| ends.room_mm)
    }

    /// As `room_mm`, including the limit switches.
    pub fn ends_mm(&self, axis: usize) -> Option<[f64; 2]> {
        self.ends_of(axis).map(|ends| ends.ends_mm)
    }

    fn ends_of(&self, axis: usize) -> Option<AxisEnds> {
        *self.ends.get(axis).filter(|_| self.is_homed())?
    }

    /// Takes an answer to a query. Rows that change more than what is known are not for here.
    pub(super) fn hear(&mut self, heard: HeardLine) {
        let unit_mm = self.unit_mm();
        match heard {
            HeardLine::Version { version, .. } => self.info.version = version,
            HeardLine::Options(options) => self.info.options = options,
            HeardLine::About { name, value } if self.info.about.len() < MOST_ABOUT => {
                self.info.about.insert(name, value);
            }
            HeardLine::Offset { name, places } => {
                let offsets = &mut self.info.offsets;
                if offsets.len() < MOST_OFFSETS || offsets.contains_key(&name) {
                    offsets.insert(name, places.into_iter().map(|place| place * unit_mm).collect());
                }
            }
            HeardLine::Modes(mut modes) => {
                modes.feed_mm_per_min *= unit_mm;
                self.modes = Some(modes);
            }
            HeardLine::Probe { place_mm: place, met } => {
                self.probed = Some(met);
                self.probed_at_mm = Some(place.map(|value| value * unit_mm));
            }
            HeardLine::Message(text) => self.info.hear_ends(&text),
            _ => {}
        }
    }

    fn unit_mm(&self) -> f64 {
        if settings::in_inches(&self.info.values) { MM_PER_INCH } else { 1.0 }
    }

    /// A setting has changed. If the unit changed, drop values in the old unit. During identification,
    /// convert the zero: only its unit was misread.
    pub(super) fn set(&mut self, number: u16, value: f64, identifies: bool) {
        let before = settings::in_inches(&self.info.values);
        self.info.values.insert(number, value);
        if settings::in_inches(&self.info.values) == before {
            return;
        }
        let factor = if before { 1.0 / MM_PER_INCH } else { MM_PER_INCH };
        let zero_mm = self.zero_mm.filter(|_| identifies);
        (self.status, self.zero_mm) = (None, zero_mm.map(|zero| zero.map(|value| value * factor)));
    }

    /// Takes a status report; returns the one before. Converts positions to mm and fills omitted fields from
    /// the last report.
    pub(super) fn report(&mut self, mut status: ControllerStatus) -> Option<ControllerStatus> {
        let unit = self.unit_mm();
        let scaled = |place: Option<[f64; 3]>| place.map(|place| place.map(|value| value * unit));
        (status.machine_mm, status.work_mm, status.offset_mm) =
            (scaled(status.machine_mm), scaled(status.work_mm), scaled(status.offset_mm));
        status.feed_mm_per_min = status.feed_mm_per_min.map(|feed| feed * unit);
        // GRBL adds the work offset, and the overrides, only to some reports.
        if status.offset_mm.is_some() {
            self.zero_mm = status.offset_mm;
        }
        if let (None, Some(work), Some(zero)) = (status.machine_mm, status.work_mm, self.zero_mm) {
            status.machine_mm = Some(core::array::from_fn(|axis| work[axis] + zero[axis]));
        }
        if status.overrides.is_none() {
            status.overrides = self.overrides();
            status.accessories = self.status.as_ref().and_then(|before| before.accessories.clone());
        }
        self.status.replace(status)
    }

    /// True if the last report may come from a controller without limit switches that restarted since the
    /// report `before`. A controller with limit switches would be locked then.
    pub(super) fn may_have_restarted(&self, before: &ControllerStatus) -> bool {
        let Some(now) = &self.status else { return false };
        // A machine that was at zero already looks the same after a restart.
        let was_elsewhere = before.machine_mm.is_some_and(|place| place != [0.0; 3]);
        let is_at_zero = now.doing == ReportedState::Idle && now.machine_mm == Some([0.0; 3]);
        self.trust == Trust::Trusted && !self.homes() && was_elsewhere && is_at_zero
    }

    /// Work zero from the stored offsets, machine coordinates; `None` if they were not listed.
    pub(super) fn listed_zero_mm(&self) -> Option<[f64; 3]> {
        let offsets = &self.info.offsets;
        let of = |name: &str, axis: usize| offsets.get(name).and_then(|places| places.get(axis)).copied();
        let zero = |axis: usize| {
            let shift = of("G92", axis).unwrap_or(0.0);
            let tool = if axis == 2 { of("TLO", 0).unwrap_or(0.0) } else { 0.0 };
            Some(of("G54", axis)? + shift + tool)
        };
        Some([zero(0)?, zero(1)?, zero(2)?])
    }

    /// The largest active offset of G92 and tool length, from the stored offsets, mm.
    pub(super) fn offset_in_force(&self) -> Option<f64> {
        let all = ["G92", "TLO"].into_iter().filter_map(|name| self.info.offsets.get(name)).flatten();
        all.copied()
            .filter(|mm| libm::fabs(*mm) > SAME_ZERO_MM / 10.0)
            .max_by(|a, b| libm::fabs(*a).total_cmp(&libm::fabs(*b)))
    }

    /// Difference of the reported work zero to the stored one, if it exceeds rounding.
    pub(super) fn zero_off_mm(&self) -> Option<[f64; 3]> {
        let (reported, listed) = self.zero_mm.zip(self.listed_zero_mm())?;
        let off: [f64; 3] = core::array::from_fn(|axis| reported[axis] - listed[axis]);
        off.iter().any(|off| libm::fabs(*off) > SAME_ZERO_MM).then_some(off)
    }

    /// A differing zero prevents a job.
    pub(super) fn check_listed(&self) -> Option<Diagnostic> {
        let off = self.zero_off_mm()?;
        let told = |axis: usize| format!("{:.3}", off[axis]);
        let why = error!("grbl.zero_differs", x = told(0), y = told(1), ..);
        Some(why.with("z", told(2)))
    }
}
