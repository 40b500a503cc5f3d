//! The `foliage-lod` command.

fn main() {}
