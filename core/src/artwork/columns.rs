//! The columns of a hole list: how lines are split, and which column is which. Columns are identified by
//! their heading, or by their values: a counter, or a few small sizes in the first column.
//!
//! ```text
//! No;X;Y;D                 "5,080","0,000","0,8"             0.8   -5.08  0.00
//! 1;-5,080;0,000;0,8       quotes, with decimal commas       0.8    0.00  2.54    size first
//! ```

use super::excellon::units_by_sizes;
use super::number::{Decimal, decimal};
use super::text::{holds, lines, starts};

const LOOKED_AT: usize = 400;
const MOST_CELLS: usize = 24;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Row {
    Blank,
    /// Names of columns, units, a title.
    Heading,
    /// `DRILL 0.0320 COUNT 36`: the diameter of the following holes.
    Group(Decimal, Option<u32>),
    /// X, Y, optional diameter.
    Hole(Decimal, Decimal, Option<Decimal>),
    Other,
}

type Order = (usize, usize, Option<usize>);

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Columns {
    /// Numbers have decimal commas.
    comma: bool,
    /// None: X, Y, diameter in the order of the cells.
    order: Option<Order>,
    /// A line names the columns; lines before the first hole are titles.
    pub(super) headed: bool,
    /// The diameter can be the first or the last column.
    pub(super) unsure: bool,
}

struct Cell {
    text: Vec<u8>,
    number: Option<Decimal>,
}

impl Columns {
    pub(super) fn of(text: &[u8]) -> Self {
        let comma = decimal_comma(text);
        let headed = lines(text).take(LOOKED_AT).find_map(|line| heading_order(&cells(line.text, comma)));
        let (shaped, unsure) =
            order_by_shape(text, comma).map_or((None, false), |(order, unsure)| (Some(order), unsure));
        let order = headed.or(shaped);
        Self { comma, order, headed: headed.is_some(), unsure: unsure && headed.is_none() }
    }

    pub(super) fn row(&self, line: &[u8]) -> Row {
        let line = line.trim_ascii();
        if line.is_empty() {
            return Row::Blank;
        }
        if line.first().is_some_and(|byte| b";#!/".contains(byte)) {
            return Row::Heading;
        }
        let cells = cells(line, self.comma);
        let numbers: Vec<Decimal> = cells.iter().filter_map(|cell| cell.number).collect();
        if let Some((x, y, size)) = self.order {
            let number = |at: usize| cells.get(at).and_then(|cell| cell.number);
            if let (Some(x), Some(y)) = (number(x), number(y)) {
                return Row::Hole(x, y, size.and_then(number));
            }
        } else if let (true, [x, y, rest @ ..]) = (numbers.len() == cells.len(), numbers.as_slice())
            && rest.len() <= 1
        {
            return Row::Hole(*x, *y, rest.first().copied());
        }
        let grouping = ["DRILL", "DIA", "SIZE", "TOOL", "HOLE"].iter().any(|word| starts(line, word));
        match (grouping, numbers.first()) {
            (true, Some(&size)) => {
                let count = numbers.get(1).and_then(|count| u32::try_from(count.mantissa).ok());
                Row::Group(size, count.filter(|_| holds(line, "COUNT") || holds(line, "QTY")))
            }
            _ if is_heading(line) || heading_order(&cells).is_some() => Row::Heading,
            _ => Row::Other,
        }
    }
}

pub(super) fn names_columns(line: &[u8]) -> bool {
    heading_order(&cells(line, false)).is_some()
}

const PLACEMENT: [&str; 19] = [
    "net",
    "testpoint",
    "designator",
    "refdes",
    "ref",
    "reference",
    "footprint",
    "package",
    "rotation",
    "rot",
    "val",
    "value",
    "side",
    "layer",
    "midx",
    "midy",
    "posx",
    "posy",
    "device",
];
/// Headings of a parts list, which has no positions.
const PARTS_LIST: [&str; 21] = [
    "designator",
    "designators",
    "refdes",
    "ref",
    "refs",
    "reference",
    "references",
    "value",
    "val",
    "qty",
    "quantity",
    "count",
    "footprint",
    "package",
    "mpn",
    "partnumber",
    "manufacturer",
    "description",
    "comment",
    "lcsc",
    "part",
];
/// Headings that mean a placement list only if there are positions but no sizes.
const WEAK: [&str; 12] = [
    "net",
    "testpoint",
    "id",
    "name",
    "part",
    "partid",
    "component",
    "angle",
    "winkel",
    "bauteil",
    "mirror",
    "symbol",
];

