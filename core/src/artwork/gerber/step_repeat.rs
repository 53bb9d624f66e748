//! Blocks (`%AB`) and step and repeat (`%SR`). If the copies exceed the limit, draws one copy or none, with a
//! diagnostic: a few lines can request 10¹² flashes.
//!
//! ```text
//!  %ABD20* … %AB*%        an aperture made of objects; nested blocks up to DEEPEST
//!  %SRX3Y2I5J4*% … %SR*%  ⠿  rows first, then columns
//! ```

use super::Reader;
use super::object::{Aperture, Form, Object, ObjectShape};
use super::words::{At, Block, fields};
use crate::artwork::number::Decimal;
use crate::code;
use crate::diagnostic::Severity;
use crate::geometry::Point;
use crate::units::Length;

const MOST_COPIES: u64 = 250_000;
/// A copied contour counts as one object per this many corners.
const CORNERS: u64 = 8;
const DEEPEST: u32 = 16;

/// Open blocks and repeats, and object counts.
#[derive(Default)]
pub(super) struct StepRepeat {
    /// Open blocks and repeats, innermost last.
    open: Vec<Open>,
    /// Number of stored objects, including those in blocks, plus segments of contours.
    pub(super) kept: usize,
    made: u64,
}

struct Open {
    what: What,
    objects: Vec<Object>,
    copies: u64,
    depth: u32,
    at: At,
}

enum What {
    Block { code: u32 },
    Repeat { columns: u32, rows: u32, step: Point },
}

impl Reader {
    /// Stores an object in the innermost open block or repeat, unless it makes too many copies or nests
    /// blocks too deep.
    pub(super) fn keep(&mut self, object: Object) {
        let aperture = match object.shape {
            ObjectShape::Flash { .. } => self.out.apertures.get(object.aperture as usize),
            _ => None,
        };
        // A copied contour counts by its corners.
        let corners = match &object.shape {
            ObjectShape::Contour(path) if !self.step_repeat.open.is_empty() => {
                path.segments.len() as u64 / CORNERS
            }
            _ => 0,
        };
        let (copies, depth) =
            aperture.map_or((1 + corners, 0), |aperture| (aperture.repeated, aperture.depth));
        self.keep_copies(object, copies, depth);
    }

    fn keep_copies(&mut self, object: Object, copies: u64, depth: u32) {
        let total = self.step_repeat.made.saturating_add(copies);
        if copies > 1 && total > MOST_COPIES || depth > DEEPEST {
            self.tell_once(
                Severity::Error,
                code!("gerber.too_many_copies"),
                At { line: object.line, column: object.column },
                b"",
            );
            return;
        }
        self.step_repeat.kept += 1;
        match self.step_repeat.open.last_mut() {
            Some(open) => {
                open.copies = open.copies.saturating_add(copies);
                open.depth = open.depth.max(depth);
                open.objects.push(object);
            }
            None => {
                self.step_repeat.made = total;
                self.out.objects.push(object);
            }
        }
    }

    /// `ABD20` opens, `AB` closes.
    pub(super) fn block_aperture(&mut self, rest: &[u8], block: &Block<'_>) {
        if rest.is_empty() {
            self.close_repeat();
            if self.step_repeat.open.is_empty() {
                self.tell(Severity::Warning, code!("gerber.unknown_command"), block.at, block.text);
            }
            self.close(block);
            return;
        }
        let code = fields(rest, *b"D").and_then(|[code]| Some(code?.mantissa));
        let code = code.and_then(|code| u32::try_from(code).ok());
        if code.is_none() || self.step_repeat.open.len() >= DEEPEST as usize {
            self.tell_once(Severity::Error, code!("gerber.bad_block"), block.at, block.text);
        }
        // Always open, so that the matching end closes this and nothing else. Without a code, nothing can
        // flash it.
        if self.step_repeat.open.len() < 2 * DEEPEST as usize {
            let what = What::Block { code: code.unwrap_or(0) };
            self.step_repeat.open.push(Open { what, objects: Vec::new(), copies: 1, depth: 1, at: block.at });
        }
    }

    /// `SRX3Y2I5J4` closes the previous repeat and opens one; `SR` and `SRX1Y1` only close.
    pub(super) fn step_and_repeat(&mut self, rest: &[u8], block: &Block<'_>) {
        self.close_repeat();
        let units = self.format.size_units();
        let count = |field: Option<Decimal>| field.map_or(Some(1), |n| u32::try_from(n.mantissa).ok());
        let step = |field: Option<Decimal>| field.map_or(Some(Length::ZERO), |n| n.length(units));
        let known = fields(rest, *b"XYIJ")
            .and_then(|[x, y, i, j]| (count(x).zip(count(y))).zip(step(i).zip(step(j))));
        let known = known.filter(|((columns, rows), (i, j))| {
            let wide = |count: u32, step: Length| {
                i128::from(step.nm().abs()) * i128::from(count) <= i128::from(Length::LIMIT.nm())
            };
            *columns > 0 && *rows > 0 && wide(*columns, *i) && wide(*rows, *j)
        });
        match known {
            Some(((1, 1), _)) => {}
            Some(((columns, rows), (x, y))) if self.step_repeat.open.len() < 2 * DEEPEST as usize => {
                let what = What::Repeat { columns, rows, step: Point::new(x, y) };
                self.step_repeat.open.push(Open {
                    what,
                    objects: Vec::new(),
                    copies: 1,
                    depth: 0,
                    at: block.at,
                });
            }
            _ => self.tell(Severity::Error, code!("gerber.bad_repeat"), block.at, block.text),
        }
    }

