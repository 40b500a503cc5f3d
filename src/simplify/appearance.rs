//! Looks of polygons, for comparing views with the full plant's.
//!
//! Every polygon has one look in each view. The difference between two looks is the sum of squares
//! of their channel differences; the difference between a polygon and the background is constant.
//! There are two sets of looks:
//!
//! - *silhouette*: all polygons look the same and differ from the background by 1, so that only
//!   coverage counts;
//! - *image*: colour and light, where a polygon and the background differ by [`COVERAGE`]. The suns
//!   that will light a model are not known, so no direction is favoured: three channels hold the
//!   colour under even light, darker inside the crown as everywhere in this crate, and three hold
//!   the normal that faces the view, scaled by how much light from one side makes the colour vary.
//!   For a sun in an unknown direction, the squared difference of two surfaces follows the squared
//!   difference of these channels.
//!
//! All numbers come from operations that round the same way on every machine, and channels are
//! integers, so differences add up exactly in any order.
//!
//! Limits: each leaf has a single colour, the mean of its texels; all wood shares one.

use super::{
    change::Gain,
    outline::beyond,
    views::{CAMERA_DISTANCE, ViewSet},
};
use crate::{
    Result,
    bounds::Aabb,
    crown::openness,
    leaf::Vertex,
    material::{Material, Pixels, Texture, Wrap},
    plant::Plant,
    srgb::{encoded, linear_bytes},
};
use glam::{DVec3, Vec2, Vec3};

/// Difference between a polygon and the background: the same as between middle grey and black or
/// white.
pub const COVERAGE: i64 = 3 * 128 * 128;
/// Length of a white surface's normal in channel steps. The sun makes a channel vary by about a
/// third of it in either direction.
const NORMAL_LENGTH: f32 = 128.0;
/// Number of colour samples along each side of a triangle.
const SAMPLES: u32 = 6;

/// Look of a polygon: red, green and blue (sRGB-encoded), then the normal's x, y and z offset by
/// 128, then two unused bytes.
pub type Look = [u8; 8];

/// Look of a pale sky, which faces nowhere.
const SKY: Look = [220, 230, 240, 128, 128, 128, 0, 0];

/// Looks of all polygons in all views.
#[derive(Debug, Clone, PartialEq)]
pub struct Appearance {
    leaves: u32,
    /// Look of `row` in `view` at index `view * (leaves + 2) + row`; rows are as in
    /// [`Areas`](super::areas::Areas).
    looks: Vec<Look>,
    /// Difference between a polygon and the background.
    coverage: i64,
}

/// Looks of all polygons in one view.
#[derive(Debug, Clone, Copy)]
pub struct ViewLook<'a> {
    background: u32,
    looks: &'a [Look],
    coverage: i64,
}

impl ViewLook<'_> {
    /// Whether a row is that of the background.
    pub fn is_background(&self, row: u32) -> bool {
        row == self.background
    }

    /// Look of a row; of the background, that of a pale sky.
    pub fn before_sky(&self, row: u32) -> Look {
        if row == self.background { SKY } else { self.looks[row as usize] }
    }

    /// Difference between the looks of two rows; 0 or more.
    pub fn difference(&self, a: u32, b: u32) -> i64 {
        if a == b {
            0
        } else if a == self.background || b == self.background {
            self.coverage
        } else {
            let [a, b] = [a, b].map(|row| self.looks[row as usize]);
            let squares = (0..8).map(|i| (i32::from(a[i]) - i32::from(b[i])).pow(2));
            i64::from(squares.sum::<i32>())
        }
    }
}

impl ViewLook<'_> {
    /// Gain of one pixel when polygon `after` replaces polygon `before`. `reference` is the
    /// frontmost polygon at full detail, or the row [`beyond`].
    pub fn gain(&self, before: u32, after: u32, reference: u32) -> Gain {
        if before == after {
            return Gain::default();
        }
        let is_beyond = reference == beyond(self.background);
        let reference = if is_beyond { self.background } else { reference };
        let closer = self.difference(before, reference) - self.difference(after, reference);
        let covered = i64::from(before == self.background) - i64::from(after == self.background);
        let [within, beyond] = if is_beyond { [0, covered] } else { [covered, 0] };
        Gain { closer, within, beyond }
    }
}

