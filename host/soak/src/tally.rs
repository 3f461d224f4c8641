//! The parameters of a soak, and the results of its hours or minutes, and of all of them.

use field::planting::PlantingError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::ops::AddAssign;
use thiserror::Error;

/// The parameters of a soak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// The random seed.
    pub seed: u64,
    /// Faults in an hour, on average.
    pub faults_an_hour: f64,
}

/// Why a soak has no result.
#[derive(Debug, Error)]
pub enum SoakError {
    /// A row did not grow.
    #[error(transparent)]
    Planting(#[from] PlantingError),
    /// A new machine does not start.
    #[error("a new machine does not start: {0}")]
    Start(String),
}

/// The result of a soak.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// Simulated seconds.
    pub seconds: f64,
    /// Distance rolled, forward and back, in metres.
    pub metres: f64,
    /// Rows worked.
    pub rows: u64,
    /// Plants that the tool came to.
    pub plants: u64,
    /// Distance rolled with the tool in the row, in metres.
    pub weeded_metres: f64,
    /// Plants that were harmed without an excuse.
    pub harmed: u64,
    /// Plants that were harmed because they were classified as weeds.
    pub mistaken: u64,
    /// Plants that were harmed while the firmware could not know its position.
    pub blind: u64,
    /// Injected faults by name.
    pub faults: BTreeMap<String, u64>,
    /// Alarms by name.
    pub alarms: BTreeMap<String, u64>,
    /// Resets by cause.
    pub resets: BTreeMap<String, u64>,
    /// Warnings by name.
    pub warnings: BTreeMap<String, u64>,
    /// Failed checks, each with its hour or minute, and the time in it.
    pub violations: Vec<String>,
}

impl Tally {
    /// Counts an alarm, a warning or a reset in a line that the machine wrote.
    pub(super) fn hear(&mut self, line: &str) {
        let word = |rest: &str| rest.split_whitespace().next().unwrap_or_default().to_owned();
        if let Some((code, rest)) = line.strip_prefix("alarm code=").and_then(|rest| rest.split_once(" name=")) {
            count(&mut self.alarms, &format!("{code} {}", word(rest)));
        }
        if let Some(rest) = line.strip_prefix("warning name=") {
            count(&mut self.warnings, &word(rest));
        }
        if let Some((_, cause)) = line.split_once("reset by ") {
            count(&mut self.resets, cause.split(',').next().unwrap_or(cause));
        }
        if let Some((_, alarm)) = line.split_once(", state alarm ") {
            count(&mut self.alarms, alarm.split(',').next().unwrap_or(alarm));
        }
    }
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.seconds += other.seconds;
        self.metres += other.metres;
        self.rows += other.rows;
        self.plants += other.plants;
        self.weeded_metres += other.weeded_metres;
        self.harmed += other.harmed;
        self.mistaken += other.mistaken;
        self.blind += other.blind;
        for (names, others) in [
            (&mut self.faults, other.faults),
            (&mut self.alarms, other.alarms),
            (&mut self.resets, other.resets),
            (&mut self.warnings, other.warnings),
        ] {
            for (name, times) in others {
                *names.entry(name).or_default() += times;
            }
        }
        self.violations.extend(other.violations);
    }
}

/// Adds the hours or minutes of a soak, up to the first with a violation. Later ones are not computed.
///
/// # Errors
/// The first error of an hour or a minute.
pub fn total<E>(tallies: impl IntoIterator<Item = Result<Tally, E>>) -> Result<Tally, E> {
    let mut total = Tally::default();
    for tally in tallies {
        total += tally?;
        if !total.violations.is_empty() {
            break;
        }
    }
    Ok(total)
}

/// Counts a name.
pub(super) fn count(names: &mut BTreeMap<String, u64>, name: &str) {
    *names.entry(name.to_owned()).or_default() += 1;
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Worked      {:.2} h, {:.2} km, {} rows", self.seconds / 3600.0, self.metres / 1000.0, self.rows)?;
        writeln!(f, "Weeded      {:.0} % of the distance", 100.0 * self.weeded_metres / self.metres.max(1.0))?;
        writeln!(
            f,
            "Plants      {} passed, {} harmed; excused: {} classified as weeds, {} reached while the firmware could not know",
            self.plants, self.harmed, self.mistaken, self.blind
        )?;
        for (title, names) in
            [("Faults", &self.faults), ("Alarms", &self.alarms), ("Resets", &self.resets), ("Warnings", &self.warnings)]
        {
            let names: Vec<String> = names.iter().map(|(name, times)| format!("{name} {times}")).collect();
            writeln!(f, "{title:11} {}", if names.is_empty() { "none".to_owned() } else { names.join(", ") })?;
        }
        self.violations.iter().try_for_each(|violation| writeln!(f, "VIOLATED    {violation}"))
    }
}
