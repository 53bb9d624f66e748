//! Builds the page as a static site for any file server: no bridge, installable, and usable offline after
//! the first visit.
//!
//! ```text
//! target/www ─ files as they are ─▶ target/site        index.html is marked as having no bridge
//!                                                      service-worker.js gets the digest of every file
//! ```

use crate::page::{self, Effort};
use crate::sh::{Done, root, say};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    root().join("target/site")
}

/// First tag of the page, and its replacement for a site.
const OPENING: (&str, &str) = ("<html lang=\"en\">", "<html lang=\"en\" data-alone=\"true\">");

const LIST: &str = "const SITE = { version: \"\", files: {} };";

/// The service worker, which caches the other files.
const KEEPER: &str = "service-worker.js";

pub(crate) fn build(effort: Effort) -> Done<PathBuf> {
    let page = page::build(effort)?;
    write(&page, &folder())?;
    say(&format!("The site is in {}: put it on any server of files", folder().display()));
    Ok(folder())
}

fn write(page: &Path, site: &Path) -> Done {
    let failed = |place: &Path| {
        let place = place.display().to_string();
        move |error: std::io::Error| format!("{place}: {error}.")
    };
    let _ = fs::remove_dir_all(site);
    let mut digests = BTreeMap::new();
    let mut keeper = None;
    for file in page::files_below(page) {
        let Some(name) = file.strip_prefix(page).ok().and_then(Path::to_str) else { continue };
        if name.starts_with('.') || name.ends_with(".br") || name.ends_with(".gz") {
            continue;
        }
        let mut bytes = fs::read(&file).map_err(failed(&file))?;
        match name {
            KEEPER => {
                keeper = Some(bytes);
                continue;
            }
            "index.html" => bytes = replaced(&bytes, OPENING.0, OPENING.1, name)?,
            _ => {}
        }
        put(&site.join(name), &bytes)?;
        digests.insert(name.replace('\\', "/"), format!("{:x}", Sha256::digest(&bytes)));
    }
    let keeper = keeper.ok_or_else(|| format!("{KEEPER} is not in the page."))?;
    put(&site.join(KEEPER), &replaced(&keeper, LIST, &list(&digests), KEEPER)?)
}

fn list(digests: &BTreeMap<String, String>) -> String {
    let rows: Vec<_> = digests.iter().map(|(name, digest)| format!("{name:?}: {digest:?}")).collect();
    let rows = rows.join(", ");
    let version = format!("{:x}", Sha256::digest(&rows));
    format!("const SITE = {{ version: {:?}, files: {{ {rows} }} }};", &version[..16])
}

/// Replaces `before` in `bytes` by `now`; `before` must occur exactly once.
fn replaced(bytes: &[u8], before: &str, now: &str, name: &str) -> Done<Vec<u8>> {
    let text = String::from_utf8_lossy(bytes);
    if text.matches(before).count() != 1 {
        return Err(format!("{name} has no line {before:?}, or more than one."));
    }
    Ok(text.replacen(before, now, 1).into_bytes())
}

fn put(place: &Path, bytes: &[u8]) -> Done {
    let failed = |error: std::io::Error| format!("{}: {error}.", place.display());
    fs::create_dir_all(place.parent().unwrap_or(place)).map_err(failed)?;
    fs::write(place, bytes).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn site_is_marked_standalone_and_lists_every_other_file() {
        let www = root().join("www");
        let names = ["index.html", KEEPER, "boot.js", "icons/annulus.svg"];
        let at = std::env::temp_dir().join(format!("annulus-site-{}", std::process::id()));
        let (page, site) = (at.join("page"), at.join("site"));
        for name in names {
            put(&page.join(name), &fs::read(www.join(name)).unwrap()).unwrap();
        }
        put(&page.join("boot.js.br"), b"packed").unwrap();
        put(&page.join(".stamp"), b"-").unwrap();
        let written = || {
            write(&page, &site).unwrap();
            fs::read_to_string(site.join(KEEPER)).unwrap()
        };
        let first = written();
        assert!(fs::read_to_string(site.join("index.html")).unwrap().contains("data-alone"));
        for name in ["index.html", "boot.js", "icons/annulus.svg"] {
            let digest = format!("{:x}", Sha256::digest(fs::read(site.join(name)).unwrap()));
            assert!(first.contains(&format!("{name:?}: {digest:?}")), "{name}");
        }
        assert!(!first.contains("boot.js.br") && !first.contains(".stamp") && !site.join(".stamp").exists());
        assert_eq!(written(), first, "the same page is the same site");
        put(&page.join("boot.js"), b"// another").unwrap();
        assert_ne!(written(), first, "another page is another site");
        put(&page.join("index.html"), b"<html>").unwrap();
        assert!(write(&page, &site).is_err(), "an index that cannot be marked");
        fs::remove_dir_all(at).unwrap();
    }
}
