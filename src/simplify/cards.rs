//! Choice of the leaves that become cards of clusters, leaf by leaf, by what the views show.
//!
//! At each of a few active counts the plant is captured with its leaves enlarged, as without cards.
//! A card is then tried in the place of its leaf, alone: the gain is how much closer the views come
//! to the full plant's, before a pale sky, in squares of pixels that are as large as a pixel is
//! where so few leaves are drawn: a plant with a quarter of its leaves is seen half as large.
//! (Compared pixel by pixel, small leaves a little off their places cost as much as a large one
//! that is wrong, and nine of ten cards of a birch are left out.) Of the cards of a leaf, those
//! from some count on are kept: the more leaves one stands for, the better its picture is beside
//! one large leaf.
//!
//! Limits: a card has the look of its leaf here, so its gain is that of its outline and of what it
//! uncovers.

use super::{
    appearance::{Appearance, ViewLook},
    capture::{Captured, Shown, capture_leaves, capture_shown},
    clusters,
    fragments::FragmentSource,
    layers::Layers,
    masks::Masks,
    options::SimplifyOptions,
    order::PixelOrder,
    progress::Observer,
    raster::cover,
    shapes::Shapes,
    views::{ScreenPoint, ViewSet},
};
use crate::{
    Plant, Result,
    edge::SUBPIXEL,
    model::{Clusters, FoliageModel, Timeline, Transition},
};
use glam::DVec2;
use rayon::prelude::*;

/// Shares of the leaves with which cards are tried, and pixels along each side of the squares that
/// are compared there.
const TRIED: [(f64, u32); 7] = [(0.5, 1), (0.25, 2), (0.12, 3), (0.06, 4), (0.03, 6), (0.015, 8), (0.008, 11)];

/// The cards of a model that pay.
///
/// # Errors
/// The errors of `source`; [`Unreadable`](crate::Error::Unreadable) if a texture cannot be decoded;
/// [`Interrupted`](crate::Error::Interrupted) if the observer returns false.
pub fn chosen(
    model: &FoliageModel,
    options: &SimplifyOptions,
    source: &mut dyn FragmentSource,
    observer: &mut dyn Observer,
) -> Result<Clusters> {
    let all = clusters::all(model)?;
    if all.cards().is_empty() {
        return Ok(all);
    }
    let plant = model.to_plant();
    let views = ViewSet::new(plant.sphere(), options.resolution, options.views)?;
    let masks = Masks::new(&plant)?;
    let shapes = Shapes::new(&plant, &views, &masks, options.max_scale);
    source.prepare(&masks.masks)?;
    let of_cards = plant_of_cards(&all);
    let cards = Shapes::new(&of_cards, &views, &Masks::new(&of_cards)?, 1.0);
    let appearance = Appearance::image(&plant, &views)?;
    let timeline = Timeline::new(model);
    let trial = Trial { model, all: &all, timeline: &timeline, cards: &cards, appearance: &appearance };
    observer.phase("clusters", TRIED.len() as u64);
    let Shown { fronts, wood_depths, .. } = capture_shown(&shapes, &views, |_| Some(1.0), false, source, |_| true)?;
    let mut gains = vec![0_i64; all.cards().len()];
    for (step, (share, square)) in TRIED.into_iter().enumerate() {
        let count = ((model.leaves.len() as f64 * share) as u32).max(1);
        let scale = |leaf: usize| (leaf < count as usize).then(|| timeline.scale(leaf as u32, count));
        let Captured { layers, .. } = capture_leaves(&shapes, &views, scale, model.growth.tiles, &wood_depths, source)?;
        let of_view = |view: usize| trial.gains((count, square), &views, view, &layers[view], &fronts[view]);
        for of_view in (0..layers.len()).into_par_iter().map(of_view).collect::<Vec<_>>() {
            of_view.into_iter().for_each(|(card, gain)| gains[card] += gain);
        }
        if !observer.advance(step as u64 + 1) {
            return Err(crate::Error::Interrupted);
        }
    }
    Ok(kept(&all, &gains))
}

