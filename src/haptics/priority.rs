//! Priority of the threads of force and clay.

use std::sync::OnceLock;
use thread_priority::{Error, ThreadPriority, set_current_thread_priority};

/// Place of the threads among those of the system's real-time class, 0 to 99 [-]: above what audio has by
/// custom (70), below the kernel's own.
#[cfg(unix)]
const REAL_TIME: u8 = 80;

static REFUSAL: OnceLock<String> = OnceLock::new();

/// Raises the calling thread: into the system's real-time class; where that is not allowed, as far above
/// other threads as is. On Linux a user needs the limit `rtprio` or `nice` for that.
///
/// # Errors
/// The system's words where neither is allowed: the thread goes on as it was, and is late where the machine
/// is busy. [`refusal`] keeps them.
pub fn raise() -> Result<(), String> {
    #[cfg(unix)]
    let raised = into_real_time().or_else(|_| set_current_thread_priority(ThreadPriority::Max));
    #[cfg(not(unix))]
    let raised = set_current_thread_priority(ThreadPriority::Max);
    raised.map_err(|error: Error| {
        let words = error.to_string();
        _ = REFUSAL.set(words.clone());
        words
    })
}

#[cfg(unix)]
fn into_real_time() -> Result<(), Error> {
    use thread_priority::unix::{
        RealtimeThreadSchedulePolicy, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
    };
    let priority = ThreadPriority::Crossplatform(REAL_TIME.try_into().map_err(|_| Error::Priority("beyond 99"))?);
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), priority, policy)
}

/// Why a thread of this program was not raised, if one was not.
pub fn refusal() -> Option<&'static str> {
    REFUSAL.get().map(String::as_str)
}
