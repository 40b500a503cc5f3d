//! Available memory, so that work that would need more can be rejected before it starts.

use sysinfo::{MemoryRefreshKind, System};

/// Bytes in a megabyte.
pub const MEGABYTE: u64 = 1_000_000;

/// Memory limit in megabytes: `max_mb` if set, else [`available_bytes`].
pub(crate) fn limit_mb(max_mb: Option<u64>) -> Option<u64> {
    max_mb.or_else(|| available_bytes().map(|bytes| bytes / MEGABYTE))
}

/// Bytes that this process can allocate without swapping: the machine's available memory, capped by
/// what remains of the container's limit (Linux control group). `None` if the system does not
/// report it.
///
/// Limits: a control group is detected only where it is mounted as the root, as containers do.
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
