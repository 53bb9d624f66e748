//! Web Serial: opens a port that the user chose, now or before, and carries its bytes to and from a worker.
//! The worker drives the controller or the USB step adapter at the port. The worker also owns all timers,
//! because a hidden page slows its own. An adapter, recognized by its USB identifiers, may be replugged.
//!
//! ```text
//! click ─▶ requestPort ─▶ open 115200 ─▶ read ══ bytes ══▶ worker        no answer: next baud rate
//!                                       write ◀═ bytes ══                port gone: Unplugged
//! ```

use super::drill::{self, Drill, ForPort};
use super::{last_stop, session};
use crate::browser::window;
use crate::engine::drill::{CONTROLLER, tell as post};
use crate::engine::messages::ToDrill;
use crate::model::{ControllerEvent, LinkEvent, Support};
use crate::page::send;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::BITS_PER_S;
use annulus_core::{code, error};
use annulus_host::adapter::USB;
use js_sys::{Array, Object, Promise, Reflect, Uint8Array};
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::{Event, Worker};

/// Give up after this many baud rates if nothing was received: at a wrong rate a controller would be received
/// as noise.
const USUAL: usize = 4;
/// Feed hold of the GRBL family.
const HOLD: u8 = b'!';
/// Soft reset of the GRBL family: stops all motion and the spindle.
const RESET: u8 = 0x18;
/// Name of the error when the port is gone. After any other error the line was only disturbed and can be read
/// again.
const GONE: &str = "NetworkError";

#[wasm_bindgen]
extern "C" {
    /// `navigator.serial`. web-sys offers Web Serial only with a flag that changes other types.
    #[wasm_bindgen(extends = Object)]
    #[derive(Clone)]
    type Ports;
    #[wasm_bindgen(method, catch, js_name = requestPort)]
    async fn request_port(this: &Ports) -> Result<JsValue, JsValue>;
    #[wasm_bindgen(method, catch, js_name = getPorts)]
    async fn get_ports(this: &Ports) -> Result<JsValue, JsValue>;
    #[wasm_bindgen(method, js_name = addEventListener)]
    fn add_event_listener(this: &Ports, name: &str, listener: &JsValue);

    #[wasm_bindgen(extends = Object)]
    #[derive(Clone)]
    type Port;
    #[wasm_bindgen(method, catch)]
    async fn open(this: &Port, options: &JsValue) -> Result<JsValue, JsValue>;
    #[wasm_bindgen(method, catch)]
    async fn close(this: &Port) -> Result<JsValue, JsValue>;
    #[wasm_bindgen(method, js_name = getInfo)]
    fn info(this: &Port) -> JsValue;
    #[wasm_bindgen(method, getter)]
    fn readable(this: &Port) -> Option<Stream>;
    #[wasm_bindgen(method, getter)]
    fn writable(this: &Port) -> Option<Stream>;

    type Stream;
    #[wasm_bindgen(method, catch, js_name = getReader)]
    fn get_reader(this: &Stream) -> Result<Reader, JsValue>;
    #[wasm_bindgen(method, catch, js_name = getWriter)]
    fn get_writer(this: &Stream) -> Result<Writer, JsValue>;

    #[wasm_bindgen(extends = Object)]
    #[derive(Clone)]
    type Reader;
    #[wasm_bindgen(method, catch)]
    async fn read(this: &Reader) -> Result<JsValue, JsValue>;
    #[wasm_bindgen(method, catch)]
    async fn cancel(this: &Reader) -> Result<JsValue, JsValue>;
    #[wasm_bindgen(method, js_name = releaseLock)]
    fn release_lock(this: &Reader);

    #[wasm_bindgen(extends = Object)]
    #[derive(Clone)]
    type Writer;
    #[wasm_bindgen(method, catch)]
    fn write(this: &Writer, bytes: &Uint8Array) -> Result<Promise, JsValue>;
    #[wasm_bindgen(method, js_name = releaseLock)]
    fn release_writer(this: &Writer);
}

struct Open {
    port: Port,
    reader: Reader,
    writer: Writer,
    disturbed: u32,
}

