//! Comments and attributes: what a layer states about itself and its objects.

use super::Reader;
use super::object::Tag;
use super::words::{At, Block};
use crate::artwork::text::holds;
use crate::code;
use crate::diagnostic::Severity;
use std::collections::BTreeMap;

const LONGEST: usize = 200;
const MOST_ATTRIBUTES: usize = 100;
const MOST_TAGS: usize = 200_000;
const COMMENTS_LOOKED_AT: u32 = 200;

const NAMES: [&[u8]; 7] =
    [b".FileFunction", b".FilePolarity", b".GenerationSoftware", b".AperFunction", b".N", b".C", b".P"];

#[derive(Clone, Debug)]
pub(super) struct Attributes {
    /// The current attributes; the function is that of apertures and contours.
    now: Tag,
    comments: u32,
    tags: BTreeMap<Tag, u32>,
    /// Index of the current tag for flashes and strokes, and for contours; none until the next use.
    index: [Option<u32>; 2],
}

impl Attributes {
    /// Without attributes; the first tag is the empty one.
    pub(super) fn new() -> Self {
        Self {
            now: Tag::default(),
            comments: 0,
            tags: BTreeMap::from([(Tag::default(), 0)]),
            index: [Some(0); 2],
        }
    }

    pub(super) fn aperture_function(&self) -> Option<String> {
        self.now.function.clone()
    }

    /// `.N,GND` after `TO`.
    pub(super) fn of_objects(&mut self, text: &[u8]) {
        let (name, value) = named(text);
        let mut fields = value.split(|&byte| byte == b',').map(shown);
        match name {
            b".N" => self.now.net = fields.next(),
            b".C" => self.now.component = fields.next(),
            b".P" => (self.now.component, self.now.pin) = (fields.next(), fields.next()),
            _ => return,
        }
        self.index = [None; 2];
    }

    /// Index in `all` of the tag for an object drawn now.
    pub(super) fn tag_now(&mut self, contour: bool, all: &mut Vec<Tag>) -> u32 {
        let [other, of_contour] = &mut self.index;
        let known = if contour { of_contour } else { other };
        *known.get_or_insert_with(|| {
            let function = self.now.function.clone().filter(|_| contour);
            let tag = Tag { function, ..self.now.clone() };
            match self.tags.get(&tag) {
                Some(&index) => index,
                None if all.len() >= MOST_TAGS => 0,
                None => {
                    let index = all.len() as u32;
                    all.push(tag.clone());
                    self.tags.insert(tag, index);
                    index
                }
            }
        })
    }
}

impl Reader {
    pub(super) fn comment(&mut self, text: &[u8], block: &Block<'_>) {
        let text = text.trim_ascii();
        if let Some(rest) = text.strip_prefix(b"#@!") {
            // Some CADs keep the percent signs.
            let rest = rest.trim_ascii();
            let rest = rest.strip_prefix(b"%").unwrap_or(rest);
            if let Some((&[b'T', code @ (b'F' | b'A' | b'O' | b'D')], rest)) = rest.split_first_chunk::<2>() {
                self.command([b'T', code], rest, block);
            }
            return;
        }
        self.attributes.comments += 1;
        if self.attributes.comments > COMMENTS_LOOKED_AT {
            return;
        }
        let says = |words: &[&str]| words.iter().any(|word| holds(text, word));
        if let Some(rest) = text.strip_prefix(b"TF.") {
            self.file_attribute(&[b".", rest].concat());
        } else if says(&["created by", "Creator:", "generated", "ULTIpost", "EasyEDA", "DipTrace"]) {
            self.out.generator.get_or_insert_with(|| shown(text));
        } else if says(&["layer", "Title", "Film Name"]) {
            self.out.layer_name.get_or_insert_with(|| shown(text));
        }
    }

    /// `.FileFunction,Copper,L1,Top` after `TF`.
    pub(super) fn file_attribute(&mut self, text: &[u8]) {
        let (name, value) = named(text);
        let value = shown(value);
        match name {
            b".FileFunction" => self.out.file_function = Some(value.clone()),
            b".FilePolarity" => self.out.file_polarity = Some(value.clone()),
            b".GenerationSoftware" => self.out.generator = Some(value.replace(',', " ")),
            _ => {}
        }
        if self.out.attributes.len() < MOST_ATTRIBUTES {
            let name = shown(name.strip_prefix(b".").unwrap_or(name));
            self.out.attributes.push((name, value));
        }
    }

