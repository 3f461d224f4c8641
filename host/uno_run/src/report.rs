//! A pass's outcome for people: a table with a line for each plant, the totals in words, and CSV tables.
//!
//! The picture of the row is in [`crate::picture`].

use crate::console::Status;
use crate::run::Outcome;
use comfy_table::{Attribute, Cell, CellAlignment, Color, Row, Table, presets};
use field::conditions::Conditions;
use field::counted;
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::Pass;
use field::tool_path::share_from_row_to_row;
use field::verdict::{Judgement, PlantOutcome, Verdict, WeedOutcome};
use serde::Serialize;
use std::fmt::Write;
use std::io;
use uno::elf::Size;

/// Flash that the Uno's bootloader leaves, and SRAM, of the ATmega328P (its data sheet, section 8).
const FLASH_BYTES: u64 = 32_768 - 512;
const SRAM_BYTES: u64 = 2048;

/// A table without inner lines. Its columns from this one on are numbers, and stand to the right.
pub fn number_table(header: impl Into<Row>, from: usize) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY).set_header(header);
    for column in table.column_iter_mut().skip(from) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// One line per plant: where it stood, where the tool was clear of the row and where it came back, and the verdict.
pub fn table(outcome: &Outcome) -> Table {
    let header = [
        "plant",
        "place\nmm",
        "canopy\nmm",
        "tool clear\nfrom mm",
        "tool clear\nto mm",
        "clearance\nbefore mm",
        "clearance\nbehind mm",
        "out late\nticks",
        "in late\nticks",
        "swings",
        "verdict",
    ];
    let mut table = number_table(header, 0);
    table.column_iter_mut().skip(10).for_each(|column| column.set_cell_alignment(CellAlignment::Left));
    for (index, plant) in outcome.judgement.plants.iter().enumerate() {
        let whole = |value: Option<f64>, none: &str| value.map_or(none.to_owned(), |value| format!("{value:.0}"));
        let tenths = |value: Option<f64>| value.map_or("shared".to_owned(), |value| format!("{value:+.1}"));
        table.add_row([
            Cell::new(index + 1),
            Cell::new(format!("{:.0}", plant.plant.position_mm)),
            Cell::new(format!("{:.0}", plant.plant.width_mm)),
            Cell::new(whole(plant.clear_mm, "start")),
            Cell::new(whole(plant.back_mm, "end")),
            Cell::new(whole(plant.clearance_before_mm, "-")),
            Cell::new(whole(plant.clearance_behind_mm, "-")),
            Cell::new(tenths(plant.out_error_ticks)),
            Cell::new(tenths(plant.in_error_ticks)),
            Cell::new(plant.swings),
            verdict_cell(plant.verdict),
        ]);
    }
    table
}

fn verdict_cell(verdict: Verdict) -> Cell {
    let cell = Cell::new(verdict);
    match verdict {
        Verdict::Kept => cell.fg(Color::Green),
        Verdict::MarginCut | Verdict::Reached => cell.fg(Color::Yellow),
        Verdict::Damaged => cell.fg(Color::Red).add_attribute(Attribute::Bold),
    }
}

