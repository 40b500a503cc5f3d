//! Shader sources: one `.wgsl` file each, preceded by the constants that it shares with Rust.

use crate::material::Wrap;
use std::fmt::Write;

/// Builder of a WGSL source.
#[derive(Debug, Default)]
pub struct ShaderSource {
    text: String,
}

impl ShaderSource {
    /// An empty source.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds `const NAME: u32 = value;`.
    pub fn constant_u32(mut self, name: &str, value: u32) -> Self {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "const {name}: u32 = {value}u;");
        self
    }

    /// Adds `const NAME: f32 = value;`; the value must be finite.
    pub fn constant_f32(mut self, name: &str, value: f32) -> Self {
        let _ = writeln!(self.text, "const {name}: f32 = {value:?}f;");
        self
    }

    /// Adds `const NAME: bool = value;`.
    pub fn constant_bool(mut self, name: &str, value: bool) -> Self {
        let _ = writeln!(self.text, "const {name}: bool = {value};");
        self
    }

    /// Adds `const NAME: vec3<f32> = value;`; the value must be finite.
    pub fn constant_vec3(mut self, name: &str, value: glam::Vec3) -> Self {
        let _ = writeln!(self.text, "const {name}: vec3<f32> = vec3({:?}f, {:?}f, {:?}f);", value.x, value.y, value.z);
        self
    }

    /// Adds a piece of WGSL that several shaders share.
    pub fn with_part(mut self, part: &str) -> Self {
        self.text.push_str(part);
        self
    }

    /// Returns everything added so far, followed by `body`.
    pub fn with_body(self, body: &str) -> String {
        self.text + "\n" + body
    }
}

/// Number of a wrap mode in the shaders.
pub const fn wrap_number(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }
}
