//! The whole simplification, written directly from its formulas without optimisation: every
//! candidate of every step is redrawn and recounted. Slow; shares no code with the library.

use super::naive_raster::{Mask, Masked, alpha_covers, inside, mask, outline};
use foliage_lod::{
    Plant,
    model::Prune,
    simplify::{Compensate, Criterion},
};
use glam::{DVec3, Vec3};

/// Difference in appearance of two polygons in a view: `(view, a, b)`.
type Difference<'a> = Box<dyn Fn(usize, usize, usize) -> i64 + 'a>;

/// A measure of the difference between two pictures.
pub struct Comparison<'a> {
    pub difference: Difference<'a>,
    /// Difference between a polygon and the background.
    pub coverage: i64,
}

pub struct Naive<'a> {
    plant: &'a Plant,
    pub criterion: Criterion,
    pub compensate: Compensate,
    /// Texture coordinates of every leaf's pivot, if masked leaves grow by tiling.
    pub pivot_uv: Option<[f32; 2]>,
    /// Measures used by the criterion and by the compensation rule.
    pub comparisons: [Option<Comparison<'a>>; 2],
    /// Cost of a pixel that the dearest leaf covers, as a fraction of that of a pixel that shows
    /// the background instead of a polygon.
    pub intrinsic: f64,
    /// Frontmost row at each pixel of each view at full detail.
    reference: Vec<Vec<usize>>,
    /// Whether each pixel of each view is within the crown's outline.
    outline: Vec<Vec<bool>>,
    resolution: usize,
    background: bool,
    max_scale: f64,
    center: DVec3,
    radius: f64,
    /// (right, up, toward) of each view.
    pub cameras: Vec<[DVec3; 3]>,
    /// Alpha mask of each material's texture.
    masks: Vec<Option<Mask>>,
    fraction_bits: u32,
    /// log2 of every possible area, in fixed point.
    logs: Vec<i64>,
    scales: Vec<f32>,
    live: Vec<bool>,
    /// For each leaf and view, (pixel, depth) at its current scale.
    drawn: Vec<Vec<Vec<(usize, u32)>>>,
    /// Depth of the nearest wood at each pixel of each view.
    wood: Vec<Vec<u32>>,
}

const NEAR: f64 = 0.1;
const DISTANCE: f64 = 3.0;

impl<'a> Naive<'a> {
    pub fn new(plant: &'a Plant, resolution: u32, background: bool, max_scale: f32) -> Self {
        let corners: Vec<DVec3> =
            plant.vertices.iter().chain(&plant.wood.vertices).map(|v| Vec3::from(v.position).as_dvec3()).collect();
        let low = corners.iter().copied().reduce(DVec3::min).unwrap();
        let high = corners.iter().copied().reduce(DVec3::max).unwrap();
        let center = (low + high) * 0.5;
        let radius = corners.iter().map(|&p| p.distance_squared(center)).fold(0.0, f64::max).sqrt();
        let phi = (1.0 + 5.0_f64.sqrt()) / 2.0;
        let mut vertices = Vec::new();
        let signs = [1.0, -1.0];
        for x in signs {
            for y in signs {
                vertices.extend(signs.map(|z| DVec3::new(x, y, z)));
                for rotation in 0..3 {
                    let rectangle = [0.0, x / phi, y * phi];
                    vertices.push(DVec3::from_array([0, 1, 2].map(|axis| rectangle[(axis + rotation) % 3])));
                }
            }
        }
        // The library lists the cube's vertices first; the order of the views affects no sum.
        let cameras = vertices.into_iter().map(|vertex| {
            let toward = vertex / vertex.dot(vertex).sqrt();
            let across = DVec3::Y.cross(toward);
            let right = across / across.dot(across).sqrt();
            [right, toward.cross(right), toward]
        });
        let pixels = 20 * (resolution as u64).pow(2);
        let area = pixels as f64;
        let fraction_bits = (62 - (area * area.log2()).log2().ceil() as u32 - 1).min(36);
        let mut naive = Self {
            plant,
            criterion: Criterion::Vmi,
            compensate: Compensate::Nearest,
            pivot_uv: None,
            comparisons: [None, None],
            intrinsic: 0.0,
            reference: Vec::new(),
            outline: Vec::new(),
            resolution: resolution as usize,
            background,
            max_scale: f64::from(max_scale),
            center,
            radius,
            cameras: cameras.collect(),
            masks: plant.materials.iter().map(|material| mask(plant, material)).collect(),
            fraction_bits,
            logs: (0..=pixels).map(|n| log2(n, fraction_bits)).collect(),
            scales: vec![1.0; plant.leaves.len()],
            live: vec![true; plant.leaves.len()],
            drawn: Vec::new(),
            wood: Vec::new(),
        };
        naive.drawn = (0..plant.leaves.len()).map(|leaf| naive.draw(leaf)).collect();
        naive.wood = (0..20).map(|view| naive.draw_wood(view)).collect();
        naive.reference = naive.fronts(None);
        let background = plant.leaves.len();
        let covered = |view: &Vec<usize>| outline(view.iter().map(|&front| front != background).collect());
        naive.outline = naive.reference.iter().map(covered).collect();
        naive
    }

