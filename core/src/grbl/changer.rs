//! The tool change macro: the lines that change a tool without the user.

use crate::diagnostic::Diagnostic;
use crate::error;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Key in the controller's settings for the tool change macro; absent if the user changes tools.
pub const CHANGER_KEY: &str = "controller.changer";
pub const TOOL_MARK: &str = "{tool}";
const MOST_LINES: usize = 32;
const LONGEST: usize = 70;
/// Largest tool number.
const MOST_TOOLS: &str = "999";
/// Characters that a controller acts on at once, anywhere in a line.
const AT_ONCE: &[char] = &['!', '?', '~'];
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToolMacro(Vec<String>);

impl ToolMacro {
    /// Drops empty lines; refuses lines that can't be sent.
    pub fn of_lines<'a>(lines: impl IntoIterator<Item = &'a str>) -> Result<Self, Diagnostic> {
        let lines: Vec<String> =
            lines.into_iter().map(|line| line.trim().to_owned()).filter(|line| !line.is_empty()).collect();
        if lines.len() > MOST_LINES {
            return Err(error!("changer.too_many", count = lines.len()));
        }
        let is_bad = |line: &&String| {
            let full = line.replace(TOOL_MARK, MOST_TOOLS);
            let is_sign = |sign: char| (' '..='~').contains(&sign) && !AT_ONCE.contains(&sign);
            full.len() > LONGEST
                || full.starts_with('$')
                || !full.chars().all(is_sign)
                || full.contains(['{', '}'])
        };
        match lines.iter().find(is_bad) {
            Some(line) => Err(Self::bad(line)),
            None => Ok(Self(lines)),
        }
    }

    pub fn bad(text: impl ToString) -> Diagnostic {
        error!("changer.bad_line", text = text.to_string(), mark = TOOL_MARK)
    }

    pub fn lines(&self) -> &[String] {
        &self.0
    }

    /// True if there are no lines: the user changes tools.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn asks_number(&self) -> bool {
        self.0.iter().any(|line| line.contains(TOOL_MARK))
    }

    /// True if a T word passes the number to the controller, which then reports it in `$G`.
    pub(super) fn says_tool(&self) -> bool {
        let word = format!("T{TOOL_MARK}");
        self.0
            .iter()
            .any(|line| line.to_ascii_uppercase().replace(' ', "").contains(&word.to_ascii_uppercase()))
    }

    pub(super) fn of_tool(&self, number: Option<u32>) -> VecDeque<String> {
        let number = number.map(|number| number.to_string()).unwrap_or_default();
        self.0.iter().map(|line| line.replace(TOOL_MARK, &number)).collect()
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Changer {
    pub lines: ToolMacro,
    /// Number of each of the routine's tools; `None` if the user gave none.
    pub numbers: Vec<Option<u32>>,
}

impl Changer {
    pub(super) fn number(&self, tool: u32) -> Option<u32> {
        self.numbers.get(tool as usize).copied().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unsendable_lines_are_no_macro() {
        let made = |text: &str| ToolMacro::of_lines(text.lines()).map_err(|why| why.code);
        let good = made("M6 T{tool}\n\n  G53 G0 Z-1 (up)  ").unwrap();
        assert_eq!(good.lines(), ["M6 T{tool}", "G53 G0 Z-1 (up)"]);
        assert_eq!(good.of_tool(Some(12)), ["M6 T12", "G53 G0 Z-1 (up)"]);
        assert!(good.asks_number() && made("").unwrap().is_empty());
        let long = format!("({})", "x".repeat(69));
        for bad in ["$H", "$20=0", "G0 X1 !", "G0 ~", "?", "M6 T{number}", "G0 X1\u{18}", "G0 Xä", &long] {
            assert_eq!(made(bad), Err("changer.bad_line".to_owned()), "{bad}");
        }
        assert_eq!(made(&"M5\n".repeat(32)).map(|lines| lines.lines().len()), Ok(32));
        assert_eq!(made(&"M5\n".repeat(33)), Err("changer.too_many".to_owned()));
    }
}
