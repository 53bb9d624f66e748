//! Sorts the words of a line by purpose.

use super::words::Word;
use crate::artwork::number::Decimal;
use crate::code;

/// Larger numbers are not tool numbers.
const HIGHEST_TOOL: i64 = 99_999;

/// Two coordinates; each can be missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Pair {
    pub(super) x: Option<Decimal>,
    pub(super) y: Option<Decimal>,
}

impl Pair {
    pub(super) const fn any(&self) -> bool {
        self.x.is_some() || self.y.is_some()
    }

    /// Sets a coordinate; false if it is already set.
    fn put(&mut self, letter: u8, number: Decimal) -> bool {
        let axis = if matches!(letter, b'X' | b'I') { &mut self.x } else { &mut self.y };
        axis.replace(number).is_none()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ToolWord {
    pub(super) code: u32,
    pub(super) digits: u8,
    /// The tool's size. None without a `C`; `Some(None)` for a `C` without a number.
    pub(super) size: Option<Option<Decimal>>,
    pub(super) column: u32,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Block {
    pub(super) tool: Option<ToolWord>,
    pub(super) gs: Vec<(u16, u32)>,
    pub(super) ms: Vec<(u16, u32)>,
    /// X and Y, before a G85 if there is one.
    pub(super) to: Pair,
    /// X and Y after a G85.
    pub(super) slot_to: Option<Pair>,
    pub(super) centre: Pair,
    pub(super) radius: Option<Decimal>,
    pub(super) repeat: Option<Decimal>,
    /// Feeds, speeds and counts, with their columns.
    pub(super) feeds: Vec<(u8, Decimal, u32)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Fault {
    pub(super) code: &'static str,
    pub(super) column: u32,
}

pub(super) fn sort(words: &[Word]) -> Result<Block, Fault> {
    let mut block = Block::default();
    for word in words {
        let fault = |code| Fault { code, column: word.column };
        let number = || word.number.ok_or(fault(code!("drill.bad_number")));
        match word.letter {
            b'X' | b'Y' => {
                let pair = block.slot_to.as_mut().unwrap_or(&mut block.to);
                if !pair.put(word.letter, number()?) {
                    return Err(fault(code!("drill.word_twice")));
                }
            }
            b'I' | b'J' => {
                block.centre.put(word.letter, number()?);
            }
            b'A' => block.radius = Some(number()?),
            b'R' => block.repeat = Some(number()?),
            b'G' => match code(number()?).ok_or(fault(code!("drill.unknown_word")))? {
                85 => block.slot_to = Some(Pair::default()),
                code => block.gs.push((code, word.column)),
            },
            b'M' => block.ms.push((code(number()?).ok_or(fault(code!("drill.unknown_word")))?, word.column)),
            b'T' => {
                let number = number()?;
                let sound = !number.point && (0..=HIGHEST_TOOL).contains(&number.mantissa);
                if !sound || block.tool.is_some() {
                    return Err(fault(code!("drill.tool_number")));
                }
                let (code, digits) = (number.mantissa as u32, number.digits);
                block.tool = Some(ToolWord { code, digits, size: None, column: word.column });
            }
            b'C' => match &mut block.tool {
                Some(tool) => tool.size = Some(word.number),
                None => return Err(fault(code!("drill.unknown_word"))),
            },
            letter @ (b'F' | b'S' | b'H' | b'B' | b'Z' | b'Q') => {
                block.feeds.push((letter, word.number.unwrap_or_default(), word.column));
            }
            _ => return Err(fault(code!("drill.unknown_word"))),
        }
    }
    Ok(block)
}

fn code(number: Decimal) -> Option<u16> {
    if number.point { None } else { u16::try_from(number.mantissa).ok() }
}