    /// Prunes all leaves but one.
    pub fn run(&mut self) -> Vec<Prune> {
        let mut prunes = Vec::new();
        while self.live.iter().filter(|&&live| live).count() > 1 {
            let areas = self.count(None);
            let seconds = self.count_seconds();
            let candidates = (0..self.live.len()).filter(|&leaf| self.live[leaf]);
            let errors = self.errors(&areas);
            let (error, _, leaf) = candidates.map(|leaf| (errors[leaf], seconds[leaf], leaf)).min().unwrap();
            let visible = areas[leaf].iter().sum::<u64>();
            let prices = self.prices();
            let error = error - self.intrinsic_cost(leaf);
            self.live[leaf] = false;
            let nearest = self.nearest(leaf);
            let (target, scale) = match self.compensate {
                _ if visible == 0 => (nearest[0], self.scales[nearest[0]]),
                Compensate::None => (nearest[0], self.scales[nearest[0]]),
                Compensate::Nearest => {
                    let covered: usize = self.drawn[leaf].iter().map(Vec::len).sum();
                    (nearest[0], self.grown(nearest[0], self.area(leaf) * (visible as f64 / covered as f64)))
                }
                Compensate::Silhouette | Compensate::Image => self.judged(leaf, &nearest, prices),
            };
            self.scales[target] = scale;
            self.drawn[target] = self.draw(target);
            prunes.push(Prune {
                leaf: leaf as u32,
                target: target as u32,
                target_scale: scale,
                error: self.recorded(error),
            });
        }
        prunes
    }

    fn area(&self, leaf: usize) -> f64 {
        self.surface(leaf).0 * f64::from(self.scales[leaf]).powi(2)
    }

    /// The scale at which `area` is added to the leaf's own area, within the limits on its scale.
    fn grown(&self, leaf: usize, area: f64) -> f32 {
        let grown = ((self.area(leaf) + area) / self.surface(leaf).0).sqrt();
        grown.min(self.max_scale).min(self.room(leaf)).max(self.scales[leaf].into()) as f32
    }

    /// Error of pruning each leaf, in fixed-point steps.
    fn errors(&self, areas: &[Vec<u64>]) -> Vec<i64> {
        let leaves = 0..self.live.len();
        match self.criterion {
            Criterion::Vmi => {
                let before = self.information(areas);
                leaves.map(|leaf| self.error(&before, &self.count(Some(leaf)))).collect()
            }
            Criterion::Area => leaves.map(|leaf| areas[leaf].iter().sum::<u64>() as i64).collect(),
            Criterion::Image => {
                let by = self.comparisons[0].as_ref().unwrap();
                let prices = self.prices();
                let before = self.score(by, prices, None);
                leaves.map(|leaf| before - self.score(by, prices, Some(leaf)) + self.intrinsic_cost(leaf)).collect()
            }
        }
    }

