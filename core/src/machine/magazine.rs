//! The magazine of the automatic tool changer: slots, heights and times.
//!
//! ```text
//!          pause +                      spindle up: check that a tool was put back, or taken
//!   slot 1   ○   ○   ○   ○  slot 4      machine coordinates of X and Y, one of each per slot
//!            └ height                   Z at which the clamp opens and closes over a slot
//! ```

use super::field::{ADVANCED, BUILT, Setting, fields};
use super::foot::not_named;
use super::value::ValueKind::{Number, Numbers, Text};
use super::{Machine, Output, Steps, ToolChange};
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::units::{Length, TICK_HZ};

pub const MOST_PLACES: usize = 64;

const APART: Length = Length::from_um(2_000);

#[derive(Clone, Debug, PartialEq)]
pub struct Magazine {
    /// X of the slots, machine coordinates.
    pub x: Vec<Length>,
    pub y: Vec<Length>,
    /// Z of a tool in its slot, machine coordinates.
    pub height: Length,
    /// XY position for checks of the tool in the spindle, machine coordinates.
    pub pause: [Length; 2],
    /// Name of the output that opens the clamp; off means closed.
    pub clamp: String,
    pub clamp_ms: f64,
    /// Time for the spindle to stop, in ms.
    pub spin_down_ms: f64,
}

impl Default for Magazine {
    /// Eight slots along the far edge of the virtual drill.
    fn default() -> Self {
        let mm = |mm: i64| Length::from_um(mm * 1_000);
        Self {
            x: (0..8).map(|place| mm(60 + 25 * place)).collect(),
            y: vec![mm(190); 8],
            height: mm(-25),
            pause: [mm(30), mm(150)],
            clamp: "clamp".to_owned(),
            clamp_ms: 300.0,
            spin_down_ms: 1_500.0,
        }
    }
}

impl Magazine {
    pub fn places(&self) -> usize {
        self.x.len().min(self.y.len())
    }

    pub fn clamp_ticks(&self) -> u64 {
        libm::ceil(self.clamp_ms * 1e-3 * TICK_HZ as f64) as u64
    }

    pub fn spin_down_ticks(&self) -> u64 {
        libm::ceil(self.spin_down_ms * 1e-3 * TICK_HZ as f64) as u64
    }
}

impl Machine {
    pub fn has_magazine(&self) -> bool {
        self.tool_change == ToolChange::Magazine
    }

    /// Machine steps of X and Y over slot `place`, from 0.
    pub fn magazine_place(&self, place: usize) -> Option<[i64; 2]> {
        let (x, y) = (self.magazine.x.get(place)?, self.magazine.y.get(place)?);
        Some([self.x.scale.steps(*x), self.y.scale.steps(*y)])
    }

    /// `from` with X and Y at the pause position.
    pub fn magazine_pause(&self, from: Steps) -> Steps {
        let [x, y] = self.magazine.pause;
        let mut to = from;
        (to[0], to[1]) = (self.x.scale.steps(x), self.y.scale.steps(y));
        to
    }
}

/// The section "magazine" of the settings table.
pub(super) const ROWS: &[Setting] = fields! { Machine;
    ("magazine.x", "mm", Numbers(-2_000.0, 2_000.0), BUILT, magazine.x)
    ("magazine.y", "mm", Numbers(-2_000.0, 2_000.0), BUILT, magazine.y)
    ("magazine.height", "mm", Number(-2_000.0, 2_000.0), BUILT, magazine.height)
    ("magazine.pause_x", "mm", Number(-2_000.0, 2_000.0), BUILT.and(ADVANCED), magazine.pause[0])
    ("magazine.pause_y", "mm", Number(-2_000.0, 2_000.0), BUILT.and(ADVANCED), magazine.pause[1])
    ("magazine.clamp", "", Text(32), BUILT, magazine.clamp)
    ("magazine.clamp_time", "ms", Number(0.0, 60_000.0), BUILT.and(ADVANCED), magazine.clamp_ms)
    ("magazine.spin_down", "ms", Number(0.0, 60_000.0), BUILT.and(ADVANCED), magazine.spin_down_ms)
};

fn refuse(code: &str, key: &str) -> Diagnostic {
    Diagnostic::error(code).with("key", key)
}

/// Problems of the magazine of `machine`; an unused one may be invalid.
pub(super) fn validate(machine: &Machine) -> Vec<Diagnostic> {
    if !machine.has_magazine() {
        return Vec::new();
    }
    let magazine = &machine.magazine;
    let mut diagnostics = Vec::new();
    if machine.output == Output::Adapter {
        diagnostics.push(refuse(code!("machine.magazine_beside_adapter"), "rack.change"));
    } else {
        diagnostics.extend(not_named(machine, "magazine.clamp", &magazine.clamp));
    }
    if machine.foot.on && machine.foot.output == magazine.clamp {
        let why = refuse(code!("machine.one_output_twice"), "magazine.clamp").with("name", &magazine.clamp);
        diagnostics.push(why.with("other", "foot.output"));
    }
    if machine.spindles > 1 {
        let why = refuse(code!("machine.magazine_one_spindle"), "machine.spindles");
        diagnostics.push(why.with("spindles", machine.spindles));
    }
    let (along_x, along_y) = (magazine.x.len(), magazine.y.len());
    if along_x != along_y || along_x == 0 {
        let why = refuse(code!("machine.magazine_places"), "magazine.x").with("x", along_x);
        diagnostics.push(why.with("y", along_y).with("most", MOST_PLACES));
    }
    diagnostics.extend(out_of_reach(machine));
    diagnostics.extend(too_close(magazine));
    diagnostics
}

