//! A port of the page, whose bytes somebody else carries.
//!
//! Comes in: bytes, that it was opened, that it is gone. Goes out: bytes; a cable that never waits. Does not know what they mean.

use crate::adapter::Cable;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What messages call it: a browser does not tell a page the names of ports.
const NAME: &str = "USB";

/// Bytes that wait to be written, beyond which nothing more is said.
const MOST_WAITING: usize = 16 * 1024;

/// Bytes that came and wait to be read, at most.
const MOST_HEARD: usize = 64 * 1024;

#[derive(Default)]
struct Wire {
    is_open: bool,
    came: Vec<u8>,
    written: Vec<u8>,
}

/// The port. Every copy is the same port.
#[derive(Clone, Default)]
pub struct Port(Arc<Mutex<Wire>>);

impl Port {
    fn wire(&self) -> MutexGuard<'_, Wire> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// It is open now, for the first time or again.
    pub fn opened(&self) {
        *self.wire() = Wire { is_open: true, ..Wire::default() };
    }

    /// It is gone.
    pub fn gone(&self) {
        *self.wire() = Wire::default();
    }

    /// Bytes came from it. What has no room is lost: it is noise, or nobody reads, and frames that are lost are said again.
    pub fn bytes(&self, bytes: &[u8]) {
        let came = &mut self.wire().came;
        let room = MOST_HEARD.saturating_sub(came.len()).min(bytes.len());
        came.extend_from_slice(&bytes[..room]);
    }

    /// The bytes that are to go to it, in their order.
    pub fn written(&self) -> Vec<u8> {
        std::mem::take(&mut self.wire().written)
    }
}

impl Cable for Port {
    fn name(&self) -> &str {
        NAME
    }

    fn read(&mut self) -> Result<Vec<u8>, String> {
        let mut wire = self.wire();
        if wire.is_open { Ok(std::mem::take(&mut wire.came)) } else { Err("not connected".to_owned()) }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.wire().written.extend_from_slice(bytes);
        Ok(())
    }

    fn is_full(&self) -> bool {
        self.wire().written.len() >= MOST_WAITING
    }

    fn again(&mut self) -> bool {
        self.wire().is_open
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_reads_does_not_grow_without_end() {
        let mut port = Port::default();
        port.opened();
        (0..100).for_each(|_| port.bytes(&[7; 1_000]));
        assert_eq!(port.read().unwrap().len(), MOST_HEARD);
        port.bytes(&[1, 2]);
        assert_eq!(port.read().unwrap(), [1, 2]);
    }
}
