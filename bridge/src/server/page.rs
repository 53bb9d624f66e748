//! The page: prebuilt files embedded in the program, in a compression that the browser accepts.
//!
//! ```text
//! target/www/   index.html   app-1a2b3c4d.wasm   app-1a2b3c4d.wasm.br   app-1a2b3c4d.wasm.gz   …
//! ```
//!
//! Debug builds read the files from disk at every request.

use super::reply::Refused;
use annulus_core::code;
use annulus_core::locale;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use std::borrow::Cow;

#[derive(rust_embed::RustEmbed)]
#[folder = "../target/www/"]
struct Built;

/// A file's bytes and their SHA-256.
struct File {
    bytes: Cow<'static, [u8]>,
    hash: [u8; 32],
}

pub(crate) fn answer(path: &str, headers: &HeaderMap) -> Response {
    serve(path, headers, |name| {
        let file = Built::get(name)?;
        Some(File { hash: file.metadata.sha256_hash(), bytes: file.data })
    })
}

fn serve(path: &str, headers: &HeaderMap, find: impl Fn(&str) -> Option<File>) -> Response {
    let name = match path.trim_start_matches('/') {
        "" => "index.html",
        name => name,
    };
    // Hidden files of the build are not part of the page.
    if name.split('/').any(|part| part.starts_with('.')) {
        return missing();
    }
    let accepted = text(headers, &header::ACCEPT_ENCODING);
    let packings =
        [("br", ".br"), ("gzip", ".gz")].into_iter().filter(|(coding, _)| accepts(accepted, coding));
    let packed =
        packings.into_iter().find_map(|(coding, ending)| Some((find(&format!("{name}{ending}"))?, coding)));
    let Some((file, coding)) = packed.or_else(|| find(name).map(|file| (file, ""))) else {
        return if name == "index.html" { not_built() } else { missing() };
    };
    let hash: String = file.hash.iter().take(12).map(|byte| format!("{byte:02x}")).collect();
    let tag = format!("\"{hash}{coding}\"");
    let known = text(headers, &header::IF_NONE_MATCH)
        .split(',')
        .any(|one| one.trim().trim_start_matches("W/") == tag);
    let mut response = if known {
        StatusCode::NOT_MODIFIED.into_response()
    } else {
        (StatusCode::OK, file.bytes).into_response()
    };
    let out = response.headers_mut();
    out.remove(header::CONTENT_TYPE);
    if !known {
        out.insert(header::CONTENT_TYPE, HeaderValue::from_static(kind(name)));
        if !coding.is_empty() {
            out.insert(header::CONTENT_ENCODING, HeaderValue::from_static(coding));
        }
    }
    out.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    let keep = if has_hash(name) { "public, max-age=31536000, immutable" } else { "no-cache" };
    out.insert(header::CACHE_CONTROL, HeaderValue::from_static(keep));
    if let Ok(tag) = HeaderValue::from_str(&tag) {
        out.insert(header::ETAG, tag);
    }
    response
}

fn text<'a>(headers: &'a HeaderMap, name: &header::HeaderName) -> &'a str {
    headers.get(name).and_then(|value| value.to_str().ok()).unwrap_or_default()
}

/// Returns `true` if the `Accept-Encoding` header `accepted` names `coding`, not with weight 0.
fn accepts(accepted: &str, coding: &str) -> bool {
    accepted.split(',').any(|one| {
        let mut parts = one.split(';').map(str::trim);
        let named = parts.next().is_some_and(|name| name.eq_ignore_ascii_case(coding));
        let weight = parts
            .find_map(|part| part.strip_prefix("q="))
            .map_or(1.0, |weight| weight.parse().unwrap_or(0.0));
        named && weight > 0.0
    })
}

/// Returns `true` if the name contains a hash of the content, like `app-1a2b3c4d.wasm`: such a file never
/// changes.
fn has_hash(name: &str) -> bool {
    name.split(['-', '.', '_', '/'])
        .any(|part| part.len() >= 8 && part.bytes().all(|byte| byte.is_ascii_hexdigit()))
}

