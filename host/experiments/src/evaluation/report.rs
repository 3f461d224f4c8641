//! A trial's analysis for people at a terminal: findings in plain words, then the tables that they rest on.

use super::findings::probability;
use super::{Analysis, Performance, ResponseAnalysis};
use crate::statistics::{AnalysisOfVariance, BinomialModel, LinearModel, Remark};
use comfy_table::{CellAlignment, Table, presets};
use std::fmt::{self, Display, Formatter};

/// Heads of the columns that [`measures`] fills.
const MEASURES: [&str; 6] = [
    "plant\ndamage %",
    "weeding\nefficiency %",
    "theoretical\ncapacity ha/h",
    "effective\ncapacity ha/h",
    "field\nefficiency %",
    "performance\nindex",
];

/// The legend of p-values and the index.
const LEGEND: &str = "\
p is how probable it is that chance alone makes an effect as large: below 0.05 it is taken for one.
Capacities are by Eq. 25 and 26 of the paper, field efficiency by Eq. 24. The performance index (Eq. 27) is
effective capacity in ha/h, times the percentages of plants unharmed and of weeds gone, by the power in hp.
Weeding efficiency is of the weeds that were counted: over a whole plot it is higher than in the row alone.
Behind damage stands its exact 95 % interval over all plants of the treatment, behind weeding that of a mean of plots.
";

impl Display for Analysis {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        for finding in self.findings() {
            writeln!(f, "{finding}")?;
        }
        writeln!(f, "\nPlots\n{}", self.plots())?;
        writeln!(f, "\nMeans of the treatments\n{}", self.means())?;
        for response in &self.responses {
            write!(f, "\n{response}")?;
        }
        write!(f, "\n{LEGEND}")
    }
}

impl Analysis {
    /// Every plot and its measures.
    fn plots(&self) -> Table {
        let mut table = table(["plot", "replication", "speed\nkm/h", "spacing\ncm"].into_iter().chain(MEASURES));
        for (index, (record, performance)) in self.records.iter().zip(&self.performances).enumerate() {
            let place = [
                (index + 1).to_string(),
                record.replication.to_string(),
                record.speed_km_h.to_string(),
                record.spacing_cm.to_string(),
            ];
            table.add_row(place.into_iter().chain(measures(performance)));
        }
        right(table, 0)
    }

    /// The means of each treatment.
    fn means(&self) -> Table {
        let mut table = table(["speed\nkm/h", "spacing\ncm", "plots"].into_iter().chain(MEASURES));
        for treatment in self.treatments() {
            let place =
                [treatment.speed_km_h.to_string(), treatment.spacing_cm.to_string(), treatment.plots.to_string()];
            let [damage, weeding, others @ ..] = measures(&treatment.mean);
            let damage = format!("{damage} ({})", treatment.damaged);
            let weeding = match treatment.weeding_efficiency.within {
                Some(within) => format!("{weeding} ± {within:.2}"),
                None => weeding,
            };
            table.add_row(place.into_iter().chain([damage, weeding]).chain(others));
        }
        right(table, 0)
    }
}

impl Display for ResponseAnalysis {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        writeln!(f, "{}, {}", self.response.title().to_uppercase(), self.response.unit())?;
        match &self.model {
            Ok(model) => write!(f, "\nLinear model\n{model}")?,
            Err(reason) => writeln!(f, "\nNo linear model: {reason}.")?,
        }
        for sentence in self.checked() {
            writeln!(f, "Residuals: {sentence}")?;
        }
        match &self.binomial {
            Some(Ok(model)) => write!(f, "\nBinomial model of the counts\n{model}")?,
            Some(Err(reason)) => writeln!(f, "\nNo binomial model: {reason}.")?,
            None => {}
        }
        match &self.variance {
            Ok(variance) => write!(f, "\nAnalysis of variance\n{variance}")?,
            Err(reason) => writeln!(f, "\nNo analysis of variance: {reason}.")?,
        }
        writeln!(f, "\nBeside the paper\n{}", self.beside_the_paper())?;
        for contradiction in self.published.contradictions {
            writeln!(f, "- {contradiction}")?;
        }
        Ok(())
    }
}

