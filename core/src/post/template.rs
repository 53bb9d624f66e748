//! The template language: text with `@NAME@` for numbers.
//!
//! ```text
//!   G0 X@X@ Y@Y+10@       the parameter, with numbers added, subtracted, multiplied, divided, left to right
//!   F@F/60:3@             with three decimals
//!   @?W@G4 P@W@           this line only if W is not 0
//!   @>P[@K+1@]{ … }       this line is moved to the end part of the file, for lists of points
//!   @<                    (in the last block) position of the end part
//!   a@@b                  a literal @
//! ```

const MOST_OPERATIONS: usize = 8;
const LARGEST_NUMBER: f64 = 1e9;

#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Template {
    pub(crate) lines: Vec<Line>,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Line {
    pub(crate) to: Goes,
    /// Write only if this parameter is not 0.
    pub(crate) only_if: Option<String>,
    pub(crate) pieces: Vec<Piece>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Goes {
    #[default]
    Here,
    /// The end part.
    End,
    PutsEnd,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Piece {
    Text(String),
    Field(Field),
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Field {
    pub(crate) name: String,
    operations: Vec<(char, f64)>,
    /// Decimals, if given.
    pub(crate) decimals: Option<u32>,
}

impl Field {
    /// Applies the operations to the parameter's `value`, in millionths.
    pub(crate) fn reckon(&self, value: i64) -> i64 {
        if self.operations.is_empty() {
            return value;
        }
        let result =
            self.operations.iter().fold(value as f64 / 1e6, |sum, &(operator, number)| match operator {
                '+' => sum + number,
                '-' => sum - number,
                '*' => sum * number,
                _ => sum / number,
            });
        libm::round(result * 1e6) as i64
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    Unknown(String),
    /// An `@` without its partner on the line.
    Unclosed,
    /// The text after the name is no valid arithmetic.
    Arithmetic(String),
}

/// Kind of a name in a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Known {
    No,
    Number,
    /// Text: arithmetic is not possible.
    Word,
}

impl Template {
    /// Parses `text`; `known` gives the kind of a name. Returns all faults with their byte offsets.
    pub(crate) fn parse(text: &str, known: impl Fn(&str) -> Known) -> (Self, Vec<(Fault, usize)>) {
        let mut faults = Vec::new();
        let mut lines = Vec::new();
        let mut at = 0;
        for raw in text.split_inclusive('\n') {
            let body = raw.trim_end_matches('\n').trim_end_matches('\r');
            lines.push(line(body, at, &known, &mut faults));
            at += raw.len();
        }
        (Self { lines }, faults)
    }

    /// All parameters used, in order.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.lines.iter().flat_map(|line| {
            let fields = line.pieces.iter().filter_map(|piece| match piece {
                Piece::Field(field) => Some(field.name.as_str()),
                Piece::Text(_) => None,
            });
            line.only_if.as_deref().into_iter().chain(fields)
        })
    }

    /// True if its literal text has `word`.
    pub(super) fn says(&self, word: &str) -> bool {
        let mut pieces = self.lines.iter().flat_map(|line| &line.pieces);
        pieces.any(|piece| matches!(piece, Piece::Text(text) if text.contains(word)))
    }
}

fn line(body: &str, start: usize, known: &impl Fn(&str) -> Known, faults: &mut Vec<(Fault, usize)>) -> Line {
    let mut out = Line::default();
    if body.trim() == "@<" {
        out.to = Goes::PutsEnd;
        return out;
    }
    let mut at = 0;
    if body.starts_with("@>") {
        (out.to, at) = (Goes::End, 2);
    }
    if let Some(rest) = body.get(at..).and_then(|rest| rest.strip_prefix("@?")) {
        match rest.split_once('@') {
            Some((name, _)) => {
                if known(name) != Known::Number {
                    faults.push((Fault::Unknown(name.to_owned()), start + at));
                }
                out.only_if = Some(name.to_owned());
                at += name.len() + 3;
            }
            None => {
                faults.push((Fault::Unclosed, start + at));
                return out;
            }
        }
    }
    while let Some(rest) = body.get(at..) {
        let Some((before, behind)) = rest.split_once('@') else {
            out.text(rest);
            break;
        };
        out.text(before);
        let open = at + before.len();
        let Some((inside, _)) = behind.split_once('@') else {
            faults.push((Fault::Unclosed, start + open));
            break;
        };
        if inside.is_empty() {
            out.text("@");
        } else {
            match field(inside, known) {
                Ok(field) => out.pieces.push(Piece::Field(field)),
                Err(fault) => faults.push((fault, start + open)),
            }
        }
        at = open + inside.len() + 2;
    }
    out
}

impl Line {
    fn text(&mut self, text: &str) {
        if let Some(Piece::Text(last)) = self.pieces.last_mut() {
            last.push_str(text);
        } else if !text.is_empty() {
            self.pieces.push(Piece::Text(text.to_owned()));
        }
    }
}

