//! The confusion matrix.
//!
//! Unknown detections are treated as plants. So there are two kinds of error: a plant classified as a weed is cut, and
//! a weed classified as a plant or unknown is left.

use control::ground::class::Class;
use field::row::Kind;
use std::fmt;
use trial::report::number_table;

/// How many detections of each kind were classified as each class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Confusion {
    plants: Counts,
    weeds: Counts,
}

/// Objects of one kind: those classified as a plant, the unknown ones, and those classified as a weed.
type Counts = [usize; 3];

impl FromIterator<(Kind, Class)> for Confusion {
    fn from_iter<I: IntoIterator<Item = (Kind, Class)>>(classified: I) -> Self {
        let mut confusion = Self::default();
        for (kind, class) in classified {
            let counts = match kind {
                Kind::Plant => &mut confusion.plants,
                Kind::Weed => &mut confusion.weeds,
            };
            counts[match class {
                Class::Plant => 0,
                Class::Unknown => 1,
                Class::Weed => 2,
            }] += 1;
        }
        confusion
    }
}

impl Confusion {
    /// The objects of a kind.
    pub fn count(&self, kind: Kind) -> usize {
        match kind {
            Kind::Plant => self.plants.iter().sum(),
            Kind::Weed => self.weeds.iter().sum(),
        }
    }

    /// All objects.
    pub fn total(&self) -> usize {
        self.count(Kind::Plant) + self.count(Kind::Weed)
    }

    /// Plants that the machine would cut.
    pub fn plants_taken_for_weeds(&self) -> usize {
        self.plants[2]
    }

    /// Weeds that the machine would spare, including unknown ones.
    pub fn weeds_taken_for_plants(&self) -> usize {
        self.weeds[0] + self.weeds[1]
    }

    /// Plants that are spared because they are unknown.
    pub fn plants_unknown(&self) -> usize {
        self.plants[1]
    }

    /// Share of detections that the machine treats correctly, from 0 to 1.
    pub fn accuracy(&self) -> f64 {
        1.0 - share(self.plants_taken_for_weeds() + self.weeds_taken_for_plants(), self.total())
    }

    /// The errors, worst first: plants cut, weeds spared, plants unknown.
    pub(super) fn harm(&self) -> (usize, usize, usize) {
        (self.plants_taken_for_weeds(), self.weeds_taken_for_plants(), self.plants_unknown())
    }
}

impl fmt::Display for Confusion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut table = number_table(["", "classified as\nplant", "\nunknown", "classified as\nweed"], 1);
        for (name, counts) in [("plants", self.plants), ("weeds", self.weeds)] {
            table.add_row([name.to_owned()].into_iter().chain(counts.map(|count| count.to_string())));
        }
        writeln!(f, "{table}")?;
        let percent = |part: usize, total: usize| format!("{part} of {total}, {:.2} %", 100.0 * share(part, total));
        let (plants, weeds) = (self.count(Kind::Plant), self.count(Kind::Weed));
        writeln!(f, "Plants classified as weeds   {}", percent(self.plants_taken_for_weeds(), plants))?;
        writeln!(f, "Weeds classified as plants   {}", percent(self.weeds_taken_for_plants(), weeds))?;
        writeln!(f, "Plants spared unknown    {}", percent(self.plants_unknown(), plants))?;
        write!(f, "Treated as they should   {:.2} % of all", 100.0 * self.accuracy())
    }
}

fn share(part: usize, total: usize) -> f64 {
    if total == 0 { 0.0 } else { part as f64 / total as f64 }
}
