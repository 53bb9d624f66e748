//! The waiting room for connections that are not authenticated yet. No connection is refused: if the room
//! is full, the most silent and oldest guest is dropped.
//!
//! ```text
//! connections   silent ─▶ sent a valid request ─▶ became a socket, or ended: leaves
//! sockets       before hello ─▶ hello with a known key: leaves, for a seat
//! ```
//!
//! So strangers that wait here cannot keep others out.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use tokio::sync::oneshot;

pub(crate) struct Hall {
    room: usize,
    inside: Mutex<(u64, BTreeMap<u64, Guest>)>,
}

struct Guest {
    /// The guest sent something that our own page could have sent.
    polite: bool,
    /// Dropping it makes the guest leave.
    _stays: oneshot::Sender<()>,
}

/// A guest's entry, removed when dropped.
pub(crate) struct Place<'a> {
    hall: &'a Hall,
    number: u64,
}

impl Hall {
    pub(crate) fn new(room: usize) -> Self {
        Self { room, inside: Mutex::default() }
    }

    /// Adds a guest. The receiver ends when it must leave.
    pub(crate) fn enter(&self) -> (Place<'_>, oneshot::Receiver<()>) {
        let (stays, leaves) = oneshot::channel();
        let mut inside = self.inside.lock().unwrap_or_else(PoisonError::into_inner);
        let (next, guests) = &mut *inside;
        if guests.len() >= self.room {
            let first = |polite: bool| guests.iter().find(|(_, guest)| guest.polite == polite);
            let goes = first(false).or_else(|| first(true)).map(|(number, _)| *number);
            goes.and_then(|number| guests.remove(&number));
        }
        *next += 1;
        let number = *next;
        guests.insert(number, Guest { polite: false, _stays: stays });
        (Place { hall: self, number }, leaves)
    }
}

impl Place<'_> {
    /// The guest sent something that our own page could have sent: others are dropped first.
    pub(crate) fn polite(&self) {
        let mut inside = self.hall.inside.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(guest) = inside.1.get_mut(&self.number) {
            guest.polite = true;
        }
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        let mut inside = self.hall.inside.lock().unwrap_or_else(PoisonError::into_inner);
        inside.1.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use oneshot::error::TryRecvError;

    #[test]
    fn oldest_silent_connection_is_closed_first() {
        let hall = Hall::new(3);
        let (one, mut one_leaves) = hall.enter();
        let (_two, mut two_leaves) = hall.enter();
        let (three, _) = hall.enter();
        one.polite();
        assert_eq!(two_leaves.try_recv(), Err(TryRecvError::Empty));
        let (four, mut four_leaves) = hall.enter();
        assert_eq!(two_leaves.try_recv(), Err(TryRecvError::Closed), "the first who said nothing");
        assert_eq!(one_leaves.try_recv(), Err(TryRecvError::Empty));
        drop(three);
        let (five, _) = hall.enter();
        assert_eq!(four_leaves.try_recv(), Err(TryRecvError::Empty), "there was room");
        four.polite();
        five.polite();
        let (_six, mut six_leaves) = hall.enter();
        assert_eq!(one_leaves.try_recv(), Err(TryRecvError::Closed), "all were polite: the first of them");
        assert_eq!(
            (four_leaves.try_recv(), six_leaves.try_recv()),
            (Err(TryRecvError::Empty), Err(TryRecvError::Empty))
        );
    }
}
