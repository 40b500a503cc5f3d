//! Conversion of wgpu's panics to errors.
//!
//! wgpu reports most device failures as errors, but panics on some driver failures: when waiting
//! for a lost device, and in some calls that run out of memory. The caller is not at fault and
//! receives an [`Error::Gpu`](crate::Error::Gpu) instead.
//!
//! Limits: with `panic = "abort"` the process still aborts. The panic hook still runs; to stay
//! silent, it must check [`is_guarding`].

use crate::{Error, Result};
use std::{
    any::Any,
    cell::Cell,
    panic::{AssertUnwindSafe, catch_unwind},
};

thread_local! {
    /// Number of nested guards on this thread.
    static GUARDS: Cell<u32> = const { Cell::new(0) };
}

/// Whether this thread is inside [`guarded`], where panics become errors: a panic hook need not
/// print them.
pub fn is_guarding() -> bool {
    GUARDS.get() > 0
}

/// Runs `work` and returns its result. After a panic, only drop the values that `work` modified.
///
/// # Errors
/// Any error of `work`; [`Error::Gpu`](crate::Error::Gpu) with the panic's message if it panics.
pub fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    caught(work).unwrap_or_else(|reason| Err(Error::gpu(reason)))
}

/// Runs `work` and returns its value, or the message of its panic.
pub(super) fn caught<T>(work: impl FnOnce() -> T) -> std::result::Result<T, String> {
    GUARDS.set(GUARDS.get() + 1);
    let done = catch_unwind(AssertUnwindSafe(work));
    GUARDS.set(GUARDS.get() - 1);
    done.map_err(|panic| format!("the driver failed: {}", message(&*panic)))
}

/// Message of a panic, on one line.
fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("panic without a message").split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_one_line_and_other_ends_stay_as_they_are() {
        let panicking = guarded::<()>(|| panic!("lost\n\n  the {}", "device"));
        let line = panicking.unwrap_err().to_string();
        assert!(line.starts_with("GPU: the driver failed: lost the device; "), "{line}");
        assert!(matches!(guarded(|| Ok(is_guarding())), Ok(true)));
        assert!(matches!(guarded::<()>(|| Err(Error::Interrupted)), Err(Error::Interrupted)));
        assert!(!is_guarding());
    }
}