impl Appearance {
    /// Creates looks for silhouettes: only coverage counts, 1 per pixel.
    pub fn silhouette(leaves: usize, views: usize) -> Self {
        Self { leaves: leaves as u32, looks: vec![[0; 8]; (leaves + 2) * views], coverage: 1 }
    }

    /// Creates looks for images: colour, light and coverage.
    ///
    /// # Errors
    /// [`Unreadable`](crate::Error::Unreadable) if a texture cannot be decoded.
    pub fn image(plant: &Plant, views: &ViewSet) -> Result<Self> {
        let sampler = Sampler::new(&plant.materials, &plant.textures, views.center())?;
        let leaves: Vec<Surface> = plant
            .leaves
            .iter()
            .map(|leaf| {
                let indices = &plant.indices[leaf.index_range()];
                sampler.surface(&plant.vertices, indices, leaf.material)
            })
            .collect();
        let wood = plant.wood.parts.iter().fold(Surface::default(), |sum, part| {
            let indices = &plant.wood.indices[part.indices[0] as usize..part.indices[1] as usize];
            sum.joined(sampler.surface(&plant.wood.vertices, indices, part.material))
        });
        let crown = Aabb::of_points(plant.vertices.iter().map(|vertex| vertex.position));
        let crown_center = crown.center() - views.center();
        let half_size = (crown.size() * 0.5).max(Vec3::splat(f32::MIN_POSITIVE));
        let mut looks = Vec::with_capacity((leaves.len() + 2) * views.views.len());
        for view in &views.views {
            looks.extend(leaves.iter().map(|leaf| {
                let in_crown = (leaf.center - crown_center).as_vec3() / half_size;
                let to_eye = view.toward * CAMERA_DISTANCE - leaf.center * views.unit_length(1.0);
                leaf.look(openness(in_crown.length()), to_eye.as_vec3())
            }));
            looks.push([0; 8]);
            looks.push(Surface { normal: Vec3::ZERO, ..wood }.look(1.0, Vec3::ZERO));
        }
        Ok(Self { leaves: leaves.len() as u32, looks, coverage: COVERAGE })
    }

    /// Difference between a polygon and the background.
    pub fn coverage(&self) -> i64 {
        self.coverage
    }

    /// The looks in some of the views, in this order.
    pub fn of_views(&self, views: &[usize]) -> Self {
        let looks = views.iter().flat_map(|&view| self.view(view).looks).copied().collect();
        Self { looks, ..*self }
    }

    /// Looks in one view.
    pub fn view(&self, view: usize) -> ViewLook<'_> {
        let rows = self.leaves as usize + 2;
        ViewLook { background: self.leaves, looks: &self.looks[view * rows..][..rows], coverage: self.coverage }
    }
}

/// Area-weighted properties of a surface.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Surface {
    pub(super) area: f64,
    /// Mean position relative to the centre of the views, which keeps precision far from the
    /// origin.
    pub(super) center: DVec3,
    /// Mean linear colour.
    pub(super) albedo: Vec3,
    pub(super) normal: Vec3,
}

impl Surface {
    /// Combines two surfaces.
    pub(super) fn joined(self, other: Self) -> Self {
        let area = self.area + other.area;
        let share = if area > 0.0 { (other.area / area) as f32 } else { 1.0 };
        Self {
            area,
            center: self.center.lerp(other.center, share.into()),
            albedo: self.albedo.lerp(other.albedo, share),
            normal: self.normal + other.normal,
        }
    }

    fn look(&self, light: f32, to_eye: Vec3) -> Look {
        let color = (self.albedo * light).to_array().map(encoded);
        let brightness = (color[0] + color[1] + color[2]) / 3.0;
        let facing = if self.normal.dot(to_eye) < 0.0 { -self.normal } else { self.normal };
        let tilt = facing.normalize_or_zero() * (brightness * NORMAL_LENGTH);
        let [r, g, b] = color.map(|c| (c * 255.0).round() as u8);
        let [x, y, z] = tilt.to_array().map(|c| (128.0 + c).round() as u8);
        [r, g, b, x, y, z, 0, 0]
    }
}

