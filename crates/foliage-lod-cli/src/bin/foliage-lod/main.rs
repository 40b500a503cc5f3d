//! The `foliage-lod` command: trees in, continuous models and pictures out.
//!
//! Results go to stdout, progress and errors to stderr. The exit code is 0 for success, 1 for
//! failure, 2 for an invalid command line and 130 when interrupted.

mod args;
mod baking;
#[cfg(feature = "viewer")]
mod budget_panel;
mod budget_study;
mod curves;
mod drawing;
mod export;
mod export_args;
mod export_levels;
mod failure;
mod grow;
mod import_args;
mod inspect;
mod interrupt;
mod models;
mod names;
#[cfg(feature = "viewer")]
mod orbit;
mod output;
mod pacing;
mod patches;
mod pictures;
mod planting;
mod progress;
mod quickstart;
mod quiet;
mod raster;
mod render;
mod report;
mod scene;
mod scene_study;
mod simplify;
mod staging;
mod study;
#[cfg(feature = "viewer")]
mod view;
#[cfg(feature = "viewer")]
mod view_scene;

use args::Command;
use failure::Failure;
use std::process::ExitCode;

fn main() -> ExitCode {
    quiet::without_wayland();
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}

fn run() -> Result<(), Failure> {
    let args = args::parse()?;
    interrupt::install();
    failure::tell_panics_of_drivers_once();
    match args.command {
        None => quickstart::run(),
        Some(Command::Simplify(args)) => simplify::run(&args),
        Some(Command::Export(args)) => export::run(&args),
        Some(Command::Bake(args)) => baking::run(&args),
        Some(Command::Inspect(args)) => inspect::run(&args),
        Some(Command::Grow(args)) => grow::run(&args),
        Some(Command::Render(args)) => render::run(&args),
        Some(Command::Report(args)) if args.paper => report::run(&args),
        Some(Command::Report(args)) => study::run(&args),
        #[cfg(feature = "viewer")]
        Some(Command::View(args)) => view::run(&args),
    }
}
