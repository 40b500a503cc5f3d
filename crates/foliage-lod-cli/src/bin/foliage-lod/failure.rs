//! Failures of the command: one line on stderr and an exit code.

use foliage_lod::{Error, gpu::is_guarding};
use std::{fmt::Display, io::Write, process::ExitCode};

/// Exit code for an invalid command line.
const USAGE: u8 = 2;
/// Exit code after an interruption, as shells report SIGINT.
const INTERRUPTED: u8 = 130;

/// Reason why the command ends early.
pub enum Failure {
    /// An error of the library.
    Library(Error),
    /// clap's error for the command line; also help and version, which are not failures.
    Usage(clap::Error),
    /// Stdout was closed by its reader.
    ReaderGone,
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Library(error)
    }
}

impl Failure {
    /// Prints the message, if there is one, and returns the exit code.
    pub fn report(self) -> ExitCode {
        match self {
            Self::Usage(error) if !error.use_stderr() => {
                let _ = error.print();
                ExitCode::SUCCESS
            }
            Self::Usage(error) => {
                complain(format_args!("{}; see `foliage-lod --help`", one_line(&error)));
                ExitCode::from(USAGE)
            }
            Self::Library(error) => {
                complain(format_args!("error: {}", spelled(&error)));
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

/// Library fields whose flag has a different name, each with that flag.
const FLAGS: [(&str, &str); 10] = [
    ("bake.across", "--far"),
    ("bake.frame_px", "--far"),
    ("far.at_px", "--far"),
    ("wood_error_px", "--wood-error"),
    ("max_memory_mb", "--max-memory"),
    ("species", "SPECIES"),
    ("CpuFragments", "--raster cpu"),
    ("GpuDevice", "--raster gpu"),
    ("Up::Z", "--up z"),
    ("VertexColors::Ignore", "--vertex-colors ignore"),
];
/// Library fields whose flag is the same name, spelled with dashes.
const FIELDS: [&str; 14] = [
    "alpha_cutoff",
    "group",
    "leaves",
    "levels",
    "lod",
    "intrinsic",
    "max_scale",
    "output",
    "plant",
    "resolution",
    "size",
    "target",
    "threads",
    "views",
];

/// The flag for the library's field `name`; `None` if the command has none.
fn flag(name: &str) -> Option<String> {
    let other = FLAGS.iter().find(|(field, _)| *field == name).map(|(_, flag)| (*flag).to_owned());
    other.or_else(|| FIELDS.contains(&name).then(|| format!("--{}", name.replace('_', "-"))))
}

/// The library's message with fields replaced by flags: the field of an invalid option, and every
/// field in backticks.
pub fn spelled(error: &Error) -> String {
    let text = error.to_string();
    let mut spelled = String::new();
    let mut rest = &text[..];
    if let Error::InvalidOption { field, .. } = error {
        spelled = flag(field).unwrap_or_else(|| field.to_string());
        rest = &text[field.len()..];
    }
    spelled + &with_flags(rest)
}

/// A text of the library with every field in backticks replaced by its flag.
pub fn with_flags(text: &str) -> String {
    let part = |(i, part): (usize, &str)| match i % 2 {
        0 => part.to_owned(),
        _ => flag(part).unwrap_or_else(|| format!("`{part}`")),
    };
    text.split('`').enumerate().map(part).collect()
}

/// Silences the messages of panics that the library turns into errors, unless backtraces are
/// requested.
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

/// Prints one line to stderr. If that fails too, the line is lost.
pub fn complain(text: impl Display) {
    let _ = writeln!(std::io::stderr(), "{}", visible(&text.to_string()));
}

/// A line in which control characters, which names in files may have, are spelled out.
pub fn visible(text: &str) -> String {
    let spelled = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
    text.chars().map(spelled).collect()
}

/// The first paragraph of clap's message, which names the argument and its possible values.
fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines = text.lines().take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more"));
    lines.map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_of_the_library_are_spelled_as_flags_and_other_words_stay() {
        let range = Error::invalid("max_scale", 0, "from 1 to 64");
        assert_eq!(spelled(&range), "--max-scale is 0; it must be from 1 to 64");
        let scene = Error::invalid("effects.wind.strength", 7, "from 0 to 0.1");
        assert_eq!(spelled(&scene), "effects.wind.strength is 7; it must be from 0 to 0.1");
        assert_eq!(with_flags("use `VertexColors::Ignore` or `Up::Z`"), "use --vertex-colors ignore or --up z");
        assert_eq!(with_flags("name it in `plant`"), "name it in --plant");
        assert_eq!(with_flags("set `alpha_cutoff` to 0.5"), "set --alpha-cutoff to 0.5");
        assert_eq!(spelled(&Error::gpu("`x` failed")), "GPU: `x` failed; use the CPU: --raster cpu");
    }
}
