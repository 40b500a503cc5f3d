//! Limbs in the wind: leaves and wood stay together, neighbours differ, motion is bounded, and the
//! GPU and the CPU show the same.
//!
//! Without an adapter the comparisons print a note and pass; with `FOLIAGE_REQUIRE_ADAPTER=1` they
//! fail.
#![cfg(all(feature = "render", feature = "simplify"))]

mod common;

use common::gpu::{difference, gpu};
use foliage_lod::{
    FoliageModel, FoliageRenderer, Frame, Instance, Look, LookAt,
    draw::Prepared,
    effects::{Effects, Limbs, Sway, Wind, WindShape},
    extract::Far,
    gpu::{GpuDevice, Offscreen, TARGET},
    grow::{GrowOptions, Species, grow},
    import::{ImportOptions, load},
    software::{Image, SoftwareRenderer},
    stochastic::shuffled,
    wood::{Stem, WoodLevels, WoodOrder, nearest_stems, stems},
};
use glam::{DAffine3, DVec3, Vec3};
use std::path::Path;

/// The strongest wind.
const STORM: Wind =
    Wind { direction: 20.0, strength: 0.1, gustiness: 1.0, branches: 0.02, flutter: 40.0, gust_length: 40.0 };

fn grown(species: &str, leaves: u32) -> FoliageModel {
    let species = Species::embedded(species).unwrap();
    let plant = grow(&species, &GrowOptions { leaves: Some(leaves), ..GrowOptions::default() }).unwrap();
    let mut model = shuffled(&plant, 1).unwrap();
    model.order_wood();
    model
}

/// A tree made by others; `None`, with a note printed, if `FOLIAGE_TREES` is not set.
fn imported(file: &str) -> Option<FoliageModel> {
    let Some(folder) = std::env::var_os("FOLIAGE_TREES") else {
        println!("skipped: FOLIAGE_TREES is not set");
        return None;
    };
    let plant = load(&Path::new(&folder).join(file), &ImportOptions::default()).unwrap().plant;
    let mut model = shuffled(&plant, 1).unwrap();
    model.order_wood();
    Some(model)
}

/// Two grown plants and two imported ones.
fn models() -> impl Iterator<Item = (&'static str, FoliageModel)> {
    let grown =
        [("english-oak", 1500), ("betula-populifolia", 1500)].map(|(name, leaves)| (name, Some(grown(name, leaves))));
    let imported = ["eztree_oak_medium.glb", "sapling_birch_8k_rect.glb"].map(|name| (name, imported(name)));
    grown.into_iter().chain(imported).filter_map(|(name, model)| Some((name, model?)))
}

/// A model, its limbs and its shape, in plant space.
struct Skeleton<'a> {
    model: &'a FoliageModel,
    order: &'a WoodOrder,
    limbs: Limbs,
    shape: WindShape,
}

impl<'a> Skeleton<'a> {
    fn new(model: &'a FoliageModel) -> Self {
        let order = model.wood_order.as_ref().unwrap();
        let limbs = Limbs::new(model, order, DVec3::ZERO).unwrap();
        let shape = WindShape { limbs: Some(limbs.reach()), ..WindShape::new(&model.aabb()) };
        Self { model, order, limbs, shape }
    }

    fn sway(&self, wind: Wind, seconds: f64) -> Sway {
        wind.at(seconds).sway(&self.shape, &DAffine3::from_translation(DVec3::new(3.0, 0.0, 8.0)))
    }

    fn stems(&self) -> Vec<Stem> {
        stems(&self.model.wood, self.order)
    }

