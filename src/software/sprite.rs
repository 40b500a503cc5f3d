//! Impostors on the CPU: where a sprite lies on the screen, and what one of its pixels shows. Twin
//! of `impostor_pass.wgsl`.

use super::{frame_pages::FramePages, light::Light};
use crate::{
    Camera, Depth,
    bounds::{Aabb, largest_scale},
    draw::{
        handover::{covered_samples, far_samples},
        light::Lighting,
        mips::SrgbTable,
        pages::{PageLevel, Pages},
        sprite::{DEEP_FROM_PX, DEPTH_STEPS, LEAST_APPROACH, LEAST_PX, MOST_PULL, SHARPER_LEVELS},
        tint::Tint,
    },
    effects::wind::Sway,
    hash::hash,
    model::{Framing, Lattice},
};
use glam::{DAffine3, DMat4, DVec2, DVec3, DVec4, Vec2, Vec3};

/// An impostor in the place of one plant.
#[derive(Clone, Copy)]
pub(super) struct PlacedImpostor<'a> {
    pub(super) framing: Framing,
    pub(super) pages: FramePages<'a>,
    /// Bounding box of all leaves.
    pub(super) crown: Aabb,
    pub(super) world_from_plant: DAffine3,
    pub(super) sway: Option<Sway>,
    /// Share of the samples that it takes; the leaves have the others.
    pub(super) share: f32,
    /// Change of its lit colour.
    pub(super) tint: Tint,
    /// See [`Instance::seed`](crate::Instance::seed).
    pub(super) seed: u32,
}

/// A sprite on the screen.
pub(super) struct Sprite<'a> {
    frames: [Frame<'a>; 3],
    half_side: f32,
    /// Centre of the pictures, in the plant's space.
    center: DVec3,
    /// Eye relative to the centre.
    eye: Vec3,
    towards_eye: Vec3,
    axes: [Vec3; 2],
    radius: f32,
    /// Diameter in pixels that it is drawn with, and how many times its own that is.
    diameter_px: f32,
    enlarged: f32,
    /// Mip level, with a fraction.
    level: f32,
    is_deep: bool,
    tint: Tint,
    share: f32,
    /// Number by which the samples of plants differ.
    seed: u32,
    sway: Option<Sway>,
    clip_from_plant: DMat4,
    plant_from_clip: DMat4,
    depth: Depth,
    is_orthographic: bool,
    size: DVec2,
    /// Lighting of the plant.
    pub(super) light: Light,
    /// Columns and rows that it may touch, from the first to one past the last.
    pub(super) bounds: [[i64; 2]; 2],
}

/// One of the frames that are blended.
#[derive(Clone, Copy)]
struct Frame<'a> {
    /// Pages that have it, and its number among theirs.
    pages: Option<(&'a Pages, u32)>,
    weight: f32,
    towards: Vec3,
    axes: [Vec3; 2],
}

/// What a pixel of a sprite shows.
pub(super) struct Seen {
    /// Mask of the samples that it covers.
    pub(super) samples: u32,
    /// Depth as of [`Corner::nearness`](super::project::Corner::nearness).
    pub(super) nearness: f32,
    /// Linear colour without light.
    albedo: Vec3,
    /// Mean normal of the surfaces.
    normal: Vec3,
    /// Part of them that is leaves.
    leaf: f32,
    from_eye: Vec3,
}

/// Texel of both pages.
#[derive(Clone, Copy, Default)]
struct Texel {
    /// Linear colour, and coverage.
    color: [f32; 4],
    /// Mean normal to the right and up, depth, and code; see
    /// [`Impostor::surface`](crate::model::Impostor::surface).
    surface: [f32; 4],
}

