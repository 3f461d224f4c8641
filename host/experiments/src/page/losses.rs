//! The loss budget as stacked bars, and as a table.

use super::comparison::Work;
use crate::table::{Table, fixed, short};
use field::budget::Part;

/// Parts narrower than this, in tenths of a percent, have no room for their figure.
const LEAST_LABELLED: u32 = 45;

/// The loss budget of some speeds.
pub struct Losses {
    /// The legend of the colours: a part's key and its title.
    pub legend: [(&'static str, &'static str); Part::ALL.len()],
    /// A bar a speed.
    pub bars: Vec<Bar>,
    /// The same in figures.
    pub table: Table,
}

/// The loss budget of one speed.
pub struct Bar {
    /// The speed.
    pub name: String,
    /// The bar in words.
    pub words: String,
    /// Its pieces.
    pub pieces: Vec<Piece>,
}

/// A part that there is.
pub struct Piece {
    /// The part's key.
    pub key: &'static str,
    /// Its share of the bar, in thousandths.
    pub tenths: u32,
    /// Its text in the bar.
    pub label: String,
}

impl Losses {
    /// The loss budget of this work. `None` without work.
    pub fn of(work: &[Work]) -> Option<Self> {
        let bars: Vec<Bar> = work.iter().map(Bar::of).collect();
        let titles = Part::ALL.map(|part| format!("{}, %", part.title()));
        let mut table = Table::new("Where the row's ground went", ["speed".to_owned()].into_iter().chain(titles));
        for at in work {
            let shares = at.budget.tenths().map(|(_, tenths)| percent(tenths));
            table.rows.push([name(at)].into_iter().chain(shares).collect());
        }
        (!bars.is_empty()).then_some(Self { legend: Part::ALL.map(|part| (part.key(), part.title())), bars, table })
    }
}

impl Bar {
    fn of(work: &Work) -> Self {
        let parts = work.budget.tenths().into_iter().filter(|(_, tenths)| *tenths > 0);
        let words: Vec<String> =
            parts.clone().map(|(part, tenths)| format!("{} {} %", part.title(), percent(tenths))).collect();
        let label = |tenths| if tenths < LEAST_LABELLED { String::new() } else { percent(tenths) };
        Self {
            name: name(work),
            words: format!("{}: {}", name(work), words.join(", ")),
            pieces: parts.map(|(part, tenths)| Piece { key: part.key(), tenths, label: label(tenths) }).collect(),
        }
    }
}

fn name(work: &Work) -> String {
    format!("{} km/h", short(work.speed_km_h))
}

fn percent(tenths: u32) -> String {
    fixed(f64::from(tenths) / 10.0, 1)
}
