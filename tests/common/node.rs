//! Programs of `web/tests` that run in Node, most of them with a headless Chromium.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

/// Folder of the page, its reader and their tests.
pub fn web() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("web")
}

/// Why a program of `web/tests` cannot run here, if it cannot.
fn missing(program: &str) -> Option<String> {
    let runs = |program: &str| Command::new(program).arg("--version").output().is_ok_and(|run| run.status.success());
    let chromium = std::env::var("CHROMIUM").unwrap_or("/usr/bin/chromium".into());
    let needs_browser = program != "validate.mjs";
    let needed = ["node", &chromium].into_iter().take(1 + usize::from(needs_browser));
    let absent = needed.into_iter().find(|program| !runs(program));
    let packages = || (!web().join("node_modules").is_dir()).then(|| "run `npm ci` in web".to_owned());
    absent.map(|program| format!("{program} is missing")).or_else(packages)
}

/// Runs a program with arguments; it must succeed. Returns what it prints, or `None`, with a note
/// printed, if Node, Chromium where it is needed, or packages are missing; then panics if
/// `FOLIAGE_REQUIRE_WEB` is set.
pub fn run(program: &str, arguments: &[&Path]) -> Option<String> {
    if let Some(missing) = missing(program) {
        assert!(std::env::var_os("FOLIAGE_REQUIRE_WEB").is_none(), "{missing}");
        println!("skipped: {missing}");
        return None;
    }
    let run = Command::new("node").arg(web().join("tests").join(program)).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (said, complained) = (text(&run.stdout), text(&run.stderr));
    assert!(run.status.success(), "{program}: {said}{complained}");
    print!("{said}");
    Some(said)
}
