//! CPU counterpart of the GPU renderer: draws a picture from the same camera, look and instances.

use super::{
    frame_pages::FramePages,
    ground::PlacedGround,
    image::Image,
    list::{DrawList, Drawn, Part, Placed, is_sound},
    live::{LiveFrames, LiveImpostors},
    options::{Background, DrawOptions},
    painter::{Contents, Painter, mean_leaf_color},
    sprite::PlacedImpostor,
    toning::Toning,
    wood::{SlidingWood, WoodAt},
};
use crate::{
    Camera, Error, Result,
    bounds::{Aabb, largest_scale},
    draw::{
        eye::Eye,
        ground::GroundPages,
        instance::{Frame, GroundCounts, Instance, ModelId, Prepared},
        landscape::REACH,
        look::{Coloring, Look},
        pages::Pages,
        tint::Tints,
        wood::limbs_of,
    },
    effects::{Counts, FadeBy, Limbs, wind::Shape},
    model::{FoliageModel, Framing, Timeline, Transition},
    terrain::{GroundMesh, Terrain},
};
use glam::{DVec3, Vec3};
use slotmap::SlotMap;
use std::{collections::HashMap, sync::Arc};

/// Maximum number of triangles in one picture; they take 2 GB.
const MOST_TRIANGLES: u64 = 1 << 23;

/// Draws instances of foliage models on the CPU.
///
/// Every effect except `shadow` is simulated for every plant, visible or not. Drawn scales always
/// come from the timeline: [`Instance::scales`] is ignored. Wood of models without an
/// [order](FoliageModel::wood_order) is drawn in full.
pub struct SoftwareRenderer<'a> {
    look: Look,
    models: SlotMap<ModelId, Model<'a>>,
    painter: Painter<'a>,
    live: Option<LiveImpostors>,
    ground: Option<(Arc<Terrain>, GroundPages)>,
}

/// A picture and its draw statistics.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// The picture.
    pub image: Image,
    /// Draw statistics. Shadows count as skipped, because the CPU draws none.
    pub prepared: Prepared,
}

struct Model<'a> {
    model: &'a FoliageModel,
    timeline: Timeline,
    shape: Shape,
    /// Centre of its bounding sphere.
    center: DVec3,
    /// Its limbs, if there is wind and its wood slides.
    limbs: Option<Limbs>,
    /// Mean shaded colour of the leaves, linear; 0 if neither tone nor the effect `contrast` acts.
    mean: [f32; 3],
    /// Index of its first material in the painter.
    first_material: u32,
    /// Its wood, if that slides.
    wood: Option<SlidingWood>,
    /// Its impostor, if the look hands plants over and it has one or gets one while drawing.
    far: Option<FarModel<'a>>,
}

struct FarModel<'a> {
    framing: Framing,
    frames: Frames<'a>,
    /// Bounding box of all leaves.
    crown: Aabb,
}

enum Frames<'a> {
    Baked(Pages),
    Live(Box<LiveFrames<'a>>),
}

impl<'a> SoftwareRenderer<'a> {
    /// Creates a renderer without models.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a parameter of the look that is out of range, and for a
    /// colouring other than [`Coloring::Picture`].
    pub fn new(look: Look) -> Result<Self> {
        look.check()?;
        if look.coloring != Coloring::Picture {
            return Err(Error::invalid("look.coloring", format!("{:?}", look.coloring), "Picture on the CPU"));
        }
        Ok(Self { look, models: SlotMap::default(), painter: Painter::new(&[], &[])?, live: None, ground: None })
    }

    /// Makes impostors for the models without one that are added from now on, if the look hands
    /// plants over: each picture first makes all frames that it needs and that are missing.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a size out of its range.
    pub fn with_live_impostors(mut self, live: LiveImpostors) -> Result<Self> {
        live.check()?;
        self.live = Some(live);
        Ok(self)
    }

    /// Draws ground with heights from now on, in pictures with a background; `None` draws only what
    /// the look says.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] if the look has no ground.
    pub fn set_terrain(&mut self, terrain: Option<Arc<Terrain>>) -> Result<()> {
        self.look.check_terrain(terrain.is_some())?;
        self.ground = terrain.map(|terrain| {
            let pages = GroundPages::new(&terrain);
            (terrain, pages)
        });
        Ok(())
    }

