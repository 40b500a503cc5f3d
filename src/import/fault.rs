//! Errors inside the importer, before the path of the file is added.

use super::source::listed;
use crate::Error;
use std::path::{Path, PathBuf};

/// An error that does not yet contain the path of the file it occurred in.
#[derive(Debug)]
pub(super) enum Fault {
    /// The content is damaged or violates the rules of the format.
    Broken { reason: String, fix: &'static str },
    /// The content needs a feature that is not supported.
    Unsupported { feature: String, fix: String },
    /// A count above a documented limit.
    TooLarge { what: String, value: u64, limit: u64, fix: &'static str },
    /// The user named foliage that the file does not contain.
    UnknownName { name: String, closest: Vec<String>, count: usize },
    /// The user named a plant that the file does not contain.
    UnknownPlant { name: String, known: Vec<String> },
    /// This file, or one that it refers to, could not be read.
    Io { path: PathBuf, source: std::io::Error },
}

/// Suggested fix for errors that only the exporter can correct.
const EXPORT_AGAIN: &str = "export it again and check it with a glTF validator";

impl Fault {
    /// An error for damaged content, to be exported again.
    pub(super) fn broken(reason: impl Into<String>) -> Self {
        Self::Broken { reason: reason.into(), fix: EXPORT_AGAIN }
    }

    /// Converts to the error for the file at `path`.
    pub(super) fn at(self, path: &Path) -> Error {
        let path = path.to_path_buf();
        match self {
            Self::Broken { reason, fix } => Error::Unreadable { path, reason, fix: fix.to_owned() },
            Self::Unsupported { feature, fix } => Error::Unsupported { path, feature, fix },
            Self::TooLarge { what, value, limit, fix } => {
                Error::TooLarge { what: format!("{}: {what}", path.display()), value, limit, fix: fix.to_owned() }
            }
            Self::UnknownName { name, closest, count } => {
                let all = if closest.len() < count { format!(", the closest of {count}") } else { String::new() };
                let closest = closest.join(", ");
                let allowed =
                    format!("a material, node or mesh of {}{all}: {}", path.display(), closest.escape_debug());
                Error::invalid("leaves", format!("{name:?}"), allowed)
            }
            Self::UnknownPlant { name, known } => {
                let known = listed(&known.iter().map(String::as_str).collect::<Vec<_>>());
                let allowed = format!("'*' or a node or object of {}, such as {known}", path.display());
                Error::invalid("plant", format!("{name:?}"), allowed)
            }
            Self::Io { path, source } => Error::Io { path, source },
        }
    }
}

/// Fails if `value` exceeds `limit`.
pub(super) fn limit(what: &str, value: u64, limit: u64) -> Result<(), Fault> {
    let fix = "split the file or simplify it first";
    if value <= limit { Ok(()) } else { Err(Fault::TooLarge { what: what.to_owned(), value, limit, fix }) }
}
