//! The hall: those who came in and have not yet shown that they belong here. It is never shut: when it is full, somebody
//! goes, and who said least and came first goes first.
//!
//! ```text
//! connections   said nothing ─▶ sent a request that is ours ─▶ became a socket, or ended: out of the hall
//! sockets       before hello ─▶ hello with a key that is known: out of the hall, to a seat
//! ```
//!
//! Comes in: arrivals. Goes out: who is to leave. Nobody who waits here can keep anybody else out. Does not know HTTP.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use tokio::sync::oneshot;

/// Those who wait, by their number.
pub(crate) struct Hall {
    room: usize,
    inside: Mutex<(u64, BTreeMap<u64, Guest>)>,
}

struct Guest {
    /// Whether it said something that our own page could have said.
    polite: bool,
    /// Kept until it is to leave: dropping it is the sign.
    _stays: oneshot::Sender<()>,
}

/// A place in the hall, given back when it is dropped.
pub(crate) struct Place<'a> {
    hall: &'a Hall,
    number: u64,
}

impl Hall {
    /// A hall for `room` guests.
    pub(crate) fn new(room: usize) -> Self {
        Self { room, inside: Mutex::default() }
    }

    /// Somebody comes in. The receiver ends when he has to go.
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
    /// He said something that our own page could have said: those who did not go before him.
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
    fn who_said_nothing_and_came_first_goes_first() {
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