    /// `.AperFunction,ComponentPad` after `TA`.
    pub(super) fn aperture_attribute(&mut self, text: &[u8]) {
        if let (b".AperFunction", value) = named(text) {
            self.attributes.now.function = Some(shown(value));
            self.attributes.index = [None; 2];
        }
    }

    /// A name, or none for all, after `TD`.
    pub(super) fn forget(&mut self, text: &[u8], place: At) {
        let (name, _) = named(text);
        let now = &mut self.attributes.now;
        match name {
            b"" => *now = Tag::default(),
            b".AperFunction" => now.function = None,
            b".N" => now.net = None,
            b".C" => now.component = None,
            b".P" => (now.component, now.pin) = (None, None),
            [b'.', ..] if name.len() > 1 => {}
            [first, ..] if first.is_ascii_alphabetic() || *first == b'_' || *first == b'$' => {}
            _ => self.tell_once(Severity::Warning, code!("gerber.unknown_command"), place, name),
        }
        self.attributes.index = [None; 2];
    }
}

/// Name and value of an attribute; the name spelled as in the specification.
fn named(text: &[u8]) -> (&[u8], &[u8]) {
    let text = text.trim_ascii();
    let (name, value) = match text.iter().position(|&byte| byte == b',') {
        Some(at) => (text.get(..at).unwrap_or_default(), text.get(at + 1..).unwrap_or_default()),
        None => (text, [].as_slice()),
    };
    (NAMES.into_iter().find(|known| known.eq_ignore_ascii_case(name)).unwrap_or(name), value)
}

/// A printable, comparable text: `\u00E4` decoded, no control characters, limited length.
fn shown(text: &[u8]) -> String {
    let text = String::from_utf8_lossy(text);
    let mut parts = text.trim().split("\\u");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let letter = part.get(..4).and_then(|hex| u32::from_str_radix(hex, 16).ok()).and_then(char::from_u32);
        match letter.zip(part.get(4..)) {
            Some((letter, rest)) => {
                out.push(letter);
                out.push_str(rest);
            }
            None => {
                out.push_str("\\u");
                out.push_str(part);
            }
        }
    }
    out.chars().filter(|letter| !letter.is_control()).take(LONGEST).collect()
}

#[cfg(test)]
mod tests {
    use crate::artwork::Overrides;

    #[test]
    fn objects_carry_the_attributes_in_force() {
        let text = "%FSLAX36Y36*%%MOMM*%%TF.FileFunction,Copper,L1,Top*%%TF.FilePolarity,Positive*%\
            %TA.AperFunction,ComponentPad*%%ADD10C,1*%%TD*%%ADD11C,1*%D10*\
            %TO.P,R1,2*%%TO.N,V\\u00B2*%X0Y0D03*%TD*%X1Y1D03*G04 #@! TO.N,GND*\nX2Y2D03*%TD.N*%X3Y3D03*\
            %TA.AperFunction,Conductor*%G36*X0Y0D02*X1Y0D01*Y1D01*X0Y0D01*G37*M02*";
        let (gerber, diagnostics) = super::super::read("t", text.as_bytes(), &Overrides::default());
        assert_eq!(diagnostics, []);
        assert_eq!(gerber.file_function.as_deref(), Some("Copper,L1,Top"));
        assert_eq!(gerber.file_polarity.as_deref(), Some("Positive"));
        assert_eq!(gerber.apertures[0].function.as_deref(), Some("ComponentPad"));
        assert_eq!(gerber.apertures[1].function, None);
        let tags: Vec<_> = gerber.objects.iter().map(|object| &gerber.tags[object.tag as usize]).collect();
        let net = |index: usize| tags[index].net.as_deref();
        assert_eq!([0, 1, 2, 3].map(net), [Some("V\u{b2}"), None, Some("GND"), None]);
        assert_eq!((tags[0].component.as_deref(), tags[0].pin.as_deref()), (Some("R1"), Some("2")));
        assert_eq!(tags[4].function.as_deref(), Some("Conductor"));
    }
}
