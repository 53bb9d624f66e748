//! Every message of the link, described once: the table below generates types, writer and reader.
//!
//! Never renumber, only append: a changed layout gets a new kind, and [`crate::NEWEST`] grows.

use crate::bytes::{Plain, Reader, Writer};
use crate::{AXES, INPUTS};

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
        pub enum $name { $($message($message),)* }

        impl $name {
            pub fn kind(&self) -> u8 { match self { $(Self::$message(_) => $kind,)* } }

            pub const fn name(&self) -> &'static str {
                match self { $(Self::$message(_) => stringify!($message),)* }
            }

            pub fn put(&self, out: &mut Writer<'_>) { match self { $(Self::$message(message) => message.put(out),)* } }

            /// The message of a payload, and the bytes after it, which only a chunk has.
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

        impl $name {
            pub const fn name(self) -> &'static str {
                match self { $(Self::$word => stringify!($word),)* }
            }
        }

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
    /// State of the adapter. Only `Running` moves; new path is accepted in `Ready` and `Running`.
    State {
        /// The session has no settings yet.
        #[default]
        Unset,
        Ready,
        /// Steps are being given, or time is held between two of them.
        Running,
        /// Stopped on its tail because nothing newer arrived. The index is exact.
        Starved,
        /// Stopped by request with path left. The index is exact.
        Stopped,
        /// A limit switch stopped the pulses at once. The index is exact, but the motors may have overrun.
        Limit,
        /// The emergency stop is pressed, or was.
        EmergencyStop,
        /// The adapter missed its own timing: steps may be missing.
        Fault,
    }

    /// How far the index matches the machine position.
    Trust {
        /// No position was set since the last reset, or the machine was stopped by force in motion.
        #[default]
        Lost,
        /// A limit switch stopped it, or it ran dry.
        Suspect,
        /// Set by the bridge, and every step counted since.
        Trusted,
    }

    /// Reason of the latest refusal. A refusal does not change the motion.
    Refusal {
        #[default]
        None,
        /// Not allowed in this state.
        State,
        /// Not a message, or invalid runs.
        Form,
        /// A chunk before it is missing.
        Gap,
        /// Does not start at the end of the previous chunk.
        Index,
        /// Its runs do not add up to its head.
        Counts,
        /// Steps closer than pulse and pause allow.
        Rate,
        /// A turn without the driver's direction setup time.
        Turn,
        /// The tail in which it could stop has not fully arrived, or exceeds the limit.
        Tail,
        /// More bytes than the room left.
        Room,
        Settings,
        /// The emergency stop or a limit switch is still active.
        Input,
    }
}