/// The totals, a paragraph in plain words.
pub fn totals(pass: &Pass, conditions: &Conditions, outcome: &Outcome) -> String {
    let Outcome { judgement, status, .. } = outcome;
    let plants = judgement.plants.len();
    let kept = if pass.timing.stem_zone_mm == 0 { "canopy" } else { "stem zone" };
    let mut text = String::new();
    // Writing to a String cannot fail.
    let mut line = |label: &str, words: String| {
        let _ = writeln!(text, "{label:<12}{words}");
    };

    line(
        "Plants",
        format!(
            "{plants}: {} damaged, {} whose zone was reached, {} with the margin cut, {} kept",
            judgement.count(Verdict::Damaged),
            judgement.count(Verdict::Reached),
            judgement.count(Verdict::MarginCut),
            judgement.count(Verdict::Kept),
        ),
    );
    if let Some(depth_mm) = deepest_mm(&judgement.plants) {
        line("", format!("the tool reached {depth_mm:.0} mm into the {kept} that it reached farthest"));
    }
    if judgement.idle_swings > 0 {
        line("", format!("the tool swung out {} for no plant", counted(judgement.idle_swings, "time")));
    }
    if !judgement.weeds.is_empty() {
        let cut = judgement.weeds.iter().filter(|weed| weed.cut).count();
        let left = match judgement.weeds.len() - cut {
            0 => String::new(),
            left => format!("; the tool was aside over the other {left}"),
        };
        line("Tall weeds", format!("{cut} of {} cut{left}", judgement.weeds.len()));
    }
    let span = pass.row.span_mm();
    line(
        "Row weeded",
        format!(
            "{:.1} % of the row's {:.2} m; with every {kept} and its margin kept, this servo allows {:.1} % at most",
            judgement.weeded_share * 100.0,
            (span.end - span.start) / 1000.0,
            judgement.weedable_share * 100.0,
        ),
    );
    // As the paper counted weeds.
    let percent = 100.0 * share_from_row_to_row(conditions, judgement.weeded_share);
    line("", format!("({percent:.1} % of the {} mm from row to row, with the sweeps)", conditions.plot.row_spacing_mm));
    line("Swings", swing_words(judgement, &pass.machine));
    if status.alarm.is_some() {
        line("", "the alarm's swing is one of them".to_owned());
    }
    if outcome.stray_pulses > 0 {
        let pulses = counted(outcome.stray_pulses, "pulse");
        line("", format!("{pulses} of a width that no servo knows: ignored"));
    }
    line("Encoder", count_words(outcome, pass.machine.dirt.share));
    if status.state != "work" {
        let alarm = status.alarm.as_ref().map(|alarm| format!(" {alarm}")).unwrap_or_default();
        line("Firmware", format!("ended in `{}`{alarm}, not at work", status.state));
    } else if pass.motion.top_speed_mm_s() >= pass.too_fast_mm_s() {
        let km_h = pass.too_fast_mm_s() / mm_s(1.0);
        line("Firmware", format!("too fast for its beam: from {km_h:.1} km/h on the tool stays out"));
    }
    let Size { flash, sram } = outcome.size;
    line("Memory", format!("{flash} of {FLASH_BYTES} bytes of flash, {sram} of {SRAM_BYTES} bytes of SRAM"));
    text
}

/// The tool's deepest position in a canopy. `None` if it entered none.
fn deepest_mm(plants: &[PlantOutcome]) -> Option<f64> {
    plants
        .iter()
        .flat_map(|plant| [plant.clearance_before_mm, plant.clearance_behind_mm])
        .flatten()
        .filter(|clearance_mm| *clearance_mm < 0.0)
        .map(f64::abs)
        .max_by(f64::total_cmp)
}

fn swing_words(judgement: &Judgement, machine: &Machine) -> String {
    let errors: Vec<f64> = judgement.swing_errors_ticks().into_iter().map(f64::abs).collect();
    if errors.is_empty() {
        return "none was commanded for a plant".to_owned();
    }
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    format!(
        "{}, off their ideal place by {mean:.1} ticks ({:.1} mm) in the mean, {worst:.1} ticks ({:.1} mm) at worst",
        counted(errors.len(), "command"),
        mean * machine.tick_mm(),
        worst * machine.tick_mm(),
    )
}

/// The encoder's count against the wheel's. The field hides this share of its pulses.
fn count_words(outcome: &Outcome, hidden: f64) -> String {
    let off = outcome.status.position_ticks - outcome.true_ticks;
    let place = match off {
        0 => "exactly the wheel's".to_owned(),
        off if hidden > 0.0 => format!("{off:+} from the wheel's, of whose pulses dirt hides {} %", 100.0 * hidden),
        off => format!("{off:+} from the wheel's"),
    };
    let Status { position_ticks, lost_ticks, .. } = outcome.status;
    format!("position {}, {place}; {} lost", counted(position_ticks, "tick"), counted(lost_ticks, "count"))
}

