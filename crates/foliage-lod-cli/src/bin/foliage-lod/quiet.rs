//! Keeps Mesa's device selection layer from printing `error: XDG_RUNTIME_DIR is invalid ...` when
//! it looks for a Wayland session that does not exist.
//!
//! The layer reads its switch from the environment, which a process cannot change safely while it
//! runs: the command replaces itself once, with the switch set. If that fails, it continues
//! unchanged.

/// Environment variable that turns the layer off.
#[cfg(target_os = "linux")]
const SWITCH: &str = "NODEVICE_SELECT";

/// Starts the command again with the layer off, if there is no Wayland session and the layer is on.
#[cfg(target_os = "linux")]
pub fn without_wayland() {
    use std::{env, os::unix::process::CommandExt, process::Command};
    if env::var_os("XDG_RUNTIME_DIR").is_some() || env::var_os(SWITCH).is_some() {
        return;
    }
    let Ok(this) = env::current_exe() else { return };
    let mut arguments = env::args_os();
    let mut command = Command::new(this);
    if let Some(name) = arguments.next() {
        command.arg0(name);
    }
    // `exec` returns only if it fails.
    let _ = command.args(arguments).env(SWITCH, "1").exec();
}

/// Does nothing: other systems have no such layer.
#[cfg(not(target_os = "linux"))]
pub fn without_wayland() {}
