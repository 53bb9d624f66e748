//! An adapter is found, greeted and set, or a sentence says why not.
//!
//! ```text
//! port ─ hello ─▶ Welcome: version, clock, axes, fastest steps ─ Configure ─▶ settings in force, at rest, nothing pressed
//! ```
//!
//! Comes in: a machine. Goes out: a line that is ready. Does not know what will move.

use super::line::Line;
use crate::serial::{self, Port};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Machine;
use annulus_link::bytes::{Plain, Writer};
use annulus_link::crc::crc32c;
use annulus_link::message::{Ask, Clear, Configure, Refused, State, Status, Welcome};
use annulus_link::{CYCLES_PER_TICK, NEWEST, OLDEST, TICK_HZ};
use std::time::{Duration, Instant};

/// USB number of the adapter: one that everybody may use for trials.
const USB: (u16, u16) = (0x1209, 0x0001);

/// How long an adapter may take to say what it is: it may have to come up first.
const ANSWER: Duration = Duration::from_secs(5);

/// How long it may take to come to rest, and to do what it is told.
const OBEY: Duration = Duration::from_secs(10);

/// The speed of a port that has none.
const BAUD: u32 = 115_200;

/// Ticks in a microsecond.
const TICKS_PER_US: f64 = 10.0;

/// Why a line is of no use any more.
pub(super) fn trouble(code: &str, port: &str) -> Diagnostic {
    Diagnostic::error(code).with("port", port)
}

/// Whether what is at a port says by its USB number that it is an adapter.
pub(crate) fn is_adapter(listed: &serial::Listed) -> bool {
    listed.usb == Some(USB)
}

/// Opens the port of `machine`'s adapter: the one that its file names, or the only one with an adapter's USB number.
pub(super) fn open(machine: &Machine) -> Result<Port, Diagnostic> {
    let name = match machine.adapter.port.as_str() {
        "" => found()?,
        named => named.to_owned(),
    };
    serial::open(&name, BAUD)
        .map_err(|error| trouble("adapter.port_unopened", &name).with("reason", error.description))
}

fn found() -> Result<String, Diagnostic> {
    let mut names: Vec<String> =
        serial::list().into_iter().filter(is_adapter).map(|listed| listed.name).collect();
    match names.len() {
        0 => Err(Diagnostic::error("adapter.not_found")),
        1 => Ok(names.swap_remove(0)),
        _ => Err(Diagnostic::error("adapter.several").with("ports", names.join(", "))),
    }
}

/// The settings of `machine` as an adapter takes them. No input stops before it is said which.
pub(super) fn settings(machine: &Machine) -> Configure {
    let bits = |numbers: &[i8]| {
        numbers.iter().enumerate().filter(|(_, bit)| **bit == 1).fold(0, |all, (axis, _)| all | 1 << axis)
    };
    let pulse = (machine.pulse_width_us * TICKS_PER_US).ceil();
    Configure {
        pulse: pulse as u8,
        setup: (f64::from(machine.direction_setup_us) * TICKS_PER_US) as u16,
        limits: 0,
        low_inputs: machine.adapter.low_inputs(),
        low_steps: bits(&machine.adapter.steps_low),
        low_forward: bits(&machine.adapter.directions_low),
    }
}

/// What an adapter calls these settings.
pub(super) fn settings_crc(settings: &Configure) -> u32 {
    let mut bytes = [0; 32];
    let mut out = Writer::new(&mut bytes);
    settings.put(&mut out);
    let length = out.end().unwrap_or(0);
    crc32c(bytes.get(..length).unwrap_or_default()).max(1)
}

/// The adapter of `machine`, ready: at rest, its settings in force, nothing pressed.
pub(super) fn connect(machine: &Machine) -> Result<Line, Diagnostic> {
    let port = open(machine)?;
    let session = getrandom::u32().unwrap_or(std::process::id());
    let mut line = Line::new(port, session);
    let welcome = greet(&mut line)?;
    fits(&welcome, machine, line.port())?;
    // An adapter that moves for somebody who is gone comes to rest first.
    until(&mut line, |status| status.state != State::Running)?;
    let settings = settings(machine);
    let crc = settings_crc(&settings);
    let status = say(&mut line, settings.into())?;
    if status.settings != crc {
        return Err(refused(&line, &status, "Configure"));
    }
    // Where the emergency stop is pressed, it shows as soon as the inputs are watched.
    let status = until(&mut line, |status| status.settings == crc && status.state != State::Unset)?;
    if status.inputs >> 15 == 1 {
        return Err(trouble("adapter.emergency_stop", line.port()));
    }
    if status.state != State::Ready && say(&mut line, Clear {}.into())?.state != State::Ready {
        return Err(trouble("adapter.emergency_stop", line.port()));
    }
    tracing::info!(
        "USB step adapter at {}: firmware {:08x}, version {} of the link",
        line.port(),
        welcome.firmware,
        welcome.version
    );
    Ok(line)
}

