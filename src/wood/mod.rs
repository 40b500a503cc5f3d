//! Wood as stems, and the order in which it loses detail.
//!
//! ```text
//! Wood --cut--> stems (tubes), their parents --collapse--> vertex after vertex onto another
//!                                             --thin-----> stem after stem
//!                                             --swell----> as wide as it takes
//!                                                          = WoodOrder
//! WoodOrder --ribbon--> centre lines of stems --level--> WoodLevels
//! WoodLevels, error --slide--> vertices on their way; triangles still drawn: a range
//! ```
//!
//! A **stem** is a tube of wood with a foot on its parent. Every vertex of the wood has a
//! **threshold**, an error in the plant's units, from which on it is drawn where its **parent**
//! vertex is; over the last fifth below its threshold it slides there. A triangle is drawn until
//! two of its corners meet. Triangles sorted by that error, the last one first, are drawn as a
//! prefix at any error: no state, no second set of vertices, nothing that pops. At an error of 0
//! all wood is drawn as it is.
//!
//! Stems at most four times as wide as the error, two pixels by default, are drawn as ribbons that
//! face the eye: a third of a tube's triangles, as wide as the tube from anywhere. Their triangles
//! lie before those of the tubes, in the other direction, so that one range holds both.
//!
//! The error of a collapse is the greatest distance of a vertex that is gone from the surface that
//! is left: what edge collapse is usually ordered by quadrics for (M. Garland, P. Heckbert,
//! *Surface Simplification Using Quadric Error Metrics*, 1997), measured. Half-edge collapses onto
//! vertices that exist keep their texture coordinates, normals and colours, and make progressive
//! meshes that need no other vertices (H. Hoppe, *Progressive Meshes*, 1996). Tubes and other wood
//! are treated alike: a ring less, a side less and a tip cut short are all collapses, and the least
//! harmful comes first.
//!
//! Stems thinner than the error are drawn with the probability at which those that are left, drawn
//! as wide as the error, cover as much as all of them would, after R. Cook et al., *Stochastic
//! Simplification of Aggregate Detail* (2007), for leaves. A stem never goes before those on it.
//! Every stem is widened by what was measured to be missing: a tube of three sides around a circle
//! covers 17 % less than a round one, and wide stems hide some of the thin ones.
//!
//! The drawers of this crate draw the wood of a model with an
//! [order](crate::FoliageModel::wood_order) at the error that their look allows (see
//! [`Look::wood_error_px`](crate::Look::wood_error_px)). For other engines, [`WoodLevels`] is the
//! wood at any error.
//!
//! At an error of half a pixel, wood covers within 2 % of what it does in full for oak, birch and
//! pecan of 64 to 1024 pixels. The oak's 52,751 triangles are 7,490, 3,240 and 1,250 at 256, 128
//! and 64 pixels; as tubes alone 13,850, 5,940 and 2,030.
//!
//! Limits: of thin twigs a random choice is drawn, so that pictures of bare wood differ pixel by
//! pixel: by 16 % of the oak's area at 256 pixels, by 50 % of a birch's. Widened stems are as wide
//! at their tips as the normals there make them. A stem that forks keeps its rings where others
//! begin. Vertices where nothing continues their texture, such as those of soup without shared
//! vertices, are never collapsed, only their whole stem goes.

mod boost;
#[cfg(feature = "simplify")]
mod build;
#[cfg(feature = "simplify")]
mod collapse;
#[cfg(feature = "simplify")]
mod cut;
mod grid;
mod level;
mod measure;
#[cfg(feature = "simplify")]
mod mesh;
mod order;
#[cfg(feature = "simplify")]
mod parents;
#[cfg(feature = "simplify")]
mod patch;
mod ribbon;
mod slide;
#[cfg(feature = "simplify")]
mod swell;
#[cfg(feature = "simplify")]
mod thin;
#[cfg(feature = "simplify")]
mod union;

#[cfg(feature = "simplify")]
pub use build::cut;
pub use level::{DrawnWood, WoodLevel, WoodLevels};
pub use measure::{Stem, nearest_stems, nearest_triangles, stems};
pub use order::{
    BOOSTS, Boosts, LEAST_SWELL, MAX_SLIDES, NO_SWELL, SWELL_STEPS, SWELLS, StemLink, Swell, WoodOrder, levels,
};

pub(crate) use ribbon::RIBBON;
#[cfg(feature = "software")]
pub(crate) use ribbon::facing;
pub use slide::{SLIDE, Slid, Slides, vanishing};
