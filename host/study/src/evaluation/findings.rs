//! A trial's findings, in sentences.

use super::report::times;
use super::table::LEAVE_OUT;
use super::{Analysis, PlotRecord, Response, ResponseAnalysis, Treatment, nominal};
use crate::statistics::{OddsTerm, SIGNIFICANCE, Share, Term, grouped, probability};
use crate::table::{distinct, in_words, list, short, visible};
use field::counted;
use statrs::distribution::{ContinuousCDF, StudentsT};

impl Analysis {
    /// The findings, a sentence each: the plots, the damage, the effects on each measure, and impossible values.
    pub fn findings(&self) -> Vec<String> {
        let mut findings = vec![self.size(), self.damage_in_words()];
        findings.extend(self.is_renumbered.then(|| {
            "The column plot does not number each plot once: plots are numbered in the order of the lines.".to_owned()
        }));
        for response in &self.responses {
            findings.push(response.finding());
            findings.extend(response.odds());
        }
        findings.extend(self.responses.iter().flat_map(ResponseAnalysis::checked));
        findings.extend(self.incomplete());
        findings.extend(self.more_weeds());
        findings.extend(self.speeds_as_measured());
        // Area, time, width or speed is wrong. Rounding alone takes a plot without a stop just above 100.
        let is_hasty = |record: &PlotRecord| record.performance().field_efficiency_percent.is_some_and(|it| it > 100.5);
        if let Some(plots) = self.named(is_hasty) {
            findings.push(format!(
                "{plots}: more ground was covered than speed and width allow (field efficiency above 100 %), so check area, time, width and speed."
            ));
        }
        findings
    }

    /// The plots for which this is true, with their numbers: `Plots 2 and 5`.
    fn named(&self, is_meant: impl Fn(&PlotRecord) -> bool) -> Option<String> {
        let meant = self.records.iter().filter(|record| is_meant(record));
        let numbers: Vec<f64> = meant.map(|record| f64::from(record.plot)).collect();
        let of = if numbers.len() == 1 { "Plot" } else { "Plots" };
        (!numbers.is_empty()).then(|| format!("{of} {}", list(&numbers)))
    }

    /// The plots that take no part in a measure, and why.
    fn incomplete(&self) -> Vec<String> {
        let reasons = grouped(self.records.iter().filter_map(|record| {
            let plot = record.performance();
            let lacks_it = |response: &Response| response.value(&plot).is_none();
            let without: Vec<String> =
                Response::ALL.into_iter().filter(lacks_it).map(|response| response.title().to_lowercase()).collect();
            (!without.is_empty()).then(|| ((lacking(record), without), f64::from(record.plot)))
        }));
        let sentence = |((lacking, without), plots): ((Vec<String>, Vec<String>), Vec<f64>)| {
            let (of, have) = if plots.len() == 1 { ("Plot", "takes") } else { ("Plots", "take") };
            let (plots, lacking, without) = (list(&plots), in_words(&lacking), in_words(&without));
            format!("{of} {plots} ({lacking}) {have} no part in {without}.")
        };
        reasons.into_iter().map(sentence).collect()
    }

    /// The plots with more weeds after weeding than before. Without any before, a plot has no efficiency.
    fn more_weeds(&self) -> Option<String> {
        let plots =
            self.named(|of| of.weeds_before.is_some_and(|before| before > 0 && of.weeds_after > Some(before)))?;
        Some(format!(
            "{plots}: more weeds were counted after weeding than before. The weeding efficiency is negative there; in the binomial model no weed counts as gone. If this is a mistake, correct it; {LEAVE_OUT}."
        ))
    }

