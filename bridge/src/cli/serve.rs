//! Serves the page on this computer. Ends on Ctrl-C or a signal, after the machine has stopped.

use super::browser;
use super::{Answer, Exit, Refusal, sentence};
use crate::drill::Drill;
use crate::hosted::Hosted;
use crate::machine_file::{self, Known};
use crate::server::runtime::{self, Claim};
use crate::server::{self, Bridge};
use crate::signals::Signals;
use annulus_core::control::Timing;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine;
use annulus_core::virtual_drill::faults;
use annulus_core::wire::Scope;
use annulus_core::{code, error};
use serde_json::{Value, json};
use std::io::{self, ErrorKind, Write};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener};
use std::sync::Arc;

/// Default port of the page.
pub(crate) const DEFAULT_PORT: u16 = 7425;

/// Arguments of `annulus serve`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct ServeArgs {
    /// Listen on this port; 0 chooses a free one [default: 7425].
    #[arg(long)]
    pub(crate) port: Option<u16>,
    /// Do not open a browser.
    #[arg(long)]
    pub(crate) no_open: bool,
    /// Use this machine: a preset's name or a machine file [default: the one of `annulus machines use`, else
    /// virtual].
    #[arg(short, long)]
    pub(crate) machine: Option<String>,
    /// Drive the GRBL controller at this serial port, as listed by `annulus ports`.
    #[arg(long, value_name = "PORT", conflicts_with = "fault")]
    pub(crate) serial_port: Option<String>,
    /// Set the baud rate of the serial port [default: try the common ones until the controller answers].
    #[arg(long, requires = "serial_port")]
    pub(crate) baud: Option<u32>,
    /// Run the virtual drill or a simulated controller this many times faster than real time [default: 1].
    #[arg(long = "time-scale", alias = "speed", value_parser = super::numbers::speed)]
    pub(crate) speed: Option<f64>,
    /// Inject a fault of the virtual drill, from a number of holes on: NAME or NAME@HOLES; see the manual.
    #[arg(long, value_name = "NAME[@HOLES]")]
    pub(crate) fault: Vec<String>,
    /// The user named no command: print how to get help, and log warnings only.
    #[arg(skip)]
    pub(crate) is_default: bool,
}

pub(crate) fn run(args: &ServeArgs, json: bool) -> Result<Answer, Refusal> {
    super::log::begin(args.is_default);
    let chosen = machine_file::chosen().unwrap_or(machine::VIRTUAL);
    let known = machine_file::named(args.machine.as_deref().unwrap_or(chosen))?;
    let mut claim =
        Claim::take(&runtime::folder())?.map_err(|note| already_running(note.map(|note| note.port)))?;
    let (port, listeners) = listen(args.port.unwrap_or(DEFAULT_PORT))?;
    let folder = machine_file::data_folder();
    runtime::make_folder(&folder)?;
    let (machine, timing) = open(args, known)?;
    if let Some(timing) = &timing {
        for found in timing.diagnostics() {
            tracing::info!("{} {}", found.message("en"), found.advice("en"));
        }
    }
    let bridge = Bridge::new(machine, port).map_err(Refusal::surroundings)?;
    claim.say(&bridge.note())?;
    let url = bridge.address(Scope::Configure).map_err(Refusal::surroundings)?;
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    let runtime = runtime.map_err(|error| trouble(code!("serve.cannot_start"), &error))?;
    let signal = runtime.block_on(async {
        let mut signals = Signals::new()?;
        let listeners =
            listeners.into_iter().map(tokio::net::TcpListener::from_std).collect::<io::Result<Vec<_>>>()?;
        announce(&url, port, timing.as_ref(), json);
        if args.is_default && !json {
            announce_line(&sentence("serve.help", &[]));
        }
        if !args.no_open && !browser::open(&url) {
            tracing::info!("no browser opened: copy the address into one");
        }
        let mut signal = Exit::Done;
        let ended = async {
            signal = signals.wait().await;
            tracing::info!("ending as soon as the machine has stopped");
        };
        server::run(bridge, listeners, ended).await;
        Ok(signal)
    });
    let exit = signal.map_err(|error: io::Error| trouble(code!("serve.cannot_start"), &error))?;
    Ok(Answer { object: Value::Null, text: String::new(), exit })
}

