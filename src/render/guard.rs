//! Panics of wgpu become errors.
//!
//! wgpu reports most of what goes wrong on a device. Where a driver fails in ways that it does not expect it panics:
//! waiting for a lost device does, and so do some calls that find no memory. That is no fault of the caller, who gets an
//! [`Error::Gpu`](crate::Error::Gpu) instead.
//!
//! Limits: with `panic = "abort"` the process ends as it would without. The process's panic hook still runs, and prints
//! unless it asks [`is_guarding`].

use super::device::gpu_error;
use crate::Result;
use std::{
    any::Any,
    cell::Cell,
    panic::{AssertUnwindSafe, catch_unwind},
};

thread_local! {
    /// How many guards are around what this thread does.
    static GUARDS: Cell<u32> = const { Cell::new(0) };
}

/// True while this thread does work whose panics become errors: a panic hook need not tell them.
pub fn is_guarding() -> bool {
    GUARDS.get() > 0
}

/// What `work` gives. When it panics, what it has changed should not be used any more but for being dropped.
///
/// # Errors
/// Those of `work`; [`Error::Gpu`](crate::Error::Gpu) with the panic's message when it panics.
pub fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    caught(work).unwrap_or_else(|reason| Err(gpu_error(reason)))
}

/// What `work` gives, or what was said when it panicked.
pub(super) fn caught<T>(work: impl FnOnce() -> T) -> std::result::Result<T, String> {
    GUARDS.set(GUARDS.get() + 1);
    let done = catch_unwind(AssertUnwindSafe(work));
    GUARDS.set(GUARDS.get() - 1);
    done.map_err(|panic| format!("the driver failed: {}", message(&*panic)))
}

/// What was said at a panic, on one line.
fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("it did not say how").split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;

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
