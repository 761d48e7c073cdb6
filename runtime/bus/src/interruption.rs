//! Ctrl-C for a command that has something to keep before it ends.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::control::{ending_signal_set, hold_back_signals};
use crate::error::BusError;

/// What a shell expects of a process that SIGINT has ended.
const INTERRUPTED_STATUS: i32 = 130;

/// Whether SIGINT or SIGTERM has come; the second one ends the process at once. To be called before any other thread starts.
///
/// # Errors
/// [`BusError::System`].
pub fn interruption() -> Result<Arc<AtomicBool>, BusError> {
    hold_back_signals()?;
    let flag = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&flag);
    std::thread::Builder::new()
        .name("interruption".into())
        .spawn(move || {
            while ending_signal_set().wait().is_ok() {
                if told.swap(true, Ordering::Relaxed) {
                    std::process::exit(INTERRUPTED_STATUS);
                }
            }
        })
        .map_err(|error| {
            let code = error.raw_os_error().unwrap_or_default();
            BusError::system("to wait for SIGINT")(nix::errno::Errno::from_raw(code))
        })?;
    Ok(flag)
}
