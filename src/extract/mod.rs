//! Placeholder head of `extract`.