/// Slots, pause or height outside the travel.
fn out_of_reach(machine: &Machine) -> Vec<Diagnostic> {
    let magazine = &machine.magazine;
    let along = |key: &'static str, places: &[Length]| places.iter().map(|at| (key, *at)).collect::<Vec<_>>();
    let x = [along("magazine.x", &magazine.x), vec![("magazine.pause_x", magazine.pause[0])]].concat();
    let y = [along("magazine.y", &magazine.y), vec![("magazine.pause_y", magazine.pause[1])]].concat();
    let z = vec![("magazine.height", magazine.height)];
    // XY moves over the slots with Z at its rest position of homing, so a tool must be out of its slot at
    // that height.
    let top = machine.z.max - machine.z.home_offset;
    let rows = [
        (x, machine.x.min, machine.x.max),
        (y, machine.y.min, machine.y.max),
        (z, machine.z.min, top - Length::from_um(1_000)),
    ];
    let outside = rows.into_iter().flat_map(|(places, low, high)| {
        places
            .into_iter()
            .filter(move |(_, at)| !(low..=high).contains(at))
            .map(move |(key, at)| (key, at, low, high))
    });
    outside
        .map(|(key, at, low, high)| {
            let why = refuse(code!("machine.magazine_out_of_reach"), key).with("value", at.mm());
            why.with("low", low.mm()).with("high", high.mm())
        })
        .collect()
}

fn too_close(magazine: &Magazine) -> Option<Diagnostic> {
    let places: Vec<_> = magazine.x.iter().zip(&magazine.y).collect();
    let near = |a: Length, b: Length| (a - b).nm().abs() < APART.nm();
    let twins = places.iter().enumerate().find_map(|(at, (x, y))| {
        let before = places
            .iter()
            .take(at)
            .position(|(other_x, other_y)| near(**x, **other_x) && near(**y, **other_y));
        before.map(|before| (before + 1, at + 1))
    });
    let (one, other) = twins?;
    let why = refuse(code!("machine.magazine_too_close"), "magazine.x").with("one", one).with("other", other);
    Some(why.with("least", APART.mm()))
}

#[cfg(test)]
mod tests {
    use super::super::{Value, apply, virtual_drill};

    #[test]
    fn impossible_magazine_names_its_field() {
        let text = |text: &str| Value::Text(text.to_owned());
        let on = ("rack.change", text("magazine"));
        let found = |changes: &[(&str, Value)]| {
            let changes = [on.clone()]
                .iter()
                .chain(changes)
                .map(|(key, value)| ((*key).to_owned(), value.clone()))
                .collect::<Vec<_>>();
            let refusals = apply(&virtual_drill(), &changes).err().unwrap_or_default();
            refusals.first().map(|why| {
                let message = why.message("en");
                assert!(!message.contains('{') && !why.advice("en").is_empty(), "{message}");
                (why.code.clone(), why.argument(&["key"]).unwrap_or_default().to_owned())
            })
        };
        assert_eq!(found(&[]), None, "the virtual drill has one as it is shipped");
        type Row<'a> = (&'a [(&'a str, Value)], &'a str, &'a str);
        let rows: [Row; 12] = [
            (&[("magazine.x", Value::Numbers(vec![60.0]))], "machine.magazine_places", "magazine.x"),
            (
                &[("magazine.x", Value::Numbers(vec![])), ("magazine.y", Value::Numbers(vec![]))],
                "machine.magazine_places",
                "magazine.x",
            ),
            (
                &[("magazine.x", Value::Numbers(vec![301.0])), ("magazine.y", Value::Numbers(vec![9.0]))],
                "machine.magazine_out_of_reach",
                "magazine.x",
            ),
            (
                &[("magazine.pause_y", Value::Number(-1.0))],
                "machine.magazine_out_of_reach",
                "magazine.pause_y",
            ),
            (&[("magazine.height", Value::Number(-1.5))], "machine.magazine_out_of_reach", "magazine.height"),
            (
                &[("magazine.height", Value::Number(-45.5))],
                "machine.magazine_out_of_reach",
                "magazine.height",
            ),
            (
                &[
                    ("magazine.x", Value::Numbers(vec![9.0, 10.0])),
                    ("magazine.y", Value::Numbers(vec![9.0, 9.0])),
                ],
                "machine.magazine_too_close",
                "magazine.x",
            ),
            (&[("machine.spindles", Value::Number(2.0))], "machine.magazine_one_spindle", "machine.spindles"),
            (&[("machine.output", text("adapter"))], "machine.magazine_beside_adapter", "rack.change"),
            (&[("machine.output", text("card"))], "machine.output_not_named", "magazine.clamp"),
            (
                &[("magazine.clamp", text("foot")), ("foot.on", text("yes")), ("overlap.on", text("no"))],
                "machine.one_output_twice",
                "magazine.clamp",
            ),
            (&[("magazine.clamp", text("9"))], "machine.output_name", "card.output_names"),
        ];
        for (changes, code, key) in rows {
            assert_eq!(found(changes), Some((code.to_owned(), key.to_owned())), "{changes:?}");
        }
    }
}
