//! What goes to stdout: a line for each step, or one JSON object at the end.

use crate::failure::Failure;
use foliage_lod::Error;
use std::{
    fmt::Display,
    io::{ErrorKind, Write},
    time::Instant,
};

/// Prints one line to stdout.
///
/// # Errors
/// [`Failure::ReaderGone`] when nobody reads stdout any more, [`Failure::Library`] when it cannot be written to.
pub fn line(text: impl Display) -> Result<(), Failure> {
    writeln!(std::io::stdout(), "{text}").map_err(|error| match error.kind() {
        ErrorKind::BrokenPipe => Failure::ReaderGone,
        _ => Error::io("stdout", error).into(),
    })
}

/// Prints one line to stderr. Where that fails there is nowhere left to say so.
pub fn complaint(text: impl Display) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Tells the steps of a command as they end; silent where the command prints JSON.
pub struct Steps {
    is_silent: bool,
    started: Instant,
    step_started: Instant,
}

impl Steps {
    /// The clock starts here.
    pub fn new(is_silent: bool) -> Self {
        let now = Instant::now();
        Self { is_silent, started: now, step_started: now }
    }

    /// A step ends: says what it gave and how long it took. Returns its seconds.
    ///
    /// # Errors
    /// [`Failure::Library`] when stdout cannot be written to, and when the user asked to stop. Whoever only stopped reading
    /// still wants the files.
    pub fn done(&mut self, step: &str, result: impl Display) -> Result<f64, Failure> {
        let seconds = self.step_started.elapsed().as_secs_f64();
        if !self.is_silent {
            match line(format_args!("{step:<9} {result}  [{seconds:.2} s]")) {
                Err(Failure::ReaderGone) => self.is_silent = true,
                told => told?,
            }
        }
        crate::interrupt::check()?;
        self.step_started = Instant::now();
        Ok(seconds)
    }

    /// Seconds since the first step began.
    pub fn total_seconds(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }
}

/// 1234567 as `1,234,567`.
pub fn grouped(number: impl Into<u64>) -> String {
    let digits = number.into().to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Bytes as megabytes with one decimal.
pub fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 / 1e6)
}
