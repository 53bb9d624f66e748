//! Locks of the browser (Web Locks), by which the tabs of a site agree on who has which storage slot. A lock
//! ends with the tab that holds it.
//!
//! ```text
//!   a lock per slot in use ─▶ no other tab writes there
//! ```
//!
//! In a browser without locks every slot is free.

use crate::browser::window;
use js_sys::{Array, Function, Object, Promise, Reflect};
use leptos::task::spawn_local;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;

/// After a reload, locks that this tab held before may still seem to belong to another tab for this long, in
/// ms.
pub(super) const RELOAD_MS: u32 = 1000;

/// A held lock; dropping it releases the lock.
struct Held(Option<Function>);

impl Drop for Held {
    fn drop(&mut self) {
        if let Some(release) = &self.0 {
            let _ = release.call0(&JsValue::UNDEFINED);
        }
    }
}

/// The browser's lock manager; `None` if it is missing or not available at this address.
fn locks() -> Option<JsValue> {
    let locks = Reflect::get(&window().navigator(), &"locks".into()).ok()?;
    locks.is_object().then_some(locks)
}

fn method(of: &JsValue, name: &str) -> Option<Function> {
    Reflect::get(of, &name.into()).ok()?.dyn_into().ok()
}

fn promise() -> Option<(Promise, Function)> {
    let mut kept = None;
    let promise = Promise::new(&mut |keep, _| kept = Some(keep));
    Some((promise, kept?))
}

#[derive(Clone, Copy)]
enum Way {
    /// Exclusive, if it becomes free within this time.
    Alone { patience_ms: u32 },
    /// Shared: granted when no tab holds it exclusively.
    Shared,
}

/// Requests the lock `name`; `None` if it was not granted.
async fn hold(name: &str, way: Way) -> Option<Held> {
    let Some(locks) = locks() else { return Some(Held(None)) };
    let request = method(&locks, "request")?;
    let ((answer, answered), (until, release)) = (promise()?, promise()?);
    let tell = answered.clone();
    let granted = Closure::once_into_js(move |lock: JsValue| {
        let is_ours = lock.is_object();
        let _ = tell.call1(&JsValue::UNDEFINED, &is_ours.into());
        // The browser holds the lock until this promise resolves.
        if is_ours { JsValue::from(until) } else { JsValue::UNDEFINED }
    });
    let options = Object::new();
    let (name_of_option, option) = match way {
        Way::Alone { patience_ms: 0 } => ("ifAvailable", true.into()),
        Way::Alone { patience_ms } => ("signal", ends_after(patience_ms)?),
        Way::Shared => ("mode", "shared".into()),
    };
    Reflect::set(&options, &name_of_option.into(), &option).ok()?;
    let asked: Promise = request.call3(&locks, &name.into(), &options, &granted).ok()?.dyn_into().ok()?;
    spawn_local(async move {
        if JsFuture::from(asked).await.is_err() {
            let _ = answered.call1(&JsValue::UNDEFINED, &false.into());
        }
    });
    let is_ours = JsFuture::from(answer).await.ok()?.is_truthy();
    is_ours.then_some(Held(Some(release)))
}

fn ends_after(ms: u32) -> Option<JsValue> {
    let signals = Reflect::get(&js_sys::global(), &"AbortSignal".into()).ok()?;
    method(&signals, "timeout")?.call1(&signals, &ms.into()).ok()
}

fn word(of: &JsValue, name: &str) -> Option<String> {
    Reflect::get(of, &name.into()).ok()?.as_string()
}

/// Names of the locks that any tab of this site holds exclusively.
async fn held() -> BTreeSet<String> {
    let asked = async {
        let locks = locks()?;
        let asked: Promise = method(&locks, "query")?.call0(&locks).ok()?.dyn_into().ok()?;
        let state = JsFuture::from(asked).await.ok()?;
        let held: Array = Reflect::get(&state, &"held".into()).ok()?.dyn_into().ok()?;
        let alone = held.iter().filter(|lock| word(lock, "mode").as_deref() == Some("exclusive"));
        Some(alone.filter_map(|lock| word(&lock, "name")).collect())
    };
    asked.await.unwrap_or_default()
}

