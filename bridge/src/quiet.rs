//! Panics that are expected of a library and caught at once: nobody at the machine is to see one.
//!
//! Comes in: work that may panic. Goes out: what came of it, or nothing. Panics of everything else, and of other threads in the
//! meantime, are told as ever. Does not know the work.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    /// Whether this thread's panics are caught by [`caught`].
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// What came of `work`; none where it panicked, of which nothing is said. What `work` had in hand must not be used afterwards.
pub(crate) fn caught<T>(work: impl FnOnce() -> T) -> Option<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let told_by = panic::take_hook();
        panic::set_hook(Box::new(move |what| {
            if !QUIET.get() {
                told_by(what);
            }
        }));
    });
    let outer = QUIET.replace(true);
    let done = catch_unwind(AssertUnwindSafe(work)).ok();
    QUIET.set(outer);
    done
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;
    use std::thread;

    /// What the test below looks at from outside.
    #[test]
    #[ignore = "run by the test below, in a process of its own"]
    fn some_panics() {
        assert_eq!(caught(|| 7), Some(7));
        assert_eq!(caught(|| panic!("by design")), None::<()>);
        let in_another = || {
            assert_eq!(caught(|| panic!("by design")), None::<()>);
            panic!("by design")
        };
        assert_eq!(caught(in_another), None::<()>);
        caught(|| assert!(thread::spawn(|| panic!("of another thread")).join().is_err()));
        assert!(catch_unwind(|| panic!("afterwards")).is_err());
    }

    #[test]
    fn only_what_is_caught_by_design_is_quiet() {
        let mut process = Command::new(std::env::current_exe().unwrap());
        process.args(["quiet::tests::some_panics", "--exact", "--ignored", "--nocapture"]);
        let output = process.env("RUST_BACKTRACE", "1").output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{told}");
        assert_eq!(told.matches("panicked").count(), 2, "{told}");
        assert!(told.contains("of another thread") && told.contains("afterwards"), "{told}");
    }
}
