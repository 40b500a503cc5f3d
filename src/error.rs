//! The one error type of the crate: every variant carries the value that was seen and says the fix.

use std::{
    borrow::Cow,
    fmt::Display,
    io::ErrorKind,
    ops::RangeInclusive,
    path::{Path, PathBuf},
};

/// Everything that can go wrong, each with the value seen and what to do about it.
///
/// The text is one line without a trailing full stop, ready to be printed after `error: `. Fixes name options by their
/// field, between backticks: a program can put its own spelling there.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be opened, read or written.
    #[error("{}: {}", path.display(), told(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file's content is damaged or breaks its format's rules.
    #[error("{}: {reason}; {fix}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the value seen.
        reason: String,
        /// What the user can do.
        fix: String,
    },
    /// A file is sound but needs something that this crate does not read.
    #[error("{}: {feature} is not supported; {fix}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The extension or format by its name.
        feature: String,
        /// What the user can do.
        fix: String,
    },
    /// Nothing in the plant can be taken for separable leaves.
    #[error("{name}: no separable leaves: {reason}; {fix}")]
    NoLeaves {
        /// The plant or file.
        name: String,
        /// Why nothing qualified.
        reason: String,
        /// What the user can do.
        fix: String,
    },
    /// A plant that breaks one of the numbered invariants of [`Plant`](crate::Plant).
    #[error("plant breaks invariant {invariant}: {what}")]
    InvalidPlant {
        /// The number in the list of the type's documentation.
        invariant: u8,
        /// What was found, with the index and the value seen.
        what: String,
    },
    /// A model that breaks one of the numbered invariants of its type.
    #[error("model breaks invariant {invariant}: {what}")]
    InvalidModel {
        /// The number in the list of the type's documentation.
        invariant: u8,
        /// What was found, with the index and the value seen.
        what: String,
    },
    /// An option or parameter outside its range.
    #[error("{field} is {value}; it must be {allowed}")]
    InvalidOption {
        /// Field of the options struct, or dotted key of the file, that holds the value: `max_scale`, `effects.wind.strength`.
        field: Cow<'static, str>,
        /// The value seen.
        value: String,
        /// The values that are allowed.
        allowed: String,
    },
    /// An input or a working set beyond a documented limit; nothing was allocated for it.
    #[error("{what} is {value}, above the limit of {limit}; {fix}")]
    TooLarge {
        /// What is too large.
        what: String,
        /// The value seen.
        value: u64,
        /// The limit.
        limit: u64,
        /// What the user can do.
        fix: String,
    },
    /// The GPU is missing, was refused or failed.
    #[error("GPU: {reason}; {fix}")]
    Gpu {
        /// What happened.
        reason: String,
        /// What the user can do.
        fix: String,
    },
    /// The caller asked to stop.
    #[error("interrupted; every file is whole or as it was")]
    Interrupted,
}

impl Error {
    /// An [`Error::Io`] for `path`.
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Self::Io { path: path.as_ref().to_path_buf(), source }
    }

    /// An [`Error::InvalidOption`] for `field`.
    pub fn invalid(field: impl Into<Cow<'static, str>>, value: impl Display, allowed: impl Into<String>) -> Self {
        Self::InvalidOption { field: field.into(), value: value.to_string(), allowed: allowed.into() }
    }

    /// An [`Error::Unreadable`] for `path`.
    pub fn unreadable(path: impl AsRef<Path>, reason: impl Into<String>, fix: impl Into<String>) -> Self {
        Self::Unreadable { path: path.as_ref().to_path_buf(), reason: reason.into(), fix: fix.into() }
    }
}

/// What the system said with the fix; an error that was made in this crate names its own.
fn told(source: &std::io::Error) -> String {
    let fix = match source.kind() {
        _ if source.get_ref().is_some() => return source.to_string(),
        ErrorKind::NotFound => "check the name",
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => "change its permissions or name another place",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            "make room or name another place"
        }
        ErrorKind::IsADirectory => "name a file in it",
        _ => "see that the file and its disk are sound",
    };
    format!("{source}; {fix}")
}

/// Checks that `value` lies within `range`; NaN does not.
///
/// # Errors
/// [`Error::InvalidOption`] that names `field`.
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

/// Result with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;
