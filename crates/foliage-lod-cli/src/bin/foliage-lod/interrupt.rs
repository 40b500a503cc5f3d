//! Ctrl-C handling: the first one requests a clean stop, so that temporary files are removed; the
//! second ends the process.

use foliage_lod::{Error, Result};
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Installs the handler for Ctrl-C and termination signals. If that fails, they end the process as
/// usual.
pub fn install() {
    let _ = ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
}

/// Whether the user has requested a stop.
pub fn is_requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// Checks for a requested stop; called between steps.
///
/// # Errors
/// [`Error::Interrupted`] once the user has requested a stop.
pub fn check() -> Result<()> {
    if is_requested() { Err(Error::Interrupted) } else { Ok(()) }
}
