//! The crate's only error type: every variant carries the offending value and suggests a fix.

use std::{
    borrow::Cow,
    fmt::Display,
    io::ErrorKind,
    ops::RangeInclusive,
    path::{Path, PathBuf},
};

/// Everything that can go wrong, with the offending value and a suggested fix.
///
/// The message is one line without a trailing full stop, ready to be printed after `error: `.
/// Suggested fixes name options by their field in backticks, so that a program can substitute its
/// own spelling.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be opened, read or written.
    #[error("{}: {}", path.display(), told(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// A file's content is damaged or violates its format.
    #[error("{}: {reason}; {fix}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The defect, with the offending value.
        reason: String,
        /// Suggested fix.
        fix: String,
    },
    /// A file is valid but requires a feature that this crate does not support.
    #[error("{}: {feature} is not supported; {fix}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// Name of the extension or format.
        feature: String,
        /// Suggested fix.
        fix: String,
    },
    /// Nothing in the plant qualifies as separable leaves.
    #[error("{name}: no separable leaves: {reason}; {fix}")]
    NoLeaves {
        /// Name of the plant or file.
        name: String,
        /// Why nothing qualified.
        reason: String,
        /// Suggested fix.
        fix: String,
    },
    /// A plant violates one of the numbered invariants of [`Plant`](crate::Plant).
    #[error("plant violates invariant {invariant}: {what}")]
    InvalidPlant {
        /// Number of the invariant in the type's documentation.
        invariant: u8,
        /// The violation, with the index and the offending value.
        what: String,
    },
    /// A model violates one of the numbered invariants of
    /// [`FoliageModel`](crate::model::FoliageModel).
    #[error("model violates invariant {invariant}: {what}")]
    InvalidModel {
        /// Number of the invariant in the type's documentation.
        invariant: u8,
        /// The violation, with the index and the offending value.
        what: String,
    },
    /// An option or parameter is outside its range.
    #[error("{field} is {value}; it must be {allowed}")]
    InvalidOption {
        /// Field of the options struct, or dotted key of the file, that holds the value, such as
        /// `max_scale` or `effects.wind.strength`.
        field: Cow<'static, str>,
        /// The offending value.
        value: String,
        /// The allowed values.
        allowed: String,
    },
    /// An input or a working set exceeds a documented limit; nothing was allocated for it.
    #[error("{what} is {value}, above the limit of {limit}; {fix}")]
    TooLarge {
        /// The quantity that is too large.
        what: String,
        /// The offending value.
        value: u64,
        /// The limit.
        limit: u64,
        /// Suggested fix.
        fix: String,
    },
    /// The GPU is missing, was rejected or failed.
    #[error("GPU: {reason}; {fix}")]
    Gpu {
        /// The failure.
        reason: String,
        /// Suggested fix.
        fix: String,
    },
    /// The caller requested cancellation.
    #[error("interrupted; every file is whole or as it was")]
    Interrupted,
}

impl Error {
    /// Creates an [`Error::Io`] for `path`.
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Self::Io { path: path.as_ref().to_path_buf(), source }
    }

    /// Creates an [`Error::InvalidOption`] for `field`.
    pub fn invalid(field: impl Into<Cow<'static, str>>, value: impl Display, allowed: impl Into<String>) -> Self {
        Self::InvalidOption { field: field.into(), value: value.to_string(), allowed: allowed.into() }
    }

    /// Creates an [`Error::Gpu`] whose fix is the CPU.
    pub fn gpu(reason: impl Into<String>) -> Self {
        Self::Gpu { reason: reason.into(), fix: "use the CPU: `CpuFragments`".into() }
    }

    /// Creates an [`Error::Unreadable`] for `path`.
    pub fn unreadable(path: impl AsRef<Path>, reason: impl Into<String>, fix: impl Into<String>) -> Self {
        Self::Unreadable { path: path.as_ref().to_path_buf(), reason: reason.into(), fix: fix.into() }
    }
}

/// The operating system's message followed by a fix. Errors created by this crate already contain
/// one.
fn told(source: &std::io::Error) -> String {
    let fix = match source.kind() {
        _ if source.get_ref().is_some() => return source.to_string(),
        ErrorKind::NotFound => "check the name",
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "change its permissions or choose another location"
        }
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            "make room or choose another location"
        }
        ErrorKind::IsADirectory => "name a file inside it",
        _ => "check that the file and its disk are intact",
    };
    format!("{source}; {fix}")
}

/// Checks that `value` is within `range`; NaN never is.
///
/// # Errors
/// [`Error::InvalidOption`] naming `field`.
pub(crate) fn check_range<T: PartialOrd + Display>(
    field: impl Into<Cow<'static, str>>,
    value: T,
    range: RangeInclusive<T>,
) -> Result<()> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(Error::invalid(field, value, format!("from {} to {}", range.start(), range.end())))
}

/// A `Result` with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;
