//! How much memory there is to take, so that what would take more is refused before the work.

use sysinfo::{MemoryRefreshKind, System};

/// Bytes in a megabyte.
pub const MEGABYTE: u64 = 1_000_000;

/// Megabytes that may be taken: `max_mb`, or what [`available_bytes`] tells where that is `None`.
pub(crate) fn limit_mb(max_mb: Option<u64>) -> Option<u64> {
    max_mb.or_else(|| available_bytes().map(|bytes| bytes / MEGABYTE))
}

/// Bytes that this process may take without swapping: what the machine has available, and no more than the limit of the
/// container (control group of Linux) that it runs in leaves. `None` where the system does not tell.
///
/// Limits: a control group is seen where it is mounted as the root, as containers do it.
pub fn available_bytes() -> Option<u64> {
    let mut system = System::new();
    system.refresh_memory_specifics(MemoryRefreshKind::nothing().with_ram());
    if system.total_memory() == 0 {
        return None;
    }
    let of_machine = system.available_memory();
    let of_group = system.cgroup_limits().map(|group| group.total_memory.saturating_sub(group.rss));
    Some(of_group.map_or(of_machine, |bytes| bytes.min(of_machine)))
}
