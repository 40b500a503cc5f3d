//! A model as an asset: meshes of prefixes of its leaves, wood with less and less detail, and their
//! materials.

use crate::{
    far::{FarMaterial, far_parts},
    material::{ATTRIBUTE_LEAF, ATTRIBUTE_STEM, Crown, FoliageExtension, FoliageMaterial},
    plants::{PLANTS, SWAYS},
    texture::{image, mean},
};
use bevy::{
    asset::{Asset, Assets, Handle, LoadContext, RenderAssetUsages},
    camera::primitives::Aabb,
    color::Color,
    ecs::world::World,
    image::{Image, ImageSampler},
    math::{Vec3, Vec3A},
    mesh::{Indices, Mesh, PrimitiveTopology},
    pbr::StandardMaterial,
    platform::collections::HashMap,
    prelude::AlphaMode,
    reflect::TypePath,
    render::{
        render_resource::{Extent3d, TextureDimension, TextureFormat},
        storage::ShaderBuffer,
    },
};
use foliage_lod::{
    FoliageModel,
    draw::{MaterialLeaves, Upload, limb_texels},
    effects::{Limbs, WindShape},
    leaf::Vertex,
    material::{Material, Wrap},
    model::ErrorCurve,
    wood::WoodLevels,
};
use std::{ops::Range, sync::Arc};

/// Ratio of the leaves of a rung to those of the next one. A plant that draws n leaves processes
/// the vertices of the smallest rung that has them: at most [`RUNG_RATIO`] times as many as it
/// needs, 1.4 times on average.
pub const RUNG_RATIO: f32 = 1.9;
/// Fewest leaves of a rung.
const LEAST_RUNG: u32 = 32;
/// Diameter in pixels at which the first rung of thinned wood is half a pixel off, and the smallest
/// one that there is a rung for.
const WOOD_PX: Range<f32> = 16.0..1024.0;
/// Largest share of the triangles of a rung of wood that the next one may have.
const FEWER_TRIANGLES: f32 = 0.8;

/// A plant that can be drawn with any number of its leaves. Loaded from `.vds` files and continuous
/// glTF, or [built](Self::new) from a model.
#[derive(Asset, TypePath, Debug, Clone)]
pub struct FoliageAsset {
    /// The model.
    pub model: Arc<FoliageModel>,
    /// Prefixes of the leaves, from all down to few.
    pub(crate) rungs: Vec<u32>,
    /// Number of vertices of each.
    pub(crate) rung_vertices: Vec<u32>,
    /// The leaves of each material, by rung.
    pub(crate) leaves: Vec<(Handle<FoliageMaterial>, Vec<Handle<Mesh>>)>,
    /// Wood, from all down to little.
    pub(crate) wood: Vec<WoodRung>,
    /// The impostor, if the model has one.
    pub(crate) far: Option<(Handle<Mesh>, Handle<FarMaterial>)>,
    /// Middle of the bounding sphere, in plant space; meshes are relative to it.
    pub(crate) center: Vec3,
    /// Radius of the bounding sphere.
    pub(crate) radius: f32,
    /// Box around all leaves however they are enlarged, and the wood, relative to the middle.
    pub(crate) aabb: Aabb,
    /// Largest distance of a leaf's corner from its pivot.
    pub(crate) leaf_reach: f32,
    /// What the wind goes by.
    pub(crate) shape: WindShape,
    /// Error by number of leaves.
    pub(crate) curve: ErrorCurve,
}

/// Wood at an error.
#[derive(Debug, Clone)]
pub(crate) struct WoodRung {
    /// How far it may be off, in plant units.
    pub(crate) error: f32,
    /// Triangles and vertices of all parts.
    pub(crate) triangles: u32,
    pub(crate) vertices: u32,
    pub(crate) parts: Vec<(Handle<FoliageMaterial>, Handle<Mesh>)>,
}

/// Where assets are put.
pub(crate) trait Store {
    fn put<A: Asset>(&mut self, label: String, asset: A) -> Handle<A>;
}

