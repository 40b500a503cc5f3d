//! Converts strips and fans to triangle lists.

use ::gltf::json::mesh::Mode;

/// Three indices per triangle, or `None` for points and lines. Left-over indices are dropped, as
/// are triangles of a strip or fan that use a vertex twice, which only stitch.
pub(super) fn triangle_list(mode: Mode, mut indices: Vec<u32>) -> Option<Vec<u32>> {
    match mode {
        Mode::Triangles => {
            indices.truncate(indices.len() / 3 * 3);
            Some(indices)
        }
        Mode::TriangleStrip => {
            let turned = |(i, corners): (usize, &[u32])| match (i % 2, corners) {
                (0, &[a, b, c]) => [a, b, c],
                (_, corners) => [corners[1], corners[0], corners[2]],
            };
            Some(without_stitches(indices.windows(3).enumerate().map(turned)))
        }
        Mode::TriangleFan => {
            let hub = indices.first().copied().unwrap_or_default();
            let rim = indices.get(1..).unwrap_or_default();
            Some(without_stitches(rim.windows(2).map(|edge| [hub, edge[0], edge[1]])))
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => None,
    }
}

fn without_stitches(triangles: impl Iterator<Item = [u32; 3]>) -> Vec<u32> {
    triangles.filter(|[a, b, c]| a != b && b != c && c != a).flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strip_keeps_its_winding_and_loses_its_stitches() {
        let list = triangle_list(Mode::TriangleStrip, vec![0, 1, 2, 3, 3, 4, 4, 5, 6]);
        assert_eq!(list.unwrap(), [0, 1, 2, 2, 1, 3, 4, 5, 6]);
    }

    #[test]
    fn fan_turns_about_its_first_vertex() {
        assert_eq!(triangle_list(Mode::TriangleFan, vec![7, 1, 2, 3]).unwrap(), [7, 1, 2, 7, 2, 3]);
        assert!(triangle_list(Mode::TriangleFan, vec![]).unwrap().is_empty());
    }

    #[test]
    fn lines_and_points_are_no_triangles() {
        assert_eq!(triangle_list(Mode::Lines, vec![0, 1]), None);
        assert_eq!(triangle_list(Mode::Points, vec![0]), None);
    }
}