    /// Triangles of the wood at an error, moved, with half of the width of ribbons, which are still
    /// on their centre lines.
    fn wood(&self, levels: &WoodLevels, error: f32, sway: &Sway) -> Vec<([Vec3; 3], f32)> {
        let level = levels.at(error);
        let slides = levels.slides();
        let moved = |&number: &u32| -> Vec3 {
            let way = slides.way(number, error);
            way.map(|(vertex, weight)| {
                let rest = Vec3::from(levels.vertices[vertex as usize].position);
                let carry = self.limbs.on_stem(levels.vertex_stems[vertex as usize], rest, sway);
                let widened = slides.half(vertex, error).map_or_else(|| slides.widened(vertex, error), |_| Vec3::ZERO);
                weight * (rest + carry.offset(rest) + carry.turned(widened))
            })
            .sum()
        };
        let vertices: Vec<Vec3> = level.numbers.iter().map(moved).collect();
        let half = |corner: u32| level.across[corner as usize].length();
        let drawn = level.triangles.iter().map(|(corners, _)| corners);
        drawn.map(|of| (of.map(|i| vertices[i as usize]), of.map(half).into_iter().fold(0.0, f32::max))).collect()
    }

    fn pivot(&self, leaf: usize, sway: &Sway) -> Vec3 {
        let rest = Vec3::from(self.model.leaves[leaf].pivot);
        rest + self.limbs.on_leaf(leaf as u32, sway).offset(rest)
    }
}

/// Nearest point of a triangle, as weights of its corners.
fn nearest(p: Vec3, [a, b, c]: [Vec3; 3]) -> [f32; 3] {
    let on_edge = |from: Vec3, to: Vec3| {
        let along = to - from;
        ((p - from).dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)
    };
    let normal = (b - a).cross(c - a);
    let squared = normal.length_squared();
    let weight = |from: Vec3, to: Vec3| (to - from).cross(p - from).dot(normal) / squared;
    let inside = [weight(b, c), weight(c, a), weight(a, b)];
    if squared > 0.0 && inside.iter().all(|&weight| weight >= 0.0) {
        return inside;
    }
    let [ab, bc, ca] = [on_edge(a, b), on_edge(b, c), on_edge(c, a)];
    let edges = [[1.0 - ab, ab, 0.0], [0.0, 1.0 - bc, bc], [ca, 0.0, 1.0 - ca]];
    let far = |weights: &[f32; 3]| p.distance_squared(at([a, b, c], *weights));
    edges.into_iter().min_by(|x, y| far(x).total_cmp(&far(y))).unwrap()
}

fn at(corners: [Vec3; 3], weights: [f32; 3]) -> Vec3 {
    (0..3).map(|i| corners[i] * weights[i]).sum()
}

/// The triangle nearest to a point, with its distance from it or from the tube that it stands for.
fn nearest_of(point: Vec3, triangles: &[([Vec3; 3], f32)]) -> (usize, f32) {
    let distances = triangles.iter().map(|&(of, half)| (point.distance(at(of, nearest(point, of))) - half).max(0.0));
    distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
}