impl<'a> Sprite<'a> {
    /// Places an impostor on a screen of `size` pixels; `None` if it cannot be seen.
    pub(super) fn new(
        placed: &PlacedImpostor<'a>,
        camera: &Camera,
        size: [u32; 2],
        lighting: &Lighting,
    ) -> Option<Self> {
        let PlacedImpostor { framing, pages, crown, world_from_plant, sway, share, tint, seed } = *placed;
        let plant_from_world = world_from_plant.inverse();
        let center = Vec3::from(framing.center).as_dvec3();
        let eye = (plant_from_world.transform_point3(camera.eye) - center).as_vec3();
        let towards_eye = eye.try_normalize()?;
        let axes = Lattice::axes(towards_eye);
        let clip_from_plant = camera.clip_from_world * world_from_plant;
        let radius = framing.radius();
        let own_px = camera.diameter_px(
            world_from_plant.transform_point3(center),
            f64::from(radius) * largest_scale(&world_from_plant),
        );
        let enlarged = (LEAST_PX / own_px).max(1.0);
        let diameter_px = own_px.max(LEAST_PX);
        let size = DVec2::new(f64::from(size[0]), f64::from(size[1]));
        let frames = framing.lattice.around(eye).map(|(frame, weight)| {
            let towards = framing.lattice.direction(frame);
            Frame { pages: pages.of(frame), weight, towards, axes: Lattice::axes(towards) }
        });
        let light = Light::new(&crown, plant_from_world.transform_point3(camera.eye), lighting);
        let mut sprite = Self {
            frames,
            half_side: framing.half_side,
            center,
            eye,
            towards_eye,
            axes,
            radius,
            diameter_px,
            enlarged,
            level: (((framing.frame_px - 2) as f32 / diameter_px).log2() - SHARPER_LEVELS).max(0.0),
            is_deep: diameter_px >= DEEP_FROM_PX,
            share,
            tint,
            seed: if share >= 1.0 { seed << 2 } else { 0 },
            sway,
            clip_from_plant,
            plant_from_clip: clip_from_plant.inverse(),
            depth: camera.depth,
            is_orthographic: camera.is_orthographic(),
            size,
            light: light.turned(&plant_from_world),
            bounds: [[0; 2]; 2],
        };
        sprite.bounds = sprite.bounds_on_screen()?;
        sprite.plant_from_clip.is_finite().then_some(sprite)
    }

