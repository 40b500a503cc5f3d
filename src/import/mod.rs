//! Placeholder head of `import`.