/// A leaf whose stem is at least half a pixel wide is at most a pixel farther from the wood that is
/// drawn than it is from all wood at rest; and at any level of detail its distance from where it is
/// attached changes by less than half a pixel, and by 1e-4 of the height at most.
#[test]
fn leaves_stay_on_their_stems_at_any_time_and_size() {
    for (name, model) in models() {
        let skeleton = Skeleton::new(&model);
        let levels = WoodLevels::with_ribbons(&model.wood, skeleton.order);
        let widths: Vec<f32> = skeleton.stems().iter().map(|stem| stem.width).collect();
        let own = nearest_stems(&model.wood, skeleton.order, model.leaves.iter().map(|leaf| leaf.pivot));
        let full = skeleton.wood(&levels, 0.0, &skeleton.sway(Wind { strength: 0.0, branches: 0.0, ..STORM }, 0.0));
        let leaves: Vec<usize> = (0..model.leaves.len()).step_by(1 + model.leaves.len() / 150).collect();
        let attached: Vec<(usize, [f32; 3], f32)> = leaves
            .iter()
            .map(|&leaf| {
                let pivot = model.leaves[leaf].pivot.into();
                let (triangle, distance) = nearest_of(pivot, &full);
                (triangle, nearest(pivot, full[triangle].0), distance)
            })
            .collect();
        println!("{name}: {:?} limbs", skeleton.limbs.counts());
        let diameter = 2.0 * model.sphere().radius as f32;
        let (mut seen, mut parted) = (0, 0.0_f32);
        for (side_px, times) in [(2048.0, [3.3, 61.0]), (512.0, [1.0, 17.0]), (96.0, [0.2, 40.0]), (40.0, [5.0, 1e7])] {
            let pixel = diameter / side_px;
            let shares = STORM.limb_shares(&skeleton.shape, f64::from(1.0 / pixel));
            let (mut off, mut worst, mut parted_px) = (0, 0.0_f32, 0.0_f32);
            for seconds in times {
                let sway = skeleton.sway(STORM, seconds).with_limbs(shares);
                let drawn = skeleton.wood(&levels, 0.5 * pixel, &sway);
                let all = skeleton.wood(&levels, 0.0, &sway);
                for (&leaf, &(triangle, weights, distance)) in leaves.iter().zip(&attached) {
                    let pivot = skeleton.pivot(leaf, &sway);
                    let change = (pivot.distance(at(all[triangle].0, weights)) - distance).abs();
                    parted_px = parted_px.max(change / pixel);
                    // Where both levels move in full.
                    parted = parted.max(if shares == [1.0; 2] { change / skeleton.shape.height } else { 0.0 });
                    if widths[own[leaf].unwrap() as usize] >= 0.5 * pixel {
                        let gap = (nearest_of(pivot, &drawn).1 - distance) / pixel;
                        (seen, worst) = (seen + 1, worst.max(gap));
                        off += usize::from(gap > 1.0);
                    }
                }
            }
            println!("{name} at {side_px}: {off} off, at most {worst:.2} px; parted by {parted_px:.3} px");
            assert!(off == 0 && parted_px < 0.5, "{name} at {side_px}: {off}, {worst}, {parted_px}");
        }
        println!("{name}: {seen} seen, parted by {parted:.1e} of the height");
        assert!(seen > 50 && parted < 1e-4, "{name}: {seen}, {parted}");
    }
}

/// Correlation of two motions, each relative to its mean.
fn correlation(a: &[Vec3], b: &[Vec3]) -> f32 {
    let mean = |of: &[Vec3]| of.iter().copied().sum::<Vec3>() / of.len() as f32;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let dot = |x: &[Vec3], of_x: Vec3, y: &[Vec3], of_y: Vec3| -> f32 {
        x.iter().zip(y).map(|(x, y)| (*x - of_x).dot(*y - of_y)).sum()
    };
    dot(a, mean_a, b, mean_b) / (dot(a, mean_a, a, mean_a) * dot(b, mean_b, b, mean_b)).sqrt()
}

#[test]
fn neighbouring_branches_are_hardly_correlated() {
    let model = grown("english-oak", 1500);
    let skeleton = Skeleton::new(&model);
    let stems = skeleton.stems();
    // Of level 2, without what it inherits from level 1 and the trunk.
    let sways = [(Wind::default(), [1.0, 1.0]), (Wind { strength: 0.0, ..Wind::default() }, [0.0, 1.0])].map(
        |(wind, shares)| -> Vec<Sway> {
            (0..1200).map(|step| skeleton.sway(wind, f64::from(step) * 0.1).with_limbs(shares)).collect()
        },
    );
    let motion = |stem: u32| -> Vec<Vec3> {
        let Stem { tip, level, .. } = stems[stem as usize];
        sways[usize::from(level) - 1]
            .iter()
            .map(|sway| skeleton.limbs.on_stem(stem, tip, sway).offset(tip) - sway.offset(tip))
            .collect()
    };
    for level in [1_u8, 2] {
        // Stems that are limbs themselves, each with those on the same stem whose feet are nearest.
        let own: Vec<u32> = (0..stems.len() as u32).filter(|&stem| stems[stem as usize].level == level).collect();
        let motions: Vec<Vec<Vec3>> = own.iter().map(|&stem| motion(stem)).collect();
        let mut found = Vec::new();
        for (i, &stem) in own.iter().enumerate() {
            let of = |other: u32| &stems[other as usize];
            let siblings = (0..own.len()).filter(|&j| j != i && of(own[j]).parent == of(stem).parent);
            let mut siblings: Vec<usize> = siblings.collect();
            siblings.sort_by(|&a, &b| {
                let far = |j: usize| of(own[j]).foot.distance(of(stem).foot);
                far(a).total_cmp(&far(b))
            });
            found.extend(siblings.iter().take(3).map(|&j| correlation(&motions[i], &motions[j])));
        }
        let (most, mean) =
            (found.iter().copied().fold(f32::MIN, f32::max), found.iter().sum::<f32>() / found.len() as f32);
        println!(
            "level {level}: {} pairs of {} limbs, at most {most:.2}, on average {mean:.3}",
            found.len(),
            own.len()
        );
        assert!(most < 0.5 && found.len() > 20, "level {level}: {most}");
    }
}

