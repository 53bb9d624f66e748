//! Edits of a phase table: cells, blocks, rotation, mirroring, length; and its waveforms. The core checks the
//! tables.
//!
//! ```text
//! line  bit   1 2 3 4 5 6 …      a column is the output byte of one step
//! 1a    0     x x x x x x        block = the cells between anchor and cursor
//! ```

pub const MOST_COLUMNS: usize = 64;

/// A line of the table: one bit of the output byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PhaseLine {
    pub bit: u8,
    /// Name on the drive: the digit is the winding, the letter its half.
    pub name: &'static str,
    /// Voltage of the supply that it switches.
    pub volts: u8,
}

impl PhaseLine {
    pub fn mask(self) -> u8 {
        1 << self.bit
    }
}

const fn line(bit: u8, name: &'static str, volts: u8) -> PhaseLine {
    PhaseLine { bit, name, volts }
}

/// The wired lines; bits 4 and 7 are not wired.
pub const LINES: [PhaseLine; 6] = [
    line(0, "1a", 5),
    line(1, "1b", 5),
    line(2, "2a", 5),
    line(3, "2b", 5),
    line(5, "boost a", 24),
    line(6, "boost b", 24),
];

/// A cell, both indices from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cell {
    pub line: usize,
    pub column: usize,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CellBlock {
    pub anchor: Cell,
    pub cursor: Cell,
}

impl CellBlock {
    pub fn at(cell: Cell) -> Self {
        Self { anchor: cell, cursor: cell }
    }

    pub fn lines(self) -> (usize, usize) {
        let (a, b) = (self.anchor.line, self.cursor.line);
        (a.min(b), a.max(b).min(LINES.len() - 1))
    }

    pub fn columns(self, count: usize) -> (usize, usize) {
        let (a, b) = (self.anchor.column, self.cursor.column);
        let last = count.saturating_sub(1);
        (a.min(b).min(last), a.max(b).min(last))
    }

    pub fn holds(self, cell: Cell) -> bool {
        let ((top, bottom), (left, right)) = (self.lines(), self.columns(MOST_COLUMNS));
        (top..=bottom).contains(&cell.line) && (left..=right).contains(&cell.column)
    }

    pub fn single(self) -> bool {
        self.anchor == self.cursor
    }

    /// Moves the cursor within a table of `count` columns. The anchor stays if `stretch`.
    #[must_use]
    pub fn moved(self, lines: isize, columns: isize, stretch: bool, count: usize) -> Self {
        let add = |at: usize, by: isize, last: usize| at.saturating_add_signed(by).min(last);
        let cursor = Cell {
            line: add(self.cursor.line, lines, LINES.len() - 1),
            column: add(self.cursor.column, columns, count.saturating_sub(1)),
        };
        Self { anchor: if stretch { self.anchor } else { cursor }, cursor }
    }
}

/// A copied block: its cells, line by line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Clip {
    cells: Vec<Vec<bool>>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum TableEdit {
    /// Toggles a cell; sets a block to the inverse of its first cell.
    Toggle(CellBlock),
    Clear(CellBlock),
    Invert(CellBlock),
    Mirror(CellBlock),
    Rotate {
        /// Number of columns; negative to the left.
        by: isize,
    },
    /// Sets the number of columns: truncates, or repeats from the start.
    Length {
        columns: usize,
    },
    /// Pastes a block; drops cells outside the table.
    Paste {
        at: Cell,
        clip: Clip,
    },
    Replace(Vec<u8>),
}

pub fn edited(columns: &[u8], edit: &TableEdit) -> Vec<u8> {
    let mut next = columns.to_vec();
    match edit {
        TableEdit::Toggle(block) => {
            let (top, _) = block.lines();
            let (left, _) = block.columns(columns.len());
            let on = !is_on(columns, Cell { line: top, column: left });
            each(&mut next, *block, |byte, mask| if on { byte | mask } else { byte & !mask });
        }
        TableEdit::Clear(block) => each(&mut next, *block, |byte, mask| byte & !mask),
        TableEdit::Invert(block) => each(&mut next, *block, |byte, mask| byte ^ mask),
        TableEdit::Mirror(block) => {
            let ((top, bottom), (left, right)) = (block.lines(), block.columns(columns.len()));
            for line in top..=bottom {
                for column in left..=right.min(columns.len().saturating_sub(1)) {
                    let from = Cell { line, column: left + right - column };
                    set(&mut next, Cell { line, column }, is_on(columns, from));
                }
            }
        }
        TableEdit::Rotate { by } if !next.is_empty() => {
            let count = next.len() as isize;
            next.rotate_right(by.rem_euclid(count) as usize);
        }
        TableEdit::Rotate { .. } => {}
        TableEdit::Length { columns: count } => {
            let count = (*count).clamp(1, MOST_COLUMNS);
            let source = if columns.is_empty() { &[0][..] } else { columns };
            next = source.iter().copied().cycle().take(count).collect();
        }
        TableEdit::Paste { at, clip } => {
            for (down, row) in clip.cells.iter().enumerate() {
                for (right, on) in row.iter().enumerate() {
                    set(&mut next, Cell { line: at.line + down, column: at.column + right }, *on);
                }
            }
        }
        TableEdit::Replace(other) => next.clone_from(other),
    }
    next
}

fn each(columns: &mut [u8], block: CellBlock, change: impl Fn(u8, u8) -> u8) {
    let ((top, bottom), (left, right)) = (block.lines(), block.columns(columns.len()));
    for byte in columns.iter_mut().take(right + 1).skip(left) {
        for line in &LINES[top..=bottom] {
            *byte = change(*byte, line.mask());
        }
    }
}

