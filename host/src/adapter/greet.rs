//! Identifies an adapter and configures it, or reports why that failed.
//!
//! ```text
//! hello ─▶ Welcome: version, clock, axes, fastest steps ─ Windings, Configure ─▶ configured, stopped
//! ```

use super::line::{AdapterLine, Lost};
use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{AdapterOutputs, Machine};
use annulus_core::pins::give_way;
use annulus_core::wire::OtherFirmware;
use annulus_link::bytes::{Plain, Writer};
use annulus_link::crc::crc32c;
use annulus_link::message::{
    Ask, COLUMNS, Clear, Configure, Filters, Refusal, Refused, State, Status, Touches, Welcome, Windings,
};
use annulus_link::phases::{MOTORS, tables_crc};
use annulus_link::{CYCLES_PER_TICK, NEWEST, OLDEST, TICK_HZ};
use std::time::Duration;

/// How long an adapter may take to identify itself: it may have to boot first.
const ANSWER: Duration = Duration::from_secs(5);

/// How long the adapter may take to stop, and to carry out a request.
const OBEY: Duration = Duration::from_secs(10);

/// How long the adapter may take to report its touch counters.
const COUNTS: Duration = Duration::from_secs(2);

const TICKS_PER_US: f64 = 10.0;

pub(super) fn trouble(code: &str, port: &str) -> Diagnostic {
    Diagnostic::error(code).with("port", port)
}

/// The settings of `machine` in the adapter's form. No input stops motion until a `Guard` names it.
pub(super) fn settings(machine: &Machine) -> Configure {
    let bits = |numbers: &[i8]| {
        numbers.iter().enumerate().filter(|(_, bit)| **bit == 1).fold(0, |all, (axis, _)| all | 1 << axis)
    };
    let pulse = (machine.pulse_width_us * TICKS_PER_US).ceil();
    let windings = windings(machine);
    // Windings need no step pulse and no direction setup time.
    let (pulse, setup) = match windings {
        Some(_) => (2, 0),
        None => (pulse as u8, (f64::from(machine.direction_setup_us) * TICKS_PER_US) as u16),
    };
    Configure {
        pulse,
        setup,
        limits: 0,
        low_inputs: machine.adapter.low_inputs(),
        low_steps: bits(&machine.adapter.steps_low),
        low_forward: bits(&machine.adapter.directions_low),
        phases: windings.map_or(0, |windings| tables_crc(&windings)),
    }
}

/// The phase tables of the motors of `machine`, if its adapter drives windings. The forcing pulse lasts one
/// interrupt period, as on an I/O card.
fn windings(machine: &Machine) -> Option<[Windings; MOTORS]> {
    let interrupt = TICK_HZ.div_ceil(machine.interrupt_hz.max(1));
    let of = |axis: usize| {
        let table = &machine.axis(axis).phases.columns;
        let mut columns = [0; COLUMNS];
        columns.iter_mut().zip(table).for_each(|(place, column)| *place = *column);
        Windings { axis: axis as u8, forcing: interrupt, count: table.len() as u8, columns }
    };
    (machine.adapter.outputs == AdapterOutputs::Phases).then(|| std::array::from_fn(of))
}

/// The checksum by which an adapter names these settings.
pub(super) fn settings_crc(settings: &Configure) -> u32 {
    let mut bytes = [0; 32];
    let mut out = Writer::new(&mut bytes);
    settings.put(&mut out);
    let length = out.end().unwrap_or(0);
    crc32c(bytes.get(..length).unwrap_or_default()).max(1)
}

