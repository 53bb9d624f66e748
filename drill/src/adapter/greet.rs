//! An adapter is greeted and set, or a sentence says why not.
//!
//! ```text
//! hello ─▶ Welcome: version, clock, axes, fastest steps ─ Windings, Configure ─▶ settings in force, at rest, nothing pressed
//! ```
//!
//! Comes in: a machine, a line. Goes out: a line that is ready. Does not know what will move.

use super::line::{AdapterLine, Lost};
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

/// How long an adapter may take to say what it is: it may have to come up first.
const ANSWER: Duration = Duration::from_secs(5);

/// How long it may take to come to rest, and to do what it is told.
const OBEY: Duration = Duration::from_secs(10);

/// How long it may take to say how often inputs were touched.
const COUNTS: Duration = Duration::from_secs(2);

/// Ticks in a microsecond.
const TICKS_PER_US: f64 = 10.0;

/// Why a line is of no use any more.
pub(super) fn trouble(code: &str, port: &str) -> Diagnostic {
    Diagnostic::error(code).with("port", port)
}

/// The settings of `machine` as an adapter takes them. No input stops before it is said which.
pub(super) fn settings(machine: &Machine) -> Configure {
    let bits = |numbers: &[i8]| {
        numbers.iter().enumerate().filter(|(_, bit)| **bit == 1).fold(0, |all, (axis, _)| all | 1 << axis)
    };
    let pulse = (machine.pulse_width_us * TICKS_PER_US).ceil();
    let windings = windings(machine);
    // Windings have no pulses, and no direction to be set up.
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

/// The phases of the motors of `machine`, where its adapter drives windings. They are forced as long as on an I/O card: for an
/// interrupt.
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

/// What an adapter calls these settings.
pub(super) fn settings_crc(settings: &Configure) -> u32 {
    let mut bytes = [0; 32];
    let mut out = Writer::new(&mut bytes);
    settings.put(&mut out);
    let length = out.end().unwrap_or(0);
    crc32c(bytes.get(..length).unwrap_or_default()).max(1)
}

/// Makes the adapter at the end of `line` ready for `machine`: at rest, its settings in force, nothing pressed. What it is.
pub(super) async fn ready(line: &mut AdapterLine, machine: &Machine) -> Result<Welcome, Diagnostic> {
    let welcome = who(line).await?;
    fits(&welcome, machine, line.port())?;
    // An adapter that moves for somebody who is gone comes to rest first.
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
    // Where the emergency stop is pressed, it shows as soon as the inputs are watched.
    let status = until(line, |status| status.settings == crc && status.state != State::Unset).await?;
    if status.inputs >> 15 == 1 {
        return Err(trouble("adapter.emergency_stop", line.port()));
    }
    if status.state != State::Ready && say(line, Clear {}.into()).await?.state != State::Ready {
        return Err(trouble("adapter.emergency_stop", line.port()));
    }
    Ok(welcome)
}

/// Says how long inputs have to be touched, where one has a filter. Firmware that knows no filters is refused then: it would stop at
/// every touch, and nobody would know why.
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
        Refusal::Form => Err(trouble("adapter.no_filters", line.port())),
        _ => Err(refused(line, &status, "Filters")),
    }
}

/// Hears and says, and gives way.
async fn turn(line: &mut AdapterLine) -> Result<(), Diagnostic> {
    let turned = line.turn().map_err(|why| lost(line, &why));
    give_way().await;
    turned
}

/// Who is at the end of `line`. An adapter that moves for somebody else comes to rest by being asked.
pub async fn who(line: &mut AdapterLine) -> Result<Welcome, Diagnostic> {
    let since = line.now();
    loop {
        let turned = line.turn();
        if let Some(Refused { oldest, newest }) = line.refused {
            let why = trouble("adapter.other_version", line.port()).with("oldest", oldest);
            return Err(why.with("newest", newest).with("own_oldest", OLDEST).with("own_newest", NEWEST));
        }
        if let (Some(welcome), Some(_)) = (line.welcome, line.status) {
            return Ok(welcome);
        }
        let is_over = line.now().saturating_sub(since) >= ANSWER;
        match turned {
            Err(why @ Lost::Cable { .. }) => return Err(lost(line, &why)),
            _ if is_over && line.hears_bytes => {
                return Err(trouble("adapter.another_program", line.port()));
            }
            _ if is_over => return Err(trouble("adapter.no_answer", line.port())),
            _ => give_way().await,
        }
    }
}