/// Of the cards of each leaf, those from the one on from which their gains add up to the most, if
/// that is above 0.
fn kept(all: &Clusters, gains: &[i64]) -> Clusters {
    let (mut cards, mut texels) = (Vec::new(), Vec::new());
    let mut at = 0;
    for of_leaf in all.cards().chunk_by(|a, b| a.leaf == b.leaf) {
        let (mut sum, mut best, mut from) = (0, 0, of_leaf.len());
        for card in (0..of_leaf.len()).rev() {
            sum += gains[at + card];
            if sum > best {
                (best, from) = (sum, card);
            }
        }
        for (card, kept) in of_leaf.iter().enumerate().skip(from) {
            cards.push(*kept);
            texels.extend_from_slice(&all.texels()[all.texel_range(at + card)]);
        }
        at += of_leaf.len();
    }
    Clusters::new(cards, texels)
}

/// A plant whose leaves are the cards.
fn plant_of_cards(clusters: &Clusters) -> Plant {
    let mut plant = Plant { materials: vec![Default::default()], ..Plant::default() };
    for (card, number) in clusters.cards().iter().zip(0..) {
        plant.push_leaf(clusters.corners(number), &[0, 1, 2, 0, 2, 3], card.center, 0);
    }
    plant
}

struct Trial<'a> {
    model: &'a FoliageModel,
    all: &'a Clusters,
    timeline: &'a Timeline,
    /// The cards as leaves.
    cards: &'a Shapes,
    appearance: &'a Appearance,
}

impl Trial<'_> {
    /// Gain of each card that shows at an active count, in one view, whose frontmost polygons at
    /// full detail are `full`, row by row.
    fn gains(
        &self,
        (count, square): (u32, u32),
        views: &ViewSet,
        view: usize,
        layers: &Layers,
        full: &[u32],
    ) -> Vec<(usize, i64)> {
        let transition = Transition::new(f64::from(count), 1.0, self.model.leaves.len() as u32);
        let order = PixelOrder::new(views.resolution);
        let mut squares = Squares::new(self.appearance.view(view), order, views.resolution, square);
        squares.compare(full, layers);
        let fronts = Places::new(layers, count as usize);
        // For each pixel, one more than the last card that showed there.
        let mut stamps = vec![0; views.pixels()];
        let mut projected = Vec::new();
        let mut of_card = |number: usize| {
            let shown = self.all.shown(number, self.timeline, &transition)?;
            let (leaf, shape) = (self.all.cards()[number].leaf, &self.cards.shapes[number]);
            let stamp = number as u32 + 1;
            self.cards.project(views, &views.views[view], shape, 1.0, &mut projected);
            for (triangle, ends) in (shape.triangles[0]..shape.triangles[1]).zip(ENDS) {
                let Some(corners) = self.cards.corners(shape, triangle, &projected) else { continue };
                let corners = corners.map(|ScreenPoint { x, y, .. }| [x, y]);
                let depth = self.cards.depth_plane(views, &views.views[view], shape, triangle, 1.0);
                cover(views.resolution, corners, |y, first, last| {
                    for x in first..=last {
                        let pixel = order.index(x as u32, y as u32);
                        let shows = || self.all.covers(number, &shown, place(&corners, ends, [x, y]));
                        let front = layers.front(pixel);
                        // Its own leaf is not there.
                        let before = u32::from(front == leaf);
                        if stamps[pixel as usize] != stamp
                            && layers.is_before(pixel, before, depth.depth(x, y), leaf)
                            && shows()
                        {
                            stamps[pixel as usize] = stamp;
                            squares.change(pixel, front, leaf);
                        }
                    }
                });
            }
            for &pixel in fronts.of(leaf) {
                if stamps[pixel as usize] != stamp {
                    squares.change(pixel, leaf, layers.second(pixel));
                }
            }
            Some((number, squares.gain()))
        };
        (0..self.all.cards().len()).filter_map(&mut of_card).collect()
    }
}

/// Channels of a look, and coverage.
const CHANNELS: usize = 7;
/// Value of a covered pixel.
const COVERED: i32 = 128;

/// Squares of pixels of a view, and how they differ from the full plant's.
struct Squares<'a> {
    look: ViewLook<'a>,
    order: PixelOrder,
    across: usize,
    side: u32,
    /// Sum over the pixels of each square of what they show less what they should.
    off: Vec<[i32; CHANNELS]>,
    /// The same for the changes of one card, in the squares that are listed.
    changes: Vec<[i32; CHANNELS]>,
    changed: Vec<u32>,
}