/// The result for a plant, as a line of a table.
#[derive(Debug, Serialize)]
pub struct PlantRecord {
    position_mm: f64,
    width_mm: f64,
    clear_from_mm: Option<f64>,
    clear_to_mm: Option<f64>,
    clearance_before_mm: Option<f64>,
    clearance_behind_mm: Option<f64>,
    out_error_ticks: Option<f64>,
    in_error_ticks: Option<f64>,
    swings: usize,
    verdict: &'static str,
}

/// The result for a tall weed, as a line of a table.
#[derive(Debug, Serialize)]
pub struct WeedRecord {
    position_mm: f64,
    width_mm: f64,
    cut: bool,
}

/// A line for each plant. An empty field is a `None` of [`PlantOutcome`].
pub fn plants(outcome: &Outcome) -> Vec<PlantRecord> {
    let record = |plant: &PlantOutcome| PlantRecord {
        position_mm: plant.plant.position_mm,
        width_mm: plant.plant.width_mm,
        clear_from_mm: plant.clear_mm,
        clear_to_mm: plant.back_mm,
        clearance_before_mm: plant.clearance_before_mm,
        clearance_behind_mm: plant.clearance_behind_mm,
        out_error_ticks: plant.out_error_ticks,
        in_error_ticks: plant.in_error_ticks,
        swings: plant.swings,
        verdict: match plant.verdict {
            Verdict::Kept => "kept",
            Verdict::MarginCut => "margin_cut",
            Verdict::Reached => "zone_reached",
            Verdict::Damaged => "damaged",
        },
    };
    outcome.judgement.plants.iter().map(record).collect()
}

/// A line per tall weed.
pub fn weeds(outcome: &Outcome) -> Vec<WeedRecord> {
    let record = |weed: &WeedOutcome| WeedRecord {
        position_mm: weed.weed.position_mm,
        width_mm: weed.weed.width_mm,
        cut: weed.cut,
    };
    outcome.judgement.weeds.iter().map(record).collect()
}

/// Writes [`plants`] or [`weeds`] as a CSV table.
///
/// # Errors
/// The errors of the writer.
pub fn write_csv(records: &[impl Serialize], to: impl io::Write) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_writer(to);
    records.iter().try_for_each(|record| writer.serialize(record))?;
    writer.flush()?;
    Ok(())
}

