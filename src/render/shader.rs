//! Shader sources: one `.wgsl` file each, with the constants that it shares with Rust put in front.

use std::fmt::Write;

/// A WGSL source being put together.
#[derive(Debug, Default)]
pub struct ShaderSource {
    text: String,
}

impl ShaderSource {
    /// Nothing yet.
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

    /// The constants, then `body`.
    pub fn with_body(self, body: &str) -> String {
        self.text + "\n" + body
    }
}