impl Store for World {
    fn put<A: Asset>(&mut self, _: String, asset: A) -> Handle<A> {
        self.resource_mut::<Assets<A>>().add(asset)
    }
}

impl Store for LoadContext<'_> {
    fn put<A: Asset>(&mut self, label: String, asset: A) -> Handle<A> {
        self.add_labeled_asset(label, asset)
    }
}

impl FoliageAsset {
    /// Builds the meshes and materials of a valid model, and adds them to the world's assets.
    /// O(vertices + indices), twice over for the prefixes.
    ///
    /// # Errors
    /// Those of [`Texture::decode`](foliage_lod::material::Texture::decode).
    pub fn new(model: FoliageModel, world: &mut World) -> foliage_lod::Result<Self> {
        Self::build(model, world)
    }

    pub(crate) fn build(model: FoliageModel, store: &mut impl Store) -> foliage_lod::Result<Self> {
        let upload = Upload::new(&model);
        let sphere = model.sphere();
        let limbs = model.wood_order.as_ref().and_then(|order| Limbs::new(&model, order, sphere.center()));
        let materials = materials(&model, &upload, limbs.as_ref(), store)?;
        let rungs = rungs(model.leaves.len() as u32);
        let mut leaves = Vec::new();
        let mut rung_vertices = vec![0; rungs.len()];
        for group in upload.by_material() {
            let mut meshes: Vec<Handle<Mesh>> = Vec::new();
            // Vertices of the last mesh.
            let mut vertices = 0;
            for (rung, &count) in rungs.iter().enumerate() {
                match meshes.last() {
                    // A mesh has vertices, if only some that are not drawn.
                    Some(last) if group.index_end(count) == 0 => meshes.push(last.clone()),
                    _ => {
                        let mesh = leaf_mesh(&upload, &group, count);
                        vertices = mesh.count_vertices() as u32;
                        meshes.push(store.put(format!("Leaves{}/{rung}", group.material), mesh));
                    }
                }
                rung_vertices[rung] += vertices;
            }
            leaves.push((materials[group.material as usize][0].clone(), meshes));
        }
        let wood = wood(&model, &materials, store);
        let far = model.impostor.as_ref().map(|impostor| far_parts(impostor, upload.center, store));
        let bounds = model.enlarged_aabb();
        let center = sphere.center().as_vec3();
        let center = Vec3::new(center.x, center.y, center.z);
        let corner = |corner: [f32; 3]| Vec3::from(corner) - center;
        let shape = WindShape::new(&model.aabb());
        let shape = WindShape {
            base: shape.base - center.y,
            axis: [shape.axis[0] - center.x, shape.axis[1] - center.z],
            limbs: limbs.as_ref().map(Limbs::reach),
            ..shape
        };
        Ok(Self {
            rungs,
            rung_vertices,
            leaves,
            wood,
            far,
            center,
            radius: sphere.radius as f32,
            aabb: Aabb::from_min_max(corner(bounds.min), corner(bounds.max)),
            leaf_reach: leaf_reach(&model),
            shape,
            curve: ErrorCurve::of(&model),
            model: Arc::new(model),
        })
    }

    /// Number of leaves of the model.
    pub fn leaf_count(&self) -> u32 {
        self.model.leaves.len() as u32
    }

    /// The smallest rung that has so many leaves, or the one that a plant is at, which is kept
    /// until there is some room.
    pub(crate) fn rung(&self, drawn: u32, current: usize) -> usize {
        let fits = |rung: usize| self.rungs.get(rung).is_some_and(|&leaves| leaves >= drawn);
        let best = self.rungs.partition_point(|&leaves| leaves >= drawn).saturating_sub(1);
        let has_room = |rung: usize| f64::from(self.rungs[rung]) * 0.95 >= f64::from(drawn);
        if fits(current) && best == current + 1 && !has_room(best) { current } else { best }
    }

