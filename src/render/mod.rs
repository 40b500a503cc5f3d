//! Placeholder head of `render`.
