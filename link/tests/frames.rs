//! Tests of frames and messages: round trips, and rejection of everything else.

use crate::support::seeds;
use annulus_core::chance::Chance;
use annulus_link::bytes::Writer;
use annulus_link::cobs::Unstuffer;
use annulus_link::crc::crc32c;
use annulus_link::frame::{FRAME, Header, ON_LINE, PAYLOAD, open, seal};
use annulus_link::message::{Ask, Chunk, Configure, Hello, Outputs, Status, Tell, Welcome, Windings};
use annulus_link::run::Run;

#[test]
fn checksum_is_crc_32c() {
    assert_eq!(crc32c(b"123456789"), 0xE306_9283);
    assert_eq!(crc32c(&[0; 32]), 0x8A91_36AA);
    assert_eq!(crc32c(&[]), 0);
}

#[test]
fn stuffed_bytes_match_cobs() {
    let rows: [(&[u8], &[u8]); 4] = [
        (&[0], &[1, 1, 0]),
        (&[0x11, 0x22, 0, 0x33], &[3, 0x11, 0x22, 2, 0x33, 0]),
        (&[0x11, 0, 0, 0], &[2, 0x11, 1, 1, 1, 0]),
        (&[], &[1, 0]),
    ];
    for (plain, stuffed) in rows {
        let mut out = [0xAA; 16];
        let mut stuffer = annulus_link::cobs::Stuffer::new(&mut out);
        plain.iter().for_each(|byte| stuffer.put(*byte));
        let length = stuffer.end().unwrap();
        assert_eq!(&out[..length], stuffed);
    }
}

fn payload(chance: &mut Chance) -> Vec<u8> {
    let length = if chance.below(2) == 0 { chance.below(8) } else { chance.below(PAYLOAD + 1) };
    let zeros = chance.below(3);
    (0..length)
        .map(|_| match zeros {
            0 => 0,
            1 => 1 + chance.below(255) as u8,
            _ => chance.bits() as u8 & chance.bits() as u8,
        })
        .collect()
}

#[test]
fn every_frame_is_read_after_noise() {
    for seed in seeds(300) {
        let mut chance = Chance::new(seed);
        let (mut line, mut unstuffer) = ([0; ON_LINE], Unstuffer::<FRAME>::new());
        for _ in 0..20 {
            // Noise ends with a zero, or spoils only the next frame.
            for _ in 0..chance.below(40) {
                let _ = unstuffer.take(chance.bits() as u8);
            }
            let _ = unstuffer.take(0);
            let header = Header {
                session: chance.bits() as u32,
                number: chance.bits() as u32,
                kind: chance.bits() as u8,
            };
            let payload = payload(&mut chance);
            let length = seal(header, &payload, &mut line).unwrap();
            assert_eq!(line[..length].iter().filter(|byte| **byte == 0).count(), 1);
            let found = line[..length].iter().find_map(|byte| unstuffer.take(*byte).map(<[u8]>::to_vec));
            let found = found.expect("the frame is there");
            assert_eq!(open(&found), Some((header, payload.as_slice())));
        }
    }
}

#[test]
fn frame_with_a_flipped_bit_is_rejected() {
    let header = Header { session: 7, number: 8, kind: 9 };
    let mut line = [0; ON_LINE];
    let length = seal(header, &[1, 0, 255, 4], &mut line).unwrap();
    for bit in 0..8 * (length - 1) {
        let mut bad = line;
        bad[bit / 8] ^= 1 << (bit % 8);
        let mut unstuffer = Unstuffer::<FRAME>::new();
        for byte in &bad[..length] {
            if let Some(frame) = unstuffer.take(*byte) {
                assert_eq!(open(frame), None, "bit {bit}");
            }
        }
    }
}

#[test]
fn overlong_payloads_and_endless_lines_are_rejected() {
    let mut line = [0; ON_LINE];
    assert_eq!(seal(Header::default(), &[1; PAYLOAD + 1], &mut line), None);
    assert!(seal(Header::default(), &[0; PAYLOAD], &mut line).is_some());
    assert!(seal(Header::default(), &[1; PAYLOAD], &mut line).is_some());
    let mut unstuffer = Unstuffer::<FRAME>::new();
    assert!((0..10 * FRAME).all(|_| unstuffer.take(3).is_none()));
    assert_eq!(unstuffer.take(0), None);
}

fn there_and_back(ask: &Ask) {
    let mut bytes = [0; PAYLOAD];
    let mut out = Writer::new(&mut bytes);
    ask.put(&mut out);
    let length = out.end().unwrap();
    assert_eq!(Ask::take(ask.kind(), &bytes[..length]), Some((*ask, [].as_slice())));
    for short in 0..length {
        assert_eq!(Ask::take(ask.kind(), &bytes[..short]), None, "{ask:?} from {short} bytes");
    }
}

