//! The real-time priority of a thread.

/// Gives the calling thread the scheduling class SCHED_FIFO with a priority from 1 to 99.
///
/// Linux refuses this without CAP_SYS_NICE or a sufficient limit RLIMIT_RTPRIO.
#[allow(unsafe_code, reason = "sched_setscheduler has no safe wrapper")]
pub fn set_fifo(priority: i32) -> nix::Result<()> {
    let parameters = libc::sched_param {
        sched_priority: priority,
    };
    // SAFETY: 0 is the calling thread, `parameters` outlives the call, and the kernel only reads it.
    let result = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) };
    nix::errno::Errno::result(result).map(drop)
}

/// Lowers the priority of the calling thread to a nice value from 1 to 19, if possible.
#[allow(unsafe_code, reason = "setpriority has no safe wrapper")]
pub fn lower(nice: i32) {
    // SAFETY: no memory is touched; 0 is the calling thread, and raising its nice value is always permitted.
    unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, nice) };
}

/// Setup of a thread that serves a device: it takes the priority directly below that of the loop.
///
/// A refusal is ignored here, because the loop's own thread reports the same refusal.
pub fn device_thread_setup(loop_priority: i32) -> impl Fn() + Send + Sync + Clone + use<> {
    let priority = (loop_priority - 1).max(1);
    move || {
        let _ = set_fifo(priority);
    }
}
