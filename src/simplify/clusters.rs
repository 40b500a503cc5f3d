//! Makes the pictures of clusters: for each leaf, as the leaves that it stands for become more, a
//! card for about every four times as many.
//!
//! A card lies where its leaves are, in the plane of the two longer axes of their vertices. Every
//! leaf is laid flat at its place: its longer axis keeps its direction in that plane, and it is not
//! foreshortened, since the card is seen from all sides. (Projected as they stand, leaves lose half
//! of their coverage.) The colour and the normal are the leaves' means, by area.

use super::appearance::{Sampler, Surface};
use crate::{
    Result,
    bounds::Aabb,
    leaf::Vertex,
    material::Material,
    model::{ClusterCard, Clusters, EMPTY, FoliageModel, Leaf, PICTURE_SIDES},
};
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};

/// Fewest leaves of a card.
const LEAST_LEAVES: usize = 4;
/// Growth of the number of leaves from one card to the next.
const PER_CARD: usize = 4;
/// Most steps of a card.
const MOST_STEPS: usize = EMPTY as usize - 1;
/// Texels along each side of a square as large as a leaf, and most texels of a picture.
const PER_LEAF: f64 = 4.0;
const MOST_TEXELS: f64 = 1024.0;
/// Rounds of Jacobi's method, which doubles the number of digits with each.
const ROUNDS: usize = 8;

/// A leaf, ready to be laid flat.
struct Flat<'a> {
    vertices: &'a [Vertex],
    indices: &'a [u32],
    first: u32,
    material: &'a Material,
    surface: Surface,
    /// Directions of its length and width.
    axes: [DVec3; 2],
}

/// The cluster of a leaf, as leaves become fewer.
#[derive(Default, Clone)]
struct Growing {
    /// Leaves of the cluster, in the order in which they joined it.
    members: Vec<u32>,
    /// The leaf with whose removal the current card begins, and how many leaves it began with.
    card: Option<(u32, usize)>,
    /// Number of leaves at each later step.
    steps: Vec<usize>,
}

/// Cards of all leaves that stand for at least four.
///
/// # Errors
/// [`Unreadable`](crate::Error::Unreadable) if a texture cannot be decoded.
pub fn all(model: &FoliageModel) -> Result<Clusters> {
    let maker = Maker::new(model)?;
    let mut growing: Vec<Growing> =
        (0..model.leaves.len() as u32).map(|leaf| Growing { members: vec![leaf], ..Growing::default() }).collect();
    let mut made = Vec::new();
    for (number, leaf) in model.leaves.iter().enumerate().rev() {
        let gone = std::mem::take(&mut growing[number]);
        made.extend(maker.card(number as u32, &gone));
        let Some(target) = leaf.target() else { continue };
        let into = &mut growing[target];
        let (before, after) = (into.members.len(), into.members.len() + gone.members.len());
        let is_over = into.card.is_some_and(|(_, began)| after > PER_CARD * began || into.steps.len() >= MOST_STEPS);
        if is_over {
            made.extend(maker.card(target as u32, into));
        }
        if is_over || into.card.is_none() && after >= LEAST_LEAVES {
            into.card = Some((number as u32, after));
            into.steps.clear();
        } else if into.card.is_some() {
            into.steps.push(before);
        }
        into.members.extend(gone.members);
    }
    made.sort_by_key(|(card, _)| (card.leaf, std::cmp::Reverse(card.first)));
    let (cards, texels): (Vec<_>, Vec<_>) = made.into_iter().unzip();
    Ok(Clusters::new(cards, texels.concat()))
}

struct Maker<'a> {
    sampler: Sampler<'a>,
    leaves: Vec<Flat<'a>>,
    crown: DVec3,
}

