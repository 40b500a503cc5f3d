//! Ctrl-C: the first asks the work to stop, so that temporary files are removed; the second ends the process.

use foliage_lod::{Error, Result};
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C and the system's wish to terminate are noted. Where no handler can be set they end the process.
pub fn install() {
    let _ = ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
}

/// True once the user asked to stop.
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// Called between steps.
///
/// # Errors
/// [`Error::Interrupted`] once the user asked to stop.
pub fn check() -> Result<()> {
    if is_requested() { Err(Error::Interrupted) } else { Ok(()) }
}
