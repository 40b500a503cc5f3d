//! `foliage-lod report SCENE --budgets`: what accuracy costs in time, by each rule of a budget.

use crate::{
    drawing::Drawer,
    failure::Failure,
    interrupt,
    output::Steps,
    progress::spinning,
    scene::{Budgeting, Opened},
};
use foliage_lod::{
    Result,
    gpu::{GpuDevice, guarded},
    measure::{Comparison, largest_change},
    scene::{Amount, BudgetEntry, Portions},
    software::Image,
};
use foliage_lod_cli::report::BudgetRow;
use indicatif::HumanCount;
use serde_json::{Value, json};
use std::time::Instant;

/// Number of places along the camera's path.
const PLACES: u32 = 10;
/// Seconds from one to the next.
const SECONDS_BETWEEN: f64 = 2.0;
/// Seconds from one frame of a pair to the next.
const FRAME_SECONDS: f64 = 1.0 / 60.0;
/// Budgets, as fractions of the leaves in view.
const SHARES: [f64; 2] = [0.03, 0.1];
/// Rules, whether they go by what shows behind others, and their names.
const RULES: [(Portions, bool, &str); 6] = [
    (Portions::Error, false, "least error"),
    (Portions::Error, true, "least error, by what shows"),
    (Portions::Equal, false, "equal error"),
    (Portions::Cook, false, "Cook"),
    (Portions::Gomez, false, "Gomez"),
    (Portions::Uniform, false, "uniform"),
];

/// A rule, and what was measured of it.
struct Case {
    rule: String,
    share: f64,
    /// Whether every leaf is drawn.
    full: bool,
    budget: Budgeting,
    leaves: f64,
    seconds: Vec<f64>,
    sums: Comparison,
    change: f64,
    first: Option<Image>,
    last: Option<Image>,
}

impl Case {
    fn new(rule: &str, share: f64, full: bool, entry: Option<BudgetEntry>) -> Self {
        Self {
            rule: rule.into(),
            share,
            full,
            budget: Budgeting::of(entry),
            leaves: 0.0,
            seconds: Vec::new(),
            sums: Comparison::default(),
            change: 0.0,
            first: None,
            last: None,
        }
    }

    fn row(mut self) -> BudgetRow {
        self.seconds.sort_by(f64::total_cmp);
        let at = |share: f64| self.seconds[((self.seconds.len() - 1) as f64 * share).round() as usize];
        BudgetRow {
            seconds: [0.5, 0.95, 0.99].map(at),
            rule: self.rule,
            share: self.share,
            leaves: self.leaves / f64::from(2 * PLACES),
            quality: self.sums.quality(),
            change: self.change,
            image: self.first.unwrap_or_else(|| Image::filled(1, 1, [0; 4])),
        }
    }
}

/// Measures the rules, each frame by all of them in turn.
///
/// # Errors
/// GPU errors, and [`Interrupted`](foliage_lod::Error::Interrupted).
pub fn study(
    gpu: &GpuDevice,
    opened: &mut Opened,
    size: [u32; 2],
    steps: &mut Steps,
) -> std::result::Result<Vec<BudgetRow>, Failure> {
    let (effects, budget) = (std::mem::take(&mut opened.file.effects), opened.file.budget);
    opened.set_budget(None);
    opened.measure(steps)?;
    let cases = spinning("drawing", || guarded(|| measured(gpu, opened, size)));
    opened.file.effects = effects;
    opened.set_budget(budget);
    let rows: Vec<BudgetRow> = cases?.into_iter().map(Case::row).collect();
    for BudgetRow { rule, share, leaves, seconds, quality, .. } in &rows {
        let budget = if share.is_nan() { String::new() } else { format!(" at {:.0} %", 100.0 * share) };
        let (leaves, ms) = (HumanCount(*leaves as u64), 1e3 * seconds[0]);
        steps.done(
            "budget",
            format!("{rule}{budget}: {leaves} leaves, {ms:.1} ms per frame, RMSE {:.2}", quality.rmse),
        )?;
    }
    Ok(rows)
}

fn measured(gpu: &GpuDevice, opened: &mut Opened, size: [u32; 2]) -> Result<Vec<Case>> {
    let mut drawer = Drawer::new(gpu.clone(), &opened.staging(0.0, size, true)?, size)?;
    let frames = || (0..PLACES).flat_map(|place| [None, Some(FRAME_SECONDS)].map(|after| (place, after)));
    let at = |place: u32, after: Option<f64>| f64::from(place) * SECONDS_BETWEEN + after.unwrap_or_default();
    let mut in_view = 0.0;
    for (place, after) in frames() {
        let staging = opened.staging(at(place, after), size, true)?;
        in_view += staging.plants.iter().map(|plant| f64::from(plant.active)).sum::<f64>() / f64::from(2 * PLACES);
    }
    let mut cases =
        vec![Case::new("every leaf", f64::NAN, true, None), Case::new("by size on screen", f64::NAN, false, None)];
    for share in SHARES {
        cases.extend(RULES.map(|(rule, visibility, name)| {
            let entry = BudgetEntry { rule, visibility, ..BudgetEntry::of(Amount::Leaves(share * in_view)) };
            Case::new(name, share, false, Some(entry))
        }));
    }
    // The first picture warms up.
    let first = opened.staging(0.0, size, true)?;
    drawer.prepare(&first)?;
    drawer.picture()?;
    for (place, after) in frames() {
        // Of every leaf, the first case.
        let (mut truth, mut own_change) = (None, None);
        for case in &mut cases {
            interrupt::check()?;
            opened.exchange(&mut case.budget);
            let staging = opened.staging_after(at(place, after), size, case.full, after)?;
            let started = Instant::now();
            case.leaves += drawer.prepare(&staging)?.leaves as f64;
            let image = drawer.picture()?;
            case.seconds.push(started.elapsed().as_secs_f64());
            opened.exchange(&mut case.budget);
            let truth = truth.get_or_insert_with(|| image.clone());
            case.sums = case.sums.plus(Comparison::of(&image, truth)?);
            case.first.get_or_insert_with(|| image.clone());
            let pair = [case.last.take().unwrap_or_else(|| image.clone()), image];
            let change = largest_change(&pair)?;
            let own = *own_change.get_or_insert(change);
            if after.is_some() && own > 0.0 {
                case.change = case.change.max(change / own);
            }
            let [_, image] = pair;
            case.last = Some(image);
        }
    }
    Ok(cases)
}

/// The rows as JSON.
pub fn json_rows(scene: &str, rows: &[BudgetRow]) -> Vec<Value> {
    let row = |row: &BudgetRow| {
        json!({
            "scene": scene,
            "rule": row.rule,
            "budget": row.share.is_finite().then_some(row.share),
            "leaves": row.leaves,
            "frame_seconds": { "p50": row.seconds[0], "p95": row.seconds[1], "p99": row.seconds[2] },
            "rmse": row.quality.rmse,
            "ssim": row.quality.ssim,
            "flip": row.quality.flip.is_finite().then_some(row.quality.flip),
            "largest_change": row.change,
        })
    };
    rows.iter().map(row).collect()
}