fn kind(name: &str) -> &'static str {
    match name.rsplit_once('.').map(|(_, ending)| ending) {
        Some("html") => "text/html; charset=utf-8",
        Some("js" | "mjs") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("wasm") => "application/wasm",
        Some("json") => "application/json",
        Some("webmanifest") => "application/manifest+json",
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        Some("ico") => "image/x-icon",
        Some("woff2") => "font/woff2",
        Some("txt" | "drl" | "toml") => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

fn not_built() -> Response {
    let sentence = |part| locale::text("en", &format!("serve.not_built.{part}"), &[]);
    let text = format!("{}\n{}\n", sentence("message"), sentence("advice"));
    let plain = [(header::CONTENT_TYPE, "text/plain; charset=utf-8"), (header::CACHE_CONTROL, "no-store")];
    (StatusCode::SERVICE_UNAVAILABLE, plain, text).into_response()
}

fn missing() -> Response {
    Refused::new(StatusCode::NOT_FOUND, code!("door.nothing_here")).into_response()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn find(name: &str) -> Option<File> {
        let files = [
            "index.html",
            "index.html.gz",
            "app-0123abcd.wasm",
            "app-0123abcd.wasm.br",
            "app-0123abcd.wasm.gz",
        ];
        let index = files.iter().position(|file| *file == name)?;
        Some(File { bytes: Cow::Owned(name.as_bytes().to_vec()), hash: [u8::try_from(index).unwrap(); 32] })
    }

    fn get(path: &str, rows: &[(&'static str, &str)]) -> Response {
        let mut headers = HeaderMap::new();
        for (name, value) in rows {
            headers.insert(*name, value.parse().unwrap());
        }
        serve(path, &headers, find)
    }

    #[test]
    fn files_use_an_encoding_that_the_browser_accepts() {
        let rows = [
            ("/", "", "", "text/html; charset=utf-8", "no-cache"),
            ("/", "br", "", "text/html; charset=utf-8", "no-cache"),
            ("/index.html", "gzip, br", "gzip", "text/html; charset=utf-8", "no-cache"),
            ("/app-0123abcd.wasm", "", "", "application/wasm", "public, max-age=31536000, immutable"),
            (
                "/app-0123abcd.wasm",
                "gzip, deflate, br",
                "br",
                "application/wasm",
                "public, max-age=31536000, immutable",
            ),
            (
                "/app-0123abcd.wasm",
                "br;q=0, gzip;q=0.5",
                "gzip",
                "application/wasm",
                "public, max-age=31536000, immutable",
            ),
        ];
        for (path, accepted, coding, kind, keep) in rows {
            let response = get(path, &[("accept-encoding", accepted)]);
            let value = |name| text(response.headers(), &name).to_owned();
            assert_eq!(response.status(), StatusCode::OK);
            assert_eq!(value(header::CONTENT_ENCODING), coding, "{path} {accepted}");
            assert_eq!(value(header::CONTENT_TYPE), kind, "{path}");
            assert_eq!(value(header::CACHE_CONTROL), keep, "{path}");
            assert_eq!(value(header::VARY), "accept-encoding");
        }
    }

    #[test]
    fn cached_file_gets_not_modified() {
        let first = get("/", &[("accept-encoding", "gzip")]);
        let tag = text(first.headers(), &header::ETAG).to_owned();
        let again =
            get("/", &[("accept-encoding", "gzip"), ("if-none-match", &format!("\"other\", W/{tag}"))]);
        assert_eq!(again.status(), StatusCode::NOT_MODIFIED);
        assert_eq!(
            get("/", &[("if-none-match", &tag)]).status(),
            StatusCode::OK,
            "another packing is another answer"
        );
    }

    #[test]
    fn missing_files_are_not_found_and_an_unbuilt_page_is_503() {
        assert_eq!(get("/other.js", &[]).status(), StatusCode::NOT_FOUND);
        assert_eq!(get("/../Cargo.toml", &[]).status(), StatusCode::NOT_FOUND);
        let hidden = |_: &str| Some(File { bytes: Cow::Borrowed(&b"-"[..]), hash: [0; 32] });
        for path in ["/.stamp", "/locales/.x", "/.well-known/x"] {
            assert_eq!(serve(path, &HeaderMap::new(), hidden).status(), StatusCode::NOT_FOUND, "{path}");
        }
        let unbuilt = serve("/", &HeaderMap::new(), |_| None);
        assert_eq!(unbuilt.status(), StatusCode::SERVICE_UNAVAILABLE);
        assert_eq!(text(unbuilt.headers(), &header::CONTENT_TYPE), "text/plain; charset=utf-8");
    }

    #[test]
    fn file_names_with_hashes_are_recognized() {
        let rows = [
            ("app-0123abcd.wasm", true),
            ("app-0123abcd_bg.wasm", true),
            ("index.html", false),
            ("examples/board-7.drl", false),
            ("snippets/x-0011223344556677/inline0.js", true),
        ];
        for (name, expected) in rows {
            assert_eq!(has_hash(name), expected, "{name}");
        }
    }
}
