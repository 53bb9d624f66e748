//! A separate bridge for every test, and a minimal client that can break the rules.

use annulus_core::wire::{Ask, Control, PROOF_HEADER, PROTOCOL, SESSION_HEADER, Tell, auth};
use serde_json::{Value, json};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;
use tempfile::TempDir;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// Longest wait for anything; long, because test computers are busy.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

/// The command `annulus` with `home` as its only home.
pub(crate) fn annulus(home: &TempDir, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_annulus"));
    command.args(arguments).env("ANNULUS_HOME", home.path()).env_remove("XDG_RUNTIME_DIR");
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command
}

pub(crate) fn output(home: &TempDir, arguments: &[&str]) -> (i32, Value, String) {
    let Output { status, stdout, stderr } = annulus(home, arguments).output().unwrap();
    let object = serde_json::from_slice(&stdout).unwrap_or(Value::Null);
    (status.code().unwrap_or(-1), object, String::from_utf8_lossy(&stderr).into_owned())
}

pub(crate) struct Running {
    pub(crate) child: Child,
    pub(crate) home: Option<TempDir>,
    pub(crate) port: u16,
    pub(crate) token: String,
    /// Text output of bridge and executor; printed if the test fails.
    said: File,
}

impl Running {
    pub(crate) fn start() -> Self {
        Self::start_in(TempDir::new().unwrap())
    }

    pub(crate) fn start_in(home: TempDir) -> Self {
        Self::start_at(home, "1")
    }

    pub(crate) fn start_at(home: TempDir, speed: &str) -> Self {
        let command = annulus(&home, &["serve", "--port", "0", "--no-open", "--time-scale", speed]);
        Self::of(command, home)
    }

    pub(crate) fn of(mut command: Command, home: TempDir) -> Self {
        let said = tempfile::tempfile().unwrap();
        command.stdout(Stdio::piped()).stderr(said.try_clone().unwrap());
        let mut child = command.spawn().unwrap();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        out.read_line(&mut line).unwrap();
        let (port, token) = take_apart(line.trim_end());
        Self { child, home: Some(home), port, token, said }
    }

    pub(crate) fn origin(&self) -> String {
        format!("http://127.0.0.1:{}", self.port)
    }

