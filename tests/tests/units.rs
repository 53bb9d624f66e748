//! Numbers say their unit in their name: `feed_mm_per_s`, not `feed`.
//!
//! Comes in: the sources. Goes out: constants, fields of `f64` that other files see, also those of variants, and arguments of functions
//! that they may call, whose name ends in no unit. Does not read what a function gives back, nor arguments of private functions.

use crate::floor_plan::rust_files;
use annulus_tests::root;
use std::fs;
use syn::visit::{self, Visit};

/// How names of numbers end.
const UNITS: &[&str] = &[
    "deg", "factor", "hz", "inch", "m", "min", "mm", "mm2", "ms", "nm", "nm2", "ns", "pct", "percent", "px",
    "rad", "rpm", "s", "seconds", "share", "steps", "ticks", "turns", "um", "us", "v", "volts",
];

/// What else is counted or is a bare number.
const COUNTED: &[&str] = &[
    "cells",
    "cosine",
    "diameters",
    "frames",
    "parts",
    "pieces",
    "places",
    "rings",
    "samples",
    "sine",
    "slope",
    "swings",
    "tolerances",
];

/// Numbers without a unit, or with that of what they are of: where they stand, their name, what they are.
const PLAIN: &[(&str, &str, &str)] = &[
    ("app/src/engine/messages.rs", "runner_up", "a share of the holes"),
    ("app/src/engine/messages.rs", "score", "a share of the holes"),
    ("app/src/format.rs", "value", "a number to be written"),
    ("app/src/model/play.rs", "speed", "how many times faster than life"),
    ("app/src/model/play.rs", "speeds", "how many times faster than life"),
    ("app/src/readout.rs", "reach", "in the unit of the axis that is plotted"),
    ("app/src/readout.rs", "value", "in the unit of the axis that is plotted"),
    ("app/src/readout.rs", "x", "in the unit of the axis that is plotted"),
    ("app/src/view", "density", "dots of the screen for each of the page"),
    ("bridge/src/cli", "speed", "how many times faster than life"),
    ("bridge/src/cli/lab/output.rs", "value", "a number to be written"),
    ("bridge/src/controller/owner.rs", "speed", "how many times faster than life"),
    ("bridge/src/drill", "speed", "how many times faster than life"),
    ("bridge/src/executor/clock.rs", "speed", "how many times faster than life"),
    ("bridge/src/lab", "found", "in the unit of the value that is compared"),
    ("bridge/src/lab", "loosest", "in the unit of the value that is compared"),
    ("bridge/src/lab", "ratio", "a deviation over what it may be"),
    ("bridge/src/lab", "relative", "a share of the value that is compared"),
    ("bridge/src/lab", "tolerance", "in the unit of the value that is compared"),
    ("core/src/artwork/gerber", "scale", "a factor"),
    ("core/src/artwork/gerber/transform.rs", "degrees", "degrees"),
    ("core/src/artwork/kinds.rs", "runner_up", "a share of the holes"),
    ("core/src/artwork/kinds.rs", "score", "a share of the holes"),
    ("core/src/cam/bench.rs", "optimum", "a length in the unit of the instance"),
    ("core/src/cam/tour/lin_kernighan.rs", "epsilon", "a cost of the tour"),
    ("core/src/cam/tour/lin_kernighan.rs", "fixed", "a cost of the tour"),
    ("core/src/chance.rs", "high", "any number"),
    ("core/src/chance.rs", "low", "any number"),
    ("core/src/controller", "value", "a number of a setting or a line, in its own unit"),
    ("core/src/geometry", "x", "mm, as the name of the function says"),
    ("core/src/geometry", "y", "mm, as the name of the function says"),
    ("core/src/machine/drive.rs", "order", "the power of a law"),
    ("core/src/machine/drive.rs", "reserve", "a share of the acceleration"),
    ("core/src/motion", "t", "seconds: the time of every law of motion"),
    ("core/src/motion/path", "center", "mm, as all places of a path"),
    ("core/src/motion/profile/mod.rs", "greatest", "in the unit of what it bounds"),
    ("core/src/motion/profile/mod.rs", "greatest_order", "the power of a law"),
    ("core/src/motion/profile/mod.rs", "least_limit", "in the unit of what it bounds"),
    ("core/src/motion/profile/mod.rs", "value", "in the unit of what is wrong"),
    ("core/src/plot", "at", "px, as all places in the picture"),
    ("core/src/plot", "bar", "in the unit of the axis"),
    ("core/src/plot", "high", "in the unit of the axis that is plotted"),
    ("core/src/plot", "low", "in the unit of the axis that is plotted"),
    ("core/src/plot", "py", "px, as a place in the picture"),
    ("core/src/plot", "range", "in the unit of the axis that is plotted"),
    ("core/src/plot", "size", "px, as all sizes in the picture"),
    ("core/src/plot", "step", "in the unit of the axis that is plotted"),
    ("core/src/plot", "x", "in the unit of the axis that is plotted"),
    ("core/src/plot", "y", "in the unit of the axis that is plotted"),
    ("core/src/post/again.rs", "units", "units of the last digit"),
    ("core/src/post/readback/hand.rs", "x", "mm, as all of the tip"),
    ("core/src/post/readback/hand.rs", "y", "mm, as all of the tip"),
    ("core/src/post/readback/hand.rs", "z", "mm, as all of the tip"),
    ("core/src/post/template.rs", "largest_number", "any number"),
    ("core/src/proof/edges.rs", "x", "mm, as all of the proof's places"),
    ("core/src/proof/edges.rs", "y", "mm, as all of the proof's places"),
    ("core/src/servo", "e", "an error in levels of the table"),
    ("core/src/servo", "ec", "its change in levels of the table"),
    ("core/src/servo", "kd", "a gain of the PID"),
    ("core/src/servo", "ki", "a gain of the PID"),
    ("core/src/servo", "kp", "a gain of the PID"),
    ("core/src/sim/cuts.rs", "center", "mm, as all of a cut"),
    ("core/src/virtual_drill", "glitches", "a share of the readings"),
    ("core/src/wire/mod.rs", "stamp", "whatever the page's clock says; it is only sent back"),
    ("drill/src", "speed", "how many times faster than life"),
];

