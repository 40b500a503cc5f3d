//! How much memory a thread holds while it works, and how much a file of some size may ask for.

/// Bytes held for each byte of a file, and for any file.
const BOUND: [u64; 2] = [64, 64_000_000];

/// What `read` gives for a file of `length` bytes, and the most bytes that it held at once on this thread, which must be
/// within the bound.
pub fn within_bounds<T>(length: u64, read: impl FnOnce() -> T) -> (T, u64) {
    let (value, held) = held(read);
    let bound = BOUND[0] * length + BOUND[1];
    assert!(held <= bound, "{held} bytes are held for a file of {length}, more than {bound}");
    (value, held)
}

/// What `work` gives, and the most bytes that it held at once on this thread.
pub fn held<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let mut value = None;
    let counted = allocation_counter::measure(|| value = Some(work()));
    (value.expect("the work was done"), counted.bytes_max)
}
