//! Passes the machine's reports to its listeners. A slow listener misses statuses, because newer ones follow.
//! It gets all other reports: a command that misses the end of its job would never end.

use annulus_core::wire::Tell;
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::mpsc::{Receiver, Sender, channel};

/// Limit of reports that wait for a listener. A listener with more is dropped.
const MOST: usize = 16_384;

/// With this many waiting reports, statuses are skipped.
const LATE: usize = 256;

#[derive(Clone, Default)]
pub(crate) struct Listeners(Arc<Mutex<Vec<Sender<Tell>>>>);

impl Listeners {
    pub(crate) fn add(&self) -> Receiver<Tell> {
        let (sender, receiver) = channel(MOST);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(sender);
        receiver
    }

    pub(crate) fn tell(&self, tell: &Tell) {
        let is_status = matches!(tell, Tell::Status(_));
        self.0.lock().unwrap_or_else(PoisonError::into_inner).retain(|listener| {
            if is_status && MOST - listener.capacity() >= LATE {
                return !listener.is_closed();
            }
            listener.try_send(tell.clone()).is_ok()
        });
    }
}
