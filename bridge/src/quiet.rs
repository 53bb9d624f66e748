//! Catches expected panics of a library without their message. All other panics, and those of other
//! threads, are reported as usual.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    /// Panics of this thread are caught by [`caught`].
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Returns the result of `work`; `None` if it panicked. After a panic, the values that `work` used must not
/// be used again.
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

    #[test]
    #[ignore = "run by the test below, in a process of its own"]
    fn panics_are_caught() {
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
    fn only_caught_panics_are_silent() {
        let mut process = Command::new(std::env::current_exe().unwrap());
        process.args(["quiet::tests::panics_are_caught", "--exact", "--ignored", "--nocapture"]);
        let output = process.env("RUST_BACKTRACE", "1").output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{told}");
        assert_eq!(told.matches("panicked").count(), 2, "{told}");
        assert!(told.contains("of another thread") && told.contains("afterwards"), "{told}");
    }
}
