//! Options of the simplification, with presets.

/// Greatest linear growth that may be asked for; with the greatest resolution it keeps edge functions within `i64`.
pub const MAX_SCALE_LIMIT: f32 = 64.0;