impl<'a> Squares<'a> {
    fn new(look: ViewLook<'a>, order: PixelOrder, resolution: u32, side: u32) -> Self {
        let across = resolution.div_ceil(side) as usize;
        let zero = vec![[0; CHANNELS]; across * across];
        Self { look, order, across, side, off: zero.clone(), changes: zero, changed: Vec::new() }
    }

    fn value(&self, row: u32) -> [i32; CHANNELS] {
        let [r, g, b, x, y, z, ..] = self.look.before_sky(row).map(i32::from);
        [r, g, b, x, y, z, if self.look.is_background(row) { 0 } else { COVERED }]
    }

    fn square(&self, [x, y]: [u32; 2]) -> usize {
        (y / self.side) as usize * self.across + (x / self.side) as usize
    }

    fn compare(&mut self, full: &[u32], layers: &Layers) {
        for (number, &reference) in (0..).zip(full) {
            let index = self.order.index_of(number);
            let (now, goal) = (self.value(layers.front(index)), self.value(reference));
            let square = self.square(self.order.pixel(index));
            (0..CHANNELS).for_each(|i| self.off[square][i] += now[i] - goal[i]);
        }
    }

    /// Polygon `after` takes the place of `before` in a pixel.
    fn change(&mut self, pixel: u32, before: u32, after: u32) {
        if before == after {
            return;
        }
        let (before, after) = (self.value(before), self.value(after));
        let square = self.square(self.order.pixel(pixel));
        if self.changes[square] == [0; CHANNELS] {
            self.changed.push(square as u32);
        }
        (0..CHANNELS).for_each(|i| self.changes[square][i] += after[i] - before[i]);
    }

    /// Takes the changes back, and returns how much less the squares differed with them, times the
    /// pixels of a square.
    fn gain(&mut self) -> i64 {
        let mut gain = 0;
        for square in self.changed.drain(..) {
            let change = std::mem::replace(&mut self.changes[square as usize], [0; CHANNELS]);
            for (off, change) in
                self.off[square as usize].into_iter().zip(change).map(|(a, b)| (i64::from(a), i64::from(b)))
            {
                gain -= change * (2 * off + change);
            }
        }
        gain / i64::from(self.side * self.side)
    }
}

/// Texture coordinates of the corners of a card's triangles.
const ENDS: [[[f64; 2]; 3]; 2] = [[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]];

/// Texture coordinates in the middle of a pixel, as if the card were parallel to the view.
fn place(corners: &[[i64; 2]; 3], ends: [[f64; 2]; 3], [x, y]: [i64; 2]) -> [f32; 2] {
    let [a, b, c] = corners.map(|at| DVec2::from(at.map(|at| at as f64)));
    let at = DVec2::new((x * SUBPIXEL) as f64, (y * SUBPIXEL) as f64);
    let shares = [(c - b).perp_dot(at - b), (a - c).perp_dot(at - c), (b - a).perp_dot(at - a)];
    let whole = (b - a).perp_dot(c - a);
    [0, 1].map(|axis| ((0..3).map(|i| ends[i][axis] * shares[i]).sum::<f64>() / whole).clamp(0.0, 1.0) as f32)
}

/// Pixels in which each leaf is frontmost.
struct Places {
    starts: Vec<u32>,
    pixels: Vec<u32>,
}

impl Places {
    fn new(layers: &Layers, leaves: usize) -> Self {
        let fronts = || layers.fronts().zip(0_u32..).filter(|([front, _], _)| (*front as usize) < leaves);
        let mut starts = vec![0_u32; leaves + 2];
        fronts().for_each(|([front, _], _)| starts[front as usize + 2] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let mut pixels = vec![0; starts.last().map_or(0, |&end| end as usize)];
        for ([front, _], pixel) in fronts() {
            let next = &mut starts[front as usize + 1];
            pixels[*next as usize] = pixel;
            *next += 1;
        }
        Self { starts, pixels }
    }

    fn of(&self, leaf: u32) -> &[u32] {
        let [start, end] = [0, 1].map(|i| self.starts[leaf as usize + i] as usize);
        &self.pixels[start..end]
    }
}
