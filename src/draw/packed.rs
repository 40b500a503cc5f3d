//! A model in few bytes for the GPU: 72 for a leaf that is one quad, its timeline included.
//!
//! A corner of a leaf is an offset from the leaf's pivot, a pivot and a vertex of the wood are
//! steps of a grid. What many of them have in common, such as the material and the range of
//! texture coordinates, is a *look*: a row of a table.
//!
//! Nothing is out of range: a plant too large for one grid has more looks with other origins, and
//! small leaves beside large ones have looks with a shorter unit of length. Rare needs take rows
//! in `extras`: leaves of different numbers of quads, colours that differ within a leaf, leaves of
//! more than 256 looks, outlines of cards. Wood of more than 65,536 looks has one for each stem.
//!
//! Precision: offsets 1/32767 of the leaf's reach; pivots half a step, at most 1/128 of the median
//! leaf's reach; wood two millionths of the plant, widths of stems 0.14 %; normals about half a
//! degree; texture coordinates 1/65535 of a power of two at least as large as their range, 1/16384
//! for wood; colours of leaves half a step of 255 of their square root.

mod bits;
mod grid;
mod looks;

use super::{
    cards::PackedCards,
    quads::Quads,
    records::{
        CrownRecord, Event, LEAF_BITS, LeafVertex, LookRecord, MaterialRecord, NO_EXTRA, PackedCorner, PackedLeaf,
        PackedWood, PackingRecord, SlidingWood, StemRecord, WoodSlide, WoodVertex,
    },
    upload::Upload,
};
use crate::{bounds::Aabb, model::FoliageModel};
use bits::{color_bits, half_bits, normal_bits, uv_bits, width_bits};
use glam::{Vec2, Vec3};
use grid::Grid;
use looks::{Looks, look, unit_of_length, wood_look};

/// Sizes in bytes of what a model takes on the GPU: its leaves with their timelines, the cards of
/// clusters and all that they share with the wood, and the wood; textures and impostors are not
/// counted. O(vertices).
///
/// A renderer sums them over its models in
/// [`Diagnostics::model_bytes`](crate::gpu::Diagnostics::model_bytes).
pub fn gpu_bytes(model: &FoliageModel) -> [u64; 2] {
    let packed = Packed::new(Upload::sliding(model));
    Packed { cards: PackedCards::new(model), ..packed }.bytes(model.materials.len())
}

/// Looks that a leaf's record can hold.
const FEW_LOOKS: usize = 256;
/// Looks that a vertex of the wood can hold beside the width of its stem.
const MANY_LOOKS: u32 = 1 << 16;

/// The buffers of one model.
#[derive(Debug, Clone, Default)]
pub(crate) struct Packed {
    pub(crate) packing: PackingRecord,
    pub(crate) crown: CrownRecord,
    /// Four corners per quad, in drawing order.
    pub(crate) corners: Vec<PackedCorner>,
    /// One record per leaf, and one after the last for the end of its events.
    pub(crate) leaves: Vec<PackedLeaf>,
    pub(crate) events: Vec<Event>,
    pub(crate) looks: Vec<LookRecord>,
    pub(crate) extras: Vec<u32>,
    /// Entry n: number of quads of the first n leaves.
    pub(crate) quad_ends: Vec<u32>,
    /// Vertices of the wood, unless they slide.
    pub(crate) wood_vertices: Vec<PackedWood>,
    /// Vertices of wood that slides, and its stems.
    pub(crate) sliding: Vec<SlidingWood>,
    pub(crate) stems: Vec<StemRecord>,
    pub(crate) wood_indices: Vec<u32>,
    /// Texels of the limbs and their columns and rows; `None` without wind.
    pub(crate) limbs: Option<(Vec<[u32; 4]>, [u32; 2])>,
    /// Cards of clusters.
    pub(crate) cards: PackedCards,
}

