//! Requests of the screens to the machine, and what most of them ask about it.

use super::{read, send};
use crate::model::LinkEvent;
use annulus_core::control::State;
use annulus_core::wire::Ask;

pub fn ask(wish: Ask) {
    send(LinkEvent::Ask { wish });
}

pub fn stop() {
    send(LinkEvent::Stop);
}

/// The machine's state, if one is connected.
pub fn state() -> Option<State> {
    read(|m| m.link.state())
}

/// True if the machine moves or is about to.
pub fn busy() -> bool {
    read(|m| m.link.busy())
}

/// True if this page may request motion.
pub fn may_act() -> bool {
    read(|m| m.link.may_act())
}

pub fn ready() -> bool {
    read(|m| m.link.may_act() && m.link.state() == Some(State::Ready))
}

/// True if this page may change the machine's settings: it has control, and nothing moves.
pub fn may_change() -> bool {
    read(|m| m.link.may_act() && !m.link.busy())
}