impl<'a> Maker<'a> {
    fn new(model: &'a FoliageModel) -> Result<Self> {
        let crown = Aabb::of_points(model.vertices.iter().map(|vertex| vertex.position)).center();
        let sampler = Sampler::new(&model.materials, &model.textures, DVec3::ZERO)?;
        let flat = |leaf: &Leaf| {
            let geometry = leaf.geometry();
            let (vertices, indices) =
                (&model.vertices[geometry.vertex_range()], &model.indices[geometry.index_range()]);
            let places = || vertices.iter().map(|vertex| (Vec3::from(vertex.position).as_dvec3(), 1.0));
            let [long, short, _] = axes(places());
            Flat {
                vertices,
                indices,
                first: leaf.vertices[0],
                material: &model.materials[leaf.material as usize],
                surface: sampler.surface(&model.vertices, indices, leaf.material),
                axes: [long, short],
            }
        };
        let leaves = model.leaves.iter().map(flat).collect();
        Ok(Self { leaves, sampler, crown })
    }

    /// The current card of a leaf's cluster, with its texels.
    fn card(&self, leaf: u32, cluster: &Growing) -> Option<(ClusterCard, Vec<u8>)> {
        let (first, _) = cluster.card?;
        let members = || cluster.members.iter().map(|&member| &self.leaves[member as usize]);
        let weighted = || {
            members().flat_map(|member| {
                let share = member.surface.area / member.vertices.len() as f64;
                member.vertices.iter().map(move |vertex| (Vec3::from(vertex.position).as_dvec3(), share))
            })
        };
        let sum = members().fold(Surface::default(), |sum, member| sum.joined(member.surface));
        if sum.area <= 0.0 {
            return None;
        }
        let middle =
            weighted().map(|(at, share)| at * share).sum::<DVec3>() / weighted().map(|(_, share)| share).sum::<f64>();
        let [right, up, _] = axes(weighted());
        let flat: Vec<Vec<DVec2>> = members().map(|member| member.laid(middle, [right, up])).collect();
        let points = || flat.iter().flatten().copied();
        let low = points().fold(DVec2::INFINITY, DVec2::min);
        let high = points().fold(DVec2::NEG_INFINITY, DVec2::max);
        let extent = high - low;
        let texel = (sum.area / cluster.members.len() as f64).sqrt() / PER_LEAF;
        let texel = texel.max((extent.x * extent.y / MOST_TEXELS).sqrt()).max(extent.max_element() / 62.0);
        // A margin of one texel around the leaves.
        let texels = |length: f64, multiple: u32| {
            ((length / texel).ceil() as u32 + 2).next_multiple_of(multiple).min(PICTURE_SIDES[0])
        };
        let size = [texels(extent.x, PICTURE_SIDES[1]), texels(extent.y, 1)];
        let [width, height] = size.map(f64::from);
        let half = extent * 0.5 * DVec2::new(width / (width - 2.0), height / (height - 2.0));
        let center = (low + high) * 0.5;
        let mut texels = vec![EMPTY; (size[0] * size[1]) as usize];
        for (number, (member, points)) in members().zip(&flat).enumerate() {
            let step = cluster.steps.partition_point(|&before| before <= number) as u8;
            let texel = |at: DVec2| (at - center + half) / (2.0 * half) * DVec2::new(width, height);
            let points: Vec<DVec2> = points.iter().map(|&at| texel(at)).collect();
            self.paint(member, &points, step, &mut texels, size.map(|side| side as usize));
        }
        let normals = members().map(|member| {
            let normal = member.surface.normal.normalize_or_zero() * member.surface.area as f32;
            let outwards = (member.surface.center - self.crown).as_vec3();
            if normal.dot(outwards) < 0.0 { -normal } else { normal }
        });
        let normal = normals.sum::<Vec3>() / sum.area as f32;
        let card = ClusterCard {
            leaf,
            first,
            size,
            center: (middle + right * center.x + up * center.y).as_vec3().to_array(),
            half_sides: [(right * half.x).as_vec3().to_array(), (up * half.y).as_vec3().to_array()],
            normal: normal.normalize_or(Vec3::Y).to_array(),
            kept: normal.length().min(1.0),
            color: sum.albedo.max(Vec3::ZERO).to_array(),
        };
        Some((card, texels))
    }

