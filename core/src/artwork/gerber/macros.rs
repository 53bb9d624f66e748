//! Aperture macros: stored as text, evaluated for each aperture that uses them.
//!
//! ```text
//!  %AMDONUT*             %ADD12DONUT,1.2X.8*%
//!  0 outer, inner*            $1 = 1.2   $2 = 0.8
//!  $3=$1-$2*                  $3 = 0.4
//!  1,1,$1,0,0*                ●
//!  1,0,$2,0,0*%               ○ removed
//! ```

use super::Reader;
use super::expression::value;
use super::object::Form;
use super::primitives::{Primitive, primitive};
use super::words::{Block, plain};
use crate::artwork::Units;
use crate::artwork::number::Decimal;
use crate::code;
use crate::diagnostic::Severity;
use std::collections::BTreeMap;

/// Maximum number of bytes of macro text evaluated per layer; each aperture with a macro counts its whole
/// text.
const FUEL: usize = 8_000_000;
/// Cost of a path, and of each segment, in bytes of text.
const PATH: usize = 64;
const SEGMENT: usize = 16;
const MOST_MACROS: usize = 10_000;
const MOST_LINES: usize = 10_000;
const MOST_VARIABLES: usize = 1_000;
const MOST_FIELDS: usize = 20_005;

/// The lines of a macro, without comments.
type Macro = Vec<Vec<u8>>;

#[derive(Clone, Debug)]
pub(super) struct Macros {
    by_name: BTreeMap<Vec<u8>, Macro>,
    open: Option<Vec<u8>>,
    /// Bytes of text left to evaluate.
    fuel: usize,
}

impl Default for Macros {
    fn default() -> Self {
        Self { by_name: BTreeMap::new(), open: None, fuel: FUEL }
    }
}

impl Macros {
    pub(super) fn is_open(&self) -> bool {
        self.open.is_some()
    }

    pub(super) fn close(&mut self) {
        self.open = None;
    }
}

impl Reader {
    /// Parses `DONUT`, without the `AM`; the lines follow as separate blocks.
    pub(super) fn macro_definition(&mut self, name: &[u8], block: &Block<'_>) {
        let macros = &mut self.apertures.macros;
        if macros.by_name.len() >= MOST_MACROS {
            self.tell_once(Severity::Error, code!("gerber.bad_macro"), block.at, block.text);
            return;
        }
        macros.open = Some(name.to_vec());
        if macros.by_name.insert(name.to_vec(), Macro::new()).is_some() {
            self.tell_once(Severity::Note, code!("gerber.macro_again"), block.at, block.text);
        }
    }

    pub(super) fn macro_line(&mut self, block: &Block<'_>) {
        let macros = &mut self.apertures.macros;
        let lines = macros.open.as_ref().and_then(|name| macros.by_name.get_mut(name));
        let Some(lines) = lines.filter(|lines| lines.len() < MOST_LINES) else {
            self.tell_once(Severity::Error, code!("gerber.bad_macro"), block.at, block.text);
            return;
        };
        let comment = matches!(block.written, [b'0'] | [b'0', b' ' | b',' | b'\n' | b'\r' | b'\t', ..]);
        if !comment {
            lines.push(block.text.to_vec());
        }
    }

    /// Evaluates the macro `name`; reports and omits unsupported parts.
    pub(super) fn macro_aperture(
        &mut self,
        name: &[u8],
        numbers: &[Decimal],
        units: Units,
        block: &Block<'_>,
    ) -> Option<Form> {
        let Macros { by_name, fuel, .. } = &mut self.apertures.macros;
        let lines = by_name.get(name)?;
        let mut variables: BTreeMap<u32, f64> =
            (1..).zip(numbers.iter().map(|number| plain(*number))).collect();
        let (mut primitives, mut lost) = (Vec::new(), Vec::new());
        for line in lines {
            if *fuel == 0 {
                lost.push(line.clone());
                break;
            }
            match work_out(line, &mut variables, units, fuel) {
                Some(made) => primitives.extend(made),
                None => lost.push(line.clone()),
            }
        }
        for line in lost {
            self.tell_once(Severity::Error, code!("gerber.bad_macro"), block.at, &line);
        }
        Some(Form::Macro { name: String::from_utf8_lossy(name).into_owned(), primitives })
    }
}

/// Evaluates a line: an assignment returns no paths, a primitive returns its paths. None if it is neither.
fn work_out(
    line: &[u8],
    variables: &mut BTreeMap<u32, f64>,
    units: Units,
    fuel: &mut usize,
) -> Option<Vec<Primitive>> {
    if let Some(rest) = line.strip_prefix(b"$") {
        let at = rest.iter().position(|&byte| byte == b'=')?;
        let index = std::str::from_utf8(rest.get(..at)?.trim_ascii()).ok()?.parse().ok()?;
        let found = value(rest.get(at + 1..)?, variables, fuel)?;
        if variables.len() >= MOST_VARIABLES {
            return None;
        }
        variables.insert(index, found);
        return Some(Vec::new());
    }
    let mut fields = Vec::new();
    for field in line.split(|&byte| byte == b',').take(MOST_FIELDS) {
        fields.push(value(field, variables, fuel)?);
    }
    let made = primitive(&fields, units)?;
    let paths = made.iter().flat_map(|(_, paths)| paths);
    let cost = paths.map(|path| PATH + SEGMENT * path.segments.len()).sum();
    let left = fuel.checked_sub(cost);
    *fuel = left.unwrap_or(0);
    left.map(|_| made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artwork::Overrides;
    use crate::geometry::Point;

    fn paths(text: &str) -> (Vec<Primitive>, usize) {
        let text = format!("%FSLAX33Y33*%%MOMM*%{text}M02*");
        let (gerber, diagnostics) = super::super::read("t", text.as_bytes(), &Overrides::default());
        match gerber.apertures.into_iter().next().map(|aperture| aperture.form) {
            Some(Form::Macro { primitives, .. }) => (primitives, diagnostics.len()),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn macros_are_evaluated_with_their_parameters() {
        let (paths, diagnostics) =
            paths("%AMD*\n0 a 1,1,9,0,0 comment*\n$3=$1-$2*1,1,$1,$3,0*\n1,0,$2,0,0*%%ADD10D,1.2X.8*%");
        assert_eq!((paths.len(), diagnostics), (2, 0));
        assert!(paths[0].0 && !paths[1].0);
        let right = paths[0].1[0].flattened(1e-3).into_iter().max().unwrap();
        assert!(right.distance_mm(Point::from_mm(1.0, 0.0)) < 0.05, "{right:?}");
    }

    #[test]
    fn unsupported_macro_parts_are_reported_and_the_rest_drawn() {
        let (paths, diagnostics) = paths("%AMD*1,1,1,0,0*9,1,1*1,1,$1x(,0,0*%%ADD10D,1*%");
        assert_eq!((paths.len(), diagnostics), (1, 2));
    }
}
