//! Reads the `.fol` files of Intel's foliage sample as patches.
//!
//! After D. McNabb, *Foliage Patch* (Intel, 2013), whose files have a block `[Foliage_DX11]` with
//! the size of the patches and the ground, and blocks `[plant 1]`, `[plant 2]` ... until one is
//! missing. A line is `key = value`, a comment or empty; `;` begins a comment; keys are the same in
//! capitals and small letters. Missing keys have the sample's defaults.
//!
//! Differs: each kind's share is what its map says, where in the sample later kinds take the place
//! of earlier ones. Textures are named, not loaded: `.dds` pictures have to be saved as PNG.

use super::{
    entry::PatchEntry,
    kind::{PlantKind, Spacing},
};
use crate::{Error, Result};
use std::{collections::HashMap, path::Path};

/// Metres of a foot, the unit of the sample's files.
pub const FOOT: f64 = 0.3048;
/// Name that stands for no texture.
const UNDEFINED: &str = "$Undefined";
/// Most blocks of a file.
const MOST_BLOCKS: usize = 4096;

/// A patch from a `.fol` file. Lengths are in the units asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct FolFile {
    /// The patch: an area of all its patches, around the origin. Models are named after the kinds'
    /// asset sets, or else their pictures; maps are not set.
    pub entry: PatchEntry,
    /// The ground's height map.
    pub ground: FolGround,
    /// What is drawn for each kind, in the patch's order.
    pub plants: Vec<FolPlant>,
    /// What was left out, with the number of its line.
    pub warnings: Vec<String>,
}

/// Height map of a `.fol` file.
#[derive(Debug, Clone, PartialEq)]
pub struct FolGround {
    /// Name of its texture; `None` if there is none.
    pub texture: Option<String>,
    /// Heights of black and white.
    pub heights: [f64; 2],
    /// Side lengths of the texture in the world.
    pub size: [f64; 2],
}

/// What the sample draws for a kind: the same pictures for all its plants.
#[derive(Debug, Clone, PartialEq)]
pub struct FolPlant {
    /// Geometry drawn near the camera; `None` draws the picture there too.
    pub asset_set: Option<String>,
    /// Distance within which it is drawn.
    pub asset_reach: f64,
    /// Name of the picture with coverage, of its normals, and of the probability map.
    pub textures: [Option<String>; 3],
    /// Distances over which the picture appears as the camera comes near; `None` if it always has.
    pub far_fade: Option<[f64; 2]>,
    /// Distances over which it vanishes as the camera comes nearer; `None` if it never does.
    pub near_fade: Option<[f64; 2]>,
    /// Shift of the geometry against the picture.
    pub offset: [f64; 2],
    /// Left, right, top and bottom texture coordinate.
    pub uv: [f32; 4],
}

/// A block: its values by lower-case key, each with its line.
#[derive(Debug, Default)]
struct Block<'a> {
    values: HashMap<String, (usize, &'a str)>,
}

impl FolFile {
    /// Reads a file; `unit` is what one of its units is in the scene's, such as [`FOOT`].
    ///
    /// # Errors
    /// [`Error::Io`]; otherwise those of [`parse`](Self::parse).
    pub fn read(path: impl AsRef<Path>, unit: f64) -> Result<Self> {
        let path = path.as_ref();
        let text = std::io::read_to_string(crate::file::open(path)?).map_err(|error| Error::io(path, error))?;
        Self::parse(&text, path, unit)
    }