    /// Marks the texels whose middle a leaf covers, unless an earlier step does.
    fn paint(&self, leaf: &Flat<'_>, points: &[DVec2], step: u8, texels: &mut [u8], [width, height]: [usize; 2]) {
        for triangle in leaf.indices.as_chunks::<3>().0 {
            let local = triangle.map(|index| (index - leaf.first) as usize);
            let [a, b, c] = local.map(|at| points[at]);
            let uvs = local.map(|at| Vec2::from(leaf.vertices[at].uv));
            let whole = (b - a).perp_dot(c - a);
            if whole == 0.0 {
                continue;
            }
            let range = |low: f64, high: f64, end: usize| {
                (low.floor().max(0.0) as usize)..((high.ceil().max(0.0) as usize).min(end))
            };
            for y in range(a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y), height) {
                for x in range(a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x), width) {
                    let at = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                    let shares = [(c - b).perp_dot(at - b), (a - c).perp_dot(at - c), (b - a).perp_dot(at - a)];
                    let shares = shares.map(|share| share / whole);
                    let texel = &mut texels[y * width + x];
                    if shares.iter().all(|share| *share >= 0.0) && step < *texel {
                        let uv = (0..3).map(|i| uvs[i] * shares[i] as f32).sum();
                        let (_, alpha) = self.sampler.texel(leaf.material, uv);
                        let opacity = leaf.material.base_color[3];
                        if leaf.material.cutoff().is_none_or(|cutoff| alpha * opacity >= cutoff) {
                            *texel = step;
                        }
                    }
                }
            }
        }
    }
}

impl Flat<'_> {
    /// Its vertices, laid flat in a plane through `origin`.
    fn laid(&self, origin: DVec3, plane: [DVec3; 2]) -> Vec<DVec2> {
        let on_plane = |v: DVec3| DVec2::new(v.dot(plane[0]), v.dot(plane[1]));
        let place = on_plane(self.surface.center - origin);
        let [long, short] = self.axes;
        let along = on_plane(long).normalize_or(DVec2::X);
        let across = if on_plane(short).dot(along.perp()) < 0.0 { -along.perp() } else { along.perp() };
        let laid = |vertex: &Vertex| {
            let offset = Vec3::from(vertex.position).as_dvec3() - self.surface.center;
            place + along * offset.dot(long) + across * offset.dot(short)
        };
        self.vertices.iter().map(laid).collect()
    }
}

/// Principal axes of weighted points, from the longest: eigenvectors of their covariance, by
/// Jacobi's method.
fn axes(points: impl Iterator<Item = (DVec3, f64)> + Clone) -> [DVec3; 3] {
    let (sum, weight) =
        points.clone().fold((DVec3::ZERO, 0.0), |(sum, all), (at, share)| (sum + at * share, all + share));
    let mean = sum / weight;
    let mut matrix = points.fold([[0.0; 3]; 3], |mut matrix, (at, share)| {
        let offset = (at - mean).to_array();
        (0..9).for_each(|i| matrix[i / 3][i % 3] += share * offset[i / 3] * offset[i % 3]);
        matrix
    });
    let mut vectors = DMat3::IDENTITY.to_cols_array_2d();
    for _ in 0..ROUNDS {
        for [p, q] in [[0, 1], [0, 2], [1, 2]] {
            let off = matrix[p][q];
            if off == 0.0 {
                continue;
            }
            let theta: f64 = (matrix[q][q] - matrix[p][p]) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let cos = 1.0 / (t * t + 1.0).sqrt();
            let sin = t * cos;
            for row in &mut matrix {
                let [a, b] = [row[p], row[q]];
                (row[p], row[q]) = (cos * a - sin * b, sin * a + cos * b);
            }
            for k in 0..3 {
                let [a, b] = [matrix[p][k], matrix[q][k]];
                (matrix[p][k], matrix[q][k]) = (cos * a - sin * b, sin * a + cos * b);
                let [a, b] = [vectors[p][k], vectors[q][k]];
                (vectors[p][k], vectors[q][k]) = (cos * a - sin * b, sin * a + cos * b);
            }
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&a: &usize, &b: &usize| matrix[b][b].total_cmp(&matrix[a][a]));
    order.map(|i| DVec3::from(vectors[i]))
}
