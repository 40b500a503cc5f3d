//! Constants of impostors that the shaders share with the software renderer.

/// Diameter in pixels from which the depth of the pictures is followed; below it they are as flat
/// as their frames, which nobody sees.
pub(crate) const DEEP_FROM_PX: f32 = 24.0;
/// Steps along the ray towards the depth of a picture.
pub(crate) const DEPTH_STEPS: u32 = 2;
/// Levels by which the mip level is finer than one whose texels are a pixel wide: pictures are
/// filtered twice, when they are looked up and when three of them are blended.
pub(crate) const SHARPER_LEVELS: f32 = 0.5;
/// Diameter in pixels below which a sprite keeps its size, and its coverage falls instead.
pub(crate) const LEAST_PX: f32 = 2.0;
/// Least part of a ray towards a frame: rays along a frame's plane would never meet it.
pub(crate) const LEAST_APPROACH: f32 = 0.2;
/// Part of the distance to the eye up to which a flat sprite is drawn before its plant's centre, so
/// that what stands within the crown does not cut it.
pub(crate) const MOST_PULL: f32 = 0.5;
