//! The house rules of the page as a test: which folder of `app/src` may name which, and how
//! many things live as long as the page. The arrows are those that ARCHITECTURE.md draws.

use crate::floor_plan::{architecture, not_lower, only_drawn};
use crate::module_graph::{modules, target};

/// The sources of the page.
const PAGE: &str = "app/src";

/// What the browser is to a source: "the browser" in the table, and `leptos` by its own name.
const BROWSER: &[&str] = &["web_sys", "js_sys", "wasm_bindgen"];

/// Everything that lives as long as the page: the running page, and the pictures there are.
const MOST_STATICS: usize = 2;

#[test]
fn every_arrow_of_the_page_is_on_the_plan() {
    let plan = architecture("## The floors of app");
    let modules = modules(PAGE);
    let mut wrong = only_drawn(PAGE, &plan);
    let of_the_page = plan.iter().map(|(floor, may)| {
        let may = may.iter().filter(|name| *name != "the browser" && *name != "leptos").cloned();
        (floor.clone(), may.collect())
    });
    wrong.extend(not_lower(&of_the_page.collect()));
    for (module, names) in &modules {
        let Some(own) = module.first().filter(|own| *own != "bin") else { continue };
        let Some((_, may)) = plan.iter().find(|(floor, _)| floor == own) else {
            wrong.push(format!("{own} is not on the plan"));
            continue;
        };
        for path in &names.paths {
            let outside = path.first().map(String::as_str);
            let outside = outside.map(|name| if BROWSER.contains(&name) { "the browser" } else { name });
            let outside = outside.filter(|name| ["the browser", "leptos"].contains(name)).map(str::to_owned);
            let inside = target(module, path, &modules).and_then(|to| to.first()).cloned();
            if let Some(name) = outside.or(inside).filter(|name| name != own && !may.contains(name)) {
                wrong.push(format!("{} must not name {name}", module.join("/")));
            }
        }
    }
    wrong.dedup();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn little_lives_as_long_as_the_page() {
    let modules = modules(PAGE);
    let found: Vec<String> = modules
        .iter()
        .filter(|(_, names)| names.statics > 0)
        .map(|(module, names)| format!("{}: {}", module.join("/"), names.statics))
        .collect();
    let all: usize = modules.values().map(|names| names.statics).sum();
    assert!(all <= MOST_STATICS, "{all} statics, at most {MOST_STATICS}:\n{}", found.join("\n"));
}
