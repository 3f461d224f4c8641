//! A trial's findings, in sentences.

use super::{Analysis, Performance, PlotRecord, Response, ResponseAnalysis, Treatment};
use crate::statistics::{SIGNIFICANCE, Share, Term, probability};
use crate::table::distinct;
use field::counted;
use statrs::distribution::{ContinuousCDF, StudentsT};

impl Analysis {
    /// The findings, a sentence each: the plots, the damage, the effects on each measure, and impossible values.
    pub fn findings(&self) -> Vec<String> {
        let mut findings = vec![self.size(), self.damage()];
        for response in &self.responses {
            findings.push(response.finding());
            findings.extend(response.odds());
        }
        findings.extend(self.responses.iter().flat_map(ResponseAnalysis::checked));
        // Area, time, width or speed is wrong.
        let plots = (1..).zip(&self.performances);
        let hasty =
            plots.filter(|(_, plot)| plot.field_efficiency_percent > 100.0).map(|(number, _)| f64::from(number));
        let hasty: Vec<f64> = hasty.collect();
        if !hasty.is_empty() {
            let of = if hasty.len() == 1 { "Plot" } else { "Plots" };
            findings.push(format!(
                "{of} {}: more ground was covered than speed and width allow (field efficiency above 100 %), so check area, time, width and speed.",
                list(&hasty)
            ));
        }
        findings
    }

    /// How large the trial was.
    fn size(&self) -> String {
        let treatments = self.treatments();
        let levels = |quantity: fn(&Treatment) -> f64| list(&distinct(treatments.iter().map(quantity)));
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

    /// The damage, and the treatment with most of it.
    fn damage(&self) -> String {
        let share = super::damaged(&self.records);
        let Share { count, of, .. } = share;
        let percent = |(_, plot): &(&PlotRecord, &Performance)| plot.plant_damage_percent;
        let plots = self.records.iter().zip(&self.performances);
        match plots.max_by(|a, b| percent(a).total_cmp(&percent(b))) {
            Some((worst, plot)) if count > 0 => format!(
                "{count} of {of} plants were damaged ({:.2} %, which may be {share} %), at most {:.2} % in a plot (replication {}, {} km/h, {} cm).",
                share.percent(),
                plot.plant_damage_percent,
                worst.replication,
                worst.speed_km_h,
                worst.spacing_cm
            ),
            _ => format!("None of {of} plants was damaged: in truth {share} %."),
        }
    }

    /// Contradictions to the paper's text: a sentence for each measure whose 95 % interval of the slope excludes the
    /// paper's slope. One sentence if there is none.
    pub fn against_the_paper(&self) -> Vec<String> {
        let said: Vec<String> = self.responses.iter().filter_map(ResponseAnalysis::against_the_paper).collect();
        let compared =
            self.responses.iter().filter(|of| of.model.is_ok() && of.published.text.per_km_h.is_some()).count();
        match (said.is_empty(), compared) {
            (_, 0) => Vec::new(),
            (true, _) => vec!["no slope by speed contradicts the paper's.".to_owned()],
            (false, _) => said,
        }
    }
}

impl ResponseAnalysis {
    /// The effects on the measure.
    fn finding(&self) -> String {
        let title = self.response.title();
        match &self.model {
            Err(reason) => format!("{title} has no model: {reason}."),
            Ok(model) => {
                let effect = |name, unit| model.term(name).map(|term| effect(term, self.response, name, unit));
                let effects: Vec<String> =
                    [effect("speed", "km/h"), effect("spacing", "cm")].into_iter().flatten().collect();
                let (effects, percent) = (effects.join(" and "), 100.0 * model.r_squared);
                format!("{title} {effects}; the model explains {percent:.1} % of its variation.")
            }
        }
    }

    /// A contradiction to the paper's slope by speed.
    fn against_the_paper(&self) -> Option<String> {
        let paper = self.published.text.per_km_h?;
        let model = self.model.as_ref().ok()?;
        let term = model.term("speed").filter(|term| term.p.is_some())?;
        let distribution = StudentsT::new(0.0, 1.0, model.degrees_of_freedom as f64).ok()?;
        let within = distribution.inverse_cdf(1.0 - SIGNIFICANCE / 2.0) * term.standard_error;
        ((term.estimate - paper).abs() > within).then(|| {
            format!(
                "{} changes by {:+.2} ± {within:.2} for each km/h, where the paper's text has {paper:+}: they contradict each other.",
                self.response.title().to_lowercase(),
                term.estimate
            )
        })
    }

    /// The effect of speed on the odds of the counts, if it is significant.
    fn odds(&self) -> Option<String> {
        let model = self.binomial.as_ref()?.as_ref().ok()?;
        let term = model.term("speed").filter(|term| term.p < SIGNIFICANCE)?;
        let what = match self.response {
            Response::PlantDamage => "that a plant is damaged",
            _ => "that a weed is gone",
        };
        let (times, least, greatest) = term.odds_ratio();
        Some(format!(
            "Counted, the odds {what} are {times:.2} times as high for each km/h more ({least:.2} to {greatest:.2}; {}).",
            probability(term.p)
        ))
    }

    /// The findings of the residuals, a sentence each.
    pub fn checked(&self) -> Vec<String> {
        self.checks.as_ref().map(|checks| checks.sentences(self.response.title())).unwrap_or_default()
    }
}

/// A slope in words.
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

/// Numbers as in a sentence.
fn list(numbers: &[f64]) -> String {
    let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
    match words.as_slice() {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        words => words.join(""),
    }
}
