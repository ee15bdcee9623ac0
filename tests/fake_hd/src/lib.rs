//! A library with the 36 entries of 3D Systems' libHD and no device behind them: an arm in a hand,
//! simulated, and faults by a plan. What drives a Touch is tested through it as it runs: found, loaded and
//! called as the true one.
//!
//! | file        | what                                                                    |
//! |-------------|-------------------------------------------------------------------------|
//! | `abi`       | types and numbers of HDAPI                                              |
//! | `exports`   | its functions                                                           |
//! | `values`    | what can be read and set, of which type                                 |
//! | `world`     | the device: errors, frames, calibration, motors and their limits        |
//! | `arm`       | the arm and the hand                                                    |
//! | `scheduler` | the thread that ticks, by the wall's clock or by ticks that are granted |
//! | `plan`      | faults: see there for how they are written                              |
//! | `control`   | entries of its own, `fakehd_`: for tests                                |
//!
//! An app runs on it unmodified: `OPENHAPTICS_LIBHD=.../libfake_hd.so FAKEHD_PLAN='unplug@5..9' APP`.
//! Nothing here is shared with the driver that it tests. Where HDAPI's documents are silent it is the
//! harsher of what may be: the last force stays on the motors until another frame ends, a thread has no
//! current device until it takes one.

pub mod abi;
mod arm;
pub mod control;
pub mod exports;
mod plan;
mod scheduler;
mod values;
mod world;

/// Locks, whoever panicked with it.
fn lock<T>(mutex: &std::sync::Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
