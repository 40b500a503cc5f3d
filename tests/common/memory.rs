//! Measures the peak memory of a thread, and checks it against a bound given by the size of a file.

/// Bytes allowed per byte of a file, and bytes allowed for any file.
const BOUND: [u64; 2] = [64, 64_000_000];

/// Runs `read` for a file of `length` bytes and returns its result and its peak memory on this
/// thread, in bytes. Panics if the peak is above [`BOUND`].
pub fn within_bounds<T>(length: u64, read: impl FnOnce() -> T) -> (T, u64) {
    let (value, held) = held(read);
    let bound = BOUND[0] * length + BOUND[1];
    assert!(held <= bound, "a file of {length} bytes takes {held} bytes of memory, more than {bound}");
    (value, held)
}

/// Runs `work` and returns its result and its peak memory on this thread, in bytes.
pub fn held<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let mut value = None;
    let counted = allocation_counter::measure(|| value = Some(work()));
    (value.expect("the work was done"), counted.bytes_max)
}
