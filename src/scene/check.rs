//! Rules of scene files: what a broken one is told, and where in the file it stands.

use toml::de::{DeTable, DeValue};

/// A value that breaks a rule.
pub(super) struct Wrong {
    pub(super) key: String,
    pub(super) value: String,
    pub(super) allowed: String,
}

pub(super) fn wrong_if(is_wrong: bool, key: &str, value: &str, allowed: &str) -> Result<(), Wrong> {
    let wrong = || Wrong { key: key.into(), value: value.into(), allowed: allowed.into() };
    if is_wrong { Err(wrong()) } else { Ok(()) }
}

pub(super) fn in_range(key: &str, value: f64, least: f64, most: f64) -> Result<(), Wrong> {
    let is_within = (least..=most).contains(&value);
    wrong_if(!is_within, key, &value.to_string(), &format!("from {least} to {most}"))
}

/// Where the value of a dotted key starts, or the deepest table on the way to it.
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
