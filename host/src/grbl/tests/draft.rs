//! Tests of a station as the bridge hosts it, without a page: another thread writes the G-code.

use super::{Memory, NOW, holes};
use crate::grbl::{Setup, Station};
use crate::owner::Message;
use crate::programs::Upload;
use annulus_core::machine::Value;
use annulus_core::wire::{Ask, RowVerdict, Tell, program};
use std::sync::Arc;
use std::sync::mpsc::channel;

pub(super) fn station(files: &Memory) -> Station<Memory> {
    let tickets = Arc::default();
    let (named, command, in_page) = (None, None, false);
    let setup = Setup { speed: 1.0, time: || NOW.get(), tickets, named, in_page, command };
    Station::open(files.clone(), setup).unwrap()
}

#[test]
fn job_written_for_other_settings_is_not_armed() {
    let mut station = station(&Memory::default());
    let bytes = program::encode(&holes(4));
    let key = program::key(&bytes);
    assert_eq!(station.draft(&key, 0).err().unwrap().code, "control.no_such_job");
    station.upload(Upload::checked(&key, bytes).unwrap());
    assert_eq!(station.draft(&key, 3).err().unwrap().code, "control.leg_not_offered");
    let before = station.draft(&key, 0).unwrap().unwrap().write().unwrap();
    let changes = vec![("stroke.feed".to_owned(), Value::Number(1.0))];
    let (reply, answer) = channel();
    station.take(Message::Ask { ask: Ask::Configure { changes }, ticket: None, reply });
    assert_eq!(answer.try_recv().unwrap(), Ok(Vec::new()));
    assert_eq!(station.arm(&key, 0, Some(before)).unwrap_err().code, "control.not_armed");
    let now = station.draft(&key, 0).unwrap().unwrap().write().unwrap();
    let Tell::Armed(armed) = station.arm(&key, 0, Some(now)).unwrap() else { panic!() };
    let warned = |code: &str| {
        armed.checks.iter().any(|row| row.finding.code == code && row.verdict == RowVerdict::Warn)
    };
    assert!(warned("grbl.bridge_feeds") && !warned("grbl.page_feeds"), "{armed:?}");
}
