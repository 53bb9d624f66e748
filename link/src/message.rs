//! Every message of the link, described once: the table below makes the types, the writer and the reader.
//!
//! Comes in: a message, or a kind and a payload. Goes out: the other. Does not know when a message is right.
//!
//! Never renumber, append only: what has another form gets another kind, and [`crate::NEWEST`] grows.

use crate::bytes::{Plain, Reader, Writer};
use crate::{AXES, INPUTS};

/// Most columns of a table of phases.
pub const COLUMNS: usize = 64;

macro_rules! messages {
    ($(#[$about:meta])* $name:ident {
        $($(#[$said:meta])* $kind:literal $message:ident { $($(#[$meant:meta])* $field:ident: $type:ty,)* })*
    }) => {
        $($(#[$said])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $message { $($(#[$meant])* pub $field: $type,)* }

        impl Plain for $message {
            const NONE: Self = Self { $($field: <$type as Plain>::NONE,)* };
            fn put(&self, _out: &mut Writer<'_>) { $(self.$field.put(_out);)* }
            fn take(_from: &mut Reader<'_>) -> Option<Self> { Some(Self { $($field: Plain::take(_from)?,)* }) }
        }

        impl Default for $message {
            fn default() -> Self { Self::NONE }
        }

        impl From<$message> for $name {
            fn from(message: $message) -> Self { Self::$message(message) }
        })*

        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum $name { $($message($message),)* }

        impl $name {
            /// Its kind in the header of a frame.
            pub fn kind(&self) -> u8 { match self { $(Self::$message(_) => $kind,)* } }

            /// Its payload.
            pub fn put(&self, out: &mut Writer<'_>) { match self { $(Self::$message(message) => message.put(out),)* } }

            /// The message of a payload, and the bytes behind it, which only a chunk has.
            pub fn take(kind: u8, payload: &[u8]) -> Option<(Self, &[u8])> {
                let mut from = Reader::new(payload);
                let message = match kind {
                    $($kind => Self::$message(Plain::take(&mut from)?),)*
                    _ => return None,
                };
                Some((message, from.rest()))
            }
        }
    };
}

macro_rules! words {
    ($($(#[$about:meta])* $name:ident { $($(#[$said:meta])* $word:ident,)* })*) => {$(
        $(#[$about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub enum $name { $($(#[$said])* $word,)* }

        impl Plain for $name {
            const NONE: Self = [$(Self::$word),*][0];
            fn put(&self, out: &mut Writer<'_>) { (*self as u8).put(out); }
            fn take(from: &mut Reader<'_>) -> Option<Self> {
                let wanted = u8::take(from)?;
                [$(Self::$word),*].into_iter().find(|word| *word as u8 == wanted)
            }
        }
    )*};
}

words! {
    /// What the adapter is doing. Only `Running` moves; a new program of steps is taken in `Ready` and `Running`.
    State {
        /// No settings yet in this session.
        #[default]
        Unset,
        /// At rest.
        Ready,
        /// Steps are going out, or time is held between two of them.
        Running,
        /// Came to rest on its tail because nothing newer came. The index is exact.
        Starved,
        /// Came to rest as ordered, with path left. The index is exact.
        Stopped,
        /// An end sensor stopped the pulses at once. The index is exact, the motors may have gone on.
        Limit,
        /// The emergency stop is pressed, or was.
        EmergencyStop,
        /// The adapter could not keep its own time: steps may be missing.
        Fault,
    }

    /// Whether the index is where the machine is.
    Trust {
        /// Nobody said where it is since the last reset, or it was stopped by force in motion.
        #[default]
        Lost,
        /// It was stopped by an end sensor, or ran dry.
        Suspect,
        /// As told by the bridge, and every step counted since.
        Trusted,
    }

    /// Why the latest frame that was refused was refused. Nothing moves differently for it.
    Refusal {
        /// None was.
        #[default]
        None,
        /// Not in this state.
        State,
        /// It is no message, or its runs are none.
        Form,
        /// A chunk before it is missing.
        Gap,
        /// It does not begin where the last one ends.
        Index,
        /// Its runs do not add up to what its head says.
        Counts,
        /// Steps closer than pulse and pause allow.
        Rate,
        /// A turn without the time that the driver needs to see the direction.
        Turn,
        /// The path in which it could come to rest is not all here, or would be longer than any may be.
        Tail,
        /// More bytes than there is room for.
        Room,
        /// Settings out of range.
        Settings,
        /// The emergency stop or an end sensor is still there.
        Input,
    }
}

messages! {
    /// What the bridge says.
    Ask {
        /// First frame of a session, not numbered. Ends every older session; the same one again changes nothing.
        1 Hello {
            /// Oldest version of the link that the bridge speaks.
            oldest: u16,
            /// Newest one.
            newest: u16,
        }
        /// Still here; not numbered. Any frame of the session keeps the outputs on; this one says nothing else.
        2 Beat {}
        /// Settings of the session.
        3 Configure {
            /// Length of a pulse in ticks, 2 … 33.
            pulse: u8,
            /// Least time from a change of direction to the next pulse, in ticks.
            setup: u16,
            /// Inputs that stop all pulses while they are on, one bit each.
            limits: u8,
            /// Inputs that are on while their pin is low.
            low_inputs: u8,
            /// Axes whose pulse is low.
            low_steps: u8,
            /// Axes whose direction pin is high when they count down.
            low_forward: u8,
            /// What the tables of [`Windings`] are known by, where pins drive windings by them; 0 where they give steps and directions.
            phases: u32,
        }
        /// A piece of path. Its runs follow the head, axis by axis.
        4 Chunk {
            /// Its number in the session, from 0 on without gaps.
            number: u32,
            /// CRC-32C of the index of every axis before it and of every axis after it.
            places: u32,
            /// How long it takes, in ticks.
            ticks: u32,
            /// Most that the rate of time may fall in a slice, in 1/65,536 of full rate.
            fall: u16,
            /// Most that it may rise.
            rise: u16,
            /// Direction of the step that follows this chunk, one bit an axis, on for forward.
            ahead: u8,
            /// 1 where the path rests at its end, so that nothing has to follow it.
            rests: u8,
            /// Runs of every axis.
            runs: [u8; AXES],
        }
        /// Go, from rest.
        5 Begin {}
        /// The rate of time that is wanted, in 1/65,536 of full rate; 0 holds.
        6 Rate {
            /// 0 … 65,536.
            wanted: u32,
        }
        /// Come to rest on the path and forget the rest of it.
        7 Stop {}
        /// Outputs, one bit each; bit 0 is the spindle. Off by themselves 250 ms after the last frame of the session.
        8 Outputs {
            /// Those that are on.
            on: u8,
        }
        /// What stopped it was seen: ready again.
        9 Clear {}
        /// Where the machine is, said at rest.
        10 Place {
            /// Index of every axis.
            index: [i32; AXES],
        }
        /// Inputs that stop all pulses from now on, said at rest: a switch can be left only while it does not stop.
        11 Guard {
            /// One bit each.
            limits: u8,
        }
        /// The phases of a motor, said at rest, before the settings that name them.
        12 Windings {
            /// Which motor.
            axis: u8,
            /// How long the forcing of a winding stays without another step, in ticks.
            forcing: u32,
            /// Columns that there are.
            count: u8,
            /// Those of the machine's table, one after the other.
            columns: [u8; COLUMNS],
        }
        /// How long an input has to be touched to count as on, said at rest; none of a session that says nothing.
        16 Filters {
            /// Of every input, in µs; 0 for no filter.
            least_us: [u16; INPUTS],
        }
        /// How often inputs were touched for less than their filter; not numbered.
        17 CountTouches {}
    }
}

messages! {
    /// What the adapter says. Nothing of it is numbered: the latest counts, and any can be asked for again.
    Tell {
        /// Answer to a hello whose versions meet its own.
        129 Welcome {
            /// Version that both speak.
            version: u16,
            /// CRC-32C of the sources that the firmware was made of.
            firmware: u32,
            /// Clock in Hz.
            clock_hz: u32,
            /// Room for chunks, in bytes.
            buffer: u32,
            /// Frames that may be on their way at once.
            window: u8,
            /// Axes it drives.
            axes: u8,
            /// First step pin, by the map of steps; the others follow.
            step_pin: u8,
            /// First direction pin, by that map too.
            direction_pin: u8,
            /// Emergency stop, by the map in force, as the next two; by that of steps where nobody said which since the reset.
            stop_pin: u8,
            /// First input.
            input_pin: u8,
            /// First output.
            output_pin: u8,
            /// Most steps a second on every axis at once.
            max_rate_hz: u32,
            /// 1 where the watchdog was what last reset it.
            by_watchdog: u8,
        }
        /// Where everything is; every 10 ms, and at every change. Also what was received.
        130 Status {
            /// Number of the numbered frame that is waited for.
            next: u32,
            /// Which of those behind it are here already: bit 0 is `next` + 1.
            held: u8,
            /// Bytes of payload of all chunks of the session up to which there is room.
            limit: u32,
            /// What it is doing.
            state: State,
            /// Whether the index is where the machine is.
            trust: Trust,
            /// Input that stopped it, counted from 0; 255 where none did.
            input: u8,
            /// Index of every axis: at rest exact, in motion at most 2 ms ahead of the pins.
            index: [i32; AXES],
            /// Number of the chunk that is waited for.
            chunk: u32,
            /// Path that is here and not yet made into pulses, in ticks.
            resident: u32,
            /// Rate of time now.
            rate: u32,
            /// Inputs that are on; bit 15 is the emergency stop.
            inputs: u16,
            /// Outputs that are on.
            outputs: u8,
            /// CRC-32C of the settings' payload; 0 where there are none.
            settings: u32,
            /// Why the latest refused frame was refused.
            refusal: Refusal,
            /// Its number.
            refused: u32,
            /// The adapter's clock, in µs.
            micros: u32,
        }
        /// Answer to a hello whose versions do not meet: the session does not begin.
        131 Refused {
            /// Oldest version of the link that the adapter speaks.
            oldest: u16,
            /// Newest one.
            newest: u16,
        }
        /// Touches that were shorter than the filter of their input, since the adapter has power. Answer to [`CountTouches`].
        144 Touches {
            /// How many, of every input; 65,535 says that many or more.
            short: [u16; INPUTS],
            /// The longest of them, in µs.
            longest_us: [u16; INPUTS],
        }
    }
}
