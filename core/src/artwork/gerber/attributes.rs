//! Comments and attributes: what the layer says about itself and its objects.
//!
//! Comes in: `%TF.FileFunction,Copper,L1,Top*%`, `%TO.N,GND*%`, the same behind `G04 #@!`, and plain comments of the CADs.
//! Goes out: what is in force for the next object, and the layer's own attributes. Does not judge them.

use super::machine::Machine;
use super::object::Tag;
use super::words::At;
use crate::artwork::text::holds;
use crate::remark::Weight;

/// Text of one attribute, in letters.
const LONGEST: usize = 200;
/// File attributes kept.
const MOST_ATTRIBUTES: usize = 100;
/// Different tags kept.
const MOST_TAGS: usize = 200_000;
/// Comments in which the CAD's name is looked for.
const COMMENTS_LOOKED_AT: u32 = 200;

/// The names that are understood.
const NAMES: [&[u8]; 7] =
    [b".FileFunction", b".FilePolarity", b".GenerationSoftware", b".AperFunction", b".N", b".C", b".P"];

/// Attributes in force.
#[derive(Clone, Debug, Default)]
pub(super) struct Attributes {
    function: Option<String>,
    net: Option<String>,
    component: Option<String>,
    pin: Option<String>,
    comments: u32,
}

impl Attributes {
    /// What an aperture defined now is for.
    pub(super) fn aperture_function(&self) -> Option<String> {
        self.function.clone()
    }
}

impl Machine {
    /// What stands behind `G04`.
    pub(super) fn comment(&mut self, text: &[u8], place: At) {
        let text = text.trim_ascii();
        if let Some(rest) = text.strip_prefix(b"#@!") {
            // Some CADs leave the percent signs in.
            let rest = rest.trim_ascii();
            let rest = rest.strip_prefix(b"%").unwrap_or(rest);
            if let Some((&[b'T', code @ (b'F' | b'A' | b'O' | b'D')], rest)) = rest.split_first_chunk::<2>() {
                self.attribute([b'T', code], rest, place);
            }
            return;
        }
        self.attributes.comments += 1;
        if self.attributes.comments > COMMENTS_LOOKED_AT {
            return;
        }
        if let Some(rest) = text.strip_prefix(b"TF.") {
            self.attribute(*b"TF", [b".", rest].concat().as_slice(), place);
        } else if ["created by", "Creator:", "generated", "ULTIpost", "EasyEDA", "DipTrace"]
            .iter()
            .any(|word| holds(text, word))
        {
            self.out.generator.get_or_insert_with(|| shown(text));
        } else if ["layer", "Title", "Film Name"].iter().any(|word| holds(text, word)) {
            self.out.layer_name.get_or_insert_with(|| shown(text));
        }
    }

    /// `.FileFunction,Copper,L1,Top` behind `TF`; the same of TA, TO and TD.
    pub(super) fn attribute(&mut self, code: [u8; 2], rest: &[u8], place: At) {
        let text = rest.trim_ascii();
        let (name, value) = match text.iter().position(|&byte| byte == b',') {
            Some(at) => (text.get(..at).unwrap_or_default(), text.get(at + 1..).unwrap_or_default()),
            None => (text, [].as_slice()),
        };
        let name = NAMES.into_iter().find(|known| known.eq_ignore_ascii_case(name)).unwrap_or(name);
        match &code {
            b"TF" => self.file_attribute(name, shown(value)),
            b"TA" => {
                if name == b".AperFunction" {
                    self.attributes.function = Some(shown(value));
                    self.tag_index = [None; 2];
                }
            }
            b"TO" => self.object_attribute(name, value),
            _ => self.forget(name, place),
        }
    }

    fn file_attribute(&mut self, name: &[u8], value: String) {
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

    fn object_attribute(&mut self, name: &[u8], value: &[u8]) {
        let mut fields = value.split(|&byte| byte == b',').map(shown);
        match name {
            b".N" => self.attributes.net = fields.next(),
            b".C" => self.attributes.component = fields.next(),
            b".P" => {
                self.attributes.component = fields.next();
                self.attributes.pin = fields.next();
            }
            _ => return,
        }
        self.tag_index = [None; 2];
    }

    fn forget(&mut self, name: &[u8], place: At) {
        let now = &mut self.attributes;
        match name {
            b"" => (now.function, now.net, now.component, now.pin) = (None, None, None, None),
            b".AperFunction" => now.function = None,
            b".N" => now.net = None,
            b".C" => now.component = None,
            b".P" => (now.component, now.pin) = (None, None),
            [b'.', ..] if name.len() > 1 => {}
            [first, ..] if first.is_ascii_alphabetic() || *first == b'_' || *first == b'$' => {}
            _ => self.tell_once(Weight::Doubt, "gerber.unknown_command", place, name),
        }
        self.tag_index = [None; 2];
    }

    /// Index of the tag that an object drawn now carries.
    pub(super) fn tag_now(&mut self, contour: bool) -> u32 {
        let [other, of_contour] = &mut self.tag_index;
        let known = if contour { of_contour } else { other };
        if let Some(index) = *known {
            return index;
        }
        let Attributes { net, component, pin, function, .. } = self.attributes.clone();
        let tag = Tag { net, component, pin, function: function.filter(|_| contour) };
        let index = match self.tags.get(&tag) {
            Some(&index) => index,
            None if self.out.tags.len() >= MOST_TAGS => 0,
            None => {
                let index = self.out.tags.len() as u32;
                self.out.tags.push(tag.clone());
                self.tags.insert(tag, index);
                index
            }
        };
        *known = Some(index);
        index
    }
}

/// Text fit to show and to compare: `\u00E4` made a letter, no control characters, not too long.
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
        let (gerber, remarks) = super::super::read("t", text.as_bytes(), &Overrides::default());
        assert_eq!(remarks, []);
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