    fn close_repeat(&mut self) {
        if matches!(self.step_repeat.open.last(), Some(Open { what: What::Repeat { .. }, .. })) {
            self.close(&Block::made(b"SR"));
        }
    }

    pub(super) fn close_all(&mut self) {
        self.close_repeat();
        if let Some(at) = self.step_repeat.open.last().map(|open| open.at) {
            self.tell(Severity::Error, code!("gerber.block_open"), at, b"");
        }
        while !self.step_repeat.open.is_empty() {
            self.close(&Block::made(b"AB"));
        }
    }

    fn close(&mut self, block: &Block<'_>) {
        let Some(Open { what, objects, copies, depth, at }) = self.step_repeat.open.pop() else { return };
        match what {
            What::Block { code } => {
                let function = self.attributes.aperture_function();
                let form = Form::Block { objects };
                let depth = depth + 1;
                self.define(Aperture { code, form, opening: None, function, repeated: copies, depth }, block);
            }
            What::Repeat { columns, rows, step } if !objects.is_empty() => {
                let all = copies.saturating_mul(u64::from(columns)).saturating_mul(u64::from(rows));
                let too_many = self.step_repeat.made.saturating_add(all) > MOST_COPIES;
                let (columns, rows) = if too_many { (1, 1) } else { (columns, rows) };
                if too_many {
                    self.tell(Severity::Error, code!("gerber.too_many_copies"), at, b"");
                }
                let shape = ObjectShape::Repeat { objects, columns, rows, step };
                // The objects of a repeat have their own polarity.
                let At { line, column } = at;
                let object = Object { shape, clear: false, aperture: 0, transform: 0, tag: 0, line, column };
                self.keep_copies(object, if too_many { copies } else { all }, depth);
            }
            What::Repeat { .. } => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artwork::Overrides;

    fn places(body: &str) -> (Vec<(i64, i64, bool)>, Vec<String>) {
        let text = format!("%FSLAX33Y33*%%MOMM*%%ADD10C,0.1*%D10*{body}M02*");
        let (gerber, diagnostics) = super::super::read("t", text.as_bytes(), &Overrides::default());
        let mut found = Vec::new();
        super::super::flatten::each(&gerber, &mut |seen| {
            if let ObjectShape::Flash { at } = seen.object.shape {
                let at = seen.place.point(at);
                found.push((at.x.nm() / 1_000, at.y.nm() / 1_000, seen.clear));
            }
        });
        (found, diagnostics.into_iter().map(|diagnostic| diagnostic.code).collect())
    }

    #[test]
    fn copies_are_where_blocks_and_repeats_put_them() {
        let (found, diagnostics) = places("%SRX2Y2I5J3*%X1000Y0D03*%SR*%X0Y0D03*");
        assert_eq!(
            found,
            [
                (1_000, 0, false),
                (1_000, 3_000, false),
                (6_000, 0, false),
                (6_000, 3_000, false),
                (0, 0, false)
            ]
        );
        assert_eq!(diagnostics, Vec::<String>::new());
        let nested = "%ABD20*%%ABD21*%X1000Y0D03*%LPC*%X2000Y0D03*%LPD*%%AB*%D21*X0Y5000D03*%AB*%\
            D20*%LR90*%X0Y0D03*%LR0*%%LPC*%X10000Y0D03*";
        let (found, diagnostics) = places(nested);
        assert_eq!(
            found,
            [(-5_000, 1_000, false), (-5_000, 2_000, true), (11_000, 5_000, true), (12_000, 5_000, false)]
        );
        assert_eq!(diagnostics, Vec::<String>::new());
    }

    #[test]
    fn excessive_copies_are_an_error() {
        let mut bomb = String::from("%ABD20*%X0Y0D03*X1Y0D03*%AB*%");
        for code in 21..60 {
            bomb += &format!("%ABD{code}*%D{}*X0Y0D03*X1Y0D03*%AB*%", code - 1);
        }
        let (found, diagnostics) = places(&(bomb + "D59*X0Y0D03*"));
        assert_eq!((found.len(), diagnostics[0].as_str()), (0, "gerber.too_many_copies"));
        let mut chain = String::from("%ABD20*%X0Y0D03*%AB*%");
        for code in 21..5_000 {
            chain += &format!("%ABD{code}*%D{}*X0Y0D03*%AB*%", code - 1);
        }
        let (found, diagnostics) = places(&(chain + "D4999*X0Y0D03*"));
        assert_eq!((found.len(), diagnostics[0].as_str()), (0, "gerber.too_many_copies"));
        let (found, diagnostics) = places("%SRX30000Y30000I0.2J0.2*%X0Y0D03*%SR*%");
        assert_eq!((found.len(), diagnostics[0].as_str()), (1, "gerber.too_many_copies"));
    }
}
