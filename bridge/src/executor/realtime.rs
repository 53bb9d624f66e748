//! System services for precise pulses: the real-time class for one thread, and memory that is never swapped
//! out. A refusal is no error: the measured lateness shows its effect.

/// Puts the calling thread into the real-time class (first in, first out, middle priority). Returns the
/// reason if refused.
#[cfg(target_os = "linux")]
pub(crate) fn ask_for_class() -> Option<String> {
    /// Just below the interrupt threads: above them it would block the system.
    const PRIORITY: i32 = 45;
    let parameters = libc::sched_param { sched_priority: PRIORITY };
    #[expect(unsafe_code, reason = "no package of ours wraps this call")]
    // SAFETY: the call reads the parameters during the call; thread 0 is the calling one.
    let answer = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) };
    (answer != 0).then(|| std::io::Error::last_os_error().to_string())
}

/// Locks this process' memory, now and later. Returns the reason if refused.
#[cfg(target_os = "linux")]
pub(crate) fn ask_for_memory() -> Option<String> {
    use rustix::mm::{MlockAllFlags, mlockall};
    use rustix::process::{Resource, geteuid, getrlimit};
    /// With a lower limit later allocations would fail, which is worse than swapping.
    const ENOUGH: u64 = 256 << 20;
    let limit = getrlimit(Resource::Memlock).current.filter(|limit| *limit < ENOUGH);
    if let Some(limit) = limit.filter(|_| !geteuid().is_root()) {
        return Some(format!("only {} kB may be locked", limit >> 10));
    }
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).err().map(|error| error.to_string())
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn ask_for_class() -> Option<String> {
    Some("this system has none".to_owned())
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn ask_for_memory() -> Option<String> {
    Some("this system cannot".to_owned())
}
