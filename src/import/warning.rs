//! Warnings: what an import ignored or changed.

use std::fmt;
use strum::{Display, IntoStaticStr};

/// Subject of a warning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display, IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
#[non_exhaustive]
pub enum WarningKind {
    /// A texture or material library that cannot be used, or only in part.
    Texture,
    /// Points, lines or attributes that are ignored.
    Geometry,
    /// A material of which nothing is drawn, or leaves that cannot be seen.
    Invisible,
    /// Leaves that are hardly a part of the plant, or cards that may be leaves and are not.
    Foliage,
    /// The plant has been moved to the origin.
    Moved,
    /// Animations or damaged joints: the plant stands in its rest pose.
    Pose,
    /// Parts that are not to be drawn and have been left out.
    LeftOut,
    /// Several plants in one file.
    SeveralPlants,
    /// Vertex colours that look like data, or whose alpha cannot be kept.
    VertexColors,
    /// The plant seems to lie on its side.
    Up,
}

/// Anything ignored or changed by an import that does not stop it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// Subject.
    pub kind: WarningKind,
    /// The thing ignored or changed and the reason, in one line.
    pub message: String,
    /// Fix, in one line that starts with a verb; empty if nothing needs to be done.
    pub fix: String,
}

impl Warning {
    pub(super) fn new(kind: WarningKind, message: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { kind, message: message.into(), fix: fix.into() }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.fix.is_empty() {
            true => f.write_str(&self.message),
            false => write!(f, "{}; {}", self.message, self.fix),
        }
    }
}
