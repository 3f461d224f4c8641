//! Designs and comparisons as tables for people. Programs serialise the figures themselves.

use crate::figure::{Figure, digits, digits_beside};
use crate::paper::{Comparison, Verdict};
use comfy_table::{Attribute, Cell, CellAlignment, Color, ColumnConstraint, ContentArrangement, Table, presets};

/// The greatest width of a table, in columns of a terminal.
const WIDTH: u16 = 100;

/// Every figure with its equation and its interpretation, and a `!` if the machine should be changed.
pub fn design_table(figures: &[Figure]) -> Table {
    let mut table = table(&["quantity", "equation", "it gives", "unit", "", "which means"], 2..3);
    for figure in figures {
        let sense = Cell::new(&figure.sense);
        table.add_row([
            Cell::new(figure.name),
            Cell::new(figure.equation),
            Cell::new(digits(figure.value)),
            Cell::new(figure.unit),
            Cell::new(if figure.concern { "!" } else { "" }),
            if figure.concern { sense.fg(Color::Red).add_attribute(Attribute::Bold) } else { sense },
        ]);
    }
    // Only the meaning is broken into lines.
    for column in table.column_iter_mut().take(5) {
        column.set_constraint(ColumnConstraint::ContentWidth);
    }
    table
}

/// The paper's figures beside the calculated ones, and beside those of the user's own machine, if there is one.
pub fn comparison_table(comparisons: &[Comparison]) -> Table {
    let own = comparisons.iter().any(|comparison| comparison.own.is_some());
    let mut header = vec!["quantity", "equation", "printed", "from the\nprinted\ninputs", "calculated\nall\nthrough"];
    if own {
        header.push("your\nmachine");
    }
    header.extend(["unit", "verdict"]);
    let mut table = table(&header, 2..5 + usize::from(own));
    for comparison in comparisons {
        let number = |value| Cell::new(digits_beside(value, comparison.decimals));
        let mut row = vec![
            Cell::new(comparison.name),
            Cell::new(comparison.equation),
            Cell::new(format!("{:.*}", comparison.decimals, comparison.printed)),
            number(comparison.from_printed_inputs),
            number(comparison.calculated),
        ];
        if own {
            row.push(comparison.own.map_or_else(|| Cell::new(""), number));
        }
        row.extend([Cell::new(comparison.unit), verdict_cell(comparison.verdict)]);
        table.add_row(row);
    }
    // Only the quantity's name is broken into lines.
    for column in table.column_iter_mut().skip(1) {
        column.set_constraint(ColumnConstraint::ContentWidth);
    }
    table
}

/// The remarks to the figures that have one.
pub fn remark_table(comparisons: &[Comparison]) -> Table {
    let mut table = table(&["quantity", "remark"], 0..0);
    for Comparison { name, remark, .. } in comparisons.iter().filter(|comparison| !comparison.remark.is_empty()) {
        table.add_row([*name, remark.as_str()]);
    }
    table
}

/// A table whose columns `numbers` stand to the right.
fn table(header: &[&str], numbers: std::ops::Range<usize>) -> Table {
    let mut table = Table::new();
    table
        .load_style(presets::UTF8_BORDERS_ONLY)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_header(header);
    // A pipe has no width.
    let width = table.width().map_or(WIDTH, |width| width.min(WIDTH));
    table.set_width(width);
    for column in table.column_iter_mut().take(numbers.end).skip(numbers.start) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn verdict_cell(verdict: Verdict) -> Cell {
    match verdict {
        Verdict::Right => Cell::new("right").fg(Color::Green),
        Verdict::Follows => Cell::new("follows").fg(Color::Yellow),
        Verdict::Wrong => Cell::new("wrong").fg(Color::Red).add_attribute(Attribute::Bold),
    }
}