/// Parses the text between two `@`.
fn field(inside: &str, known: &impl Fn(&str) -> Known) -> Result<Field, Fault> {
    let end = inside.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(inside.len());
    let (name, rest) = inside.split_at(end);
    let kind = known(name);
    if kind == Known::No {
        return Err(Fault::Unknown(if name.is_empty() { inside.to_owned() } else { name.to_owned() }));
    }
    let wrong = || Fault::Arithmetic(inside.to_owned());
    let (mut rest, digits) = match rest.split_once(':') {
        Some((rest, digits)) => (rest, Some(digits.trim())),
        None => (rest, None),
    };
    let decimals = match digits {
        Some(digits) => Some(digits.parse().ok().filter(|&count: &u32| count <= 6).ok_or_else(wrong)?),
        None => None,
    };
    let mut operations = Vec::new();
    while let Some(operator) = rest.trim_start().chars().next() {
        let behind = rest.trim_start().get(1..).unwrap_or_default().trim_start();
        let signed = usize::from(behind.starts_with(['-', '+']));
        let number = |c: char| c.is_ascii_digit() || c == '.';
        let digits = behind.get(signed..).unwrap_or_default();
        let end = signed + digits.find(|c| !number(c)).unwrap_or(digits.len());
        let (text, left) = behind.split_at(end);
        let value: f64 = text.parse().map_err(|_| wrong())?;
        let sound = value.abs() <= LARGEST_NUMBER && (operator != '/' || value != 0.0);
        if !"+-*/".contains(operator) || !sound || operations.len() >= MOST_OPERATIONS {
            return Err(wrong());
        }
        operations.push((operator, value));
        rest = left;
    }
    if kind == Known::Word && (!operations.is_empty() || decimals.is_some()) {
        return Err(wrong());
    }
    Ok(Field { name: name.to_owned(), operations, decimals })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(name: &str) -> Known {
        match name {
            "X" | "AX" | "W" => Known::Number,
            "JOB" => Known::Word,
            _ => Known::No,
        }
    }

    fn filled(template: &Template, value: i64) -> String {
        let line = |line: &Line| {
            let piece = |piece: &Piece| match piece {
                Piece::Text(text) => text.clone(),
                Piece::Field(field) => format!("<{} {}>", field.name, field.reckon(value)),
            };
            let before = if line.to == Goes::End { ">" } else { "" };
            before.to_owned() + &line.pieces.iter().map(piece).collect::<String>() + "\n"
        };
        template.lines.iter().map(line).collect()
    }

    #[test]
    fn templates_are_filled_with_arithmetic() {
        let rows = [
            ("G0 X@X@ Y@AX@\n", "G0 X<X 2000000> Y<AX 2000000>\n"),
            ("", ""),
            ("@X@@AX@", "<X 2000000><AX 2000000>\n"),
            ("a@@b\n\nc", "a@b\n\nc\n"),
            ("@X+10@", "<X 12000000>\n"),
            ("@X-0.5*4@", "<X 6000000>\n"),
            ("@X * -1@ @X/8@ @X*1000:0@", "<X -2000000> <X 250000> <X 2000000000>\n"),
            ("@>P@X@", ">P<X 2000000>\n"),
            ("@?W@G4 P@W@", "G4 P<W 2000000>\n"),
            ("@JOB@ ü", "<JOB 2000000> ü\n"),
        ];
        for (text, expected) in rows {
            let (template, faults) = Template::parse(text, known);
            assert_eq!((filled(&template, 2_000_000), faults), (expected.to_owned(), vec![]), "{text:?}");
        }
    }

    #[test]
    fn every_fault_has_its_position() {
        let wrong = |text: &str| Fault::Arithmetic(text.to_owned());
        let missing = |text: &str| Fault::Unknown(text.to_owned());
        let rows = [
            ("G0 @Q@", vec![(missing("Q"), 3)]),
            ("@X@ @x@ @Y+1@", vec![(missing("x"), 4), (missing("Y"), 8)]),
            ("ab @X", vec![(Fault::Unclosed, 3)]),
            ("@X\n@", vec![(Fault::Unclosed, 0), (Fault::Unclosed, 3)]),
            (
                "@X+@ @X/0@ @X%2@ @X:7@",
                vec![(wrong("X+"), 0), (wrong("X/0"), 5), (wrong("X%2"), 11), (wrong("X:7"), 17)],
            ),
            ("@JOB+1@", vec![(wrong("JOB+1"), 0)]),
            ("@X+1e9@", vec![(wrong("X+1e9"), 0)]),
            ("@?Q@a", vec![(missing("Q"), 0)]),
            ("@?X", vec![(Fault::Unclosed, 0)]),
            ("@ä@", vec![(missing("ä"), 0)]),
            ("@+1@", vec![(missing("+1"), 0)]),
        ];
        for (text, expected) in rows {
            assert_eq!(Template::parse(text, known).1, expected, "{text:?}");
        }
    }
}