#[test]
fn messages_have_stable_bytes() {
    there_and_back(&Hello { oldest: 1, newest: 2 }.into());
    there_and_back(&Configure { pulse: 10, setup: 300, limits: 3, ..Configure::default() }.into());
    let columns = std::array::from_fn(|column| column as u8);
    there_and_back(&Windings { axis: 2, forcing: 20_000, count: 12, columns }.into());
    there_and_back(&Chunk { number: 5, places: 0xFFFF_FFFE, fall: 7, ..Chunk::default() }.into());
    let bytes = |put: &dyn Fn(&mut Writer<'_>)| {
        let mut bytes = [0; PAYLOAD];
        let mut out = Writer::new(&mut bytes);
        put(&mut out);
        let length = out.end().unwrap();
        bytes[..length].to_vec()
    };
    assert_eq!(bytes(&|out| Ask::from(Hello { oldest: 1, newest: 0x203 }).put(out)), [1, 0, 3, 2]);
    assert_eq!(bytes(&|out| Ask::from(Outputs { on: 5 }).put(out)), [5]);
    assert_eq!(bytes(&|out| Tell::from(Welcome::default()).put(out)).len(), 26);
    assert_eq!(bytes(&|out| Tell::from(Status::default()).put(out)).len(), 56);
    let steady = Run { count: 3, ..Run::one(true, 300) };
    assert_eq!(
        bytes(&|out| steady.put(None, out)),
        [0xB2, 3, 0x96, 1],
        "forward, even, 18 zeros: 75 times 4 ticks"
    );
    assert_eq!(bytes(&|out| steady.put(Some(&steady), out)), [0xB2, 3, 0]);
    let ramp =
        Run { forward: false, count: 9, interval: 1736, fraction: 0, change: -1_589_248, phase: 0x8000 };
    let next = Run { count: 13, interval: 1523, change: -1_114_112, ..ramp };
    assert_eq!(bytes(&|out| next.put(Some(&ramp), out)), [16, 13, 12, 4], "a ramp that goes on");
    let cut = Run { phase: 0x1234, ..ramp };
    assert_eq!(bytes(&|out| cut.put(Some(&cut), out)).last_chunk(), Some(&[0x34, 0x12]));
}

#[test]
fn runs_read_back_after_any_predecessor() {
    let mut longest = 0;
    for seed in seeds(2000) {
        let mut chance = Chance::new(seed);
        let mut any = || {
            let parts = chance.below(1 << 40) as u64 >> chance.below(40);
            let bits = |chance: &mut Chance| chance.below(1 << 32) as u32 as i32 >> chance.below(32);
            Run {
                forward: chance.below(2) == 0,
                count: 1 + chance.below(1 << 20) as u32,
                interval: (parts >> 16) as u32,
                fraction: parts as u16,
                change: bits(&mut chance) << chance.below(20),
                phase: if chance.below(2) == 0 {
                    annulus_link::run::HALF
                } else {
                    chance.below(1 << 16) as u16
                },
            }
        };
        let (before, run) = (any(), any());
        for before in [None, Some(&before)] {
            let mut bytes = [0; 32];
            let mut out = Writer::new(&mut bytes);
            run.put(before, &mut out);
            let length = out.end().expect("room");
            longest = longest.max(length);
            let mut from = annulus_link::bytes::Reader::new(&bytes[..length]);
            let mut over = from;
            assert_eq!(Run::take(before, &mut from), Some(run), "{before:?}");
            assert_eq!((Run::skip(&mut over), over.rest()), (Some(()), from.rest()));
            assert!(from.rest().is_empty());
            let mut short = annulus_link::bytes::Reader::new(&bytes[..length - 1]);
            assert_eq!(Run::take(before, &mut short), None);
        }
    }
    println!("{longest} bytes at most");
}

#[test]
fn random_bytes_never_break_the_readers() {
    for seed in seeds(2000) {
        let mut chance = Chance::new(seed);
        let payload = payload(&mut chance);
        for kind in [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 99, 129, 130, 131] {
            let _ = Ask::take(kind, &payload);
            let _ = Tell::take(kind, &payload);
        }
        let mut from = annulus_link::bytes::Reader::new(&payload);
        let mut before = None;
        while let Some(run) = Run::take(before.as_ref(), &mut from) {
            let _ = run.extent();
            before = Some(run);
        }
    }
}