#[test]
fn motion_is_bounded_for_a_million_steps_and_late_times_move_as_early_ones() {
    let model = grown("english-oak", 300);
    let skeleton = Skeleton::new(&model);
    let reach = STORM.reach(&skeleton.shape, 0.0);
    let mut most = [0.0_f32; 2];
    let leaves = model.leaves.len();
    for step in 0..1_000_000_usize {
        let sway = skeleton.sway(STORM, step as f64 / 60.0);
        let leaf = step * 7 % leaves;
        let moved = skeleton.pivot(leaf, &sway).distance(model.leaves[leaf].pivot.into());
        let half = &mut most[usize::from(step >= 500_000)];
        *half = half.max(moved);
        assert!(moved <= reach, "step {step}: {moved} beyond {reach}");
    }
    println!("at most {most:?} of {reach}");
    assert!((most[0] / most[1] - 1.0).abs() < 0.02 && most[0] > 0.4 * reach, "{most:?} of {reach}");
    for early in [0.0, 0.37, 59.9, 119.99] {
        let sways = [early, early + 120.0 * 83_333.0].map(|seconds| skeleton.sway(STORM, seconds));
        for leaf in 0..leaves {
            let [a, b] = [0, 1].map(|i| skeleton.pivot(leaf, &sways[i]));
            assert!(a.distance(b) < 2e-5 * skeleton.shape.height, "{early}: {a} {b}");
        }
    }
}

/// All vertices of wood and leaves stay within the bound, and parts of a limb of level 2 keep their
/// distances.
#[test]
fn limbs_are_rigid_and_stay_within_their_reach() {
    for (name, model) in models() {
        let skeleton = Skeleton::new(&model);
        let levels = WoodLevels::with_ribbons(&model.wood, skeleton.order);
        let corner_of = |leaf: usize| {
            let vertices = &model.vertices[model.leaves[leaf].geometry().vertex_range()];
            let pivot = Vec3::from(model.leaves[leaf].pivot);
            vertices.iter().map(move |vertex| (pivot, Vec3::from(vertex.position) - pivot))
        };
        let leaf_reach =
            (0..model.leaves.len()).flat_map(corner_of).map(|(_, offset)| offset.length()).fold(0.0, f32::max);
        let [reach, of_wood] = [leaf_reach, 0.0].map(|leaf_reach| STORM.reach(&skeleton.shape, leaf_reach));
        let (mut most, mut bent) = (0.0_f32, 0.0_f32);
        for seconds in [0.0, 3.3, 17.0, 61.0, 100.0] {
            let sway = skeleton.sway(STORM, seconds);
            for leaf in 0..model.leaves.len() {
                let carry = skeleton.limbs.on_leaf(leaf as u32, &sway);
                for (pivot, offset) in corner_of(leaf) {
                    let turned = pivot + sway.turn(leaf as u32) * offset;
                    most = most.max((turned + carry.offset(turned)).distance(pivot + offset) / reach);
                }
            }
            let mut last: Vec<Option<[Vec3; 2]>> = vec![None; 1 << 16];
            for (vertex, &stem) in model.wood.vertices.iter().zip(&levels.vertex_stems) {
                let rest = Vec3::from(vertex.position);
                let moved = rest + skeleton.limbs.on_stem(stem, rest, &sway).offset(rest);
                most = most.max(moved.distance(rest) / of_wood);
                let [limb, below] = skeleton.limbs.of_stem(stem);
                if below > 0 {
                    if let Some([other, other_moved]) = last[usize::from(limb)] {
                        bent = bent
                            .max((moved.distance(other_moved) - rest.distance(other)).abs() / skeleton.shape.height);
                    }
                    last[usize::from(limb)] = Some([rest, moved]);
                }
            }
        }
        println!("{name}: moves up to {most:.2} of the bound; distances change by {bent:.1e} of the height");
        assert!(most <= 1.0 && most > 0.3 && bent < 1e-6, "{name}: {most}, {bent}");
    }
}

