//! Quantisation: rounds the numbers of a model to grids, so that its file is small.
//!
//! Steps are powers of two, so every rounded number is an `f32` without further error: what is
//! drawn in memory and what a file gives back are the same bits, and rounding again changes
//! nothing. Leaf records stay as they are: targets, scales, errors, and the order.
//!
//! Where that makes the file smaller, leaves of the same shape up to a turn, a size and a place are
//! moved onto one shape instead, within the same errors.
//!
//! Limits: numbers that no grid suits stay exact, and their entry in [`Precision`] is 0: positions
//! whose enlarged leaves reach 1e30, normals that are not unit vectors, texture coordinates and
//! colours beyond 1,000.

use super::{
    Clusters, FoliageModel, Precision, format,
    grid::{self, EXPONENTS, exponent_below},
    octahedral::{self, NORMAL_BITS},
    shapes::{self, Shared},
};
use crate::{leaf::Vertex, plant::moved};
use std::mem::swap;

/// Positions: half a step is at most 1/65,536 of the longest edge of the bounding box...
const STEPS_PER_BOX: f64 = 32768.0;
/// ... and at most 1/1,024 of the reach of all leaves but the smallest twentieth.
const STEPS_PER_REACH: f64 = 512.0;
const SMALLEST: usize = 20;
/// Coordinates that stay exact: an `f32` may overflow once their leaves are enlarged.
const TOO_FAR: f32 = 1e30;
/// Texture coordinates: half a step is a quarter of a texel of the largest texture.
const UV_EXPONENT: i16 = -14;
/// What cards of clusters keep of their colours.
const CARD_EXPONENT: i16 = -8;
/// Linear colours: finer than a byte, for dark colours. Alpha stays exact: cutoffs decide by it.
const COLOR_EXPONENT: i16 = -10;
/// Texture coordinates and colours up to this size are whole multiples of their steps.
const LARGEST: f32 = 1000.0;
/// How far the length of a unit normal may be from 1.
const UNIT_TOLERANCE: f32 = 1e-3;

impl FoliageModel {
    /// Rounds positions, normals, texture coordinates and colours so that the model's file is
    /// small, and sets [`precision`](Self::precision) to the largest errors. A quantized model is
    /// left as it is. O(model).
    pub fn quantize(&mut self) {
        if self.precision != Precision::EXACT {
            return;
        }
        let exact = self.vertices.clone();
        let pivots: Vec<[f32; 3]> = self.leaves.iter().map(|leaf| leaf.pivot).collect();
        let exponent = self.quantize_positions();
        self.quantize_cards(exponent);
        self.precision = Precision {
            position: exponent.map_or(0.0, |exponent| (0.5 * grid::power(exponent)) as f32),
            normal_rad: self.quantize_normals().unwrap_or(0.0),
            uv: self.quantize_uvs().unwrap_or(0.0),
            color: self.quantize_numbers(COLOR_EXPONENT, |vertex| &mut vertex.color[..3]).unwrap_or(0.0),
        };
        if let Some(exponent) = exponent.filter(|_| self.precision.normal_rad > 0.0 && self.validate().is_ok())
            && let Some(shared) = shapes::find(self, exact, pivots, exponent)
        {
            self.share(shared);
        }
    }

    /// Moves leaves onto shared shapes if that makes the file smaller.
    fn share(&mut self, mut shared: Shared) {
        let alone = format::leaf_bytes(self);
        self.swap_shared(&mut shared);
        let is_smaller = matches!((format::leaf_bytes(self), alone), (Ok(bytes), Ok(alone)) if bytes < alone);
        if !is_smaller {
            self.swap_shared(&mut shared);
        }
    }

    fn swap_shared(&mut self, shared: &mut Shared) {
        swap(&mut self.plant.vertices, &mut shared.vertices);
        swap(&mut self.copies, &mut shared.copies);
        self.plant.leaves.iter_mut().zip(&mut shared.pivots).for_each(|(leaf, pivot)| swap(&mut leaf.pivot, pivot));
    }

    /// Returns the exponent of the steps.
    fn quantize_positions(&mut self) -> Option<i16> {
        let reach = self.enlarged_aabb();
        let largest = reach.min.iter().chain(&reach.max).fold(0.0_f32, |most, x| most.max(x.abs()));
        if largest > TOO_FAR {
            return None;
        }
        let exponent = self.position_exponent();
        let snap = |point: &mut [f32; 3]| *point = point.map(|x| grid::value(grid::code(x, exponent), exponent));
        self.all_vertices().for_each(|vertex| snap(&mut vertex.position));
        self.leaves.iter_mut().for_each(|leaf| snap(&mut leaf.pivot));
        Some(exponent)
    }

