//! G-code words that each controller accepts, from its documents and sources: GRBL 1.1h (`gcode.c`), grblHAL
//! (`gcode.c`), LinuxCNC 2.9 (`interp_array.cc`, `interp_check.cc`). Codes in hundredths: G38.2 is 3820.

use super::Interpreter;

const GRBL: u8 = 1;
const HAL: u8 = 2;
const LCNC: u8 = 4;
const FAMILY: u8 = GRBL | HAL;
const ALL: u8 = GRBL | HAL | LCNC;
const BOTH: u8 = HAL | LCNC;

/// How a code uses the axis words on its line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axes {
    Free,
    Own,
    Needed,
    /// Moves by them, and is modal.
    Motion,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) code: u32,
    pub(super) group: u8,
    /// Value words that it uses.
    pub(super) uses: &'static str,
    /// Value words that it requires.
    pub(super) needs: &'static str,
    pub(super) axes: Axes,
    by: u8,
}

const fn row(code: u32, group: u8, by: u8) -> Row {
    Row { code, group, uses: "", needs: "", axes: Axes::Free, by }
}

impl Row {
    const fn with(self, uses: &'static str) -> Self {
        Self { uses, ..self }
    }

    const fn needing(self, needs: &'static str) -> Self {
        Self { needs, ..self }
    }

    const fn axes(self, axes: Axes) -> Self {
        Self { axes, ..self }
    }
}

/// The modal group of G93, G94 and G95. Groups have the numbers of the NIST standard; 0 is that of the
/// non-modal codes.
pub(super) const FEED_MODE: u8 = 5;

const G: &[Row] = &[
    row(0, 1, ALL).axes(Axes::Motion),
    row(100, 1, ALL).axes(Axes::Motion),
    row(200, 1, ALL).axes(Axes::Motion),
    row(300, 1, ALL).axes(Axes::Motion),
    row(400, 0, ALL).with("P").needing("P"),
    row(500, 1, BOTH).with("IJPQ").axes(Axes::Motion),
    row(510, 1, BOTH).with("IJ").axes(Axes::Motion),
    row(520, 1, LCNC).with("PL").axes(Axes::Motion),
    row(530, 1, LCNC),
    row(700, 17, LCNC),
    row(800, 17, LCNC),
    row(1000, 0, GRBL).with("LP").axes(Axes::Needed),
    row(1000, 0, HAL).with("LP").needing("LP").axes(Axes::Needed),
    row(1000, 0, LCNC).with("LPRIJQ").needing("LP").axes(Axes::Own),
    row(1700, 2, ALL),
    row(1710, 2, LCNC),
    row(1800, 2, ALL),
    row(1810, 2, LCNC),
    row(1900, 2, ALL),
    row(1910, 2, LCNC),
    row(2000, 6, ALL),
    row(2100, 6, ALL),
    row(2800, 0, ALL).axes(Axes::Own),
    row(2810, 0, ALL),
    row(3000, 0, ALL).axes(Axes::Own),
    row(3010, 0, ALL),
    row(3300, 1, BOTH).with("K").needing("K").axes(Axes::Motion),
    row(3310, 1, LCNC).with("KI").needing("K").axes(Axes::Motion),
    row(3820, 1, ALL).axes(Axes::Motion),
    row(3830, 1, ALL).axes(Axes::Motion),
    row(3840, 1, ALL).axes(Axes::Motion),
    row(3850, 1, ALL).axes(Axes::Motion),
    row(4000, 7, ALL),
    row(4100, 7, LCNC).with("D"),
    row(4110, 7, LCNC).with("DL").needing("D"),
    row(4200, 7, LCNC).with("D"),
    row(4210, 7, LCNC).with("DL").needing("D"),
    row(4300, 8, BOTH).with("H"),
    row(4310, 8, FAMILY).axes(Axes::Needed),
    row(4310, 8, LCNC).axes(Axes::Own),
    row(4320, 8, HAL).with("H").needing("H"),
    row(4320, 8, LCNC).with("H").axes(Axes::Own),
    row(4900, 8, ALL),
    row(5000, 11, HAL),
    row(5100, 11, HAL).axes(Axes::Needed),
    row(5200, 0, LCNC).axes(Axes::Needed),
    row(5300, 0, ALL),
    row(5400, 12, ALL),
    row(5500, 12, ALL),
    row(5600, 12, ALL),
    row(5700, 12, ALL),
    row(5800, 12, ALL),
    row(5900, 12, ALL),
    row(5910, 12, BOTH),
    row(5920, 12, BOTH),
    row(5930, 12, BOTH),
    row(6100, 13, ALL),
    row(6110, 13, LCNC),
    row(6400, 13, LCNC).with("PQ"),
    row(7300, 1, BOTH).with("RLQ").axes(Axes::Motion),
    row(7400, 1, LCNC).with("RLP").axes(Axes::Motion),
    row(7600, 1, BOTH).with("PIJRKQHEL").axes(Axes::Motion),
    row(8000, 1, FAMILY),
    row(8000, 19, LCNC),
    row(8100, 1, BOTH).with("RL").axes(Axes::Motion),
    row(8200, 1, BOTH).with("RLP").axes(Axes::Motion),
    row(8300, 1, BOTH).with("RLQ").axes(Axes::Motion),
    row(8400, 1, LCNC).with("RLP").axes(Axes::Motion),
    row(8500, 1, BOTH).with("RL").axes(Axes::Motion),
    row(8600, 1, BOTH).with("RLP").axes(Axes::Motion),
    row(8700, 1, LCNC).with("RLPIJK").axes(Axes::Motion),
    row(8800, 1, LCNC).with("RLP").axes(Axes::Motion),
    row(8900, 1, BOTH).with("RLP").axes(Axes::Motion),
    row(9000, 3, ALL),
    row(9010, 4, LCNC),
    row(9100, 3, ALL),
    row(9110, 4, ALL),
    row(9200, 0, ALL).axes(Axes::Needed),
    row(9210, 0, ALL),
    row(9220, 0, BOTH),
    row(9230, 0, BOTH),
    row(9300, 5, ALL),
    row(9400, 5, ALL),
    row(9500, 5, BOTH),
    row(9600, 14, LCNC).with("D").needing("S"),
    row(9700, 14, LCNC),
    row(9800, 10, BOTH),
    row(9900, 10, BOTH),
];

