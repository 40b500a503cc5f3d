//! Progress of a simplification, and the time that it took.

/// Receives the progress of a simplification and may stop it.
pub trait Observer: Send {
    /// Called when a phase of `total` units begins: `"growth"` (leaves of the trial), `"fragments"`
    /// (views), `"prune"` (leaves) or `"clusters"` (levels of detail).
    fn phase(&mut self, name: &str, total: u64);

    /// Called when `done` units of the phase are done. Returning false stops with
    /// [`Error::Interrupted`](crate::Error::Interrupted).
    fn advance(&mut self, done: u64) -> bool;
}

/// An observer that reports nothing and never stops.
pub struct Quiet;

impl Observer for Quiet {
    fn phase(&mut self, _: &str, _: u64) {}

    fn advance(&mut self, _: u64) -> bool {
        true
    }
}

/// Wall-clock seconds of each phase.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Seconds {
    /// Finding out how leaves grow, in a trial, and which become cards of clusters.
    pub growth: f64,
    /// Rasterising all views and sorting their fragments.
    pub fragments: f64,
    /// Finding the pruning order.
    pub prune: f64,
}
