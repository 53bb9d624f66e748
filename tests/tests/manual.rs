//! The manual: every link leads to a file and a heading, and the book has every page.

use annulus_tests::{files_below, root};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Markdown outside `docs` that links into it.
const BESIDE: [&str; 5] = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md"];

fn pages() -> Vec<PathBuf> {
    let beside = BESIDE.iter().map(|name| root().join(name));
    let manual = files_below(&root().join("docs")).into_iter();
    beside.chain(manual.filter(|path| path.extension().is_some_and(|ending| ending == "md"))).collect()
}

/// The text without code blocks and code spans, which may hold brackets.
fn prose(text: &str) -> String {
    let blocks = text.split("```").step_by(2).collect::<Vec<_>>().join("\n");
    blocks.split('`').step_by(2).collect::<Vec<_>>().join("")
}

/// Targets of the links to files of the repository.
fn links(text: &str) -> Vec<String> {
    let prose = prose(text);
    let targets = prose.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    let own = |target: &str| !target.contains("://") && !target.starts_with("mailto:");
    targets.map(|(target, _)| target.to_owned()).filter(|target| own(target)).collect()
}

/// Anchors of the headings, as GitHub and mdBook make them.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = text.split("```").step_by(2).flat_map(str::lines).filter(|line| line.starts_with('#'));
    let kept = |letter: &char| letter.is_alphanumeric() || " -_".contains(*letter);
    let slug = |line: &str| {
        let words = line.trim_start_matches('#').trim().to_lowercase();
        words.chars().filter(kept).map(|letter| if letter == ' ' { '-' } else { letter }).collect()
    };
    headings.map(slug).collect()
}

#[test]
fn links_of_the_manual_lead_somewhere() {
    let mut broken = Vec::new();
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        for link in links(&text) {
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() {
                page.clone()
            } else {
                page.parent().unwrap_or(Path::new(".")).join(file)
            };
            let leads = if anchor.is_empty() {
                target.exists()
            } else {
                fs::read_to_string(&target).is_ok_and(|text| anchors(&text).contains(anchor))
            };
            if !leads {
                broken.push(format!("{}: {link}", page.strip_prefix(root()).unwrap_or(&page).display()));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn book_has_every_page_once() {
    let folder = root().join("docs");
    let named = links(&fs::read_to_string(folder.join("SUMMARY.md")).unwrap());
    let once: BTreeSet<&String> = named.iter().collect();
    assert_eq!(once.len(), named.len(), "a page is named twice in docs/SUMMARY.md");
    let missing: Vec<String> = pages()
        .iter()
        .filter_map(|page| Some(page.strip_prefix(&folder).ok()?.to_str()?.replace('\\', "/")))
        .filter(|page| page != "SUMMARY.md" && !once.contains(page))
        .collect();
    assert!(missing.is_empty(), "not in docs/SUMMARY.md: {}", missing.join(", "));
}

#[test]
fn checker_sees_links_and_headings() {
    let text = "# A b, c!\n[x](one.md#two) `[y](no.md)`\n```\n# no\n[z](no.md)\n```\n[w](https://a.b/c.md)";
    assert_eq!(links(text), ["one.md#two"]);
    assert_eq!(anchors(text).into_iter().collect::<Vec<_>>(), ["a-b-c"]);
}