const M: &[Row] = &[
    row(0, 4, ALL),
    row(100, 4, ALL),
    row(200, 4, ALL),
    row(3000, 4, ALL),
    row(6000, 4, BOTH),
    row(300, 7, ALL),
    row(400, 7, ALL),
    row(500, 7, ALL),
    row(1900, 7, LCNC).with("RPQ"),
    row(600, 6, BOTH),
    row(6100, 6, BOTH).with("Q").needing("Q"),
    row(700, 8, BOTH),
    row(800, 8, ALL),
    row(900, 8, ALL),
    row(4800, 9, BOTH),
    row(4900, 9, BOTH),
    row(5000, 9, BOTH).with("P"),
    row(5100, 9, BOTH).with("P"),
    row(5200, 9, LCNC).with("P"),
    row(5300, 9, BOTH).with("P"),
    row(6200, 5, BOTH).with("P").needing("P"),
    row(6300, 5, BOTH).with("P").needing("P"),
    row(6400, 5, BOTH).with("P").needing("P"),
    row(6500, 5, BOTH).with("P").needing("P"),
    row(6600, 5, BOTH).with("PELQ"),
    row(6700, 5, BOTH).with("EQ").needing("EQ"),
    row(6800, 5, BOTH).with("EQ").needing("EQ"),
    row(7000, 18, BOTH),
    row(7100, 18, BOTH),
    row(7200, 18, BOTH),
    row(7300, 18, BOTH),
];

/// Words of controllers without a table here: Fanuc, Haas, Mach3, Marlin, Sinumerik. Only groups and words
/// that differ from the above.
const G_OTHER: &[Row] = &[
    row(400, 0, 0).with("PXUFS"),
    row(1000, 0, 0).with("LPRIJQ").axes(Axes::Own),
    row(3300, 1, 0).with("KFE").axes(Axes::Motion),
    row(4300, 8, 0).with("H"),
    row(4400, 8, 0).with("H"),
    row(5200, 0, 0).axes(Axes::Own),
    row(6000, 13, 0),
    row(6410, 13, 0),
    row(6420, 13, 0),
    row(7000, 6, 0),
    row(7100, 6, 0),
    row(7300, 9, 0).with("RLPQKIJ").axes(Axes::Motion),
    row(7400, 9, 0).with("RLPQKIJ").axes(Axes::Motion),
    row(7600, 9, 0).with("RLPQKIJHE").axes(Axes::Motion),
    row(8000, 9, 0),
    row(8100, 9, 0).with("RLPQKIJ").axes(Axes::Motion),
    row(8200, 9, 0).with("RLPQKIJ").axes(Axes::Motion),
    row(8300, 9, 0).with("RLPQKIJ").axes(Axes::Motion),
    row(8400, 9, 0).with("RLPQKIJ").axes(Axes::Motion),
    row(8500, 9, 0).with("RLPQKIJ").axes(Axes::Motion),
    row(8600, 9, 0).with("RLPQKIJ").axes(Axes::Motion),
    row(8700, 9, 0).with("RLPQKIJ").axes(Axes::Motion),
    row(8800, 9, 0).with("RLPQKIJ").axes(Axes::Motion),
    row(8900, 9, 0).with("RLPQKIJ").axes(Axes::Motion),
];

/// The row of a code; `None` if the controller doesn't know it.
pub(super) fn find(of: Interpreter, letter: char, code: u32) -> Option<&'static Row> {
    let known = if letter == 'G' { G } else { M };
    let by = match of {
        Interpreter::Grbl => GRBL,
        Interpreter::GrblHal => HAL,
        Interpreter::LinuxCnc => LCNC,
        Interpreter::Any => {
            let other = G_OTHER.iter().filter(|_| letter == 'G').find(|row| row.code == code);
            return other.or_else(|| known.iter().find(|row| row.code == code));
        }
    };
    known.iter().find(|row| row.code == code && row.by & by != 0)
}
