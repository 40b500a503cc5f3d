//! Output on stdout: a line per step, or one JSON object at the end.

use crate::failure::{Failure, visible, with_flags};
use foliage_lod::{
    Error,
    import::Warning,
    model::{ModelFile, Part, Precision, Recipe},
};
use serde_json::{Value, json};
use std::{
    fmt::Display,
    io::{ErrorKind, Write},
    time::Instant,
};

/// Prints one line to stdout.
///
/// # Errors
/// [`Failure::ReaderGone`] if stdout was closed by its reader, [`Failure::Library`] if it cannot be
/// written to.
pub fn line(text: impl Display) -> Result<(), Failure> {
    writeln!(std::io::stdout(), "{text}").map_err(|error| match error.kind() {
        ErrorKind::BrokenPipe => Failure::ReaderGone,
        _ => Error::io("stdout", error).into(),
    })
}

/// Prints the steps of a command as they end; silent if the command prints JSON.
pub struct Steps {
    is_silent: bool,
    started: Instant,
    step_started: Instant,
}

impl Steps {
    /// Starts the clock.
    pub fn new(is_silent: bool) -> Self {
        let now = Instant::now();
        Self { is_silent, started: now, step_started: now }
    }

    /// Ends a step: prints its result and duration, and returns the duration in seconds.
    ///
    /// # Errors
    /// [`Failure::Library`] if stdout cannot be written to or the user interrupted the command. A
    /// closed stdout is not an error: the files are still wanted.
    pub fn done(&mut self, step: &str, result: impl Display) -> Result<f64, Failure> {
        let seconds = self.step_started.elapsed().as_secs_f64();
        if !self.is_silent {
            match line(visible(&format!("{step:<9} {result}  [{seconds:.2} s]"))) {
                Err(Failure::ReaderGone) => self.is_silent = true,
                told => told?,
            }
        }
        crate::interrupt::check()?;
        self.step_started = Instant::now();
        Ok(seconds)
    }

    /// Seconds since the clock was started.
    pub fn total_seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }
}

/// A model's recipe as a JSON object.
pub fn recipe_json(recipe: &Recipe) -> Value {
    json!({
        "preset": recipe.preset,
        "criterion": recipe.criterion,
        "compensate": recipe.compensate,
        "resolution": recipe.resolution,
        "views": recipe.views,
        "background": recipe.background,
        "intrinsic": recipe.intrinsic,
        "raster": recipe.raster,
        "adapter": recipe.adapter,
    })
}

/// Largest errors of a model's numbers as a JSON object.
pub fn precision_json(precision: &Precision) -> Value {
    let Precision { position, normal_rad, uv, color } = precision;
    json!({ "position": position, "normal_rad": normal_rad, "uv": uv, "color": color })
}

/// Lines of the warnings about sections of a model's file that were skipped.
pub fn skipped_lines(file: &ModelFile) -> impl Iterator<Item = String> {
    let line = |Part { name, bytes }: &Part| {
        format!("warning: section {name} ({bytes} bytes) is not known and was skipped; a newer version reads it")
    };
    file.skipped.iter().map(line)
}

/// Warnings of an import as a JSON array.
pub fn warnings_json(warnings: &[Warning]) -> Value {
    let json = |Warning { kind, message, fix }: &Warning| json!({ "kind": kind.to_string(), "message": with_flags(message), "fix": with_flags(fix) });
    warnings.iter().map(json).collect()
}

/// The line of one warning.
pub fn warning_line(warning: &Warning) -> String {
    format!("warning: {}", with_flags(&warning.to_string()))
}

/// Merges two JSON objects; where both have a key, the value of `other` is kept.
pub fn merged(mut one: Value, other: Value) -> Value {
    if let (Value::Object(keys), Value::Object(more)) = (&mut one, other) {
        keys.extend(more);
    }
    one
}