impl Packed {
    /// Packs the records of a model. O(vertices + indices).
    pub(crate) fn new(upload: Upload) -> Self {
        let quads = upload.quads();
        let mut looks = Looks::default();
        let mut packed = Self { crown: upload.crown, ..Self::default() };
        packed.pack_leaves(&upload, &quads, &mut looks);
        if upload.wood_slides.is_empty() {
            packed.pack_wood(&upload, &mut looks);
        } else {
            packed.pack_sliding(&upload, &mut looks);
        }
        packed.looks = looks.rows;
        packed.events = upload.events;
        packed.wood_indices = upload.wood_indices;
        packed.stems = upload.wood_stems;
        packed.quad_ends = quads.ends;
        packed
    }

    /// Sizes in bytes of the buffers that hold it: of leaves, with `materials` materials, and of
    /// wood.
    pub(crate) fn bytes(&self, materials: usize) -> [u64; 2] {
        // A binding is never empty.
        fn held<T>(contents: &[T]) -> u64 {
            (contents.len().max(1) * size_of::<T>()) as u64
        }
        let tables = held(&self.corners) + held(&self.leaves) + held(&self.events);
        let shared = held(&self.looks) + held(&self.extras) + (materials.max(1) * size_of::<MaterialRecord>()) as u64;
        let uniforms = size_of::<CrownRecord>() + size_of::<PackingRecord>();
        let vertices = size_of_val(&self.wood_vertices[..]) + size_of_val(&self.sliding[..]);
        let wood = vertices + size_of_val(&self.stems[..]) + size_of_val(&self.wood_indices[..]);
        let cards = size_of_val(&self.cards.records[..]) + size_of_val(&self.cards.texels[..]);
        [tables + shared + uniforms as u64 + cards as u64, wood as u64]
    }

    fn pack_leaves(&mut self, upload: &Upload, quads: &Quads, looks: &mut Looks) {
        let vertex = |index: u32| &upload.leaf_vertices[index as usize];
        let corners_of = |leaf: usize| {
            let range = quads.ends[leaf] as usize..quads.ends[leaf + 1] as usize;
            quads.corners[range].as_flattened().iter().map(|&index| vertex(index))
        };
        let reaches: Vec<f32> =
            upload.leaves.iter().enumerate().map(|(leaf, record)| reach(record.pivot, corners_of(leaf))).collect();
        let grid = Grid::of_pivots(Aabb::of_points(upload.leaves.iter().map(|leaf| leaf.pivot)), &reaches);
        let color = largest_color(&upload.leaf_vertices);
        let trimmed = upload.trimmed(quads);
        let is_even = |leaf| {
            let mut colors = corners_of(leaf).map(|corner| corner.color);
            let first = colors.next();
            colors.all(|color| Some(color) == first)
        };
        let has_even_colors = (0..reaches.len()).all(is_even);
        let mut numbers = Vec::with_capacity(reaches.len());
        for (leaf, record) in upload.leaves.iter().enumerate() {
            let reach = unit_of_length(reaches[leaf]);
            let uvs = || corners_of(leaf).map(|corner| Vec2::from(corner.uv));
            let (origin, pivot) = grid.place(record.pivot);
            let mut look = look(origin, record.material, color, reach, uvs(), record);
            look.outline = trimmed.leaves[leaf];
            numbers.push(looks.number(look));
            let even = corners_of(leaf).next().filter(|_| has_even_colors);
            let color = even.map_or(0xff_ffff, |corner| color_bits(corner.color, color, 8));
            self.leaves.push(PackedLeaf {
                pivot_xy: pivot[0] | pivot[1] << 16,
                pivot_z_seed: pivot[2] | record.seed & 0xffff_0000,
                first_event: record.first_event,
                color_look: color,
            });
            self.corners.extend(corners_of(leaf).map(|corner| packed_corner(corner, record.pivot, &look)));
        }
        let end = upload.leaves.last().map_or(0, |leaf| leaf.end_event);
        self.leaves.push(PackedLeaf { first_event: end, ..bytemuck::Zeroable::zeroed() });
        self.packing.grid_step = grid.step as f32;
        self.packing.quads_per_leaf = quads_per_leaf(&quads.ends);
        if self.packing.quads_per_leaf == 0 {
            let leaves = (0_u32..).zip(quads.ends.windows(2));
            let most = u32::MAX >> LEAF_BITS;
            let quads = leaves.flat_map(|(leaf, ends)| (0..ends[1] - ends[0]).map(move |quad| (leaf, quad)));
            self.extras.extend(quads.map(|(leaf, quad)| leaf | quad.min(most) << LEAF_BITS));
        }
        self.packing.first_color = NO_EXTRA;
        if !has_even_colors {
            self.packing.first_color = self.extras.len() as u32;
            let corners = quads.corners.as_flattened().iter();
            self.extras.extend(corners.map(|&index| color_bits(vertex(index).color, color, 10)));
        }
        self.packing.first_look = NO_EXTRA;
        if looks.rows.len() <= FEW_LOOKS {
            self.leaves.iter_mut().zip(numbers).for_each(|(leaf, number)| leaf.color_look |= number << 24);
        } else {
            self.packing.first_look = self.extras.len() as u32;
            self.extras.extend(numbers);
        }
        self.packing.first_outline = self.extras.len() as u32;
        self.extras.extend_from_slice(&trimmed.extras);
    }