    /// A request like those of our own page.
    pub(crate) fn own(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Reply {
        let origin = self.origin();
        let mut all = vec![("origin", origin.as_str())];
        all.extend(headers);
        self.raw(method, path, &all, body)
    }

    /// A request with exactly these headers, and `Host` if it is not among them.
    pub(crate) fn raw(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Reply {
        let mut head =
            format!("{method} {path} HTTP/1.1\r\nconnection: close\r\ncontent-length: {}\r\n", body.len());
        if !headers.iter().any(|(name, _)| *name == "host") {
            head += &format!("host: 127.0.0.1:{}\r\n", self.port);
        }
        for (name, value) in headers {
            head += &format!("{name}: {value}\r\n");
        }
        head += "\r\n";
        let mut stream = self.connect();
        let _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(body));
        Reply::read(&mut stream)
    }

    pub(crate) fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    pub(crate) fn link(&self, scope: &str) -> String {
        let (code, object, text) = output(self.home.as_ref().unwrap(), &["link", "--json", "--scope", scope]);
        assert_eq!(code, 0, "{text}");
        let (port, token) = take_apart(object["url"].as_str().unwrap());
        assert_eq!(port, self.port);
        token
    }

    pub(crate) fn pair(&self, scope: &str) -> (String, String) {
        let token = self.link(scope);
        let reply = self.own("POST", "/api/pair", &[], json!({ "token": token }).to_string().as_bytes());
        assert_eq!(reply.status, 200, "{}", reply.text());
        let object = reply.json();
        let text = |name: &str| object[name].as_str().unwrap().to_owned();
        (text("session"), text("key"))
    }

    pub(crate) fn job(&self, (session, key): (&str, &str), method: &str, name: &str, body: &[u8]) -> Reply {
        let path = format!("/api/jobs/{name}");
        let proof = auth::request(key, method, &path);
        self.own(method, &path, &[(SESSION_HEADER, session), (PROOF_HEADER, &proof)], body)
    }

    pub(crate) fn stranger(&self) -> Page {
        Page { session: String::new(), key: String::new(), socket: self.upgrade(&[]).unwrap() }
    }

    /// A socket up to the challenge, with `headers` added; an empty value removes the header.
    pub(crate) fn upgrade(&self, headers: &[(&'static str, &str)]) -> Result<WebSocket<TcpStream>, u16> {
        self.call("", headers)
    }

    pub(crate) fn upgrade_of(&self, session: &str) -> WebSocket<TcpStream> {
        self.call(&format!("?session={session}"), &[]).unwrap()
    }

    fn call(&self, query: &str, headers: &[(&'static str, &str)]) -> Result<WebSocket<TcpStream>, u16> {
        let address = format!("ws://127.0.0.1:{}/api/socket{query}", self.port);
        let mut request = address.into_client_request().unwrap();
        request.headers_mut().insert("origin", self.origin().parse().unwrap());
        for (name, value) in headers {
            if value.is_empty() {
                request.headers_mut().remove(*name);
            } else {
                request.headers_mut().insert(*name, value.parse().unwrap());
            }
        }
        match tungstenite::client(request, self.connect()) {
            Ok((socket, _)) => Ok(socket),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(reply))) => {
                Err(reply.status().as_u16())
            }
            Err(error) => panic!("{error}"),
        }
    }

    pub(crate) fn page(&self) -> Page {
        self.page_that_may("configure")
    }

    pub(crate) fn page_that_may(&self, scope: &str) -> Page {
        let (session, key) = self.pair(scope);
        let mut page = Page { session, key, socket: self.upgrade(&[]).unwrap() };
        let nonce = page.nonce();
        page.hello(&page.session.clone(), &auth::hello(&page.key, &nonce));
        page.until(|tell| matches!(tell, Tell::Welcome { .. }));
        page
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let ended = self.child.try_wait();
        let _ = self.child.kill();
        let _ = self.child.wait();
        if std::thread::panicking() {
            let mut text = String::new();
            let _ = self.said.rewind().and_then(|()| self.said.read_to_string(&mut text));
            println!("the bridge on port {} had ended: {ended:?}; it said:\n{text}", self.port);
        }
    }
}

pub(crate) fn take_apart(url: &str) -> (u16, String) {
    let rest = url.strip_prefix("http://127.0.0.1:").unwrap_or_else(|| panic!("{url}"));
    let (port, token) = rest.split_once("/#t=").unwrap();
    (port.parse().unwrap(), token.to_owned())
}

#[derive(Debug)]
pub(crate) struct Reply {
    pub(crate) status: u16,
    pub(crate) headers: Vec<(String, String)>,
    pub(crate) body: Vec<u8>,
}

impl Reply {
    /// Reads to the end of the connection; status 0 if it ended without a response.
    pub(crate) fn read(stream: &mut TcpStream) -> Self {
        let mut bytes = Vec::new();
        let _ = stream.read_to_end(&mut bytes);
        let end = bytes.windows(4).position(|four| four == b"\r\n\r\n").unwrap_or(bytes.len());
        let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
        let mut lines = head.lines();
        let status = lines.next().and_then(|line| line.split(' ').nth(1)?.parse().ok()).unwrap_or(0);
        let headers = lines.filter_map(|line| line.split_once(": "));
        let headers = headers.map(|(name, value)| (name.to_ascii_lowercase(), value.to_owned())).collect();
        Self { status, headers, body: bytes[(end + 4).min(bytes.len())..].to_vec() }
    }

    pub(crate) fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|_| panic!("no object: {self:?}"))
    }

    pub(crate) fn header(&self, name: &str) -> &str {
        self.headers.iter().find(|(key, _)| key == name).map_or("", |(_, value)| value)
    }

    /// The code of a refusal; checks that it is complete: message, advice, all headers.
    pub(crate) fn code(&self) -> String {
        let object = self.json();
        assert_eq!(object["ok"], false, "{object}");
        for part in ["message", "advice"] {
            let text = object["error"][part].as_str().unwrap();
            assert!(text.ends_with('.') && text.contains(' ') && !text.contains('{'), "{object}");
        }
        object["error"]["code"].as_str().unwrap().to_owned()
    }
}

pub(crate) struct Page {
    pub(crate) session: String,
    pub(crate) key: String,
    pub(crate) socket: WebSocket<TcpStream>,
}

impl Page {
    pub(crate) fn nonce(&mut self) -> String {
        match self.next() {
            Some(Tell::Challenge { nonce, .. }) => nonce,
            other => panic!("{other:?}"),
        }
    }

