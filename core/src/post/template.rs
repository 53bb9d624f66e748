//! The template language (S8): text with `@NAME@` where a number goes, `@@` for the sign itself.
//!
//! ```text
//!   G0 X@X@ Y@Y@      ─ parse ─▶   "G0 X" X " Y" Y      ─ fill ─▶   G0 X1.500 Y2.000
//! ```
//!
//! Comes in: text, then values. Goes out: text. Does not know which parameters there are.

/// A template, read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Template(Vec<Piece>);

#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Text(String),
    Parameter(String),
}

/// What is wrong with a template, and at which byte.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// The table does not have this name.
    Unknown(String),
    /// An `@` without its partner on the same line.
    Unclosed,
}

impl Template {
    /// Reads `text`; `known` says which names there are. The first fault with its byte offset otherwise.
    pub(crate) fn parse(text: &str, known: impl Fn(&str) -> bool) -> Result<Self, (Fault, usize)> {
        let mut pieces = Vec::new();
        let mut at = 0;
        while let Some(found) = text[at..].find('@') {
            let open = at + found;
            pieces.push(Piece::Text(text[at..open].to_owned()));
            let rest = &text[open + 1..];
            let Some(length) = rest.find(['@', '\n']).filter(|&end| rest[end..].starts_with('@')) else {
                return Err((Fault::Unclosed, open));
            };
            let name = &rest[..length];
            pieces.push(match name {
                "" => Piece::Text("@".to_owned()),
                _ if known(name) => Piece::Parameter(name.to_owned()),
                _ => return Err((Fault::Unknown(name.to_owned()), open)),
            });
            at = open + length + 2;
        }
        pieces.push(Piece::Text(text[at..].to_owned()));
        Ok(Self(pieces))
    }

    /// Appends the text with every name replaced by what `value` gives for it.
    pub(crate) fn fill(&self, out: &mut String, mut value: impl FnMut(&str) -> String) {
        for piece in &self.0 {
            match piece {
                Piece::Text(text) => out.push_str(text),
                Piece::Parameter(name) => out.push_str(&value(name)),
            }
        }
    }
}

/// `value` / 10^`scale` with `decimals` digits after the point (at most `scale`), halves away from zero, never `-0`.
/// Without `zeros` at the end when told so, but one digit stays after the point.
pub(crate) fn decimal(value: i64, scale: u32, decimals: u32, zeros: bool) -> String {
    let decimals = decimals.min(scale);
    let unit = 10_i128.pow(scale - decimals);
    let size = (i128::from(value).abs() + unit / 2) / unit;
    let one = 10_i128.pow(decimals);
    let sign = if value < 0 && size != 0 { "-" } else { "" };
    if decimals == 0 {
        return format!("{sign}{size}");
    }
    let text = format!("{sign}{}.{:0width$}", size / one, size % one, width = decimals as usize);
    if zeros {
        return text;
    }
    let short = text.trim_end_matches('0');
    if short.ends_with('.') { format!("{short}0") } else { short.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_read_fill_and_refuse() {
        let known = |name: &str| ["X", "Y"].contains(&name);
        type Row = (&'static str, Result<&'static str, (Fault, usize)>);
        let rows: [Row; 8] = [
            ("G0 X@X@ Y@Y@\n", Ok("G0 X<X> Y<Y>\n")),
            ("", Ok("")),
            ("@X@@Y@", Ok("<X><Y>")),
            ("a@@b", Ok("a@b")),
            ("G0 @Q@", Err((Fault::Unknown("Q".into()), 3))),
            ("@X@ @x@", Err((Fault::Unknown("x".into()), 4))),
            ("ab @X", Err((Fault::Unclosed, 3))),
            ("@X\n@", Err((Fault::Unclosed, 0))),
        ];
        for (text, expected) in rows {
            let got = Template::parse(text, known).map(|template| {
                let mut out = String::new();
                template.fill(&mut out, |name| format!("<{name}>"));
                out
            });
            assert_eq!(got, expected.map(str::to_owned), "{text:?}");
        }
    }

    #[test]
    fn numbers_are_written_as_told() {
        // value in nm, decimals, zeros kept, text
        let rows = [
            (1_500_000, 3, true, "1.500"),
            (1_500_000, 3, false, "1.5"),
            (2_000_000, 3, false, "2.0"),
            (2_000_000, 0, false, "2"),
            (-400, 3, true, "0.000"),
            (-500, 3, true, "-0.001"),
            (499, 3, true, "0.000"),
            (-1_234_567, 6, true, "-1.234567"),
            (-1_234_567, 9, true, "-1.234567"),
            (i64::MIN, 6, true, "-9223372036854.775808"),
        ];
        for (nm, decimals, zeros, text) in rows {
            assert_eq!(decimal(nm, 6, decimals, zeros), text);
        }
    }
}
