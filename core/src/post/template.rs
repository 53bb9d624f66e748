//! The template language (S8): text with `@NAME@` where a number goes.
//!
//! ```text
//!   G0 X@X@ Y@Y+10@       the parameter, with numbers added, taken off, multiplied, divided, from left to right
//!   F@F/60:3@             with three digits after the point
//!   @?W@G4 P@W@           this line only where W is not 0
//!   @>P[@K+1@]{ … }       this line goes to the end part of the file: for controllers that list their points there
//!   @<                    (in the last block) here the end part stands
//!   a@@b                  the sign itself
//! ```
//!
//! Comes in: text, then values. Goes out: lines. Does not know which parameters there are.

/// Most operations in one parameter.
const MOST_OPERATIONS: usize = 8;
/// Largest number that can be reckoned with.
const LARGEST_NUMBER: f64 = 1e9;

/// A template, read.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Template {
    pub(crate) lines: Vec<Line>,
}

/// A line of a template.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Line {
    /// Where it goes.
    pub(crate) to: Goes,
    /// Only where this parameter is not 0.
    pub(crate) only_if: Option<String>,
    pub(crate) pieces: Vec<Piece>,
}

/// Where a line goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Goes {
    /// Where it stands.
    #[default]
    Here,
    /// To the end part.
    End,
    /// Here the end part stands.
    PutsEnd,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Piece {
    Text(String),
    Field(Field),
}

/// A parameter with what is reckoned with it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Field {
    pub(crate) name: String,
    operations: Vec<(char, f64)>,
    /// Digits after the point, if said.
    pub(crate) decimals: Option<u32>,
}

impl Field {
    /// The parameter's `value`, in millionths, after the operations.
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

/// What is wrong with a template.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// The block does not have this name.
    Unknown(String),
    /// An `@` without its partner on the same line.
    Unclosed,
    /// What stands behind the name cannot be reckoned.
    Arithmetic(String),
}

/// What a name is in a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Known {
    /// Not there.
    No,
    /// A number.
    Number,
    /// A word: nothing can be reckoned with it.
    Word,
}

impl Template {
    /// Reads `text`; `known` says which names there are. Goes out with every fault and its byte offset.
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

    /// Every parameter that is used, in order.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.lines.iter().flat_map(|line| {
            let fields = line.pieces.iter().filter_map(|piece| match piece {
                Piece::Field(field) => Some(field.name.as_str()),
                Piece::Text(_) => None,
            });
            line.only_if.as_deref().into_iter().chain(fields)
        })
    }

    /// Whether it says `word` in its own text.
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

/// What stands between two `@`.
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
    fn templates_read_and_reckon() {
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
    fn every_fault_is_told_with_its_place() {
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
