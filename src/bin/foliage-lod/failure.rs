//! How the command ends when it does not succeed: one line and an exit code.

use crate::output;
use foliage_lod::{Error, render::guard::is_guarding};
use std::process::ExitCode;

/// Exit code of a command line that makes no sense.
const USAGE: u8 = 2;
/// Exit code after an interruption, as shells have it for SIGINT.
const INTERRUPTED: u8 = 130;

/// Why the command ends early.
pub enum Failure {
    /// The library's error.
    Library(Error),
    /// What clap says about the command line; help and version are not failures but end here too.
    Usage(clap::Error),
    /// Whoever read stdout does not want more.
    ReaderGone,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Library(error)
    }
}

impl Failure {
    /// Prints what there is to say and gives the exit code.
    pub fn report(self) -> ExitCode {
        match self {
            Self::Usage(error) if !error.use_stderr() => {
                let _ = error.print();
                ExitCode::SUCCESS
            }
            Self::Usage(error) => {
                output::complaint(format_args!("{}; see `foliage-lod --help`", one_line(&error)));
                ExitCode::from(USAGE)
            }
            Self::Library(error) => {
                output::complaint(format_args!("error: {}", spelled(&error)));
                ExitCode::from(match error {
                    Error::InvalidOption { .. } => USAGE,
                    Error::Interrupted => INTERRUPTED,
                    _ => 1,
                })
            }
            Self::ReaderGone => ExitCode::SUCCESS,
        }
    }
}

/// Options of the library whose flag is spelled in another way than their field.
const FLAGS: [(&str, &str); 3] =
    [("max_memory_mb", "--max-memory"), ("species", "SPECIES"), ("CpuFragments", "--raster cpu")];
/// Options of the library whose flag is their field with dashes.
const FIELDS: [&str; 9] = ["resolution", "views", "max_scale", "threads", "leaves", "target", "size", "sizes", "group"];

/// The flag of the library's field `name`; `None` where the command has none.
fn flag(name: &str) -> Option<String> {
    let other = FLAGS.iter().find(|(field, _)| *field == name).map(|(_, flag)| (*flag).to_owned());
    other.or_else(|| FIELDS.contains(&name).then(|| format!("--{}", name.replace('_', "-"))))
}

/// The library's message with fields as flags: the field of an invalid option, and all that stand between backticks.
pub fn spelled(error: &Error) -> String {
    let text = error.to_string();
    let mut spelled = String::new();
    let mut rest = &text[..];
    if let Error::InvalidOption { field, .. } = error {
        spelled = flag(field).unwrap_or_else(|| field.to_string());
        rest = &text[field.len()..];
    }
    for (i, part) in rest.split('`').enumerate() {
        spelled += &match i % 2 {
            0 => part.to_owned(),
            _ => flag(part).unwrap_or_else(|| format!("`{part}`")),
        };
    }
    spelled
}

/// Panics that the library turns into errors are told as those alone, unless backtraces are asked for.
pub fn tell_panics_of_drivers_once() {
    if std::env::var_os("RUST_BACKTRACE").is_some_and(|wanted| wanted != "0") {
        return;
    }
    let tell = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !is_guarding() {
            tell(panic);
        }
    }));
}

/// The first paragraph of clap's message, which names the argument and the values it may have.
fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines = text.lines().take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more"));
    lines.map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}
