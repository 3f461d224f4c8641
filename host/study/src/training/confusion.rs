//! The confusion matrix.
//!
//! Unknown detections are treated as plants. So there are two kinds of error: a plant classified as a weed is cut, and
//! a weed classified as a plant or unknown is left.

use crate::table::optional;
use control::ground::class::Class;
use field::row::Kind;
use std::fmt;
use uno_run::report::number_table;

/// How many detections of each kind were classified as each class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Confusion([[usize; CLASSES.len()]; 2]);

const CLASSES: [Class; 3] = [Class::Plant, Class::Unknown, Class::Weed];

impl FromIterator<(Kind, Class)> for Confusion {
    fn from_iter<I: IntoIterator<Item = (Kind, Class)>>(classified: I) -> Self {
        let mut confusion = Self::default();
        for (kind, class) in classified {
            confusion.0[kind as usize][class as usize] += 1;
        }
        confusion
    }
}

impl Confusion {
    /// The detections of a kind that were classified as a class.
    pub fn of(&self, kind: Kind, class: Class) -> usize {
        self.0[kind as usize][class as usize]
    }

    /// The objects of a kind.
    pub fn count(&self, kind: Kind) -> usize {
        self.0[kind as usize].iter().sum()
    }

    /// All objects.
    pub fn total(&self) -> usize {
        self.count(Kind::Plant) + self.count(Kind::Weed)
    }

    /// Plants that the machine would cut.
    pub fn plants_taken_for_weeds(&self) -> usize {
        self.of(Kind::Plant, Class::Weed)
    }

    /// Weeds that the machine would spare, including unknown ones.
    pub fn weeds_left(&self) -> usize {
        self.of(Kind::Weed, Class::Plant) + self.of(Kind::Weed, Class::Unknown)
    }

    /// Plants that the machine would spare without knowing them.
    pub fn plants_unknown(&self) -> usize {
        self.of(Kind::Plant, Class::Unknown)
    }

    /// Share of detections that the machine treats correctly, from 0 to 1. `None` without detections.
    pub fn accuracy(&self) -> Option<f64> {
        share(self.total() - self.plants_taken_for_weeds() - self.weeds_left(), self.total())
    }

    /// The errors, worst first: plants cut, weeds spared, plants unknown.
    pub(super) fn harm(&self) -> (usize, usize, usize) {
        (self.plants_taken_for_weeds(), self.weeds_left(), self.plants_unknown())
    }
}

impl fmt::Display for Confusion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut table = number_table(["", "classified as\nplant", "\nunknown", "classified as\nweed"], 1);
        for (name, kind) in [("plants", Kind::Plant), ("weeds", Kind::Weed)] {
            let counts = CLASSES.map(|class| self.of(kind, class).to_string());
            table.add_row([name.to_owned()].into_iter().chain(counts));
        }
        writeln!(f, "{table}")?;
        let percent = |share: Option<f64>| optional(share, |share| format!("{:.2} %", 100.0 * share));
        let errors = [
            ("Plants classified as weeds", Kind::Plant, self.plants_taken_for_weeds()),
            ("Weeds left standing", Kind::Weed, self.weeds_left()),
            ("Plants spared unknown", Kind::Plant, self.plants_unknown()),
        ];
        for (name, kind, part) in errors {
            let total = self.count(kind);
            writeln!(f, "{name:<28} {part} of {total}, {}", percent(share(part, total)))?;
        }
        write!(f, "{:<28} {} of all", "Treated as they should", percent(self.accuracy()))
    }
}

/// A part of a total, from 0 to 1. `None` if the total is 0.
fn share(part: usize, total: usize) -> Option<f64> {
    (total > 0).then(|| part as f64 / total as f64)
}