    fn speeds_as_measured(&self) -> Option<String> {
        // Nominal speeds that were given are not guessed again.
        if self.records.iter().zip(&self.levels_km_h).any(|(record, level)| record.speed_km_h != *level) {
            return None;
        }
        let nominal = nominal::guessed(&self.records)?;
        let speeds = distinct(self.levels_km_h.iter().copied()).len();
        let option: Vec<String> = nominal.iter().map(f64::to_string).collect();
        Some(format!(
            "Speeds differ by less than a step: {speeds} speeds in {}. If they were measured at {} km/h, add --speeds {}: the means and the analysis of variance then compare these.",
            counted(self.records.len(), "plot"),
            list(&nominal),
            option.join(",")
        ))
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

    fn damage_in_words(&self) -> String {
        let share = self.damage();
        let Share { count, of, .. } = share;
        if of == 0 {
            let is_counted = self.records.iter().any(|plot| plot.damaged.is_some() && plot.plants.is_some());
            let which = if is_counted {
                "No plot with counted plants had any."
            } else {
                "Damaged plants were counted in no plot."
            };
            return which.to_owned();
        }
        if count == 0 {
            return format!("None of {of} plants was damaged: {share} % ({}).", share.kind());
        }
        let percent = |plot: &PlotRecord| plot.performance().plant_damage_percent;
        let most = self.records.iter().filter_map(percent).fold(0.0, f64::max);
        let worst = self.records.iter().filter(|plot| percent(plot).is_some_and(|percent| percent >= most));
        let place = |plot: &PlotRecord| {
            // More digits would only seem to be measured.
            let km_h = short((1000.0 * plot.speed_km_h).round() / 1000.0);
            format!("replication {}, {km_h} km/h, {} cm", plot.replication, plot.spacing_cm)
        };
        let worst: Vec<String> = worst.map(place).collect();
        let kind = if worst.len() == 1 { "a plot" } else { "each of these plots" };
        format!(
            "{count} of {of} plants were damaged: {} %, {} {share} %. At most {} % in {kind}: {}.",
            share.in_interval(2),
            share.kind(),
            visible(most, 2),
            worst.join("; ")
        )
    }

    /// Differences from the paper's text: a sentence for each measure whose 95 % interval of the slope excludes the paper's
    /// slope. If there is none, one sentence names the compared measures. Another one names the measures whose slope the
    /// paper has and this trial does not. Empty if no slope can be compared.
    pub fn against_the_paper(&self) -> Vec<String> {
        let of_paper = self.responses.iter().filter(|of| of.published.text.per_km_h.is_some());
        let (compared, without): (Vec<_>, Vec<_>) = of_paper.partition(|of| of.slope().is_some());
        if compared.is_empty() {
            return Vec::new();
        }
        let names = |of: &[&ResponseAnalysis]| {
            in_words(&of.iter().map(|of| of.response.title().to_lowercase()).collect::<Vec<_>>())
        };
        let mut said: Vec<String> = compared.iter().filter_map(|of| of.against_the_paper()).collect();
        if said.is_empty() {
            said.push(format!(
                "No slope by speed is shown to differ from the paper's: each 95 % interval contains the paper's slope. Compared: {}.",
                names(&compared)
            ));
        }
        if !without.is_empty() {
            said.push(format!("Not compared, because this trial has no such slope: {}.", names(&without)));
        }
        said
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

    /// The slope by speed, and half the width of its 95 % interval. `None` without a model, speeds or scatter.
    fn slope(&self) -> Option<(&Term, f64)> {
        let model = self.model.as_ref().ok()?;
        let term = model.term("speed").filter(|term| term.p.is_some())?;
        let distribution = StudentsT::new(0.0, 1.0, model.degrees_of_freedom as f64).ok()?;
        Some((term, distribution.inverse_cdf(1.0 - SIGNIFICANCE / 2.0) * term.standard_error))
    }

    /// A difference from the paper's slope by speed.
    fn against_the_paper(&self) -> Option<String> {
        let (paper, (term, within)) = self.published.text.per_km_h.zip(self.slope())?;
        ((term.estimate - paper).abs() > within).then(|| {
            format!(
                "{} changes by {}{} ± {} for each km/h, where the paper's text has {paper:+}.",
                self.response.title(),
                if term.estimate < 0.0 { '-' } else { '+' },
                visible(term.estimate.abs(), 2),
                visible(within, 2)
            )
        })
    }

    /// The effect of speed on the odds of the counts, if it is significant.
    fn odds(&self) -> Option<String> {
        let model = self.binomial.as_ref()?.as_ref().ok()?;
        let OddsTerm { p, odds_ratio, odds_interval: (least, greatest), .. } =
            model.term("speed").filter(|term| term.p < SIGNIFICANCE)?;
        let what = match self.response {
            Response::PlantDamage => "that a plant is damaged",
            _ => "that a weed is gone",
        };
        let [ratio, least, greatest] = [odds_ratio, least, greatest].map(|&odds| times(odds, 2));
        Some(format!(
            "Counted, the odds {what} are {ratio} times as high for each km/h more ({least} to {greatest}; {}).",
            probability(*p)
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
    format!("{verb} by {}{measure} for each {unit}{significance}", visible(term.estimate.abs(), 3))
}

fn lacking(record: &PlotRecord) -> Vec<String> {
    let is_missing = |(_, value): &(&str, String)| value.is_empty();
    let missing = record.columns().filter(is_missing).map(|(column, _)| format!("no {column}"));
    let none = [(record.weeds_before, "no weed before weeding"), (record.plants, "no plant")];
    let none = none.into_iter().filter(|(count, _)| *count == Some(0)).map(|(_, what)| what.to_owned());
    missing.chain(none).collect()
}
