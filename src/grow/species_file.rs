//! Reads species, embedded or from a `.toml` file.

use super::species::Species;
use crate::{Error, Result, file};
use std::path::Path;

/// Names and TOML sources of the embedded species.
const SOURCES: [(&str, &str); 6] = [
    ("english-oak", include_str!("../../data/species/english-oak.toml")),
    ("carya-illinoinensis", include_str!("../../data/species/carya-illinoinensis.toml")),
    ("betula-populifolia", include_str!("../../data/species/betula-populifolia.toml")),
    ("hazel", include_str!("../../data/species/hazel.toml")),
    ("male-fern", include_str!("../../data/species/male-fern.toml")),
    ("meadow-grass", include_str!("../../data/species/meadow-grass.toml")),
];

impl Species {
    /// Names that [`Species::embedded`] accepts.
    pub const EMBEDDED: [&'static str; 6] =
        [SOURCES[0].0, SOURCES[1].0, SOURCES[2].0, SOURCES[3].0, SOURCES[4].0, SOURCES[5].0];

    /// Returns one of the species embedded in the crate.
    ///
    /// # Errors
    /// [`InvalidOption`](Error::InvalidOption) for a name that is not in [`Species::EMBEDDED`].
    pub fn embedded(name: &str) -> Result<Self> {
        let source = SOURCES.iter().find(|(known, _)| *known == name);
        let (name, text) = source.ok_or_else(|| {
            let allowed = format!("{}, or a species .toml file", Self::EMBEDDED.join(", "));
            Error::invalid("species", format!("{name:?}"), allowed)
        })?;
        Self::from_toml(text, Path::new(&format!("{name}.toml")))
    }

    /// Returns the embedded species of that name, or reads one from a path that ends in `.toml`.
    ///
    /// # Errors
    /// The errors of [`embedded`](Self::embedded) and [`from_toml`](Self::from_toml), and
    /// [`Error::Io`].
    pub fn named(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        if path.extension().is_none_or(|extension| extension != "toml") {
            return Self::embedded(&path.to_string_lossy());
        }
        let text = std::io::read_to_string(file::open(path)?).map_err(|error| Error::io(path, error))?;
        Self::from_toml(&text, path)
    }

    /// Parses a species; `origin` is the path used in messages.
    ///
    /// # Errors
    /// [`Unreadable`](Error::Unreadable) for text that is not TOML, for missing or unknown keys,
    /// and for values out of range; the message names key, value and allowed range.
    pub fn from_toml(text: &str, origin: &Path) -> Result<Self> {
        let species: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
            let reason = format!("line {line}: {}", error.message().replace(char::is_control, " "));
            Error::unreadable(origin, reason, "see data/species/english-oak.toml for every key")
        })?;
        species.check(origin)?;
        Ok(species)
    }
}
