//! What happens, is asked or is ordered says what its values are: `LegDone { cut, last }`, not `LegDone(bool, bool)`.
//!
//! Comes in: the sources. Goes out: variants of public enums of events that carry two values or more, or a bare bool or number,
//! without names. Does not read enums that say what a thing is (`Mark::Hole(3)`).

use crate::floor_plan::rust_files;
use annulus_tests::root;
use std::fs;
use syn::visit::{self, Visit};

/// How names of enums of events end.
const ENDINGS: &[&str] = &[
    "Act",
    "Action",
    "Answer",
    "Ask",
    "Asked",
    "Edit",
    "Effect",
    "Ended",
    "Event",
    "Heard",
    "Instruction",
    "Key",
    "Message",
    "Next",
    "Order",
    "Outcome",
    "Record",
    "Report",
    "Request",
    "Rest",
    "Said",
    "Stride",
    "Switching",
    "Tell",
    "Told",
    "Written",
];

/// Types that say nothing of what their value is.
const BARE: &[&str] =
    &["bool", "f32", "f64", "i8", "i16", "i32", "i64", "isize", "u8", "u16", "u32", "u64", "usize"];

fn is_bare(kind: &syn::Type) -> bool {
    match kind {
        syn::Type::Array(array) => is_bare(&array.elem),
        syn::Type::Tuple(_) => true,
        syn::Type::Path(path) => path.path.segments.last().is_some_and(|last| match &last.arguments {
            syn::PathArguments::AngleBracketed(inner) if last.ident == "Option" => {
                inner.args.iter().any(|one| matches!(one, syn::GenericArgument::Type(kind) if is_bare(kind)))
            }
            _ => BARE.iter().any(|bare| last.ident == bare),
        }),
        _ => false,
    }
}

fn is_of_events(name: &str) -> bool {
    ENDINGS.iter().any(|ending| name.ends_with(ending))
}

/// Variants whose values have no names, as `Enum::Variant`; and how many enums of events there are.
#[derive(Default)]
struct Nameless {
    variants: Vec<String>,
    enums: usize,
}

impl<'ast> Visit<'ast> for Nameless {
    fn visit_item_enum(&mut self, item: &'ast syn::ItemEnum) {
        if matches!(item.vis, syn::Visibility::Inherited) || !is_of_events(&item.ident.to_string()) {
            return;
        }
        self.enums += 1;
        for variant in &item.variants {
            if let syn::Fields::Unnamed(fields) = &variant.fields
                && (fields.unnamed.len() > 1 || fields.unnamed.iter().any(|field| is_bare(&field.ty)))
            {
                self.variants.push(format!("{}::{}", item.ident, variant.ident));
            }
        }
        visit::visit_item_enum(self, item);
    }
}

fn nameless(text: &str) -> Nameless {
    let mut found = Nameless::default();
    found.visit_file(&syn::parse_file(text).unwrap());
    found
}

#[test]
fn values_of_events_have_names() {
    let mut files = Vec::new();
    for folder in ["core/src", "drill/src", "link/src", "app/src", "bridge/src"] {
        rust_files(&root().join(folder), &mut files);
    }
    let (mut wrong, mut enums) = (Vec::new(), 0);
    for path in files {
        let found = nameless(&fs::read_to_string(&path).unwrap());
        enums += found.enums;
        wrong.extend(found.variants.into_iter().map(|variant| format!("{}: {variant}", path.display())));
    }
    assert!(enums > 30, "{enums} enums of events: they were not found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_rule_of_named_values_can_fail() {
    let text = "pub enum Event { Done(bool, bool), Late(u64), To([i64; 2]), By(Option<u8>), Pair((A, B)), Bytes(Vec<u8>), Ask(Ask), At { x: u8 }, End }
        pub(crate) enum DrawKey { Side(bool) } enum Ask { Own(bool) } pub enum Mark { Hole(u32) }";
    let found = nameless(text);
    assert_eq!(
        found.variants,
        ["Event::Done", "Event::Late", "Event::To", "Event::By", "Event::Pair", "DrawKey::Side"]
    );
    assert_eq!(found.enums, 2);
}
