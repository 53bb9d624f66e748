//! What the system can do for pulses: the real-time class for one thread, and memory that is never swapped out.
//!
//! Goes out: none where it was granted, else why not. Being refused is no error: the lateness that is measured afterwards
//! tells what it costs.

/// Puts the calling thread into the real-time class (first in, first out, middle priority).
#[cfg(target_os = "linux")]
pub(crate) fn ask_for_class() -> Option<String> {
    /// Above interrupt threads would be too much, below them is late.
    const PRIORITY: i32 = 45;
    let parameters = libc::sched_param { sched_priority: PRIORITY };
    #[expect(unsafe_code, reason = "no package of ours wraps this call")]
    // SAFETY: the call reads the parameters during the call; thread 0 is the calling one.
    let answer = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) };
    (answer != 0).then(|| std::io::Error::last_os_error().to_string())
}

/// Locks this process' memory, now and later.
#[cfg(target_os = "linux")]
pub(crate) fn ask_for_memory() -> Option<String> {
    use rustix::mm::{MlockAllFlags, mlockall};
    use rustix::process::{Resource, geteuid, getrlimit};
    /// With less, what is asked for later would fail, and that is worse than being swapped out.
    const ENOUGH: u64 = 256 << 20;
    let limit = getrlimit(Resource::Memlock).current.filter(|limit| *limit < ENOUGH);
    if let Some(limit) = limit.filter(|_| !geteuid().is_root()) {
        return Some(format!("only {} kB may be locked", limit >> 10));
    }
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).err().map(|error| error.to_string())
}

/// Not here.
#[cfg(not(target_os = "linux"))]
pub(crate) fn ask_for_class() -> Option<String> {
    Some("this system has none".to_owned())
}

/// Not here.
#[cfg(not(target_os = "linux"))]
pub(crate) fn ask_for_memory() -> Option<String> {
    Some("this system cannot".to_owned())
}
