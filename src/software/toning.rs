//! Tone of a plant's leaves on the CPU. Twin of `shaders/tone.wgsl` and `shaders/contrast.wgsl`.

/// Moves the shaded colours of a plant's leaves towards their mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Toning {
    /// Mean shaded colour of the plant's leaves, linear.
    pub mean: [f32; 3],
    /// Fraction of a colour's distance from the mean that every leaf keeps, 0 to 1.
    pub kept: f32,
    /// Tone of enlarged leaves, which keep less; see [`Growth::tone`](crate::model::Growth::tone).
    pub tone: f32,
}

impl Toning {
    /// Keeps every colour.
    pub const NONE: Self = Self { mean: [0.0; 3], kept: 1.0, tone: 0.0 };

    /// Fraction of its distance from the mean that the colour of a leaf keeps at a linear scale.
    pub fn kept_at(&self, scale: f32) -> f32 {
        self.kept * libm::powf(scale.max(1.0), -2.0 * self.tone)
    }
}
