//! Runs the command as a child process.

use std::{
    fs,
    path::Path,
    process::{Child, Command, Output, Stdio},
    time::{Duration, Instant},
};
use tempfile::TempDir;

pub const COMMAND: &str = env!("CARGO_BIN_EXE_foliage-lod");
/// Longest time that a run may take.
const LIMIT: Duration = Duration::from_secs(120);

/// Builds the command with `arguments`, to be run in `folder` with its output captured.
pub fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(COMMAND);
    command.current_dir(folder).args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    // Some drivers write to stderr if this is not set.
    command.env("XDG_RUNTIME_DIR", folder).env_remove("RUST_BACKTRACE");
    command
}

/// Waits for `child` and returns its output. Panics if it runs longer than [`LIMIT`].
pub fn ended(mut child: Child, what: &[&str]) -> Output {
    let started = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if started.elapsed() > LIMIT {
            child.kill().unwrap();
            panic!("{what:?} does not finish");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

/// Runs the command in `folder` and returns its output.
pub fn run(folder: &TempDir, arguments: &[&str]) -> Output {
    ended(command(folder.path(), arguments).spawn().unwrap(), arguments)
}

/// Returns the single stderr line of a run that exited with `code`: the problem and, after a
/// semicolon, the fix.
pub fn error_line(output: &Output, code: i32) -> String {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(text.starts_with("error: ") && text.ends_with('\n') && text.lines().count() == 1, "{text:?}");
    assert!(text.contains("; "), "no fix in {text:?}");
    text
}

/// Panics with the stderr of the command unless it succeeded.
pub fn succeeds(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Names of the entries in `folder`, sorted.
#[allow(dead_code)]
pub fn names(folder: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(folder.path()).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