/// Who is there.
fn greet(line: &mut Line) -> Result<Welcome, Diagnostic> {
    let since = Instant::now();
    loop {
        let turned = line.turn();
        if let Some(Refused { oldest, newest }) = line.refused {
            let why = trouble("adapter.other_version", line.port()).with("oldest", oldest);
            return Err(why.with("newest", newest).with("own_oldest", OLDEST).with("own_newest", NEWEST));
        }
        if let (Some(welcome), Some(_)) = (line.welcome, line.status) {
            return Ok(welcome);
        }
        let is_over = since.elapsed() >= ANSWER;
        match turned {
            Err(error) if error.kind() != std::io::ErrorKind::TimedOut => return Err(lost(line, &error)),
            _ if is_over && line.hears_bytes => {
                return Err(trouble("adapter.another_program", line.port()));
            }
            _ if is_over => return Err(trouble("adapter.no_answer", line.port())),
            _ => {}
        }
    }
}

/// Whether the adapter can do what the machine asks of it.
fn fits(welcome: &Welcome, machine: &Machine, port: &str) -> Result<(), Diagnostic> {
    let clock_hz = TICK_HZ * CYCLES_PER_TICK;
    if welcome.clock_hz != clock_hz {
        let why = trouble("adapter.other_clock", port).with("found", welcome.clock_hz);
        return Err(why.with("wanted", clock_hz));
    }
    if machine.max_step_hz > welcome.max_rate_hz || 2 + machine.spindles > u32::from(welcome.axes) {
        let why = trouble("adapter.too_small", port).with("axes", welcome.axes);
        return Err(why.with("rate", welcome.max_rate_hz));
    }
    Ok(())
}

/// What a port said when it failed.
pub(super) fn lost(line: &Line, error: &std::io::Error) -> Diagnostic {
    trouble("adapter.unplugged", line.port()).with("reason", error)
}

/// An adapter that will not do what it is asked.
pub(super) fn refused(line: &Line, status: &Status, what: &str) -> Diagnostic {
    let reason = format!("{:?}, {:?}", status.refusal, status.state);
    trouble("adapter.refused", line.port()).with("what", what).with("reason", reason)
}

/// Waits until the adapter is so.
fn until(line: &mut Line, so: impl Fn(&Status) -> bool) -> Result<Status, Diagnostic> {
    let since = Instant::now();
    loop {
        if let Some(status) = line.status.filter(&so) {
            return Ok(status);
        }
        if since.elapsed() >= OBEY {
            return Err(trouble("adapter.no_answer", line.port()));
        }
        line.turn().map_err(|error| lost(line, &error))?;
    }
}

/// Says it, and waits until the adapter has it.
fn say(line: &mut Line, ask: Ask) -> Result<Status, Diagnostic> {
    line.offer(ask);
    let since = Instant::now();
    while line.pending() > 0 || line.status.is_none() {
        if since.elapsed() >= OBEY {
            return Err(trouble("adapter.no_answer", line.port()));
        }
        line.turn().map_err(|error| lost(line, &error))?;
    }
    Ok(line.status.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::machine::{AdapterWiring, virtual_drill};

    #[test]
    fn settings_are_those_of_the_machine_in_ticks_and_bits() {
        let adapter = AdapterWiring {
            sensors_low: vec![0, 0, 1, 0, 0, 0, 0],
            steps_low: vec![0, 1, 0, 0],
            directions_low: vec![1, 0, 0, 1],
            ..AdapterWiring::default()
        };
        let machine = Machine { adapter, pulse_width_us: 1.25, direction_setup_us: 5, ..virtual_drill() };
        let found = settings(&machine);
        let wanted = Configure {
            pulse: 13,
            setup: 50,
            limits: 0,
            low_inputs: 0b100,
            low_steps: 0b10,
            low_forward: 0b1001,
        };
        assert_eq!(found, wanted);
        assert_ne!(settings_crc(&found), settings_crc(&Configure::default()));
    }
}