/// What impostors leave out, which bend as the trunk alone, is below half a pixel where plants are
/// handed over.
#[test]
fn impostors_sway_as_the_leaves_do() {
    for (name, model) in models() {
        let skeleton = Skeleton::new(&model);
        let pixel = 2.0 * model.sphere().radius / f64::from(Far::default().at_px);
        let wind = Wind::default();
        let shares = wind.limb_shares(&skeleton.shape, 1.0 / pixel);
        let (mut most, mut sum, mut count) = (0.0_f64, 0.0, 0.0);
        for step in 0..240 {
            let sway = skeleton.sway(wind, f64::from(step) * 0.5).with_limbs(shares);
            for leaf in (0..model.leaves.len()).step_by(7) {
                let rest = Vec3::from(model.leaves[leaf].pivot);
                let apart = f64::from(skeleton.pivot(leaf, &sway).distance(rest + sway.offset(rest))) / pixel;
                (most, sum, count) = (most.max(apart), sum + apart, count + 1.0);
            }
        }
        println!("{name}: shares {shares:?}, left out {:.3} px on average, {most:.3} at most", sum / count);
        assert!(most < 0.5, "{name}: {most}");
    }
}

const SIZE: [u32; 2] = [256, 256];

fn camera(model: &FoliageModel, factor: f64) -> LookAt {
    LookAt::framing(&model.sphere(), DVec3::new(0.45, 0.25, 1.0), 0.5, factor)
}

fn look(wind: Option<Wind>) -> Look {
    Look { effects: Effects { wind, ..Effects::default() }, tone: false, ..Look::default() }
}

fn drawn(gpu: &GpuDevice, model: &FoliageModel, look: Look, factor: f64, seconds: f64) -> (Image, Prepared, u64) {
    let target = Offscreen::new(gpu, SIZE).unwrap();
    let mut foliage = FoliageRenderer::new(gpu.device(), TARGET, look).unwrap();
    let id = foliage.add_model(gpu.device(), gpu.queue(), model).unwrap();
    let plant = Instance::new(id, DAffine3::IDENTITY, model.leaves.len() as f32);
    let frame = Frame::new(&camera(model, factor).camera(SIZE[1])).at(seconds);
    let prepared = foliage.prepare(gpu.device(), gpu.queue(), frame, &[plant]).unwrap();
    (target.picture(&foliage).unwrap(), prepared, foliage.diagnostics().limb_bytes)
}

fn painted(model: &FoliageModel, look: Look, factor: f64, seconds: f64) -> (Image, Prepared) {
    let mut painter = SoftwareRenderer::new(look).unwrap();
    let id = painter.add_model(model).unwrap();
    let plant = Instance::new(id, DAffine3::IDENTITY, model.leaves.len() as f32);
    let frame = Frame::new(&camera(model, factor).camera(SIZE[1])).at(seconds);
    let drawing = painter.draw(frame, &[plant], SIZE).unwrap();
    (drawing.image, drawing.prepared)
}