    /// Cost of pruning the leaf besides what shows, in fixed-point steps.
    fn intrinsic_cost(&self, leaf: usize) -> i64 {
        let Some(by) = self.comparisons[0].as_ref().filter(|_| self.criterion == Criterion::Image) else { return 0 };
        let most = (self.intrinsic * (8 * by.coverage) as f64).round() as u64;
        let covered: usize = self.drawn[leaf].iter().map(Vec::len).sum();
        (most * hash(leaf as u64) / (1 << 32)) as i64 * covered as i64
    }

    fn recorded(&self, error: i64) -> f32 {
        let pixels = if self.background { self.resolution.pow(2) as f64 } else { 1.0 };
        let error = error as f64;
        match self.criterion {
            Criterion::Vmi => (error / (1_u64 << self.fraction_bits) as f64 / pixels) as f32,
            Criterion::Area => error as f32,
            Criterion::Image => (error.max(0.0) / (self.comparisons[0].as_ref().unwrap().coverage * 8) as f64) as f32,
        }
    }

    /// Frontmost row at each pixel of each view, with one leaf left out.
    fn fronts(&self, without: Option<usize>) -> Vec<Vec<usize>> {
        let front = |view| self.nearest_fragments(view, without, None).into_iter().map(|(_, row)| row).collect();
        (0..20).map(front).collect()
    }

    /// Score of the views with one leaf left out: -8 times their difference from full detail, plus
    /// the first price for each covered pixel within the outline, minus the second for each beyond.
    fn score(&self, by: &Comparison<'_>, prices: [i64; 2], without: Option<usize>) -> i64 {
        let background = self.live.len();
        let mut score = 0;
        for (view, fronts) in self.fronts(without).iter().enumerate() {
            for (pixel, &front) in fronts.iter().enumerate() {
                score -= 8 * (by.difference)(view, front, self.reference[view][pixel]);
                let price = if self.outline[view][pixel] { prices[0] } else { -prices[1] };
                score += if front == background { 0 } else { price * by.coverage };
            }
        }
        score
    }

    /// Price of coverage within the outline, from -8 to 8: 1 for each 1/160 of the pixels covered
    /// at full detail that is missing now, negative if too many are covered. Then the price beyond
    /// it, up to 64: 1 for each 1/2000 above 8/1000.
    fn prices(&self) -> [i64; 2] {
        let background = self.live.len();
        let covered = self.reference.iter().flatten().filter(|&&front| front != background).count();
        let (mut within, mut beyond) = (0, 0);
        for (front, inside) in self.fronts(None).iter().flatten().zip(self.outline.iter().flatten()) {
            if *front != background {
                *(if *inside { &mut within } else { &mut beyond }) += 1;
            }
        }
        let share = |share: f64| (covered as f64 * share) as i64;
        let price = (covered as i64 - within) / share(0.05 / 8.0).max(1);
        [price.clamp(-8, 8), ((beyond - share(0.008)) / share(0.0005).max(1)).clamp(0, 64)]
    }

    /// The target and its scale that give the best score over the views.
    fn judged(&mut self, leaf: usize, nearest: &[usize], prices: [i64; 2]) -> (usize, f32) {
        let lost = self.area(leaf);
        let by = self.comparisons[1].take().unwrap();
        let now = self.score(&by, prices, None);
        let mut best = (i64::MIN, nearest[0], 1.0);
        let attempt = |naive: &mut Self, target: usize, area: f64, best: &mut (i64, usize, f32)| {
            let before = naive.scales[target];
            let scale = naive.grown(target, area);
            naive.scales[target] = scale;
            let drawn = naive.draw(target);
            let drawn = std::mem::replace(&mut naive.drawn[target], drawn);
            let gain = naive.score(&by, prices, None) - now;
            naive.scales[target] = before;
            naive.drawn[target] = drawn;
            if gain > best.0 {
                *best = (gain, target, scale);
            }
        };
        for &target in nearest.iter().take(8) {
            attempt(self, target, lost, &mut best);
        }
        if self.compensate == Compensate::Image {
            let target = best.1;
            for share in [0.25, 0.5, 2.0, 4.0] {
                attempt(self, target, lost * share, &mut best);
            }
        }
        self.comparisons[1] = Some(by);
        let (gain, target, scale) = best;
        (target, if gain > 0 { scale } else { self.scales[target] })
    }