enum Found {
    /// The port; true if it is exactly the chosen one, false if only its USB identifiers match.
    One(Port, bool),
    Nobody,
    Several,
}

#[derive(Default)]
pub(super) struct Serial {
    chosen: RefCell<Option<Port>>,
    open: RefCell<Option<Open>>,
    /// Counts requests; a task of an older request ends.
    count: Cell<u32>,
    /// Index of the baud rate in use.
    speed: Cell<usize>,
    /// Something was received since the first baud rate was tried, even noise.
    heard: Cell<bool>,
    guards: Cell<bool>,
    /// The worker of an adapter whose cable was pulled.
    waits: RefCell<Option<Worker>>,
}

fn usb(port: &Port) -> [Option<f64>; 2] {
    let info = port.info();
    ["usbVendorId", "usbProductId"]
        .map(|name| Reflect::get(&info, &name.into()).ok().and_then(|number| number.as_f64()))
}

fn usb_words(port: &Port) -> String {
    usb(port).map(|number| number.map_or_else(|| "-".to_owned(), |number| number.to_string())).join(":")
}

/// True if the USB identifiers are those of a step adapter.
fn is_adapter(port: &Port) -> bool {
    usb(port) == [Some(f64::from(USB.0)), Some(f64::from(USB.1))]
}

fn ports() -> Option<Ports> {
    let ports = Reflect::get(&window().navigator(), &"serial".into()).ok()?;
    ports.is_object().then(|| ports.unchecked_into())
}

/// Whether this browser offers Web Serial on this page.
pub(super) fn support() -> Support {
    match ports() {
        Some(_) => Support::Yes,
        None if window().is_secure_context() => Support::Missing,
        None => Support::Insecure,
    }
}

fn name_of(error: &JsValue, field: &str) -> String {
    let text = Reflect::get(error, &field.into()).ok().and_then(|text| text.as_string());
    text.unwrap_or_else(|| format!("{error:?}"))
}

fn tell(event: ControllerEvent) {
    send(LinkEvent::Controller(event));
}

fn failed(code: &str, error: &JsValue) -> Diagnostic {
    Diagnostic::error(code).with("reason", name_of(error, "message"))
}

async fn known() -> Vec<Port> {
    let Some(ports) = ports() else { return Vec::new() };
    let list = ports.get_ports().await.map(JsCast::unchecked_into::<Array>).unwrap_or_default();
    list.iter().map(JsCast::unchecked_into).collect()
}

/// Reports to the model what the browser offers, before the link starts; later whether a port is known.
pub(super) fn begin() {
    let support = support();
    tell(ControllerEvent::Looked { support, kept: session::had_controller(), before: session::kept_board() });
    if support == Support::Yes {
        spawn_local(async { tell(ControllerEvent::Known { any: !known().await.is_empty() }) });
    }
}

impl Serial {
    /// Listens for plugged devices and for the end of the page. Called once.
    pub(super) fn listen(self: &Rc<Self>) {
        if let Some(ports) = ports() {
            let this = Rc::clone(self);
            let plugged = Closure::<dyn FnMut()>::new(move || this.plugged());
            ports.add_event_listener("connect", plugged.as_ref());
            plugged.forget();
        }
        let guards = Rc::clone(self);
        let leaves = Closure::<dyn FnMut(Event)>::new(move |event: Event| {
            if guards.guards.get() {
                event.prevent_default();
            }
        });
        let gone = Closure::<dyn FnMut()>::new(|| tell(ControllerEvent::PageLeft));
        let page = window();
        let _ = page.add_event_listener_with_callback("beforeunload", leaves.as_ref().unchecked_ref());
        let _ = page.add_event_listener_with_callback("pagehide", gone.as_ref().unchecked_ref());
        leaves.forget();
        gone.forget();
    }

    /// A known device was plugged in. While an adapter is awaited, other devices are ignored.
    fn plugged(self: &Rc<Self>) {
        if self.waits.borrow().is_none() {
            return tell(ControllerEvent::Plugged);
        }
        let this = Rc::clone(self);
        spawn_local(async move {
            let Some(port) = this.adapter_of_before().await else { return };
            let Some(worker) = this.waits.take() else { return };
            this.chosen.replace(Some(port));
            let count = this.next();
            this.carry(worker, count).await;
        });
    }

