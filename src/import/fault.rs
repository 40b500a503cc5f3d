//! What goes wrong inside the importer, before the file's name is known to the message.

use crate::Error;
use std::path::{Path, PathBuf};

/// An error that still lacks the path of the file it happened in.
#[derive(Debug)]
pub(super) enum Fault {
    /// The content is damaged or breaks the format's rules.
    Broken { reason: String, fix: &'static str },
    /// The content needs something that is not read here.
    Unsupported { feature: String, fix: String },
    /// A count beyond a documented limit.
    TooLarge { what: String, value: u64, limit: u64, fix: &'static str },
    /// The user named foliage that the file does not have.
    UnknownName { name: String, known: Vec<String> },
    /// Another file, or this one, could not be read.
    Io { path: PathBuf, source: std::io::Error },
}

/// The fix for content that only its exporter can put right.
const EXPORT_AGAIN: &str = "export it again and check it with a glTF validator";

impl Fault {
    /// Damaged content, to be exported again.
    pub(super) fn broken(reason: impl Into<String>) -> Self {
        Self::Broken { reason: reason.into(), fix: EXPORT_AGAIN }
    }

    /// The error for the file at `path`.
    pub(super) fn at(self, path: &Path) -> Error {
        let path = path.to_path_buf();
        match self {
            Self::Broken { reason, fix } => Error::Unreadable { path, reason, fix: fix.to_owned() },
            Self::Unsupported { feature, fix } => Error::Unsupported { path, feature, fix },
            Self::TooLarge { what, value, limit, fix } => {
                Error::TooLarge { what: format!("{}: {what}", path.display()), value, limit, fix: fix.to_owned() }
            }
            Self::UnknownName { name, known } => {
                let known = known.join(", ");
                let allowed = format!("a material, node or mesh of {}: {}", path.display(), known.escape_debug());
                Error::invalid("leaves", format!("{name:?}"), allowed)
            }
            Self::Io { path, source } => Error::Io { path, source },
        }
    }
}

/// `Ok` when `value` is at most `limit`.
pub(super) fn limit(what: &str, value: u64, limit: u64) -> Result<(), Fault> {
    let fix = "split the file or simplify it first";
    if value <= limit { Ok(()) } else { Err(Fault::TooLarge { what: what.to_owned(), value, limit, fix }) }
}