    fn pack_wood(&mut self, upload: &Upload, looks: &mut Looks) {
        let vertices = &upload.wood_vertices;
        let grid = Grid::of_wood(Aabb::of_points(vertices.iter().map(|vertex| vertex.position)));
        let step = grid.step as f32;
        let placed: Vec<_> = vertices.iter().map(|vertex| grid.place(vertex.position)).collect();
        let mut number = |(vertex, &(origin, _)): (&WoodVertex, &(Vec3, _)), size| {
            looks.number(LookRecord { size, ..wood_look(origin, vertex) })
        };
        let mut numbers: Vec<u32> = vertices.iter().zip(&placed).map(|of| number(of, 0.0)).collect();
        let is_many = numbers.iter().any(|&number| number >= MANY_LOOKS);
        for (to, of) in numbers.iter_mut().zip(vertices.iter().zip(&placed)) {
            let width = of.0.width;
            *to = if is_many { number(of, width) } else { *to | width_bits(width / step) << 16 };
        }
        self.packing.wood_step = step;
        self.packing.widths_in_looks = is_many.into();
        let vertices = vertices.iter().zip(&placed).zip(numbers);
        self.wood_vertices.extend(vertices.map(|((vertex, &(origin, at)), look_width)| PackedWood {
            position_xy: at[0] | at[1] << 16,
            position_z_normal: at[2] | normal_bits(vertex.normal) << 16,
            uv: uv_bits(vertex.uv, &wood_look(origin, vertex)),
            look_width,
        }));
    }
}

impl Packed {
    /// Packs wood that slides.
    fn pack_sliding(&mut self, upload: &Upload, looks: &mut Looks) {
        let vertices = &upload.wood_vertices;
        let grid = Grid::of_wood(Aabb::of_points(vertices.iter().map(|vertex| vertex.position)));
        self.packing.wood_step = grid.step as f32;
        let packed = |(vertex, slide): (&WoodVertex, &WoodSlide)| {
            let (origin, at) = grid.place(vertex.position);
            let look = wood_look(origin, vertex);
            SlidingWood {
                position_xy: at[0] | at[1] << 16,
                position_z_normal: at[2] | normal_bits(vertex.normal) << 16,
                uv: uv_bits(vertex.uv, &look),
                look: looks.number(look),
                parent_half: slide.parent | slide.half.map_or(0, |half| half_bits(half / vertex.width)) << 24,
                // Shaders may take no number for infinite.
                stem_threshold: slide.stem | slide.threshold.min(f32::MAX).to_bits() & 0xffff_0000,
            }
        };
        self.sliding = vertices.iter().zip(&upload.wood_slides).map(packed).collect();
    }
}

fn packed_corner(corner: &LeafVertex, pivot: [f32; 3], look: &LookRecord) -> PackedCorner {
    let offset = (Vec3::from(corner.position) - Vec3::from(pivot)) / look.size * f32::from(i16::MAX);
    let [x, y, z] = offset.to_array().map(|steps| u32::from(steps.round() as i16 as u16));
    PackedCorner {
        offset_xy: x | y << 16,
        offset_z_normal: z | normal_bits(corner.normal) << 16,
        uv: uv_bits(corner.uv, look),
    }
}

