//! Numbers say their unit in their name: `feed_mm_per_s`, not `feed`.
//!
//! Comes in: the sources. Goes out: fields of `f64` that other files see, and arguments of public functions, whose name ends in no
//! unit. Does not read what a function gives back, nor what is private.

use crate::floor_plan::rust_files;
use annulus_tests::root;
use std::fs;
use syn::visit::{self, Visit};

/// How names of numbers end.
const UNITS: &[&str] = &[
    "deg", "factor", "hz", "inch", "m", "min", "mm", "mm2", "ms", "nm", "ns", "pct", "percent", "px", "rad",
    "rpm", "s", "seconds", "share", "steps", "ticks", "turns", "um", "us", "v", "volts",
];

/// Numbers without a unit, or with that of what they are of: where they stand, their name, what they are.
const PLAIN: &[(&str, &str, &str)] = &[
    ("app/src/engine/messages.rs", "runner_up", "a share of the holes"),
    ("app/src/engine/messages.rs", "score", "a share of the holes"),
    ("app/src/format.rs", "value", "a number to be written"),
    ("app/src/model/play.rs", "speed", "how many times faster than life"),
    ("app/src/readout.rs", "reach", "in the unit of the axis that is plotted"),
    ("app/src/readout.rs", "value", "in the unit of the axis that is plotted"),
    ("app/src/readout.rs", "x", "in the unit of the axis that is plotted"),
    ("app/src/view", "density", "dots of the screen for each of the page"),
    ("bridge/src/cli", "speed", "how many times faster than life"),
    ("bridge/src/drill", "speed", "how many times faster than life"),
    ("bridge/src/lab", "ratio", "a deviation over what it may be"),
    ("bridge/src/lab", "tolerance", "in the unit of the value that is compared"),
    ("core/src/artwork/gerber", "scale", "a factor"),
    ("core/src/artwork/kinds.rs", "runner_up", "a share of the holes"),
    ("core/src/artwork/kinds.rs", "score", "a share of the holes"),
    ("core/src/cam/bench.rs", "optimum", "a length in the unit of the instance"),
    ("core/src/chance.rs", "high", "any number"),
    ("core/src/chance.rs", "low", "any number"),
    ("core/src/geometry", "x", "mm, as the name of the function says"),
    ("core/src/geometry", "y", "mm, as the name of the function says"),
    ("core/src/machine/drive.rs", "order", "the power of a law"),
    ("core/src/machine/drive.rs", "reserve", "a share of the acceleration"),
    ("core/src/motion", "t", "seconds: the time of every law of motion"),
    ("core/src/plot", "high", "in the unit of the axis that is plotted"),
    ("core/src/plot", "low", "in the unit of the axis that is plotted"),
    ("core/src/plot", "py", "px, as a place in the picture"),
    ("core/src/plot", "range", "in the unit of the axis that is plotted"),
    ("core/src/plot", "step", "in the unit of the axis that is plotted"),
    ("core/src/plot", "x", "in the unit of the axis that is plotted"),
    ("core/src/plot", "y", "in the unit of the axis that is plotted"),
    ("core/src/post/readback/hand.rs", "x", "mm, as all of the tip"),
    ("core/src/post/readback/hand.rs", "y", "mm, as all of the tip"),
    ("core/src/post/readback/hand.rs", "z", "mm, as all of the tip"),
    ("core/src/proof/edges.rs", "x", "mm, as all of the proof's places"),
    ("core/src/proof/edges.rs", "y", "mm, as all of the proof's places"),
    ("core/src/servo", "e", "an error in levels of the table"),
    ("core/src/servo", "ec", "its change in levels of the table"),
    ("core/src/servo", "kd", "a gain of the PID"),
    ("core/src/servo", "ki", "a gain of the PID"),
    ("core/src/servo", "kp", "a gain of the PID"),
    ("core/src/virtual_drill", "glitches", "a share of the readings"),
    ("drill/src", "speed", "how many times faster than life"),
];

/// Whether a name says what its number counts: `…_mm`, `…_mm_per_s2`.
fn says(name: &str) -> bool {
    let words: Vec<&str> = name.split('_').collect();
    let last = words.last().is_some_and(|word| UNITS.contains(word));
    last || words.contains(&"per")
}

/// Whether a type is `f64`, or some of them.
fn is_number(kind: &syn::Type) -> bool {
    match kind {
        syn::Type::Array(array) => is_number(&array.elem),
        syn::Type::Path(path) => path.path.segments.last().is_some_and(|last| match &last.arguments {
            syn::PathArguments::AngleBracketed(inner) if last.ident == "Option" => inner
                .args
                .iter()
                .any(|one| matches!(one, syn::GenericArgument::Type(kind) if is_number(kind))),
            _ => last.ident == "f64",
        }),
        _ => false,
    }
}

/// Names that do not say their unit.
#[derive(Default)]
struct Silent(Vec<String>);

impl Silent {
    fn number(&mut self, name: &syn::Ident, kind: &syn::Type) {
        let name = name.to_string();
        if is_number(kind) && !says(&name) {
            self.0.push(name);
        }
    }

    /// The arguments of a function, where everybody may call it.
    fn function(&mut self, seen: &syn::Visibility, function: &syn::Signature) {
        if !matches!(seen, syn::Visibility::Public(_)) {
            return;
        }
        for input in &function.inputs {
            if let syn::FnArg::Typed(input) = input
                && let syn::Pat::Ident(name) = input.pat.as_ref()
            {
                self.number(&name.ident, &input.ty);
            }
        }
    }
}

impl<'ast> Visit<'ast> for Silent {
    fn visit_field(&mut self, field: &'ast syn::Field) {
        if let (Some(name), false) = (&field.ident, matches!(field.vis, syn::Visibility::Inherited)) {
            self.number(name, &field.ty);
        }
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        self.function(&item.vis, &item.sig);
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.function(&item.vis, &item.sig);
        visit::visit_impl_item_fn(self, item);
    }
}

fn silent(text: &str) -> Vec<String> {
    let mut silent = Silent::default();
    silent.visit_file(&syn::parse_file(text).unwrap());
    silent.0
}

#[test]
fn numbers_that_others_see_say_their_unit() {
    let mut files = Vec::new();
    for folder in ["core/src", "drill/src", "app/src", "bridge/src"] {
        rust_files(&root().join(folder), &mut files);
    }
    assert!(files.len() > 200, "the sources were not found");
    let (mut wrong, mut met) = (Vec::new(), vec![false; PLAIN.len()]);
    for path in files.iter().filter(|path| !path.to_string_lossy().replace(".rs", "/").contains("tests/")) {
        let inside = path.strip_prefix(root()).unwrap();
        for name in silent(&fs::read_to_string(path).unwrap()) {
            match PLAIN.iter().position(|(folder, plain, _)| *plain == name && inside.starts_with(folder)) {
                Some(place) => met[place] = true,
                None => wrong.push(format!("{}: {name}", inside.display())),
            }
        }
    }
    wrong.extend(
        PLAIN.iter().zip(met).filter(|(_, met)| !met).map(|(row, _)| format!("not there any more: {row:?}")),
    );
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_rule_of_units_can_fail() {
    let text = "pub struct A { pub feed: f64, pub feed_mm_per_s: f64, own: f64, pub to: Option<[f64; 2]>, pub n: u8, pub(super) by: f64 }
        impl A { pub fn at(&self, t: f64, x_mm: f64) {} fn own(&self, x: f64) {} pub(crate) fn near(y: f64) {} }
        pub fn all(z: [f64; 3]) {}";
    assert_eq!(silent(text), ["feed", "to", "by", "t", "z"]);
}