#[test]
fn the_gpu_moves_limbs_as_the_cpu_does_and_no_wind_is_the_rest_pose() {
    let Some(gpu) = gpu() else { return };
    for (name, model) in models().step_by(2) {
        let without = [drawn(&gpu, &model, look(None), 1.0, 9.0).0, painted(&model, look(None), 1.0, 9.0).0];
        let (mean_at_rest, _) = difference(&without[0], &without[1]);
        for (wind, seconds) in [(STORM, 9.0), (Wind::default(), 31.0)] {
            let (by_gpu, prepared, bytes) = drawn(&gpu, &model, look(Some(wind)), 1.0, seconds);
            let (by_cpu, _) = painted(&model, look(Some(wind)), 1.0, seconds);
            let (mean, percentile) = difference(&by_gpu, &by_cpu);
            let (shown, _) = difference(&by_gpu, &without[0]);
            println!("{name}: {bytes} bytes; moves {shown:.2}, CPU {mean:.2} {percentile}, at rest {mean_at_rest:.2}");
            assert_eq!(prepared.effects.wind_limbs.unwrap().map(|count| count.simulated), [1, 1]);
            assert!(mean < mean_at_rest + 0.5 && shown > mean + 1.0, "{name}: {mean}, {shown}");
            if let Some(folder) = std::env::var_os("FOLIAGE_PICTURES") {
                let path = Path::new(&folder).join(format!("limbs-{name}-{seconds}.png"));
                Image::side_by_side(&[without[0].clone(), by_gpu, by_cpu], 4).write_png(path).unwrap();
            }
        }
        let still = Wind { strength: 0.0, branches: 0.0, flutter: 0.0, ..STORM };
        let skeleton = Skeleton::new(&model);
        let sway = skeleton.sway(still, 9.0);
        assert!((0..model.leaves.len()).all(|leaf| skeleton.pivot(leaf, &sway).to_array() == model.leaves[leaf].pivot));
        assert!(drawn(&gpu, &model, look(Some(still)), 1.0, 9.0).0 == without[0], "{name} on the GPU");
        assert!(painted(&model, look(Some(still)), 1.0, 9.0).0 == without[1], "{name} on the CPU");
    }
}

#[test]
fn levels_are_simulated_only_where_they_are_seen_to_move() {
    let Some(gpu) = gpu() else { return };
    let model = grown("english-oak", 300);
    let mut before = [1.0_f64; 2];
    let skeleton = Skeleton::new(&model);
    for (factor, expected) in [(1.0, [1, 1]), (3.4, [1, 0]), (9.0, [0, 0]), (60.0, [0, 0])] {
        let [by_gpu, by_cpu] = [
            drawn(&gpu, &model, look(Some(Wind::default())), factor, 2.0).1,
            painted(&model, look(Some(Wind::default())), factor, 2.0).1,
        ];
        for prepared in [by_gpu, by_cpu] {
            let counts = prepared.effects.wind_limbs.unwrap();
            assert_eq!(counts.map(|count| count.simulated), expected, "at {factor}");
            assert_eq!(counts.map(|count| count.skipped), expected.map(|simulated| 1 - simulated), "at {factor}");
        }
        assert_eq!(by_gpu.effects.named().filter(|(name, _)| name.starts_with("wind_limbs")).count(), 2);
    }
    // Their motion fades between half a pixel and one.
    for step in 1..200 {
        let shares = Wind::default()
            .limb_shares(&skeleton.shape, 40.0 / f64::from(step) / f64::from(skeleton.shape.height) * 16.0);
        for level in 0..2 {
            assert!(f64::from(shares[level]) <= before[level]);
            before[level] = f64::from(shares[level]);
        }
    }
    assert_eq!(before, [0.0; 2]);
    assert_eq!(drawn(&gpu, &model, look(None), 1.0, 2.0).2, 0);
    let mut bare = model.clone();
    bare.wood_order = None;
    let (_, prepared, bytes) = drawn(&gpu, &bare, look(Some(Wind::default())), 1.0, 2.0);
    assert_eq!((prepared.effects.wind_limbs, bytes), (None, 16));
}