    /// The coarsest rung of the wood that is at most so far off, or the one that a plant is at, as
    /// for leaves.
    pub(crate) fn wood_rung(&self, error: f32, current: usize) -> usize {
        let best = self.wood.partition_point(|rung| rung.error <= error).saturating_sub(1);
        let has_room = |rung: usize| self.wood[rung].error <= 0.95 * error;
        if best == current + 1 && !has_room(best) { current } else { best }
    }
}

/// Numbers of leaves of the prefixes.
fn rungs(leaves: u32) -> Vec<u32> {
    let mut rungs = vec![leaves];
    let next = |last: u32| (last as f32 / RUNG_RATIO).ceil() as u32;
    while next(rungs[rungs.len() - 1]) >= LEAST_RUNG {
        rungs.push(next(rungs[rungs.len() - 1]));
    }
    rungs
}

/// Largest distance of a leaf's corner from its pivot, however the leaf is enlarged.
fn leaf_reach(model: &FoliageModel) -> f32 {
    let scales = model.largest_scales();
    let reach = model.leaves.iter().zip(scales).flat_map(|(leaf, scale)| {
        let pivot = Vec3::from(leaf.pivot);
        let corners = &model.vertices[leaf.geometry().vertex_range()];
        corners.iter().map(move |corner| Vec3::from(corner.position).distance(pivot) * scale)
    });
    reach.fold(0.0, f32::max)
}

/// A mesh of the first leaves of one material.
fn leaf_mesh(upload: &Upload, group: &MaterialLeaves, leaves: u32) -> Mesh {
    let mut numbers: HashMap<u32, u32> = HashMap::default();
    let mut vertices = Vec::new();
    let own = &group.indices[..group.index_end(leaves) as usize];
    let indices = own.iter().map(|&index| {
        *numbers.entry(index).or_insert_with(|| {
            vertices.push(&upload.leaf_vertices[index as usize]);
            vertices.len() as u32 - 1
        })
    });
    let indices = indices.collect();
    mesh(indices)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, of(&vertices, |vertex| vertex.position))
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, of(&vertices, |vertex| vertex.normal))
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, of(&vertices, |vertex| vertex.uv))
        .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, of(&vertices, |vertex| rgba(vertex.color)))
        .with_inserted_attribute(ATTRIBUTE_LEAF, of(&vertices, |vertex| vertex.leaf))
}

fn mesh(indices: Vec<u32>) -> Mesh {
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
        .with_inserted_indices(Indices::U32(indices))
}

fn of<V, T>(vertices: &[V], part: impl Fn(&V) -> T) -> Vec<T> {
    vertices.iter().map(part).collect()
}

fn rgba([red, green, blue]: [f32; 3]) -> [f32; 4] {
    [red, green, blue, 1.0]
}

