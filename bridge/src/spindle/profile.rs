//! A family of frequency converters: its registers, as a data file.
//!
//! ```text
//! [[run]]  register, value       written in order; function 6 by default
//! [speed]  register, unit, per   the number is per · Hz, per · rpm, or per · share of the greatest frequency
//! [actual] register, unit, per   read; function 3 by default
//! [fault]  register, mask, bad   a masked number in `bad` is a trip (any but 0 without a list)
//! ```

use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::Converter;
use serde::Deserialize;
use std::fs;
use std::path::Path;

const SHIPPED: &[(&str, &str)] = &[
    ("huanyang", include_str!("profiles/huanyang.toml")),
    ("h100", include_str!("profiles/h100.toml")),
    ("h2a", include_str!("profiles/h2a.toml")),
    ("yl620", include_str!("profiles/yl620.toml")),
    ("v20", include_str!("profiles/v20.toml")),
    ("delta", include_str!("profiles/delta.toml")),
    ("bd600", include_str!("profiles/bd600.toml")),
    ("g70", include_str!("profiles/g70.toml")),
    ("gs2", include_str!("profiles/gs2.toml")),
    ("mitsubishi", include_str!("profiles/mitsubishi.toml")),
    ("altivar", include_str!("profiles/altivar.toml")),
];

const LONGEST: u64 = 64 * 1024;

const MOST_WRITES: usize = 8;

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Profile {
    pub(super) title: String,
    /// Settings that the user must make at the converter.
    pub(super) set_up: String,
    #[serde(default)]
    pub(super) frames: Frames,
    pub(super) baud: u32,
    #[serde(default)]
    pub(super) parity: Parity,
    #[serde(default = "one")]
    pub(super) stop_bits: u8,
    pub(super) run: Vec<Write>,
    pub(super) stop: Vec<Write>,
    pub(super) speed: Speed,
    pub(super) actual: Actual,
    pub(super) fault: Option<Fault>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Frames {
    #[default]
    Rtu,
    /// Huanyang's own: Modbus checksum, other functions and lengths.
    Huanyang,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Parity {
    #[default]
    None,
    Even,
    Odd,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Write {
    #[serde(default)]
    pub(super) register: u16,
    pub(super) value: u16,
    /// 5: a coil, 6: a register, 16: registers.
    #[serde(default = "six")]
    pub(super) function: u8,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Speed {
    #[serde(default)]
    pub(super) register: u16,
    #[serde(default = "six")]
    pub(super) function: u8,
    pub(super) unit: Unit,
    pub(super) per: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Actual {
    pub(super) register: u16,
    #[serde(default = "three")]
    pub(super) function: u8,
    pub(super) unit: Unit,
    pub(super) per: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Unit {
    Hz,
    Rpm,
    Share,
}

/// The register that reports a trip.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Fault {
    pub(super) register: u16,
    #[serde(default = "three")]
    pub(super) function: u8,
    #[serde(default = "all")]
    pub(super) mask: u16,
    #[serde(default)]
    pub(super) bad: Vec<u16>,
}

fn one() -> u8 {
    1
}

fn three() -> u8 {
    3
}

fn six() -> u8 {
    6
}

fn all() -> u16 {
    u16::MAX
}

impl Speed {
    /// The number for a speed; limited to the register's range.
    pub(super) fn number(&self, rpm: u32, converter: &Converter) -> u16 {
        self.exact(rpm, converter).clamp(0.0, f64::from(u16::MAX)) as u16
    }

    pub(super) fn reaches(&self, rpm: u32, converter: &Converter) -> bool {
        self.exact(rpm, converter) <= f64::from(u16::MAX)
    }

    fn exact(&self, rpm: u32, converter: &Converter) -> f64 {
        (self.per * in_unit(self.unit, rpm, converter)).round()
    }
}

impl Actual {
    pub(super) fn rpm(&self, number: u16, converter: &Converter) -> u32 {
        let value = f64::from(number) / self.per;
        let hz = match self.unit {
            Unit::Hz => value,
            Unit::Share => value * f64::from(converter.max_hz),
            Unit::Rpm => return value.round() as u32,
        };
        converter.rpm((hz * 100.0).round() as u32)
    }
}

fn in_unit(unit: Unit, rpm: u32, converter: &Converter) -> f64 {
    let hz = f64::from(converter.centi_hz(rpm)) / 100.0;
    match unit {
        Unit::Hz => hz,
        Unit::Rpm => f64::from(rpm),
        Unit::Share => hz / f64::from(converter.max_hz.max(1)),
    }
}

impl Fault {
    /// The reason of a trip, if the number reports one.
    pub(super) fn tripped(&self, number: u16) -> Option<u16> {
        let code = number & self.mask;
        let bad = if self.bad.is_empty() { code != 0 } else { self.bad.contains(&code) };
        bad.then_some(code)
    }
}

pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, _)| *name)
}

/// The profile `name`: this user's own in `folder`, else the shipped one.
pub(super) fn named(name: &str, folder: &Path) -> Result<Profile, Diagnostic> {
    let is_name = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c));
    let own = folder.join(format!("{name}.toml"));
    if is_name && own.is_file() {
        let file = own.display();
        let cannot = |reason: String| error!("spindle.bad_profile", file = &file, reason = reason);
        if own.metadata().is_ok_and(|found| found.len() > LONGEST) {
            return Err(cannot(format!("it is longer than {LONGEST} bytes")));
        }
        let text = fs::read_to_string(&own).map_err(|error| cannot(error.to_string()))?;
        return parse(&text).map_err(cannot);
    }
    let shipped = SHIPPED.iter().find(|(known, _)| *known == name);
    shipped.and_then(|(_, text)| parse(text).ok()).ok_or_else(|| {
        let names = names().collect::<Vec<_>>().join(", ");
        let why = error!("spindle.no_profile", name = name, names = names, ..);
        why.with("folder", folder.display())
    })
}

