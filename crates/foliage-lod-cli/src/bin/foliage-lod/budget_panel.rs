//! The budget of a scene in the window's panel.

use crate::{scene::Opened, staging::Shown};
use foliage_lod::{
    Result,
    scene::{
        Amount, BudgetEntry, Portions,
        budget::{Pace, Spent, Times},
    },
};
use foliage_lod_cli::window::{FrameTimes, egui};
use indicatif::HumanCount;

/// A unit of the slider.
struct Unit {
    of: fn(f64) -> Amount,
    range: [f64; 2],
    first: f64,
}

const UNITS: [Unit; 3] = [
    Unit { of: Amount::Leaves, range: [1e2, 2e7], first: 5e5 },
    Unit { of: Amount::Triangles, range: [1e3, 1e8], first: 2e6 },
    Unit { of: Amount::Ms, range: [1.0, 2000.0], first: 16.0 },
];
/// Rules and their labels.
const RULES: [(Portions, &str); 5] = [
    (Portions::Error, "least error"),
    (Portions::Equal, "equal error"),
    (Portions::Cook, "Cook"),
    (Portions::Gomez, "Gomez"),
    (Portions::Uniform, "uniform"),
];
/// Width of a bar.
const BAR: f32 = 180.0;

/// A budget that the user sets, and what it is spent on.
pub struct BudgetPanel {
    is_on: bool,
    entry: BudgetEntry,
    /// What the scene has.
    applied: Option<BudgetEntry>,
    pace: Option<Pace>,
    frame: u64,
    /// Name and leaves of each model in view.
    of_models: Vec<(String, f64)>,
}

impl BudgetPanel {
    /// The panel of a scene with this budget.
    pub fn new(entry: Option<BudgetEntry>) -> Self {
        let Unit { of, first, .. } = UNITS[0];
        let shown = entry.unwrap_or(BudgetEntry::of(of(first)));
        Self { is_on: entry.is_some(), entry: shown, applied: None, pace: None, frame: 0, of_models: Vec::new() }
    }

    /// Shows it.
    pub fn show(&mut self, ui: &mut egui::Ui, opened: &Opened) {
        ui.checkbox(&mut self.is_on, "budget for all plants in view");
        if !self.is_on {
            return;
        }
        ui.horizontal(|ui| {
            for Unit { of, first, .. } in UNITS {
                let amount = of(first);
                if ui.selectable_label(self.entry.amount.unit() == amount.unit(), amount.unit()).clicked() {
                    self.entry.amount = amount;
                }
            }
        });
        let (unit, mut number) = (self.entry.amount.unit(), self.entry.amount.number());
        let same = UNITS.into_iter().find(|other| (other.of)(1.0).unit() == unit);
        if let Some(Unit { of, range: [least, most], .. }) = same {
            let range = least.min(number)..=most.max(number);
            ui.add(egui::Slider::new(&mut number, range).logarithmic(true).text(unit));
            self.entry.amount = of(number);
        }
        let label = RULES.iter().find(|(rule, _)| *rule == self.entry.rule).map_or("", |(_, label)| label);
        egui::ComboBox::from_label("split by").selected_text(label).show_ui(ui, |ui| {
            for (rule, label) in RULES {
                ui.selectable_value(&mut self.entry.rule, rule, label);
            }
        });
        let weighs = matches!(self.entry.rule, Portions::Error | Portions::Equal);
        self.entry.visibility &= weighs;
        self.entry.exponent = self.entry.exponent.filter(|_| self.entry.rule == Portions::Error);
        ui.add_enabled(weighs, egui::Checkbox::new(&mut self.entry.visibility, "by what shows behind others"));
        if let Some(Spent { asked, used, .. }) = opened.spent() {
            let [asked_n, used_n] = [asked, used].map(|of| HumanCount(of as u64));
            bar(ui, used / asked.max(1.0), format!("{used_n} of {asked_n}"));
        }
        let all: f64 = self.of_models.iter().map(|(_, leaves)| leaves).sum();
        for (name, leaves) in &self.of_models {
            bar(ui, leaves / all.max(1.0), format!("{name}: {}", HumanCount(*leaves as u64)));
        }
    }

    /// Whether leaves still follow a time.
    pub fn moves(&self) -> bool {
        self.is_on && self.pace.is_some()
    }

    /// Gives the scene the budget. A new amount is followed without a jump.
    ///
    /// # Errors
    /// As [`BudgetEntry::check`].
    pub fn apply(&mut self, opened: &mut Opened) -> Result<()> {
        let wanted = self.is_on.then_some(self.entry);
        let split = |entry: BudgetEntry| (entry.amount.unit(), entry.rule, entry.visibility, entry.exponent);
        if wanted.map(split) != self.applied.map(split) || opened.file.budget.is_some() != self.is_on {
            wanted.map_or(Ok(()), |entry| entry.check())?;
            opened.set_budget(wanted);
            self.pace = None;
        }
        self.applied = wanted;
        let Some(shared) = opened.shared() else { return Ok(()) };
        shared.amount = match self.entry.amount {
            Amount::Ms(target_ms) => {
                let pace = self.pace.get_or_insert_with(|| Pace::new(target_ms, shared.amount));
                pace.target_ms = target_ms;
                pace.leaves()
            }
            Amount::Leaves(number) | Amount::Triangles(number) => number,
        };
        Ok(())
    }

    /// Tells that the camera has jumped.
    pub fn cut(&mut self, opened: &mut Opened) {
        self.pace.iter_mut().for_each(Pace::cut);
        opened.shared().into_iter().for_each(|shared| shared.reset());
    }

    /// Tells what the next picture shows.
    pub fn prepared(&mut self, opened: &mut Opened, shown: &[Shown], wood_triangles: u64) {
        let names = opened.file.models.iter().map(|source| (source.name.clone(), 0.0));
        self.of_models = names.collect();
        for plant in shown {
            self.of_models[plant.model].1 += f64::from(plant.active);
        }
        if let (Some(pace), Some(shared)) = (&mut self.pace, opened.shared()) {
            self.frame += 1;
            pace.drew(self.frame, shared.load(wood_triangles));
        }
    }

    /// Tells how long it took.
    pub fn took(&mut self, times: &FrameTimes) {
        if let Some(pace) = &mut self.pace {
            let frame_ms = 1e3 * times.whole.as_secs_f64();
            pace.took(self.frame, Times { frame_ms, gpu_ms: times.gpu_ms, cpu_ms: None });
        }
    }
}

fn bar(ui: &mut egui::Ui, share: f64, text: String) {
    ui.add(egui::ProgressBar::new(share as f32).desired_width(BAR).text(text));
}