/// The pass, in a line.
pub fn introduction(Pass { row, machine, motion, .. }: &Pass) -> String {
    let span = row.span_mm();
    format!(
        "{} and {} on {:.2} m of row, beam {:.0} mm ahead of the tool, {:.0} s on the field",
        counted(row.plants().count(), "plant"),
        counted(row.weeds().count(), "tall weed"),
        (span.end - span.start) / 1000.0,
        machine.beam_to_tool_mm,
        motion.duration_s(),
    )
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use field::row::Canopy;
    use field::verdict::{ZoneSettings, judge};
    use uno::{CYCLES_PER_SECOND, Pulse};

    /// A pass in which the tool stayed in the row from one second on, and its outcome.
    pub fn ruined_row() -> (Pass, Outcome) {
        let canopies = vec![Canopy::plant(500.0, 150.0), Canopy::weed(750.0, 15.0), Canopy::plant(1000.0, 150.0)];
        let row = field::row::Row::new(canopies).unwrap();
        let pass = Pass::at_speed(row, Machine::default(), ZoneSettings::default(), mm_s(1.0));
        let frame = |rise, width_us: u64| Pulse { rise, fall: rise + width_us * CYCLES_PER_SECOND / 1_000_000 };
        let pulses = vec![frame(0, 2000), frame(CYCLES_PER_SECOND, 1500)];
        let outcome = Outcome {
            judgement: judge(&pass.row, &pass.machine, &pass.motion, pass.timing, &pulses, 0),
            status: Status { state: "work".to_owned(), alarm: None, position_ticks: 99, lost_ticks: 2 },
            true_ticks: 101,
            size: Size { flash: 20_000, sram: 800 },
            pulses,
            stray_pulses: 0,
            changes: Vec::new(),
            start_cycle: 0,
        };
        (pass, outcome)
    }

    #[test]
    fn the_totals_are_in_plain_words() {
        let (pass, outcome) = ruined_row();
        let totals = totals(&pass, &Conditions::default(), &outcome);
        for words in [
            "2: 2 damaged, 0 whose zone was reached, 0 with the margin cut, 0 kept",
            "the tool reached 150 mm into the canopy that it reached farthest",
            "1 of 1 cut",
            "100.0 % of the row's 1.00 m",
            "88.8 % of the 400 mm from row to row, with the sweeps",
            "none was commanded for a plant",
            "position 99 ticks, -2 from the wheel's; 2 counts lost",
            "20000 of 32256 bytes of flash, 800 of 2048 bytes of SRAM",
        ] {
            assert!(totals.contains(words), "{words:?} is not in\n{totals}");
        }
    }

    #[test]
    fn singular_and_plural_differ() {
        let (pass, mut outcome) = ruined_row();
        (outcome.stray_pulses, outcome.judgement.idle_swings, outcome.status.lost_ticks) = (1, 1, 1);
        let words = totals(&pass, &Conditions::default(), &outcome);
        assert!(words.contains("swung out 1 time for no plant"), "{words}");
        assert!(words.contains("1 pulse of a width that no servo knows: ignored"), "{words}");
        assert!(words.contains("; 1 count lost"), "{words}");
        outcome.stray_pulses = 2;
        let words = totals(&pass, &Conditions::default(), &outcome);
        assert!(words.contains("2 pulses of a width that no servo knows: ignored"), "{words}");
        let introduction = introduction(&pass);
        assert!(introduction.starts_with("2 plants and 1 tall weed on 1.00 m of row"), "{introduction}");
    }

    #[test]
    fn the_cause_of_a_tool_that_stayed_out_is_named() {
        let (mut pass, mut outcome) = ruined_row();
        let words = |pass: &Pass, outcome: &Outcome| totals(pass, &Conditions::default(), outcome);
        assert!(!words(&pass, &outcome).contains("Firmware"));
        pass.motion = Pass::at_speed(pass.row.clone(), pass.machine, pass.timing, 4.0 * pass.too_fast_mm_s()).motion;
        let too_fast = format!("from {:.1} km/h on the tool stays out", pass.too_fast_mm_s() * 0.0036);
        assert!(words(&pass, &outcome).contains(&too_fast), "{too_fast}");
        (outcome.status.state, outcome.status.alarm) = ("alarm".to_owned(), Some("3-1 too_fast".to_owned()));
        assert!(words(&pass, &outcome).contains("ended in `alarm` 3-1 too_fast, not at work"));
        assert!(!words(&pass, &outcome).contains("for its beam"));
    }

    #[test]
    fn the_table_has_a_line_for_each_plant_with_its_verdict() {
        let (_, outcome) = ruined_row();
        let text = table(&outcome).to_string();
        assert_eq!(text.matches("DAMAGED").count(), 2, "{text}");
    }

    #[test]
    fn the_csv_tables_have_a_header_and_a_line_each() {
        let (_, outcome) = ruined_row();
        let (mut plants, mut weeds) = (Vec::new(), Vec::new());
        write_csv(&super::plants(&outcome), &mut plants).unwrap();
        write_csv(&super::weeds(&outcome), &mut weeds).unwrap();
        let plants = String::from_utf8(plants).unwrap();
        assert_eq!(plants.lines().count(), 3);
        assert!(plants.lines().nth(1).unwrap().starts_with("500.0,150.0,"), "{plants}");
        assert_eq!(String::from_utf8(weeds).unwrap(), "position_mm,width_mm,cut\n750.0,15.0,true\n");
    }
}
