//! The oak's crown is dense: many of its leaves are hidden by others from all sides, which is what
//! makes pruning effective.
#![cfg(feature = "simplify")]

use foliage_lod::{
    Plant,
    grow::{GrowOptions, Species, grow},
    leaf::Vertex,
    material::Pixels,
};
use glam::Vec3;

/// Width and height of each view in pixels.
const RESOLUTION: usize = 256;
/// Id of wood in a view.
const WOOD: u32 = u32::MAX - 1;
/// Id of the background in a view.
const NOTHING: u32 = u32::MAX;

/// An orthographic view with a depth buffer, written for this test only: alpha comes from the
/// nearest texel, unfiltered.
struct View {
    axes: [Vec3; 3],
    center: Vec3,
    pixels_per_unit: f32,
    front: Vec<(f32, u32)>,
}

impl View {
    fn new(plant: &Plant, direction: Vec3) -> Self {
        let sphere = plant.sphere();
        let toward_viewer = direction.normalize();
        let right = toward_viewer.any_orthonormal_vector();
        let axes = [right, toward_viewer.cross(right), toward_viewer];
        let pixels_per_unit = RESOLUTION as f32 / (2.0 * sphere.radius as f32);
        let front = vec![(f32::MIN, NOTHING); RESOLUTION * RESOLUTION];
        Self { axes, center: sphere.center().as_vec3(), pixels_per_unit, front }
    }

    fn draw(&mut self, corners: [Vertex; 3], id: u32, alpha: Option<&Pixels>) {
        let half = 0.5 * RESOLUTION as f32;
        let [a, b, c] = corners.map(|corner| {
            let p = (Vec3::from(corner.position) - self.center) * self.pixels_per_unit;
            Vec3::new(half + p.dot(self.axes[0]), half + p.dot(self.axes[1]), p.dot(self.axes[2]))
        });
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        let (low, high) = (a.min(b).min(c).max(Vec3::ZERO), a.max(b).max(c));
        for y in low.y as usize..=(high.y as usize).min(RESOLUTION - 1) {
            for x in low.x as usize..=(high.x as usize).min(RESOLUTION - 1) {
                let p = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 0.0);
                let wb = (p - a).truncate().perp_dot((c - a).truncate()) / area;
                let wc = (b - a).truncate().perp_dot((p - a).truncate()) / area;
                let weights = [1.0 - wb - wc, wb, wc];
                let depth = Vec3::from(weights).dot(Vec3::new(a.z, b.z, c.z));
                let pixel = &mut self.front[y * RESOLUTION + x];
                let inside = weights.iter().all(|&w| w >= 0.0) && depth > pixel.0;
                if inside && alpha.is_none_or(|pixels| covers(pixels, &corners, weights)) {
                    *pixel = (depth, id);
                }
            }
        }
    }
}

fn covers(pixels: &Pixels, corners: &[Vertex; 3], weights: [f32; 3]) -> bool {
    let at = |axis: usize| (0..3).map(|i| corners[i].uv[axis] * weights[i]).sum::<f32>();
    let texel = |value: f32, size: u32| ((value * size as f32) as usize).min(size as usize - 1);
    let (x, y) = (texel(at(0), pixels.width), texel(at(1), pixels.height));
    pixels.rgba[4 * (y * pixels.width as usize + x) + 3] >= 128
}

/// The vertices of a dodecahedron.
fn directions() -> Vec<Vec3> {
    let golden = 0.5 * (1.0 + 5_f32.sqrt());
    let signs = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)];
    let on_edges = signs.map(|(s, t)| Vec3::new(0.0, s / golden, t * golden));
    let corners = signs.iter().flat_map(|&(s, t)| [Vec3::new(s, t, 1.0), Vec3::new(s, t, -1.0)]);
    on_edges.iter().flat_map(|p| [*p, Vec3::new(p.y, p.z, p.x), Vec3::new(p.z, p.x, p.y)]).chain(corners).collect()
}

#[test]
fn a_fifth_of_the_oaks_leaves_is_seen_by_none_of_twenty_views() {
    let plant = grow(&Species::embedded("english-oak").unwrap(), &GrowOptions::default()).unwrap();
    let alpha = plant.textures[0].decode().unwrap();
    let mut seen = vec![false; plant.leaves.len()];
    for direction in directions() {
        let mut view = View::new(&plant, direction);
        for triangle in plant.wood.indices.chunks(3) {
            view.draw([0, 1, 2].map(|i| plant.wood.vertices[triangle[i] as usize]), WOOD, None);
        }
        for (leaf, triangle) in plant.indices.chunks(3).enumerate().map(|(i, triangle)| (i / 2, triangle)) {
            view.draw([0, 1, 2].map(|i| plant.vertices[triangle[i] as usize]), leaf as u32, Some(&alpha));
        }
        view.front.iter().filter(|pixel| pixel.1 < WOOD).for_each(|pixel| seen[pixel.1 as usize] = true);
    }
    let hidden = seen.iter().filter(|&&seen| !seen).count() as f32 / seen.len() as f32;
    assert!((0.2..0.6).contains(&hidden), "{hidden} of the leaves are hidden");
}
