//! A line of G-code as words: letters with numbers, and the few that are more than a letter.

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Word {
    Letter(char, f64),
    /// `CR=5`: a name and its number.
    Named(String, f64),
    /// `CYCLE82(2,0,0.5,-2,,0.1)`: a name and its numbers, `None` if one is omitted.
    Call(String, Vec<Option<f64>>),
}

/// The line without comments, block number and leading slash, in capitals.
pub(super) fn bare(line: &str) -> String {
    bare_with(line, true)
}

/// As [`bare`]; `messages`: text after M0, M1 and M117 is a message. No controller with rules of its own has
/// such messages.
pub(super) fn bare_with(line: &str, messages: bool) -> String {
    let (text, _) = split(line, messages);
    let text = text.trim().trim_start_matches('/').trim_start();
    let numbered = text.starts_with('N')
        && text.get(1..2).is_some_and(|next| next.starts_with(|c: char| c.is_ascii_digit()));
    if !numbered {
        return text.to_owned();
    }
    text.get(1..).unwrap_or_default().trim_start_matches(|c: char| c.is_ascii_digit()).trim_start().to_owned()
}

/// The number of a line that begins with one: N10.
pub(super) fn line_number(line: &str) -> Option<f64> {
    let (text, _) = split(line, true);
    let rest = text.trim().trim_start_matches('/').trim_start().strip_prefix('N')?;
    let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    rest.get(..digits)?.parse().ok()
}

/// The first character that LinuxCNC refuses in a line: an unclosed or nested bracket comment, or a space
/// other than blank and tab.
pub(super) fn foreign_to_linuxcnc(line: &str) -> Option<char> {
    let mut is_comment = false;
    for letter in line.chars() {
        match letter {
            ';' if !is_comment => return None,
            '(' if is_comment => return Some('('),
            '(' => is_comment = true,
            ')' => is_comment = false,
            ' ' | '\t' | '\r' => {}
            space if space.is_whitespace() && !is_comment => return Some(space),
            _ => {}
        }
    }
    is_comment.then_some('(')
}

pub(super) fn comments(line: &str) -> Vec<String> {
    split(line, true).1
}

/// A line in capitals without its comments, and these as written.
fn split(line: &str, messages: bool) -> (String, Vec<String>) {
    let (mut text, mut comments) = (String::new(), Vec::new());
    let mut rest = line;
    // Messages are for people: Sinumerik's in quotes, Marlin's after M0 or M117.
    let upper = line.to_ascii_uppercase();
    let spoken = upper.trim_start();
    if messages && ["M0 ", "M1 ", "M117 "].iter().any(|word| spoken.starts_with(word)) {
        let at = line.len() - spoken.len();
        let word = spoken.find(' ').unwrap_or(spoken.len());
        let said = line.get(at + word..).unwrap_or_default();
        // M0 X40 is a stop and a move. M117 X40 is a message to Marlin, but a move for others: it is followed.
        if of(&bare_with(said, false)).is_err() {
            return (spoken.chars().take_while(|c| *c != ' ').collect(), vec![said.trim().to_owned()]);
        }
    }
    while let Some(at) = rest.find(['(', ';']) {
        let (before, comment) = rest.split_at(at);
        text.push_str(before);
        if comment.starts_with(';') {
            comments.push(comment.get(1..).unwrap_or_default().trim().to_owned());
            rest = "";
            break;
        }
        let end = comment.find(')').map_or(comment.len(), |end| end + 1);
        let whole = comment.get(..end).unwrap_or_default();
        // Brackets after a name belong to a call; after a number they are a comment.
        let name = before.rsplit(|c: char| !c.is_ascii_alphanumeric()).next().unwrap_or_default();
        if name.chars().take_while(char::is_ascii_alphabetic).count() > 1 {
            if whole.contains('"') {
                comments.push(whole.trim_matches(['(', ')', '"']).to_owned());
                text.push_str("()");
            } else {
                text.push_str(whole);
            }
        } else {
            comments.push(whole.trim_matches(['(', ')']).trim().to_owned());
        }
        rest = comment.get(end..).unwrap_or_default();
    }
    text.push_str(rest);
    (text.to_ascii_uppercase(), comments)
}

/// The words of a bare line, or the column of the first letter that starts no word.
pub(super) fn of(line: &str) -> Result<Vec<Word>, usize> {
    let mut words = Vec::new();
    let mut rest = line;
    loop {
        rest = rest.trim_start();
        let column = line.len() - rest.len() + 1;
        let letters = rest.chars().take_while(char::is_ascii_alphabetic).count();
        if rest.is_empty() {
            return Ok(words);
        }
        let mut name_end = letters;
        if letters > 1 {
            name_end += rest.chars().skip(letters).take_while(char::is_ascii_digit).count();
        }
        let (name, behind) =
            (rest.get(..name_end).unwrap_or_default(), rest.get(name_end..).unwrap_or_default());
        if letters == 0 {
            return Err(column);
        }
        if behind.starts_with('(') {
            let end = behind.find(')').ok_or(column)?;
            let inner = behind.get(1..end).unwrap_or_default();
            let given = |one: &str| match one.trim() {
                "" => Ok(None),
                number => number.parse().map(Some).map_err(|_| column),
            };
            let numbers = inner.split(',').map(given).collect::<Result<_, _>>()?;
            words.push(Word::Call(name.to_owned(), numbers));
            rest = behind.get(end + 1..).unwrap_or_default();
            continue;
        }
        if let Some(value) = behind.trim_start().strip_prefix('=') {
            let (number, after) = number(value).ok_or(column)?;
            words.push(Word::Named(name.to_owned(), number));
            rest = after;
            continue;
        }
        // Sinumerik's word for machine coordinates, regardless of other modes.
        if name == "SUPA" {
            words.push(Word::Letter('G', 53.0));
            rest = behind;
            continue;
        }
        // Letters run together with no number between are no words of G-code.
        if letters > 1 {
            return Err(column);
        }
        let (number, after) = number(rest.get(1..).unwrap_or_default()).ok_or(column)?;
        words.push(Word::Letter(name.chars().next().unwrap_or(' '), number));
        rest = after;
    }
}

pub(super) fn number(text: &str) -> Option<(f64, &str)> {
    let text = text.trim_start();
    let sign = usize::from(text.starts_with(['+', '-']));
    let body = text.get(sign..)?.chars().take_while(|c| c.is_ascii_digit() || *c == '.').count();
    let (number, rest) = text.split_at_checked(sign + body)?;
    Some((number.parse().ok()?, rest))
}
