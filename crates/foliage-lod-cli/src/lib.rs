//! Library of the `foliage-lod` command: reports on the quality and the cost of levels of detail,
//! and a window.

#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod report;
#[cfg(feature = "viewer")]
pub mod window;