/// Materials with their decoded textures.
pub(super) struct Sampler<'a> {
    materials: &'a [Material],
    textures: Vec<Option<Pixels>>,
    /// Linear value of each sRGB byte.
    decoded: [f32; 256],
    /// Origin of the centres of surfaces.
    origin: DVec3,
}

impl<'a> Sampler<'a> {
    pub(super) fn new(materials: &'a [Material], textures: &[Texture], origin: DVec3) -> Result<Self> {
        let used = |index: usize| materials.iter().any(|material| material.texture == Some(index as u32));
        let decode = |(index, texture): (usize, &Texture)| used(index).then(|| texture.decode()).transpose();
        Ok(Self {
            materials,
            textures: textures.iter().enumerate().map(decode).collect::<Result<_>>()?,
            decoded: linear_bytes(),
            origin,
        })
    }

    pub(super) fn surface(&self, vertices: &[Vertex], indices: &[u32], material: u32) -> Surface {
        let material = &self.materials[material as usize];
        let triangles = indices
            .chunks_exact(3)
            .map(|corners| self.triangle([0, 1, 2].map(|i| &vertices[corners[i] as usize]), material));
        triangles.fold(Surface::default(), Surface::joined)
    }

    fn triangle(&self, corners: [&Vertex; 3], material: &Material) -> Surface {
        let [a, b, c] = corners.map(|corner| Vec3::from(corner.position).as_dvec3() - self.origin);
        let area = (b - a).cross(c - a).length_squared().sqrt() * 0.5;
        let normal = corners.iter().map(|corner| Vec3::from(corner.normal)).sum::<Vec3>().normalize_or_zero();
        let (mut covered, mut all) = ((Vec3::ZERO, 0.0), (Vec3::ZERO, 0.0));
        for weights in barycentric() {
            let mix = |of: fn(&Vertex) -> Vec3| (0..3).map(|i| of(corners[i]) * weights[i]).sum::<Vec3>();
            let uv = mix(|corner| Vec2::from(corner.uv).extend(0.0)).truncate();
            let (texel, alpha) = self.texel(material, uv);
            let [r, g, b, opacity] = material.base_color;
            let albedo = texel * Vec3::new(r, g, b) * mix(|corner| Vec3::from_slice(&corner.color));
            let counts = material.cutoff().is_none_or(|cutoff| alpha * opacity >= cutoff);
            for sum in if counts { vec![&mut covered, &mut all] } else { vec![&mut all] } {
                sum.0 += albedo;
                sum.1 += 1.0;
            }
        }
        let (sum, count) = if covered.1 > 0.0 { covered } else { all };
        Surface { area, center: (a + b + c) / 3.0, albedo: sum / count, normal: normal * area as f32 }
    }

    /// Linear colour and alpha of the nearest texel; opaque white if there is no texture.
    pub(super) fn texel(&self, material: &Material, uv: Vec2) -> (Vec3, f32) {
        let Some(pixels) = material.texture.and_then(|texture| self.textures[texture as usize].as_ref()) else {
            return (Vec3::ONE, 1.0);
        };
        let [x, y] = [(uv.x, pixels.width, 0), (uv.y, pixels.height, 1)]
            .map(|(coordinate, size, axis)| cell(coordinate, size, material.wrap[axis]));
        let texel = &pixels.rgba[(y * pixels.width as usize + x) * 4..][..4];
        let color = Vec3::from([0, 1, 2].map(|i| self.decoded[texel[i] as usize]));
        (color, f32::from(texel[3]) / 255.0)
    }
}

/// Barycentric weights of a triangle's samples.
fn barycentric() -> impl Iterator<Item = [f32; 3]> {
    let at = |i: u32| (i as f32 + 1.0 / 3.0) / SAMPLES as f32;
    (0..SAMPLES).flat_map(move |i| (0..SAMPLES - i).map(move |j| [at(i), at(j), 1.0 - at(i) - at(j)]))
}