    /// Turns the browser's confirmation before leaving the page on or off.
    pub(super) fn guard(&self, on: bool) {
        self.guards.set(on);
    }

    /// Shows the browser's port dialog.
    pub(super) fn choose(self: &Rc<Self>) {
        let Some(ports) = ports() else { return };
        let this = Rc::clone(self);
        spawn_local(async move {
            match ports.request_port().await {
                Ok(port) => {
                    this.chosen.replace(Some(port.unchecked_into()));
                    this.speed.set(0);
                    this.heard.set(false);
                    tell(ControllerEvent::Chosen);
                }
                Err(error) => match name_of(&error, "name").as_str() {
                    // The user closed the dialog, which is not an error.
                    "NotFoundError" => {}
                    _ => tell(ControllerEvent::Failed { why: failed(code!("serial.not_chosen"), &error) }),
                },
            }
        });
    }

    pub(super) fn connect(self: &Rc<Self>) -> Option<Drill> {
        let this = Rc::clone(self);
        let drill = drill::hire(CONTROLLER, move |word| this.word(word))?;
        let (this, worker, count) = (Rc::clone(self), drill.worker().clone(), self.next());
        spawn_local(async move { this.carry(worker, count).await });
        Some(drill)
    }

    pub(super) fn leave(self: &Rc<Self>) {
        self.next();
        let this = Rc::clone(self);
        spawn_local(async move { this.close().await });
    }

    /// Sends feed hold: once the page is closed, nothing feeds the job.
    pub(super) fn hold(&self) {
        self.put(&[HOLD]);
    }

    fn next(&self) -> u32 {
        drop(self.waits.take());
        self.count.set(self.count.get() + 1);
        self.count.get()
    }

    fn word(self: &Rc<Self>, word: ForPort) {
        match word {
            ForPort::Bytes(bytes) => self.put(&bytes),
            ForPort::Silent => self.is_silent(),
        }
    }

    /// Nothing understandable was received at this baud rate: tries the next one, or reports that nothing
    /// answers.
    fn is_silent(&self) {
        let next = self.speed.get() + 1;
        let is_mute = next >= USUAL && !self.heard.get();
        if next < BITS_PER_S.len() && !is_mute {
            self.speed.set(next);
            tell(ControllerEvent::OtherSpeed);
        } else {
            self.speed.set(0);
            self.heard.set(false);
            tell(ControllerEvent::Failed { why: error!("grbl.no_answer") });
        }
    }

    fn put(&self, bytes: &[u8]) {
        let Some(writer) = self.open.borrow().as_ref().map(|open| open.writer.clone()) else { return };
        // Call write synchronously: a closing page gets no later turn. If it fails, the port is gone, which
        // the reader reports.
        if let Ok(written) = writer.write(&Uint8Array::from(bytes)) {
            let written = JsFuture::from(written);
            spawn_local(async move { drop(written.await) });
        }
    }

    async fn close(&self) {
        let Some(open) = self.open.take() else { return };
        let _ = open.reader.cancel().await;
        open.reader.release_lock();
        open.writer.release_writer();
        let _ = open.port.close().await;
    }

    /// The chosen port, if it still exists. Else one with the same USB identifiers, because a replug or a
    /// reload may create a new object. If the user chose none in this tab, the known port.
    async fn find(&self) -> Found {
        let mut known = known().await;
        let chosen = self.chosen.borrow().clone();
        let very = chosen.as_ref().and_then(|chosen| known.iter().position(|port| Object::is(port, chosen)));
        if let Some(at) = very {
            return Found::One(known.swap_remove(at), true);
        }
        if let Some(before) = chosen.as_ref().map(usb_words).or_else(session::kept_port) {
            known.retain(|port| usb_words(port) == before);
        }
        match (known.pop(), known.is_empty()) {
            (None, _) => Found::Nobody,
            (Some(port), true) => Found::One(port, false),
            (Some(_), false) => Found::Several,
        }
    }