    /// Reads the text of a file; `origin` names it in error messages.
    ///
    /// # Errors
    /// [`Error::Unreadable`] with the line for a value that is no number, and for numbers that no
    /// patch can have.
    pub fn parse(text: &str, origin: &Path, unit: f64) -> Result<Self> {
        let reader = Reader { origin, unit };
        let (mut blocks, mut warnings) = reader.blocks(text)?;
        let Some(mut patch) = blocks.remove("foliage_dx11") else {
            let fix = "begin it with [Foliage_DX11], as the sample's files do";
            return Err(Error::unreadable(origin, "there is no block [Foliage_DX11]", fix));
        };
        let mut whole = |key: &str| -> Result<f64> { Ok(reader.number(&mut patch, key, 128.0)?.floor()) };
        let plants_wide = [whole("widthInPlants")?, whole("heightInPlants")?];
        let patches = [whole("widthInPatches")?, whole("heightInPatches")?];
        let ground = reader.ground(&mut patch, &mut warnings)?;
        patch.take("material");
        let (mut kinds, mut plants) = (Vec::new(), Vec::new());
        while let Some(mut block) = blocks.remove(&format!("plant {}", kinds.len() + 1)) {
            let plant = reader.plant(&mut block)?;
            kinds.push(reader.kind(&mut block, &plant, kinds.len())?);
            plants.push(plant);
            block.tell_rest(&format!("[plant {}]", kinds.len()), &mut warnings);
        }
        patch.tell_rest("[Foliage_DX11]", &mut warnings);
        let mut others: Vec<String> = blocks.into_keys().collect();
        others.sort_unstable();
        warnings.extend(others.iter().map(|name| format!("block [{name}] is left out: no [plant k] leads up to it")));
        let Some(first) = kinds.first().map(|kind| kind.spacing.each()) else {
            return Err(Error::unreadable(origin, "there is no block [plant 1]", "give at least one plant"));
        };
        let area = [0, 1].map(|axis| patches[axis] * plants_wide[axis] * first[axis]);
        let cells = plants_wide[0].clamp(1.0, 1024.0) as u32;
        let entry = PatchEntry { area: Some(area), cells, ..PatchEntry::new(kinds) };
        entry.check(key_of).map_err(|error| {
            let Error::InvalidOption { field, value, allowed } = error else { return error };
            Error::unreadable(origin, format!("{field} is {value}"), format!("it must be {allowed}"))
        })?;
        Ok(Self { entry, ground, plants, warnings })
    }
}

/// The file's own key of a patch's parameter.
fn key_of(name: &str) -> String {
    let (of, name) = match name.strip_prefix("kinds.").and_then(|rest| rest.split_once('.')) {
        Some((number, name)) => (format!("[plant {}] ", number.parse().unwrap_or(0) + 1), name),
        None => (String::new(), name),
    };
    let key = match name {
        "spacing" => "plantSpacingWidth or plantSpacingHeight",
        "jitter" => "positionRandomScale",
        "height" => "sizeMin or sizeMax",
        "ratio" => "widthRatioMin or widthRatioMax",
        "reach" => "FarFadeEnd",
        "area" => "widthInPatches or heightInPatches times the plants' width",
        "cells" => "widthInPlants",
        "kinds" => "the number of plants",
        other => other,
    };
    of + key
}

/// Reads values of one file.
struct Reader<'a> {
    origin: &'a Path,
    unit: f64,
}

