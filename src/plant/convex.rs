//! Convex polygons in a plane, their corners in order from the first axis towards the second.

/// A point of the plane.
pub(crate) type Point = [f64; 2];

/// Twice the signed area of a triangle; positive from the first axis towards the second.
pub(crate) fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Area of a convex polygon.
#[cfg(any(test, feature = "simplify"))]
pub(crate) fn area(corners: &[Point]) -> f64 {
    let Some((&first, rest)) = corners.split_first() else { return 0.0 };
    0.5 * rest.windows(2).map(|pair| turn(first, pair[0], pair[1])).sum::<f64>()
}

/// Whether every turn, and every triangle with the first corner, goes the same way round.
pub(crate) fn is_convex(corners: &[Point]) -> bool {
    let at = |i: usize| corners[i % corners.len()];
    let turns = (0..corners.len()).all(|i| turn(at(i), at(i + 1), at(i + 2)) >= 0.0);
    let fan = (1..corners.len().saturating_sub(1)).all(|i| turn(at(0), at(i), at(i + 1)) >= 0.0);
    turns && fan
}

/// Corners of the convex hull, without those on its edges: A. M. Andrew, *Another efficient
/// algorithm for convex hulls in two dimensions* (1979).
pub(crate) fn hull(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    let chain = |points: &mut dyn Iterator<Item = &Point>| {
        let mut kept: Vec<Point> = Vec::new();
        for &point in points {
            while let [.., a, b] = kept[..]
                && turn(a, b, point) <= 0.0
            {
                kept.pop();
            }
            kept.push(point);
        }
        kept.pop();
        kept
    };
    let lower = chain(&mut points.iter());
    let upper = chain(&mut points.iter().rev());
    [lower, upper].concat()
}

/// The part of a polygon that lies within another one: I. E. Sutherland and G. W. Hodgman,
/// *Reentrant polygon clipping* (1974).
pub(crate) fn clipped(polygon: &[Point], window: &[Point]) -> Vec<Point> {
    let mut kept = polygon.to_vec();
    for (i, &from) in window.iter().enumerate() {
        let to = window[(i + 1) % window.len()];
        let side = |point| turn(from, to, point);
        let mut inside = Vec::with_capacity(kept.len() + 1);
        for (j, &a) in kept.iter().enumerate() {
            let b = kept[(j + 1) % kept.len()];
            if side(a) >= 0.0 {
                inside.push(a);
            }
            inside.extend(crossing(a, b, [side(a), side(b)]));
        }
        kept = inside;
    }
    kept.dedup();
    kept
}

/// Where the edge from `a` to `b` crosses a line whose signed distances from them are `sides`;
/// `None` if both are on the same side, or one is on the line.
pub(crate) fn crossing(a: Point, b: Point, sides: [f64; 2]) -> Option<Point> {
    let t = sides[0] / (sides[0] - sides[1]);
    (sides[0] * sides[1] < 0.0).then(|| [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * t))
}

/// Removes edges of a polygon until it has at most `most` corners, never fewer than 4: as long as
/// there are too many, the edge goes whose removal adds least area. `inside` returns a point, with
/// rounding errors removed, if a corner may be there. `None` if no edge can go.
pub(crate) fn cut(mut corners: Vec<Point>, most: usize, inside: impl Fn(Point) -> Option<Point>) -> Option<Vec<Point>> {
    while corners.len() > most.max(4) {
        let count = corners.len();
        let removed = (0..count).filter_map(|i| {
            let [before, a, b, after] = [count - 1, 0, 1, 2].map(|by| corners[(i + by) % count]);
            let meeting = meeting(before, a, b, after).and_then(&inside)?;
            Some((turn(a, meeting, b), i, meeting))
        });
        let (_, i, meeting) = removed.min_by(|a, b| a.0.total_cmp(&b.0))?;
        corners[i] = meeting;
        corners.remove((i + 1) % count);
    }
    Some(corners)
}

/// Where the edges before and after the edge from `a` to `b` meet beyond it.
fn meeting(before: Point, a: Point, b: Point, after: Point) -> Option<Point> {
    let (along, back) = ([a[0] - before[0], a[1] - before[1]], [b[0] - after[0], b[1] - after[1]]);
    let across = along[0] * back[1] - along[1] * back[0];
    let t = ((b[0] - a[0]) * back[1] - (b[1] - a[1]) * back[0]) / across;
    let point = [a[0] + along[0] * t, a[1] + along[1] * t];
    // Nearly parallel edges meet where rounding errors decide.
    let is_sound = t.is_finite() && t > 0.0 && turn(a, b, point) < 0.0;
    is_sound.then_some(point)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Point; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    #[test]
    fn the_part_within_a_window_is_what_both_have_in_common() {
        let diamond = [[0.5, -0.25], [1.25, 0.5], [0.5, 1.25], [-0.25, 0.5]];
        let part = clipped(&diamond, &SQUARE);
        assert_eq!(part.len(), 8);
        assert!(is_convex(&part) && (area(&part) - 0.875).abs() < 1e-12, "{part:?}");
        assert_eq!(clipped(&SQUARE, &diamond).len(), 8);
        assert!(clipped(&SQUARE, &SQUARE.map(|[x, y]| [x + 2.0, y])).is_empty());
        assert_eq!(clipped(&SQUARE, &SQUARE), SQUARE);
    }

    #[test]
    fn a_cut_polygon_holds_the_whole_one_and_keeps_four_corners() {
        let circle: Vec<Point> =
            (0..16).map(|i| f64::from(i) / 16.0 * std::f64::consts::TAU).map(|t| [t.cos(), t.sin()]).collect();
        for most in [4, 6, 8] {
            let cut = cut(circle.clone(), most, Some).unwrap();
            assert!(cut.len() == most && is_convex(&cut) && area(&cut) > area(&circle));
            assert!((area(&clipped(&circle, &cut)) - area(&circle)).abs() < 1e-12);
        }
        assert_eq!(cut(circle.clone(), 15, |_| None), None);
        assert_eq!(cut(circle, 1, Some).unwrap().len(), 4);
    }
}
