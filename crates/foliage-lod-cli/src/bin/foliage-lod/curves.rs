//! Error curves of models, for commands that make or show them.

use crate::progress::Bars;
use foliage_lod::{
    FoliageModel, Result,
    model::{CurveCorner, ErrorCurve},
    simplify::{CurveOptions, Observer, curve_steps, error_curve},
};
use serde_json::{Value, json};

/// Measures the error curve of a model, with a progress bar.
///
/// # Errors
/// As [`error_curve`].
pub fn measure(model: &FoliageModel) -> Result<ErrorCurve> {
    let mut bars = Bars::new();
    let options = CurveOptions::for_model(model);
    bars.phase("curve", curve_steps(model.leaves.len() as u32, &options));
    error_curve(model, &options, &mut |done| bars.advance(done))
}

/// The error curve of a model, in words.
pub fn summary(model: &FoliageModel) -> String {
    let Some(ErrorCurve { size_px, size_power, corners }) = &model.curve else { return "no error curve".into() };
    let count = corners.len();
    format!("error curve of {count} corners at {size_px} pixels, growing with their power {size_power:.2}")
}

/// An error curve's numbers.
pub fn to_json(curve: &ErrorCurve) -> Value {
    let ErrorCurve { size_px, size_power, corners } = curve;
    let corner = |corner: &CurveCorner| json!([corner.leaves, corner.error_px]);
    json!({ "size_px": size_px, "size_power": size_power, "corners": corners.iter().map(corner).collect::<Vec<_>>() })
}