struct Holding {
    _held: Held,
    /// Held only for a deletion or a first write: not yet a slot that this tab works in.
    for_now: bool,
}

/// The slots of one kind that this tab has. Copies share their state.
#[derive(Clone)]
pub(super) struct Claims {
    /// Prefix of the lock names; the slot's number follows.
    lock: &'static str,
    held: Rc<RefCell<BTreeMap<u32, Holding>>>,
    /// Slots of other tabs whose release is awaited.
    awaited: Rc<RefCell<BTreeSet<u32>>>,
}

impl Claims {
    pub(super) fn new(lock: &'static str) -> Self {
        Self { lock, held: Rc::default(), awaited: Rc::default() }
    }

    fn lock_of(&self, place: u32) -> String {
        format!("{}{place}", self.lock)
    }

    /// The slots below `end` that other tabs have. Excludes those that this tab has at the call, because the
    /// browser may still report a lock that was just released.
    pub(super) fn elsewhere(&self, end: u32) -> impl Future<Output = BTreeSet<u32>> + use<> {
        let own: BTreeSet<u32> = self.held.borrow().keys().copied().collect();
        let claims = self.clone();
        async move {
            let held = held().await;
            (0..end).filter(|place| !own.contains(place) && held.contains(&claims.lock_of(*place))).collect()
        }
    }

    /// Calls back once when the tab that has `place` releases it, however long that takes.
    pub(super) fn when_free(&self, place: u32, call: impl FnOnce() + 'static) {
        if !self.awaited.borrow_mut().insert(place) {
            return;
        }
        let this = self.clone();
        spawn_local(async move {
            let is_free = hold(&this.lock_of(place), Way::Shared).await.is_some();
            this.awaited.borrow_mut().remove(&place);
            if is_free {
                call();
            }
        });
    }

    /// True if this tab works in `place`, and does not only hold it temporarily.
    pub(super) fn works_at(&self, place: u32) -> bool {
        self.held.borrow().get(&place).is_some_and(|holding| !holding.for_now)
    }

    /// Holds `place` temporarily if no tab has it, including this one.
    pub(super) async fn hold(&self, place: u32) -> bool {
        self.hold_soon(place, 0).await
    }

    async fn hold_soon(&self, place: u32, patience_ms: u32) -> bool {
        if self.held.borrow().contains_key(&place) {
            return false;
        }
        let held = hold(&self.lock_of(place), Way::Alone { patience_ms }).await;
        let is_held = held.is_some();
        self.held.borrow_mut().extend(held.map(|held| (place, Holding { _held: held, for_now: true })));
        is_held
    }

    /// Turns a temporary hold into a slot that this tab works in.
    pub(super) fn settle(&self, place: u32) {
        if let Some(holding) = self.held.borrow_mut().get_mut(&place) {
            holding.for_now = false;
        }
    }

    /// Works in `place` if no other tab has it.
    pub(super) async fn take(&self, place: u32) -> bool {
        self.take_soon(place, 0).await
    }

    /// Like [`Self::take`], but waits `patience_ms` for a release: the lock may be this tab's own from before
    /// a reload.
    pub(super) async fn take_soon(&self, place: u32, patience_ms: u32) -> bool {
        let own = self.works_at(place) || self.hold_soon(place, patience_ms).await;
        if own {
            self.settle(place);
        }
        own
    }

    pub(super) fn let_go(&self, place: u32) {
        self.held.borrow_mut().remove(&place);
    }

    /// Holds temporarily, of the slots below `end`, an empty one, else the one written longest ago.
    /// `written_ms` returns negative infinity for an empty slot.
    pub(super) async fn claim(&self, end: u32, written_ms: impl AsyncFn(u32) -> f64) -> Option<u32> {
        let mut places = Vec::new();
        for place in 0..end {
            places.push((written_ms(place).await, place));
        }
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (seen_ms, place) in places {
            if !self.hold(place).await {
                continue;
            }
            if written_ms(place).await > seen_ms {
                // Another tab wrote to the slot meanwhile.
                self.let_go(place);
                continue;
            }
            return Some(place);
        }
        None
    }
}
