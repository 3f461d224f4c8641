//! What a trial found, in plain sentences.

use super::{Analysis, Performance, PlotRecord, Response, ResponseAnalysis, Treatment};
use crate::statistics::{LinearModel, Term};

/// A coefficient is taken for an effect where chance makes one as large less often than this.
pub const SIGNIFICANCE: f64 = 0.05;

impl Analysis {
    /// What the trial found, a sentence each: its plots, the damage, what each measure depends on, and what cannot be right.
    pub fn findings(&self) -> Vec<String> {
        let mut findings = vec![self.size(), self.damage()];
        findings.extend(self.responses.iter().map(ResponseAnalysis::finding));
        let hasty = self.faster_than_possible();
        if !hasty.is_empty() {
            let plots: Vec<f64> = hasty.into_iter().map(|plot| plot as f64).collect();
            let of = if plots.len() == 1 { "Plot" } else { "Plots" };
            findings.push(format!(
                "{of} {}: more ground was covered than speed and width allow (field efficiency above 100 %), so check area, time, width and speed.",
                list(&plots)
            ));
        }
        findings
    }

    /// How large the trial was.
    fn size(&self) -> String {
        let treatments = self.treatments();
        let levels = |quantity: fn(&Treatment) -> f64| {
            let mut levels: Vec<f64> = treatments.iter().map(quantity).collect();
            levels.sort_by(f64::total_cmp);
            levels.dedup();
            list(&levels)
        };
        let plots = treatments.iter().map(|treatment| treatment.plots);
        let (fewest, most) = (plots.clone().min().unwrap_or_default(), plots.max().unwrap_or_default());
        let replications = if fewest == most { format!("{fewest}") } else { format!("{fewest} to {most}") };
        format!(
            "{} of {} ({} km/h; {} cm), {replications} of each treatment.",
            counted(self.records.len(), "plot"),
            counted(treatments.len(), "treatment"),
            levels(|treatment| treatment.speed_km_h),
            levels(|treatment| treatment.spacing_cm)
        )
    }

    /// How much damage there was, and where most.
    fn damage(&self) -> String {
        let plants: u64 = self.records.iter().map(|plot| u64::from(plot.plants)).sum();
        let damaged: u64 = self.records.iter().map(|plot| u64::from(plot.damaged)).sum();
        let percent = |(_, plot): &(&PlotRecord, &Performance)| plot.plant_damage_percent;
        let plots = self.records.iter().zip(&self.performances);
        match plots.max_by(|a, b| percent(a).total_cmp(&percent(b))) {
            Some((worst, plot)) if damaged > 0 => format!(
                "{damaged} of {plants} plants were damaged ({:.2} %), at most {:.2} % in a plot (replication {}, {} km/h, {} cm).",
                damaged as f64 / plants as f64 * 100.0,
                plot.plant_damage_percent,
                worst.replication,
                worst.speed_km_h,
                worst.spacing_cm
            ),
            _ => format!("None of {plants} plants was damaged."),
        }
    }
}

impl ResponseAnalysis {
    /// What the measure depends on.
    fn finding(&self) -> String {
        let title = self.response.title();
        match &self.model {
            Err(reason) => format!("{title} has no model: {reason}."),
            Ok(model) => {
                let effect = |name, unit| model.term(name).map(|term| effect(term, self.response, name, unit));
                let effects: Vec<String> =
                    [effect("speed", "km/h"), effect("spacing", "cm")].into_iter().flatten().collect();
                format!("{title} {}; {}.", effects.join(" and "), explained(model))
            }
        }
    }
}

/// What a slope says.
fn effect(term: &Term, response: Response, name: &str, unit: &str) -> String {
    let significance = match term.p {
        Some(p) if p >= SIGNIFICANCE => return format!("shows no effect of {name} ({})", probability(p)),
        Some(p) => format!(" ({})", probability(p)),
        None => String::new(),
    };
    let verb = if term.estimate < 0.0 { "falls" } else { "rises" };
    let measure = if response == Response::PerformanceIndex { "" } else { " points" };
    format!("{verb} by {:.3}{measure} for each {unit}{significance}", term.estimate.abs())
}

/// How much the model explains.
fn explained(model: &LinearModel) -> String {
    format!("the model explains {:.1} % of its variation", model.r_squared * 100.0)
}

/// A probability with its sign: four digits, or what it is below.
pub fn probability(p: f64) -> String {
    if p < 0.0001 { "p < 0.0001".to_owned() } else { format!("p = {p:.4}") }
}

/// A number of things.
fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// Numbers as in a sentence.
fn list(numbers: &[f64]) -> String {
    let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
    match words.as_slice() {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        words => words.join(""),
    }
}