pub(super) fn is_placement(text: &[u8]) -> bool {
    lines(text).take(40).any(|line| {
        let cells = cells(line.text, false);
        let names: Vec<String> = cells.iter().map(|cell| letters(&cell.text)).collect();
        let known =
            |words: &[&str]| words.iter().filter(|word| names.iter().any(|name| name == *word)).count();
        let places = heading_order(&cells).is_some_and(|(_, _, size)| size.is_none());
        let parts = known(&PLACEMENT);
        let is_bom = heading_order(&cells).is_none() && known(&PARTS_LIST) >= 2;
        is_bom || parts >= 3 || places && parts + known(&WEAK) >= 2
    })
}

fn letters(text: &[u8]) -> String {
    text.iter()
        .filter(|byte| byte.is_ascii_alphabetic())
        .map(|byte| char::from(byte.to_ascii_lowercase()))
        .collect()
}

/// True if the numbers have commas but no points, and semicolons, tabs or spaces between them. Only lines
/// with at least two numbers count, so titles and headings have no influence.
fn decimal_comma(text: &[u8]) -> bool {
    let (mut commas, mut points) = (false, false);
    for line in lines(text).take(LOOKED_AT).map(|line| line.text.trim_ascii()) {
        let marked = line.iter().any(|byte| b";\t".contains(byte));
        let parts = |byte: &u8| if marked { b";\t".contains(byte) } else { byte.is_ascii_whitespace() };
        let cells = || line.split(parts).map(<[u8]>::trim_ascii).filter(|cell| !cell.is_empty());
        let numbers = || cells().filter(|cell| is_numeral(cell));
        if numbers().count() < 2 || !marked && numbers().count() < cells().count() {
            continue;
        }
        commas |= numbers().any(|cell| cell.contains(&b','));
        points |= numbers().any(|cell| cell.contains(&b'.'));
    }
    commas && !points
}

/// True if the cell is one number with at most one comma or point, optionally quoted.
fn is_numeral(cell: &[u8]) -> bool {
    let cell = cell.strip_prefix(b"\"").and_then(|cell| cell.strip_suffix(b"\"")).unwrap_or(cell);
    let digits = cell.strip_prefix(b"-").or_else(|| cell.strip_prefix(b"+")).unwrap_or(cell);
    let marks = digits.iter().filter(|byte| b",.".contains(byte)).count();
    let ends =
        digits.first().zip(digits.last()).is_some_and(|(a, b)| a.is_ascii_digit() && b.is_ascii_digit());
    ends && marks <= 1 && digits.iter().all(|byte| byte.is_ascii_digit() || b",.".contains(byte))
}