    /// Visible areas of leaves, background and wood in each view, with one leaf left out.
    pub fn count(&self, without: Option<usize>) -> Vec<Vec<u64>> {
        let mut areas = vec![vec![0; 20]; self.live.len() + 2];
        (0..20).for_each(|view| {
            for (_, front) in self.nearest_fragments(view, without, None) {
                areas[front][view] += 1;
            }
        });
        areas
    }

    /// For each row, the number of pixels where it is directly behind the frontmost.
    fn count_seconds(&self) -> Vec<u64> {
        let mut seconds = vec![0; self.live.len() + 2];
        for view in 0..20 {
            let front = self.nearest_fragments(view, None, None);
            for (_, second) in self.nearest_fragments(view, None, Some(&front)) {
                seconds[second] += 1;
            }
        }
        seconds
    }

    /// The nearest (depth, row) at every pixel; with `behind`, only leaves behind those count.
    fn nearest_fragments(
        &self,
        view: usize,
        without: Option<usize>,
        behind: Option<&[(u32, usize)]>,
    ) -> Vec<(u32, usize)> {
        let leaves = self.live.len();
        let bottom = |&depth: &u32| if depth == u32::MAX { (depth, leaves) } else { (depth, leaves + 1) };
        let mut nearest: Vec<(u32, usize)> = self.wood[view].iter().map(bottom).collect();
        for leaf in (0..leaves).filter(|&leaf| self.live[leaf] && Some(leaf) != without) {
            for &(pixel, depth) in &self.drawn[leaf][view] {
                let is_behind = behind.is_none_or(|front| (depth, leaf) > front[pixel]);
                if is_behind && (depth, leaf) < nearest[pixel] {
                    nearest[pixel] = (depth, leaf);
                }
            }
        }
        nearest
    }

    /// Information of each view, multiplied by the number of pixels per view if the background
    /// counts.
    fn information(&self, areas: &[Vec<u64>]) -> Vec<i64> {
        let background = self.live.len();
        let rows: Vec<&Vec<u64>> = areas
            .iter()
            .enumerate()
            .filter(|&(row, _)| self.background || row != background)
            .map(|(_, row)| row)
            .collect();
        let totals: Vec<u64> = rows.iter().map(|row| row.iter().sum()).collect();
        let all = totals.iter().sum();
        (0..20)
            .map(|view| {
                let rows = || rows.iter().zip(&totals).map(|(row, &total)| (row[view], total));
                let sum: i64 = rows().map(|(area, total)| area as i64 * (self.log(area) - self.log(total))).sum();
                let covered: u64 = rows().map(|(area, _)| area).sum();
                match (self.background, covered) {
                    (true, _) => sum,
                    (false, 0) => 0,
                    (false, _) => sum.div_euclid(covered as i64) + self.log(all) - self.log(covered),
                }
            })
            .collect()
    }

    fn error(&self, before: &[i64], without: &[Vec<u64>]) -> i64 {
        before.iter().zip(self.information(without)).map(|(before, after)| (after - before).abs()).sum()
    }

    fn log(&self, area: u64) -> i64 {
        self.logs[area as usize]
    }

