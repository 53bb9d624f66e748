//! Prints a new one-time address for a running bridge.

use super::{Answer, Refusal};
use crate::server::runtime::{self, Note};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::{LinkBody, PROOF_HEADER, Scope, auth};
use annulus_core::{code, error};
use serde_json::{Value, json};
use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::time::Duration;

/// Maximum wait for the bridge.
const PATIENCE: Duration = Duration::from_secs(5);

/// Arguments of `annulus link`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct LinkArgs {
    /// Choose what the page with this address may do; each scope includes the ones before it.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) scope: May,
}

/// The scopes, as words of the command line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum May {
    /// Watch, and stop.
    View,
    /// Take control and jog.
    Jog,
    /// Upload and run jobs.
    Run,
    /// Change the machine's settings.
    #[default]
    Configure,
}

pub(crate) fn run(args: &LinkArgs) -> Result<Answer, Refusal> {
    let refuse = |code| Refusal::surroundings(Diagnostic::error(code));
    let note = runtime::running(&runtime::folder()).ok_or_else(|| refuse(code!("link.no_bridge")))?;
    let scope = match args.scope {
        May::View => Scope::View,
        May::Jog => Scope::Jog,
        May::Run => Scope::Run,
        May::Configure => Scope::Configure,
    };
    let body = ask(&note, scope).map_err(|error| {
        let why = error!("link.no_answer", port = note.port, ..);
        Refusal::surroundings(why.with("reason", error))
    })?;
    let answer: Value = serde_json::from_str(&body).unwrap_or_default();
    let url = answer.get("url").and_then(Value::as_str).ok_or_else(|| refuse(code!("link.refused")))?;
    Ok(Answer::new(&json!({ "url": url, "port": note.port }), format!("{url}\n")))
}

/// Sends `POST /api/link`. Returns the body of the answer.
fn ask(note: &Note, scope: Scope) -> io::Result<String> {
    let body = serde_json::to_string(&LinkBody { scope })?;
    let host = format!("127.0.0.1:{}", note.port);
    let proof = auth::request(&note.secret, "POST", "/api/link");
    let head = format!(
        "POST /api/link HTTP/1.1\r\nhost: {host}\r\norigin: http://{host}\r\n{PROOF_HEADER}: {proof}\r\n\
         content-length: {}\r\nconnection: close\r\n\r\n{body}",
        body.len()
    );
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, note.port));
    let mut stream = TcpStream::connect_timeout(&address, PATIENCE)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.write_all(head.as_bytes())?;
    let mut answer = String::new();
    stream.take(64 * 1024).read_to_string(&mut answer)?;
    Ok(answer.split_once("\r\n\r\n").map(|(_, body)| body.to_owned()).unwrap_or_default())
}