    /// Pixels around the sprite's corners; `None` if it is not wholly before the eye.
    fn bounds_on_screen(&self) -> Option<[[i64; 2]; 2]> {
        let distance = self.eye.length();
        // The outline of the sphere, on the plane through its centre.
        let outline =
            distance / (distance * distance - self.radius * self.radius).max(0.01 * distance * distance).sqrt();
        let reach = self.radius * outline * self.enlarged + self.sway.map_or(0.0, |sway| sway.reach());
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
            let corner = (self.axes[0] * x + self.axes[1] * y) * reach;
            let clip = self.clip_from_plant * (self.center + corner.as_dvec3()).extend(1.0);
            if clip.w.is_nan() || clip.w <= 0.0 {
                return None;
            }
            let at = DVec2::new(clip.x / clip.w * 0.5 + 0.5, 0.5 - clip.y / clip.w * 0.5) * self.size;
            (low, high) = (low.min(at), high.max(at));
        }
        let range = |low: f64, high: f64, end: f64| [low.clamp(0.0, end) as i64, high.clamp(0.0, end).ceil() as i64];
        Some([range(low.x, high.x, self.size.x), range(low.y, high.y, self.size.y)])
    }

    /// What the pixel shows, if anything.
    pub(super) fn seen(&self, pixel: [i64; 2], srgb: &SrgbTable) -> Option<Seen> {
        let on_plane = self.on_plane([pixel[0] as f64 + 0.5, pixel[1] as f64 + 0.5])?;
        let ray = (on_plane - self.eye).normalize();
        let at = on_plane / self.enlarged;
        let shift = self.sway.map_or(Vec3::ZERO, |sway| sway.offset(self.center.as_vec3() + at));
        let origin = at - shift;
        let plane = Vec2::new(at.dot(self.axes[0]), at.dot(self.axes[1])) * (0.5 * self.diameter_px / self.radius);
        let cell =
            |salt: u32| hash([plane.x.floor() as i32, plane.y.floor() as i32, self.seed.wrapping_add(salt) as i32]);
        let (frames, level) = self.mixed(cell(2));
        let (mut coverage, mut color, mut normal, mut leaf, mut hit) = (0.0, Vec3::ZERO, Vec3::ZERO, 0.0, Vec3::ZERO);
        for frame in frames.iter().filter(|frame| frame.weight > 0.0) {
            let Some((texel, place)) = self.through(frame, origin, ray, level, srgb) else { continue };
            let weight = frame.weight * texel.color[3];
            let [right, up, _, code] = texel.surface;
            let towards = (2.0 * code - 1.0).abs();
            let [x, y] = frame.axes;
            coverage += weight;
            color += weight * Vec3::new(texel.color[0], texel.color[1], texel.color[2]);
            normal += weight * (x * (2.0 * right - 1.0) + y * (2.0 * up - 1.0) + frame.towards * towards);
            leaf += weight * f32::from(u8::from(code >= 0.5));
            hit += weight * place;
        }
        if coverage <= 0.0 {
            return None;
        }
        let hit = hit / coverage + shift;
        let shown = coverage / (self.enlarged * self.enlarged);
        let samples = covered_samples(shown, cell(0), cell(1), super::samples::SAMPLES as u32)
            & far_samples(pixel.map(|at| at as i32), self.share, super::samples::SAMPLES as u32);
        Some(Seen {
            samples,
            nearness: self.nearness(if self.is_deep { hit } else { self.pulled(at) })?,
            albedo: color / coverage,
            normal: normal / coverage,
            leaf: leaf / coverage,
            from_eye: hit - self.eye,
        })
    }

    /// The frames to blend, and the mip level: where the sprite is flat, one frame for each cell of
    /// about a pixel, as often as it weighs, on one level.
    fn mixed(&self, draw: f32) -> ([Frame<'a>; 3], f32) {
        if self.is_deep {
            return (self.frames, self.level);
        }
        let [first, second, _] = self.frames.map(|frame| frame.weight);
        let drawn = if draw < first { 0 } else { 1 + usize::from(draw >= first + second) };
        let mut frames = self.frames;
        (0..3).for_each(|i| frames[i].weight = if i == drawn { 1.0 } else { 0.0 });
        (frames, (self.level + (draw * 61.0).fract()).floor())
    }

    /// Linear light of a pixel.
    pub(super) fn shade(&self, seen: &Seen) -> Vec3 {
        let lit = |is_leaf| self.light.reflected_by_many(seen.albedo, seen.normal, seen.from_eye, is_leaf);
        self.tint.of(lit(false).lerp(lit(true), seen.leaf))
    }

    /// What a frame's picture shows on a ray, and its place. The picture is looked up where the ray
    /// meets the plane through the centre or, if the sprite is deep, the picture's depth.
    fn through(
        &self,
        frame: &Frame<'_>,
        origin: Vec3,
        ray: Vec3,
        level: f32,
        srgb: &SrgbTable,
    ) -> Option<(Texel, Vec3)> {
        let pages = frame.pages?;
        let approach = ray.dot(frame.towards).min(-LEAST_APPROACH);
        let before = origin.dot(frame.towards);
        let place = |height: f32| origin + ray * ((height - before) / approach);
        let uv = |at: Vec3| Vec2::new(at.dot(frame.axes[0]), -at.dot(frame.axes[1])) / self.half_side * 0.5 + 0.5;
        let placed = |surface: [f32; 4]| place((2.0 * surface[2] - 1.0) * self.half_side);
        // The last step's surface is the one that is shown: a pixel's fraction from the place.
        let (mut at, mut stepped) = (place(0.0), None);
        for _ in 0..if self.is_deep { DEPTH_STEPS } else { 0 } {
            let surface = texel(pages, uv(at), level, srgb).surface;
            (at, stepped) = (placed(surface), Some(surface));
        }
        let uv = uv(at);
        let is_inside = uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all();
        let shown = is_inside.then(|| texel(pages, uv, level, srgb))?;
        let surface = stepped.unwrap_or(shown.surface);
        Some((Texel { surface, ..shown }, placed(surface)))
    }

    /// Point relative to the centre where the ray through a point of the picture meets the plane
    /// through the centre that faces the eye.
    fn on_plane(&self, [x, y]: [f64; 2]) -> Option<Vec3> {
        let [x, y] = [x / self.size.x * 2.0 - 1.0, 1.0 - y / self.size.y * 2.0];
        let near = match self.depth {
            Depth::Reversed => 1.0,
            Depth::Standard => 0.0,
        };
        let at = |depth: f64| {
            let point = self.plant_from_clip * DVec4::new(x, y, depth, 1.0);
            point.truncate() / point.w - self.center
        };
        let (from, to) = (at(near), at(0.5));
        let towards = self.towards_eye.as_dvec3();
        let along = (to - from).dot(towards);
        let met = from - (to - from) * (from.dot(towards) / along);
        met.is_finite().then(|| met.as_vec3())
    }

    /// A point of the sprite's plane, moved towards the eye to the front of the crown.
    fn pulled(&self, at: Vec3) -> Vec3 {
        let to_eye = self.eye - at;
        let distance = to_eye.length();
        at + to_eye * (self.radius.min(MOST_PULL * distance) / distance)
    }

    fn nearness(&self, from_center: Vec3) -> Option<f32> {
        let clip = self.clip_from_plant * (self.center + from_center.as_dvec3()).extend(1.0);
        let is_between = Camera::between_planes(self.depth, clip).iter().all(|&distance| distance >= 0.0);
        let nearness = match (self.is_orthographic, self.depth) {
            (false, _) => 1.0 / clip.w,
            (true, Depth::Reversed) => clip.z / clip.w,
            (true, Depth::Standard) => 1.0 - clip.z / clip.w,
        };
        is_between.then_some(nearness as f32)
    }
}

