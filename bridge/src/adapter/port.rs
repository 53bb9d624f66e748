//! The serial port of an adapter: the one in the machine file, or the only one with an adapter's USB ID.

use crate::serial::{self, Port};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_host::adapter::{Cable, USB};
use std::thread;
use std::time::Duration;

/// Any speed will do: USB ignores it.
const BAUD: u32 = 115_200;

/// Interval between attempts to open the port of an unplugged adapter.
const TRY: Duration = Duration::from_millis(100);

pub(crate) fn is_adapter(listed: &serial::Listed) -> bool {
    listed.usb == Some(USB)
}

pub(crate) fn adapters() -> Vec<String> {
    serial::list().into_iter().filter(is_adapter).map(|listed| listed.name).collect()
}

/// The port `name`; if empty, the only one with an adapter.
pub(super) fn named(name: &str) -> Result<String, Diagnostic> {
    if name.is_empty() { only(adapters()) } else { Ok(name.to_owned()) }
}

fn only(mut names: Vec<String>) -> Result<String, Diagnostic> {
    match names.len() {
        0 => Err(error!("adapter.not_found")),
        1 => Ok(names.swap_remove(0)),
        _ => Err(error!("adapter.several", ports = names.join(", "))),
    }
}

fn open(name: &str) -> Result<Port, Diagnostic> {
    let name = named(name)?;
    serial::open(&name, BAUD).map_err(|error| {
        let why = error!("adapter.port_unopened", ..);
        why.with("port", &name).with("reason", error.description)
    })
}

/// An adapter's port, which may return under another name after it was unplugged.
pub(super) struct Plug {
    /// As in the machine file; empty for the only adapter.
    wanted: String,
    /// As opened.
    name: String,
    port: Option<Port>,
}

impl Plug {
    pub(super) fn open(wanted: &str) -> Result<Self, Diagnostic> {
        let port = open(wanted)?;
        Ok(Self { wanted: wanted.to_owned(), name: port.name.clone(), port: Some(port) })
    }

    pub(super) fn port_name(&self) -> &str {
        &self.name
    }

    fn port(&mut self) -> Result<&mut Port, String> {
        self.port.as_mut().ok_or_else(|| std::io::ErrorKind::NotConnected.to_string())
    }
}

impl Cable for Plug {
    fn name(&self) -> &str {
        &self.name
    }

    fn read(&mut self) -> Result<Vec<u8>, String> {
        self.port()?.read().map_err(|error| error.to_string())
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.port()?.write(bytes).map_err(|error| error.to_string())
    }

    fn is_full(&self) -> bool {
        self.port.as_ref().is_some_and(Port::is_full)
    }

    fn again(&mut self) -> bool {
        if self.port.take().is_some() {
            tracing::warn!("the adapter at {} is disconnected: waiting for it", self.name);
        }
        thread::sleep(TRY);
        if let Ok(port) = open(&self.wanted) {
            tracing::info!("a device is at {} again", port.name);
            (self.name, self.port) = (port.name.clone(), Some(port));
        }
        self.port.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adapter_is_found_by_usb_number_only_if_it_is_the_only_one() {
        let listed = |usb| serial::Listed { name: "A".to_owned(), what: String::new(), usb };
        let found = [Some(USB), Some((USB.0, 2)), None].map(|usb| is_adapter(&listed(usb)));
        assert_eq!(found, [true, false, false]);
        let names = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(only(names("A")), Ok("A".to_owned()));
        assert_eq!(named("B"), Ok("B".to_owned()), "a name is a name");
        assert_eq!(only(names("")).unwrap_err().code, "adapter.not_found");
        let several = only(names("A B")).unwrap_err();
        assert_eq!(several.code, "adapter.several");
        assert!(several.message("en").contains("A, B"), "{}", several.message("en"));
    }
}
