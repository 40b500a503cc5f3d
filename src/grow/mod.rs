//! Placeholder head of `grow`.