/// Texel of both pages, filtered bilinearly on two levels.
fn texel((pages, frame): (&Pages, u32), uv: Vec2, level: f32, srgb: &SrgbTable) -> Texel {
    let last = pages.levels.len() - 1;
    let level = level.min(last as f32);
    let (first, part) = (level as usize, level.fract());
    let fine = on_level(&pages.levels[first], frame, uv, srgb);
    if part == 0.0 {
        return fine;
    }
    let coarse = on_level(&pages.levels[(first + 1).min(last)], frame, uv, srgb);
    let mix = |a: [f32; 4], b: [f32; 4]| std::array::from_fn(|i| a[i] + (b[i] - a[i]) * part);
    Texel { color: mix(fine.color, coarse.color), surface: mix(fine.surface, coarse.surface) }
}

fn on_level(level: &PageLevel, frame: u32, uv: Vec2, srgb: &SrgbTable) -> Texel {
    let side = level.side;
    let at = uv.clamp(Vec2::ZERO, Vec2::ONE) * side as f32 - 0.5;
    let first = at.floor();
    let part = at - first;
    let mut sum = Texel::default();
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let near = |at: f32, by: i32| (at as i32 + by).clamp(0, side as i32 - 1) as u32;
        let index = 4 * ((frame * side + near(first.y, dy)) * side + near(first.x, dx)) as usize;
        let share = |part: f32, by: i32| if by == 1 { part } else { 1.0 - part };
        let weight = share(part.x, dx) * share(part.y, dy);
        let [color, surface] = [&level.color, &level.surface].map(|page| &page[index..index + 4]);
        let rgb = srgb.color([color[0], color[1], color[2]]) * weight;
        (0..3).for_each(|i| sum.color[i] += rgb[i]);
        sum.color[3] += f32::from(color[3]) / 255.0 * weight;
        (0..4).for_each(|i| sum.surface[i] += f32::from(surface[i]) / 255.0 * weight);
    }
    sum
}
