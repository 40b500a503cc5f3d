//! Placeholder head of `simplify`.