impl ResponseAnalysis {
    /// This trial's model, the paper's equation, and the paper's text.
    fn beside_the_paper(&self) -> Table {
        let published = self.published;
        let equation = format!("paper,\nEq. {}", published.equation_number);
        let mut table = table(["", "this trial", &equation, "paper,\ntext"]);
        let model = self.model.as_ref().ok();
        let ours = |name| coefficient(model.and_then(|model| model.term(name)).map(|term| term.estimate));
        let rows = [
            ("constant", ours("constant"), published.equation.constant, published.text.constant),
            ("for each km/h", ours("speed"), published.equation.per_km_h, published.text.per_km_h),
            ("for each cm", ours("spacing"), published.equation.per_cm, published.text.per_cm),
        ];
        for (name, ours, equation, text) in rows {
            table.add_row([name.to_owned(), ours, coefficient(equation), coefficient(text)]);
        }
        let percent = |share: Option<f64>| share.map_or_else(dash, |share| format!("{:.2} %", share * 100.0));
        let fits = [
            ("R2", model.map(|model| model.r_squared), Some(published.r_squared)),
            ("adjusted R2", model.map(|model| model.adjusted_r_squared), published.adjusted_r_squared),
        ];
        for (name, ours, theirs) in fits {
            table.add_row([name.to_owned(), percent(ours), dash(), percent(theirs)]);
        }
        let range = |(lowest, highest): (f64, f64)| format!("{lowest:.2} to {highest:.2}");
        let printed: Vec<String> = published.ranges.iter().copied().map(range).collect();
        table.add_row(["lowest to highest".to_owned(), range(self.range), dash(), printed.join("\n")]);
        right(table, 1)
    }
}

impl Display for LinearModel {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let mut table = table(["term", "estimate", "standard\nerror", "t", "p"]);
        for term in &self.terms {
            table.add_row([
                term_name(term.name).to_owned(),
                format!("{:+.4}", term.estimate),
                format!("{:.4}", term.standard_error),
                term.t.map_or_else(dash, |t| format!("{t:.3}")),
                chance(term.p),
            ]);
        }
        writeln!(f, "{}", right(table, 1))?;
        writeln!(
            f,
            "R2 {:.2} %, adjusted {:.2} %; residual standard error {:.4} with {} degrees of freedom",
            self.r_squared * 100.0,
            self.adjusted_r_squared * 100.0,
            self.residual_standard_error,
            self.degrees_of_freedom
        )?;
        remarks(f, &self.remarks)
    }
}

impl Display for BinomialModel {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let mut table = table(["term", "log odds", "standard\nerror", "z", "p", "odds\ntimes", "95 %"]);
        for term in &self.terms {
            let (times, least, greatest) = term.odds_ratio();
            let is_slope = term.name != "constant";
            table.add_row([
                term_name(term.name).to_owned(),
                format!("{:+.4}", term.estimate),
                format!("{:.4}", term.standard_error),
                format!("{:.3}", term.z),
                chance(Some(term.p)),
                if is_slope { format!("{times:.3}") } else { dash() },
                if is_slope { format!("{least:.3} to {greatest:.3}") } else { dash() },
            ]);
        }
        writeln!(f, "{}", right(table, 1))?;
        writeln!(
            f,
            "deviance {:.3} with {} degrees of freedom, of {:.3} without speed and spacing; dispersion {:.2}",
            self.deviance, self.degrees_of_freedom, self.null_deviance, self.dispersion
        )?;
        remarks(f, &self.remarks)
    }
}

/// A term's name in a table.
fn term_name(name: &'static str) -> &'static str {
    match name {
        "speed" => "speed, for each km/h",
        "spacing" => "spacing, for each cm",
        name => name,
    }
}

impl Display for AnalysisOfVariance {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let mut table = table(["source", "degrees of\nfreedom", "sum of\nsquares", "mean\nsquare", "F", "p"]);
        for source in &self.sources {
            table.add_row([
                source.name.to_owned(),
                source.degrees_of_freedom.to_string(),
                format!("{:.4}", source.sum_of_squares),
                format!("{:.4}", source.mean_square),
                source.f.map_or_else(dash, |f| format!("{f:.3}")),
                chance(source.p),
            ]);
        }
        writeln!(f, "{}", right(table, 1))?;
        remarks(f, &self.remarks)
    }
}

fn remarks(f: &mut Formatter, remarks: &[Remark]) -> fmt::Result {
    remarks.iter().try_for_each(|remark| writeln!(f, "Note: {remark}."))
}

/// A plot's measures, or their means, in the order of [`MEASURES`].
fn measures(performance: &Performance) -> [String; 6] {
    [
        format!("{:.2}", performance.plant_damage_percent),
        format!("{:.2}", performance.weeding_efficiency_percent),
        format!("{:.4}", performance.theoretical_capacity_ha_h),
        format!("{:.4}", performance.effective_capacity_ha_h),
        format!("{:.2}", performance.field_efficiency_percent),
        format!("{:.2}", performance.performance_index),
    ]
}

fn coefficient(value: Option<f64>) -> String {
    value.map_or_else(dash, |value| format!("{value:+.4}"))
}

/// A probability in a column that is headed p.
fn chance(p: Option<f64>) -> String {
    p.map_or_else(dash, |p| probability(p).trim_start_matches("p ").trim_start_matches("= ").to_owned())
}

/// Where nothing is known.
fn dash() -> String {
    "-".to_owned()
}

fn table<'a>(header: impl IntoIterator<Item = &'a str>) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY).set_header(header);
    table
}

/// The table with its columns aligned right from column `from` on.
fn right(mut table: Table, from: usize) -> Table {
    for column in table.column_iter_mut().skip(from) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
