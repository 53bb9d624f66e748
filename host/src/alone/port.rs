//! A serial port of the page: other code carries its bytes.

use crate::adapter::Cable;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Name of the port in messages: browsers do not reveal the real one.
const NAME: &str = "USB";

/// Most bytes that may wait to be written; then the port counts as full.
const MOST_WAITING: usize = 16 * 1024;

/// Most received bytes that may wait to be read.
const MOST_HEARD: usize = 64 * 1024;

#[derive(Default)]
struct Wire {
    is_open: bool,
    came: Vec<u8>,
    written: Vec<u8>,
}

/// The port. All clones share it.
#[derive(Clone, Default)]
pub struct Port(Arc<Mutex<Wire>>);

impl Port {
    fn wire(&self) -> MutexGuard<'_, Wire> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn opened(&self) {
        *self.wire() = Wire { is_open: true, ..Wire::default() };
    }

    pub fn gone(&self) {
        *self.wire() = Wire::default();
    }

    /// Takes received bytes. Excess bytes are dropped: they are noise, or nothing reads them, and lost
    /// frames are repeated.
    pub fn bytes(&self, bytes: &[u8]) {
        let came = &mut self.wire().came;
        let room = MOST_HEARD.saturating_sub(came.len()).min(bytes.len());
        came.extend_from_slice(&bytes[..room]);
    }

    /// Takes the bytes to send, in order.
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
    fn unread_bytes_are_limited() {
        let mut port = Port::default();
        port.opened();
        (0..100).for_each(|_| port.bytes(&[7; 1_000]));
        assert_eq!(port.read().unwrap().len(), MOST_HEARD);
        port.bytes(&[1, 2]);
        assert_eq!(port.read().unwrap(), [1, 2]);
    }
}
