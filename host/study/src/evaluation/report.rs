//! A trial's analysis as tables, which the page has too, and for people at a terminal: findings in plain words, then the tables that they
//! rest on.

use super::plot::COLUMNS;
use super::published::Published;
use super::{Analysis, Performance, ResponseAnalysis};
use crate::statistics::{AnalysisOfVariance, BinomialModel, LinearModel, Mean};
use crate::table::{NOTHING, Table, fixed, optional, probability, short, significant, visible};
use field::counted;
use std::fmt::{self, Display, Formatter};

/// The meaning of p-values and index.
const LEGEND: &str = "\
p is how probable it is that chance alone makes an effect as large: below 0.05 it is taken for one.
Capacities are by Eq. 25 and 26 of the paper, field efficiency by Eq. 24. The performance index (Eq. 27) is
effective capacity in ha/h, times the percentages of plants unharmed and of weeds gone, by the power in hp.
Weeding efficiency is of the weeds that were counted: over a whole plot it is higher than in the row alone.
A treatment's damage is of all its plants together. Behind it stands its exact 95 % interval: two-sided where it has two
ends, one-sided where it reads below or above. It takes plants as independent: where plots scatter by more than counting,
it is too narrow.
Behind weeding stands the two-sided 95 % interval of a mean of plots. If some plots were not counted,
the number of the others follows.
";

/// Columns of [`Analysis::plots`] that stand in the trial's own table already.
const COUNTED: std::ops::Range<usize> = 4..12;

impl Display for Analysis {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        for finding in self.findings() {
            writeln!(f, "{finding}")?;
        }
        writeln!(f, "\n{}\n\n{}", self.plots().without(COUNTED), self.means())?;
        for response in &self.responses {
            write!(f, "\n{response}")?;
        }
        write!(f, "\n{LEGEND}")
    }
}

impl Display for ResponseAnalysis {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        writeln!(f, "{}, {}", self.response.title().to_uppercase(), self.response.unit())?;
        if let Err(reason) = &self.model {
            writeln!(f, "\nNo linear model: {reason}.")?;
        }
        writeln!(f, "\n{}\n\n{}", self.terms(), self.fit())?;
        match &self.binomial {
            Some(Ok(model)) => {
                writeln!(f, "\n{}\n{}", model.table(), model.fit_in_words())?;
            }
            Some(Err(reason)) => writeln!(f, "\nNo binomial model: {reason}.")?,
            None => {}
        }
        match &self.variance {
            Ok(variance) => writeln!(f, "\n{}", variance.table())?,
            Err(reason) => writeln!(f, "\nNo analysis of variance: {reason}.")?,
        }
        self.remarks().iter().try_for_each(|remark| writeln!(f, "Note: {remark}"))?;
        self.published.contradictions.iter().try_for_each(|contradiction| writeln!(f, "- {contradiction}"))
    }
}