fn parse(text: &str) -> Result<Profile, String> {
    let profile: Profile =
        toml::from_str(text).map_err(|error| error.to_string().trim().replace('\n', " "))?;
    let lists = [profile.run.len(), profile.stop.len()];
    if lists.iter().any(|length| !(1..=MOST_WRITES).contains(length)) {
        return Err(format!("run and stop have 1 to {MOST_WRITES} entries"));
    }
    let writes = profile.run.iter().chain(&profile.stop).map(|write| write.function);
    if writes.chain([profile.speed.function]).any(|function| ![5, 6, 16].contains(&function)) {
        return Err("a function that writes is 5, 6 or 16".to_owned());
    }
    let reads = [profile.actual.function].into_iter().chain(profile.fault.iter().map(|fault| fault.function));
    if reads.into_iter().any(|function| ![3, 4].contains(&function)) {
        return Err("a function that reads is 3 or 4".to_owned());
    }
    if ![profile.speed.per, profile.actual.per].iter().all(|per| per.is_finite() && *per > 0.0) {
        return Err("per is above 0".to_owned());
    }
    // At a lower speed an answer takes longer than the limit for a lost spindle.
    if !(9_600..=115_200).contains(&profile.baud) || !(1..=2).contains(&profile.stop_bits) {
        return Err("baud is 9600 to 115200, stop_bits 1 or 2".to_owned());
    }
    Ok(profile)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shipped_profiles_load_and_keep_their_speeds() {
        assert!(SHIPPED.len() >= 8);
        let nowhere = Path::new("/nonexistent");
        for name in names() {
            let profile = named(name, nowhere).unwrap();
            assert!(profile.title.len() > 4 && profile.set_up.len() > 20, "{name}");
            let converter = Converter::default();
            for rpm in [6_000, 12_000, 24_000] {
                let number = profile.speed.number(rpm, &converter);
                assert!(number > 0, "{name}: {rpm}");
                // The number read back has its own unit: some number must give the same speed within 0.2 %.
                let told = (0..=u16::MAX).map(|number| profile.actual.rpm(number, &converter));
                let near = told.map(|told| told.abs_diff(rpm)).min().unwrap();
                assert!(near * 500 <= rpm, "{name}: {rpm} by {near}");
            }
        }
    }

    #[test]
    fn speed_beyond_a_16_bit_register_is_not_reached() {
        let converter = Converter::default();
        let speed = Speed { register: 0, function: 6, unit: Unit::Hz, per: 100.0 };
        assert!(speed.reaches(24_000, &converter));
        let finer = Speed { per: 1_000.0, ..speed };
        assert_eq!((finer.reaches(24_000, &converter), finer.number(24_000, &converter)), (false, u16::MAX));
    }

    #[test]
    fn user_profile_overrides_and_its_errors_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let own = SHIPPED[0].1.replace("9600", "19200");
        fs::write(folder.path().join("huanyang.toml"), &own).unwrap();
        assert_eq!(named("huanyang", folder.path()).unwrap().baud, 19_200);
        let rows = [
            String::new(),
            "title = 3".to_owned(),
            own.replace("19200", "4800"),
            own.replace("per = 100", "per = 0"),
            own.clone() + "\ncolour = 1",
        ];
        for text in rows {
            fs::write(folder.path().join("mine.toml"), &text).unwrap();
            let why = named("mine", folder.path()).unwrap_err();
            assert_eq!(why.code, "spindle.bad_profile", "{text}");
            assert!(why.message("en").contains("mine.toml"), "{}", why.message("en"));
        }
        let why = named("../mine", folder.path()).unwrap_err();
        assert_eq!(why.code, "spindle.no_profile", "no way out of the folder");
        assert!(why.message("en").contains("altivar") || why.advice("en").contains("altivar"));
    }
}
