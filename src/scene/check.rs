//! Checks for scene files, and the position of the offending key.

use crate::{Error, Result};
use toml::de::{DeTable, DeValue};

/// Returns an [`Error::InvalidOption`] for the dotted `key` if `is_wrong`.
pub(super) fn wrong_if(is_wrong: bool, key: &str, value: &str, allowed: &str) -> Result<()> {
    if is_wrong { Err(Error::invalid(key.to_owned(), value, allowed)) } else { Ok(()) }
}

/// Byte offset of the value of a dotted key, or of the deepest table on the way to it.
pub(super) fn offset_of(text: &str, key: &str) -> Option<usize> {
    let document = DeValue::Table(DeTable::parse(text).ok()?.into_inner());
    let (mut value, mut offset) = (&document, None);
    for part in key.split('.') {
        let next = match value {
            DeValue::Table(table) => table.iter().find(|(name, _)| name.get_ref() == part).map(|(_, next)| next),
            DeValue::Array(array) => part.parse().ok().and_then(|i: usize| array.get(i)),
            _ => None,
        };
        let Some(next) = next else { break };
        offset = Some(next.span().start);
        value = next.get_ref();
    }
    offset
}