/// Largest component of an offset from the pivot.
fn reach<'a>(pivot: [f32; 3], corners: impl Iterator<Item = &'a LeafVertex>) -> f32 {
    let pivot = Vec3::from(pivot);
    corners.map(|corner| (Vec3::from(corner.position) - pivot).abs().max_element()).fold(0.0, f32::max)
}

/// Number of quads that every leaf has; 0 if they differ.
fn quads_per_leaf(ends: &[u32]) -> u32 {
    let first = ends.get(1).copied().unwrap_or(1);
    if ends.windows(2).all(|pair| pair[1] - pair[0] == first) { first } else { 0 }
}

fn largest_color(vertices: &[LeafVertex]) -> Vec3 {
    let largest = vertices.iter().map(|vertex| Vec3::from(vertex.color)).fold(Vec3::ZERO, Vec3::max);
    largest.max(Vec3::splat(f32::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use super::{
        super::records::{LEAST_WIDTH, NO_NORMAL, WIDTH_STEPS},
        *,
    };
    use crate::{
        Plant,
        leaf::Vertex,
        model::{FoliageModel, Prune, Recipe, octahedral},
        plant::WoodPart,
        random::Random,
    };

    /// Leaves of the given numbers of triangles, each a strip as long as `reach` of its number, and
    /// one triangle of wood.
    fn upload(leaves: u32, triangles: impl Fn(u32) -> u32, reach: impl Fn(u32) -> f32) -> Upload {
        let mut random = Random::new(1);
        let mut unit = move || (random.bits() >> 44) as f32 / (1 << 20) as f32;
        let mut plant = Plant { materials: vec![Default::default(); 2], ..Plant::default() };
        for leaf in 0..leaves {
            let pivot = [10.0 * unit(), 8.0 * unit(), -10.0 * unit()];
            let corners = triangles(leaf) + 2;
            let vertices: Vec<Vertex> = (0..corners)
                .map(|i| Vertex {
                    position: [0, 1, 2].map(|axis| pivot[axis] + reach(leaf) * (unit() - 0.5)),
                    normal: Vec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5).normalize().to_array(),
                    uv: [3.0 * unit() - 1.0, unit()],
                    color: if i == 0 { [0.1, 0.9, 1.5, 1.0] } else { [unit(); 4] },
                })
                .collect();
            let indices: Vec<u32> = (0..triangles(leaf)).flat_map(|i| [i, i + 1, i + 2]).collect();
            plant.push_leaf(&vertices, &indices, pivot, leaf % 2);
        }
        let corner = |position, uv| Vertex { position, normal: [0.0, 0.6, -0.8], uv, color: [0.5; 4] };
        plant.wood.vertices = vec![
            corner([0.0; 3], [0.0, 37.3]),
            corner([0.1, 0.0, 0.0], [-2.2, 9.0]),
            corner([0.0, 20.0, 0.0], [0.5; 2]),
        ];
        plant.wood.indices = vec![0, 1, 2];
        plant.wood.parts = vec![WoodPart { indices: [0, 3], material: 1 }];
        let prunes: Vec<Prune> =
            (1..leaves).rev().map(|leaf| Prune { leaf, target: leaf / 2, target_scale: 1.5, error: 0.0 }).collect();
        Upload::new(&FoliageModel::assemble(&plant, &prunes, Recipe::default()).unwrap())
    }

    fn halves(bits: u32) -> [f32; 2] {
        [bits as u16, (bits >> 16) as u16].map(f32::from)
    }

    fn signed(bits: u32) -> [f32; 2] {
        [bits as u16, (bits >> 16) as u16].map(|half| f32::from(half as i16) / f32::from(i16::MAX))
    }

    fn normal_of(bits: u32) -> Vec3 {
        let byte = |shift: u32| i32::from((bits >> shift) as u8 as i8);
        if bits == NO_NORMAL { Vec3::ZERO } else { octahedral::decode([byte(0), byte(8)], 8).into() }
    }

    /// A corner as the shader reads it: position, normal, texture coordinates, colour.
    fn corner(packed: &Packed, at: usize) -> (Vec3, Vec3, Vec2, Vec3, u32) {
        let PackingRecord { grid_step, quads_per_leaf, first_color, first_look, .. } = packed.packing;
        let quad = at as u32 / 4;
        let number =
            quad.checked_div(quads_per_leaf).unwrap_or_else(|| packed.extras[quad as usize] & ((1 << LEAF_BITS) - 1));
        let (leaf, bits) = (packed.leaves[number as usize], packed.corners[at]);
        let own = leaf.color_look >> 24;
        let row = if first_look == NO_EXTRA { own } else { packed.extras[(first_look + number) as usize] };
        let look = packed.looks[row as usize];
        let [x, y] = halves(leaf.pivot_xy);
        let pivot = Vec3::from(look.origin) + Vec3::new(x, y, halves(leaf.pivot_z_seed)[0]) * grid_step;
        let ([x, y], [z, _]) = (signed(bits.offset_xy), signed(bits.offset_z_normal));
        let uv = Vec2::from(look.uv_low) + Vec2::from(halves(bits.uv)) / 65535.0 * Vec2::from(look.uv_size);
        let (color, width) = match first_color {
            NO_EXTRA => (leaf.color_look, 8),
            first => (packed.extras[first as usize + at], 10),
        };
        let steps = (1 << width) - 1;
        let root = [0, 1, 2].map(|i| (color >> (i * width) & steps) as f32 / steps as f32);
        let color = Vec3::from(root) * Vec3::from(root) * Vec3::from(look.color);
        let position = pivot + Vec3::new(x, y, z) * look.size;
        (position, normal_of(bits.offset_z_normal >> 16), uv, color, number)
    }

    /// Compares every corner with the vertex that it stands for; positions within `allowed`.
    fn check(upload: &Upload, packed: &Packed, allowed: f32) {
        let quads = upload.quads();
        assert_eq!(packed.corners.len(), 4 * quads.corners.len());
        for (at, &index) in quads.corners.as_flattened().iter().enumerate() {
            let vertex = &upload.leaf_vertices[index as usize];
            let (position, normal, uv, color, leaf) = corner(packed, at);
            let off = (position - Vec3::from(vertex.position)).abs().max_element();
            assert!(off <= allowed, "corner {at} is {off} off");
            assert!(normal.dot(vertex.normal.into()) > 0.7_f32.to_radians().cos(), "{normal}");
            assert!((uv - Vec2::from(vertex.uv)).abs().max_element() < 1e-4, "{uv}");
            assert!((color - Vec3::from(vertex.color)).abs().max_element() < 2e-3, "{color} {:?}", vertex.color);
            assert_eq!(leaf, vertex.leaf);
        }
        for (leaf, packed) in upload.leaves.iter().zip(packed.leaves.windows(2)) {
            assert_eq!([leaf.first_event, leaf.end_event], [packed[0].first_event, packed[1].first_event]);
            assert_eq!(leaf.seed >> 16, packed[0].pivot_z_seed >> 16);
        }
    }

    #[test]
    fn a_leaf_that_is_a_quad_takes_72_bytes() {
        let mut upload = upload(1000, |_| 2, |_| 0.1);
        for vertex in &mut upload.leaf_vertices {
            (vertex.color, vertex.uv) = ([0.3, 0.5, 0.2], [0.0, 1.0]);
        }
        upload.leaves.iter_mut().for_each(|leaf| leaf.uv_size = [1.0; 2]);
        let packed = Packed::new(upload.clone());
        assert_eq!((packed.packing.quads_per_leaf, packed.extras.len()), (1, 0));
        let bytes =
            size_of_val(&packed.corners[..]) + size_of_val(&packed.leaves[..]) + size_of_val(&packed.events[..]);
        // One event fewer than leaves, one leaf record more.
        assert_eq!(bytes, 72 * 1000 + 16 - 8);
        assert!(packed.looks.len() <= 8, "{}", packed.looks.len());
        assert_eq!([size_of::<PackedWood>(), size_of::<PackedLeaf>(), size_of::<PackedCorner>()], [16, 16, 12]);
    }

    #[test]
    fn every_corner_is_where_its_vertex_is_and_looks_like_it() {
        // Colours and texture coordinates that differ within leaves: more than 256 looks.
        for (triangles, quads) in [(2, 1), (4, 2), (1, 1)] {
            let upload = upload(400, |_| triangles, |_| 0.2);
            let packed = Packed::new(upload.clone());
            assert_eq!(packed.packing.quads_per_leaf, quads);
            assert!(packed.packing.first_color != NO_EXTRA && packed.packing.first_look != NO_EXTRA);
            check(&upload, &packed, 3e-4);
        }
        let mixed = upload(300, |leaf| 1 + leaf % 7, |_| 0.2);
        let packed = Packed::new(mixed.clone());
        assert_eq!(packed.packing.quads_per_leaf, 0);
        check(&mixed, &packed, 3e-4);
    }

    #[test]
    fn small_leaves_beside_a_large_one_and_far_apart_stay_precise() {
        let sizes = upload(300, |_| 2, |leaf| if leaf == 7 { 50.0 } else { 0.001 });
        let packed = Packed::new(sizes.clone());
        let small = |at: usize| sizes.quads().corners.as_flattened()[at] / 4 != 7;
        let off = (0..packed.corners.len()).filter(|&at| small(at)).map(|at| {
            let index = sizes.quads().corners.as_flattened()[at] as usize;
            (corner(&packed, at).0 - Vec3::from(sizes.leaf_vertices[index].position)).abs().max_element()
        });
        // `f32` itself has steps of 1e-6 here.
        let off = off.fold(0.0, f32::max);
        assert!(off < 1e-5, "{off}");
    }

    #[test]
    fn wood_stays_within_two_millionths_and_has_a_look_for_each_range_of_its_texture() {
        let mut upload = upload(1, |_| 2, |_| 0.1);
        let widths = [-0.3, 0.002, 5.0];
        upload.wood_vertices.iter_mut().zip(widths).for_each(|(vertex, width)| vertex.width = width);
        let packed = Packed::new(upload.clone());
        for (bits, vertex) in packed.wood_vertices.iter().zip(&upload.wood_vertices) {
            let look = packed.looks[(bits.look_width & 0xffff) as usize];
            let ([x, y], [z, _]) = (halves(bits.position_xy), halves(bits.position_z_normal));
            let position = Vec3::from(look.origin) + Vec3::new(x, y, z) * packed.packing.wood_step;
            assert!((position - Vec3::from(vertex.position)).abs().max_element() < 4e-5, "{position}");
            let uv = Vec2::from(look.uv_low) + Vec2::from(halves(bits.uv)) / 65535.0 * Vec2::from(look.uv_size);
            assert!((uv - Vec2::from(vertex.uv)).abs().max_element() < 4e-5, "{uv}");
            assert!(normal_of(bits.position_z_normal >> 16).dot(vertex.normal.into()) > 0.9999);
            assert_eq!((look.material, look.color), (vertex.material, vertex.color));
            let code = bits.look_width >> 16;
            let width = ((code & 0x7fff) as f32 / WIDTH_STEPS + LEAST_WIDTH).exp2() * packed.packing.wood_step;
            let width = if code >> 15 == 1 { -width } else { width };
            assert!((width / vertex.width - 1.0).abs() < 1.4e-3, "{width} {}", vertex.width);
        }
    }

    #[test]
    fn wood_of_very_many_looks_keeps_them_all() {
        let mut upload = upload(1, |_| 2, |_| 0.1);
        let vertex = upload.wood_vertices[0];
        let colored = |i: u32| WoodVertex { color: [i as f32; 3], width: 0.5, ..vertex };
        upload.wood_vertices = (0..70_000).map(colored).collect();
        let packed = Packed::new(upload);
        assert_eq!(packed.packing.widths_in_looks, 1);
        for (i, bits) in packed.wood_vertices.iter().enumerate() {
            let look = packed.looks[bits.look_width as usize];
            assert_eq!((look.color, look.size), ([i as f32; 3], 0.5));
        }
        assert_eq!([0.0, f32::INFINITY, -0.0].map(width_bits), [0, 0x7fff, 0x8000]);
    }

    #[test]
    fn normals_without_a_direction_and_along_the_axes_keep_it() {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z, Vec3::ZERO] {
            assert_eq!(normal_of(normal_bits(axis.to_array())), axis);
        }
    }
}
