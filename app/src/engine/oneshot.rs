//! A value that somebody else will bring, once.
//!
//! Comes in: the value, or nothing when whoever had to bring it is gone. Goes out: a future. Knows nothing else.

use std::cell::RefCell;
use std::future::Future;
use std::pin::Pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

struct Cell<T> {
    value: Option<T>,
    waker: Option<Waker>,
}

/// The bringing end.
pub(super) struct Bringer<T>(Rc<RefCell<Cell<T>>>);

/// The waiting end.
pub(super) struct Coming<T>(Rc<RefCell<Cell<T>>>);

pub(super) fn oneshot<T>() -> (Bringer<T>, Coming<T>) {
    let cell = Rc::new(RefCell::new(Cell { value: None, waker: None }));
    (Bringer(cell.clone()), Coming(cell))
}

impl<T> Bringer<T> {
    pub(super) fn bring(self, value: T) {
        self.0.borrow_mut().value = Some(value);
    }
}

impl<T> Drop for Bringer<T> {
    fn drop(&mut self) {
        let waker = self.0.borrow_mut().waker.take();
        if let Some(waker) = waker {
            waker.wake();
        }
    }
}

impl<T> Future for Coming<T> {
    /// None when the bringing end went without bringing anything.
    type Output = Option<T>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<T>> {
        if let Some(value) = self.0.borrow_mut().value.take() {
            return Poll::Ready(Some(value));
        }
        if Rc::strong_count(&self.0) == 1 {
            return Poll::Ready(None);
        }
        self.0.borrow_mut().waker = Some(context.waker().clone());
        Poll::Pending
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};
    use std::task::Wake;

    #[derive(Default)]
    struct Bell(AtomicU32);
    impl Wake for Bell {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn look<T>(coming: &mut Coming<T>, bell: &Arc<Bell>) -> Poll<Option<T>> {
        Pin::new(coming).poll(&mut Context::from_waker(&Waker::from(bell.clone())))
    }

    #[test]
    fn what_is_brought_arrives_and_wakes_who_waits() {
        let bell = Arc::new(Bell::default());
        let (bringer, mut coming) = oneshot();
        assert!(look(&mut coming, &bell).is_pending());
        bringer.bring(7);
        assert_eq!(bell.0.load(Ordering::Relaxed), 1);
        assert_eq!(look(&mut coming, &bell), Poll::Ready(Some(7)));
    }

    #[test]
    fn a_bringer_that_goes_without_a_word_wakes_too() {
        let bell = Arc::new(Bell::default());
        let (bringer, mut coming) = oneshot::<u8>();
        assert!(look(&mut coming, &bell).is_pending());
        drop(bringer);
        assert_eq!(bell.0.load(Ordering::Relaxed), 1);
        assert_eq!(look(&mut coming, &bell), Poll::Ready(None));
    }
}