/// The wood at errors that double; in full only, without an order.
fn wood(model: &FoliageModel, materials: &[[Handle<FoliageMaterial>; 2]], store: &mut impl Store) -> Vec<WoodRung> {
    let center = model.sphere().center().as_vec3().to_array();
    let mut triangles: Vec<([u32; 3], u32)> = Vec::new();
    for part in &model.wood.parts {
        let corners = model.wood.indices[part.indices[0] as usize..part.indices[1] as usize].chunks_exact(3);
        triangles.extend(corners.map(|of| ([of[0], of[1], of[2]], part.material)));
    }
    if triangles.is_empty() {
        return Vec::new();
    }
    let levels = model.wood_order.as_ref().map(|order| WoodLevels::new(&model.wood, order));
    let stem = |vertex: u32| levels.as_ref().map_or(0, |levels| levels.vertex_stems[vertex as usize]);
    let numbers: Vec<u32> = (0..model.wood.vertices.len() as u32).collect();
    let mut of_materials: Vec<u32> = triangles.iter().map(|triangle| triangle.1).collect();
    of_materials.sort_unstable();
    of_materials.dedup();
    let mut rungs: Vec<WoodRung> = Vec::new();
    let mut put = |error: f32, vertices: &[Vertex], numbers: &[u32], triangles: &[([u32; 3], u32)]| {
        let mut count = 0;
        let part = |(number, &material): (usize, &u32)| {
            let own = triangles.iter().filter(|triangle| triangle.1 == material).flat_map(|triangle| triangle.0);
            let own: Vec<u32> = own.collect();
            if let (true, Some(last)) = (own.is_empty(), rungs.last()) {
                return last.parts[number].clone();
            }
            let mesh = wood_mesh(vertices, &own, center, |vertex| stem(numbers[vertex as usize]));
            count += mesh.count_vertices() as u32;
            // Thinned stems are flat triangles, which have a back.
            let sided = &materials[material as usize][usize::from(rungs.is_empty())];
            (sided.clone(), store.put(format!("Wood{material}/{}", rungs.len()), mesh))
        };
        let parts = of_materials.iter().enumerate().map(part).collect();
        rungs.push(WoodRung { error, triangles: triangles.len() as u32, vertices: count, parts });
    };
    put(0.0, &model.wood.vertices, &numbers, &triangles);
    let Some(levels) = &levels else { return rungs };
    let mut last = triangles.len();
    let diameter = 2.0 * model.sphere().radius as f32;
    let mut px = WOOD_PX.end;
    while px >= WOOD_PX.start {
        let error = 0.5 * diameter / px;
        let level = levels.at(error);
        if (level.triangles.len() as f32) < FEWER_TRIANGLES * last as f32 {
            last = level.triangles.len();
            put(error, &level.vertices, &level.numbers, &level.triangles);
        }
        px *= 0.5;
    }
    rungs
}

/// A mesh of some of the wood's triangles.
fn wood_mesh(vertices: &[Vertex], corners: &[u32], center: [f32; 3], stem: impl Fn(u32) -> u32) -> Mesh {
    let mut numbers: HashMap<u32, u32> = HashMap::default();
    let mut own = Vec::new();
    let indices = corners.iter().map(|&corner| {
        *numbers.entry(corner).or_insert_with(|| {
            own.push(corner);
            own.len() as u32 - 1
        })
    });
    let indices = indices.collect();
    let vertex = |&corner: &u32| &vertices[corner as usize];
    let position = |corner: &u32| (Vec3::from(vertex(corner).position) - Vec3::from(center)).to_array();
    let normal = |corner: &u32| Vec3::from(vertex(corner).normal).normalize_or(Vec3::Y).to_array();
    mesh(indices)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, of(&own, position))
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, of(&own, normal))
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, of(&own, |corner| vertex(corner).uv))
        .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, of(&own, |corner| vertex(corner).color))
        .with_inserted_attribute(ATTRIBUTE_STEM, of(&own, |&corner| stem(corner)))
}

/// For each of the model's materials, one whose backs are drawn, and one whose are not unless the
/// model says so.
fn materials(
    model: &FoliageModel,
    upload: &Upload,
    limbs: Option<&Limbs>,
    store: &mut impl Store,
) -> foliage_lod::Result<Vec<[Handle<FoliageMaterial>; 2]>> {
    let leaves = store.put("Leaves".into(), buffer(upload.leaves.clone()));
    let events = store.put("Events".into(), buffer(upload.events.clone()));
    let limbs = store.put("Limbs".into(), limb_image(limbs));
    let surfaces = surfaces(model, store)?;
    let mean = mean_color(model, &surfaces);
    let crown = &upload.crown;
    let both = |(number, material): (usize, &Material)| {
        let base = StandardMaterial {
            base_color: Color::linear_rgb(material.base_color[0], material.base_color[1], material.base_color[2]),
            base_color_texture: surfaces[number].image.clone(),
            alpha_mode: material.cutoff().map_or(AlphaMode::Opaque, AlphaMode::Mask),
            perceptual_roughness: 0.85,
            reflectance: 0.2,
            ..StandardMaterial::default()
        };
        let extension = FoliageExtension {
            leaves: leaves.clone(),
            events: events.clone(),
            plants: PLANTS,
            sways: SWAYS,
            limbs: limbs.clone(),
            crown: Crown {
                center: crown.center_local.into(),
                tone: crown.tone,
                inverse_half_size: crown.inverse_half_size.into(),
                cutoff: surfaces[number].image.as_ref().and(material.texture_cutoff()).unwrap_or(0.0),
                mean,
            },
        };
        let sided = |name: &str, double_sided: bool| {
            let base = StandardMaterial {
                double_sided,
                cull_mode: (!double_sided).then_some(bevy::render::render_resource::Face::Back),
                ..base.clone()
            };
            (format!("{name}{number}"), FoliageMaterial { base, extension: extension.clone() })
        };
        [sided("TwoSided", true), sided("Material", material.double_sided)]
    };
    let materials: Vec<[(String, FoliageMaterial); 2]> = model.materials.iter().enumerate().map(both).collect();
    Ok(materials.into_iter().map(|both| both.map(|(label, material)| store.put(label, material))).collect())
}