/// Index along one axis of the texel at a texture coordinate.
fn cell(coordinate: f32, size: u32, wrap: Wrap) -> usize {
    let at = match wrap {
        Wrap::Clamp => coordinate,
        Wrap::Repeat => coordinate - coordinate.floor(),
        Wrap::Mirror => 1.0 - ((coordinate * 0.5 - (coordinate * 0.5).floor()) * 2.0 - 1.0).abs(),
    };
    ((at * size as f32) as usize).min(size as usize - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertex(position: [f32; 3], normal: [f32; 3], shade: f32) -> Vertex {
        Vertex { position, normal, uv: [0.0; 2], color: [shade, shade, shade, 1.0] }
    }

    /// Four small triangles around the origin, perpendicular to X: two of the same colour with
    /// opposite normals, a dark one, and one in the middle of the crown.
    fn plant() -> Plant {
        let mut plant = Plant { materials: vec![Material::default()], ..Plant::default() };
        for (place, normal, shade) in [
            ([0.0, 1.0, 1.0], 1.0, 0.5),
            ([0.0, 1.0, -1.0], -1.0, 0.5),
            ([0.0, -1.0, 1.0], 1.0, 0.1),
            ([0.0; 3], 1.0, 0.5),
        ] {
            let corners = [[0.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]
                .map(|corner| [0, 1, 2].map(|axis| corner[axis] + place[axis]));
            let vertices = corners.map(|corner| vertex(corner, [normal, 0.0, 0.0], shade));
            plant.push_leaf(&vertices, &[0, 1, 2], place, 0);
        }
        plant
    }

    #[test]
    fn a_look_tells_colour_light_and_the_side_that_faces_the_view() {
        let plant = plant();
        let views = ViewSet::new(plant.sphere(), 16, 6).unwrap();
        let appearance = Appearance::image(&plant, &views).unwrap();
        let from = |direction: DVec3| views.views.iter().position(|view| view.toward.dot(direction) > 0.999).unwrap();
        let look = appearance.view(from(DVec3::X));
        // sRGB of 0.5 is 188, and half of 188 is 94.
        assert_eq!(look.looks[0], [188, 188, 188, 128 + 94, 128, 128, 0, 0]);
        assert_eq!(look.looks[1], look.looks[0], "a leaf looks the same from both sides");
        assert_eq!(appearance.view(from(DVec3::NEG_X)).looks[0][3], 128 - 94);
        assert_eq!(look.looks[2][0], 89);
        assert!(look.looks[3][0] < 130, "dark within the crown: {:?}", look.looks[3]);
        let channels = 3 * (188 - 89_i64).pow(2) + (94 - 45_i64).pow(2);
        assert_eq!(look.difference(0, 2), channels);
        assert_eq!([look.difference(0, 4), look.difference(4, 5), look.difference(0, 0)], [COVERAGE, COVERAGE, 0]);
    }

    #[test]
    fn in_silhouettes_only_coverage_counts() {
        let appearance = Appearance::silhouette(3, 2);
        let look = appearance.view(1);
        assert_eq!([look.difference(0, 2), look.difference(0, 4), look.difference(3, 4)], [0, 0, 1]);
        assert_eq!(look.gain(3, 1, 0), Gain { closer: 1, within: 1, beyond: 0 });
        assert_eq!(look.gain(1, 3, 3), Gain { closer: 1, within: -1, beyond: 0 });
        assert_eq!(look.gain(3, 1, beyond(3)), Gain { closer: -1, within: 0, beyond: 1 });
    }

    #[test]
    fn only_texels_that_cover_give_their_colour() {
        // Left half red and opaque, right half white and transparent.
        let mut png = Vec::new();
        let texel = |x: u32| image::Rgba(if x < 4 { [255, 0, 0, 255] } else { [255, 255, 255, 0] });
        let image = image::RgbaImage::from_fn(8, 8, |x, _| texel(x));
        image.write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
        let mut plant = plant();
        plant.textures = vec![Texture { name: String::new(), format: crate::material::TextureFormat::Png, bytes: png }];
        let alpha_mode = crate::material::AlphaMode::Mask;
        plant.materials = vec![Material { texture: Some(0), alpha_mode, ..Material::default() }];
        for (i, vertex) in plant.vertices.iter_mut().enumerate() {
            vertex.uv = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][i % 3];
            vertex.color = [1.0; 4];
        }
        let sampler = Sampler::new(&plant.materials, &plant.textures, DVec3::ZERO).unwrap();
        assert_eq!(sampler.surface(&plant.vertices, &plant.indices[..3], 0).albedo, Vec3::new(1.0, 0.0, 0.0));
    }
}
