//! Choice of how enlarged leaves are drawn: their tone by how many leaves lie behind each other,
//! tiles by what a trial showed.

use super::{
    options::GrowBy,
    trial::{Trial, Tried},
};

/// Tones of crowns with ten and more leaves behind each other, and with hardly two. Where leaves
/// hide each other, few are enlarged much and their own colours are right; where they do not, every
/// leaf stands for others that are lit differently.
const TONES: [f64; 2] = [0.1, 0.3];
/// Tone times the number of layers. Of tones that all plants have in common, 0.3 is good for a
/// sparse birch (3 to 5 % less RMSE) and 0.1 for a dense oak (1 to 3 % less), where 0.3 is up to
/// 4 % worse.
const TONE_TIMES_LAYERS: f64 = 0.5;

/// Tone of a plant with so many leaves behind each other, on average, where one shows.
pub fn tone(layers: f64) -> f32 {
    (TONE_TIMES_LAYERS / layers.max(1.0)).clamp(TONES[0], TONES[1]) as f32
}

/// Share of the leaves that can grow by tiling from which on a trial is made.
const LEAST_TILED: f64 = 0.5;

/// Whether a trial tells how leaves grow, of which a share can by tiling.
pub fn needs_trial(grow_by: GrowBy, tileable: f64) -> bool {
    matches!(grow_by, GrowBy::Auto | GrowBy::Picture) && tileable >= LEAST_TILED
}

/// Whether leaves grow by tiling, of which a share can.
pub fn tiles(grow_by: GrowBy, tileable: f64, trial: Option<&Trial>) -> bool {
    match grow_by {
        GrowBy::Scale => false,
        GrowBy::Tile => tileable > 0.0,
        GrowBy::Auto | GrowBy::Picture => trial.is_some_and(favors_tiles),
    }
}

/// Largest error and silhouette difference of tiles, over those of scaled leaves, with which they
/// are chosen. The trial finds 0.95 and 1.05 for a white oak, whose tiles have 1 % less error and 7
/// % more silhouette difference in held-out views; 1.06 and 1.24 for an oak made by ez-tree, whose
/// tiles have 6 % and 17 % more. Its views are coarse, so it finds 0.1 more of the second than
/// pictures of the same size.
const MOST: [f64; 2] = [1.0, 1.2];
/// How much farther from 1 the grain of tiles may be than that of scaled leaves: tiles of leaves
/// that fill little of their pictures, such as a zelkova's (0.17), read as a net.
const MOST_GRAIN: f64 = 0.15;

fn favors_tiles(Trial { scale, tile }: &Trial) -> bool {
    let off = |shown: &Tried| (shown.grain - 1.0).abs();
    tile.rmse <= MOST[0] * scale.rmse && tile.xor <= MOST[1] * scale.xor && off(tile) <= off(scale) + MOST_GRAIN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_chosen_where_neither_error_nor_outline_nor_grain_suffers() {
        let scale = Tried { rmse: 10.0, xor: 0.2, grain: 0.9 };
        let chosen = |tile: Tried| tiles(GrowBy::Auto, 1.0, Some(&Trial { scale, tile }));
        assert!(chosen(Tried { rmse: 9.9, xor: 0.22, grain: 1.1 }));
        assert!(!chosen(Tried { rmse: 10.1, xor: 0.1, grain: 1.0 }));
        assert!(!chosen(Tried { rmse: 9.0, xor: 0.25, grain: 1.0 }));
        assert!(!chosen(Tried { rmse: 9.0, xor: 0.1, grain: 1.26 }));
        assert!(!chosen(Tried { rmse: 9.0, xor: 0.1, grain: 0.74 }));
        assert!(!tiles(GrowBy::Auto, 1.0, None) && !tiles(GrowBy::Tile, 0.0, None) && tiles(GrowBy::Tile, 0.1, None));
    }
}