fn cells(line: &[u8], comma: bool) -> Vec<Cell> {
    let mut texts: Vec<(Vec<u8>, bool)> = Vec::new();
    let (mut quoted, mut open) = (false, false);
    // Spaces separate cells only if nothing else does; commas only without semicolons and tabs.
    let strong = line.trim_ascii().iter().any(|byte| b";\t".contains(byte));
    let commas = !comma && !strong;
    let marked = strong || commas && line.contains(&b',');
    for &byte in line.trim_ascii() {
        let parts = !quoted
            && (byte == b';'
                || byte == b'\t'
                || byte == b',' && commas
                || !marked && byte.is_ascii_whitespace());
        if byte == b'"' {
            quoted = !quoted;
            if !open {
                texts.push((Vec::new(), true));
                open = true;
            }
        } else if parts {
            // Adjacent separators enclose an empty cell, adjacent spaces don't.
            if !open && (byte == b'\t' || !byte.is_ascii_whitespace()) {
                texts.push((Vec::new(), false));
            }
            open = false;
        } else {
            if !open {
                texts.push((Vec::new(), quoted));
                open = true;
            }
            if let Some((text, _)) = texts.last_mut() {
                text.push(byte);
            }
        }
    }
    let cell = |(text, quoted): (Vec<u8>, bool)| {
        let plain = text.trim_ascii().to_vec();
        let points = |text: &[u8]| -> Vec<u8> {
            text.iter().map(|&byte| if (comma || quoted) && byte == b',' { b'.' } else { byte }).collect()
        };
        let number = points(&plain);
        let unit = |used: usize| number.get(used..).unwrap_or_default().trim_ascii().to_ascii_lowercase();
        let known = |used: usize| [&b""[..], b"mm", b"in", b"inch", b"mil", b"mils"].contains(&&*unit(used));
        let number = decimal(&number).filter(|(_, used)| known(*used)).map(|(number, _)| number);
        Cell { text: plain, number }
    };
    texts.into_iter().take(MOST_CELLS).map(cell).collect()
}

fn heading_order(cells: &[Cell]) -> Option<Order> {
    if cells.iter().any(|cell| cell.number.is_some()) {
        return None;
    }
    let name = |cell: &Cell| {
        let text = cell.text.split(|byte| b"([".contains(byte)).next().unwrap_or_default();
        let name = letters(text);
        let units = ["mm", "inch", "in", "mil"].iter();
        let bare = units.filter_map(|unit| name.strip_suffix(unit)).find(|rest| !rest.is_empty());
        bare.unwrap_or(&name).to_owned()
    };
    let names: Vec<String> = cells.iter().map(name).collect();
    let find = |words: &[&str]| names.iter().position(|name| words.contains(&name.as_str()));
    let x = find(&["x", "xpos", "posx", "xcoord", "xcoordinate", "centerx", "xcenter", "xposition"])?;
    let y = find(&["y", "ypos", "posy", "ycoord", "ycoordinate", "centery", "ycenter", "yposition"])?;
    let size = find(&[
        "d",
        "dia",
        "diam",
        "diameter",
        "drill",
        "drillsize",
        "size",
        "holesize",
        "hole",
        "holediameter",
        "drilldiameter",
        "bohrung",
        "durchmesser",
        "bit",
    ]);
    Some((x, y, size))
}

/// The columns of unnamed lines with three or four numbers, and whether the result is uncertain.
fn order_by_shape(text: &[u8], comma: bool) -> Option<(Order, bool)> {
    let rows: Vec<Vec<Decimal>> = lines(text)
        .take(LOOKED_AT)
        .filter_map(|line| {
            let cells = cells(line.text, comma);
            let numbers: Vec<Decimal> = cells.iter().filter_map(|cell| cell.number).collect();
            (numbers.len() == cells.len() && numbers.len() >= 3).then_some(numbers)
        })
        .collect();
    let width = rows.iter().map(Vec::len).min()?;
    if rows.len() < 3 && width < 4 {
        return None;
    }
    // With four columns, the first can be a counter with gaps, because a hole has only three numbers.
    let counts = rows.windows(2).all(|pair| match pair {
        [a, b] => {
            let whole =
                |row: &[Decimal]| row.first().filter(|number| !number.point).map(|number| number.mantissa);
            whole(a).zip(whole(b)).is_some_and(|(a, b)| b == a + 1 || width > 3 && b > a)
        }
        _ => false,
    });
    let from = usize::from(counts);
    let column = |at: usize| rows.iter().filter_map(move |row| row.get(at).copied());
    let sizes = |at: usize| {
        let all: Vec<Decimal> = column(at).collect();
        let positive = all.iter().all(|size| size.mantissa > 0);
        positive && units_by_sizes(&all).is_some()
    };
    let repeats = |at: usize| {
        let mut different: Vec<_> = column(at).map(|size| (size.mantissa, size.decimals)).collect();
        let all = different.len();
        different.sort_unstable();
        different.dedup();
        different.len() < all
    };
    let first = sizes(from) && repeats(from);
    match width - from {
        // Positions can look like a counter by chance: then the size is last.
        2 if counts && sizes(2) && repeats(2) => Some(((0, 1, Some(2)), true)),
        2 if counts => Some(((1, 2, None), true)),
        3 if first && !sizes(from + 2) => Some(((from + 1, from + 2, Some(from)), true)),
        3 => Some(((from, from + 1, Some(from + 2)), first && !repeats(from + 2))),
        _ => None,
    }
}

