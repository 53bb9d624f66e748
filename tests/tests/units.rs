//! Fields that are plain numbers say their unit in their name: `feed_mm_per_s`, not `feed`.
//!
//! Comes in: the sources. Goes out: public fields of `f64` whose name ends in no unit. Does not read functions.

use crate::floor_plan::rust_files;
use annulus_tests::root;
use std::fs;
use syn::visit::Visit;

/// How names of numbers end.
const UNITS: &[&str] = &[
    "deg", "factor", "hz", "m", "min", "mm", "mm2", "ms", "nm", "ns", "pct", "percent", "px", "rad", "rpm",
    "s", "share", "steps", "ticks", "turns", "um", "us", "v", "volts",
];

/// Numbers without a unit, or with that of what they are of.
const PLAIN: &[(&str, &str)] = &[
    ("glitches", "a share of the readings"),
    ("kd", "a gain of the PID"),
    ("ki", "a gain of the PID"),
    ("kp", "a gain of the PID"),
    ("order", "the power of a law"),
    ("range", "in the unit of the axis that is plotted"),
    ("reserve", "a share of the acceleration"),
    ("runner_up", "a share of the holes"),
    ("scale", "a factor"),
    ("score", "a share of the holes"),
    ("speed", "how many times faster than life"),
    ("step", "in the unit of the axis that is plotted"),
    ("x", "in the unit of the axis that is plotted"),
    ("y", "in the unit of the axis that is plotted"),
];

/// Whether a name says what its number counts: `…_mm`, `…_mm_per_s2`.
fn says(name: &str) -> bool {
    let words: Vec<&str> = name.split('_').collect();
    let last = words.last().is_some_and(|word| UNITS.contains(word));
    last || words.contains(&"per") || PLAIN.iter().any(|(plain, _)| *plain == name)
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

/// Public fields that do not say their unit.
#[derive(Default)]
struct Silent(Vec<String>);

impl Silent {
    fn field(&mut self, field: &syn::Field) {
        let name = field.ident.as_ref().map(ToString::to_string);
        self.0.extend(name.filter(|name| is_number(&field.ty) && !says(name)));
    }
}

impl<'ast> Visit<'ast> for Silent {
    fn visit_item_struct(&mut self, item: &'ast syn::ItemStruct) {
        let seen = |field: &&syn::Field| matches!(field.vis, syn::Visibility::Public(_));
        item.fields.iter().filter(seen).for_each(|field| self.field(field));
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
    let mut wrong = Vec::new();
    for path in files {
        let found = silent(&fs::read_to_string(&path).unwrap());
        wrong.extend(found.into_iter().map(|name| format!("{}: {name}", path.display())));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_rule_of_units_can_fail() {
    let text = "pub struct A { pub feed: f64, pub feed_mm_per_s: f64, own: f64, pub to: Option<[f64; 2]>, pub n: u8 }";
    assert_eq!(silent(text), ["feed", "to"]);
}
