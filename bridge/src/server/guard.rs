//! Checks every request before routing, and adds the security headers to every response.
//!
//! ```text
//! request ─▶ Host exactly ours? ─▶ no browser from elsewhere? ─▶ Origin exactly ours? ─▶ routing
//!               │ no                   │ no                         │ no
//!               └──────────────── 403, one sentence ◀──────────────┘
//! ```
//!
//! A page of another site can make a browser send requests here, but cannot forge `Host`, `Origin` or
//! `Sec-Fetch-Site`. DNS rebinding to 127.0.0.1 shows in `Host`.

use super::reply::Refused;
use annulus_core::code;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, Request, StatusCode, header};

/// Path of the socket; even without an upgrade header it is checked like one.
pub(crate) const SOCKET_PATH: &str = "/api/socket";

/// The names that this bridge answers to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Names {
    hosts: Vec<String>,
    origins: Vec<String>,
}

impl Names {
    pub(crate) fn new(port: u16) -> Self {
        let mut hosts: Vec<String> =
            ["127.0.0.1", "localhost", "[::1]"].map(|name| format!("{name}:{port}")).into();
        // Browsers leave the default port out.
        if port == 80 {
            hosts.extend(["127.0.0.1", "localhost", "[::1]"].map(str::to_owned));
        }
        let origins = hosts.iter().map(|host| format!("http://{host}")).collect();
        Self { hosts, origins }
    }
}

pub(crate) fn check<B>(names: &Names, request: &Request<B>) -> Result<(), Refused> {
    let headers = request.headers();
    let refused = |code| Refused::new(StatusCode::FORBIDDEN, code);
    let target = request.uri().authority();
    // A foreign name that points to this computer (DNS rebinding) shows here.
    match only(headers, &header::HOST) {
        Ok(Some(host))
            if names.hosts.iter().any(|name| name == host) && target.is_none_or(|name| name == host) => {}
        _ => return Err(refused(code!("door.host"))),
    }
    match only(headers, &HeaderName::from_static("sec-fetch-site")) {
        // Older browsers and command-line tools send no such header.
        Ok(None | Some("same-origin" | "none")) => {}
        _ => return Err(refused(code!("door.cross_site"))),
    }
    let reading = matches!(*request.method(), Method::GET | Method::HEAD);
    // Browsers let any site open a socket, and only `Origin` tells which.
    let upgrade = headers.contains_key(header::UPGRADE) || request.uri().path() == SOCKET_PATH;
    match only(headers, &header::ORIGIN) {
        Ok(Some(origin)) if names.origins.iter().any(|name| name == origin) => Ok(()),
        Ok(None) if reading && !upgrade => Ok(()),
        _ => Err(refused(code!("door.origin"))),
    }
}

/// The value of a header that may occur once; an error if it occurs twice or is no text.
fn only<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Result<Option<&'a str>, ()> {
    let mut values = headers.get_all(name).iter();
    match (values.next(), values.next()) {
        (None, _) => Ok(None),
        (Some(value), None) => value.to_str().map(Some).map_err(|_| ()),
        // With two values, a proxy and this server might each believe another one.
        _ => Err(()),
    }
}

pub(crate) fn policy(port: u16) -> String {
    format!(
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; \
         connect-src 'self' ws://127.0.0.1:{port} ws://localhost:{port}; worker-src 'self'; \
         manifest-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'; \
         require-trusted-types-for 'script'; trusted-types annulus"
    )
}

/// Adds headers that protect the page from other sites, and confine it.
pub(crate) fn dress(headers: &mut HeaderMap, policy: &HeaderValue) {
    headers.insert(header::CONTENT_SECURITY_POLICY, policy.clone());
    for (name, value) in [
        ("cross-origin-opener-policy", "same-origin"),
        ("cross-origin-embedder-policy", "require-corp"),
        ("cross-origin-resource-policy", "same-origin"),
        ("x-content-type-options", "nosniff"),
        ("referrer-policy", "no-referrer"),
        ("permissions-policy", "serial=(self), usb=()"),
    ] {
        headers.insert(HeaderName::from_static(name), HeaderValue::from_static(value));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(method: &str, uri: &str, headers: &[(&str, &str)]) -> Option<String> {
        let mut request = Request::builder().method(method).uri(uri);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        check(&Names::new(7425), &request.body(()).unwrap()).err().map(|refused| refused.why.code)
    }

    #[test]
    fn host_header_must_name_the_bridge() {
        let rows = [
            ("127.0.0.1:7425", true),
            ("localhost:7425", true),
            ("[::1]:7425", true),
            ("127.0.0.1", false),
            ("127.0.0.1:7426", false),
            ("LOCALHOST:7425", false),
            ("localhost.:7425", false),
            ("0.0.0.0:7425", false),
            ("[::ffff:127.0.0.1]:7425", false),
            ("::1:7425", false),
            ("evil.example:7425", false),
            ("127.0.0.1:7425.evil.example", false),
            ("evil.example@127.0.0.1:7425", false),
            ("", false),
        ];
        for (host, good) in rows {
            assert_eq!(verdict("GET", "/", &[("host", host)]).is_none(), good, "{host}");
        }
        assert_eq!(verdict("GET", "/", &[]).as_deref(), Some("door.host"));
        let twice = [("host", "127.0.0.1:7425"), ("host", "evil.example")];
        assert_eq!(verdict("GET", "/", &twice).as_deref(), Some("door.host"));
        let rows = [("http://127.0.0.1:7425/", true), ("http://evil.example/", false)];
        for (uri, good) in rows {
            assert_eq!(verdict("GET", uri, &[("host", "127.0.0.1:7425")]).is_none(), good, "{uri}");
        }
    }

    #[test]
    fn origin_header_must_name_the_bridge() {
        const OURS: &str = "http://127.0.0.1:7425";
        let rows: [(&str, &str, Option<&str>, bool, bool); 15] = [
            ("GET", "/", None, false, true),
            ("HEAD", "/", None, false, true),
            ("GET", "/", Some(OURS), false, true),
            ("GET", "/", Some("https://evil.example"), false, false),
            ("GET", "/", Some("null"), false, false),
            ("GET", "/api/socket", None, true, false),
            ("GET", "/api/socket", None, false, false),
            ("GET", "/", None, true, false),
            ("GET", "/api/socket", Some("null"), true, false),
            ("GET", "/api/socket", Some("http://[::1]:7425"), true, true),
            ("GET", "/api/socket", Some("https://127.0.0.1:7425"), true, false),
            ("POST", "/api/pair", None, false, false),
            ("POST", "/api/pair", Some(OURS), false, true),
            ("PUT", "/api/jobs/1", Some("http://127.0.0.1:7426"), false, false),
            ("OPTIONS", "/api/pair", Some("https://evil.example"), false, false),
        ];
        for (method, uri, origin, upgrade, good) in rows {
            let mut headers = vec![("host", "127.0.0.1:7425")];
            headers.extend(origin.map(|origin| ("origin", origin)));
            headers.extend(upgrade.then_some(("upgrade", "websocket")));
            let expected = if good { None } else { Some("door.origin".to_owned()) };
            assert_eq!(verdict(method, uri, &headers), expected, "{method} {uri} {origin:?} {upgrade}");
        }
    }

    #[test]
    fn cross_site_requests_are_refused() {
        for (site, good) in
            [("same-origin", true), ("none", true), ("same-site", false), ("cross-site", false), ("", false)]
        {
            let headers = [("host", "localhost:7425"), ("sec-fetch-site", site)];
            assert_eq!(verdict("GET", "/", &headers).is_none(), good, "{site}");
        }
    }
}