/// A measure of a plot or of a treatment: what stands above it, its decimals, and its value.
type Measure = (&'static str, usize, fn(&Performance) -> Option<f64>);

const MEASURES: [Measure; 6] = [
    ("plant damage, %", 2, |of| of.plant_damage_percent),
    ("weeding efficiency, %", 2, |of| of.weeding_efficiency_percent),
    ("theoretical capacity, ha/h", 4, |of| of.theoretical_capacity_ha_h),
    ("effective capacity, ha/h", 4, |of| of.effective_capacity_ha_h),
    ("field efficiency, %", 2, |of| of.field_efficiency_percent),
    ("performance index", 2, |of| of.performance_index),
];

fn measures(of: &Performance) -> [String; MEASURES.len()] {
    MEASURES.map(|(_, decimals, value)| optional(value(of), |value| visible(value, decimals)))
}

impl Analysis {
    pub(crate) fn means(&self) -> Table {
        let [_, others @ ..] = MEASURES.map(|(heading, ..)| heading);
        let columns = ["treatment", "plots", "plant damage of all plants, %"].into_iter().chain(others);
        let mut table = Table::new("Means of the plots of each treatment", columns);
        for treatment in self.treatments() {
            let name = format!("{} km/h, {} cm", short(treatment.speed_km_h), short(treatment.spacing_cm));
            let [_, mut weeding, others @ ..] = measures(&treatment.mean);
            let damage = format!("{} ({})", treatment.damaged.shown(), treatment.damaged);
            if let Some(Mean { within, of, .. }) = treatment.weeding_efficiency {
                weeding += &within.map_or_else(String::new, |within| format!(" ± {}", visible(within, 2)));
                if of < treatment.plots {
                    weeding += &format!(" ({})", counted(of, "plot"));
                }
            }
            let cells = [name, treatment.plots.to_string(), damage, weeding];
            table.rows.push(cells.into_iter().chain(others).collect());
        }
        table
    }

    pub(crate) fn plots(&self) -> Table {
        let counted = COLUMNS.map(|(_, heading, ..)| heading);
        let columns = ["plot"].into_iter().chain(counted).chain(MEASURES.map(|(heading, ..)| heading));
        let mut table = Table::new("Each plot: counts, measurements and results", columns);
        for record in &self.records {
            let measures = measures(&record.performance());
            table.rows.push([vec![record.plot.to_string()], record.cells(), measures.into()].concat());
        }
        table
    }
}

impl ResponseAnalysis {
    /// The coefficients with their errors, beside the paper's.
    pub(crate) fn terms(&self) -> Table {
        let Published { equation, text, equation_number, .. } = self.published;
        let of_paper = format!("paper, Eq. {equation_number}");
        let columns = ["term", "estimate", "standard error", "t", "p", &of_paper, "paper, in its text"];
        let mut table = Table::new("Linear model", columns);
        let rows = [
            ("constant", "constant", equation.constant, text.constant),
            ("speed", "for each km/h", equation.per_km_h, text.per_km_h),
            ("spacing", "for each cm of spacing", equation.per_cm, text.per_cm),
        ];
        for (name, meaning, equation, text) in rows {
            let term = self.model.as_ref().ok().and_then(|model| model.term(name));
            table.rows.push(vec![
                meaning.to_owned(),
                optional(term.map(|term| term.estimate), significant),
                optional(term.map(|term| term.standard_error), significant),
                optional(term.and_then(|term| term.t), |t| fixed(t, 2)),
                optional(term.and_then(|term| term.p), probability),
                optional(equation, short),
                optional(text, short),
            ]);
        }
        table
    }

    /// How well the model fits, and over which range, beside the paper's.
    pub(crate) fn fit(&self) -> Table {
        let model = self.model.as_ref().ok();
        let range = |&(low, high): &(f64, f64)| format!("{} to {}", visible(low, 2), visible(high, 2));
        let published: Vec<String> = self.published.ranges.iter().map(range).collect();
        let share = |value| fixed(value, 4);
        let ours = |value: fn(&LinearModel) -> f64, said: fn(f64) -> String| optional(model.map(value), said);
        let nothing = || NOTHING.to_owned();
        let adjusted = optional(self.published.adjusted_r_squared, share);
        let what = format!("range, {}", self.response.unit());
        let rows = [
            ["R²".to_owned(), ours(|model| model.r_squared, share), share(self.published.r_squared)],
            ["adjusted R²".to_owned(), ours(|model| model.adjusted_r_squared, share), adjusted],
            ["residual standard error".to_owned(), ours(|model| model.residual_standard_error, significant), nothing()],
            ["degrees of freedom".to_owned(), ours(|model| model.degrees_of_freedom as f64, short), nothing()],
            [what, self.range.as_ref().map_or_else(nothing, range), published.join(",\n")],
        ];
        Table { rows: rows.map(Vec::from).to_vec(), ..Table::new("Fit and range", ["", "this trial", "paper"]) }
    }

    /// Remarks on the models and the residuals, each sentence once.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let of_model = self.model.iter().flat_map(|model| &model.remarks);
        let of_counts = self.binomial.iter().flatten().flat_map(|model| &model.remarks);
        let of_variance = self.variance.iter().flat_map(|variance| &variance.remarks);
        let mut remarks = Vec::new();
        for remark in of_model.chain(of_counts).chain(of_variance) {
            let remark = sentence(&remark.to_string());
            if !remarks.contains(&remark) {
                remarks.push(remark);
            }
        }
        remarks.extend(self.checked());
        remarks
    }
}

impl BinomialModel {
    /// How well the model fits.
    pub(crate) fn fit_in_words(&self) -> String {
        let in_errors = if self.is_quasi { ", which is in the standard errors and p" } else { "" };
        format!(
            "deviance {:.3} with {} degrees of freedom, of {:.3} without speed and spacing; dispersion {:.2}{in_errors}",
            self.deviance, self.degrees_of_freedom, self.null_deviance, self.dispersion
        )
    }

    /// The effects of speed and spacing on the odds.
    pub(crate) fn table(&self) -> Table {
        let (name, statistic) = if self.is_quasi { ("Quasi-binomial", "t") } else { ("Binomial", "z") };
        let columns = ["term", "log odds", "standard error", statistic, "p", "odds times (two-sided 95 %)"];
        let mut table = Table::new(format!("{name} model of the counts"), columns);
        for term in &self.terms {
            let (name, decimals) = match term.name {
                "speed" => ("for each km/h", Some(2)),
                "spacing" => ("for each cm of spacing", Some(3)),
                name => (name, None),
            };
            let times = decimals.map_or(NOTHING.to_owned(), |decimals| {
                let said = |odds| times(odds, decimals);
                let (least, greatest) = term.odds_interval;
                format!("{} ({} to {})", said(term.odds_ratio), said(least), said(greatest))
            });
            table.rows.push(vec![
                name.to_owned(),
                significant(term.estimate),
                significant(term.standard_error),
                fixed(term.statistic, 2),
                probability(term.p),
                times,
            ]);
        }
        table
    }
}

impl AnalysisOfVariance {
    /// The part of the variation of each factor.
    pub(crate) fn table(&self) -> Table {
        let columns = ["source", "degrees of freedom", "sum of squares", "mean square", "F", "p"];
        let mut table = Table::new("Analysis of variance", columns);
        for source in &self.sources {
            table.rows.push(vec![
                source.name.replace(" x ", " × "),
                source.degrees_of_freedom.to_string(),
                significant(source.sum_of_squares),
                significant(source.mean_square),
                optional(source.f, |f| fixed(f, 2)),
                optional(source.p, probability),
            ]);
        }
        table
    }
}

/// A factor of the odds. A close pair of speeds can give one of hundreds of digits. It never reads as 0.
pub(super) fn times(odds: f64, decimals: usize) -> String {
    const LEAST: f64 = 1e-6;
    const MOST: f64 = 1e6;
    if odds < LEAST {
        format!("< {LEAST}")
    } else if odds > MOST {
        format!("> {MOST}")
    } else {
        visible(odds, decimals)
    }
}

/// Words with a capital letter in front and a full stop behind.
fn sentence(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}