/// Makes the adapter on `line` ready for `machine`: stopped, configured, no emergency stop pressed. Returns
/// its identity.
pub(super) async fn ready(line: &mut AdapterLine, machine: &Machine) -> Result<Welcome, Diagnostic> {
    let welcome = who(line).await?;
    fits(&welcome, machine, line.port())?;
    // The adapter may still be moving for an earlier session: wait until it stops.
    until(line, |status| status.state != State::Running).await?;
    for table in windings(machine).into_iter().flatten() {
        let status = say(line, table.into()).await?;
        if status.refusal == Refusal::Settings {
            return Err(refused(line, &status, "Windings"));
        }
    }
    let settings = settings(machine);
    let crc = settings_crc(&settings);
    let status = say(line, settings.into()).await?;
    if status.settings != crc {
        return Err(refused(line, &status, "Configure"));
    }
    filter(line, machine).await?;
    // A pressed emergency stop shows only after the inputs are watched.
    let status = until(line, |status| status.settings == crc && status.state != State::Unset).await?;
    if status.inputs >> 15 == 1 {
        return Err(trouble(code!("adapter.emergency_stop"), line.port()));
    }
    if status.state != State::Ready && say(line, Clear {}.into()).await?.state != State::Ready {
        return Err(trouble(code!("adapter.emergency_stop"), line.port()));
    }
    Ok(welcome)
}

/// Sends how long each input must be touched, if any input has a filter. Firmware without filters is
/// refused: every short touch would stop it, with no visible cause.
async fn filter(line: &mut AdapterLine, machine: &Machine) -> Result<(), Diagnostic> {
    let least_us = machine.adapter.filters_us();
    line.is_filtered = least_us.iter().any(|filter_us| *filter_us > 0);
    if !line.is_filtered {
        return Ok(());
    }
    let number = line.offer(Filters { least_us });
    let status = heard(line).await?;
    match status.refusal {
        Refusal::None => Ok(()),
        _ if number != Some(status.refused) => Ok(()),
        Refusal::Form => Err(trouble(code!("adapter.no_filters"), line.port())),
        _ => Err(refused(line, &status, "Filters")),
    }
}

async fn turn(line: &mut AdapterLine) -> Result<(), Diagnostic> {
    let turned = line.turn().map_err(|why| lost(line, &why));
    give_way().await;
    turned
}

/// Identifies the adapter on `line`. The request itself stops an adapter that moves for another session.
pub async fn who(line: &mut AdapterLine) -> Result<Welcome, Diagnostic> {
    let since = line.now();
    loop {
        let turned = line.turn();
        if let Some(Refused { oldest, newest }) = line.refused {
            let why = trouble(code!("adapter.other_version"), line.port()).with("oldest", oldest);
            return Err(why.with("newest", newest).with("own_oldest", OLDEST).with("own_newest", NEWEST));
        }
        if let (Some(welcome), Some(_)) = (line.welcome, line.status) {
            return Ok(welcome);
        }
        let is_over = line.now().saturating_sub(since) >= ANSWER;
        match turned {
            Err(why @ Lost::Cable { .. }) => return Err(lost(line, &why)),
            _ if is_over && line.hears_bytes => {
                return Err(trouble(code!("adapter.another_program"), line.port()));
            }
            _ if is_over => return Err(trouble(code!("adapter.no_answer"), line.port())),
            _ => give_way().await,
        }
    }
}

/// The firmware that belongs to this program: CRC-32C of its sources.
pub fn own_firmware() -> u32 {
    env!("ANNULUS_FIRMWARE_SOURCES").parse().unwrap_or_default()
}

/// Reports firmware that differs from [`own_firmware`]. The adapter is still used if it speaks our protocol
/// version.
pub fn other_firmware(welcome: Welcome) -> Option<OtherFirmware> {
    let (found, wanted) = (welcome.firmware, own_firmware());
    (found != wanted).then_some(OtherFirmware { found, wanted })
}

/// Counts of touches that were shorter than the input's filter, from the identified adapter on `line`.
/// `None` if its firmware does not count them.
pub async fn touches(line: &mut AdapterLine) -> Result<Option<Touches>, Diagnostic> {
    line.is_filtered = true;
    let since = line.now();
    while line.touches.is_none() && line.now().saturating_sub(since) < COUNTS {
        turn(line).await?;
    }
    Ok(line.touches)
}