fn set(columns: &mut [u8], cell: Cell, on: bool) {
    if let (Some(byte), Some(line)) = (columns.get_mut(cell.column), LINES.get(cell.line)) {
        *byte = if on { *byte | line.mask() } else { *byte & !line.mask() };
    }
}

/// True if a cell is on; false outside the table.
pub fn is_on(columns: &[u8], cell: Cell) -> bool {
    let line = LINES.get(cell.line);
    line.zip(columns.get(cell.column)).is_some_and(|(line, byte)| byte & line.mask() != 0)
}

pub fn copied(columns: &[u8], block: CellBlock) -> Clip {
    let ((top, bottom), (left, right)) = (block.lines(), block.columns(columns.len()));
    let row = |line| (left..=right).map(|column| is_on(columns, Cell { line, column })).collect();
    Clip { cells: (top..=bottom).map(row).collect() }
}

pub fn whole(count: usize) -> CellBlock {
    let last = Cell { line: LINES.len() - 1, column: count.saturating_sub(1) };
    CellBlock { anchor: Cell::default(), cursor: last }
}

/// Runs of columns in which `line` is on: first column, and the column after the last.
pub fn stretches(columns: &[u8], line: PhaseLine) -> Vec<(usize, usize)> {
    let mut found: Vec<(usize, usize)> = Vec::new();
    for (column, _) in columns.iter().enumerate().filter(|(_, byte)| **byte & line.mask() != 0) {
        match found.last_mut() {
            Some((_, end)) if *end == column => *end += 1,
            _ => found.push((column, column + 1)),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWELVE: [u8; 12] = [0x25, 5, 5, 0x49, 9, 9, 0x2A, 10, 10, 0x46, 6, 6];

    fn cell(line: usize, column: usize) -> Cell {
        Cell { line, column }
    }

    fn block(from: (usize, usize), to: (usize, usize)) -> CellBlock {
        CellBlock { anchor: cell(from.0, from.1), cursor: cell(to.0, to.1) }
    }

    #[test]
    fn table_edits_change_the_columns() {
        let rows: [(&[u8], TableEdit, &[u8]); 13] = [
            (&[0, 0], TableEdit::Toggle(CellBlock::at(cell(0, 1))), &[0, 1]),
            (&[1, 1], TableEdit::Toggle(CellBlock::at(cell(0, 0))), &[0, 1]),
            (&[0, 1, 0], TableEdit::Toggle(block((0, 0), (1, 2))), &[3, 3, 3]),
            (&[0x25, 0x25], TableEdit::Clear(block((2, 1), (5, 1))), &[0x25, 1]),
            (&[0x60, 0], TableEdit::Invert(block((4, 0), (5, 1))), &[0, 0x60]),
            (&[1, 2, 4], TableEdit::Mirror(whole(3)), &[4, 2, 1]),
            (&[1, 2, 4, 8], TableEdit::Mirror(block((0, 1), (5, 2))), &[1, 4, 2, 8]),
            (&[1, 2, 4], TableEdit::Rotate { by: 1 }, &[4, 1, 2]),
            (&[1, 2, 4], TableEdit::Rotate { by: -1 }, &[2, 4, 1]),
            (&[], TableEdit::Rotate { by: 1 }, &[]),
            (&[1, 2], TableEdit::Length { columns: 5 }, &[1, 2, 1, 2, 1]),
            (&[1, 2, 4], TableEdit::Length { columns: 2 }, &[1, 2]),
            (&[], TableEdit::Length { columns: 2 }, &[0, 0]),
        ];
        for (columns, edit, expected) in rows {
            assert_eq!(edited(columns, &edit), expected, "{columns:?} {edit:?}");
        }
        assert_eq!(edited(&[0; 4], &TableEdit::Length { columns: 900 }).len(), MOST_COLUMNS);
    }

    #[test]
    fn copied_block_is_clipped_when_pasted() {
        let clip = copied(&TWELVE, block((0, 0), (3, 2)));
        let pasted = edited(&[0; 12], &TableEdit::Paste { at: cell(0, 10), clip: clip.clone() });
        assert_eq!(pasted[10..], [5, 5]);
        assert_eq!(edited(&TWELVE, &TableEdit::Paste { at: cell(0, 0), clip: clip.clone() }), TWELVE);
        assert_eq!(edited(&[0; 3], &TableEdit::Paste { at: cell(5, 0), clip }), [0x40, 0x40, 0x40]);
    }

    #[test]
    fn inverting_mirroring_or_half_turn_twice_restores_the_table() {
        let all = whole(12);
        for edit in [TableEdit::Invert(all), TableEdit::Mirror(all), TableEdit::Rotate { by: 6 }] {
            assert_eq!(edited(&edited(&TWELVE, &edit), &edit), TWELVE, "{edit:?}");
        }
    }

    #[test]
    fn cursor_is_clamped_to_the_table_and_shift_extends_it() {
        let at = CellBlock::at(cell(0, 0)).moved(-1, -1, false, 12);
        assert_eq!(at, CellBlock::at(cell(0, 0)));
        let stretched = at.moved(9, 2, true, 12);
        assert_eq!((stretched.lines(), stretched.columns(12)), ((0, 5), (0, 2)));
        assert!(stretched.holds(cell(3, 2)) && !stretched.holds(cell(3, 3)) && !stretched.single());
        assert_eq!(stretched.moved(0, 99, false, 12), CellBlock::at(cell(5, 11)));
    }

    #[test]
    fn phase_table_lines_give_on_intervals() {
        assert_eq!(stretches(&TWELVE, LINES[0]), [(0, 6)]);
        assert_eq!(stretches(&TWELVE, LINES[2]), [(0, 3), (9, 12)]);
        assert_eq!(stretches(&TWELVE, LINES[5]), [(3, 4), (9, 10)]);
    }
}