    /// Exponent of the step of positions.
    fn position_exponent(&self) -> i16 {
        let pivots = self.leaves.iter().map(|leaf| leaf.pivot);
        let points = self.all_positions().chain(pivots);
        let largest = points.flatten().fold(0.0_f32, |most, x| most.max(x.abs()));
        let of_box = f64::from(self.aabb().size().max_element()) / STEPS_PER_BOX;
        let distance = |vertex: &Vertex, pivot| glam::Vec3::from(vertex.position).distance(pivot);
        let mut reaches: Vec<f32> = self
            .leaves
            .iter()
            .map(|leaf| {
                let vertices = self.vertices[leaf.geometry().vertex_range()].iter();
                vertices.map(|vertex| distance(vertex, leaf.pivot.into())).fold(0.0, f32::max)
            })
            .filter(|&reach| reach > 0.0)
            .collect();
        let small = reaches.len() / SMALLEST;
        let of_leaf = match reaches.is_empty() {
            true => f64::INFINITY,
            false => f64::from(*reaches.select_nth_unstable_by(small, f32::total_cmp).1) / STEPS_PER_REACH,
        };
        // An f32 has 24 bits: farther from the origin they do not hold smaller steps.
        exponent_below(of_box.min(of_leaf))
            .max(exponent_below(f64::from(largest)).saturating_sub(22))
            .max(*EXPONENTS.start())
    }

    fn quantize_normals(&mut self) -> Option<f32> {
        let is_unit = |vertex: &Vertex| (glam::Vec3::from(vertex.normal).length() - 1.0).abs() <= UNIT_TOLERANCE;
        if !self.vertices.iter().chain(&self.wood.vertices).all(is_unit) {
            return None;
        }
        for vertex in self.all_vertices() {
            vertex.normal = octahedral::decode(octahedral::encode(vertex.normal, NORMAL_BITS), NORMAL_BITS);
        }
        Some(octahedral::largest_error(NORMAL_BITS))
    }

    /// Rounds cards of clusters: places like those of leaves, and the rest to a byte.
    fn quantize_cards(&mut self, exponent: Option<i16>) {
        let snap = |x: f32, exponent| grid::value(grid::code(x, exponent), exponent);
        let mut cards = self.clusters.cards().to_vec();
        for card in &mut cards {
            if let Some(exponent) = exponent {
                card.center = card.center.map(|x| snap(x, exponent));
                card.half_sides = card.half_sides.map(|side| side.map(|x| snap(x, exponent)));
            }
            card.normal = octahedral::decode(octahedral::encode(card.normal, NORMAL_BITS), NORMAL_BITS);
            card.kept = snap(card.kept, CARD_EXPONENT);
            card.color = card.color.map(|x| if x <= LARGEST { snap(x, COLOR_EXPONENT) } else { x });
        }
        self.clusters = Clusters::new(cards, self.clusters.texels().to_vec());
    }

    /// Rounds texture coordinates, and the rectangles of outlines alike.
    fn quantize_uvs(&mut self) -> Option<f32> {
        let error = self.quantize_numbers(UV_EXPONENT, |vertex| &mut vertex.uv)?;
        let snap = |number| grid::value(grid::code(number, UV_EXPONENT), UV_EXPONENT);
        self.plant.outlines = moved(&self.plant.outlines, |corner| corner.map(snap));
        Some(error)
    }

    fn quantize_numbers(&mut self, exponent: i16, numbers: impl Fn(&mut Vertex) -> &mut [f32]) -> Option<f32> {
        let mut are_small = true;
        for vertex in self.all_vertices() {
            are_small &= numbers(vertex).iter().all(|number| number.abs() <= LARGEST);
        }
        if !are_small {
            return None;
        }
        for number in self.all_vertices().flat_map(&numbers) {
            *number = grid::value(grid::code(*number, exponent), exponent);
        }
        Some((0.5 * grid::power(exponent)) as f32)
    }

    fn all_positions(&self) -> impl Iterator<Item = [f32; 3]> {
        self.vertices.iter().chain(&self.wood.vertices).map(|vertex| vertex.position)
    }

    fn all_vertices(&mut self) -> impl Iterator<Item = &mut Vertex> {
        let plant = &mut self.plant;
        plant.vertices.iter_mut().chain(&mut plant.wood.vertices)
    }
}