/// Checks that the adapter can do everything that the machine needs.
fn fits(welcome: &Welcome, machine: &Machine, port: &str) -> Result<(), Diagnostic> {
    let clock_hz = TICK_HZ * CYCLES_PER_TICK;
    if welcome.clock_hz != clock_hz {
        let why = trouble(code!("adapter.other_clock"), port).with("found", welcome.clock_hz);
        return Err(why.with("wanted", clock_hz));
    }
    if machine.max_step_hz > welcome.max_rate_hz || 2 + machine.spindles > u32::from(welcome.axes) {
        let why = trouble(code!("adapter.too_small"), port).with("axes", welcome.axes);
        return Err(why.with("rate", welcome.max_rate_hz));
    }
    Ok(())
}

pub(super) fn lost(line: &AdapterLine, why: &Lost) -> Diagnostic {
    match why {
        Lost::Silent => trouble(code!("adapter.no_answer"), line.port()),
        Lost::Cable { reason } => trouble(code!("adapter.unplugged"), line.port()).with("reason", reason),
    }
}

pub(super) fn refused(line: &AdapterLine, status: &Status, what: &str) -> Diagnostic {
    let reason = format!("{}, {}", status.refusal.name(), status.state.name());
    trouble(code!("adapter.refused"), line.port()).with("what", what).with("reason", reason)
}

async fn until(line: &mut AdapterLine, so: impl Fn(&Status) -> bool) -> Result<Status, Diagnostic> {
    let since = line.now();
    loop {
        if let Some(status) = line.status.filter(&so) {
            return Ok(status);
        }
        if line.now().saturating_sub(since) >= OBEY {
            return Err(trouble(code!("adapter.no_answer"), line.port()));
        }
        turn(line).await?;
    }
}

async fn say(line: &mut AdapterLine, ask: Ask) -> Result<Status, Diagnostic> {
    line.offer(ask);
    heard(line).await
}

async fn heard(line: &mut AdapterLine) -> Result<Status, Diagnostic> {
    let since = line.now();
    while line.pending() > 0 || line.status.is_none() {
        if line.now().saturating_sub(since) >= OBEY {
            return Err(trouble(code!("adapter.no_answer"), line.port()));
        }
        turn(line).await?;
    }
    Ok(line.status.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::machine::phases::preset;
    use annulus_core::machine::{AdapterWiring, lab, virtual_drill};

    #[test]
    fn adapter_with_other_clock_axes_or_rate_is_refused() {
        let able = Welcome { clock_hz: 120_000_000, axes: 4, max_rate_hz: 500_000, ..Welcome::default() };
        let of = |welcome: Welcome| fits(&welcome, &virtual_drill(), "port").err().map(|why| why.code);
        assert_eq!(of(able), None);
        assert_eq!(of(Welcome { clock_hz: 125_000_000, ..able }).as_deref(), Some("adapter.other_clock"));
        for small in [Welcome { axes: 2, ..able }, Welcome { max_rate_hz: 10_000, ..able }] {
            assert_eq!(of(small).as_deref(), Some("adapter.too_small"));
        }
    }

    #[test]
    fn adapter_settings_match_the_machine_in_ticks_and_bits() {
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
            phases: 0,
        };
        assert_eq!(found, wanted);
        assert_ne!(settings_crc(&found), settings_crc(&Configure::default()));
    }

    #[test]
    fn phase_tables_are_sent_with_forcing_of_one_interrupt() {
        let mut machine = lab();
        assert_eq!(windings(&machine), None);
        machine.adapter.outputs = AdapterOutputs::Phases;
        let tables = windings(&machine).unwrap();
        assert_eq!((tables[2].axis, tables[2].forcing, tables[2].count), (2, 20_000, 12), "500 Hz");
        assert_eq!(tables[2].columns[..12], machine.z.phases.columns);
        let found = settings(&machine);
        assert_eq!((found.pulse, found.setup), (2, 0), "a pulse of 100 µs would be none");
        assert!(found.phases != 0 && found.phases == tables_crc(&tables));
        machine.y.phases.columns = preset("half").unwrap().columns;
        assert_ne!(settings(&machine).phases, found.phases, "another table, other settings");
    }
}