/// Opens the machine: the controller at a serial port, or the drill of this computer. Also returns the
/// timing quality of this computer, if it times the steps.
fn open(args: &ServeArgs, known: Known) -> Result<(Arc<dyn Hosted>, Option<Timing>), Refusal> {
    let speed = args.speed.unwrap_or(1.0);
    if let Some(port) = &args.serial_port {
        let is_mill = |name: &&str| machine::mill(machine::preset_name(name)).is_some();
        let named = args.machine.as_deref().or_else(|| machine_file::chosen().filter(is_mill));
        let named = named.map(|name| (name, known.machine));
        let host: Arc<dyn Hosted> = Arc::new(super::grbl::serve((port, args.baud), named, speed)?);
        return Ok((host, None));
    }
    let faults = faults::read(args.fault.iter().map(String::as_str)).map_err(Refusal::usage)?;
    let drill = Drill::open_with(&machine_file::data_folder(), known.machine, speed, faults)?;
    drill.keep_settings_in(known.path);
    let timing = drill.timing().cloned();
    let drill: Arc<dyn Hosted> = Arc::new(drill);
    Ok((drill, timing))
}

/// Prints the one line that scripts and users wait for. A closed pipe is ignored.
fn announce(url: &str, port: u16, timing: Option<&Timing>, json: bool) {
    let line = if json {
        let mut object = json!({ "ok": true, "url": url, "port": port });
        if let Some(timing) = timing {
            object["timing"] = json!(timing);
        }
        object.to_string()
    } else {
        url.to_owned()
    };
    announce_line(&line);
}

fn announce_line(line: &str) {
    let mut out = io::stdout().lock();
    let _ = writeln!(out, "{line}").and_then(|()| out.flush());
}

/// Listens on both loopback addresses, or on IPv4 alone if there is no IPv6.
fn listen(port: u16) -> Result<(u16, Vec<TcpListener>), Refusal> {
    for _ in 0..16 {
        let four = bind((Ipv4Addr::LOCALHOST, port).into()).map_err(|error| cannot_listen(port, &error))?;
        let chosen = four.local_addr().map_or(port, |address| address.port());
        match bind((Ipv6Addr::LOCALHOST, chosen).into()) {
            Ok(six) => return Ok((chosen, vec![four, six])),
            // The free port is in use on the other address: try another.
            Err(error) if error.kind() == ErrorKind::AddrInUse && port == 0 => {}
            Err(error) if error.kind() == ErrorKind::AddrInUse => return Err(cannot_listen(port, &error)),
            Err(error) => {
                tracing::warn!(%error, "no IPv6 on this computer: listening on 127.0.0.1 alone");
                return Ok((chosen, vec![four]));
            }
        }
    }
    Err(cannot_listen(port, &ErrorKind::AddrInUse.into()))
}

fn bind(address: SocketAddr) -> io::Result<TcpListener> {
    let listener = TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// Returns `true` if `port` is free on both loopback addresses.
pub(crate) fn is_free(port: u16) -> bool {
    listen(port).is_ok()
}

fn cannot_listen(port: u16, error: &io::Error) -> Refusal {
    if error.kind() == ErrorKind::AddrInUse {
        return Refusal::surroundings(error!("serve.port_in_use", port = port));
    }
    let why = error!("serve.port", port = port, ..);
    Refusal::surroundings(why.with("reason", error))
}

fn already_running(port: Option<u16>) -> Refusal {
    let port = port.map_or_else(|| "?".to_owned(), |port| port.to_string());
    Refusal::surroundings(error!("serve.already_running", port = port))
}

fn trouble(code: &str, error: &io::Error) -> Refusal {
    Refusal::surroundings(Diagnostic::error(code).with("reason", error))
}
