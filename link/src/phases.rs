//! Motors driven by their phases: which winding halves are on, and which windings are forced.
//!
//! ```text
//! bit of a column    0  1  2  3    5  6         of the machine's table: 1a 1b 2a 2b on 5 V, 1 and 2 on 24 V
//! bit of a pattern   0  1  2  3    4  5         of the neighbouring pins of a motor
//!
//! forcing   a winding whose drive changes with a step is forced, if its table ever forces it:
//!           until the next step, until its time is over, or until the path rests
//! word      wait │ pattern │ step 1 │ direction 1     a state machine waits, then shows the pattern;
//!                                                     the rest is for counting
//! ```
//!
//! Nothing is on before the first step.

use crate::CYCLES_PER_TICK;
use crate::bytes::{Plain, Writer};
use crate::crc::crc32c;
use crate::message::Windings;

/// Motors that an adapter drives by their phases.
pub const MOTORS: usize = 3;

/// Inputs that are left in this wiring.
pub const INPUTS: u8 = 0b1111;

/// Cycles of a word in addition to its wait.
pub const AROUND_WAIT: u32 = 7;

/// Longest forcing, in ticks: 100 ms.
const LONGEST: u32 = 1_000_000;

/// The halves of both windings, in a column and in a pattern.
const HALVES: u8 = 0b00_1111;

/// Of each winding: its halves, its forcing bit in a column, its forcing bit in a pattern.
const WINDINGS: [(u8, u8, u8); 2] = [(0b0011, 0b010_0000, 0b01_0000), (0b1100, 0b100_0000, 0b10_0000)];

/// The word that shows `pattern` this many ticks after the previous one. `step` is the direction of its
/// step, if any.
pub fn phase_word(ticks: u32, pattern: u8, step: Option<bool>) -> u32 {
    let wait = ticks.wrapping_mul(CYCLES_PER_TICK).wrapping_sub(AROUND_WAIT);
    let counts = step.map_or(0, |forward| 2 | u32::from(forward));
    wait << 8 | u32::from(pattern) << 2 | counts
}

/// The checksum that identifies the tables of all motors; never 0.
pub fn tables_crc(tables: &[Windings; MOTORS]) -> u32 {
    const LONGEST: usize = 80;
    let mut checks = [0; 4 * MOTORS];
    for (table, place) in tables.iter().zip(checks.chunks_exact_mut(4)) {
        let mut bytes = [0; LONGEST];
        let mut out = Writer::new(&mut bytes);
        table.put(&mut out);
        let length = out.end().unwrap_or(0);
        place.copy_from_slice(&crc32c(bytes.get(..length).unwrap_or_default()).to_le_bytes());
    }
    crc32c(&checks).max(1)
}

/// Returns `true` if the table is safe for a motor: never both halves of a winding, always at least one
/// half on.
fn is_right(table: &Windings) -> bool {
    let Some(columns) = table.columns.get(..usize::from(table.count)) else { return false };
    let is_right = |column: &u8| {
        let known = WINDINGS.iter().fold(HALVES, |known, (_, forcing, _)| known | forcing);
        let is_crossed = WINDINGS.iter().any(|(halves, ..)| column & halves == *halves);
        column & !known == 0 && !is_crossed && column & HALVES != 0
    };
    !columns.is_empty() && columns.iter().all(is_right) && (1..=LONGEST).contains(&table.forcing)
}

#[derive(Clone, Copy, Debug)]
pub struct PhaseMotor {
    table: Windings,
    /// Forcing bits used anywhere in its table, as in a column.
    forced: u8,
    at: u8,
    is_on: bool,
    /// Forcing bits of the pattern, and the machine tick at which they end.
    forcing: u8,
    until: u32,
}

impl PhaseMotor {
    pub const NONE: Self =
        Self { table: Windings::NONE, forced: 0, at: 0, is_on: false, forcing: 0, until: 0 };

    pub fn table(&self) -> &Windings {
        &self.table
    }

    /// Takes a table while stopped. Returns `false` if it is unsafe. The same table again changes nothing:
    /// a held motor keeps its position.
    pub fn take(&mut self, table: &Windings) -> bool {
        if !is_right(table) {
            return false;
        }
        if self.table != *table {
            (self.table, self.at) = (*table, table.count - 1);
            let columns = table.columns.iter().take(usize::from(table.count));
            self.forced = columns.fold(0, |bits, column| bits | column);
            self.switch_off();
        }
        true
    }

    /// Switches all windings off until the next step.
    pub fn switch_off(&mut self) {
        (self.is_on, self.forcing) = (false, 0);
    }

    /// The levels of its pins.
    pub fn pattern(&self) -> u8 {
        if self.is_on { self.column(self.at) & HALVES | self.forcing } else { 0 }
    }

    fn column(&self, at: u8) -> u8 {
        self.table.columns.get(usize::from(at)).copied().unwrap_or(0)
    }

    /// Steps to the next or previous column, at a machine tick.
    pub fn step(&mut self, forward: bool, at: u32) {
        let (before, last) = (self.column(self.at), self.table.count.saturating_sub(1));
        self.at = match (forward, self.at) {
            (true, at) if at >= last => 0,
            (true, at) => at + 1,
            (false, 0) => last,
            (false, at) => at - 1,
        };
        let (now, forced) = (self.column(self.at), self.forced);
        let is_forced = |(halves, in_table, _): &&(u8, u8, u8)| {
            forced & in_table != 0 && now & halves != 0 && (now ^ before) & halves != 0
        };
        self.forcing = WINDINGS.iter().filter(is_forced).fold(0, |bits, (.., pin)| bits | pin);
        (self.is_on, self.until) = (true, at.wrapping_add(self.table.forcing));
    }

    /// The machine tick at which the forcing ends, if there is any.
    pub fn forced_until(&self) -> Option<u32> {
        (self.forcing != 0).then_some(self.until)
    }

    pub fn hold(&mut self) {
        self.forcing = 0;
    }

    /// Takes back steps that were not made: the motor holds where it is.
    pub fn undo(&mut self, steps: i32) {
        self.hold();
        let count = i64::from(self.table.count.max(1));
        self.at = (i64::from(self.at) - i64::from(steps)).rem_euclid(count) as u8;
    }
}
