//! What goes to stdout: a line for each step, or one JSON object at the end.

use crate::failure::Failure;
use std::{fmt::Display, io::Write, time::Instant};

/// Prints one line to stdout.
///
/// # Errors
/// [`Failure::ReaderGone`] when stdout is closed.
pub fn line(text: impl Display) -> Result<(), Failure> {
    writeln!(std::io::stdout(), "{text}").map_err(|_| Failure::ReaderGone)
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
    /// [`Failure::ReaderGone`] when stdout is closed, and [`Failure::Library`] when the user asked to stop.
    pub fn done(&mut self, step: &str, result: impl Display) -> Result<f64, Failure> {
        let seconds = self.step_started.elapsed().as_secs_f64();
        if !self.is_silent {
            line(format_args!("{step:<9} {result}  [{seconds:.2} s]"))?;
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