fn buffer<T: bytemuck::NoUninit>(records: Vec<T>) -> ShaderBuffer {
    if records.is_empty() {
        // Bindings of no bytes are not allowed.
        return ShaderBuffer::new(vec![0_u32; 64], RenderAssetUsages::RENDER_WORLD);
    }
    ShaderBuffer::new(records, RenderAssetUsages::RENDER_WORLD)
}

fn limb_image(limbs: Option<&Limbs>) -> Image {
    let (texels, [width, height]) = limb_texels(limbs);
    let mut image = Image::new(
        Extent3d { width, height, depth_or_array_layers: 1 },
        TextureDimension::D2,
        bytemuck::cast_slice(&texels).to_vec(),
        TextureFormat::Rgba32Uint,
        RenderAssetUsages::RENDER_WORLD,
    );
    image.sampler = ImageSampler::nearest();
    image
}

/// The texture of a material.
#[derive(Clone)]
struct Surface {
    image: Option<Handle<Image>>,
    /// Mean linear colour of what is opaque of it.
    mean: Vec3A,
}

/// The texture of each material: one for each image, wrap mode and cutoff.
fn surfaces(model: &FoliageModel, store: &mut impl Store) -> foliage_lod::Result<Vec<Surface>> {
    type Key = (u32, [Wrap; 2], Option<u32>);
    let mut made: Vec<(Key, Surface)> = Vec::new();
    let mut of_materials = Vec::new();
    for material in &model.materials {
        let Some(number) = material.texture else {
            of_materials.push(Surface { image: None, mean: Vec3A::ONE });
            continue;
        };
        let cutoff = material.texture_cutoff();
        let key = (number, material.wrap, cutoff.map(f32::to_bits));
        let found = made.iter().find(|(of, _)| *of == key).map(|(_, surface)| surface.clone());
        let surface = match found {
            Some(surface) => surface,
            None => {
                let pixels = model.textures[number as usize].decode()?;
                let mean = mean(&pixels, cutoff);
                let image = Some(store.put(format!("Texture{}", made.len()), image(pixels, material)));
                made.push((key, Surface { image, mean }));
                made[made.len() - 1].1.clone()
            }
        };
        of_materials.push(surface);
    }
    Ok(of_materials)
}

/// Mean colour of the leaves, linear.
fn mean_color(model: &FoliageModel, surfaces: &[Surface]) -> Vec3 {
    let of_leaf = |leaf: &foliage_lod::model::Leaf| {
        let material = leaf.material as usize;
        let base = Vec3A::from_slice(&model.materials[material].base_color) * surfaces[material].mean;
        let corners = &model.vertices[leaf.geometry().vertex_range()];
        corners.iter().map(move |corner| Vec3A::from_slice(&corner.color) * base)
    };
    let (sum, count) = model
        .leaves
        .iter()
        .flat_map(of_leaf)
        .fold((Vec3A::ZERO, 0.0_f32), |(sum, count), color| (sum + color, count + 1.0));
    (sum / count.max(1.0)).into()
}
