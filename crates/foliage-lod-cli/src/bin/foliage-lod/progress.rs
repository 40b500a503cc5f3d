//! Progress bars on stderr; none if stderr is not a terminal.

use crate::interrupt;
use foliage_lod::simplify::Observer;
use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;

/// Shows a spinner while `work` runs.
pub fn spinning<T>(what: &str, work: impl FnOnce() -> T) -> T {
    let spinner = ProgressBar::new_spinner().with_message(what.to_owned());
    spinner.enable_steady_tick(Duration::from_millis(100));
    let result = work();
    spinner.finish_and_clear();
    result
}

/// One bar per phase of a simplification. Stops the simplification once the user requests it.
pub struct Bars {
    bar: ProgressBar,
}

impl Bars {
    /// Shows no bar until the first phase.
    pub fn new() -> Self {
        Self { bar: ProgressBar::hidden() }
    }
}

impl Observer for Bars {
    fn phase(&mut self, name: &str, total: u64) {
        self.bar.finish_and_clear();
        let style = ProgressStyle::with_template("{msg:<9} {bar:40} {human_pos}/{human_len}  {eta} left");
        self.bar = ProgressBar::new(total).with_message(name.to_owned());
        self.bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    }

    fn advance(&mut self, done: u64) -> bool {
        self.bar.set_position(done);
        !interrupt::is_requested()
    }
}

impl Drop for Bars {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
