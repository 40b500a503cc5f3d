//! Internal modules, exposed for the tests of this crate. Not part of the public interface:
//! anything here may change or be removed in any release.

/// Appearance of leaves in the views.
#[cfg(feature = "simplify")]
pub mod appearance {
    pub use crate::simplify::appearance::*;
}

/// Pictures of clusters.
#[cfg(feature = "simplify")]
pub mod clusters {
    pub use crate::simplify::clusters::all;
}

/// Fragment capture.
#[cfg(all(feature = "render", feature = "simplify"))]
pub mod capture {
    pub use crate::gpu::capture::*;
}
