//! Leaves that show several pictures, as triangles that show one each.

use crate::{
    leaf::Vertex,
    plant::{Cell, Tiling},
};
use glam::{Vec2, Vec3, Vec4};

/// Distance of equal vertices, as a part of the leaf's size and of the texture's.
const EQUAL: f32 = 1e-5;

/// Vertices and triangles of a leaf whose cards are cut where one picture ends and the next begins.
pub(super) fn tiled(vertices: &[Vertex], indices: &[u32], tiling: &Tiling) -> (Vec<Vertex>, Vec<u32>) {
    let (mut kept, mut triangles): (Vec<Vertex>, Vec<u32>) = (Vec::new(), Vec::new());
    let first = vertices.first().map_or(Vec3::ZERO, |vertex| vertex.position.into());
    let reach = vertices.iter().map(|vertex| first.distance(vertex.position.into())).fold(0.0, f32::max);
    for cell in tiling.cells() {
        for triangle in indices.chunks_exact(3) {
            let mut polygon: Vec<Vertex> = triangle.iter().map(|&corner| vertices[corner as usize]).collect();
            for (axis, end) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                polygon = cut(&polygon, axis, cell.ends[end][axis], end == 1);
            }
            let numbers: Vec<u32> =
                polygon.iter().map(|corner| number(&mut kept, shown(corner, &cell), EQUAL * reach)).collect();
            for i in 2..numbers.len() {
                let corners = [numbers[0], numbers[i - 1], numbers[i]];
                if corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0] {
                    triangles.extend(corners);
                }
            }
        }
    }
    (kept, triangles)
}

/// The part of a polygon with texture coordinates of at least, or at most, `end` along an axis.
fn cut(polygon: &[Vertex], axis: usize, end: f32, is_most: bool) -> Vec<Vertex> {
    let beyond = |corner: &Vertex| if is_most { corner.uv[axis] - end } else { end - corner.uv[axis] };
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, corner) in polygon.iter().enumerate() {
        let last = &polygon[(i + polygon.len() - 1) % polygon.len()];
        let [before, now] = [beyond(last), beyond(corner)];
        if (before > 0.0 && now < 0.0) || (before < 0.0 && now > 0.0) {
            // From the inner one, so that neighbours get the same point.
            let (inner, outer) = if before < 0.0 { (last, corner) } else { (corner, last) };
            let mut point = mixed(inner, outer, beyond(inner) / (beyond(inner) - beyond(outer)));
            point.uv[axis] = end;
            kept.push(point);
        }
        if now <= 0.0 {
            kept.push(*corner);
        }
    }
    kept
}

fn mixed(a: &Vertex, b: &Vertex, part: f32) -> Vertex {
    let of = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).lerp(b.into(), part).to_array();
    let uv = [0, 1].map(|axis| a.uv[axis] + part * (b.uv[axis] - a.uv[axis]));
    let color = Vec4::from(a.color).lerp(b.color.into(), part).to_array();
    Vertex { position: of(a.position, b.position), normal: of(a.normal, b.normal), uv, color }
}

/// A corner with the texture coordinates that its cell shows there.
fn shown(corner: &Vertex, cell: &Cell) -> Vertex {
    let uv = [0, 1].map(|axis| {
        let [low, high] = cell.ends.map(|end| end[axis]);
        let [from, to] = cell.shown.map(|end| end[axis]);
        from + (to - from) * ((corner.uv[axis] - low) / (high - low)).clamp(0.0, 1.0)
    });
    Vertex { uv, ..*corner }
}

/// The number of a vertex among those that are kept. Neighbours compute a common one differently.
fn number(kept: &mut Vec<Vertex>, vertex: Vertex, near: f32) -> u32 {
    let is_same = |known: &Vertex| {
        let uvs = [known.uv, vertex.uv].map(Vec2::from);
        let normals = [known.normal, vertex.normal].map(Vec3::from);
        let is_near = Vec3::from(known.position).distance(vertex.position.into()) <= near;
        is_near && uvs[0].distance(uvs[1]) <= EQUAL && normals[0].distance(normals[1]) <= EQUAL
    };
    let known = kept.iter().position(is_same);
    known.unwrap_or_else(|| {
        kept.push(vertex);
        kept.len() - 1
    }) as u32
}