messages! {
    Ask {
        /// First frame of a session, unnumbered. Ends every older session; repeating it changes nothing.
        1 Hello {
            oldest: u16,
            newest: u16,
        }
        /// Keep-alive, unnumbered. Every frame of the session keeps the outputs on; this one does nothing
        /// else.
        2 Beat {}
        3 Configure {
            /// Length of a pulse in ticks, 2 … 33.
            pulse: u8,
            /// Least time from a change of direction to the next pulse, in ticks.
            setup: u16,
            /// Inputs that stop all pulses while they are on, one bit each.
            limits: u8,
            /// Inputs that are on while their pin is low.
            low_inputs: u8,
            /// Axes with active-low pulses.
            low_steps: u8,
            /// Axes whose direction pin is high when they count down.
            low_forward: u8,
            /// Checksum of the [`Windings`] tables if the pins drive windings; 0 if they give steps and
            /// directions.
            phases: u32,
        }
        /// A piece of path. Its runs follow the head, axis by axis.
        4 Chunk {
            /// Number in the session, from 0 without gaps.
            number: u32,
            /// CRC-32C of the index of every axis before it and after it.
            places: u32,
            ticks: u32,
            /// Largest fall of the rate in a slice, in 1/65,536 of full rate.
            fall: u16,
            /// Largest rise of the rate.
            rise: u16,
            /// Direction of the first step after this chunk, one bit per axis, 1 for forward.
            ahead: u8,
            /// 1 if the path is stopped at its end, so that nothing must follow.
            rests: u8,
            runs: [u8; AXES],
        }
        5 Begin {}
        /// Requested rate of stream time, in 1/65,536 of full rate; 0 holds.
        6 Rate {
            /// 0 … 65,536.
            wanted: u32,
        }
        7 Stop {}
        /// Outputs, one bit each; bit 0 is the spindle. They go off 250 ms after the session's last frame.
        8 Outputs {
            on: u8,
        }
        /// The cause of a stop was acknowledged: ready again.
        9 Clear {}
        10 Place {
            index: [i32; AXES],
        }
        /// Inputs that stop all pulses from now on; only while stopped. Moving off a limit switch requires
        /// that it does not stop.
        11 Guard {
            limits: u8,
        }
        /// The phase table of a motor; while stopped, before the settings that name it.
        12 Windings {
            axis: u8,
            /// How long a winding stays forced without another step, in ticks.
            forcing: u32,
            count: u8,
            /// The columns of the machine's table, in order.
            columns: [u8; COLUMNS],
        }
        /// How long an input must be touched to count as on; while stopped. Without this message, no input
        /// has a filter.
        16 Filters {
            /// Of every input, in µs; 0 for no filter.
            least_us: [u16; INPUTS],
        }
        /// Requests the counts of touches shorter than their filter; unnumbered.
        17 CountTouches {}
    }
}

messages! {
    /// Messages of the adapter, all unnumbered: the latest counts, and each can be requested again.
    Tell {
        /// Answer to a hello with a common version.
        129 Welcome {
            /// Version that both speak.
            version: u16,
            /// CRC-32C of the firmware's sources.
            firmware: u32,
            clock_hz: u32,
            /// Room for chunks, in bytes.
            buffer: u32,
            /// Most frames that may be on their way.
            window: u8,
            axes: u8,
            /// First step pin in the map of steps; the others follow.
            step_pin: u8,
            /// First direction pin in that map.
            direction_pin: u8,
            /// Pin of the emergency stop. This and the next two refer to the current map, and before one is
            /// selected to that of steps.
            stop_pin: u8,
            input_pin: u8,
            output_pin: u8,
            max_rate_hz: u32,
            /// 1 if the watchdog caused the last reset.
            by_watchdog: u8,
        }
        /// The adapter's state and the frames received; sent every 10 ms and at every change.
        130 Status {
            next: u32,
            /// Later frames that have already arrived: bit 0 is `next` + 1.
            held: u8,
            /// Total payload bytes of the session's chunks up to which there is room.
            limit: u32,
            state: State,
            /// How far the index matches the machine position.
            trust: Trust,
            /// Input that stopped it, from 0; 255 for none.
            input: u8,
            /// Index of every axis: exact when stopped, at most 2 ms ahead of the pins in motion.
            index: [i32; AXES],
            chunk: u32,
            /// Path that has arrived and is not yet made into pulses, in ticks.
            resident: u32,
            rate: u32,
            /// Inputs that are on; bit 15 is the emergency stop.
            inputs: u16,
            outputs: u8,
            /// CRC-32C of the settings' payload; 0 without settings.
            settings: u32,
            refusal: Refusal,
            refused: u32,
            /// The adapter's clock, in µs.
            micros: u32,
        }
        /// Answer to a hello without a common version: no session starts.
        131 Refused {
            oldest: u16,
            newest: u16,
        }
        /// Touches shorter than their input's filter, since power-on. Answer to [`CountTouches`].
        144 Touches {
            /// Number for every input, saturating at 65,535.
            short: [u16; INPUTS],
            /// The longest of them, in µs.
            longest_us: [u16; INPUTS],
        }
    }
}
