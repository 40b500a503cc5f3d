//! Alpha of vertices: folded into the material where it is the same all over a leaf, because the
//! drawers cut leaves out by their texture alone.

use super::{Warning, WarningKind};
use crate::{
    leaf::Vertex,
    material::{AlphaMode, Material},
};
use std::collections::BTreeMap;

/// Number of alphas that a material can have: each needs a material of its own.
const SHADES: f32 = 64.0;
/// Differences of alpha below this are rounding.
const ROUNDING: f32 = 1.5 / 255.0;
/// Alpha below which a blended surface is invisible: half a step of 8 bits.
const INVISIBLE: f32 = 0.5 / 255.0;

/// Materials with the alpha of vertices folded in.
pub(super) struct Shades<'a> {
    materials: &'a [Material],
    added: Vec<Material>,
    /// Index of each material with a number of 64ths of its alpha.
    known: BTreeMap<(usize, u32), usize>,
    invisible: usize,
    varying: usize,
}

impl<'a> Shades<'a> {
    pub(super) fn new(materials: &'a [Material]) -> Self {
        Self { materials, added: Vec::new(), known: BTreeMap::new(), invisible: 0, varying: 0 }
    }

    /// The material with which `triangles` of material `index` are drawn, their alpha folded into
    /// it; `None` if they are invisible.
    pub(super) fn settle(&mut self, index: usize, triangles: &mut [[Vertex; 3]]) -> Option<usize> {
        let material = &self.materials[index];
        let alphas = || triangles.iter().flatten().map(|vertex| vertex.color[3]);
        if material.alpha_mode == AlphaMode::Opaque || alphas().all(|alpha| alpha == 1.0) {
            return Some(index);
        }
        let [low, high] = [alphas().fold(f32::INFINITY, f32::min), alphas().fold(0.0, f32::max)];
        let least = if material.alpha_mode == AlphaMode::Mask { material.alpha_cutoff } else { INVISIBLE };
        // A material that cannot be seen anyway is not the fault of its vertices.
        if high * material.base_color[3] < least && material.base_color[3] >= least {
            self.invisible += 1;
            return None;
        }
        if high - low > ROUNDING {
            self.varying += 1;
            return Some(index);
        }
        triangles.as_flattened_mut().iter_mut().for_each(|vertex| vertex.color[3] = 1.0);
        let shade = (high * SHADES).ceil().min(SHADES) as u32;
        Some(self.shade(index, shade))
    }

    fn shade(&mut self, index: usize, shade: u32) -> usize {
        if shade as f32 >= SHADES {
            return index;
        }
        let next = self.materials.len() + self.added.len();
        let found = *self.known.entry((index, shade)).or_insert(next);
        if found == next {
            let mut material = self.materials[index].clone();
            material.base_color[3] *= shade as f32 / SHADES;
            self.added.push(material);
        }
        found
    }

    /// The materials that were added behind the given ones, and what could not be kept.
    pub(super) fn finish(self) -> (Vec<Material>, Vec<Warning>) {
        let mut warnings = Vec::new();
        if self.invisible > 0 {
            let message =
                format!("{} leaves or triangles are left out: their vertex alpha makes them invisible", self.invisible);
            warnings.push(Warning::new(
                WarningKind::Invisible,
                message,
                "if it is no alpha, use `VertexColors::Ignore`",
            ));
        }
        if self.varying > 0 {
            let message =
                format!("the alpha of {} leaves or triangles varies over their vertices and is ignored", self.varying);
            warnings.push(Warning::new(WarningKind::VertexColors, message, "bake it into the texture if it matters"));
        }
        (self.added, warnings)
    }
}