impl Reader<'_> {
    fn blocks<'t>(&self, text: &'t str) -> Result<(HashMap<String, Block<'t>>, Vec<String>)> {
        let (mut blocks, mut warnings) = (HashMap::<String, Block<'t>>::new(), Vec::new());
        let mut current = None;
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.split(';').next().unwrap_or_default().trim();
            if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
                let name = name.trim().to_lowercase();
                if blocks.len() >= MOST_BLOCKS {
                    let reason = format!("line {number}: more than {MOST_BLOCKS} blocks");
                    return Err(Error::unreadable(self.origin, reason, "split it into several files"));
                }
                blocks.entry(name.clone()).or_default();
                current = Some(name);
            } else if let Some((key, value)) = line.split_once('=') {
                let block = current.as_ref().and_then(|name| blocks.get_mut(name));
                match block {
                    Some(block) => {
                        block.values.insert(key.trim().to_lowercase(), (number, value.trim()));
                    }
                    None => warnings.push(format!("line {number}: {:?} is left out: it is in no block", key.trim())),
                }
            } else if !line.is_empty() {
                let shown: String = line.chars().filter(|c| !c.is_control()).take(40).collect();
                let fix = "write key = value, [block] or ; comment";
                return Err(Error::unreadable(self.origin, format!("line {number} is {shown:?}"), fix));
            }
        }
        Ok((blocks, warnings))
    }

    fn number(&self, block: &mut Block<'_>, key: &str, default: f64) -> Result<f64> {
        let Some((line, text)) = block.take(key) else { return Ok(default) };
        let value: Option<f64> = text.parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| {
            let shown: String = text.chars().filter(|c| !c.is_control()).take(40).collect();
            Error::unreadable(self.origin, format!("line {line}: {key} is {shown:?}"), "it must be a number")
        })
    }

    fn length(&self, block: &mut Block<'_>, key: &str, default: f64) -> Result<f64> {
        Ok(self.number(block, key, default)? * self.unit)
    }

    fn ground(&self, block: &mut Block<'_>, warnings: &mut Vec<String>) -> Result<FolGround> {
        let offset = self.length(block, "heightOffset", 0.0)?;
        let scale = self.length(block, "heightScale", 600.0)?;
        let width = self.length(block, "heightTextureWorldWidth", 5285.28)?;
        let depth = self.length(block, "heightTextureWorldHeight", 5285.28)?;
        // The sample maps the world's sides to the textures'.
        self.length(block, "worldWidth", 5273.76)?;
        self.length(block, "worldHeight", 5273.76)?;
        let line = block.line("HeightTexture");
        let texture = block.texture("HeightTexture").filter(|name| {
            let is_made = name.starts_with('$');
            if is_made {
                warnings
                    .push(format!("line {line}: {name} is left out: the sample's program makes it, no file has it"));
            }
            !is_made
        });
        Ok(FolGround { texture, heights: [offset, offset + scale], size: [width, depth] })
    }

    fn plant(&self, block: &mut Block<'_>) -> Result<FolPlant> {
        let mut length = |key, default| self.length(block, key, default);
        let near = [length("NearFadeStart", 0.0)?, length("NearFadeEnd", -1.0)?];
        let far = [length("FarFadeStart", 0.0)?, length("FarFadeEnd", -1.0)?];
        let asset_reach = length("3DFarClipDistance", 10.0)?;
        let offset = [length("OffsetX", 0.0)?, length("OffsetY", 0.0)?];
        let mut number = |key, default| Ok(self.number(block, key, default)? as f32);
        let uv: [Result<f32>; 4] =
            [number("ULeft", 0.0), number("URight", 1.0), number("VTop", 1.0), number("VBottom", 0.0)];
        let [left, right, top, bottom] = uv;
        let textures = ["billboardColorTexture", "billboardNormalTexture", "billboardProbabilityTexture"];
        Ok(FolPlant {
            asset_set: block.texture("assetSet"),
            asset_reach,
            textures: textures.map(|key| block.texture(key)),
            // An end below 0 switches a fade off.
            far_fade: (far[1] >= 0.0).then_some(far),
            near_fade: (near[1] >= 0.0).then_some(near),
            offset,
            uv: [left?, right?, top?, bottom?],
        })
    }

    fn kind(&self, block: &mut Block<'_>, plant: &FolPlant, before: usize) -> Result<PlantKind> {
        let mut length = |key, default| self.length(block, key, default);
        let spacing = [length("plantSpacingWidth", 2.5)?, length("plantSpacingHeight", 2.5)?];
        let height = [length("sizeMin", 2.0)?, length("sizeMax", 3.0)?].map(|height| height as f32);
        let mut number = |key, default| Ok(self.number(block, key, default)? as f32);
        let (narrow, wide): (Result<f32>, Result<f32>) = (number("widthRatioMin", 0.5), number("widthRatioMax", 1.0));
        let jitter: Result<f32> = number("positionRandomScale", 0.5);
        let stem = |name: &String| Path::new(name).file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let named = plant.asset_set.as_ref().or(plant.textures[0].as_ref()).and_then(stem);
        Ok(PlantKind {
            spacing: Spacing::Each(spacing),
            jitter: jitter?,
            ratio: [narrow?, wide?],
            reach: plant.far_fade.map(|fade| fade[1]),
            ..PlantKind::new(named.unwrap_or_else(|| format!("plant {}", before + 1)), spacing[0], height)
        })
    }
}

impl<'a> Block<'a> {
    /// Takes out a value, with its line.
    fn take(&mut self, key: &str) -> Option<(usize, &'a str)> {
        self.values.remove(&key.to_lowercase())
    }

    fn line(&self, key: &str) -> usize {
        self.values.get(&key.to_lowercase()).map_or(0, |value| value.0)
    }

    /// Takes out a name, unless it stands for none.
    fn texture(&mut self, key: &str) -> Option<String> {
        self.take(key).map(|value| value.1.to_owned()).filter(|name| !name.is_empty() && name != UNDEFINED)
    }

    /// Warns of the keys that nothing has taken.
    fn tell_rest(self, block: &str, warnings: &mut Vec<String>) {
        let mut rest: Vec<(usize, String)> = self.values.into_iter().map(|(key, (line, _))| (line, key)).collect();
        rest.sort_unstable();
        warnings
            .extend(rest.into_iter().map(|(line, key)| format!("line {line}: {key:?} is left out: no key of {block}")));
    }
}
