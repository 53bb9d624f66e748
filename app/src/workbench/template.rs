//! The block of a postprocessor template at the cursor, for the hints of that block.
//!
//! ```text
//! [drill]            Some(Drill, none)
//! hole = '''         Some(Drill, Hole)
//! G0 X@X|            Some(Drill, Hole)
//! '''
//! ```

use annulus_core::post::{BLOCKS, Block, TemplateKind};

pub fn place(text: &str, at: usize) -> (Option<TemplateKind>, Option<Block>) {
    let (mut part, mut block, mut inside) = (None, None, false);
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let trimmed = line.trim();
        if inside {
            inside = !trimmed.ends_with("'''") && !trimmed.ends_with("\"\"\"");
            if !inside && start + line.len() > at {
                break;
            }
            if !inside {
                block = None;
            }
        } else if let Some(name) = trimmed.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            part = TemplateKind::ALL.into_iter().find(|part| part.key() == name);
            block = None;
        } else if let (Some(part), Some((key, value))) = (part, trimmed.split_once('=')) {
            let row = BLOCKS.iter().find(|row| row.part == part && row.block.key() == key.trim());
            block = row.map(|row| row.block);
            let value = value.trim();
            inside = ["'''", "\"\"\""]
                .iter()
                .any(|quotes| value.strip_prefix(quotes).is_some_and(|rest| !rest.ends_with(quotes)));
        }
        if start + line.len() > at {
            break;
        }
        start += line.len();
        if !inside {
            block = None;
        }
    }
    (part, block)
}

/// Byte offset of line `line`, counted from 1.
pub fn start_of_line(text: &str, line: u32) -> usize {
    text.split_inclusive('\n').take(line.saturating_sub(1) as usize).map(str::len).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "schema = 1\n[drill]\nstart = '''\nG21\n'''\nhole = '''\nG0 X@X@\n'''\n[engrave]\nline = 'G1 X@X@'\nend = ''\n";

    #[test]
    fn cursor_position_gives_its_template_block() {
        let at = |word: &str| TEXT.find(word).unwrap();
        let rows = [
            (at("schema"), None, None),
            (at("[drill]"), Some(TemplateKind::Drill), None),
            (at("G21"), Some(TemplateKind::Drill), Some(Block::Start)),
            (at("G0"), Some(TemplateKind::Drill), Some(Block::Hole)),
            (at("[engrave]"), Some(TemplateKind::Engrave), None),
            (at("G1 "), Some(TemplateKind::Engrave), Some(Block::Line)),
        ];
        for (place_at, part, block) in rows {
            assert_eq!(place(TEXT, place_at), (part, block), "at {place_at}");
        }
        assert_eq!(place("", 5), (None, None));
    }

    #[test]
    fn template_line_starts_are_byte_offsets() {
        assert_eq!(start_of_line(TEXT, 1), 0);
        assert_eq!(start_of_line(TEXT, 2), TEXT.find("[drill]").unwrap());
        assert_eq!(start_of_line(TEXT, 999), TEXT.len());
    }
}