    pub(crate) fn hello(&mut self, session: &str, proof: &str) {
        let (session, proof) = (session.to_owned(), proof.to_owned());
        self.ask(&Ask::Hello { proto: PROTOCOL, min: 1, app: "test".into(), session, proof });
    }

    pub(crate) fn ask(&mut self, ask: &Ask) {
        self.say(&serde_json::to_string(ask).unwrap());
    }

    /// Sends any text. A closed socket is noticed when reading.
    pub(crate) fn say(&mut self, text: &str) {
        let _ = self.socket.send(Message::text(text));
    }

    pub(crate) fn next(&mut self) -> Option<Tell> {
        self.hear().ok()
    }

    /// The next report, or how the bridge closed the connection.
    fn hear(&mut self) -> Result<Tell, String> {
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => return Ok(serde_json::from_str(&text).unwrap()),
                Ok(Message::Close(frame)) => return Err(format!("by {frame:?}")),
                Ok(_) => {}
                // Interrupted by a signal.
                Err(tungstenite::Error::Io(error)) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(tungstenite::Error::Io(error)) if error.kind() == std::io::ErrorKind::WouldBlock => {
                    panic!("nothing came in {PATIENCE:?}");
                }
                Err(error) => return Err(format!("by {error}")),
            }
        }
    }

    pub(crate) fn until_ended(&mut self) -> Tell {
        self.until(|tell| matches!(tell, Tell::Ended(_)))
    }

    /// The first report that is `wanted`. Keeps control alive while waiting.
    pub(crate) fn until(&mut self, wanted: impl Fn(&Tell) -> bool) -> Tell {
        let (mut seen, mut alarm) = (Vec::new(), None);
        for _ in 0..2_000 {
            match self.hear() {
                Ok(tell) if wanted(&tell) => return tell,
                Ok(Tell::Status(status)) => {
                    alarm = status.alarm;
                    self.ask(&Ask::Ping { stamp: 0.0 });
                }
                Ok(Tell::Pong { .. }) => {}
                Ok(tell) => seen.push(tell),
                Err(how) => panic!("closed {how} after {seen:?}"),
            }
        }
        panic!("not among {seen:?}, alarm {alarm:?}");
    }

    pub(crate) fn refusal(&mut self) -> String {
        match self.until(|tell| matches!(tell, Tell::Refused { .. })) {
            Tell::Refused { why } => why.code,
            other => panic!("{other:?}"),
        }
    }

    /// Codes of the refusals until the bridge closes the connection.
    pub(crate) fn last_words(&mut self) -> Vec<String> {
        let tells = std::iter::from_fn(|| self.next());
        tells
            .filter_map(|tell| if let Tell::Refused { why } = tell { Some(why.code) } else { None })
            .collect()
    }

    pub(crate) fn take_control(&mut self, force: bool) -> bool {
        self.ask(&Ask::TakeControl { force });
        let answer = self.until(|tell| {
            matches!(tell, Tell::Control(Control { yours: true, .. }))
                || matches!(tell, Tell::Refused { why } if why.code == "control.taken")
        });
        matches!(answer, Tell::Control(_))
    }
}