    /// Adds a model and decodes its textures.
    ///
    /// # Errors
    /// [`Error::InvalidModel`] for a model that breaks an invariant, [`Error::Unreadable`] for a
    /// damaged texture.
    pub fn add_model(&mut self, model: &'a FoliageModel) -> Result<ModelId> {
        model.validate()?;
        let mean = match self.look.tones(&model.growth) {
            true => mean_leaf_color(model, &self.look.lighting())?,
            false => [0.0; 3],
        };
        let first_material = self.painter.add(&model.materials, &model.textures)?;
        let (timeline, mut shape) = (Timeline::with_cards(model), Shape::new(&model.aabb()));
        let limbs = limbs_of(model, &self.look, DVec3::ZERO);
        shape.limbs = limbs.as_ref().map(Limbs::reach);
        let center = model.sphere().center();
        let far = self.look.far.map_or(Ok(None), |_| self.far(model))?;
        let wood = SlidingWood::new(model);
        Ok(self.models.insert(Model { model, timeline, shape, limbs, center, mean, first_material, wood, far }))
    }

    fn far(&self, model: &'a FoliageModel) -> Result<Option<FarModel<'a>>> {
        let crown = Aabb::of_points(model.vertices.iter().map(|vertex| vertex.position));
        if let Some(impostor) = &model.impostor {
            let frames = Frames::Baked(Pages::new(impostor));
            return Ok(Some(FarModel { framing: impostor.framing(), frames, crown }));
        }
        let Some(live) = self.live.filter(|_| model.sphere().radius > 0.0) else { return Ok(None) };
        let frames = LiveFrames::new(model, &live.bake)?;
        Ok(Some(FarModel { framing: *frames.framing(), frames: Frames::Live(Box::new(frames)), crown }))
    }

    /// Draws a frame; `size` is its width and height in pixels. Instances of unknown models are
    /// skipped.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for a size or camera that cannot be drawn, [`Error::TooLarge`] for
    /// more than eight million triangles.
    pub fn draw(&self, frame: impl Into<Frame>, instances: &[Instance], size: [u32; 2]) -> Result<Drawing> {
        let background = self.look.landscape().map_or(Background::Sky, Background::Landscape);
        self.draw_before(background, &frame.into(), instances, size)
    }

    /// Same as [`draw`](Self::draw) without anything behind the plants: alpha is the covered
    /// fraction of each pixel.
    ///
    /// # Errors
    /// Same as [`draw`](Self::draw).
    pub fn cutout(&self, frame: impl Into<Frame>, instances: &[Instance], size: [u32; 2]) -> Result<Drawing> {
        self.draw_before(Background::Transparent, &frame.into(), instances, size)
    }

    fn draw_before(
        &self,
        background: Background,
        frame: &Frame,
        instances: &[Instance],
        size: [u32; 2],
    ) -> Result<Drawing> {
        let (look, effects) = (&self.look, &self.look.effects);
        let camera = frame.jittered();
        let known = instances.iter().filter_map(|instance| {
            let model = self.models.get(instance.model)?;
            Some((model, instance, model.share(look, instance, &camera)))
        });
        let known: Vec<(&Model<'a>, &Instance, f32)> = known.collect();
        let near: Vec<(&Model<'a>, &Instance)> =
            known.iter().filter(|(.., share)| *share < 1.0).map(|&(model, instance, _)| (model, instance)).collect();
        let eye = Eye::new(frame);
        let error_px = look.wood_error_px;
        let steps: Vec<(u32, f32)> = near.iter().map(|(model, plant)| model.wood_step(&eye, plant, error_px)).collect();
        let wood_triangles: Vec<u64> =
            near.iter().zip(&steps).map(|((model, _), &(_, error))| model.wood_triangles(error)).collect();
        check_triangles(&near, &wood_triangles)?;
        let mut levels: HashMap<(ModelId, u32), (u32, WoodAt)> = HashMap::new();
        for ((model, instance), &(step, error)) in near.iter().zip(&steps) {
            let Some(wood) = &model.wood else { continue };
            levels
                .entry((instance.model, step))
                .or_insert_with(|| (model.first_material, wood.at(error, model.limbs.is_some())));
        }
        let wood: HashMap<(ModelId, u32), Vec<Part<'_>>> =
            levels.iter().map(|(&key, (first_material, wood))| (key, wood.parts(*first_material))).collect();
        let mut prepared = Prepared { draws: 1, effects: Counts::of(effects), ..Prepared::default() };
        prepared.live.made = self.make_frames(&known, &camera)?;
        let lists = self.lists(&near, &mut prepared);
        let sway = |model: &Model<'_>, instance: &Instance| {
            let sway = effects.wind?.at(frame.seconds).sway(&model.shape, &instance.world_from_plant);
            Some(sway.with_limbs(model.limb_shares(look, &eye, instance)))
        };
        let tints = Tints::new(look, frame.camera.eye);
        let tint = |model: &Model<'_>, plant: &Instance| {
            tints.of(plant, plant.world_from_plant.transform_point3(model.center))
        };
        let with_leaves = known.iter().filter(|(.., share)| *share < 1.0);
        let placed: Vec<Placed<'_>> = with_leaves
            .zip(&steps)
            .map(|(&(model, instance, far), &(step, _))| {
                let (tone, sway) = (self.toning(model, instance), sway(model, instance));
                let tint = tint(model, instance);
                let wood = wood.get(&(instance.model, step)).map_or(&[][..], Vec::as_slice);
                let riders = levels.get(&(instance.model, step)).map(|(_, wood)| &wood.riders);
                let limbs = model.limbs.as_ref().zip(riders);
                Placed {
                    wood,
                    tone,
                    sway,
                    limbs,
                    far,
                    tint,
                    ..Placed::new(&lists[&key(instance)], instance.world_from_plant)
                }
            })
            .collect();
        let with_impostors = known.iter().filter(|(.., share)| *share > 0.0);
        let impostors: Vec<PlacedImpostor<'_>> = with_impostors
            .filter_map(|&(model, instance, share)| {
                let FarModel { framing, frames, crown } = model.far.as_ref()?;
                let pages = match frames {
                    Frames::Baked(pages) => FramePages::Whole(pages),
                    Frames::Live(live) => FramePages::Each(&live.frames),
                };
                let sway = sway(model, instance);
                let world_from_plant = instance.world_from_plant;
                let (seed, tint) = (instance.seed, tint(model, instance));
                let framing = *framing;
                Some(PlacedImpostor { framing, pages, crown: *crown, world_from_plant, sway, share, tint, seed })
            })
            .filter(|placed| is_sound(&placed.world_from_plant))
            .collect();
        for plant in &placed {
            let of_leaves = plant.list.parts.iter().filter(|part| part.leaf.is_some()).count();
            prepared.leaves += of_leaves as u64;
            prepared.effects.add_plant();
            if let Some(sway) = plant.sway.filter(|_| plant.limbs.is_some()) {
                prepared.effects.add_limbs(sway.limbs);
            }
        }
        prepared.wood_triangles = wood_triangles.iter().sum();
        let sound = known.iter().filter(|(_, instance, _)| is_sound(&instance.world_from_plant));
        prepared.instances = sound.clone().count() as u32;
        sound.for_each(|&(model, plant, share)| prepared.far.add(share, model.diameter_px(plant, &camera)));
        prepared.skipped = instances.len() as u32 - prepared.instances;
        prepared.effects.shadow.iter_mut().for_each(|count| count.skipped = instances.len() as u64);
        let options = DrawOptions { lighting: look.lighting(), background, ..DrawOptions::default() };
        let mut mesh = GroundMesh::default();
        let mut ground = None;
        if let (Some((terrain, pages)), Background::Landscape(landscape)) = (&self.ground, background) {
            mesh.update(terrain, &frame.camera, REACH * landscape.ground.map_or(0.0, |ground| ground.haze));
            prepared.ground = GroundCounts::of(&mesh);
            ground = Some(PlacedGround { pages, mesh: &mesh, landscape });
        }
        let contents = Contents { plants: &placed, impostors: &impostors, ground: ground.as_ref() };
        let image = self.painter.draw_all(&contents, &camera, size, &options)?;
        Ok(Drawing { image, prepared })
    }

    /// Makes the frames of live impostors that plants need, and returns how many were missing.
    fn make_frames(&self, plants: &[(&Model<'a>, &Instance, f32)], camera: &Camera) -> Result<u32> {
        let mut needed: HashMap<ModelId, Vec<u32>> = HashMap::new();
        for (model, instance, share) in plants {
            let Some(FarModel { framing, frames: Frames::Live(_), .. }) = &model.far else { continue };
            if *share > 0.0 && is_sound(&instance.world_from_plant) {
                let eye = instance.world_from_plant.inverse().transform_point3(camera.eye);
                let from_center = eye - Vec3::from(framing.center).as_dvec3();
                let around = framing.lattice.around(from_center.as_vec3());
                let shown = around.iter().filter(|(_, weight)| *weight > 0.0);
                needed.entry(instance.model).or_default().extend(shown.map(|(frame, _)| frame));
            }
        }
        let mut made = 0;
        for (id, frames) in needed {
            if let Some(FarModel { frames: Frames::Live(live), .. }) = &self.models[id].far {
                made += live.make(frames.into_iter())?;
            }
        }
        Ok(made)
    }

    /// Tone of an instance's leaves: by their scales if the model asks for it, otherwise by the
    /// effect `contrast`.
    fn toning(&self, model: &Model<'_>, instance: &Instance) -> Option<Toning> {
        let tone = model.model.growth.tone;
        if self.look.tone && tone > 0.0 {
            return Some(Toning { mean: model.mean, kept: 1.0, tone });
        }
        let effect = self.look.effects.contrast?;
        Some(Toning { mean: model.mean, kept: effect.kept(instance.active, model.model.leaves.len()), tone: 0.0 })
    }

    /// Builds the draw lists, one for all plants with the same [`Key`], and counts fading leaves.
    fn lists(&self, plants: &[(&Model<'a>, &Instance)], prepared: &mut Prepared) -> HashMap<Key, DrawList<'a>> {
        let mut lists = HashMap::new();
        for (model, instance) in plants {
            let leaves = model.model.leaves.len() as u32;
            let active = f64::from(instance.active);
            let (transition, by) = match self.look.effects.fade {
                Some(fade) => (fade.transition(active, leaves), fade.by),
                None => (Transition::new(active, instance.window, leaves), FadeBy::Size),
            };
            prepared.effects.add_leaves(&transition);
            lists.entry(key(instance)).or_insert_with(|| {
                let drawn = Drawn { transition, by, leaf_scale: instance.leaf_scale };
                let mut list = DrawList::of_drawn(model.model, &model.timeline, &drawn);
                list.parts.retain(|part| part.leaf.is_some() || model.wood.is_none());
                list.parts
                    .iter_mut()
                    .for_each(|part| part.material = part.material.saturating_add(model.first_material));
                list
            });
        }
        lists
    }
}

impl Model<'_> {
    /// Step of the wood's error, and that error; 0 for wood that does not slide.
    fn wood_step(&self, eye: &Eye, plant: &Instance, error_px: f32) -> (u32, f32) {
        self.wood.as_ref().map_or((0, 0.0), |wood| wood.step(eye, plant, error_px))
    }

    /// Share of the motion that each level of limbs is simulated with.
    fn limb_shares(&self, look: &Look, eye: &Eye, plant: &Instance) -> [f32; 2] {
        let Some((wind, wood)) = look.effects.wind.zip(self.wood.as_ref()) else { return [0.0; 2] };
        wind.limb_shares(&self.shape, wood.pixels_per_unit(eye, plant))
    }

    /// Number of triangles of the wood that are drawn at an error.
    fn wood_triangles(&self, error: f32) -> u64 {
        self.wood.as_ref().map_or(self.model.wood.triangles() as u64, |wood| wood.triangles(error))
    }

    /// Share of an instance's samples that its impostor takes.
    fn share(&self, look: &Look, instance: &Instance, camera: &Camera) -> f32 {
        look.far.map_or(0.0, |far| far.share_of(self.diameter_px(instance, camera), instance.seed, instance.far))
    }

    /// Diameter in pixels of what an instance's impostor shows; infinite without an impostor.
    fn diameter_px(&self, instance: &Instance, camera: &Camera) -> f32 {
        let Some(model) = &self.far else { return f32::INFINITY };
        let to_world = &instance.world_from_plant;
        let center = to_world.transform_point3(Vec3::from(model.framing.center).as_dvec3());
        let radius = f64::from(model.framing.radius()) * largest_scale(to_world);
        camera.diameter_px(center, radius)
    }
}

/// Inputs of a draw list: model, and the bits of the active count, the window and the leaf scale.
type Key = (ModelId, [u32; 3]);

fn key(instance: &Instance) -> Key {
    (instance.model, [instance.active, instance.window, instance.leaf_scale].map(f32::to_bits))
}

fn check_triangles(plants: &[(&Model<'_>, &Instance)], of_wood: &[u64]) -> Result<()> {
    let leaves = |(Model { model, .. }, instance): &(&Model<'_>, &Instance)| {
        let last = (instance.active.ceil() as usize).min(model.leaves.len()).checked_sub(1);
        last.map_or(0, |last| u64::from(model.leaves[last].indices[1] / 3))
    };
    let value = plants.iter().map(leaves).chain(of_wood.iter().copied()).sum::<u64>();
    if value <= MOST_TRIANGLES {
        return Ok(());
    }
    let fix = "draw fewer trees, lower `lod`, or use `GpuDevice`".into();
    Err(Error::TooLarge { what: "triangles drawn on the CPU".into(), value, limit: MOST_TRIANGLES, fix })
}
