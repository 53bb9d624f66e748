//! The socket to the bridge, its timer and the keep-alive of a jog. On a site without a bridge, the worker of
//! the page's own drill takes the socket's place.

use super::drill::{self, Drill};
use super::serial::Serial;
use super::{jobs, last_stop, session, site};
use crate::browser::{document_hidden, window};
use crate::model::LinkEvent;
use crate::model::link::TICK_MS;
use crate::page::send;
use annulus_core::wire::{FRAME_LIMIT, JOG_GRANT_MS, Paired};
use leptos::leptos_dom::helpers::IntervalHandle;
use leptos::prelude::{set_interval, set_interval_with_handle};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::time::Duration;
use wasm_bindgen::prelude::*;
use web_sys::{CloseEvent, MessageEvent, WebSocket};

/// Two of three renewals may be late or lost.
const RENEW_EVERY: Duration = Duration::from_millis(JOG_GRANT_MS / 3);

/// A socket with its callbacks. Dropping both together silences late events of a closed socket.
struct Open {
    socket: WebSocket,
    _message: Closure<dyn FnMut(MessageEvent)>,
    _close: Closure<dyn FnMut(CloseEvent)>,
}

impl Drop for Open {
    fn drop(&mut self) {
        self.socket.set_onmessage(None);
        self.socket.set_onclose(None);
    }
}

#[derive(Default)]
pub(super) struct Line {
    open: RefCell<Option<Open>>,
    drill: RefCell<Option<Drill>>,
    pub(super) serial: Rc<Serial>,
    renews: Cell<Option<IntervalHandle>>,
}

/// Starts the link's timer and reports this tab's session. Called once.
pub(super) fn begin() {
    let token = session::token_from_address();
    // The page's own drill has no other clients, so an empty session is enough.
    let own = || Paired { ok: true, session: String::new(), key: String::new() };
    let kept = if site::alone() { Some(own()) } else { session::kept() };
    send(LinkEvent::Begun { token, kept, had_control: session::had_control() });
    set_interval(|| send(LinkEvent::Tick), Duration::from_millis(u64::from(TICK_MS)));
}

impl Line {
    /// Opens the chosen port, or a known one; a worker drives the controller.
    pub(super) fn connect_controller(&self) {
        drop(self.open.take());
        // The worker before must release its files first.
        drop(self.drill.take());
        let drill = self.serial.connect();
        if drill.is_none() {
            send(LinkEvent::Closed);
        }
        self.drill.replace(drill);
    }

    pub(super) fn leave_port(&self) {
        drop(self.drill.take());
        self.serial.leave();
    }

    pub(super) fn connect(&self) {
        if site::alone() {
            // The worker before must release its files first.
            drop(self.drill.take());
            let opened = drill::open();
            let failed = opened.is_none();
            self.drill.replace(opened);
            if failed {
                send(LinkEvent::Closed);
            }
            return;
        }
        let opened = open();
        let failed = opened.is_none();
        self.open.replace(opened);
        if failed {
            send(LinkEvent::Closed);
        }
    }

    /// Sends a text, or reports that the connection is not open.
    pub(super) fn send(&self, text: &str) {
        if let Some(drill) = &*self.drill.borrow() {
            if !drill.send(text) {
                send(LinkEvent::NotSent);
            }
            return;
        }
        let open = self.open.borrow();
        let socket = open.as_ref().map(|open| &open.socket);
        let socket = socket.filter(|socket| socket.ready_state() == WebSocket::OPEN);
        if socket.is_none_or(|socket| socket.send_with_str(text).is_err()) {
            send(LinkEvent::NotSent);
        }
    }

    pub(super) fn upload(&self, number: u32, bytes: Vec<u8>, session: Option<Paired>) {
        match &*self.drill.borrow() {
            Some(drill) => drill.upload(number, bytes),
            None => jobs::upload(number, bytes, session),
        }
    }

    pub(super) fn fetch(&self, number: u32, key: String, session: Option<Paired>) {
        match &*self.drill.borrow() {
            Some(drill) => drill.fetch(number, key),
            None => jobs::fetch(number, key, session),
        }
    }

    /// Starts or stops the keep-alive of a jog.
    pub(super) fn renew(&self, on: bool) {
        if let Some(before) = self.renews.take() {
            before.clear();
        }
        if on {
            let beat = || send(LinkEvent::Renew { hidden: document_hidden() });
            self.renews.set(set_interval_with_handle(beat, RENEW_EVERY).ok());
        }
    }
}

fn open() -> Option<Open> {
    let host = window().location().host().ok()?;
    // The bridge queues clients that name a session apart from unknown ones.
    let session = session::kept().map(|kept| format!("?session={}", kept.session)).unwrap_or_default();
    let socket = WebSocket::new(&format!("ws://{host}/api/socket{session}")).ok()?;
    let message = Closure::<dyn FnMut(MessageEvent)>::new(|event: MessageEvent| {
        if let Some(text) = event.data().as_string() {
            let read = (text.len() <= FRAME_LIMIT).then(|| serde_json::from_str(&text).ok()).flatten();
            send(LinkEvent::Heard { tell: read.map(Box::new) });
        }
    });
    let close = Closure::<dyn FnMut(CloseEvent)>::new(|_| send(LinkEvent::Closed));
    last_stop::is(&socket, "send", &last_stop::word().into());
    socket.set_onmessage(Some(message.as_ref().unchecked_ref()));
    socket.set_onclose(Some(close.as_ref().unchecked_ref()));
    Some(Open { socket, _message: message, _close: close })
}
