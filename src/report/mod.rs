//! Measurements of the whole: what is drawn, how long it takes, as tables and plots.

pub mod paper;
mod plot;