    fn surface(&self, leaf: usize) -> (f64, Vec3) {
        let indices = &self.plant.indices[self.plant.leaves[leaf].index_range()];
        let (mut area, mut weighted) = (0.0, DVec3::ZERO);
        for corners in indices.chunks(3) {
            let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(self.plant.vertices[corners[i] as usize].position).as_dvec3());
            let doubled = (b - a).cross(c - a).length();
            area += doubled;
            weighted += (a + b + c) * (doubled / 3.0);
        }
        (area * 0.5, (weighted / area).as_vec3())
    }

    /// The scale, at least 1, at which the leaf extends beyond the bounding box of all leaves by a
    /// tenth of the diagonal.
    fn room(&self, leaf: usize) -> f64 {
        let corners = || self.plant.vertices.iter().map(|v| Vec3::from(v.position).as_dvec3());
        let [low, high] = [corners().reduce(DVec3::min).unwrap(), corners().reduce(DVec3::max).unwrap()];
        let margin = (high - low).length() * 0.1;
        let pivot = Vec3::from(self.plant.leaves[leaf].pivot).as_dvec3();
        let mut room = f64::INFINITY;
        for vertex in &self.plant.vertices[self.plant.leaves[leaf].vertex_range()] {
            let offset = Vec3::from(vertex.position).as_dvec3() - pivot;
            for axis in 0..3 {
                let wall = if offset[axis] > 0.0 { high[axis] + margin } else { low[axis] - margin };
                if offset[axis] != 0.0 {
                    room = room.min((wall - pivot[axis]) / offset[axis]);
                }
            }
        }
        room.max(1.0)
    }

    /// The remaining leaves, nearest first.
    fn nearest(&self, leaf: usize) -> Vec<usize> {
        let from = self.surface(leaf).1.as_dvec3();
        let distance = |other: usize| (self.surface(other).1.as_dvec3() - from).length_squared();
        let mut live: Vec<usize> = (0..self.live.len()).filter(|&other| self.live[other]).collect();
        live.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        live
    }

    /// A leaf's fragments in every view at its current scale.
    fn draw(&self, leaf: usize) -> Vec<Vec<(usize, u32)>> {
        let record = &self.plant.leaves[leaf];
        let unit = |p: [f32; 3]| (Vec3::from(p).as_dvec3() - self.center) / self.radius;
        let pivot = unit(record.pivot);
        let offset = |index: u32| unit(self.plant.vertices[index as usize].position) - pivot;
        let reach = record.vertex_range().map(|i| offset(i as u32).length()).fold(0.0, f64::max);
        let scale = f64::from(self.scales[leaf]);
        let mut views = vec![Vec::new(); 20];
        let mut plane: Option<(DVec3, f64)> = None;
        for corners in self.plant.indices[record.index_range()].chunks(3) {
            let offsets = [0, 1, 2].map(|i| offset(corners[i]));
            let in_plane =
                |(normal, level): (DVec3, f64)| offsets.iter().all(|o| (normal.dot(*o) - level).abs() <= reach * 1e-4);
            if !plane.is_some_and(in_plane) {
                let normal = (offsets[1] - offsets[0]).cross(offsets[2] - offsets[0]).normalize();
                let level = normal.dot(offsets[0]);
                plane = Some((normal, if level.abs() <= reach * 1e-4 { 0.0 } else { level }));
            }
            let (normal, level) = plane.unwrap();
            let plane = (normal, normal.dot(pivot) + level * scale);
            let uv = [0, 1, 2].map(|i| self.plant.vertices[corners[i] as usize].uv);
            let tiling = self.pivot_uv.filter(|_| self.scales[leaf] > 1.0).map(|uv| (uv, self.scales[leaf]));
            let wrap = self.plant.materials[record.material as usize].wrap;
            let mask = self.masks[record.material as usize].as_ref().map(|mask| (mask, wrap, uv, tiling));
            for (view, fragments) in views.iter_mut().enumerate() {
                let pivot_w = DISTANCE - pivot.dot(self.cameras[view][2]);
                let swing = reach * self.max_scale;
                let range = [1.0 / (pivot_w + swing), 1.0 / (pivot_w - swing).max(NEAR)];
                self.draw_triangle(view, offsets.map(|o| pivot + o * scale), plane, range, mask, fragments);
            }
        }
        for fragments in &mut views {
            fragments.sort();
            fragments.dedup_by_key(|fragment| fragment.0);
        }
        views
    }

    fn draw_wood(&self, view: usize) -> Vec<u32> {
        let mut nearest = vec![u32::MAX; self.resolution.pow(2)];
        let unit =
            |i: u32| (Vec3::from(self.plant.wood.vertices[i as usize].position).as_dvec3() - self.center) / self.radius;
        let reach = (0..self.plant.wood.vertices.len() as u32).map(|i| unit(i).length()).fold(0.0, f64::max);
        for corners in self.plant.wood.indices.chunks(3) {
            let corners = [0, 1, 2].map(|i| unit(corners[i]));
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            let range =
                [1.0 / (DISTANCE + reach * self.max_scale), 1.0 / (DISTANCE - reach * self.max_scale).max(NEAR)];
            let mut fragments = Vec::new();
            self.draw_triangle(view, corners, (normal, normal.dot(corners[0])), range, None, &mut fragments);
            for (pixel, depth) in fragments {
                nearest[pixel] = nearest[pixel].min(depth);
            }
        }
        nearest
    }

    /// Appends the fragments of a triangle, testing every pixel of the view.
    fn draw_triangle(
        &self,
        view: usize,
        corners: [DVec3; 3],
        (normal, level): (DVec3, f64),
        range: [f64; 2],
        mask: Option<Masked<'_>>,
        fragments: &mut Vec<(usize, u32)>,
    ) {
        let [right, up, toward] = self.cameras[view];
        let w = corners.map(|corner| DISTANCE - corner.dot(toward));
        if w.iter().any(|&w| w <= NEAR) {
            return;
        }
        let pixels_per_tan = self.resolution as f64 * 8.0_f64.sqrt() / 2.0;
        let middle = self.resolution as f64 / 2.0 - 0.5;
        let snapped = [0, 1, 2].map(|i| {
            let x = middle + corners[i].dot(right) / w[i] * pixels_per_tan;
            let y = middle - corners[i].dot(up) / w[i] * pixels_per_tan;
            ((x * 256.0).round_ties_even() as i64, (y * 256.0).round_ties_even() as i64)
        });
        for pixel in 0..self.resolution.pow(2) {
            let (x, y) = (pixel % self.resolution, pixel / self.resolution);
            if !inside(snapped, (x as i64 * 256, y as i64 * 256)) {
                continue;
            }
            if mask.is_some_and(|mask| !alpha_covers(mask, snapped, w, (x, y))) {
                continue;
            }
            // Intersects the ray eye + w (x right + y up - toward) with the plane.
            let (ray_x, ray_y) = ((x as f64 - middle) / pixels_per_tan, (middle - y as f64) / pixels_per_tan);
            let ray = right * ray_x + up * ray_y - toward;
            let from_eye = level - normal.dot(toward * DISTANCE);
            let inv_w = normal.dot(ray) / from_eye;
            let inv_w = inv_w.clamp(range[0], range[1]);
            fragments.push((pixel, ((1.0 / NEAR - inv_w) * NEAR * f64::from(u32::MAX)) as u32));
        }
    }
}

/// The upper 32 bits of the second number of the SplitMix64 stream that starts at the mixed seed.
fn hash(seed: u64) -> u64 {
    const GAMMA: u64 = 11_400_714_819_323_198_485;
    let mix = |mut bits: u64| {
        bits = (bits ^ (bits >> 30)).wrapping_mul(13_787_848_793_156_543_929);
        bits = (bits ^ (bits >> 27)).wrapping_mul(10_723_151_780_598_845_931);
        bits ^ (bits >> 31)
    };
    mix(mix(seed ^ GAMMA).wrapping_add(GAMMA)) >> 32
}

/// Base-2 logarithm in fixed point, digit by digit, rounded to the nearest step; 0 for 0.
fn log2(n: u64, fraction_bits: u32) -> i64 {
    if n == 0 {
        return 0;
    }
    let whole = n.ilog2();
    let mut mantissa = u128::from(n) << (63 - whole);
    let mut fraction = 0_i64;
    for _ in 0..=fraction_bits {
        mantissa = (mantissa * mantissa) >> 63;
        let digit = mantissa >> 64;
        mantissa >>= digit;
        fraction = fraction * 2 + digit as i64;
    }
    (i64::from(whole) << fraction_bits) + (fraction + 1) / 2
}