fn is_heading(line: &[u8]) -> bool {
    let words = ["DRILL", "UNIT", "HOLE", "END", "METRIC", "INCH", "MM", "LIST", "BOARD"];
    words.iter().any(|word| starts(line, word))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows of a list as `x,y,d`, in the list's units.
    fn shown(text: &str) -> String {
        let columns = Columns::of(text.as_bytes());
        let ten = |decimals: u8| (0..decimals).fold(1.0, |ten, _| ten * 10.0);
        let number = |n: Decimal| (n.mantissa as f64 / ten(n.decimals)).to_string();
        let rows = lines(text.as_bytes()).filter_map(|line| match columns.row(line.text) {
            Row::Hole(x, y, size) => {
                Some(format!("{},{},{}", number(x), number(y), size.map_or("-".to_owned(), number)))
            }
            Row::Other => Some("?".to_owned()),
            _ => None,
        });
        rows.collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn columns_are_recognised_by_heading_or_shape() {
        let want = "-5.08,0,0.8 2.54,1.27,0.8 7.62,3.5,0.8";
        for text in [
            "-5.08 0 0.8\n2.54 1.27 0.8\n7.62 3.5 0.8\n",
            "-5,08\t0\t0,8\n2,54\t1,27\t0,8\n7,62\t3,5\t0,8\n",
            "-5,08;0;0,8\n2,54;1,27;0,8\n7,62;3,5;0,8\n",
            "X,Y,D\n-5.08,0,0.8\n2.54,1.27,0.8\n7.62,3.5,0.8\n",
            "\"X\",\"Y\",\"Dia\"\n\"-5.08\",\"0\",\"0.8\"\n\"2.54\",\"1.27\",\"0.8\"\n\"7.62\",\"3.5\",\"0.8\"\n",
            "\"-5,08\",\"0,00\",\"0,8\"\n\"2,54\",\"1,27\",\"0,8\"\n\"7,62\",\"3,5\",\"0,8\"\n",
            "No;X;Y;D\n1;-5,08;0;0,8\n2;2,54;1,27;0,8\n3;7,62;3,5;0,8\n",
            "1 -5.08 0 0.8\n2 2.54 1.27 0.8\n3 7.62 3.5 0.8\n",
            "0.8 -5.08 0\n0.8 2.54 1.27\n0.8 7.62 3.5\n",
            "1,0.8,-5.08,0\n2,0.8,2.54,1.27\n3,0.8,7.62,3.5\n",
            "Diameter (mm);Type;X (mm);Y (mm)\n0.8;PTH;-5.08;0\n0.8;PTH;2.54;1.27\n0.8;;7.62;3.5\n",
        ] {
            assert_eq!(shown(text), want, "{text}");
        }
        assert_eq!(shown("1;5.08;0\n2;2.54;1\n3;1.27;7\n"), "5.08,0,- 2.54,1,- 1.27,7,-");
        assert_eq!(shown("5.08 0\n2.54 1\n"), "5.08,0,- 2.54,1,-");
    }

    #[test]
    fn component_lists_are_recognised() {
        for (text, want) in [
            ("Ref,Val,Package,PosX,PosY,Rot,Side\nR1,10k,0805,1.0,2.0,90,top\n", true),
            ("\"Designator\",\"Footprint\",\"Mid X\",\"Mid Y\",\"Layer\",\"Rotation\"\n", true),
            (
                "# Ref     Val       Package    PosX       PosY       Rot  Side\nC1 100n C_0805 10.0 20.0 0.0 top\n",
                true,
            ),
            ("X;Y;D\n1;2;0.8\n", false),
        ] {
            assert_eq!(is_placement(text.as_bytes()), want, "{text}");
        }
    }
}