    /// The port of the adapter whose cable was pulled. If the browser gives it a new object, only when it is
    /// the only one.
    async fn adapter_of_before(&self) -> Option<Port> {
        let mut adapters = known().await;
        adapters.retain(is_adapter);
        let chosen = self.chosen.borrow();
        let same =
            chosen.as_ref().and_then(|chosen| adapters.iter().position(|port| Object::is(port, chosen)));
        match (same, adapters.len()) {
            (Some(at), _) => Some(adapters.swap_remove(at)),
            (None, 1) => adapters.pop(),
            (None, _) => None,
        }
    }

    /// Carries bytes from the port to the worker until the port is gone or another request follows.
    async fn carry(&self, worker: Worker, count: u32) {
        self.close().await;
        let found = self.find().await;
        if self.count.get() != count {
            return;
        }
        let (port, very) = match found {
            Found::One(port, very) => (port, very),
            Found::Nobody => return send(LinkEvent::Closed),
            Found::Several => return tell(ControllerEvent::Several),
        };
        let adapter = is_adapter(&port);
        let mut reader = match self.open(port).await {
            Ok(reader) => reader,
            Err(error) => {
                return tell(ControllerEvent::Failed { why: failed(code!("serial.not_opened"), &error) });
            }
        };
        if self.count.get() != count {
            return self.close().await;
        }
        tell(ControllerEvent::Opened { adapter, very });
        if adapter {
            drill::begin_adapter(&worker);
        } else {
            drill::begin(&worker);
        }
        loop {
            let read = reader.read().await;
            if self.count.get() != count {
                break;
            }
            let read = match read {
                Ok(read) => read,
                Err(error) => {
                    let Some(again) = self.read_anew(&error) else { break };
                    reader = again;
                    continue;
                }
            };
            if Reflect::get(&read, &"done".into()).is_ok_and(|done| done.is_truthy()) {
                break;
            }
            if let Ok(bytes) = Reflect::get(&read, &"value".into()) {
                self.heard.set(true);
                post(&worker, &ToDrill::Bytes(Uint8Array::new(&bytes).to_vec()));
            }
        }
        if self.count.get() == count {
            post(&worker, &ToDrill::Unplugged);
            // An adapter knows its position: the same worker continues after a replug.
            self.waits.replace(adapter.then_some(worker));
        }
    }

    /// Continues with another reader after a disturbance, which ends a reader but not the port. `None` if the
    /// port is gone.
    fn read_anew(&self, error: &JsValue) -> Option<Reader> {
        let kind = name_of(error, "name");
        let (reader, times) = {
            let mut open = self.open.borrow_mut();
            let open = open.as_mut().filter(|_| kind != GONE)?;
            let stream = open.port.readable()?;
            open.reader.release_lock();
            open.reader = stream.get_reader().ok()?;
            open.disturbed = open.disturbed.saturating_add(1);
            (open.reader.clone(), open.disturbed)
        };
        tell(ControllerEvent::Disturbed { kind, times });
        Some(reader)
    }

    async fn open(&self, port: Port) -> Result<Reader, JsValue> {
        let options = Object::new();
        let bits_per_s = BITS_PER_S[self.speed.get()];
        Reflect::set(&options, &"baudRate".into(), &bits_per_s.into())?;
        Reflect::set(&options, &"bufferSize".into(), &4_096.into())?;
        port.open(&options).await?;
        let missing = || JsValue::from_str("the port has no streams");
        let reader = port.readable().ok_or_else(missing)?.get_reader()?;
        let writer = port.writable().ok_or_else(missing)?.get_writer()?;
        if is_adapter(&port) {
            last_stop::is_none();
        } else {
            last_stop::is(&writer, "write", &Uint8Array::from([RESET].as_slice()));
        }
        self.chosen.replace(Some(port.clone()));
        session::keep_port(&usb_words(&port));
        self.open.replace(Some(Open { port, reader: reader.clone(), writer, disturbed: 0 }));
        Ok(reader)
    }
}