/// The firmware that belongs to this program: CRC-32C of its sources.
pub fn own_firmware() -> u32 {
    env!("ANNULUS_FIRMWARE_SOURCES").parse().unwrap_or_default()
}

/// That who is so has another one. It is obeyed as long as it speaks the same version.
pub fn other_firmware(welcome: Welcome) -> Option<OtherFirmware> {
    let (found, wanted) = (welcome.firmware, own_firmware());
    (found != wanted).then_some(OtherFirmware { found, wanted })
}

/// How often the inputs of the adapter at the end of `line`, which said who it is, were touched for less than their filter; none where
/// its firmware does not count.
pub async fn touches(line: &mut AdapterLine) -> Result<Option<Touches>, Diagnostic> {
    line.is_filtered = true;
    let since = line.now();
    while line.touches.is_none() && line.now().saturating_sub(since) < COUNTS {
        turn(line).await?;
    }
    Ok(line.touches)
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

/// Why a line is of no use any more.
pub(super) fn lost(line: &AdapterLine, why: &Lost) -> Diagnostic {
    match why {
        Lost::Silent => trouble("adapter.no_answer", line.port()),
        Lost::Cable { reason } => trouble("adapter.unplugged", line.port()).with("reason", reason),
    }
}

/// An adapter that will not do what it is asked.
pub(super) fn refused(line: &AdapterLine, status: &Status, what: &str) -> Diagnostic {
    let reason = format!("{:?}, {:?}", status.refusal, status.state);
    trouble("adapter.refused", line.port()).with("what", what).with("reason", reason)
}

/// Waits until the adapter is so.
async fn until(line: &mut AdapterLine, so: impl Fn(&Status) -> bool) -> Result<Status, Diagnostic> {
    let since = line.now();
    loop {
        if let Some(status) = line.status.filter(&so) {
            return Ok(status);
        }
        if line.now().saturating_sub(since) >= OBEY {
            return Err(trouble("adapter.no_answer", line.port()));
        }
        turn(line).await?;
    }
}

/// Says it, and waits until the adapter has it.
async fn say(line: &mut AdapterLine, ask: Ask) -> Result<Status, Diagnostic> {
    line.offer(ask);
    heard(line).await
}

/// Waits until the adapter has what was said.
async fn heard(line: &mut AdapterLine) -> Result<Status, Diagnostic> {
    let since = line.now();
    while line.pending() > 0 || line.status.is_none() {
        if line.now().saturating_sub(since) >= OBEY {
            return Err(trouble("adapter.no_answer", line.port()));
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
    fn an_adapter_with_another_clock_too_few_axes_or_too_slow_steps_is_refused() {
        let able = Welcome { clock_hz: 120_000_000, axes: 4, max_rate_hz: 500_000, ..Welcome::default() };
        let of = |welcome: Welcome| fits(&welcome, &virtual_drill(), "port").err().map(|why| why.code);
        assert_eq!(of(able), None);
        assert_eq!(of(Welcome { clock_hz: 125_000_000, ..able }).as_deref(), Some("adapter.other_clock"));
        for small in [Welcome { axes: 2, ..able }, Welcome { max_rate_hz: 10_000, ..able }] {
            assert_eq!(of(small).as_deref(), Some("adapter.too_small"));
        }
    }

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
            phases: 0,
        };
        assert_eq!(found, wanted);
        assert_ne!(settings_crc(&found), settings_crc(&Configure::default()));
    }

    #[test]
    fn phases_are_the_tables_of_the_machine_forced_for_one_interrupt() {
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