/// Whether a name says what its number counts: `…_mm`, `…_mm_per_s2`.
fn says(name: &str) -> bool {
    let words: Vec<&str> = name.split('_').collect();
    let last = words.last().is_some_and(|word| UNITS.contains(word) || COUNTED.contains(word));
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
        let name = name.to_string().to_lowercase();
        if is_number(kind) && !says(&name) {
            self.0.push(name);
        }
    }

    /// The arguments of a function, where other files may call it.
    fn function(&mut self, seen: &syn::Visibility, function: &syn::Signature) {
        if matches!(seen, syn::Visibility::Inherited) {
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

    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        if matches!(item.vis, syn::Visibility::Inherited) {
            return;
        }
        for field in item.variants.iter().flat_map(|variant| &variant.fields) {
            if let Some(name) = &field.ident {
                self.number(name, &field.ty);
            }
        }
    }

    fn visit_item_const(&mut self, item: &'ast syn::ItemConst) {
        self.number(&item.ident, &item.ty);
    }

    fn visit_impl_item_const(&mut self, item: &'ast syn::ImplItemConst) {
        self.number(&item.ident, &item.ty);
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
        impl A { const HIGH: f64 = 1.0; pub fn at(&self, t: f64, x_mm: f64) {} fn own(&self, x: f64) {} pub(crate) fn near(y: f64) {} }
        pub fn all(z: [f64; 3]) {}
        const MOST: f64 = 1.0; const MOST_SHARE: f64 = 0.5; const MOST_CELLS: f64 = 9.0; static N: u8 = 1;
        pub enum Event { Jog { distance: f64, speed_mm_per_s: f64 }, Power(f64) } enum Own { At { x: f64 } }";
    assert_eq!(silent(text), ["feed", "to", "by", "high", "t", "y", "z", "most", "distance"]);
}
