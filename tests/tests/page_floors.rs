//! Rules of the page: the allowed dependencies between folders of `app/src`, from ARCHITECTURE.md, and the
//! number of statics.

use crate::floor_plan::{architecture, not_lower, only_drawn};
use crate::module_graph::{modules, target};

const PAGE: &str = "app/src";

/// Crates that count as "the browser" in the table; `leptos` has its own row.
const BROWSER: &[&str] = &["web_sys", "js_sys", "wasm_bindgen"];

/// The only statics: the running page, and the list of pictures.
const MOST_STATICS: usize = 2;

#[test]
fn every_page_module_dependency_is_in_the_plan() {
    let plan = architecture("## Modules of app");
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
fn page_has_few_statics() {
    let modules = modules(PAGE);
    let found: Vec<String> = modules
        .iter()
        .filter(|(_, names)| names.statics > 0)
        .map(|(module, names)| format!("{}: {}", module.join("/"), names.statics))
        .collect();
    let all: usize = modules.values().map(|names| names.statics).sum();
    assert!(all <= MOST_STATICS, "{all} statics, at most {MOST_STATICS}:\n{}", found.join("\n"));
}

/// Requests of the screens that move or start something.
const MOVING: &[&str] = &[
    "Ask::Home)",
    "Ask::Park)",
    "Ask::Resume",
    "Ask::LiftTool",
    "Ask::ToolChanged)",
    "Ask::Probe",
    "Ask::OpenClamp",
    "Ask::ToolSeen",
    "Ask::Output {",
    "go(Mode::",
    "StartEvent::Start)",
    "LevelEvent::Touch)",
    "TouchOffEvent::Touch)",
    "HandEvent::Down {",
    "HandEvent::LiftFirst",
];
/// A guarded button is at most this many lines before or after its request.
const NEAR_LINES: usize = 24;

#[test]
fn moving_commands_are_sent_by_guarded_controls() {
    let mut wrong = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    for (path, text) in screens() {
        let lines: Vec<&str> = text.lines().collect();
        for (at, line) in lines.iter().enumerate() {
            let Some(word) = MOVING.iter().find(|word| line.contains(**word)) else { continue };
            seen.insert(*word);
            let near = &lines[at.saturating_sub(NEAR_LINES)..lines.len().min(at + NEAR_LINES)];
            let is_guarded = |line: &&str| line.contains("push_guarded(") || line.contains("\"data-moves\"");
            if !near.iter().any(is_guarded) {
                wrong.push(format!("{path}:{}: {}", at + 1, line.trim()));
            }
        }
    }
    assert!(wrong.is_empty(), "not guarded against a press that comes too soon:\n{}", wrong.join("\n"));
    let gone: Vec<_> = MOVING.iter().filter(|word| !seen.contains(*word)).collect();
    assert!(gone.is_empty(), "no screen sends {gone:?}");
}

/// Path and text of each source file of the screens.
fn screens() -> Vec<(String, String)> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../app/src/screens");
    let (mut folders, mut files) = (vec![root], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                files.push((path.display().to_string(), std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    files
}
