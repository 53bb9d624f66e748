//! Caches a site without a bridge in the browser (service worker), and reports new versions.
//!
//! ```text
//! register ─▶ installed ─▶ waits ─ FrameEvent::UpdateReady ─▶ the user accepts ─▶ "take over" ─▶ reload
//!                            └─ all windows closed: active at the next visit
//! ```

use crate::browser::window;
use crate::model::FrameEvent;
use crate::page::send;
use crate::said::{Text, key};
use leptos::prelude::set_interval;
use leptos::task::spawn_local;
use std::time::Duration;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{MessageEvent, ServiceWorkerContainer, ServiceWorkerRegistration, ServiceWorkerState};

const KEEPER: &str = "service-worker.js";

/// How often an open page checks for a new version.
const LOOK_EVERY: Duration = Duration::from_secs(3_600);

/// True if the site has no bridge.
pub(super) fn alone() -> bool {
    let root = window().document().and_then(|document| document.document_element());
    root.is_some_and(|root| root.has_attribute("data-alone"))
}

/// The browser's service workers; `None` if they are not available at this address.
fn keepers() -> Option<ServiceWorkerContainer> {
    let keepers = window().navigator().service_worker();
    (!keepers.is_undefined()).then_some(keepers)
}

fn watch_network() {
    let tell = || send(FrameEvent::Online { on: window().navigator().on_line() });
    let changed = Closure::<dyn FnMut()>::new(tell);
    for name in ["online", "offline"] {
        let _ = window().add_event_listener_with_callback(name, changed.as_ref().unchecked_ref());
    }
    changed.forget();
    tell();
}

/// Reports when the site is cached, now or since an earlier visit.
async fn tell_when_kept(keepers: &ServiceWorkerContainer) {
    if let Ok(ready) = keepers.ready()
        && JsFuture::from(ready).await.is_ok()
    {
        send(FrameEvent::SiteKept);
    }
}

/// Caches the site, and listens for new versions and for the network. Called once. A bridge's site is not
/// cached.
pub(super) fn begin() {
    watch_network();
    if !alone() {
        return;
    }
    send(FrameEvent::Alone);
    let Some(keepers) = keepers() else { return };
    let heard = Closure::<dyn FnMut(MessageEvent)>::new(|event: MessageEvent| {
        if event.data().as_string().as_deref() == Some("others") {
            send(FrameEvent::Say { text: Text::of(key!("page.update.others")) });
        }
    });
    keepers.set_onmessage(Some(heard.as_ref().unchecked_ref()));
    heard.forget();
    spawn_local(async move {
        match JsFuture::from(keepers.register(KEEPER)).await {
            Ok(kept) => {
                watch(&keepers, kept.unchecked_into());
                tell_when_kept(&keepers).await;
            }
            // The page works, but not offline.
            Err(why) => web_sys::console::warn_1(&why),
        }
    });
}

fn watch(keepers: &ServiceWorkerContainer, kept: ServiceWorkerRegistration) {
    if kept.waiting().is_some() {
        send(FrameEvent::UpdateReady);
    }
    let (keepers, of) = (keepers.clone(), kept.clone());
    let coming = move || {
        // On the first visit the version being installed is the one on screen, so it is no update.
        let Some(new) = of.installing().filter(|_| keepers.controller().is_some()) else { return };
        let worker = new.clone();
        let changed = Closure::<dyn FnMut()>::new(move || {
            if worker.state() == ServiceWorkerState::Installed {
                send(FrameEvent::UpdateReady);
            }
        });
        new.set_onstatechange(Some(changed.as_ref().unchecked_ref()));
        changed.forget();
    };
    // The browser may have found an update before this page could listen.
    coming();
    let found = Closure::<dyn FnMut()>::new(coming);
    kept.set_onupdatefound(Some(found.as_ref().unchecked_ref()));
    found.forget();
    set_interval(
        move || {
            if let Ok(looked) = kept.update() {
                spawn_local(async move { drop(JsFuture::from(looked).await) });
            }
        },
        LOOK_EVERY,
    );
}

/// Activates the waiting version and reloads. The service worker refuses while another window is open.
pub(super) fn take_update() {
    let Some(keepers) = keepers() else { return };
    let reload = Closure::once_into_js(|| drop(window().location().reload()));
    keepers.set_oncontrollerchange(Some(reload.unchecked_ref()));
    spawn_local(async move {
        let Ok(kept) = JsFuture::from(keepers.get_registration()).await else { return };
        let Ok(kept) = kept.dyn_into::<ServiceWorkerRegistration>() else { return };
        if let Some(waiting) = kept.waiting() {
            let _ = waiting.post_message(&"take over".into());
        }
    });
}
